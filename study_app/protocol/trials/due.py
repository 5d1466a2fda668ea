"""What a trial with intervals presents: a pure function of protocol, key, schedule, trial and the answers so far.

No clock, no measured number and no generator's state enters: a resumed session, another process and ``reproduce`` find
the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, Trial
from study_app.protocol.streams import Draw, shuffle
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.keyed import Key, keyed_stream
from study_app.protocol.trials.method import Heard, TrackSetting
from study_app.protocol.trials.stimuli import Stimulated
from study_app.protocol.trials.tracks import Track, condition_of, design_of, method_of, stimulus_of, track_of

STANDARD_ALONE: Final = 1
"""The arrangement of a noise trial, in a design that has any."""


@dataclass(frozen=True, slots=True, repr=False)
class Due:
    """What a trial presents; never printed.

    Attributes
    ----------
    level : float or None
        The level; 0 where only the standard is presented, None where conditions are compared.
    standard : float or None
        The standard, in the unit of the varied number; None without one.
    arrangement : int
        Which of the design's arrangements.
    intervals : tuple of Stimulated
        What each interval presents, in order.
    catch : bool
        True for a catch trial, which presents the largest level.
    """

    level: float | None
    standard: float | None
    arrangement: int
    intervals: tuple[Stimulated, ...]
    catch: bool = False


def next_level(protocol: Protocol, key: Key, schedule: Schedule, trial: Trial, heard: Sequence[Heard]) -> Due | None:
    """Return what a trial presents; None where its track has ended or its block met its criterion: it is passed over.

    Parameters
    ----------
    protocol : Protocol
        The study.
    key : Key
        Its opened key.
    schedule : Schedule
        The session's steps; participant and seed name the draws.
    trial : Trial
        A trial of a block with a design.
    heard : sequence of Heard
        The answered trials, in any order; only earlier ones count.
    """
    block = protocol.blocks[trial.block]
    track = track_of(protocol, block, key.codes[block.id][trial.code])
    earlier = [one for one in heard if one.trial < trial.number]
    if criterion_met(block, schedule, earlier):
        return None
    numbers = {one.number for one in schedule.trials if (one.block, one.code) == (trial.block, trial.code)}
    slot = sum(number < trial.number for number in numbers)
    draws = _Draws(key.secret, f"{schedule.participant}/{schedule.seed}/{block.id}/{trial.code}")
    design = design_of(protocol, block)
    if design.first is not None:
        if trial.index == 1:
            return due_of(protocol, block, track, 0, design.first.level)
        slot -= 1
    if track.comparison is not None:  # conditions are compared
        return due_of(protocol, block, track, draws.arrangement(design, slot), None)
    method, stimulus = method_of(protocol, block), stimulus_of(protocol, block)
    setting = TrackSetting(stimulus, design, track.number)
    answered = sorted((one for one in earlier if one.trial in numbers and not one.catch), key=lambda one: one.trial)
    if method.ended(setting, answered):
        return None
    catch = draws.catch(track.catch)
    if slot in catch:
        arrangement = draws.arrangement(design, catch.index(slot), "catch")
        return due_of(protocol, block, track, arrangement, stimulus.levels[1], catch=True)
    slot -= sum(one < slot for one in catch)
    noise = draws.noise(design.noise(method.presentations(stimulus)), track.slots - len(catch))
    if slot in noise:
        return due_of(protocol, block, track, STANDARD_ALONE, 0.0)
    rounds = draws.rounds(method.rounds(stimulus))
    level = method.level(setting, slot - sum(one < slot for one in noise), answered, rounds)
    return due_of(protocol, block, track, draws.arrangement(design, slot), level)


def criterion_met(block: Block, schedule: Schedule, heard: Sequence[Heard]) -> bool:
    """Return whether so many of a block's last answers among those ``heard`` were correct that it ends."""
    if block.until is None:
        return False
    numbers = {one.number for one in schedule.trials if one.block == block.id}
    latest = sorted((one for one in heard if one.trial in numbers), key=lambda one: one.trial)[-block.until.of :]
    return sum(one.correct is True for one in latest) >= block.until.right


@dataclass(frozen=True, slots=True, repr=False)
class _Draws:
    """The secret draws of one track; each kind of draw has streams of its own, so that none moves another."""

    secret: bytes
    track: str

    def arrangement(self, design: Design, slot: int, among: str = "arrangement") -> int:
        """Return the arrangement of a slot: each comes twice in every 2 × arrangements slots of its own stream."""
        if design.has_noise:
            return 0  # the other arrangement is the standard alone
        count = len(design.arrangements)
        run, place = divmod(slot, 2 * count)
        twice: tuple[int, ...] = (*range(count), *range(count))
        return shuffle(twice, keyed_stream(self.secret, f"{among}/{self.track}/{run}").random)[place]

    def catch(self, stretches: Sequence[range]) -> tuple[int, ...]:
        """Return the slots of the catch trials, ascending: one of each stretch."""
        draw = keyed_stream(self.secret, f"catch/{self.track}").random
        return tuple(stretch[int(draw() * len(stretch))] for stretch in stretches)

    def noise(self, count: int, slots: int) -> tuple[int, ...]:
        """Return the slots that present the standard alone, ascending."""
        order = shuffle(range(slots), keyed_stream(self.secret, f"noise/{self.track}").random)
        return tuple(sorted(order[:count]))

    def rounds(self, count: int) -> list[Draw]:
        """Return the source of each round of levels."""
        return [keyed_stream(self.secret, f"round/{self.track}/{number}").random for number in range(count)]


def due_of(
    protocol: Protocol, block: Block, track: Track, arrangement: int, level: float | None, *, catch: bool = False
) -> Due:
    """Return what a trial of a track presents at a level (None: conditions are compared), in an arrangement."""
    presented = design_of(protocol, block).arrangements[arrangement]
    intervals = tuple(_interval(protocol, block, track, level if holds else None, holds) for holds in presented)
    return Due(level, track.standard, arrangement, intervals, catch)


def _interval(protocol: Protocol, block: Block, track: Track, level: float | None, comparison: bool) -> Stimulated:
    if track.comparison is not None:
        return Stimulated(track.comparison if comparison else str(block.standard))
    stimulus = stimulus_of(protocol, block)
    condition = condition_of(protocol, stimulus)
    if not comparison or level is None:
        return Stimulated(condition, stimulus.vary, float(track.standard or 0.0))
    return Stimulated(condition, stimulus.vary, stimulus.comparison(track.standard, level))
