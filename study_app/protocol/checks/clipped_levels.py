"""The levels of a block: what each presents, its force at the task's fastest point, and which limit would clip it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final, Literal

from study_app.haptics.model.overrides import override
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import slope_limit
from study_app.haptics.model.steady_state import steady
from study_app.protocol.blocks import Block
from study_app.protocol.model import Follow, Protocol
from study_app.protocol.source.problems import Fault
from study_app.protocol.trials.stimuli import DELAY, OF_CONDITION, OF_LINK, Stimulus
from study_app.protocol.trials.tracks import condition_of, method_of, standards_of, stimulus_of

FASTER: Final = 1.2
"""A hand exceeds the pace of its target by up to a fifth. [choice]"""
UNPACED_MPS: Final = 0.3
"""A hand that is free moves as fast. [choice]"""
MOST_NAMED: Final = 4
"""Of more clipped levels the first and the last of each row are named."""
PACED: Final = 'choose a task of kind "follow"'
_HALVINGS: Final = 20
_GIVES: Final = ("gives", "give")
_IS: Final = ("is", "are")


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
    damping_nspm : float
        Of a linear law [N·s/m at the hand]; 0 of others.
    """

    standard: float | None
    level: float
    comparison: float
    asked_n: float | None = None
    sent_n: float | None = None
    clipped_by: Literal["slope", "norm"] | None = None
    damping_nspm: float = 0.0


def levels(protocol: Protocol, block_id: str) -> tuple[Level, ...]:
    """Return every level that a block with a stimulus can present, standard by standard, the smallest first.

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
    varied = override(scene, stimulus.vary, comparison)
    force = steady(varied, hand_mps)
    return Level(standard, level, comparison, force.drag_n, force.force_n, force.limit, _damping_nspm(varied))


def hand_mps_of(protocol: Protocol, block: Block) -> float:
    """Return the speed of the hand at the fastest point of a block's task [m/s]."""
    task = protocol.tasks[block.task]
    return FASTER * task.fastest_stroke((0.0, 0.0, 0.0)).speed_mps if isinstance(task, Follow) else UNPACED_MPS


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
    return max((_damping_nspm(scene) for _, _, scene in ends(protocol, block)), default=0.0)


def beyond_slope_limit(protocol: Protocol, block: Block, delay_ticks: int) -> Fault | None:
    """Return that dampings of a block exceed the slope limit for a delay [ticks]; None if none does."""
    highest_nspm, stimulus = highest_damping(protocol, block), stimulus_of(protocol, block)
    for standard, level, scene in ends(protocol, block):
        limit_nspm, loop = _loop(scene, delay_ticks)
        if _damping_nspm(scene) == highest_nspm > limit_nspm:
            if stimulus.vary in OF_LINK:
                gives = f'"{condition_of(protocol, stimulus)}" gives'
                hint = f"damping_nspm = {floored(limit_nspm, 1):g}"
            else:
                every = levels(protocol, block.id)
                gives = _named(every, [one for one in every if one.damping_nspm > limit_nspm], _GIVES)
                hint = _within_limit(stimulus, standard, level, limit_nspm)
            message = f"{gives} {highest_nspm:g} N·s/m at the hand; {loop} is {limit_nspm:g}"
            return Fault(("stimuli", str(block.stimulus), "levels"), message, hint)
    return None


def clipped(protocol: Protocol, block: Block, delay_ticks: int) -> Iterator[Fault]:
    """Yield which levels of a block each limit clips; the force limit only where it clips more than the slope limit.

    Parameters
    ----------
    protocol : Protocol
        The study.
    block : Block
        A block with a stimulus; where its task sets no pace, only damping has a limit (`clipped_unpaced`).
    delay_ticks : int
        How many ticks late a force acts.
    """
    beyond = beyond_slope_limit(protocol, block, delay_ticks)
    if beyond is not None:
        yield beyond
    task, place = protocol.tasks[block.task], ("stimuli", str(block.stimulus), "levels")
    hand_mps, stimulus = hand_mps_of(protocol, block), stimulus_of(protocol, block)
    found = [(steady(scene, hand_mps), scene) for *_, scene in ends(protocol, block) if len(scene.liquids) == 1]
    if not isinstance(task, Follow) or all(force.limit is None for force, _ in found):
        return
    strongest, scene = max(found, key=lambda one: one[0].drag_n)
    if stimulus.vary in OF_LINK:
        condition = f'"{condition_of(protocol, stimulus)}" is'
        yield from (Fault(place, *words) for words in clipped_at_pace(scene, task, condition))
        return
    every, (limit_nspm, loop) = levels(protocol, block.id), _loop(scene, delay_ticks)
    by_loop = [one for one in every if one.damping_nspm > limit_nspm or one.clipped_by == "slope"]
    if by_loop and beyond is None:
        most = max(by_loop, key=lambda one: one.asked_n or 0.0)
        message = (
            f"{_named(every, by_loop, _IS)} {most.asked_n:.1f} N at {FASTER:g} times the paced "
            f"{hand_mps / FASTER:.3g} m/s; {loop} leaves {most.sent_n:.1f} N"
        )
        yield Fault(place, message, _highest_unclipped(protocol, block, most))
    by_force = [one for one in every if (one.asked_n or 0.0) > scene.force_limit_n]
    if strongest.drag_n > scene.force_limit_n and not set(by_force) <= set(by_loop):
        yield from (Fault(place, *words) for words in clipped_at_pace(scene, task, _named(every, by_force, _IS)))


def clipped_unpaced(protocol: Protocol, block: Block) -> str | None:
    """Return which levels are clipped in fast motions of a task without a pace, as a warning; None where none is."""
    found = [scene for *_, scene in ends(protocol, block) if len(scene.liquids) == 1]
    if isinstance(protocol.tasks[block.task], Follow) or all(steady(one, UNPACED_MPS).limit is None for one in found):
        return None
    every = levels(protocol, block.id)
    some = [one for one in every if one.clipped_by is not None]
    of = f" of {_listed(every, some)}" if some else ""  # a number of the condition changes no force
    by_loop = any(steady(one, UNPACED_MPS).limit == "slope" for one in found)
    limit = "by the slope limit" if by_loop else f"at {protocol.device.force_limit_n:g} N"
    return (
        f"tasks.{block.task}: at {UNPACED_MPS:g} m/s the force{of} is clipped {limit}: such trials are repeated: "
        f"{PACED}"
    )


def clipped_at_pace(scene: Scene, task: Follow, what: str) -> Iterator[tuple[str, str]]:
    """Yield how much of a scene's force the force limit clips at the pace, and what would not be clipped.

    ``what`` is the subject of the sentence with its verb: "standard 32 at level 0.6 is".
    """
    pace_mps = task.fastest_stroke((0.0, 0.0, 0.0)).speed_mps
    if len(scene.liquids) != 1 or (drag_n := steady(scene, FASTER * pace_mps).drag_n) <= scene.force_limit_n:
        return
    least, most = 0.0, 1.0
    while most - least > 1e-6:
        share = (least + most) / 2
        fits = steady(scene, FASTER * share * pace_mps).drag_n <= scene.force_limit_n
        least, most = (share, most) if fits else (least, share)
    yield (
        f"{what} {drag_n:.1f} N at {FASTER:g} times the paced {pace_mps:.3g} m/s; device.force_limit_n is "
        f"{scene.force_limit_n:g}",
        f"amplitude_mm = {floored(least * task.amplitude_mm, 1):g} or "
        f"frequency_hz = {floored(least * task.frequency_hz, 2):g}",
    )


def floored(value: float, digits: int) -> float:
    """Return a value rounded down, with room for the rounding of what it was computed from."""
    step = math.pow(10, digits)
    return math.floor(value * step + 1e-6) / step


def _damping_nspm(scene: Scene) -> float:
    return max(liquid.drag.damping_nspm or 0.0 for liquid in scene.liquids)


def _loop(scene: Scene, delay_ticks: int) -> tuple[float, str]:
    """Return the slope limit [N·s/m] of a scene's loop, and what it is called."""
    limit_nspm = slope_limit(1 / scene.rate_hz, delay_ticks, scene.velocity)
    ticks = f"{delay_ticks} tick{'s' * (delay_ticks > 1)}"
    return limit_nspm, f"the slope limit ({scene.rate_hz:g} Hz, {scene.velocity.kind}, {ticks})"


def _within_limit(stimulus: Stimulus, standard: float | None, level: float, limit_nspm: float) -> str:
    """Return what keeps a damping within its limit."""
    if standard is None or stimulus.level_kind == "value":
        return f"levels to {floored(limit_nspm, 1):g}"
    if standard >= limit_nspm:
        return f"the standard below {limit_nspm:g}"
    if stimulus.level_kind == "weber":
        most_level, most_standard = limit_nspm / standard - 1, limit_nspm / (1 + level)
    else:
        most_level, most_standard = limit_nspm - standard, limit_nspm - level
    return f"levels to {floored(most_level, 3):g}, or the standard to {floored(most_standard, 1):g}"


def _highest_unclipped(protocol: Protocol, block: Block, level: Level) -> str:
    """Return up to which level of a standard the loop leaves the force as asked, "" where not even the lowest."""
    stimulus, hand_mps = stimulus_of(protocol, block), hand_mps_of(protocol, block)
    scene = protocol.scene_for(condition_of(protocol, stimulus))
    least, most = stimulus.levels[0], level.level
    if _level(stimulus, scene, hand_mps, level.standard, least).clipped_by is not None:
        return ""
    for _ in range(_HALVINGS):
        middle = (least + most) / 2
        fits = _level(stimulus, scene, hand_mps, level.standard, middle).clipped_by is None
        least, most = (middle, most) if fits else (least, middle)
    return f"levels to {floored(least, 3):g}"


def _named(every: Sequence[Level], some: Sequence[Level], verbs: tuple[str, str]) -> str:
    """Return some levels as the subject of a sentence, with its verb: "levels 40 and 60 give up to"."""
    words = _listed(every, some)
    several = words.startswith("levels") or len({one.standard for one in some}) > 1
    return f"{words} {verbs[several]}{' up to' * (len(some) > 1)}"


def _listed(every: Sequence[Level], some: Sequence[Level]) -> str:
    """Return some levels by their standards; of many in a row the first and the last."""
    found = []
    for standard in dict.fromkeys(one.standard for one in some):
        own = [one for one in every if one.standard == standard]
        rows: list[list[Level]] = []
        for place, one in enumerate(own):
            if one not in some:
                continue
            if rows and own[place - 1] is rows[-1][-1] and len(some) > MOST_NAMED:
                rows[-1].append(one)
            else:
                rows.append([one])
        words = [_number(row[0].level) + (f" to {_number(row[-1].level)}" if row[1:] else "") for row in rows]
        joined = " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))
        levels_ = f"level{'s' * (len(rows) > 1 or len(rows[0]) > 1)} {joined}"
        found.append(levels_ if standard is None else f"standard {standard:g} at {levels_}")
    return " and ".join(filter(None, (", ".join(found[:-1]), found[-1])))


def _number(level: float) -> str:
    """Return a level with three digits."""
    return f"{float(f'{level:.3g}'):g}"
