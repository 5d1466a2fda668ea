"""Settings of blocks whose levels participants set: PSE, JND, constant error and hysteresis, of each and of all."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from study_app.analysis.results.level_results import SettingFound
from study_app.analysis.statistics.psychometrics.settings import setting_statistics
from study_app.analysis.statistics.student_interval import student_interval
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.protocol.trials.stimuli import Stimulus


def settings(block: LevelBlock, opened: pd.DataFrame) -> Iterator[SettingFound]:
    """Yield the group's settings at each standard, followed by those of its participants; none of other designs."""
    stimulus = block.stimulus
    if stimulus is None or not block.design.adjusts:
        return
    rows = opened[(opened["block"] == block.id) & opened["analysed"] & opened["response"].notna()]
    rows = rows[rows["setting"].notna()]
    for _, at_standard in rows.groupby("standard", dropna=False, sort=True):
        known = None if pd.isna(which := at_standard["standard"].iloc[0]) else float(which)
        people = at_standard.groupby("participant", sort=True)
        own = [_of_person(block, stimulus, str(person), known, some) for person, some in people]
        yield _group(stimulus, known, own)
        yield from own


def _of_person(
    block: LevelBlock, stimulus: Stimulus, person: str, standard: float | None, rows: pd.DataFrame
) -> SettingFound:
    in_u = np.vectorize(stimulus.coordinate, otypes=[float])
    u, starts = (in_u(rows[name].to_numpy(dtype=float)) for name in ("setting", "level"))
    found = setting_statistics(u, starts > sum(stimulus.domain) / 2)
    compared = standard is not None and block.design.intervals > 1
    return SettingFound(
        participant=person,
        standard=standard,
        n=found.n,
        pse=stimulus.level_of(found.pse),
        low=_level(stimulus, found.low),
        high=_level(stimulus, found.high),
        jnd=found.jnd,
        constant_error=found.pse - stimulus.coordinate(standard) if compared and standard is not None else None,
        hysteresis=found.hysteresis,
        levels=tuple(rows["setting"].to_numpy(dtype=float).tolist()),
        started_high=tuple((starts > sum(stimulus.domain) / 2).tolist()),
    )


def _group(stimulus: Stimulus, standard: float | None, own: Sequence[SettingFound]) -> SettingFound:
    """Return the means over participants, with Student's interval of the PSE."""
    pse = np.array([stimulus.coordinate(one.pse) for one in own])
    low, high = student_interval(pse)
    return SettingFound(
        participant=None,
        standard=standard,
        n=len(own),
        pse=stimulus.level_of(float(pse.mean())),
        low=_level(stimulus, low),
        high=_level(stimulus, high),
        jnd=_mean(own, lambda one: one.jnd),
        constant_error=_mean(own, lambda one: one.constant_error),
        hysteresis=_mean(own, lambda one: one.hysteresis),
    )


def _mean(own: Sequence[SettingFound], value: Callable[[SettingFound], Any]) -> float | None:
    known = [number for one in own if (number := value(one)) is not None]
    return float(np.mean(known)) if known else None


def _level(stimulus: Stimulus, u: float | None) -> float | None:
    return None if u is None else stimulus.level_of(u)
