"""Studies of equal observers through the choice of levels and the analysis alone: no servo, no store.

What is presented is what was requested, so that errors are those of methods and estimates.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.levels.results import ThresholdFound
from study_app.analysis.levels.thresholds import jnd_slope, thresholds
from study_app.evidence.thresholds.planted import Planted
from study_app.protocol.orders.schedule import build_schedule, draw_key
from study_app.protocol.streams import Key, draw_secret, stream
from study_app.protocol.trials.methods import Heard
from study_app.protocol.trials.presentation import Due, arrangement_text, heard_of, next_level
from study_app.protocol.trials.stimuli import DELAYS
from study_app.protocol.trials.tracks import design_of, method_of, stimulus_of
from study_app.session.simulated.participant import Comparison, Observer

PEOPLE: Final = 10
COLUMNS: Final = (
    "participant", "session", "block", "code", "track", "trial", "catch", "arrangement", "standard", "level",
    "level_delivered", "analysed", "success",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class StudyFound:
    """Threshold, low and high of each standard that the analysis found: the group's, and each person's (``own``)."""

    group: tuple[tuple[float, float, float], ...]
    own: tuple[tuple[tuple[float, float, float], ...], ...]

    @property
    def mean(self) -> float:
        """The geometric mean of the group's thresholds over the standards."""
        return math.exp(sum(math.log(one[0]) for one in self.group) / len(self.group))

    def mean_of(self, people: int) -> float:
        """Return the geometric mean over standards and the first participants."""
        values = [math.log(one[0]) for person in self.own[:people] for one in person]
        return math.exp(sum(values) / len(values))


def simulate(
    one: Planted, number: int, seed: int, people: int = PEOPLE, observers: Sequence[Observer] = ()
) -> StudyFound:
    """Return what a study of equal observers finds; ``number`` names its draws.

    ``observers`` differ, and take part in place of ``people`` equal ones.
    """
    random = stream(seed, f"validate/{one.name}/{number}").random
    key = Key(draw_key(one.protocol, random), draw_secret(random))
    who = observers or (one.observer,) * people
    names = [f"P{person:03d}" for person in range(1, len(who) + 1)]
    rows = [
        row for name, own in zip(names, who, strict=True) for row in _rows(replace(one, observer=own), key, name, seed)
    ]
    frame = pd.DataFrame(rows, columns=list(COLUMNS)).astype({"level_delivered": "Float64", "success": "boolean"})
    found = list(thresholds(_level_block(one), frame))
    group = tuple(_ends(row) for row in found if row.participant is None)
    own = tuple(tuple(_ends(row) for row in found if row.participant == name) for name in names)
    return StudyFound(group, own)


def slopes(one: Planted, found: StudyFound) -> list[float]:
    """Return each participant's slope of ln JND over ln standard."""
    standards = np.array(one.standards)
    unit = standards if stimulus_of(one.protocol, one.block).level_kind == "weber" else 1.0
    return [jnd_slope(standards, np.array([row[0] for row in person]) * unit) for person in found.own]


def _ends(row: ThresholdFound) -> tuple[float, float, float]:
    assert row.low is not None and row.high is not None  # noqa: S101, PT018 - ten participants have an interval
    return row.threshold, row.low, row.high


def _level_block(one: Planted) -> LevelBlock:
    block, protocol = one.block, one.protocol
    return LevelBlock(
        id=block.id,
        title=block.id,
        phase=block.phase,
        design=design_of(protocol, block),
        stimulus=stimulus_of(protocol, block),
        settings=(),
        method=method_of(protocol, block),
    )


def _rows(one: Planted, key: Key, person: str, seed: int) -> Iterator[tuple[Any, ...]]:
    """Yield a row of `COLUMNS` for each trial of one participant."""
    protocol, block = one.protocol, one.block
    schedule = build_schedule(protocol, person, seed)
    design, attended = design_of(protocol, block), Comparison.of(protocol, block, one.observer)
    heard: list[Heard] = []
    total, count = 0.0, 0
    for trial in schedule.trials:
        if trial.block != block.id:
            continue
        due = next_level(protocol, key, schedule, trial, heard)
        if due is None:
            continue
        sensed = list(_sensed(due))
        total, count = total + sum(sensed), count + len(sensed)
        draw = keyed_draw(key, person, trial.number)
        answer = attended.choose(design, sensed, total / count, draw)
        what = (trial.number, trial.code, due.level, due.arrangement, answer)
        heard.append(heard_of(protocol, block, *what, catch=due.catch))
        track = key.codes[block.id][trial.code]
        yield (
            *(person, 1, block.id, trial.code, track, trial.number, due.catch),
            *(arrangement_text(design, due.arrangement), due.standard, due.level, due.level, True, heard[-1].success),
        )


def keyed_draw(key: Key, person: str, trial: int) -> Any:
    """Return the source of a participant's draws in one trial."""
    return stream(int.from_bytes(key.secret[:4], "big"), f"observer/{person}/{trial}").random


def _sensed(due: Due) -> Iterator[float]:
    """Yield what is presented in each interval: a delay [s], or a number of the liquid."""
    for interval in due.intervals:
        yield interval.value / 1000 if interval.vary in DELAYS else interval.value
