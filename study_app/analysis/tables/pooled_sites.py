"""The sites of a merged study as one study: their participants, and codes that mean the same at every site.

Each site has a key of its own, so that L1 of one is not L1 of another. Until all keys are open a code is SITE-CODE, and
each site has settings of its own; then a code is the id of its condition, and the sites have the same settings.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from study_app.analysis.results.levels import OwnDynamics
from study_app.analysis.tables.asked_questions import AskedIn, AskedQuestion, AskedQuestions, AskedScore
from study_app.analysis.tables.compared_blocks import Block, Setting
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.study import Study
from study_app.store.sites.merged import DASH, Merged

Named = Mapping[str, Study]


def pool(merged: Merged, sites: Named, withdrawn: int) -> Study:
    """Return a merged study from the studies of its sites, by the sites' names; all are revealed, or none.

    ``withdrawn`` is how many participants withdrew at all sites.
    """
    first = next(iter(sites.values()))
    estimators = [one.estimator for one in sites.values() if one.estimator is not None]
    return replace(
        first,
        folder=merged.path,
        sites=tuple(sites),
        blocks=tuple(_block(sites, block) for block in first.blocks),
        settings={
            (block, code): setting
            for name, site in sites.items()
            for (block, _), one in site.settings.items()
            for code, setting in [_renamed(name, one)]
        },
        responses=_tables(sites, lambda site: site.responses),
        trials=_tables(sites, lambda site: site.trials),
        intervals=_tables(sites, lambda site: site.intervals),
        answered=_tables(sites, lambda site: site.answered),
        participants=_tables(sites, lambda site: site.participants),
        exclusions=tuple(
            replace(row, participant=f"{name}{DASH}{row.participant}")
            for name, site in sites.items()
            for row in site.exclusions
        ),
        doubts=tuple(doubt for site in sites.values() for doubt in site.doubts),
        decided=replace(first.decided, changed=any(site.decided.changed for site in sites.values())),
        others=_others(sites, first.others),
        levels=tuple(_levels(sites, block) for block in first.levels),
        own_dynamics=_own_dynamics([one.own_dynamics for one in sites.values() if one.own_dynamics is not None], sites),
        estimator=" or ".join(dict.fromkeys(part for one in estimators for part in one.split(" or "))) or None,
        withdrawn=withdrawn,
    )


def _renamed(site: str, setting: Setting) -> tuple[str, Setting]:
    """Return a setting's code in the merged study, and the setting with it."""
    code = f"{site}{DASH}{setting.code}" if setting.condition is None else setting.condition
    return code, replace(setting, code=code)


def _settings(sites: Named, of: Callable[[Study], Sequence[Setting]]) -> tuple[Setting, ...]:
    """Return the settings of all sites, each once, in the order of the first site that has it."""
    return tuple(dict.fromkeys(_renamed(name, one)[1] for name, site in sites.items() for one in of(site)))


def _block(sites: Named, block: Block) -> Block:
    def settings(site: Study) -> Sequence[Setting]:
        return next(one.settings for one in site.blocks if one.id == block.id)

    return replace(block, settings=_settings(sites, settings))


def _levels(sites: Named, block: LevelBlock) -> LevelBlock:
    def settings(site: Study) -> Sequence[Setting]:
        return next(one.settings for one in site.levels if one.id == block.id)

    return replace(block, settings=_settings(sites, settings))


def _others(sites: Named, others: AskedQuestions) -> AskedQuestions:
    """Return the other questions with the settings of all sites."""

    def where(place: AskedIn) -> AskedIn:
        def settings(site: Study) -> Sequence[Setting]:
            asked = (*site.others.questions, *(one for score in site.others.scores for one in score.questions))
            return next(one.where.settings for one in asked if one.where.id == place.id)

        return replace(place, settings=_settings(sites, settings))

    def question(one: AskedQuestion) -> AskedQuestion:
        return replace(one, where=where(one.where))

    def score(one: AskedScore) -> AskedScore:
        return replace(one, where=where(one.where), questions=tuple(map(question, one.questions)))

    return AskedQuestions(tuple(map(question, others.questions)), tuple(map(score, others.scores)))


def _tables(sites: Named, of: Callable[[Study], pd.DataFrame]) -> pd.DataFrame:
    """Return a table of all sites, with the site in the participants' IDs and the merged study's codes."""
    return pd.concat([_own(name, site, of(site)) for name, site in sites.items()], ignore_index=True)


def _own(name: str, site: Study, table: pd.DataFrame) -> pd.DataFrame:
    if "participant" not in table:
        return table
    table = table.assign(participant=f"{name}{DASH}" + table["participant"])
    if "code" not in table:
        return table
    pairs = list(zip(table["block"].to_numpy(), table["code"].to_numpy(), strict=True))
    places = {pair: place for place, pair in enumerate(dict.fromkeys(pairs))}
    codes = [_code(name, site, *pair) for pair in places]
    which = np.fromiter((places[pair] for pair in pairs), dtype=np.int64, count=len(pairs))
    return table.assign(code=pd.array(codes, dtype="string").take(which))


def _code(name: str, site: Study, block: object, code: object) -> str | None:
    """Return the code of a row in the merged study; None of an answer in a form."""
    if pd.isna(code):  # type: ignore[call-overload]
        return None
    return _renamed(name, site.settings.get((str(block), str(code)), Setting(str(code))))[0]


def _own_dynamics(known: Sequence[OwnDynamics], sites: Named) -> OwnDynamics | None:
    """Return the mean of what the sessions of all sites know of their devices' own dynamics."""
    if not known:
        return None
    weights = [one.sessions for one in known]
    damping_nspm, friction_n, mass_kg = (
        float(np.average([getattr(one, name) for one in known], weights=weights))
        for name in ("damping_nspm", "friction_n", "mass_kg")
    )
    every = sum(len(site.participants) for site in sites.values())
    return OwnDynamics(damping_nspm, friction_n, mass_kg, sum(weights), every)
