"""What is wrong with paced motions: forces beyond the limits at the pace, swings that the estimator lags behind.

These checks need a sound protocol; a hidden ball in a reaching task is found here, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Final

from study_app.haptics.model.device_dynamics import BELIEVED_TICKS
from study_app.haptics.model.overrides import override
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import slope_limit
from study_app.haptics.model.steady_state import steady
from study_app.protocol.blocks import Block
from study_app.protocol.checks.estimator_response import fastest_hz, passed_share
from study_app.protocol.model import Follow, Protocol, Reach
from study_app.protocol.quantities import quantity
from study_app.protocol.source.problems import Fault
from study_app.protocol.trials.stimuli import DELAY, OF_LINK, Stimulus
from study_app.protocol.trials.tracks import condition_of, method_of, standards_of, stimulus_of

FASTER: Final = 1.2
"""A hand exceeds the pace of its target by up to a fifth. [choice]"""
LEAST_SHARE: Final = 0.99
"""Of a damper, that the velocity estimator must pass."""


def paced(protocol: Protocol, delay_ticks: int = BELIEVED_TICKS) -> Iterator[Fault]:
    """Yield what is wrong with tasks of kind "follow", and with balls that are hidden where a hand must aim.

    Parameters
    ----------
    protocol : Protocol
        The study, sound but for this.
    delay_ticks : int
        How many ticks late a force acts.
    """
    yield from _hidden(protocol)
    yield from _lagging(protocol)
    for block in protocol.blocks.values():
        task = protocol.tasks[block.task]
        if block.stimulus is not None:
            beyond = beyond_slope_limit(protocol, block, delay_ticks)
            yield from _clipped_levels(protocol, block) if beyond is None else (beyond,)
        elif isinstance(task, Follow):
            for index, name in enumerate(block.conditions):
                for message, hint in _clipped(protocol.scene_for(name), task, f'"{name}"'):
                    yield Fault(("blocks", block.id, "conditions", index), message, hint)


def _hidden(protocol: Protocol) -> Iterator[Fault]:
    for block in protocol.blocks.values():
        if not isinstance(protocol.tasks[block.task], Reach):
            continue
        for name in protocol.conditions_in(block.id):
            if protocol.conditions[name].ball == "hidden":
                message = f'is hidden, but block "{block.id}" has a reaching task: it cannot be aimed'
                yield Fault(("conditions", name, "ball"), message, 'a task of kind "follow" or "explore"')


def _lagging(protocol: Protocol) -> Iterator[Fault]:
    """Check that the velocity estimator passes a damper at the frequency of each target."""
    velocity, rate_hz = protocol.scene.velocity, protocol.device.rate_hz
    felt: dict[str, list[Scene]] = {}
    for block in protocol.blocks.values():
        felt.setdefault(block.task, []).extend(protocol.scene_for(name) for name in protocol.conditions_in(block.id))
    for name, scenes in felt.items():
        task = protocol.tasks[name]
        if not isinstance(task, Follow) or not any(_is_damper(scene) for scene in scenes):
            continue
        if (share := passed_share(velocity, rate_hz, task.frequency_hz)) < LEAST_SHARE:
            most_hz = _floored(fastest_hz(velocity, rate_hz, LEAST_SHARE), 1)
            yield Fault(
                ("tasks", name, "frequency_hz"),
                f"at {task.frequency_hz:g} Hz the velocity estimator passes {100 * share:.1f} % of a damper's force",
                f"at most {most_hz:g} Hz, where it passes {100 * LEAST_SHARE:g} %",
            )


def _is_damper(scene: Scene) -> bool:
    return any(liquid.drag.law == "linear" for liquid in scene.liquids)


def ends(protocol: Protocol, block: Block) -> Iterator[tuple[float | None, float, Scene]]:
    """Yield standard, level and scene at the strongest and the weakest level of each standard, but for delays."""
    stimulus = stimulus_of(protocol, block)
    if stimulus.vary == DELAY:
        return
    asked = method_of(protocol, block).asked(stimulus)
    scene = protocol.scene_for(condition_of(protocol, stimulus))
    for standard, level in product(standards_of(protocol, block), (max(asked), min(asked))):
        varied = scene
        if stimulus.vary not in OF_LINK:
            varied = override(scene, stimulus.vary, stimulus.comparison(standard, level))
        yield standard, level, varied


def highest_damping(protocol: Protocol, block: Block) -> float:
    """Return the highest damping that a block of levels presents [N·s/m at the hand]; 0 without a linear law."""
    dampings = (liquid.drag.damping_nspm for _, _, scene in ends(protocol, block) for liquid in scene.liquids)
    return max((damping or 0.0 for damping in dampings), default=0.0)


def beyond_slope_limit(protocol: Protocol, block: Block, delay_ticks: int) -> Fault | None:
    """Return that a block's highest level exceeds the slope limit for a delay [ticks]; None if it does not."""
    highest_nspm = highest_damping(protocol, block)
    for standard, level, scene in ends(protocol, block):
        limit_nspm = slope_limit(1 / scene.rate_hz, delay_ticks, scene.velocity)
        damping_nspm = max(liquid.drag.damping_nspm or 0.0 for liquid in scene.liquids)
        if damping_nspm == highest_nspm > limit_nspm:
            given = f"level {level:g}" if standard is None else f"standard {standard:g} at level {level:g}"
            loop = f"{scene.rate_hz:g} Hz, {scene.velocity.kind}, {delay_ticks} tick{'s' * (delay_ticks > 1)}"
            message = f"{given} gives {damping_nspm:g} N·s/m at the hand; the slope limit ({loop}) is {limit_nspm:g}"
            hint = _within_limit(stimulus_of(protocol, block), standard, level, limit_nspm)
            return Fault(("stimuli", str(block.stimulus), "levels"), message, hint)
    return None


def _clipped_levels(protocol: Protocol, block: Block) -> Iterator[Fault]:
    """Yield the first standard whose strongest level the force limit clips at the pace."""
    task, stimulus = protocol.tasks[block.task], stimulus_of(protocol, block)
    if not isinstance(task, Follow):
        return
    unit = f" {quantity(stimulus.vary).unit}".rstrip()
    for standard, level, scene in ends(protocol, block):
        what = f"{stimulus.comparison(standard, level):g}{unit}"
        if stimulus.vary in OF_LINK:
            what = f'"{condition_of(protocol, stimulus)}"'
        for message, hint in _clipped(scene, task, what):
            yield Fault(("stimuli", str(block.stimulus), "levels"), message, hint)
            return


def _within_limit(stimulus: Stimulus, standard: float | None, level: float, limit_nspm: float) -> str:
    """Return what keeps a damping within its limit."""
    if standard is None or stimulus.level_kind == "value":
        return f"levels to {_floored(limit_nspm, 1):g}"
    if standard >= limit_nspm:
        return f"the standard below {limit_nspm:g}"
    if stimulus.level_kind == "weber":
        most_level, most_standard = limit_nspm / standard - 1, limit_nspm / (1 + level)
    else:
        most_level, most_standard = limit_nspm - standard, limit_nspm - level
    return f"levels to {_floored(most_level, 3):g}, or the standard to {_floored(most_standard, 1):g}"


def _clipped(scene: Scene, task: Follow, what: str) -> Iterator[tuple[str, str]]:
    """Yield how much of a scene's force the force limit clips at the pace, and what would not be clipped."""
    pace_mps = task.fastest_stroke((0.0, 0.0, 0.0)).speed_mps
    if len(scene.liquids) != 1 or (drag_n := steady(scene, FASTER * pace_mps).drag_n) <= scene.force_limit_n:
        return
    least, most = 0.0, 1.0
    while most - least > 1e-6:
        share = (least + most) / 2
        fits = steady(scene, FASTER * share * pace_mps).drag_n <= scene.force_limit_n
        least, most = (share, most) if fits else (least, share)
    yield (
        f"{what} at {FASTER:g} times the paced {pace_mps:.3g} m/s is {drag_n:.1f} N; device.force_limit_n is "
        f"{scene.force_limit_n:g}",
        f"amplitude_mm = {_floored(least * task.amplitude_mm, 1):g} or "
        f"frequency_hz = {_floored(least * task.frequency_hz, 2):g}",
    )


def _floored(value: float, digits: int) -> float:
    """Return a value rounded down, with room for the rounding of what it was computed from."""
    step = math.pow(10, digits)
    return math.floor(value * step + 1e-6) / step
