"""What an evaluation finds, as frozen values: every number of a report, and the reason for every one that is not there.

``plain`` turns them into JSON values. Nothing in them is NaN or infinite: what does not exist is None.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

from study_app.analysis.findings.contrast_with_control import ContrastWithControl
from study_app.analysis.findings.delivered_delay import Delivered
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.liquid_recognition import RecognitionResult
from study_app.analysis.findings.lowest_delay import Lowest
from study_app.analysis.findings.not_tested import NotTested
from study_app.analysis.findings.pair_comparison import Pair
from study_app.analysis.findings.section_failures import Failure
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.statistics.psychometrics.threshold import Threshold
from study_app.analysis.tables.compared_blocks import Item, Kind, Setting
from study_app.analysis.tables.performance import Performance
from study_app.analysis.tables.planned_analysis import Decided
from study_app.errors import AnalysisError
from study_app.protocol.orders.balance import Evenness


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
    named: RecognitionResult | None = None
    trends: tuple[Tested, ...] = ()
    lowest: tuple[Lowest, ...] = ()
    against: tuple[ContrastWithControl, ...] = ()
    equivalent_up_to: Mapping[str, float | None] | None = None
    threshold: Threshold | None = None
    mixed: tuple[Tested, ...] = ()
    incomplete: tuple[Tested, ...] = ()
    absent: tuple[NotTested, ...] = ()
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
