"""Forces that are not delivered as requested: limits at the pace, lag of the estimator, energy of a late force.

These checks need an otherwise valid protocol. They also reject a hidden ball in a reaching task.

A damper b that is late by T returns E = (b V²/2ω)(sin ωT − ωT cos ωT) at each reversal of a sine with the peak speed V.
For other liquids, b is the force at V divided by V.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from itertools import product
from typing import Final

from study_app.haptics.model.device_dynamics import ASSUMED_TICKS
from study_app.haptics.model.estimators import NAMED
from study_app.haptics.model.overrides import override_value
from study_app.haptics.model.scene import ForceLink, Scene, Velocity
from study_app.haptics.model.slope_limits import slope_limit, steady_force
from study_app.number_text import counted
from study_app.protocol.blocks import Block
from study_app.protocol.model import Follow, Protocol, Reach
from study_app.protocol.presented.presented_levels import (
    FASTER,
    UNPACED_MPS,
    Level,
    damping_of,
    extreme_levels,
    hand_mps_of,
    level_limits,
    levels,
)
from study_app.protocol.source.document import Path
from study_app.protocol.source.problems import Fault
from study_app.protocol.trials.stimuli import OF_LINK, Stimulated, Stimulus
from study_app.protocol.trials.tasks import Stroke

_LEAST_SHARE: Final = 0.99
"""Smallest proportion of a damper's force that the velocity estimator must pass."""
LIMIT_J: Final = 0.5e-3
"""Returned energy up to which a late force is delivered [J]; measured in docs/late-force.md."""
_MAX_NAMED: Final = 4
"""Greatest number of clipped levels that are all named; of more, only the ends of each run are."""
PACED: Final = 'choose a task of type "follow"'
_PRODUCES: Final = ("produces", "produce")


def check_paced(protocol: Protocol, delay_ticks: int = ASSUMED_TICKS) -> Iterator[Fault]:
    """Yield the faults of tasks of kind "follow", and of hidden balls in tasks that require aiming.

    The protocol must be valid otherwise. Forces act ``delay_ticks`` ticks late.
    """
    for block in protocol.blocks.values():
        for name in protocol.conditions_in(block.id) if isinstance(protocol.tasks[block.task], Reach) else ():
            if protocol.conditions[name].ball == "hidden":
                message = f'is hidden, but participants must see it for the reaching task of block "{block.id}"'
                yield Fault(("conditions", name, "ball"), message, 'choose a task of type "follow" or "explore"')
    yield from _check_estimator_lag(protocol)
    for blocks in blocks_by_stimulus(protocol):
        yield from _check_clipping(protocol, blocks, delay_ticks)
    for block in protocol.blocks.values():
        for index, name in enumerate(block.conditions if block.stimulus is None else ()):
            place = ("blocks", block.id, "conditions", index)
            yield from _check_force_at_pace(protocol, block, protocol.scene_for(name), f'"{name}" produces', place)


def _check_estimator_lag(protocol: Protocol) -> Iterator[Fault]:
    """Check that the velocity estimator passes a damper's force at the frequency of each moving target."""
    velocity, rate_hz = protocol.scene.velocity, protocol.device.rate_hz
    scenes_by_task: dict[str, list[Scene]] = {}
    for block in protocol.blocks.values():
        scenes_by_task.setdefault(block.task, []).extend(
            protocol.scene_for(name) for name in protocol.conditions_in(block.id)
        )
    for name, scenes in scenes_by_task.items():
        task = protocol.tasks[name]
        laws = {liquid.drag.law for scene in scenes for liquid in scene.liquids}
        if not isinstance(task, Follow) or "linear" not in laws:
            continue
        if (proportion := passed_share(velocity, rate_hz, task.frequency_hz)) < _LEAST_SHARE:
            most_hz = _round_down(fastest_hz(velocity, rate_hz, _LEAST_SHARE), 1)
            yield Fault(
                ("tasks", name, "frequency_hz"),
                f"at {task.frequency_hz:g} Hz the velocity estimator passes only {100 * proportion:.1f} % of a "
                "damper's force",
                f"choose at most {most_hz:g} Hz, where it passes {100 * _LEAST_SHARE:g} %",
            )


def blocks_by_stimulus(protocol: Protocol) -> list[list[Block]]:
    """Return the blocks with levels, grouped by stimulus."""
    blocks_of: dict[str, list[Block]] = {}
    for block in protocol.blocks.values():
        if block.stimulus is not None:
            blocks_of.setdefault(block.stimulus, []).append(block)
    return list(blocks_of.values())


def slope_limit_fault(protocol: Protocol, blocks: Sequence[Block], delay_ticks: int) -> Fault | None:
    """Return a fault if dampings of one stimulus exceed the slope limit for a delay [ticks], else None."""
    stimulus = protocol.stimulus_of(blocks[0])
    extremes = [extreme for block in blocks for extreme in extreme_levels(protocol, block)]
    if not extremes:
        return None
    standard, level, scene = max(extremes, key=lambda extreme: damping_of(extreme[2]))
    highest_nspm, (limit_nspm, loop) = damping_of(scene), _slope_limit(scene, delay_ticks)
    if highest_nspm <= limit_nspm:
        return None
    if stimulus.vary in OF_LINK:
        subject = f'"{protocol.condition_of(stimulus)}" produces'
        hint = f"damping_nspm = {_round_down(limit_nspm, 1):g}"
    else:
        all_levels = list(_levels_at_strongest_force(protocol, blocks))
        subject = _levels_with_verb(all_levels, [level for level in all_levels if level.damping_nspm > limit_nspm])
        hint = _damping_hint(stimulus, standard, level, limit_nspm)
    message = f"{subject} {highest_nspm:g} N·s/m of damping at the hand, but {loop} is {limit_nspm:g}"
    return Fault(("stimuli", str(blocks[0].stimulus), "levels"), message, hint)


def _check_clipping(protocol: Protocol, blocks: Sequence[Block], delay_ticks: int) -> Iterator[Fault]:
    """Yield a fault for the levels that each limit clips; levels that both clip count for the slope limit.

    The blocks have the same stimulus. In tasks without a pace, only damping is checked (`unpaced_clipping_warning`).
    Forces act ``delay_ticks`` ticks late.
    """
    slope_fault = slope_limit_fault(protocol, blocks, delay_ticks)
    if slope_fault is not None:
        yield slope_fault
    place, stimulus = ("stimuli", str(blocks[0].stimulus), "levels"), protocol.stimulus_of(blocks[0])
    blocks = [block for block in blocks if isinstance(protocol.tasks[block.task], Follow)]
    single_liquid_scenes = [
        (block, scene) for block in blocks for *_, scene in extreme_levels(protocol, block) if len(scene.liquids) == 1
    ]
    if all(steady_force(scene, hand_mps_of(protocol, block)).limit is None for block, scene in single_liquid_scenes):
        return
    condition = protocol.condition_of(stimulus)
    if stimulus.vary in OF_LINK:
        block, scene = max(single_liquid_scenes, key=lambda pair: hand_mps_of(protocol, pair[0]))
        yield from _check_force_at_pace(protocol, block, scene, f'"{condition}" produces', place)
        return
    all_levels, scene = _levels_at_strongest_force(protocol, blocks), protocol.scene_for(condition)
    limit_nspm, loop = _slope_limit(scene, delay_ticks)
    by_loop = [level for level in all_levels if level.damping_nspm > limit_nspm or level.clipped_by == "slope"]
    if by_loop and slope_fault is None:
        strongest = max(by_loop, key=lambda level: level.asked_n or 0.0)
        message = (
            f"{_levels_with_verb(list(all_levels), by_loop)} {strongest.asked_n:.1f} N at {FASTER:g} times the paced "
            f"speed of {hand_mps_of(protocol, all_levels[strongest]) / FASTER:.3g} m/s, but {loop} allows only "
            f"{strongest.sent_n:.1f} N"
        )
        yield Fault(place, message, _highest_level_hint(protocol, all_levels[strongest], strongest.standard))
    by_force = [level for level in all_levels if (level.asked_n or 0.0) > scene.force_limit_n and level not in by_loop]
    if by_force:
        strongest = max(by_force, key=lambda level: level.asked_n or 0.0)
        strongest_scene = override_value(scene, stimulus.vary, strongest.comparison)
        subject = _levels_with_verb(list(all_levels), by_force)
        yield from _check_force_at_pace(protocol, all_levels[strongest], strongest_scene, subject, place)


def _levels_at_strongest_force(protocol: Protocol, blocks: Sequence[Block]) -> dict[Level, Block]:
    """Return the distinct levels of a stimulus, each with the block in which its force is largest."""
    levels_by_value: dict[tuple[float, float], tuple[Level, Block]] = {}
    for block in blocks:
        for level in levels(protocol, block.id):
            known = levels_by_value.get(key := (level.standard or 0.0, level.level))
            if known is None or (level.asked_n or 0.0) > (known[0].asked_n or 0.0):
                levels_by_value[key] = level, block
    return dict(levels_by_value[key] for key in sorted(levels_by_value))


def unpaced_clipping_warning(protocol: Protocol, blocks: Sequence[Block]) -> str | None:
    """Return a warning about levels clipped in fast motions of a task without a pace, or None.

    The blocks have the same stimulus and the same task.
    """
    task = blocks[0].task
    scenes = [scene for block in blocks for *_, scene in extreme_levels(protocol, block) if len(scene.liquids) == 1]
    if isinstance(protocol.tasks[task], Follow) or all(
        steady_force(scene, UNPACED_MPS).limit is None for scene in scenes
    ):
        return None
    all_levels = list(_levels_at_strongest_force(protocol, blocks))
    clipped_levels = [level for level in all_levels if level.clipped_by is not None]
    of_levels = (
        f" of {_level_ranges(all_levels, clipped_levels)}" if clipped_levels else ""
    )  # numbers of the condition do not change the force
    by_loop = any(steady_force(scene, UNPACED_MPS).limit == "slope" for scene in scenes)
    limit = "by the slope limit" if by_loop else f"at {protocol.device.force_limit_n:g} N"
    problem = f"at {UNPACED_MPS:g} m/s the force{of_levels} is clipped {limit}"
    return f"tasks.{task}: {problem}, and clipped trials are repeated; {PACED}"


def _check_force_at_pace(protocol: Protocol, block: Block, scene: Scene, subject: str, place: Path) -> Iterator[Fault]:
    """Yield a fault with a remedy if the force limit clips a scene at a block's pace.

    ``subject`` begins the sentence: "standard 32 at level 0.6 produces".
    """
    task = protocol.tasks[block.task]
    if not isinstance(task, Follow):
        return
    pace_mps = task.fastest_stroke((0.0, 0.0, 0.0)).speed_mps
    if len(scene.liquids) != 1 or (drag_n := steady_force(scene, FASTER * pace_mps).drag_n) <= scene.force_limit_n:
        return
    pace = FASTER * pace_mps
    clipped_from = bisect_left(
        range(10**6), True, key=lambda n: steady_force(scene, n * 1e-6 * pace).drag_n > scene.force_limit_n
    )
    unclipped_share = (clipped_from - 1) * 1e-6
    yield Fault(
        place,
        f"{subject} {drag_n:.1f} N at {FASTER:g} times the paced speed of {pace_mps:.3g} m/s, but device.force_limit_n "
        f"is {scene.force_limit_n:g}",
        f"amplitude_mm = {_round_down(unclipped_share * task.amplitude_mm, 1):g} or "
        f"frequency_hz = {_round_down(unclipped_share * task.frequency_hz, 2):g}",
    )


def _round_down(value: float, digits: int) -> float:
    """Return a value rounded down, with a margin for its rounding error."""
    step = math.pow(10, digits)
    return math.floor(value * step + 1e-6) / step


def _slope_limit(scene: Scene, delay_ticks: int) -> tuple[float, str]:
    """Return the slope limit of a scene's servo loop [N·s/m], and its description."""
    limit_nspm = slope_limit(1 / scene.rate_hz, delay_ticks, scene.velocity)
    ticks = counted(delay_ticks, "tick")
    return limit_nspm, f"the slope limit ({scene.rate_hz:g} Hz, {scene.velocity.kind}, {ticks})"


def _damping_hint(stimulus: Stimulus, standard: float | None, level: float, limit_nspm: float) -> str:
    """Return the hint on how to keep a damping within its limit."""
    if standard is None or stimulus.level_kind == "value":
        return f"choose levels up to {_round_down(limit_nspm, 1):g}"
    if standard >= limit_nspm:
        return f"choose a standard below {limit_nspm:g}"
    if stimulus.level_kind == "weber":
        most_level, most_standard = limit_nspm / standard - 1, limit_nspm / (1 + level)
    else:
        most_level, most_standard = limit_nspm - standard, limit_nspm - level
    lower_standard = f"a standard up to {_round_down(most_standard, 1):g}"
    return f"choose levels up to {_round_down(most_level, 3):g}, or {lower_standard}"


def _highest_level_hint(protocol: Protocol, block: Block, standard: float | None) -> str:
    """Return the hint with the highest level of a standard that no limit clips; "" if all are clipped."""
    stimulus, limits = protocol.stimulus_of(block), level_limits(protocol, block)
    if limits is None or not limits.lowest:
        return ""
    highest = stimulus.level_between(standard, limits.lowest)
    return f"choose levels up to {_round_down(highest, 3):g}" if highest >= stimulus.levels[0] else ""


def _levels_with_verb(all_levels: Sequence[Level], named_levels: Sequence[Level]) -> str:
    """Return the beginning of a sentence on some of all levels: "levels 40 and 60 produce up to"."""
    subject = _level_ranges(all_levels, named_levels)
    is_plural = subject.startswith("levels") or len({level.standard for level in named_levels}) > 1
    return f"{subject} {_PRODUCES[is_plural]}{' up to' * (len(named_levels) > 1)}"


def _level_ranges(all_levels: Sequence[Level], named_levels: Sequence[Level]) -> str:
    """Return some of all levels by standard as text; long runs are abbreviated to the first and the last level."""
    phrases = []
    for standard in dict.fromkeys(level.standard for level in named_levels):
        standard_levels = [level for level in all_levels if level.standard == standard]
        runs: list[list[Level]] = []
        for index, level in enumerate(standard_levels):
            if level not in named_levels:
                continue
            if runs and standard_levels[index - 1] is runs[-1][-1] and len(named_levels) > _MAX_NAMED:
                runs[-1].append(level)
            else:
                runs.append([level])
        ends = [[f"{float(f'{level.level:.3g}'):g}" for level in (run[0], run[-1])] for run in runs]
        ranges = [f"{low} to {high}" if run[1:] else low for run, (low, high) in zip(runs, ends, strict=True)]
        joined = " and ".join(filter(None, (", ".join(ranges[:-1]), ranges[-1])))
        levels_text = f"level{'s' * (len(runs) > 1 or len(runs[0]) > 1)} {joined}"
        phrases.append(levels_text if standard is None else f"standard {standard:g} at {levels_text}")
    return " and ".join(filter(None, (", ".join(phrases[:-1]), phrases[-1])))


def passed_share(velocity: Velocity, rate_hz: float, frequency_hz: float) -> float:
    """Return the ratio of estimated to true velocity, Re V/(jωX), in an evenly sampled oscillation.

    For "ewma" it follows from the recursion, for "kalman" from its lag.
    """
    return NAMED[velocity.kind].passed_share(velocity, 1 / rate_hz, 2 * math.pi * frequency_hz)


def fastest_hz(velocity: Velocity, rate_hz: float, share: float) -> float:
    """Return the highest frequency up to 20 Hz at which an estimator passes at least this proportion [Hz, to 1 mHz]."""
    mhz = range(1, 20_000)
    return (
        bisect_left(mhz, True, key=lambda frequency_mhz: passed_share(velocity, rate_hz, frequency_mhz / 1000) < share)
        / 1000
    )


def check_returned_energy(protocol: Protocol) -> Iterator[Fault]:
    """Yield a fault for each block with levels and a paced task if its delayed force returns too much energy."""
    blocks_and_strokes = (
        (block, task.fastest_stroke(protocol.device.workspace_m))
        for block in protocol.blocks.values()
        if block.stimulus is not None and isinstance(task := protocol.tasks[block.task], Follow)
    )
    yield from dict.fromkeys(
        filter(None, (_returned_energy_fault(protocol, block, stroke) for block, stroke in blocks_and_strokes))
    )


def _returned_energy_fault(protocol: Protocol, block: Block, stroke: Stroke) -> Fault | None:
    """Return a fault with the level that returns most energy if that exceeds the limit, else None."""
    stimulus = protocol.stimulus_of(block)
    condition = protocol.condition_of(stimulus)
    if len(protocol.conditions[condition].liquid_ids) > 1:
        return None
    presented: list[tuple[float, float, float]] = []
    for standard, level in product(protocol.standards_of(block), stimulus.levels):
        scene = protocol.presented_scene(Stimulated(condition, stimulus.vary, stimulus.comparison(standard, level)))
        damping, delay_s = damping_nspm(scene, stroke), scene.link.mean_delay_s(scene.rate_hz)
        presented.append((returned_j(damping, stroke, delay_s), damping, delay_s))
    most_j, damping, delay_s = max(presented)
    if most_j <= LIMIT_J:
        return None
    return Fault(
        ("stimuli", str(block.stimulus), "levels"),
        f"damping of {damping:.3g} N·s/m with a delay of {1000 * delay_s:.3g} ms returns {1000 * most_j:.1f} mJ per "
        "motion reversal, and the passivity controller removes this energy",
        f"choose a delay of at most {longest_delay_ms(damping, stroke)} ms, at which the damping returns "
        f"{1000 * LIMIT_J:g} mJ",
    )


def damping_nspm(scene: Scene, stroke: Stroke) -> float:
    """Return the damping of a scene's liquid at the greatest speed of a stroke, at the hand [N·s/m]."""
    return steady_force(scene, stroke.speed_mps).drag_n / stroke.speed_mps


def returned_j(damping: float, stroke: Stroke, delay_s: float) -> float:
    """Return the energy that a delayed damper [N·s/m] returns to the hand at each reversal of a stroke [J]."""
    omega = 2 * math.pi * stroke.frequency_hz
    angle = omega * delay_s
    return damping * stroke.speed_mps**2 / (2 * omega) * (math.sin(angle) - angle * math.cos(angle))


def longest_delay_ms(damping: float, stroke: Stroke) -> float:
    """Return the longest delay at which a damper [N·s/m] returns no more energy than the limit [whole ms]."""
    excessive = (
        delay_ms
        for delay_ms in range(ForceLink.MOST_DELAY_MS + 1)
        if returned_j(damping, stroke, delay_ms / 1000) > LIMIT_J
    )
    return next(excessive, ForceLink.MOST_DELAY_MS + 1) - 1
