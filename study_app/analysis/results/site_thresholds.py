"""The thresholds of a block of levels at each site of a merged study, compared at one standard."""

from dataclasses import dataclass

from study_app.analysis.statistics.independent_groups import GroupsDiffer


@dataclass(frozen=True, slots=True)
class SiteThresholds:
    """Thresholds of a block's participants at one ``standard``.

    ``medians`` are those of the sites named ``sites``; ``thresholds`` and ``of_sites`` have an entry per participant.
    """

    block: str
    title: str
    standard: float | None
    sites: tuple[str, ...]
    medians: tuple[float, ...]
    thresholds: tuple[float, ...]
    of_sites: tuple[str, ...]
    outcome: GroupsDiffer
