"""The content of a trial's intervals for hand and eye: the next presentation, and one recorded in a journal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, Trial
from study_app.protocol.orders.tracks import Track, track_of
from study_app.protocol.randomization.streams import Draw, Key, secret_stream, shuffle, stream
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.methods import TrackSetting, TrialResult
from study_app.protocol.trials.stimuli import DELAY, Stimulated


def link_descriptions(delay_ms: float = 0.0, jitter_ms: float = 0.0, loss: float = 0.0) -> Iterator[str]:
    """Yield phrases on the delay [ms], jitter [ms] and loss of a condition's force link, omitting zeros."""
    if delay_ms:
        yield f"force delayed by {delay_ms:g} ms"
    if jitter_ms:
        yield f"force jitter of {jitter_ms:g} ms"
    if loss:
        yield f"{100 * loss:g} % of force updates lost"


def link_seed(schedule_seed: int, participant: str, trial: int, attempt: int, interval: int | None) -> int:
    """Return the seed for the force link's jitter and packet loss in one attempt at a trial, or in one interval."""
    random_stream = stream(schedule_seed, f"force link/{participant}/{trial}/{attempt}/{interval or 1}")
    return int(random_stream.random() * 2**32)


def longest_delay_s(protocol: Protocol, block: Block) -> float:
    """Return the longest delay that a block can present [s], the same for all its trials, so that it reveals none."""
    if block.stimulus is not None and (stimulus := protocol.stimulus_of(block)).vary == DELAY:
        standards = protocol.standards_of(block)
        delays_ms = [stimulus.comparison(standard, level) for standard in standards for level in stimulus.levels]
        return max(*delays_ms, *(standard for standard in standards if standard is not None)) / 1000
    return max(protocol.delay_s(name) for name in protocol.conditions_in(block.id))


_STANDARD_ALONE: Final = 1
"""The arrangement of a noise trial, in a design with noise trials."""


@dataclass(frozen=True, slots=True, repr=False)
class Presentation:
    """The content of a trial; never printed.

    ``level`` is 0 if only the standard is presented, None if conditions are compared. ``arrangement`` is an index into
    the design's arrangements, ``intervals`` has the content of each interval. A ``catch`` trial presents the largest
    level.
    """

    level: float | None
    standard: float | None
    arrangement: int
    intervals: tuple[Stimulated, ...]
    catch: bool = False


def next_level(
    protocol: Protocol, key: Key, schedule: Schedule, trial: Trial, heard: Sequence[TrialResult]
) -> Presentation | None:
    """Return a trial's presentation; None to skip it, if its track has ended or the block's criterion is met.

    The trial belongs to a block with a design; participant and seed of the schedule select the random streams. Only
    earlier trials among the answered trials ``heard``, in any order, are used.
    """
    block = protocol.blocks[trial.block]
    track = track_of(protocol, block, key.codes[block.id][trial.code])
    earlier = [result for result in heard if result.trial < trial.number]
    if is_criterion_met(block, schedule, earlier):
        return None
    numbers = {other.number for other in schedule.trials if (other.block, other.code) == (trial.block, trial.code)}
    slot = sum(number < trial.number for number in numbers)
    draws = _Draws(key.secret, f"{schedule.participant}/{schedule.seed}/{block.id}/{trial.code}")
    design = protocol.design_of(block)
    if design.first is not None:
        if trial.index == 1:
            return _make_presentation(protocol, block, track, 0, design.first.level)
        slot -= 1
    if track.comparison is not None:  # conditions are compared
        return _make_presentation(protocol, block, track, draws.arrangement(design, slot), None)
    method, stimulus = protocol.method_of(block), protocol.stimulus_of(block)
    setting = TrackSetting(stimulus, design, track.number)
    answered = sorted(
        (result for result in earlier if result.trial in numbers and not result.catch), key=lambda result: result.trial
    )
    if method.ended(setting, answered):
        return None
    catch_slots = draws.catch(track.catch)
    if slot in catch_slots:
        arrangement = draws.arrangement(design, catch_slots.index(slot), "catch")
        return _make_presentation(protocol, block, track, arrangement, stimulus.levels[1], catch=True)
    slot -= sum(position < slot for position in catch_slots)
    noise_slots = draws.noise(design.noise(method.presentations(stimulus)), track.slots - len(catch_slots))
    if slot in noise_slots:
        return _make_presentation(protocol, block, track, _STANDARD_ALONE, 0.0)
    rounds = draws.rounds(method.rounds(stimulus))
    level = method.level(setting, slot - sum(position < slot for position in noise_slots), answered, rounds)
    return _make_presentation(protocol, block, track, draws.arrangement(design, slot), level)


def is_criterion_met(block: Block, schedule: Schedule, heard: Sequence[TrialResult]) -> bool:
    """Return whether enough of a block's last answers are correct to end it; ``heard`` are answered trials."""
    if block.until is None:
        return False
    numbers = {planned.number for planned in schedule.trials if planned.block == block.id}
    latest = sorted((result for result in heard if result.trial in numbers), key=lambda result: result.trial)[
        -block.until.of :
    ]
    return sum(result.correct is True for result in latest) >= block.until.right


@dataclass(frozen=True, slots=True, repr=False)
class _Draws:
    """The secret random draws of one track; each kind of draw has streams of its own."""

    secret: bytes
    track: str

    def arrangement(self, design: Design, slot: int, stream_name: str = "arrangement") -> int:
        """Return the arrangement of a slot; each one occurs twice in every 2 × arrangements slots of a stream."""
        if design.has_noise:
            return 0  # the other arrangement is the standard alone
        count = len(design.arrangements)
        cycle, position = divmod(slot, 2 * count)
        twice: tuple[int, ...] = (*range(count), *range(count))
        return shuffle(twice, secret_stream(self.secret, f"{stream_name}/{self.track}/{cycle}").random)[position]

    def catch(self, ranges: Sequence[range]) -> tuple[int, ...]:
        """Return the slots of the catch trials in ascending order, one in each of the ranges."""
        draw = secret_stream(self.secret, f"catch/{self.track}").random
        return tuple(slots[int(draw() * len(slots))] for slots in ranges)

    def noise(self, count: int, slots: int) -> tuple[int, ...]:
        """Return the slots that present the standard alone, in ascending order."""
        order = shuffle(range(slots), secret_stream(self.secret, f"noise/{self.track}").random)
        return tuple(sorted(order[:count]))

    def rounds(self, count: int) -> list[Draw]:
        return [secret_stream(self.secret, f"round/{self.track}/{number}").random for number in range(count)]


def _make_presentation(
    protocol: Protocol, block: Block, track: Track, arrangement: int, level: float | None, *, catch: bool = False
) -> Presentation:
    """Return a track's presentation in an arrangement; ``level`` is None if conditions are compared."""
    contains_comparison = protocol.design_of(block).arrangements[arrangement]
    intervals = tuple(
        _interval(protocol, block, track, level if is_comparison else None, is_comparison)
        for is_comparison in contains_comparison
    )
    return Presentation(level, track.standard, arrangement, intervals, catch)


def _interval(protocol: Protocol, block: Block, track: Track, level: float | None, is_comparison: bool) -> Stimulated:
    if track.comparison is not None:
        return Stimulated(track.comparison if is_comparison else str(block.standard))
    stimulus = protocol.stimulus_of(block)
    condition = protocol.condition_of(stimulus)
    if not is_comparison or level is None:
        return Stimulated(condition, stimulus.vary, float(track.standard or 0.0))
    return Stimulated(condition, stimulus.vary, stimulus.comparison(track.standard, level))


def recorded_presentation(
    protocol: Protocol, codes: Mapping[str, Mapping[str, str]], started: Mapping[str, Any]
) -> Presentation:
    """Return a recorded trial's presentation from its first journal line with opened sealed fields.

    Raises KeyError, ValueError (arrangement) or StopIteration (track) if the line or the key does not fit the study.
    """
    block = protocol.blocks[started["block"]]
    track = track_of(protocol, block, codes[block.id][started["code"]])
    arrangement = protocol.design_of(block).arrangement_of(started["arrangement"])
    return _make_presentation(protocol, block, track, arrangement, started["level"], catch=started.get("catch", False))


def trial_result(
    protocol: Protocol,
    block: Block,
    trial: int,
    code: str,
    level: float | None,
    arrangement: int,
    answer: str,
    *,
    catch: bool = False,
) -> TrialResult:
    """Return the result of an answered trial of a block with a design; ``level`` is None if conditions are compared."""
    design = protocol.design_of(block)
    stimulus = None if block.stimulus is None else protocol.stimulus_of(block)
    correct = design.is_correct(arrangement, answer) if design.can_be_correct(stimulus) else None
    success, noise = design.success(arrangement, answer), not any(design.arrangements[arrangement])
    return TrialResult(
        trial=trial, code=code, level=level or 0.0, success=success, correct=correct, catch=catch, noise=noise
    )
