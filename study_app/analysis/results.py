"""The results of an evaluation as frozen dataclasses, and their texts in reports.

Numbers are never NaN or infinite; a value that does not exist is None.
"""

import re
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, TypeVar

from study_app.analysis.data.blocks import Block, Decided, Item, Kind, OwnDynamics, Setting
from study_app.analysis.data.motion import Performance
from study_app.analysis.statistics.effect_sizes import EffectSize
from study_app.analysis.statistics.equivalence import STEPS, Equivalence
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.wording import listed, ms, number, percent, significant
from study_app.discovery import explain_error
from study_app.errors import PlugInError
from study_app.protocol.model import Contrast, Published
from study_app.protocol.orders import Evenness
from study_app.protocol.participants import fewest_participants, smallest_minority
from study_app.protocol.trials import DESIGN_KINDS


@dataclass(frozen=True, slots=True)
class NotTested:
    """A missing result and the reason: only while the key is sealed, or permanently."""

    what: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivered:
    """The differences between delivered and requested delays in one setting, in ms over trials.

    For ``judged`` trials it is known whether they met the protocol's limits; ``valid`` ones did.
    """

    block: str
    code: str | None
    delay_ms: float | None
    trials: int
    measured: int
    judged: int
    valid: int
    error_mean_ms: float | None
    error_worst_ms: float | None
    achieved_ms: float | None


_T = TypeVar("_T")
_U = TypeVar("_U")
Progress: TypeAlias = Callable[[str, float], object]
"""Called with the current activity and the proportion done (0 to 1); if it raises an exception, the evaluation ends."""


def report_no_progress(_what: str, _share: float) -> None:
    """Report nothing; the default progress function."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A part of the results (``what``) that could not be computed: the error and its location in the program."""

    what: str
    error: str
    where: str
    block: str | None = None

    @property
    def why(self) -> str:
        """The text that replaces the part in a report."""
        if not self.where:
            return f"the computation failed: {self.error}"
        return f"the computation failed ({self.error}; {self.where}); this is a fault in the program: please report it"

    def __str__(self) -> str:
        return f"{self.what}{f' of block {self.block}' if self.block else ''}: {self.why}"


class Ended(BaseException):
    """Ends the evaluation with an exception of the progress function.

    It is a BaseException, so that the part that called the function is not recorded as failed.
    """

    def __init__(self, error: BaseException) -> None:
        super().__init__(str(error))
        self.error = error


class Failures:
    """Collects the failures of one report."""

    def __init__(self, found: Iterable[Failure] = ()) -> None:
        self.found = list(found)

    def attempt(self, what: str, compute: Callable[[], _T], *, block: str | None = None) -> _T | Failure:
        """Return the result of ``compute``, or the failure, which is recorded."""
        try:
            return compute()
        except Exception as error:  # noqa: BLE001 - a failing part must not prevent the report
            last = traceback.extract_tb(error.__traceback__)[-1]
            message, where = f"{type(error).__name__}: {error}", f"{Path(last.filename).name}, line {last.lineno}"
            if isinstance(explained := explain_error(error), PlugInError):
                message, where = str(explained), ""
            failure = Failure(what=what, error=message, where=where, block=block)
            self.found.append(failure)
            return failure

    def value(self, what: str, compute: Callable[[], _T], empty: _U) -> _T | _U:
        """Return the result of ``compute``, or ``empty`` if it fails."""
        computed = self.attempt(what, compute)
        return empty if isinstance(computed, Failure) else computed


Verdict: TypeAlias = Literal["shown", "suggested", "not shown", "out of reach", "not tested"]
"""The conclusion of a test: ``shown`` (primary), ``suggested`` (exploratory), ``not shown``, ``out of reach`` (so few
participants could not show an effect) or ``not tested``. None of them is evidence that there is no effect."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tested:
    """A test of one statement within its family of ``members``, with p adjusted by ``correction``."""

    item: str
    outcome: Outcome
    family: str
    members: int
    correction: str
    p_adjusted: float | None
    primary: bool
    verdict: Verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockResult:
    """The results of one block.

    ``settings`` are in order, ``delays_ms`` are their delays if the block compares delays and they are known.
    ``measures`` has one row per setting and statement. ``findings`` are the tested values by the keys of the
    descriptors in ``analysis.findings``. ``presentations`` are the minimum and maximum number of answers by one
    participant to a statement in one setting; ``replicated_ms`` are delays that several conditions present;
    ``sessions`` are session numbers; ``incomplete`` maps statements to participants with missing answers.
    """

    id: str
    title: str
    kind: Kind
    revealed: bool
    n: int
    settings: tuple[Setting, ...]
    names: tuple[str, ...]
    items: tuple[Item, ...]
    labels: tuple[str, ...]
    measures: tuple[Mapping[str, Any], ...]
    findings: Mapping[str, Any] = field(default_factory=dict)
    absent: tuple[NotTested, ...] = ()
    presentations: tuple[int, int] = (1, 1)
    replicated_ms: tuple[float, ...] = ()
    sessions: tuple[int, ...] = (1,)
    incomplete: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def delays_ms(self) -> tuple[float, ...]:
        """The requested delays in order without duplicates; empty if they are unknown or liquids are compared."""
        if self.kind != "delays" or not self.revealed:
            return ()
        return tuple(sorted({setting.delay_ms or 0.0 for setting in self.settings}))


@dataclass(frozen=True, slots=True)
class GroupAnswers:
    """Summary numbers of the answers about one setting, or about all settings if ``code`` is None."""

    code: str | None
    name: str
    numbers: Mapping[str, Any]


_NOT_IN_JSON: Final = {"json": False}
"""Metadata of a field that `report.json` does not contain."""


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionResult:
    """A question after the trials of a block or in a form: ``where`` is the place's id, ``title`` its display name.

    ``measure`` and ``figure`` are the ids of the functions that compute and draw its numbers. ``options`` are the texts
    of possible answers; a question that ``weighs`` only determines the weights of a score.
    """

    where: str
    title: str
    is_form: bool
    item: str
    text: str
    short: str
    kind: str
    measure: str
    figure: str | None
    groups: tuple[GroupAnswers, ...]
    options: Mapping[str, str] = field(default_factory=dict, metadata=_NOT_IN_JSON)
    weighs: bool = field(default=False, metadata=_NOT_IN_JSON)

    @property
    def n(self) -> int:
        """The number of answers."""
        return sum(int(group.numbers["n"]) for group in self.groups)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoreResult:
    """A score of a questionnaire: number, mean, standard deviation and range of its values, by setting."""

    where: str
    title: str
    name: str
    instrument: str | None
    source: str | None
    groups: tuple[GroupAnswers, ...]


Summary: TypeAlias = Literal["share", "mean", "geometric mean", "settings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelsResult:
    """The result of a block of levels.

    ``summary`` is the kind of summary of the answers at a level, ``counts`` the counted answers of a proportion
    ("correct"); ``vary`` is the varied number, ``quantity`` its display name, ``unit`` its unit, ``level_kind`` the
    kind of level (weber, difference, value), all None if conditions are compared; ``guess_rate`` is the proportion at
    chance, ``bounds`` are the ends of a scale; with ``own_units`` each participant chose the unit of the estimates,
    which group intervals leave out; ``statistics`` are the rows of each statistic in `analysis.levels` by its key;
    ``family`` is the family of psychometric functions; ``adaptive`` means that answers chose the levels; ``device`` are
    the device's own dynamics, None if they were not measured. Without the key only ``times`` are known.
    """

    block: str
    title: str
    design: str
    revealed: bool
    times: tuple[GroupAnswers, ...]
    summary: Summary
    counts: str
    vary: str | None = None
    quantity: str | None = None
    unit: str | None = None
    level_kind: str | None = None
    spacing: str = "linear"
    guess_rate: float | None = None
    bounds: tuple[float, float] | None = None
    own_units: bool = False
    statistics: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    family: str | None = None
    adaptive: bool = False
    published: tuple[Published, ...] = ()
    device: OwnDynamics | None = None

    @property
    def has_pse(self) -> bool:
        """Whether thresholds are points of subjective equality (see `Stimulus.has_pse`)."""
        if self.level_kind != "value":
            return False
        design = DESIGN_KINDS[self.design]
        return design.has_standard and design.asks_for_more


@dataclass(frozen=True, slots=True, kw_only=True)
class ContrastSide:
    """One side of a hypothesis: the value of each participant, and their mean with its interval.

    The mean is that of the test: of logarithms for a ratio, with the weights of the group means. ``sd`` is the standard
    deviation between participants and ``standard_error`` that of the mean, of logarithms for a ratio.
    """

    name: str
    values: Mapping[str, float]
    mean: float | None
    low: float | None
    high: float | None
    sd: float | None
    standard_error: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ContrastResult(Outcome):
    """The test of the ``compared`` quantity; the effect is first ÷ second with ``ratio``, otherwise first − second.

    ``n`` participants are compared; ``left_out`` are the others with the reasons. ``higher`` is the number of
    participants with a higher value on the first side; None between groups. ``p_bootstrap`` and ``p_skewed`` (t
    corrected for skewness) must also show the difference. ``equivalent`` is whether the effect is shown to lie
    within the study's bound, by ``p_equivalent``, which is corrected over the hypotheses with a bound; None without a
    bound. ``not_excluded`` is then the upper limit of the 95 % interval of the proportion of participants that differ
    by more. ``sides`` are the numbers of those compared, ``sd`` is the standard deviation of the differences within
    participants; ``standardised`` is d_z or g, ``ordinal`` is Cliff's delta of answers to a statement, and
    ``bayes_factor`` the ratio of the likelihoods with and without a difference. ``within_names`` are the names of the
    blocks or conditions of an interaction, ``cells`` the numbers of each group under each of them, group by group,
    ``measure_name`` is the measure in words, and ``block_title`` is that of the first block. ``standard_error`` is that
    of the mean difference, of logarithms for a ratio, and ``freedom`` are the degrees of freedom of t. ``largest`` is
    the largest possible difference in agreement with a statement, ``scale`` the ends of the scale of another question
    or score; None for other measures. ``fewest`` is the number of participants, for groups of each group, without
    whom equivalence within the study's bound is out of reach.
    """

    contrast: Contrast
    compared: tuple[str, str]
    ratio: bool
    p_adjusted: float | None
    members: int
    verdict: Verdict | Literal["equivalent"]
    equivalent: bool | None
    p_bootstrap: float | None
    p_skewed: float | None
    p_equivalent: float | None
    not_excluded: float | None
    higher: int | None
    left_out: Mapping[str, str]
    sides: tuple[ContrastSide, ...] = ()
    sd: float | None = None
    standardised: EffectSize | None = None
    ordinal: EffectSize | None = None
    bayes_factor: float | None = None
    within_names: tuple[str, str] | None = None
    cells: tuple[ContrastSide, ...] = ()
    measure_name: str = ""
    block_title: str = ""
    standard_error: float | None = None
    freedom: int | None = None
    largest: float | None = None
    scale: tuple[float, float] | None = None
    fewest: int | None = None

    @property
    def is_too_small(self) -> bool:
        """Whether the sample, or the smaller group, is too small to show equivalence within the study's bound."""
        sizes = [self.n] if self.contrast.groups is None else [len(side.values) for side in self.sides]
        return self.fewest is not None and min(sizes) < self.fewest

    @property
    def comparison(self) -> str:
        """The direction of the effect: "A − B", or "A ÷ B" for a ratio."""
        return f" {'÷' if self.ratio else '−'} ".join(self.compared)

    @property
    def differences(self) -> dict[str, float]:
        """The difference or ratio of each participant; empty between groups."""
        if self.contrast.groups is not None or not self.sides:
            return {}
        first, second = (side.values for side in self.sides)
        return {who: first[who] / second[who] if self.ratio else first[who] - second[who] for who in first}

    @property
    def effect_text(self) -> str:
        """The compared quantity as text, with the titles that participants or operators see."""
        return self.contrast.effect_text(self.within_names, self.measure_name, self.block_title)

    @property
    def hypothesis(self) -> str:
        """The hypothesis as a sentence."""
        return self.contrast.described(self.compared, self.within_names, self.measure_name, self.block_title)

    @property
    def largest_p(self) -> float | None:
        """The largest uncorrected p, because all tests must show a difference; None if nothing was tested."""
        return max((p for p in (self.p, self.p_bootstrap, self.p_skewed) if p is not None), default=None)


@dataclass(frozen=True, slots=True)
class Results:
    """All results of a study; ``failures`` are the parts that could not be computed.

    ``questions`` and ``scores`` are the answers to questions other than statements, ``levels`` the blocks of levels,
    ``contrasts`` the study's hypotheses, ``block_orders`` the balance of block orders that differ between participants;
    JSON omits them if they are empty. ``unrated_blocks`` are the blocks with
    neither statements nor a design, which have only settings.
    """

    decided: Decided
    people: tuple[str, ...]
    blocks: tuple[BlockResult, ...]
    delivered: tuple[Delivered, ...]
    orders: Mapping[str, Evenness]
    performance: Performance | None
    seed: int
    failures: tuple[Failure, ...] = ()
    questions: tuple[QuestionResult, ...] = ()
    scores: tuple[ScoreResult, ...] = ()
    levels: tuple[LevelsResult, ...] = ()
    contrasts: tuple[ContrastResult, ...] = ()
    block_orders: Evenness | None = None
    unrated_blocks: tuple[BlockResult, ...] = field(default=(), metadata=_NOT_IN_JSON)

    @property
    def trial_blocks(self) -> tuple[BlockResult, ...]:
        """The main blocks without a design: those with statements, then the others."""
        return (*self.blocks, *self.unrated_blocks)


SEALED: Final = "computed only after unblinding, because the codes do not show which condition is which"
"""The reason for results that are missing because the key is sealed."""

BADGES: Final = {
    "shown": "significant",
    "suggested": "significant, exploratory",
    "not shown": "not significant",
    "out of reach": "too few participants",
}
"""The names of verdicts on the first page and in the table of hypotheses."""

VERDICTS_MEAN: Final = (
    "Shown (“significant” on the first page): the adjusted p value is at most {alpha}. Suggested (“significant, "
    "exploratory”): the adjusted p value is at most {alpha}, but the statement was not specified as primary before the "
    "study; this is a lead, not a finding. Not shown (“not significant”): the adjusted p value is above {alpha}, which "
    "is not evidence that the answers are the same. Out of reach (“too few participants”): no rearrangement of these "
    "answers within participants could have made the adjusted p value significant, given the other p values in the "
    "family. A statement's adjusted p value is never below the p value of the test over all statements, which is "
    "Holm-adjusted across the blocks of the study."
)


def beyond_phrase(tested: Equivalence) -> str:
    """Return the number of participants who differ by more than the bound, with the interval of their proportion."""
    if tested.beyond is None:
        return "–"
    ends = tested.beyond.interval
    return f"{tested.beyond.count} of {tested.beyond.n} [{100 * ends.low:.0f}, {100 * ends.high:.0f}] %"


def settings_noun(block: BlockResult | Block) -> str:
    """Return the noun for a block's settings: "liquid", "delay" or "view"; "condition" while the key is sealed."""
    return block.kind.removesuffix("s") if block.revealed else "condition"


def short_text(result: BlockResult, item: str) -> str:
    """Return the short text of a statement."""
    return next(statement.short for statement in result.items if statement.id == item)


def name(result: BlockResult, code: str) -> str:
    """Return the name of a setting; in a block of delays, which has only one liquid, the delay.

    The condition's ID follows a delay that several conditions have.
    """
    for setting, text in zip(result.settings, result.names, strict=True):
        if setting.code == code:
            if not result.delays_ms:
                return text
            delay_ms = setting.delay_ms or 0.0
            return f"{ms(delay_ms)} ({setting.condition})" if delay_ms in result.replicated_ms else ms(delay_ms)
    raise KeyError(code)


def lead_phrase(result: BlockResult) -> str:
    """Return the introductory phrase of sentences about a block."""
    return f"{result.title} ({settings_noun(result)}s)" if result.revealed else result.title


def statistic(outcome: Outcome) -> str:
    """Return a statistic as text: its symbol and value."""
    return f"{statistic_symbol(outcome)} {number(outcome.statistic)}"


def statistic_symbol(outcome: Outcome) -> str:
    """Return the symbol of a statistic: "χ²"."""
    return outcome.statistic_name.replace("chi2", "χ²")


def presentation_sentences(result: BlockResult) -> tuple[str, ...]:
    """Return sentences on repeated presentations and sessions; empty if there is one of each."""
    fewest, most = result.presentations
    lines = []
    if result.replicated_ms:
        delays = listed([ms(delay) for delay in result.replicated_ms])
        lines.append(
            f"Several conditions have a delay of {delays}; they are treated as repeated presentations of one delay."
        )
    if most > 1:
        often = _times_text(fewest, most)
        has_threshold = result.findings.get("threshold") is not None
        single = "; the detection threshold is estimated from all individual answers" if has_threshold else ""
        lines.append(
            f"Each participant rated each {settings_noun(result)} {often}. The tests use the median of these "
            f"answers{single}."
        )
    if len(result.sessions) > 1:
        lines.append(
            f"The answers from sessions {listed(list(map(str, result.sessions)))} are compared with each other, and "
            "are pooled in all other tests."
        )
    return tuple(lines)


def _times_text(fewest: int, most: int) -> str:
    """Return "twice", "once or twice", "1 to 3 times"."""
    if most == 2:
        return "twice" if fewest == most else "once or twice"
    return f"{most} times" if fewest == most else f"{fewest} to {most} times"


def min_sample(alpha: float, bound: float) -> str:
    """Return the minimum number of participants for equivalence of statements."""
    return f"at least {fewest_participants(alpha, bound, STEPS)} participants"


def min_sample_reason(alpha: float, bound: float) -> str:
    """Return a sentence on the minimum number of participants for equivalence of statements, and its reason."""
    proportion = smallest_minority(bound, STEPS)
    return (
        f"{min_sample(alpha, bound)}. A smaller sample has more than a {percent(alpha)} chance of including nobody "
        f"from a minority of {percent(proportion)} of the population; if the answers of such a minority differ by "
        f"{significant(bound / proportion)} points, they shift the mean by as much as the bound"
    )


def test_name(outcome: Outcome) -> str:
    """Return the name of a test within a sentence."""
    return {
        "Friedman": "Friedman's test",
        "Wilcoxon signed ranks": "Wilcoxon's signed-rank test",
        "trend over participants": "sign-flip permutation test on the participants' rank correlations",
        "t test of slopes": "Student's t test on the participants' slopes",
        "t test of differences": "Student's t test on the participants' differences",
    }.get(outcome.test, outcome.test)


def method_text(methods: Iterable[str]) -> str:
    """Return the methods of several tests as text; opposite directions become "in the direction stated for each"."""
    several = dict.fromkeys(methods)
    if len(several) > 1:
        stated = "one-sided in the direction stated for each statement"
        several = dict.fromkeys(re.sub(r"one-sided \((?:in|de)creasing\)", stated, method) for method in several)
    return "; ".join(several)


def incomplete_answers_sentence(result: BlockResult) -> str:
    """Return a sentence on participants excluded from tests over all settings."""
    statements: dict[str, list[str]] = {}
    for item, participants in result.incomplete.items():
        for participant in participants:
            statements.setdefault(participant, []).append(f"“{short_text(result, item)}”")
    statement_count = len(result.items)
    excluded = [
        f"{participant} ({'all statements' if len(items) == statement_count else listed(items)})"
        for participant, items in sorted(statements.items())
    ]
    return (
        f"Participants excluded from tests across all {settings_noun(result)}s because an answer is missing: "
        f"{listed(excluded)}."
    )


def missing_sentences(result: BlockResult) -> tuple[str, ...]:
    """Return sentences on the results that were not computed, one for each reason."""
    reasons: dict[str, list[str]] = {}
    for not_tested in result.absent:
        reasons.setdefault(not_tested.why, []).append(not_tested.what)
    return tuple(
        f"{listed([f'the {part}' for part in parts])} {'was' if len(parts) == 1 else 'were'} not computed because "
        f"{why}."
        if why != SEALED
        else f"{listed([f'the {part}' for part in parts])} {'is' if len(parts) == 1 else 'are'} {why}."
        for why, parts in reasons.items()
    )
