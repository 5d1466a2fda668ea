"""The questions of a study that no block of statements holds: of other kinds after trials, and all of forms."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from study_app.analysis.tables.compared_blocks import Setting, settings_in, spoken
from study_app.errors import AnalysisError
from study_app.protocol.orders.block_orders import every_step_of
from study_app.protocol.questionnaires import Score
from study_app.protocol.questions import Context, Question, Scale, Statement, question_of
from study_app.protocol.table import text_in
from study_app.store.blinded.blinding import Key


@dataclass(frozen=True, slots=True)
class AskedIn:
    """Where questions were asked: after the trials of a block, with its ``settings``, or in a form, which has none."""

    id: str
    title: str
    is_form: bool
    settings: tuple[Setting, ...]


@dataclass(frozen=True, slots=True)
class AskedQuestion:
    """A question, and where it was asked."""

    where: AskedIn
    question: Question
    context: Context

    @property
    def id(self) -> str:
        """The id of its item."""
        return self.question.id

    @property
    def text(self) -> str:
        """Its words."""
        return self.context.text(self.question.text)

    @property
    def short(self) -> str:
        """A few words for it."""
        return self.context.text(self.question.short)

    @property
    def levels(self) -> dict[str, str]:
        """All answers with their words, where these are few."""
        return self.question.levels(self.context)

    @property
    def bounds(self) -> tuple[float, float] | None:
        """The smallest and the largest number it can be answered with."""
        return self.question.bounds(self.context)

    @property
    def cannot_judge(self) -> str | None:
        """The answer off the scale, or None."""
        return getattr(self.question.view(0, self.context), "cannot_judge", None)


@dataclass(frozen=True, slots=True)
class AskedScore:
    """A score of a questionnaire, with the questions that it is computed of."""

    where: AskedIn
    name: str
    instrument: str | None
    score: Score
    questions: tuple[AskedQuestion, ...]


@dataclass(frozen=True, slots=True)
class AskedQuestions:
    """What a study asked besides statements after trials."""

    questions: tuple[AskedQuestion, ...] = ()
    scores: tuple[AskedScore, ...] = ()


NOTHING_ELSE: Final = AskedQuestions()


def asked_questions(protocol: Mapping[str, Any], key: Key | None) -> AskedQuestions:
    """Read them from a protocol as a receipt holds it, in the order of the session.

    Raises
    ------
    AnalysisError
        A question is of a kind that this version does not know, or not one of its kind.
    """
    if protocol.get("format", 1) < 2:
        return NOTHING_ELSE
    questions: list[AskedQuestion] = []
    scores: list[AskedScore] = []
    scales = {name: Scale.model_validate(table) for name, table in protocol["scales"].items()}
    for where, table in _questionnaires(protocol, key):
        context = Context(scales, table.get("scale"), spoken(protocol))
        found = tuple(AskedQuestion(where, _question(item, where), context) for item in table["items"])
        questions += [one for one in found if where.is_form or not isinstance(one.question, Statement)]
        scores += [
            AskedScore(where, name, table.get("instrument"), Score.model_validate(score), found)
            for name, score in table.get("scores", {}).items()
        ]
    return AskedQuestions(tuple(questions), tuple(scores))


def _questionnaires(protocol: Mapping[str, Any], key: Key | None) -> Iterator[tuple[AskedIn, Mapping[str, Any]]]:
    language = spoken(protocol)
    for step in every_step_of(protocol):
        if step in protocol["blocks"]:
            block = protocol["blocks"][step]
            if block["phase"] == "main" and block["questionnaire"] is not None:
                title = text_in(block["title"], language)
                where = AskedIn(step, title, False, settings_in(protocol, step, key))
                yield where, protocol["questionnaires"][block["questionnaire"]]
        elif step in protocol["questionnaires"]:
            table = protocol["questionnaires"][step]
            titled = table["title"] is not None
            title = text_in(table["title"], language) if titled else step.replace("_", " ").capitalize()
            yield AskedIn(step, title, True, ()), table


def _question(table: Mapping[str, Any], where: AskedIn) -> Question:
    try:
        return question_of(table)
    except (KeyError, ValueError) as error:
        raise AnalysisError(
            f"question {table.get('id')!r} of {where.id!r} is of no kind that this version knows "
            f"({table.get('kind')}): use the version that ran the study"
        ) from error
