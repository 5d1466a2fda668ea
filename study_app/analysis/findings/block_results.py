"""What an evaluation finds, as frozen values: every number of a report, and the reason for every one that is not there.

``plain`` turns them into JSON values. Nothing in them is NaN or infinite: what does not exist is None.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal, TypeAlias

from study_app.analysis.report.section_failures import Failure
from study_app.analysis.statistics.equivalence.tost import Equivalence
from study_app.analysis.statistics.equivalence.tost import Verdict as Nearness
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.statistics.psychometrics.threshold import Threshold
from study_app.analysis.statistics.recognition import Recognition
from study_app.analysis.statistics.trend import StepDown
from study_app.analysis.tables.compared_blocks import Item, Kind, Setting
from study_app.analysis.tables.performance import Performance
from study_app.analysis.tables.planned_analysis import Decided, Direction
from study_app.errors import AnalysisError
from study_app.protocol.orders.balance import Evenness

Verdict: TypeAlias = Literal["shown", "suggested", "not shown", "out of reach", "not tested"]
"""What may be said: ``shown`` (primary), ``suggested`` (exploratory), ``not shown``, ``out of reach`` of so few
participants however they had answered, or ``not tested``. None of them says that there is nothing."""


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class Pair:
    """Two settings (codes) compared in one statement; the family is all pairs that are compared in the block."""

    first: str
    second: str
    tested: Tested


@dataclass(frozen=True, slots=True)
class Named:
    """The recognition of liquids: the items that name one, and which of them is right for each setting (code)."""

    labels: tuple[str, ...]
    settings: tuple[str, ...]
    right: tuple[str | None, ...]
    found: Recognition
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Lowest:
    """The lowest delay at which a trend shows in one statement, stepping down.

    The error rate of ``steps`` holds within the statement; that of ``over_all_ms``, the lowest delay whose steps all
    have p ≤ alpha / ``members``, over all statements of the family.
    """

    item: str
    steps: StepDown
    members: int = 1

    @property
    def over_all_ms(self) -> float | None:
        """The lowest delay that shows with the error rate held over all statements; None without any."""
        lowest = None
        for step in self.steps.steps:
            if step.page.p is None or step.page.p > self.steps.alpha / self.members:
                break
            lowest = step.longest_ms
        return lowest


@dataclass(frozen=True, slots=True)
class Against:
    """One delay compared with the shortest in one statement.

    ``found`` holds the verdict; ``p_adjusted`` is p of a difference, corrected over the ``members`` comparisons of
    the block; ``expected`` the direction that was stated before the study, None where none was.
    """

    item: str
    delay_ms: float
    control_ms: float
    found: Equivalence
    p_adjusted: float | None
    members: int
    expected: Direction | None = None

    @property
    def verdict(self) -> Nearness:
        """What may be said: "equivalent" where every test shows it, "different" by the corrected p."""
        return self.found.verdict

    @property
    def as_expected(self) -> bool:
        """Whether answers went where they were expected to, or nothing was expected."""
        away = self.found.effect or 0.0
        return self.expected is None or (away > 0) == (self.expected == "increasing")


@dataclass(frozen=True, slots=True)
class Waiting:
    """What is not there, and why: while the key is sealed, or for good."""

    what: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockFound:
    """What was found in one block.

    ``settings`` are in their order, ``delays_ms`` theirs once known where the block compares delays. ``measures`` has a
    row a setting and statement. ``omnibus`` compares all settings, ``trends`` follow the delay; ``mixed`` and
    ``incomplete`` ask the same again with other assumptions. ``equivalent_up_to`` maps statements to the longest delay
    up to which every delay is equivalent to the shortest. ``presentations`` are the fewest and the most single answers
    that one participant gave to a statement on one setting; ``replicated_ms`` the delays that several conditions
    present; ``by_session`` compares ``sessions``, where there are several.
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
    overall: Outcome | None = None
    omnibus: tuple[Tested, ...] = ()
    pairs: tuple[Pair, ...] = ()
    named: Named | None = None
    trends: tuple[Tested, ...] = ()
    lowest: tuple[Lowest, ...] = ()
    against: tuple[Against, ...] = ()
    equivalent_up_to: Mapping[str, float | None] | None = None
    threshold: Threshold | None = None
    mixed: tuple[Tested, ...] = ()
    incomplete: tuple[Tested, ...] = ()
    absent: tuple[Waiting, ...] = ()
    presentations: tuple[int, int] = (1, 1)
    replicated_ms: tuple[float, ...] = ()
    sessions: tuple[int, ...] = (1,)
    by_session: tuple[Tested, ...] = ()

    @property
    def delays_ms(self) -> tuple[float, ...]:
        """The delays asked for, in order, each once; empty while they are not known or where liquids are compared."""
        if self.kind != "delays" or not self.revealed:
            return ()
        return tuple(sorted({setting.delay_ms or 0.0 for setting in self.settings}))


@dataclass(frozen=True, slots=True)
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


@dataclass(frozen=True, slots=True)
class Results:
    """All that was found in a study; ``failures`` are the parts that could not be computed."""

    decided: Decided
    people: tuple[str, ...]
    blocks: tuple[BlockFound, ...]
    delivered: tuple[Delivered, ...]
    orders: Mapping[str, Evenness]
    performance: Performance | None
    seed: int
    failures: tuple[Failure, ...] = ()


def plain(value: Any) -> Any:
    """Return a value of this module as JSON's: objects, arrays, texts, numbers, true, false and null.

    Raises
    ------
    AnalysisError
        A number is NaN or infinite, which no result may be.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [plain(entry) for entry in value]
    if hasattr(value, "item"):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        raise AnalysisError(f"a result is {value}: this is a fault of the program, please report it")
    return value
