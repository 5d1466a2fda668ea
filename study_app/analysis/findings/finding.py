"""The base class of findings, and what all tests of a block's answers share: families, verdicts, rows of tests.csv."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Final, Generic, TypeAlias, TypeVar, cast

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import KINDS, Block, Decided, Kind, setting_name
from study_app.analysis.data.measures import Array, medians, presentations
from study_app.analysis.data.study_tables import Study
from study_app.analysis.html_page import drawn_figure
from study_app.analysis.page_layout import Drawing, Picture
from study_app.analysis.results import BlockResult, Failure, Failures, NotTested, Results, Tested, Verdict
from study_app.analysis.statistics.outcome import DRAWS, Outcome, draws_for, false_discovery, holm
from study_app.analysis.statistics.rank_tests import DRAWN_UP_TO
from study_app.errors import StudyError
from study_app.store.files import Column, optional

_T = TypeVar("_T")
_U = TypeVar("_U")

MANY: Final = DRAWN_UP_TO
"""The most participants with an exact or permutation p of single statements; for more, p is approximated."""

_FEWER_DRAWS: Final = 1999
"""Permutations in the test over all statements above ``MANY`` participants; it has no approximation."""


@dataclass(frozen=True, kw_only=True)
class BlockAnswers:
    """A block's answers as arrays, with settings in order; missing answers are NaN.

    ``values`` (participants, settings) are the medians of ``single`` answers (participants, settings, presentations);
    ``sessions`` of the same shape are the sessions of these answers. ``sites`` are those of the participants of a
    merged study. ``verdicts_only`` omits results that do not affect verdicts, for thousands of simulated studies.
    ``over_all`` is the global test over all statements, or its failure, ``gate`` its p value with Holm's correction
    over the blocks of the study. No adjusted p of a statement is below it, so that the probability of any finding is at
    most alpha in a study without any difference.
    """

    block: Block
    decided: Decided
    people: tuple[str, ...]
    values: Mapping[str, Array]
    seed: int
    failures: Failures
    single: Mapping[str, Array]
    sessions: Mapping[str, Array]
    verdicts_only: bool = False
    over_all: Outcome | Failure | None = None
    gate: float = 0.0

    @property
    def n(self) -> int:
        """The number of participants with any answer."""
        return len(self.people)

    @property
    def k(self) -> int:
        """The number of settings, where conditions with the same delay count as one."""
        return len(set(self.block.columns.values()))

    @property
    def intervals(self) -> int | None:
        """The seed of bootstrap intervals; None omits them."""
        return None if self.verdicts_only else self.seed

    @property
    def draws(self) -> int:
        """The number of random permutations for one statement if full enumeration is too expensive.

        It is large enough that it never prevents a significant result.
        """
        return draws_for(self.decided.alpha, DRAWS, len(self.block.items))

    def verdict(self, p: float | None, least: float | None, *, primary: bool) -> Verdict:
        """Return the verdict on a test of one statement (see `verdict`), which the gate can only weaken."""
        smallest = self.over_all.smallest_p if isinstance(self.over_all, Outcome) else None
        lower_bound = None if least is None else max(least, smallest or 0.0)
        return verdict(None if p is None else max(p, self.gate), lower_bound, self.decided.alpha, primary=primary)

    @property
    def draws_over_all(self) -> int:
        """The number of random permutations for the global test over all statements."""
        return draws_for(self.decided.alpha, DRAWS if self.n <= MANY else _FEWER_DRAWS)


def block_answers(study: Study, block: Block, seed: int, failures: Failures) -> BlockAnswers:
    """Return the valid answers of a block as arrays."""
    answers = study.answers(block)
    people = tuple(sorted(map(str, answers["participant"].unique())))
    by_item = dict(iter(answers.groupby("item", sort=False)))
    empty = answers.iloc[:0]
    tables = {
        item.id: presentations(by_item.get(item.id, empty), people, block.columns, item.id) for item in block.items
    }
    single = {item: answers_ for item, (answers_, _) in tables.items()}
    sessions = {item: numbers for item, (_, numbers) in tables.items()}
    return answers_from_tables(block, study.decided, people, single, sessions, seed=seed, failures=failures)


def answers_from_tables(
    block: Block,
    decided: Decided,
    people: tuple[str, ...],
    single: Mapping[str, Array],
    sessions: Mapping[str, Array] | None = None,
    *,
    seed: int = 1,
    failures: Failures | None = None,
    verdicts_only: bool = False,
) -> BlockAnswers:
    """Return a block's answers from tables of single answers (participants, settings, presentations) of each item.

    Without ``sessions``, arrays of the same shape, all answers are from one session.
    """
    return BlockAnswers(
        block=block,
        decided=decided,
        people=people,
        values={item: medians(answers) for item, answers in single.items()},
        seed=seed,
        failures=Failures() if failures is None else failures,
        single=single,
        sessions={item: np.ones_like(answers) for item, answers in single.items()} if sessions is None else sessions,
        verdicts_only=verdicts_only,
    )


def summarize_block(study: Study | None, answers: BlockAnswers) -> BlockResult:
    """Return a block without findings: settings, statements and counts; without a study, no measures."""
    block = answers.block
    columns = list(block.columns.values())
    delays = enumerate(block.delays_ms) if block.kind == "delays" and block.revealed else ()
    sessions = np.concatenate([numbers[~np.isnan(numbers)] for numbers in answers.sessions.values()] or [np.zeros(0)])
    return replace(
        empty_result(block),
        n=answers.n,
        measures=tuple(
            {str(name): None if pd.isna(value) else value for name, value in row.items()}
            for row in ([] if study is None else study.aggregate(block).to_dict("records"))
        ),
        presentations=_presentation_range(answers.single.values()),
        replicated_ms=tuple(delay for place, delay in delays if columns.count(place) > 1),
        sessions=tuple(sorted({int(number) for number in sessions})),
        incomplete={
            item: people
            for item, values in answers.values.items()
            if not (study is not None and study.has_unmatched_sites)
            and (people := tuple(np.array(answers.people)[np.isnan(values).any(axis=1)].tolist()))
        },
    )


def empty_result(block: Block, *absent: NotTested) -> BlockResult:
    """Return an empty result for a block."""
    return BlockResult(
        id=block.id,
        title=block.title,
        kind=block.kind,
        revealed=block.revealed,
        n=0,
        settings=block.settings,
        names=tuple(block.name(setting) for setting in block.settings),
        items=block.items,
        labels=block.labels,
        measures=(),
        absent=absent,
    )


def unrated_results(blocks: Sequence[Block]) -> Iterator[BlockResult]:
    """Yield empty results for blocks without statements, in which names distinguish the settings of all blocks."""
    settings = list({setting.condition: setting for block in blocks for setting in block.settings}.values())
    for block in blocks:
        result = empty_result(block)
        if block.revealed:
            result = replace(result, names=tuple(setting_name(setting, settings) for setting in block.settings))
        yield result


def _presentation_range(single: Iterable[Array]) -> tuple[int, int]:
    """Return the minimum and maximum number of answers by a participant to one statement in one condition."""
    counts = np.concatenate([(~np.isnan(values)).sum(axis=2).ravel() for values in single] or [np.zeros(0)])
    positive = counts[counts > 0]
    return (int(positive.min()), int(positive.max())) if len(positive) else (0, 0)


Correct: TypeAlias = Callable[[Sequence[float | None]], tuple[float | None, ...]]

HOLM: Final = "Holm"
FDR: Final = "Benjamini-Hochberg"
ALONE: Final = "none"


def corrected_tests(outcomes: Mapping[str, Outcome], answers: BlockAnswers, family: str) -> tuple[Tested, ...]:
    """Return the tests of statements (item → outcome): primary ones with Holm's correction, the others with FDR."""
    primary = {item: outcome for item, outcome in outcomes.items() if answers.decided.is_primary(item)}
    others = {item: outcome for item, outcome in outcomes.items() if item not in primary}
    verdicts = {
        **{test.item: test for test in in_family(primary, answers, family, holm, HOLM, primary=True)},
        **{
            test.item: test
            for test in in_family(others, answers, f"{family}, exploratory", false_discovery, FDR, primary=False)
        },
    }
    return tuple(verdicts[item] for item in outcomes)


def in_family(
    outcomes: Mapping[str, Outcome],
    answers: BlockAnswers,
    family: str,
    correct: Correct,
    correction: str,
    *,
    primary: bool | Sequence[bool],
) -> tuple[Tested, ...]:
    """Return tests that are corrected together; ``primary`` is one flag for all tests, or one for each."""
    primary_flags = [primary] * len(outcomes) if isinstance(primary, bool) else primary
    ps = [outcome.p for outcome in outcomes.values()]
    members = []
    for place, ((item, outcome), p) in enumerate(zip(outcomes.items(), correct(ps), strict=True)):
        minimum = correct([*ps[:place], outcome.smallest_p, *ps[place + 1 :]])[place]
        test_verdict = answers.verdict(p, minimum, primary=primary_flags[place])
        adjusted = None if p is None else max(p, answers.gate)
        members.append(
            Tested(
                item=item,
                outcome=outcome,
                family=family,
                members=len(ps),
                correction=correction,
                p_adjusted=adjusted,
                primary=primary_flags[place],
                verdict=test_verdict,
            )
        )
    return tuple(members)


def verdict(p: float | None, least: float | None, alpha: float, *, primary: bool) -> Verdict:
    """Return the verdict on a test.

    ``p`` is adjusted. ``least`` is the smallest adjusted p that these participants could have produced, given the other
    tests of the family; None if there is no lower bound.
    """
    if p is None:
        return "not tested"
    if p <= alpha:
        return "shown" if primary else "suggested"
    return "out of reach" if least is not None and least > alpha else "not shown"


TESTS: Final = (
    Column("block", "text", "ID of the block."),
    Column("question", "text", "Question that the test answers."),
    optional("item", "text", "ID of the statement; n/a if the test covers several statements."),
    optional("comparison", "text", "Conditions compared; n/a if the test covers all of them."),
    Column("test", "text", "Name of the test."),
    Column("n", "integer", "Number of participants included.", minimum=0),
    Column("dropped", "integer", "Number of participants excluded because of missing answers.", minimum=0),
    Column("statistic_name", "text", "Name of the test statistic."),
    optional("statistic", "number", "Value of the test statistic."),
    optional("p", "number", "Uncorrected p value.", minimum=0, maximum=1),
    optional("p_adjusted", "number", "p value corrected within the family.", minimum=0, maximum=1),
    optional("smallest_p", "number", "Smallest p value attainable with these data.", minimum=0, maximum=1),
    optional("family", "text", "Name of the family of tests that are corrected together."),
    optional("members", "integer", "Number of tests in the family.", minimum=1),
    optional("correction", "text", "Method used to correct the p value."),
    optional("primary", "flag", "true if the test was planned before the study."),
    optional("verdict", "text", "Outcome of the test."),
    Column("effect_name", "text", "Name of the effect size."),
    optional("effect", "number", "Value of the effect size."),
    optional("low", "number", "Lower end of the effect's confidence interval."),
    optional("high", "number", "Upper end of the effect's confidence interval."),
    optional("level", "number", "Confidence level of the interval."),
    optional("interval", "text", "Method used for the interval, or the reason why there is none."),
    Column("method", "text", "How the p value was calculated."),
    optional("note", "text", "Notes on the result."),
    Column(
        "codes",
        "text",
        "Codes of the conditions compared, in order and separated by spaces; conditions with the same delay are "
        "joined with +.",
    ),
)


def test_row(result: BlockResult, question: str, outcome: Outcome) -> dict[str, Any]:
    """Return the row of a test that answers a question about a block; its family and verdict are empty."""
    interval = outcome.interval
    blank = {column.name: None for column in TESTS}
    return blank | {
        "block": result.id,
        "question": question,
        **{
            field: getattr(outcome, field)
            for field in (
                *("test", "n", "dropped", "statistic_name", "statistic", "p", "smallest_p", "method"),
                *("effect_name", "effect"),
            )
        },
        "low": None if interval is None else interval.low,
        "high": None if interval is None else interval.high,
        "level": None if interval is None else interval.level,
        "interval": outcome.no_interval or None if interval is None else interval.method,
        "note": outcome.note or None,
        "codes": codes_of(result),
    }


def codes_of(result: BlockResult, *delays_ms: float) -> str:
    """Return the codes of a block's settings, or of these delays, in order; codes with the same delay are joined."""
    if not result.delays_ms:
        return " ".join(setting.code for setting in result.settings)
    return " ".join(
        "+".join(setting.code for setting in result.settings if (setting.delay_ms or 0.0) == delay_ms)
        for delay_ms in delays_ms or result.delays_ms
    )


def verdict_row(result: BlockResult, question: str, test: Tested) -> dict[str, Any]:
    """Return the row of a test of one statement, with its family and verdict."""
    return test_row(result, question, test.outcome) | {
        "item": test.item,
        "family": test.family,
        "members": test.members,
        "correction": test.correction,
        "p_adjusted": test.p_adjusted,
        "primary": test.primary,
        "verdict": test.verdict,
    }


def uncorrected_entries(result: BlockResult, what: str) -> dict[str, Any]:
    """Return the entries about the family in the row of a test that is not corrected with others."""
    return {"family": f"{result.id}: {what}", "members": 1, "correction": ALONE}


NO_EVIDENCE: Final = "This is not evidence that there is no difference."
FOUND: Final = ("shown", "suggested")


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """A row of the first page: the verdict on one question (a finding's key) about one block (its id), as text.

    ``claims`` is whether it claims that conditions differ or that a delay is noticed, which would be false in a
    study without any difference.
    """

    question: str
    block: str
    title: str
    verdict: str
    text: str
    claims: bool = False


_R = TypeVar("_R")
Absent: TypeAlias = tuple[NotTested, ...]
Row: TypeAlias = dict[str, Any]


class Finding(Generic[_R]):
    """A finding of the analysis; an instance provides its parts of all outputs for one block.

    All outputs include every subclass with a ``key`` in the modules of this folder. A subclass overrides the methods of
    the outputs that it adds to; by default, these return nothing. ``_R`` is the type of its value.

    Attributes
    ----------
    key : str
        Its name in `BlockResult.findings`, in report.json and among the answers of the first page.
    place : float
        Its place among the others in the report's section of a block, in texts and in report.json.
    row_place : float
        Its place in tests.csv.
    what : str
        Its name if it fails or is missing; empty if nothing is tested, so that there is no value.
    kinds, sealed, waits : tuple of str
        The kinds of blocks in which it is tested once the key is open, in which it is tested while the key is sealed,
        and in which it is listed as missing until the key is open.
    compares_settings : bool
        Whether the test needs codes that mean the same for all participants.
    statements : bool
        Whether the value consists of tests of single statements whose verdicts the study's limitations mention.
    empty : _R
        The value if nothing was tested.
    figure_name, figure_title : str
        File name and title of its figure; empty if it has none.
    question : str
        The question of the first page that it answers ("{kind}": the compared kind); empty if it answers none.
    answer_figures : tuple of str
        The names of figures that may be shown next to the answer; the first one that was drawn is used.
    """

    key: ClassVar[str]
    place: ClassVar[float] = 50
    row_place: ClassVar[float] = 100
    what: ClassVar[str] = ""
    kinds: ClassVar[tuple[Kind, ...]] = KINDS
    sealed: ClassVar[tuple[Kind, ...]] = ()
    waits: ClassVar[tuple[Kind, ...]] = ()
    compares_settings: ClassVar[bool] = True
    statements: ClassVar[bool] = False
    empty: ClassVar[Any] = None
    figure_name: ClassVar[str] = ""
    figure_title: ClassVar[str] = ""
    question: ClassVar[str] = ""
    answer_figures: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        for name in ("place", "row_place"):
            if not isinstance(value := getattr(cls, name), int | float):
                raise StudyError(f"{cls.__name__} has the {name} {value!r}: specify a number")

    def __init__(self, result: BlockResult, results: Results, pictures: Mapping[str, Picture] | None = None) -> None:
        self.result = result
        self.results = results
        self.value = self.value_in(result)
        self._pictures = pictures or {}

    @classmethod
    def value_in(cls, result: BlockResult) -> _R:
        """Return the finding's value in a block's result."""
        return cast("_R", result.findings.get(cls.key, cls.empty))

    @classmethod
    def add_to(cls, result: BlockResult, value: _R) -> BlockResult:
        """Return a block's result with this value added."""
        return replace(result, findings={**result.findings, cls.key: value})

    @classmethod
    def test(cls, answers: BlockAnswers, result: BlockResult) -> tuple[_R, Absent]:
        """Compute the value from a block's answers and the findings with lower places; return it and untested parts."""
        raise NotImplementedError

    @classmethod
    def entries(cls, result: BlockResult) -> Mapping[str, Any]:
        """Return the entries of report.json."""
        return {cls.key: cls.value_in(result)}

    @classmethod
    def common_methods(cls, blocks: Sequence[BlockResult]) -> Iterable[str]:
        """Return the sentences of the methods paragraph that concern all blocks together."""
        return ()

    def rows(self) -> Iterable[Row]:
        """Return the rows of tests.csv."""
        return ()

    def section(self) -> Iterable[str]:
        """Return its part of the block's section in the report as HTML, made with `analysis.html_page`."""
        return ()

    def limits(self) -> Iterable[str]:
        """Return sentences about limitations, such as effects that could not be shown."""
        return ()

    def methods(self) -> Iterable[str]:
        """Return the sentences of the methods paragraph."""
        return ()

    def figure(self, drawing: Drawing) -> Picture | None:
        """Draw its figure; None if it has none."""
        raise NotImplementedError

    def figure_html(self) -> Iterable[str]:
        """Return the HTML of its figure; nothing if it was not drawn."""
        return drawn_figure(self._pictures, self.figure_name)

    def answer(self) -> Answer:
        """Return the answer to its question on the first page, once the key is open; also if nothing was shown."""
        raise NotImplementedError

    def make_answer(self, verdict: str, text: str, *, claims: bool = False) -> Answer:
        """Return an answer to its question for this block."""
        return Answer(
            question=self.key, block=self.result.id, title=self.result.title, verdict=verdict, text=text, claims=claims
        )
