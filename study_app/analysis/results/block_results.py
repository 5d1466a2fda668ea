"""What an evaluation finds, as frozen values: every number of a report, and the reason for every one that is not there.

Nothing in them is NaN or infinite: what does not exist is None.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from study_app.analysis.results.delivered_delay import Delivered
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.not_tested import NotTested
from study_app.analysis.results.question_answers import QuestionFound, ScoreFound
from study_app.analysis.results.section_failures import Failure
from study_app.analysis.results.site_thresholds import SiteThresholds
from study_app.analysis.tables.compared_blocks import Item, Kind, Setting
from study_app.analysis.tables.performance import Performance
from study_app.analysis.tables.planned_analysis import Decided
from study_app.protocol.orders.balance import Evenness


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockFound:
    """What was found in one block.

    ``settings`` are in their order, ``delays_ms`` theirs once known where the block compares delays. ``measures`` has a
    row a setting and statement. ``findings`` are the values of what was tested, by the keys of the descriptors in
    ``analysis.findings``. ``presentations`` are the fewest and the most single answers that one participant gave to a
    statement on one setting; ``replicated_ms`` the delays that several conditions present; ``sessions`` the numbers of
    the sessions.
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

    @property
    def delays_ms(self) -> tuple[float, ...]:
        """The delays asked for, in order, each once; empty while they are not known or where liquids are compared."""
        if self.kind != "delays" or not self.revealed:
            return ()
        return tuple(sorted({setting.delay_ms or 0.0 for setting in self.settings}))


@dataclass(frozen=True, slots=True)
class Results:
    """All that was found in a study; ``failures`` are the parts that could not be computed.

    ``questions`` and ``scores`` are the answers to questions other than statements, ``levels`` the blocks of levels,
    ``site_thresholds`` their thresholds at the sites of a merged study; JSON omits them where there are none.
    """

    decided: Decided
    people: tuple[str, ...]
    blocks: tuple[BlockFound, ...]
    delivered: tuple[Delivered, ...]
    orders: Mapping[str, Evenness]
    performance: Performance | None
    seed: int
    failures: tuple[Failure, ...] = ()
    questions: tuple[QuestionFound, ...] = ()
    scores: tuple[ScoreFound, ...] = ()
    levels: tuple[LevelsFound, ...] = ()
    site_thresholds: tuple[SiteThresholds, ...] = ()
