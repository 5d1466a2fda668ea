"""Whether participants of different sites have the same thresholds."""

from collections.abc import Iterator, Sequence

import numpy as np

from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.site_thresholds import SiteThresholds
from study_app.analysis.statistics.independent_groups import groups_differ
from study_app.analysis.tables.study_tables import Study


def site_thresholds(study: Study, levels: Sequence[LevelsFound], seed: int) -> Iterator[SiteThresholds]:
    """Yield the comparison of sites at each standard of each block; nothing where the study is not merged or sealed."""
    for found in levels if study.sites else ():
        for standard in dict.fromkeys(one.standard for one in found.own_thresholds):
            own = [one for one in found.own_thresholds if one.standard == standard]
            thresholds = tuple(one.threshold for one in own)
            of_sites = tuple(study.site_of(str(one.participant)) for one in own)
            sites = tuple(dict.fromkeys(of_sites))
            medians = [
                np.median([value for value, at in zip(thresholds, of_sites, strict=True) if at == site])
                for site in sites
            ]
            yield SiteThresholds(
                found.block,
                found.title,
                standard,
                sites,
                tuple(map(float, medians)),
                thresholds,
                of_sites,
                groups_differ(np.array(thresholds)[:, None], of_sites, seed=seed),
            )
