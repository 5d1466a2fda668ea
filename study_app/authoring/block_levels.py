"""The levels of a block: what each presents, its force at the task's fastest point, and which limit would clip it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from study_app.haptics.model.overrides import override
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.steady_state import steady
from study_app.protocol.blocks import Block
from study_app.protocol.checks.pace import FASTER
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.trials.stimuli import OF_CONDITION, Stimulus
from study_app.protocol.trials.tracks import condition_of, method_of, standards_of, stimulus_of


@dataclass(frozen=True, slots=True)
class Level:
    """One level of one standard.

    Attributes
    ----------
    standard : float or None
        The standard, in the unit of the varied number; None where the level is the value itself.
    level, comparison : float
        The level as it is asked, and the value that it stands for.
    asked_n, sent_n : float or None
        Force of its drag at the task's fastest point, and of what the limits leave of it [N]; None for a number of the
        condition.
    clipped_by : str or None
        The "norm" (``device.force_limit_n``) or the "slope" limit of the loop (`haptics.model.slope_limits`).
    """

    standard: float | None
    level: float
    comparison: float
    asked_n: float | None = None
    sent_n: float | None = None
    clipped_by: Literal["slope", "norm"] | None = None


def levels(protocol: Protocol, block_id: str) -> tuple[Level, ...]:
    """Return every level that a block with a stimulus can present, standard by standard, the smallest first.

    The hand is taken to be as much faster than a paced target as ``check`` takes it to be.

    Raises
    ------
    KeyError
        There is no such block.
    """
    block = protocol.blocks[block_id]
    if block.stimulus is None:
        return ()
    stimulus, method = stimulus_of(protocol, block), method_of(protocol, block)
    asked = sorted({*(stimulus.grid if method.adaptive else ()), *method.asked(stimulus)})
    scene, hand_mps = protocol.scene_for(condition_of(protocol, stimulus)), hand_mps_of(protocol, block)
    return tuple(
        _level(stimulus, scene, hand_mps, standard, level)
        for standard in standards_of(protocol, block)
        for level in asked
    )


def standard_of(protocol: Protocol, block_id: str, standard: float) -> Level:
    """Return a standard of a block as its level 0."""
    block = protocol.blocks[block_id]
    stimulus = stimulus_of(protocol, block)
    scene = protocol.scene_for(condition_of(protocol, stimulus))
    found = _level(stimulus, scene, hand_mps_of(protocol, block), None, standard)
    return replace(found, standard=standard, level=0.0, comparison=standard)


def _level(stimulus: Stimulus, scene: Scene, hand_mps: float, standard: float | None, level: float) -> Level:
    comparison = stimulus.comparison(standard, level)
    if stimulus.vary in OF_CONDITION or len(scene.liquids) != 1:
        return Level(standard, level, comparison)
    force = steady(override(scene, stimulus.vary, comparison), hand_mps)
    return Level(standard, level, comparison, force.drag_n, force.force_n, force.limit)


def hand_mps_of(protocol: Protocol, block: Block) -> float:
    """Return the speed of the hand at the fastest point of a block's task [m/s]."""
    task = protocol.tasks[block.task]
    pace_mps = task.fastest_stroke(protocol.device.workspace_m).speed_mps
    return FASTER * pace_mps if isinstance(task, Follow) else pace_mps
