"""Forces that are not delivered as requested: limits at the pace, lag of the estimator, energy of a late force.

These checks need a sound protocol; a hidden ball in a reaching task is found here, too.

A damper b that is late by T returns E = (b V²/2ω)(sin ωT − ωT cos ωT) at each reversal of a sine with the peak speed V.
Of other liquids b is the force at V over V.
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
"""Of a damper, that the velocity estimator must pass."""
LIMIT_J: Final = 0.5e-3
"""A force that returns no more is delivered; measured in docs/late-force.md."""
_MOST_NAMED: Final = 4
"""Of more clipped levels the first and the last of each row are named."""
PACED: Final = 'choose a task of type "follow"'
_PRODUCES: Final = ("produces", "produce")


def check_paced(protocol: Protocol, delay_ticks: int = ASSUMED_TICKS) -> Iterator[Fault]:
    """Yield the faults of tasks of kind "follow", and of hidden balls in tasks that require aiming.

    The study is valid otherwise; a force acts ``delay_ticks`` ticks late.
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
            yield from _check_clipping_at_pace(protocol, block, protocol.scene_for(name), f'"{name}" produces', place)


def _check_estimator_lag(protocol: Protocol) -> Iterator[Fault]:
    """Check that the velocity estimator passes a damper's force at the frequency of each target."""
    velocity, rate_hz = protocol.scene.velocity, protocol.device.rate_hz
    of_task: dict[str, list[Scene]] = {}
    for block in protocol.blocks.values():
        of_task.setdefault(block.task, []).extend(protocol.scene_for(name) for name in protocol.conditions_in(block.id))
    for name, scenes in of_task.items():
        task = protocol.tasks[name]
        laws = {liquid.drag.law for scene in scenes for liquid in scene.liquids}
        if not isinstance(task, Follow) or "linear" not in laws:
            continue
        if (share := passed_share(velocity, rate_hz, task.frequency_hz)) < _LEAST_SHARE:
            most_hz = _round_down(fastest_hz(velocity, rate_hz, _LEAST_SHARE), 1)
            yield Fault(
                ("tasks", name, "frequency_hz"),
                f"at {task.frequency_hz:g} Hz the velocity estimator passes only {100 * share:.1f} % of a damper's "
                "force",
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
        every = list(_levels_at_strongest_force(protocol, blocks))
        subject = _levels_with_verb(every, [level for level in every if level.damping_nspm > limit_nspm])
        hint = _remedy(stimulus, standard, level, limit_nspm)
    message = f"{subject} {highest_nspm:g} N·s/m of damping at the hand, but {loop} is {limit_nspm:g}"
    return Fault(("stimuli", str(blocks[0].stimulus), "levels"), message, hint)


def _check_clipping(protocol: Protocol, blocks: Sequence[Block], delay_ticks: int) -> Iterator[Fault]:
    """Yield the levels that each limit clips; a level that both clip counts for the slope limit.

    The blocks have one stimulus; without a pace, only damping has a limit (`unpaced_clipping_warning`).
    A force acts ``delay_ticks`` ticks late.
    """
    beyond = slope_limit_fault(protocol, blocks, delay_ticks)
    if beyond is not None:
        yield beyond
    place, stimulus = ("stimuli", str(blocks[0].stimulus), "levels"), protocol.stimulus_of(blocks[0])
    blocks = [block for block in blocks if isinstance(protocol.tasks[block.task], Follow)]
    felt = [
        (block, scene) for block in blocks for *_, scene in extreme_levels(protocol, block) if len(scene.liquids) == 1
    ]
    if all(steady_force(scene, hand_mps_of(protocol, block)).limit is None for block, scene in felt):
        return
    condition = protocol.condition_of(stimulus)
    if stimulus.vary in OF_LINK:
        block, scene = max(felt, key=lambda pair: hand_mps_of(protocol, pair[0]))
        yield from _check_clipping_at_pace(protocol, block, scene, f'"{condition}" produces', place)
        return
    every, scene = _levels_at_strongest_force(protocol, blocks), protocol.scene_for(condition)
    limit_nspm, loop = _slope_limit(scene, delay_ticks)
    by_loop = [level for level in every if level.damping_nspm > limit_nspm or level.clipped_by == "slope"]
    if by_loop and beyond is None:
        most = max(by_loop, key=lambda level: level.asked_n or 0.0)
        message = (
            f"{_levels_with_verb(list(every), by_loop)} {most.asked_n:.1f} N at {FASTER:g} times the paced "
            f"speed of {hand_mps_of(protocol, every[most]) / FASTER:.3g} m/s, but {loop} allows only "
            f"{most.sent_n:.1f} N"
        )
        yield Fault(place, message, _highest_unclipped_level(protocol, every[most], most.standard))
    by_force = [level for level in every if (level.asked_n or 0.0) > scene.force_limit_n and level not in by_loop]
    if by_force:
        most = max(by_force, key=lambda level: level.asked_n or 0.0)
        strongest = override_value(scene, stimulus.vary, most.comparison)
        named = _levels_with_verb(list(every), by_force)
        yield from _check_clipping_at_pace(protocol, every[most], strongest, named, place)


def _levels_at_strongest_force(protocol: Protocol, blocks: Sequence[Block]) -> dict[Level, Block]:
    """Return each level of one stimulus once, with the block in which its force is the largest."""
    levels_by_value: dict[tuple[float, float], tuple[Level, Block]] = {}
    for block in blocks:
        for level in levels(protocol, block.id):
            known = levels_by_value.get(key := (level.standard or 0.0, level.level))
            if known is None or (level.asked_n or 0.0) > (known[0].asked_n or 0.0):
                levels_by_value[key] = level, block
    return dict(levels_by_value[key] for key in sorted(levels_by_value))


def unpaced_clipping_warning(protocol: Protocol, blocks: Sequence[Block]) -> str | None:
    """Return a warning about levels clipped in fast motions of a task without a pace, or None.

    The blocks have one stimulus and one task.
    """
    task = blocks[0].task
    scenes = [scene for block in blocks for *_, scene in extreme_levels(protocol, block) if len(scene.liquids) == 1]
    if isinstance(protocol.tasks[task], Follow) or all(
        steady_force(scene, UNPACED_MPS).limit is None for scene in scenes
    ):
        return None
    every = list(_levels_at_strongest_force(protocol, blocks))
    some = [level for level in every if level.clipped_by is not None]
    of = f" of {_level_ranges(every, some)}" if some else ""  # a number of the condition changes no force
    by_loop = any(steady_force(scene, UNPACED_MPS).limit == "slope" for scene in scenes)
    limit = "by the slope limit" if by_loop else f"at {protocol.device.force_limit_n:g} N"
    clipped = f"at {UNPACED_MPS:g} m/s the force{of} is clipped {limit}"
    return f"tasks.{task}: {clipped}, and clipped trials are repeated; {PACED}"


def _check_clipping_at_pace(protocol: Protocol, block: Block, scene: Scene, what: str, place: Path) -> Iterator[Fault]:
    """Yield a fault if the force limit clips a scene at a block's pace, with the share and the remedy.

    ``what`` is the subject of the sentence with its verb: "standard 32 at level 0.6 produces".
    """
    task = protocol.tasks[block.task]
    if not isinstance(task, Follow):
        return
    pace_mps = task.fastest_stroke((0.0, 0.0, 0.0)).speed_mps
    if len(scene.liquids) != 1 or (drag_n := steady_force(scene, FASTER * pace_mps).drag_n) <= scene.force_limit_n:
        return
    pace = FASTER * pace_mps
    beyond = bisect_left(
        range(10**6), True, key=lambda n: steady_force(scene, n * 1e-6 * pace).drag_n > scene.force_limit_n
    )
    least = (beyond - 1) * 1e-6
    yield Fault(
        place,
        f"{what} {drag_n:.1f} N at {FASTER:g} times the paced speed of {pace_mps:.3g} m/s, but device.force_limit_n "
        f"is {scene.force_limit_n:g}",
        f"amplitude_mm = {_round_down(least * task.amplitude_mm, 1):g} or "
        f"frequency_hz = {_round_down(least * task.frequency_hz, 2):g}",
    )


def _round_down(value: float, digits: int) -> float:
    """Return a value rounded down, with a margin for rounding errors of the value itself."""
    step = math.pow(10, digits)
    return math.floor(value * step + 1e-6) / step


def _slope_limit(scene: Scene, delay_ticks: int) -> tuple[float, str]:
    """Return the slope limit of a scene's loop [N·s/m] and its name."""
    limit_nspm = slope_limit(1 / scene.rate_hz, delay_ticks, scene.velocity)
    ticks = counted(delay_ticks, "tick")
    return limit_nspm, f"the slope limit ({scene.rate_hz:g} Hz, {scene.velocity.kind}, {ticks})"


def _remedy(stimulus: Stimulus, standard: float | None, level: float, limit_nspm: float) -> str:
    """Return the remedy that keeps a damping within its limit."""
    if standard is None or stimulus.level_kind == "value":
        return f"choose levels up to {_round_down(limit_nspm, 1):g}"
    if standard >= limit_nspm:
        return f"choose a standard below {limit_nspm:g}"
    if stimulus.level_kind == "weber":
        most_level, most_standard = limit_nspm / standard - 1, limit_nspm / (1 + level)
    else:
        most_level, most_standard = limit_nspm - standard, limit_nspm - level
    lower = f"a standard up to {_round_down(most_standard, 1):g}"
    return f"choose levels up to {_round_down(most_level, 3):g}, or {lower}"


def _highest_unclipped_level(protocol: Protocol, block: Block, standard: float | None) -> str:
    """Return the highest level of a standard that no limit clips; "" if all are clipped."""
    stimulus, limits = protocol.stimulus_of(block), level_limits(protocol, block)
    if limits is None or not limits.lowest:
        return ""
    highest = stimulus.level_between(standard, limits.lowest)
    return f"choose levels up to {_round_down(highest, 3):g}" if highest >= stimulus.levels[0] else ""


def _levels_with_verb(every: Sequence[Level], some: Sequence[Level]) -> str:
    """Return levels as the subject of a sentence with its verb: "levels 40 and 60 produce up to"."""
    subject = _level_ranges(every, some)
    several = subject.startswith("levels") or len({level.standard for level in some}) > 1
    return f"{subject} {_PRODUCES[several]}{' up to' * (len(some) > 1)}"


def _level_ranges(every: Sequence[Level], some: Sequence[Level]) -> str:
    """Return levels by standard as text; long runs are abbreviated to the first and the last."""
    phrases = []
    for standard in dict.fromkeys(level.standard for level in some):
        own = [level for level in every if level.standard == standard]
        rows: list[list[Level]] = []
        for place, level in enumerate(own):
            if level not in some:
                continue
            if rows and own[place - 1] is rows[-1][-1] and len(some) > _MOST_NAMED:
                rows[-1].append(level)
            else:
                rows.append([level])
        ends = [[f"{float(f'{level.level:.3g}'):g}" for level in (row[0], row[-1])] for row in rows]
        ranges = [f"{low} to {high}" if row[1:] else low for row, (low, high) in zip(rows, ends, strict=True)]
        joined = " and ".join(filter(None, (", ".join(ranges[:-1]), ranges[-1])))
        levels_ = f"level{'s' * (len(rows) > 1 or len(rows[0]) > 1)} {joined}"
        phrases.append(levels_ if standard is None else f"standard {standard:g} at {levels_}")
    return " and ".join(filter(None, (", ".join(phrases[:-1]), phrases[-1])))


def passed_share(velocity: Velocity, rate_hz: float, frequency_hz: float) -> float:
    """Return Re V/(jωX), estimated over true velocity in an oscillation at ``frequency_hz``, evenly sampled.

    For "ewma" it follows from the recursion, for "kalman" from its lag.
    """
    return NAMED[velocity.kind].passed_share(velocity, 1 / rate_hz, 2 * math.pi * frequency_hz)


def fastest_hz(velocity: Velocity, rate_hz: float, share: float) -> float:
    """Return the highest frequency at which an estimator passes at least this share [Hz], to 1 mHz; at most 20 Hz."""
    mhz = range(1, 20_000)
    return (
        bisect_left(mhz, True, key=lambda frequency_mhz: passed_share(velocity, rate_hz, frequency_mhz / 1000) < share)
        / 1000
    )


def check_returned_energy(protocol: Protocol) -> Iterator[Fault]:
    """Yield faults for blocks of levels in a paced motion whose delayed force returns too much energy."""
    strokes = (
        (block, task.fastest_stroke(protocol.device.workspace_m))
        for block in protocol.blocks.values()
        if block.stimulus is not None and isinstance(task := protocol.tasks[block.task], Follow)
    )
    yield from dict.fromkeys(
        filter(None, (_returned_energy_fault(protocol, block, stroke) for block, stroke in strokes))
    )


def _returned_energy_fault(protocol: Protocol, block: Block, stroke: Stroke) -> Fault | None:
    """Return a fault if a block's force returns more energy than the limit, with the level that returns most."""
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
    beyond = (
        delay_ms
        for delay_ms in range(ForceLink.MOST_DELAY_MS + 1)
        if returned_j(damping, stroke, delay_ms / 1000) > LIMIT_J
    )
    return next(beyond, ForceLink.MOST_DELAY_MS + 1) - 1
