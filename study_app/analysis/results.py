"""What an evaluation finds, as frozen values, and how findings are put into words.

Nothing in them is NaN or infinite: what does not exist is None.
"""

import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, TypeVar

from study_app.analysis.data.blocks import Block, Decided, Item, Kind, OwnDynamics, Setting
from study_app.analysis.data.motion import Performance
from study_app.analysis.statistics.effect_sizes import EffectSize
from study_app.analysis.statistics.equivalence import STEPS, Equivalence, fewest, minority
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.wording import listed, ms, number, percent, significant
from study_app.discovery import explained
from study_app.errors import PlugInError
from study_app.protocol.model import Contrast, Published
from study_app.protocol.orders.balance import Evenness


@dataclass(frozen=True, slots=True)
class NotTested:
    """What is not there, and why: while the key is sealed, or for good."""

    what: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivered:
    """How far what was shown under one setting differed from what was asked for; ms, over trials.

    Of ``judged`` trials it is known whether they kept to the protocol's limits of timing; ``valid`` ones did.
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


T = TypeVar("T")
U = TypeVar("U")
Progress: TypeAlias = Callable[[str, float], object]
"""Receives what is being done, and which share of all is done (0 to 1); what it raises ends the evaluation."""


def silent(_what: str, _share: float) -> None:
    """Report nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A part (``what``, of a block or of none) that could not be computed: the error, and where the program met it."""

    what: str
    error: str
    where: str
    block: str | None = None

    @property
    def why(self) -> str:
        """What a report says in the place of the part."""
        if not self.where:
            return f"its computation failed: {self.error}"
        return f"its computation failed ({self.error}; {self.where}); this is a fault of the program, please report it"

    def __str__(self) -> str:
        return f"{self.what}{f' of block {self.block}' if self.block else ''}: {self.why}"


class Ended(BaseException):
    """The evaluation is to end: what a progress function raised is no failure of the part that called it."""

    def __init__(self, error: BaseException) -> None:
        super().__init__(str(error))
        self.error = error


class Failures:
    """Collects the failures of one report."""

    def __init__(self, found: Iterable[Failure] = ()) -> None:
        self.found = list(found)

    def attempt(self, what: str, compute: Callable[[], T], *, block: str | None = None) -> T | Failure:
        """Return what ``compute`` returns, or the failure, which is kept."""
        try:
            return compute()
        except Exception as error:  # noqa: BLE001 - one part must not take the report with it
            last = traceback.extract_tb(error.__traceback__)[-1]
            words, where = f"{type(error).__name__}: {error}", f"{Path(last.filename).name}, line {last.lineno}"
            if isinstance(said := explained(error), PlugInError):
                words, where = str(said), ""
            failure = Failure(what=what, error=words, where=where, block=block)
            self.found.append(failure)
            return failure

    def value(self, what: str, compute: Callable[[], T], empty: U) -> T | U:
        """Return what ``compute`` returns, or ``empty`` where it fails."""
        computed = self.attempt(what, compute)
        return empty if isinstance(computed, Failure) else computed


Verdict: TypeAlias = Literal["shown", "suggested", "not shown", "out of reach", "not tested"]
"""What may be said: ``shown`` (primary), ``suggested`` (exploratory), ``not shown``, ``out of reach`` of so few
participants however they had answered, or ``not tested``. None of them says that there is nothing."""


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
    """What was found in one block.

    ``settings`` are in their order, ``delays_ms`` theirs once known where the block compares delays. ``measures`` has a
    row a setting and statement. ``findings`` are the values of what was tested, by the keys of the descriptors in
    ``analysis.findings``. ``presentations`` are the fewest and the most single answers that one participant gave to a
    statement on one setting; ``replicated_ms`` the delays that several conditions present; ``sessions`` the numbers of
    the sessions; ``incomplete`` has of each statement the participants who miss an answer to it, if there are any.
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
        """The delays asked for, in order, each once; empty while they are not known or where liquids are compared."""
        if self.kind != "delays" or not self.revealed:
            return ()
        return tuple(sorted({setting.delay_ms or 0.0 for setting in self.settings}))


@dataclass(frozen=True, slots=True)
class GroupAnswers:
    """The numbers of the answers about one setting, or of all where ``code`` is None."""

    code: str | None
    name: str
    numbers: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionResult:
    """A question asked after the trials of a block, or in a form: ``where`` is its id, ``title`` what people read.

    ``measure`` and ``figure`` are the ids of what computes and draws its numbers.
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

    @property
    def n(self) -> int:
        """How many answers there are."""
        return sum(int(group.numbers["n"]) for group in self.groups)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoreResult:
    """A score of a questionnaire: number, mean, standard deviation and range over its answers, by setting."""

    where: str
    title: str
    name: str
    instrument: str | None
    source: str | None
    groups: tuple[GroupAnswers, ...]


Summary: TypeAlias = Literal["share", "mean", "geometric mean", "settings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelsResult:
    """A block of levels.

    ``summary`` says how the answers at a level are summarised, ``counts`` what a share is of ("correct"); ``vary`` is
    the varied number, ``quantity`` its name in words, ``unit`` its unit, ``level_kind`` what a level is (weber,
    difference, value), all None where conditions are compared; ``guess_rate`` is the share at chance, ``bounds`` are
    the ends of a scale; ``own_units``: each participant chose the unit of the numbers named, which group intervals
    leave out; ``statistics`` are the rows of each statistic in `analysis.levels` by its key; ``family`` is the
    psychometric function of the thresholds; ``adaptive``: answers chose the levels; ``device`` are the device's own
    dynamics, None where they were not measured. Without the key only ``times`` are known.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ContrastSide:
    """One of the two that a hypothesis compares: the number of each participant, and their mean with its interval.

    The mean is that of the test: of logarithms where a ratio is tested, with the weights of the group means. ``sd`` is
    the standard deviation between participants, of logarithms where a ratio is tested.
    """

    name: str
    values: Mapping[str, float]
    mean: float | None
    low: float | None
    high: float | None
    sd: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ContrastResult(Outcome):
    """The test of what is ``compared``; ``ratio``: the effect is first ÷ second, otherwise first − second.

    ``n`` participants are compared; ``left_out`` are the others with the reasons. ``higher`` is how many of those
    compared have a higher number in the first; None between groups. ``equivalent`` says whether the effect is shown to
    stay within the study's bound, by a ``p_equivalent`` that is corrected over the hypotheses with one; None where it
    has none. ``not_excluded`` is then the largest share of people that may differ by more, by its 95 % interval.
    ``sides`` are the numbers of those compared, ``sd`` is the standard deviation of the differences within
    participants; ``standardised`` is d_z or g, ``ordinal`` Cliff's delta of answers to a statement, and
    ``bayes_factor`` how much likelier the numbers are under a difference than under none.
    """

    contrast: Contrast
    compared: tuple[str, str]
    ratio: bool
    p_adjusted: float | None
    members: int
    verdict: Verdict | Literal["equivalent"]
    equivalent: bool | None
    p_bootstrap: float | None
    p_equivalent: float | None
    not_excluded: float | None
    higher: int | None
    left_out: Mapping[str, str]
    sides: tuple[ContrastSide, ...] = ()
    sd: float | None = None
    standardised: EffectSize | None = None
    ordinal: EffectSize | None = None
    bayes_factor: float | None = None


@dataclass(frozen=True, slots=True)
class Results:
    """All that was found in a study; ``failures`` are the parts that could not be computed.

    ``questions`` and ``scores`` are the answers to questions other than statements, ``levels`` the blocks of levels,
    ``contrasts`` the study's hypotheses; JSON omits them where there are none.
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


SEALED: Final = "computed after unblinding, because it needs to know which condition each code stands for"
"""The reason for results that are missing because the key is sealed."""

VERDICTS_MEAN: Final = (
    "Shown: the adjusted p is at most {alpha}. Suggested: the same in a statement that was not stated as primary "
    "before the study; this is a lead, not a finding. Not shown: the adjusted p is above {alpha}, which is not "
    "evidence that the answers are the same. Out of reach: no rearrangement of these answers within participants could "
    "have made the adjusted p significant, given the other p values in the family. No adjusted p of a statement is "
    "below the p of the test over all statements, adjusted by Holm over the blocks of the study."
)


def beyond(tested: Equivalence) -> str:
    """Return how many participants differ by more than the bound, and the interval of their share."""
    if tested.beyond is None:
        return "–"
    ends = tested.beyond.interval
    return f"{tested.beyond.count} of {tested.beyond.n} [{100 * ends.low:.0f}, {100 * ends.high:.0f}] %"


def settings_noun(found: BlockResult | Block) -> str:
    """Return what the settings of a block are called."""
    return found.kind.removesuffix("s") if found.revealed else "setting"


def short(result: BlockResult, item: str) -> str:
    """Return the few words for a statement."""
    return next(one.short for one in result.items if one.id == item)


def name(result: BlockResult, code: str) -> str:
    """Return what a setting is called: a delay by its milliseconds alone, since its block has one liquid."""
    for setting, text in zip(result.settings, result.names, strict=True):
        if setting.code == code:
            return ms(setting.delay_ms or 0.0) if result.delays_ms else text
    raise KeyError(code)


def lead(result: BlockResult) -> str:
    """Return how sentences about a block begin."""
    return f"{result.title} ({settings_noun(result)}s)" if result.revealed else result.title


def statistic(outcome: Outcome) -> str:
    """Return a statistic with its sign."""
    text = {"chi2": "χ²", "sum of chi2": "sum of χ²"}.get(outcome.statistic_name, outcome.statistic_name)
    return f"{text} {number(outcome.statistic)}"


def said_of_presentations(result: BlockResult) -> tuple[str, ...]:
    """Return how many presentations an answer stands for, and what became of sessions; empty for one of each."""
    fewest, most = result.presentations
    lines = []
    if result.replicated_ms:
        delays = listed([ms(delay) for delay in result.replicated_ms])
        lines.append(
            f"Several conditions have a delay of {delays}; they are treated as repeated presentations of one delay."
        )
    if most > 1:
        often = f"{most}" if fewest == most else f"{fewest} to {most}"
        single = "; the detection threshold uses each single answer" if result.delays_ms else ""
        lines.append(
            f"Each participant rated each {settings_noun(result)} {often} times; the tests use the median of these "
            f"answers{single}."
        )
    if len(result.sessions) > 1:
        lines.append(
            f"The answers of sessions {listed(list(map(str, result.sessions)))} are compared with each other, and "
            "pooled in all other tests."
        )
    return tuple(lines)


def least(alpha: float, bound: float) -> str:
    """Return how many participants equivalence of statements needs at least."""
    return f"at least {fewest(alpha, bound)} participants"


def enough(alpha: float, bound: float) -> str:
    """Return how many participants equivalence of statements needs at least, and why."""
    share = minority(bound, STEPS)
    return (
        f"{least(alpha, bound)}, because a smaller sample has more than a {percent(alpha)} chance of including "
        f"nobody from a minority ({percent(share)} of all people) whose answers differ by "
        f"{significant(bound / share)} points, enough to shift the mean by the bound"
    )


def test_name(outcome: Outcome) -> str:
    """Return a test as a sentence names it."""
    return {
        "Friedman": "Friedman's test",
        "Wilcoxon signed ranks": "Wilcoxon's signed-rank test",
        "trend over participants": "the test of a trend over participants",
        "t test of slopes": "Student's t test of the participants' own slopes",
    }.get(outcome.test, outcome.test)


def incomplete_words(result: BlockResult) -> str:
    """Return which participants tests over all settings leave out, in a sentence."""
    statements: dict[str, list[str]] = {}
    for item, people in result.incomplete.items():
        for person in people:
            statements.setdefault(person, []).append(f"“{short(result, item)}”")
    every = len(result.items)
    who = [
        f"{person} ({'all statements' if len(items) == every else listed(items)})"
        for person, items in sorted(statements.items())
    ]
    return f"Excluded from tests over all {settings_noun(result)}s, because an answer is missing: {listed(who)}."


def missing(result: BlockResult) -> tuple[str, ...]:
    """Return what was not computed, and why, a sentence for each reason."""
    reasons: dict[str, list[str]] = {}
    for not_tested in result.absent:
        reasons.setdefault(not_tested.why, []).append(not_tested.what)
    return tuple(
        f"{listed([f'the {one}' for one in what])} {'was' if len(what) == 1 else 'were'} not computed: {why}."
        if why != SEALED
        else f"{listed([f'the {one}' for one in what])} {'is' if len(what) == 1 else 'are'} {why}."
        for why, what in reasons.items()
    )
