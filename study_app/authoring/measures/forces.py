"""Forces: of each liquid against a hand, and from which level of a block on a limit clips them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from study_app.errors import StudyError
from study_app.haptics.model.overrides import override
from study_app.haptics.model.steady_state import HAND_MPS, Steady, steady
from study_app.protocol.checks.clipped_levels import hand_mps_of
from study_app.protocol.model import Protocol
from study_app.protocol.trials.stimuli import OF_CONDITION
from study_app.protocol.trials.tracks import condition_of, stimulus_of

BEYOND: Final = (4.0, 2.0, 1.0)
"""So far beyond the largest comparison a limit is looked for, less where a liquid cannot have such a number."""
_HALVINGS: Final = 24


@dataclass(frozen=True, slots=True)
class LevelLimits:
    """Where the limits of a block's levels are, as values of the varied number; None: beyond what is looked at.

    Attributes
    ----------
    force, loop : float or None
        From which value on the force limit, and the limit of the loop, takes part of the force away.
    hand_mps : float
        The speed of the hand that both are for [m/s].
    """

    force: float | None
    loop: float | None
    hand_mps: float


def forces(protocol: Protocol) -> dict[str, Steady]:
    """Return the force of each liquid against a hand at 0.1 m/s."""
    return {name: steady(protocol.scene_of(name), HAND_MPS) for name in protocol.liquids}


def level_limits(protocol: Protocol, block_id: str, most: float) -> LevelLimits | None:
    """Return where the limits are for what a block varies; None where it varies no force of one liquid.

    Parameters
    ----------
    protocol : Protocol
        The study.
    block_id : str
        The block.
    most : float
        The largest comparison, in the unit of the varied number.
    """
    block = protocol.blocks[block_id]
    if block.stimulus is None:
        return None
    stimulus = stimulus_of(protocol, block)
    scene = protocol.scene_for(condition_of(protocol, stimulus))
    if stimulus.vary in OF_CONDITION or len(scene.liquids) != 1 or most <= 0:
        return None
    hand_mps = hand_mps_of(protocol, block)

    def beyond_force(value: float) -> bool:
        return steady(override(scene, stimulus.vary, value), hand_mps).drag_n > scene.force_limit_n

    def beyond_loop(value: float) -> bool:
        unlimited = override(scene, stimulus.vary, value).model_copy(update={"force_limit_n": math.inf})
        return steady(unlimited, hand_mps).limit is not None

    return LevelLimits(_first(beyond_force, most), _first(beyond_loop, most), hand_mps)


def _first(beyond: Callable[[float], bool], most: float) -> float | None:
    """Return the smallest value, up to some times ``most``, that is beyond a limit; None where none is."""
    high = next((factor * most for factor in BEYOND if _holds(beyond, factor * most)), None)
    if high is None:
        return None
    low = 0.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if _holds(beyond, middle) else (middle, high)
    return high


def _holds(beyond: Callable[[float], bool], value: float) -> bool:
    """Return whether a value is beyond a limit; one that a liquid cannot have is not."""
    try:
        return beyond(value)
    except StudyError:
        return False
