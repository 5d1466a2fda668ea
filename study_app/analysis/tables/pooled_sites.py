"""What the sites of a merged study have in common: codes that mean the same, tables, and what was asked.

Each site has a key of its own, so that L1 of one is not L1 of another. Until all keys are open a code is SITE-CODE, and
each site has settings of its own; then a code is the id of its condition, and the sites have the same settings.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias, TypeVar

import numpy as np
import pandas as pd

from study_app.analysis.results.level_results import OwnDynamics
from study_app.analysis.tables.asked_questions import AskedIn, AskedQuestion, AskedQuestions, AskedScore
from study_app.analysis.tables.compared_blocks import Block, Setting
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.store.sites.merged import DASH

Settings: TypeAlias = Mapping[tuple[str, str], Setting]
AnyBlock = TypeVar("AnyBlock", Block, LevelBlock)


def renamed(site: str, setting: Setting) -> Setting:
    """Return a site's setting with its code in the merged study."""
    code = f"{site}{DASH}{setting.code}" if setting.condition is None else setting.condition
    return replace(setting, code=code)


def _all(each: Mapping[str, Iterable[Setting]]) -> tuple[Setting, ...]:
    """Return the settings of all sites, each once, in the order of the first site that has it."""
    return tuple(dict.fromkeys(renamed(site, one) for site, settings in each.items() for one in settings))


def pooled_settings(sites: Mapping[str, Settings]) -> Settings:
    """Return what every (block, code) of the merged study stands for; nothing while the sites are sealed."""
    return {
        (block, own.code): own
        for site, settings in sites.items()
        for (block, _), one in settings.items()
        for own in [renamed(site, one)]
    }


def pooled_blocks(sites: Mapping[str, Sequence[AnyBlock]]) -> tuple[AnyBlock, ...]:
    """Return the blocks, which all sites have, with the settings of all sites."""
    first = next(iter(sites.values()))
    return tuple(
        replace(block, settings=_all({site: blocks[place].settings for site, blocks in sites.items()}))
        for place, block in enumerate(first)
    )


def pooled_questions(sites: Mapping[str, AskedQuestions]) -> AskedQuestions:
    """Return the other questions, which all sites were asked, with the settings of all sites."""

    def where(wheres: Mapping[str, AskedIn]) -> AskedIn:
        settings = _all({site: one.settings for site, one in wheres.items()})
        return replace(next(iter(wheres.values())), settings=settings)

    def questions(asked: Mapping[str, Sequence[AskedQuestion]]) -> tuple[AskedQuestion, ...]:
        return tuple(
            replace(one, where=where({site: those[place].where for site, those in asked.items()}))
            for place, one in enumerate(next(iter(asked.values())))
        )

    scores: tuple[AskedScore, ...] = tuple(
        replace(
            score,
            where=where({site: asked.scores[place].where for site, asked in sites.items()}),
            questions=questions({site: asked.scores[place].questions for site, asked in sites.items()}),
        )
        for place, score in enumerate(next(iter(sites.values())).scores)
    )
    return AskedQuestions(questions({site: asked.questions for site, asked in sites.items()}), scores)


def pooled_table(sites: Mapping[str, tuple[Settings, pd.DataFrame]]) -> pd.DataFrame:
    """Return a table of all sites, with the site in the participants' IDs and the merged study's codes."""
    return pd.concat([_own(site, *of_site) for site, of_site in sites.items()], ignore_index=True)


def _own(site: str, settings: Settings, table: pd.DataFrame) -> pd.DataFrame:
    if "participant" not in table:
        return table
    table = table.assign(participant=f"{site}{DASH}" + table["participant"])
    if "code" not in table:
        return table
    pairs = list(zip(table["block"].to_numpy(), table["code"].to_numpy(), strict=True))
    places = {pair: place for place, pair in enumerate(dict.fromkeys(pairs))}
    codes = [_code(site, settings, *pair) for pair in places]
    which = np.fromiter((places[pair] for pair in pairs), dtype=np.int64, count=len(pairs))
    return table.assign(code=pd.array(codes, dtype="string").take(which))


def _code(site: str, settings: Settings, block: object, code: object) -> str | None:
    """Return the code of a row in the merged study; None of an answer in a form."""
    if pd.isna(code):  # type: ignore[call-overload]
        return None
    return renamed(site, settings.get((str(block), str(code)), Setting(str(code)))).code


def pooled_dynamics(sites: Iterable[OwnDynamics | None], sessions: int) -> OwnDynamics | None:
    """Return the mean of what the sessions of all sites know of their devices' own dynamics; None of nothing."""
    known = [one for one in sites if one is not None]
    if not known:
        return None
    weights = [one.sessions for one in known]
    damping_nspm, friction_n, mass_kg = (
        float(np.average([getattr(one, name) for one in known], weights=weights))
        for name in ("damping_nspm", "friction_n", "mass_kg")
    )
    return OwnDynamics(damping_nspm, friction_n, mass_kg, sum(weights), sessions)
