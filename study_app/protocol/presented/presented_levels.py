"""The levels of a block as presented: the force at the task's fastest point, before and after the limits."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Final, Literal

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.overrides import override_value
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import steady_force
from study_app.protocol.blocks import Block
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.trials.stimuli import DELAY, OF_CONDITION, OF_LINK, Stimulus
from study_app.psychophysics.families import Floats

FASTER: Final = 1.2
"""Greatest ratio of a hand's speed to the pace of its target. [choice]"""
UNPACED_MPS: Final = 0.3
"""Speed of a hand without a paced target [m/s]. [choice]"""
BEYOND: Final = (4.0, 2.0, 1.0)
"""Multiples of the largest value up to which a limit is searched; smaller ones are for numbers with a maximum."""
_STEPS: Final = 2**32
"""Number of steps of the search for a limit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Level:
    """One level of one standard (None if the level is the value itself); ``comparison`` is the varied number's value.

    ``asked_n`` is its drag force at the task's fastest point, and ``sent_n`` the part that the limits permit [N]; both
    are None for a number of the condition. ``clipped_by`` is "norm" for the force limit (``device.force_limit_n``),
    "slope" for the slope limit of the loop (`haptics.model.slope_limits`). ``damping_nspm`` is 0 without a linear law.
    """

    standard: float | None
    level: float
    comparison: float
    asked_n: float | None = None
    sent_n: float | None = None
    clipped_by: Literal["slope", "norm"] | None = None
    damping_nspm: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelLimits:
    """The highest unclipped values of the varied number for two limits; None if beyond the searched range.

    ``force`` is for the force limit, ``loop`` for the slope limit, both for a hand at ``hand_mps`` [m/s].
    """

    force: float | None
    loop: float | None
    hand_mps: float

    @property
    def lowest(self) -> float | None:
        """The value above which either limit clips the force; None without a limit."""
        return min((limit for limit in (self.force, self.loop) if limit is not None), default=None)


@dataclass(frozen=True, slots=True)
class Clipping:
    """The clipping of a block's levels at one standard (None if the level is the value itself).

    ``limit`` is the value of the varied number that replaces every higher one. If the task is not ``paced``, levels are
    clipped only in fast motions, whose trials are repeated. ``others`` are the block's other standards, which are
    lower.
    """

    standard: float | None
    limit: float
    paced: bool
    others: tuple[float, ...] = ()

    @property
    def clips_standard(self) -> bool:
        return self.standard is not None and self.standard > self.limit

    @property
    def named(self) -> str:
        """The standard as text to append to a noun: " 52"; "" if it is the only standard."""
        return f" {self.standard:g}" if self.others else ""

    def highest(self, stimulus: Stimulus) -> float:
        """Return the highest unclipped level; infinite if higher levels have less force."""
        if self.standard is not None and stimulus.level_kind != "value" and stimulus.direction == "down":
            return 0.0 if self.clips_standard else math.inf
        return stimulus.level_between(self.standard, self.limit)

    def presented(self, stimulus: Stimulus, levels: Floats) -> Floats:
        """Return levels (n,) after clipping, between the clipped standard and the clipped comparison."""
        standard = None if self.standard is None else min(self.standard, self.limit)
        comparisons = np.minimum(stimulus.comparison(self.standard, levels), self.limit)
        return stimulus.level_between(standard, comparisons)


def levels(protocol: Protocol, block_id: str) -> tuple[Level, ...]:
    """Return every level that a block with a stimulus can present: by standard, and in ascending order."""
    block = protocol.blocks[block_id]
    if block.stimulus is None:
        return ()
    stimulus, method = protocol.stimulus_of(block), protocol.method_of(block)
    requested_levels = sorted({*(stimulus.grid if method.adaptive else ()), *method.levels_of(stimulus)})
    scene, hand_mps = protocol.scene_for(protocol.condition_of(stimulus)), hand_mps_of(protocol, block)
    return tuple(
        _level(stimulus, scene, hand_mps, standard, level)
        for standard in protocol.standards_of(block)
        for level in requested_levels
    )


def standard_level(protocol: Protocol, block_id: str, standard: float) -> Level:
    """Return the level 0 of a standard, at which the standard itself is presented."""
    block = protocol.blocks[block_id]
    stimulus = protocol.stimulus_of(block)
    scene = protocol.scene_for(protocol.condition_of(stimulus))
    level = _level(stimulus, scene, hand_mps_of(protocol, block), None, standard)
    return replace(level, standard=standard, level=0.0, comparison=standard)


def _level(stimulus: Stimulus, scene: Scene, hand_mps: float, standard: float | None, level: float) -> Level:
    comparison = stimulus.comparison(standard, level)
    if stimulus.vary in OF_CONDITION or len(scene.liquids) != 1:
        return Level(standard=standard, level=level, comparison=comparison)
    varied = override_value(scene, stimulus.vary, comparison)
    force = steady_force(varied, hand_mps)
    return Level(
        standard=standard,
        level=level,
        comparison=comparison,
        asked_n=force.drag_n,
        sent_n=force.force_n,
        clipped_by=force.limit,
        damping_nspm=damping_of(varied),
    )


def level_limits(protocol: Protocol, block: Block) -> LevelLimits | None:
    """Return the limits of a block's varied number; None if it does not vary the force of one liquid."""
    if block.stimulus is None:
        return None
    stimulus, standards = protocol.stimulus_of(block), protocol.standards_of(block)
    scene, requested_levels = (
        protocol.scene_for(protocol.condition_of(stimulus)),
        protocol.method_of(block).levels_of(stimulus),
    )
    largest = max(
        stimulus.comparison(standard, level) for standard, level in product(standards, (0.0, *requested_levels))
    )
    if stimulus.vary in OF_CONDITION or len(scene.liquids) != 1 or largest <= 0:
        return None
    hand_mps = hand_mps_of(protocol, block)

    def beyond_force(value: float) -> bool:
        return steady_force(override_value(scene, stimulus.vary, value), hand_mps).drag_n > scene.force_limit_n

    def beyond_loop(value: float) -> bool:
        unlimited = override_value(scene, stimulus.vary, value).model_copy(update={"force_limit_n": math.inf})
        return steady_force(unlimited, hand_mps).limit is not None

    return LevelLimits(
        force=_highest_unclipped_value(beyond_force, largest),
        loop=_highest_unclipped_value(beyond_loop, largest),
        hand_mps=hand_mps,
    )


def _highest_unclipped_value(exceeds_limit: Callable[[float], bool], largest: float) -> float | None:
    """Return the highest value within a limit, searched up to a multiple of ``largest``; None if it is beyond that."""

    def is_beyond(value: float) -> bool:
        try:
            return exceeds_limit(value)
        except StudyError:  # the liquid cannot have this value
            return False

    high = next((factor * largest for factor in BEYOND if is_beyond(factor * largest)), None)
    if high is None:
        return None
    step = high / _STEPS
    return bisect_left(range(1, _STEPS), True, key=lambda number: is_beyond(number * step)) * step


def clipping(protocol: Protocol, block: Block, limits: LevelLimits | None = None) -> Clipping | None:
    """Return the clipping of a block's levels; None if no level is clipped, or `level_limits` finds no limit.

    ``limits`` are those of `level_limits`, if already known.
    """
    if block.stimulus is None:
        return None
    scenes = [scene for *_, scene in extreme_levels(protocol, block) if len(scene.liquids) == 1]
    hand_mps = hand_mps_of(protocol, block)
    if all(steady_force(scene, hand_mps).limit is None for scene in scenes):
        return None
    limits = limits or level_limits(protocol, block)
    if limits is None or not limits.lowest:
        return None
    *others, standard = sorted(value for value in protocol.standards_of(block) if value is not None) or (None,)
    return Clipping(standard, limits.lowest, isinstance(protocol.tasks[block.task], Follow), tuple(others))


def hand_mps_of(protocol: Protocol, block: Block) -> float:
    """Return the hand's speed at the fastest point of a block's task [m/s]."""
    task = protocol.tasks[block.task]
    return FASTER * task.fastest_stroke((0.0, 0.0, 0.0)).speed_mps if isinstance(task, Follow) else UNPACED_MPS


def extreme_levels(protocol: Protocol, block: Block) -> Iterator[tuple[float | None, float, Scene]]:
    """Yield standard, level and scene at the highest and the lowest level of each standard; nothing for delays."""
    stimulus = protocol.stimulus_of(block)
    if stimulus.vary == DELAY:
        return
    requested_levels = protocol.method_of(block).levels_of(stimulus)
    scene = protocol.scene_for(protocol.condition_of(stimulus))
    for standard, level in product(protocol.standards_of(block), (max(requested_levels), min(requested_levels))):
        varied = scene
        if stimulus.vary not in OF_LINK:
            varied = override_value(scene, stimulus.vary, stimulus.comparison(standard, level))
        yield standard, level, varied


def damping_of(scene: Scene) -> float:
    """Return the highest damping of a scene's liquids with a linear law [N·s/m at the hand]; 0 without one."""
    return max((liquid.drag.damping_nspm or 0.0 for liquid in scene.liquids), default=0.0)


def highest_damping(protocol: Protocol, block: Block) -> float:
    """Return the highest damping that a block of levels presents [N·s/m at the hand]; 0 without a linear law."""
    return max((damping_of(scene) for _, _, scene in extreme_levels(protocol, block)), default=0.0)
