"""The content of a study: blocks, settings, statements, levels, questions, and analysis decisions.

While the key is sealed, only the code of a setting is known. Texts are in English if the study has them in English,
otherwise in its first language.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, Self, TypeAlias, get_args

from study_app.analysis.wording import significant
from study_app.errors import AnalysisError
from study_app.protocol.blocks import Compared, Phase, block_titles, display_language
from study_app.protocol.model import SPENDINGS, Analysis, Contrast, Protocol, Published
from study_app.protocol.participants import RecordedSessions
from study_app.protocol.presented import link_descriptions
from study_app.protocol.questionnaires import Instrument, Score
from study_app.protocol.questions import Context, Question, Scale, Statement, question_of
from study_app.protocol.source import text_in
from study_app.protocol.trials import DELAY, DESIGN_KINDS, OF_LINK, Assumed, Design, Method, Stimulus, default_design
from study_app.store.blinded import Key, complete_protocol

Kind: TypeAlias = Compared

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

_CODE: Final = re.compile(r"([A-Za-z0-9]+-)?[A-Z][0-9]+")
"""A code, which follows the name of the site in merged studies: L1, Utrecht-L1."""
_WORD: Final = re.compile(r"[a-z]{2}")
"""The beginning of a name that is capitalised in tables."""
_DELAY_PREFIX: Final = "D"
"""Delay settings have the codes D1, D2 …, which identify blocks of delays in sealed receipts of earlier versions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """One statement: its id, its text, and a short text for figures."""

    id: str
    text: str
    short: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """The condition presented under a code; all other fields are None until the key is opened.

    ``label`` is the item that names the liquid, if there is one, ``link`` describes a delayed force, ``view`` the
    displayed view (empty for the drawn tank). A track ("8/1") has neither liquid nor delay; ``of`` is the condition of
    which it varies one parameter.
    """

    code: str
    condition: str | None = None
    liquid: str | None = None
    delay_ms: float | None = None
    label: str | None = None
    link: str = ""
    view: str = ""
    of: Self | None = None

    @property
    def standard(self) -> str | None:
        """The standard of a track's comparisons; None for a condition and for a track without a standard."""
        standard, is_track, _ = (self.condition or "").partition("/")
        return standard or None if is_track else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A main block without a design; ``settings`` are in code order or, once known, in condition order.

    ``kind`` is the kind of comparison recorded in the receipt. ``items`` are the statements after each trial.
    ``labels`` are the names of their seven points, lowest first; ``cannot_judge`` is the answer off the scale, or None.
    """

    id: str
    title: str
    kind: Kind
    settings: tuple[Setting, ...]
    items: tuple[Item, ...]
    labels: tuple[str, ...]
    cannot_judge: str | None

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the settings in order."""
        return tuple(setting.code for setting in self.settings)

    @property
    def columns(self) -> dict[str, int]:
        """The column of each code in tables of answers; conditions with the same delay are replicates in one column."""
        if self.kind == "delays" and self.revealed:
            return {setting.code: self.delays_ms.index(setting.delay_ms or 0.0) for setting in self.settings}
        return {code: place for place, code in enumerate(self.codes)}

    @property
    def delays_ms(self) -> tuple[float, ...]:
        """The unique delays of the settings in ascending order; (0,) while they are unknown."""
        return tuple(sorted({setting.delay_ms or 0.0 for setting in self.settings}))

    @property
    def codes_as_dealt(self) -> tuple[str, ...]:
        """The codes in ascending order, independent of conditions."""
        return tuple(sorted(self.codes, key=lambda code: (len(code), code)))

    @property
    def revealed(self) -> bool:
        """Whether the settings' conditions are known."""
        return all(setting.condition is not None for setting in self.settings)

    def name(self, setting: Setting) -> str:
        """Return the name of a setting in figures."""
        return setting_name(setting, self.settings)


def settings_from_key(key: Key) -> dict[tuple[str, str], Setting]:
    """Return the settings that the opened key defines: (block id, code) → setting."""
    return {
        (block, code): _setting_from_key(key, block, code, presented)
        for block, codes in key.codes.items()
        for code, presented in codes.items()
    }


def _setting_from_key(key: Key, block: str, code: str, presented: str) -> Setting:
    """Return the setting of a code: a condition, or a track of a design, such as "8/1"."""
    conditions = key.tables["conditions"]
    if presented in conditions:
        return _setting_of_condition(conditions[presented], code, presented)
    stimulus = key.tables["stimuli"][key.tables["blocks"][block]["stimulus"]]
    name = stimulus["condition"] or next(iter(conditions))
    of = _setting_of_condition(conditions[name], name, name)
    return Setting(code=code, condition=presented, of=replace(of, delay_ms=None) if stimulus["vary"] == DELAY else of)


def _setting_of_condition(condition: Mapping[str, Any], code: str, name: str) -> Setting:
    liquids = " + ".join(condition["liquids"] if condition["liquid"] is None else [condition["liquid"]])
    link = ", ".join(link_descriptions(*(condition.get(key, 0.0) for key in OF_LINK)))
    view = condition.get("view", "tank") + (" alone" if condition.get("overlay") == "hidden" else "")
    view = "" if view == "tank" else view
    return Setting(
        code=code,
        condition=name,
        liquid=liquids,
        delay_ms=float(condition["delay_ms"]),
        label=condition.get("label"),
        link=link,
        view=view,
    )


def main_blocks(protocol: Mapping[str, Any], key: Key | None) -> tuple[Block, ...]:
    """Return the main blocks without a design, in session order, from the protocol in a receipt."""
    blocks = [
        protocol["blocks"][step]
        for step in RecordedSessions.model_validate(protocol).steps
        if step in protocol["blocks"]
    ]
    return tuple(
        _main_block(protocol, block, block_titles(protocol)[block["id"]], key)
        for block in blocks
        if block["phase"] == "main" and "slots" not in block
    )


def _statements(protocol: Mapping[str, Any], block: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the statements of a block's questionnaire, which are the items without a kind."""
    if block["questionnaire"] is None:
        return []
    return [item for item in protocol["questionnaires"][block["questionnaire"]]["items"] if "kind" not in item]


def _main_block(protocol: Mapping[str, Any], block: Mapping[str, Any], title: str, key: Key | None) -> Block:
    language, statements = display_language(protocol), _statements(protocol, block)
    scale: Mapping[str, Any] = {"cannot_judge": None, "labels": {language: ()}}
    if statements:
        scale = protocol["scales"][protocol["questionnaires"][block["questionnaire"]]["scale"]]
    off_scale = scale["cannot_judge"]
    settings = _block_settings(protocol, block["id"], key)
    kind: Kind = block.get("compares") or ("delays" if block["code_prefix"] == _DELAY_PREFIX else "liquids")
    if key is not None:
        kind = _ordered_settings(key, block["id"], block["codes"], block.get("compares"))[1]
    return Block(
        id=block["id"],
        title=title,
        kind=kind,
        settings=settings,
        items=tuple(
            Item(id=item["id"], text=text_in(item["text"], language), short=text_in(item["short"], language))
            for item in statements
        ),
        labels=tuple(scale["labels"][language]),
        cannot_judge=None if off_scale is None else text_in(off_scale, language),
    )


def _block_settings(protocol: Mapping[str, Any], block: str, key: Key | None) -> tuple[Setting, ...]:
    """Return the settings of a block in code order or, once known, in condition order."""
    table = protocol["blocks"][block]
    if key is None:
        return tuple(Setting(code=code) for code in table["codes"])
    return _ordered_settings(key, block, table["codes"], table.get("compares"))[0]


def setting_name(setting: Setting, others: Sequence[Setting]) -> str:
    """Return the name of a setting: its code, or its condition or liquid with view and delay if these differ.

    A setting has the name of its condition, or of its liquid if other settings have the same liquid. The track or the
    condition's ID follows a name that several settings share.
    """
    name, (_, is_track, track) = _name_without_track(setting, others), (setting.condition or "").partition("/")
    if sum(_name_without_track(other, others) == name for other in others) < 2:
        return name
    return f"{name}, track {track}" if is_track else f"{name} ({setting.condition})"


def name_in_sentence(name: str) -> str:
    """Return a setting's name as it is written within a sentence: "water", but the code "L1" unchanged."""
    return name if _CODE.fullmatch(name) else name[:1].lower() + name[1:]


def _name_of_id(name: str) -> str:
    """Return an ID as a name in tables: "Light oil", but "a" and "l1", which are not words, unchanged."""
    words = name.replace("_", " ")
    return words[:1].upper() + words[1:] if _WORD.match(words) else words


def _name_without_track(setting: Setting, others: Sequence[Setting]) -> str:
    if setting.liquid is None or setting.delay_ms is None:
        return setting.code if setting.standard is None else f"Standard {setting.standard}"
    is_shared = sum(other.liquid == setting.liquid for other in others) > 1
    name = _name_of_id(setting.liquid if is_shared or setting.condition is None else setting.condition)
    name = f"{name}, {setting.view or 'tank'}" if len({other.view for other in others}) > 1 else name
    name = f"{name}, {setting.delay_ms:g} ms" if len({other.delay_ms for other in others}) > 1 else name
    return f"{name}, {setting.link}" if setting.link else name


def _ordered_settings(
    key: Key, block: str, codes: Sequence[str], kind: Kind | None
) -> tuple[tuple[Setting, ...], Kind]:
    """Return the settings by name: delays in ascending order, others in the protocol's order.

    Without ``kind``, as in receipts of earlier versions, one liquid with several delays is a block of delays.
    """
    known = settings_from_key(key)
    settings = [known[block, code] for code in codes]
    if kind is None:
        delays = {setting.delay_ms for setting in settings}
        kind = "delays" if len(delays) > 1 and len({setting.liquid for setting in settings}) == 1 else "liquids"
    if kind == "delays":
        return tuple(sorted(settings, key=lambda setting: setting.delay_ms or 0.0)), "delays"
    order = list(key.tables["conditions"])
    if any(setting.condition not in order for setting in settings):  # tracks, by their standards
        return tuple(
            sorted(settings, key=lambda setting: float((setting.condition or "").partition("/")[0] or 0))
        ), "liquids"
    return tuple(sorted(settings, key=lambda setting: order.index(setting.condition))), kind


def published_text(published: Published, unit: str | None) -> str:
    """Return a published value and how it was measured, as text; ``unit`` is that of the varied parameter."""
    details = [
        *([] if published.standard is None else [f"standard {published.standard:g} {unit or ''}".rstrip()]),
        *([] if published.low is None or published.high is None else [f"{published.low:g} to {published.high:g}"]),
        *([] if published.percent is None else [f"at {published.percent:g} % correct"]),
        *([] if published.n is None else [f"n = {published.n}"]),
    ]
    source = f"{published.source}: " if published.source else ""
    return f"{source}{published.value_text(unit or '')}" + (f" ({', '.join(details)})" if details else "")


def compared_percent(published: Iterable[Published]) -> float | None:
    """Return the percentage correct at which published thresholds were measured; None if unknown or not unique."""
    percents = {value.percent for value in published if value.measure in {"weber", "threshold"}}
    return percents.pop() if len(percents) == 1 else None


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnDynamics:
    """The device's own damping [N·s/m], friction [N] and mass [kg], as measured by ``devices bench``.

    They are means over axes and over the ``sessions`` (out of ``of``) whose receipts record them.
    """

    damping_nspm: float
    friction_n: float
    mass_kg: float
    sessions: int
    of: int


@dataclass(frozen=True, slots=True)
class LevelBlock:
    """A block with a design.

    ``stimulus`` is the varied quantity, ``method`` the rule for choosing levels: None for a comparison of conditions
    and while the key is sealed. ``published`` are values from other studies for comparison; ``wrong_most`` is the
    permitted proportion of incorrect catch trials, None without catch trials.
    """

    id: str
    title: str
    phase: Phase
    design: Design
    stimulus: Stimulus | None
    settings: tuple[Setting, ...]
    method: Method | None = None
    published: tuple[Published, ...] = ()
    wrong_most: float | None = None
    reference: Setting | None = None
    """The condition with which the block's others are compared; None with a stimulus or a sealed key."""

    @property
    def has_correct_answer(self) -> bool:
        """Whether an answer can be correct."""
        return self.design.can_be_correct(self.stimulus)

    @property
    def counts(self) -> str:
        """The name of the answers that are counted at a level, for example "correct"."""
        return self.design.success_of(self.stimulus)

    @property
    def standards_rove(self) -> bool:
        """Whether trials of several standards are interleaved."""
        standards = {setting.standard for setting in self.settings}
        return len(standards) > 1 and self.method is not None and self.method.order == "interleaved"

    @property
    def has_pse(self) -> bool:
        """Whether its thresholds are points of subjective equality."""
        return self.stimulus is not None and self.stimulus.has_pse(self.design)

    @property
    def assumed(self) -> Assumed | None:
        """The assumptions about its psychometric function; None if it has no such function, or the key is sealed."""
        if self.stimulus is None or not self.stimulus.rises(self.design):
            return None
        if self.method is None:
            return self.stimulus.assumed(self.design)
        return self.method.assumed(self.stimulus, self.design)


def contrasts_of(key: Key) -> tuple[Contrast, ...]:
    """Return the contrasts in the opened key."""
    return tuple(Contrast.model_validate(table) for table in key.tables.get("analysis", {}).get("contrasts", ()))


def level_blocks(protocol: Mapping[str, Any], key: Key | None) -> tuple[LevelBlock, ...]:
    """Return the blocks with a design from a receipt's protocol, in session order; the key must be open."""
    steps = [
        step for step in RecordedSessions.model_validate(protocol).steps if "slots" in protocol["blocks"].get(step, {})
    ]
    whole = complete_protocol(protocol, key) if key is not None and steps else None
    return tuple(_level_block(protocol, step, key, whole) for step in steps)


def _level_block(protocol: Mapping[str, Any], step: str, key: Key | None, whole: Protocol | None) -> LevelBlock:
    table = protocol["blocks"][step]
    stimulus: Stimulus | None = None
    method: Method | None = None
    published: tuple[Published, ...] = ()
    reference: Setting | None = None
    if whole is not None and key is not None:
        block = whole.blocks[step]
        design = whole.design_of(block)
        if block.stimulus is not None:
            stimulus, method = whole.stimulus_of(block), whole.method_of(block)
        if block.standard is not None:
            reference = _setting_of_condition(key.tables["conditions"][block.standard], block.standard, block.standard)
        if whole.analysis is not None:
            published = tuple(published for published in whole.analysis.published if published.block == step)
    elif (recorded := protocol.get("designs", {}).get(table["design"])) is not None:
        design = DESIGN_KINDS[recorded["kind"]].model_validate(recorded)
    else:
        design = default_design(table["design"])
    title, settings = block_titles(protocol)[step], _block_settings(protocol, step, key)
    return LevelBlock(
        step, title, table["phase"], design, stimulus, settings, method, published,
        (table.get("catch") or {}).get("wrong_most"), reference,
    )  # fmt: skip


_Direction: TypeAlias = Literal["increasing", "decreasing"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Decided:
    """The ``analysis`` table of the protocol.

    ``made`` is False without such a table. ``changed`` is True if the table differs between sessions; this is that of
    the first session. In both cases all findings are exploratory. With planned ``looks``, ``alpha`` applies to look
    number ``look`` (0: before the first look, when findings are also exploratory), and ``planned_alpha`` is the overall
    alpha.
    """

    made: bool
    changed: bool
    alpha: float
    equivalence_bound: float | None
    primary: tuple[str, ...]
    names: tuple[str, ...]
    rising: tuple[str, ...]
    falling: tuple[str, ...]
    noticed: str | None
    looks: tuple[int, ...] = ()
    spending: str = "obrien-fleming"
    look: int | None = None
    planned_alpha: float | None = None
    trends: Literal["ranks", "slopes"] = "ranks"

    @property
    def binding(self) -> bool:
        """Whether it was fixed before the first session and not changed."""
        return self.made and not self.changed and self.look != 0

    @property
    def alphas(self) -> tuple[float, ...]:
        """The significance level at each planned look."""
        from study_app.analysis.statistics.outcome import alpha_of_looks  # noqa: PLC0415 - loads scipy

        alpha = self.planned_alpha or self.alpha
        return alpha_of_looks(self.looks, alpha, self.spending) if self.looks else (alpha,)

    def at(self, n: int) -> Self:
        """Return the decisions that apply at this sample size: those of the last planned look that it reaches."""
        look = sum(planned <= n for planned in self.looks)
        alpha = self.alphas[max(look, 1) - 1]
        return replace(self, alpha=alpha, look=look, planned_alpha=self.alpha) if self.looks else self

    def alpha_text(self) -> str:
        """Return the planned alpha and the alpha that applies at the current look."""
        if self.planned_alpha is None:
            return f"{self.alpha:g}"
        return f"{self.planned_alpha:g} across all looks, {significant(self.alpha)} at this look"

    def look_text(self, n: int) -> str:
        """Return sentences on the planned look at ``n`` participants; empty if no looks are planned.

        An unplanned look is called unplanned, with the error rate of testing after every participant.
        """
        if self.look is None:
            return ""
        planned_looks = f"{' and '.join([', '.join(map(str, self.looks[:-1])), str(self.looks[-1])])} participants"
        if self.look == 0:
            return f"Looks are planned at {planned_looks}. None has been reached yet, so all results are exploratory."
        if n not in self.looks:
            from study_app.analysis.statistics.outcome import error_of_every_report  # noqa: PLC0415 - loads scipy

            alpha = self.planned_alpha or self.alpha
            return (
                f"This look at {n} participants was unplanned; looks are planned at {planned_looks}. Adjusted p values "
                f"of up to {significant(self.alpha)} are treated as significant, as at the last planned look. If there "
                "were no effect and the data were tested in this way after every participant, the false-positive rate "
                f"would be {100 * error_of_every_report(self.looks, alpha, self.spending):.1f} % instead of "
                f"{100 * alpha:g} %."
            )
        return (
            f"This is look {self.look} of {len(self.looks)}, planned at {planned_looks}. Adjusted p values of up to "
            f"{significant(self.alpha)} are significant ({SPENDINGS[self.spending]} alpha spending)."
        )

    def is_primary(self, item: str) -> bool:
        """Whether a statement is a primary outcome of the study."""
        return self.binding and (not self.primary or item in self.primary)

    def direction(self, item: str) -> _Direction | None:
        """Return the expected direction of answers to a statement with increasing delay; None if none is stated."""
        return "increasing" if item in self.rising else "decreasing" if item in self.falling else None


TRENDS: Final = {
    "ranks": "a sign-flip permutation test on the participants' rank correlations between answers and delays",
    "slopes": "Student's t test on the slopes from each participant's regression of answers on delays",
}
"""Descriptions of the tests of a trend over the delay."""

NOTHING_DECIDED: Final = Decided(
    made=False,
    changed=False,
    alpha=0.05,
    equivalence_bound=None,
    primary=(),
    names=(),
    rising=(),
    falling=(),
    noticed=None,
)


def decisions(protocol: Protocol) -> Decided:
    """Return the analysis decisions of a protocol; those of an empty table if it has none."""
    return read_decided([(protocol.analysis or Analysis()).model_dump(mode="json")])


def read_decided(tables: Sequence[Mapping[str, Any] | None]) -> Decided:
    """Return the analysis decisions recorded in the sessions' receipts."""
    first = tables[0]
    changed = any(table != first for table in tables)
    if first is None:
        return replace(NOTHING_DECIDED, changed=changed)
    try:
        bound, noticed = first["equivalence_bound"], first["noticed"]
        return Decided(
            made=True,
            changed=changed,
            alpha=float(first["alpha"]),
            equivalence_bound=None if bound is None else float(bound),
            primary=tuple(map(str, first["primary"])),
            names=tuple(map(str, first["names"])),
            rising=tuple(map(str, first["rising"])),
            falling=tuple(map(str, first["falling"])),
            noticed=None if noticed is None else str(noticed),
            looks=tuple(map(int, first.get("looks", ()))),
            spending=first.get("spending", "obrien-fleming"),
            trends=first.get("trends", "ranks"),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise AnalysisError(
            f"a receipt does not contain the decisions about the analysis ({type(error).__name__}, {error}): it has "
            "been changed, or was written by a different version of the program; restore it from a backup"
        ) from error


START: Final = "0"
"""The code of a form before the first block; no block has this ID."""
OF_SESSION: Final = "__"
"""Between block and session in the code of a form that follows the same block in several sessions."""
AT_THE_START: Final = "At the start"
AFTER: Final = "After "


@dataclass(frozen=True, slots=True)
class QuestionPlace:
    """The place of questions: after the trials of a block, with its ``settings``, or in a form.

    A form that participants complete more than once has one setting for each block that it follows, or for each block
    and session (``by_session``) if it follows the same block in several sessions; other forms have none.
    """

    id: str
    title: str
    is_form: bool
    settings: tuple[Setting, ...]
    by_session: bool = False

    def name(self, setting: Setting) -> str:
        """Return the name of a setting in tables and figures."""
        return setting.label or "" if self.is_form else setting_name(setting, self.settings)


@dataclass(frozen=True, slots=True)
class PlacedQuestion:
    """A question and the place where it is asked."""

    where: QuestionPlace
    question: Question
    context: Context

    @property
    def id(self) -> str:
        """The id of its item."""
        return self.question.id

    @property
    def text(self) -> str:
        """Its full text."""
        return self.context.text(self.question.text)

    @property
    def short(self) -> str:
        """Its short text."""
        return self.context.text(self.question.short)

    @property
    def levels(self) -> dict[str, str]:
        """All possible answers with their texts, if they are few."""
        return self.question.levels(self.context)

    @property
    def bounds(self) -> tuple[float, float] | None:
        """The smallest and the largest possible answer."""
        return self.question.bounds(self.context)

    @property
    def scale_ends(self) -> tuple[float, float] | None:
        """The ends of its answer scale; None for a number that is entered."""
        return None if self.question.kind_id == "number" else self.bounds

    @property
    def unit(self) -> str:
        """The unit of a number that is entered; "" for other answers."""
        return getattr(self.question.view(0, self.context), "unit", "")

    @property
    def cannot_judge(self) -> str | None:
        """The answer off the scale, or None."""
        return getattr(self.question.view(0, self.context), "cannot_judge", None)


@dataclass(frozen=True, slots=True)
class PlacedScore:
    """A score of a questionnaire with its questions."""

    where: QuestionPlace
    name: str
    instrument: str | None
    score: Score
    questions: tuple[PlacedQuestion, ...]

    @property
    def title(self) -> str:
        """Its name after that of its standard questionnaire: "SUS", "NASA-TLX raw"."""
        name = self.name.replace("_", " ")
        if self.instrument is None or self.instrument not in Instrument.names():
            return name
        published = Instrument(self.instrument).published_name
        return published if name.upper() == published else f"{published} {name}"

    @property
    def bounds(self) -> tuple[float, float] | None:
        """The lowest and the highest possible score; None if scores are unlimited."""
        return self.score.range_of({question.id: question.scale_ends for question in self.questions})


@dataclass(frozen=True, slots=True)
class OtherQuestions:
    """The questions of a study other than statements after trials."""

    questions: tuple[PlacedQuestion, ...] = ()
    scores: tuple[PlacedScore, ...] = ()


NO_QUESTIONS: Final = OtherQuestions()


def other_questions(protocol: Mapping[str, Any], key: Key | None) -> OtherQuestions:
    """Return the questions other than statements after trials, in session order, from the protocol in a receipt."""
    if protocol.get("format", 1) < 2:
        return NO_QUESTIONS
    questions: list[PlacedQuestion] = []
    scores: list[PlacedScore] = []
    scales = {name: Scale.model_validate(table) for name, table in protocol["scales"].items()}
    for where, table in _questionnaires(protocol, key):
        context = Context(scales, table.get("scale"), display_language(protocol))
        placed = tuple(PlacedQuestion(where, _read_question(item, where), context) for item in table["items"])
        questions += [question for question in placed if where.is_form or not isinstance(question.question, Statement)]
        scores += [
            PlacedScore(where, name, table.get("instrument"), Score.model_validate(score), placed)
            for name, score in table.get("scores", {}).items()
        ]
    return OtherQuestions(tuple(questions), tuple(scores))


def _questionnaires(protocol: Mapping[str, Any], key: Key | None) -> Iterator[tuple[QuestionPlace, Mapping[str, Any]]]:
    titles, sessions = block_titles(protocol), RecordedSessions.model_validate(protocol)
    for step in sessions.steps:
        if step in protocol["blocks"]:
            block = protocol["blocks"][step]
            if block["phase"] == "main" and block["questionnaire"] is not None:
                where = QuestionPlace(step, titles[step], False, _block_settings(protocol, step, key))
                yield where, protocol["questionnaires"][block["questionnaire"]]
        elif step in protocol["questionnaires"]:
            uses = sessions.form_uses(step) if sessions.is_repeated(step) else ()
            by_session = len({block for block, _ in uses}) < len(uses)
            settings = tuple(_form_setting(block, session if by_session else None, titles) for block, session in uses)
            where = QuestionPlace(step, _form_title(protocol, step), True, settings, by_session)
            yield where, protocol["questionnaires"][step]


def _form_setting(block: str | None, session: int | None, titles: Mapping[str, str]) -> Setting:
    """Return the setting of a repeated form after a block, or at the start of a session."""
    code, label = (START, AT_THE_START) if block is None else (block, f"{AFTER}{titles[block]}")
    if session is not None:
        link = " of" if block is None else ","
        code, label = f"{code}{OF_SESSION}{session}", f"{label}{link} session {session}"
    return Setting(code=code, condition=code, label=label)


def _form_title(protocol: Mapping[str, Any], form: str) -> str:
    """Return the name of a form in reports: that of its standard questionnaire, or the title that participants see."""
    forms = protocol["questionnaires"]
    title, instrument = forms[form]["title"], forms[form].get("instrument")
    name = form.replace("_", " ").capitalize() if title is None else text_in(title, display_language(protocol))
    if instrument not in Instrument.names():
        return name
    is_alone = sum(other.get("instrument") == instrument for other in forms.values()) == 1
    published = Instrument(instrument).published_name
    return published if is_alone else f"{published} ({name})"


def _read_question(table: Mapping[str, Any], where: QuestionPlace) -> Question:
    try:
        return question_of(table)
    except (KeyError, ValueError) as error:
        raise AnalysisError(
            f"question {table.get('id')!r} in {where.id!r} has a type that this version does not support "
            f"({table.get('kind')}): use the version that was used to run the study"
        ) from error
