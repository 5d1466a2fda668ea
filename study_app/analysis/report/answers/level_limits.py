"""What the thresholds of a block of levels cannot show, a sentence each."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from study_app.analysis.results.level_results import LevelsFound, ThresholdFound
from study_app.analysis.results.words import counted, listed
from study_app.analysis.statistics.random_effects import FEWEST

SHIFT: Final = 0.1
"""A prior that shifts a threshold by a larger share of it is named."""
FEW_ANSWERS: Final = 40
"""The fewest answers for which the coverage of the intervals was tested."""
MOST_NAMED: Final = 6


def level_limits(found: LevelsFound) -> Iterator[str]:
    """Yield the limits of a block's thresholds; none where it has no threshold."""
    own = found.own_thresholds
    if found.own_settings:
        yield from _of_settings(found)
    if not own:
        return
    kinds: tuple[tuple[Callable[[ThresholdFound], bool], str], ...] = (
        (_shifted, f"the prior of the width shifts a threshold by more than {100 * SHIFT:.0f} %: too few answers"),
        (lambda one: one.beyond == "above", "a threshold lies above the highest level presented; how far is not known"),
        (lambda one: one.beyond == "below", "a threshold lies below the lowest level presented; how far is not known"),
        (lambda one: not one.fits, "the function does not fit the answers, so that a threshold may be biased"),
        (lambda one: one.drifts, "answers became better or worse over the trials, which one threshold does not show"),
        (lambda one: one.n < FEW_ANSWERS, f"fewer than {FEW_ANSWERS} answers, so that intervals are wide"),
    )
    for applies, words in kinds:
        if some := [one for one in own if applies(one)]:
            yield f"{found.title}: {words} ({_named(found, some)})."
    people = len({one.participant for one in own})
    if people < FEWEST:
        yield (
            f"{found.title}: {counted(people, 'participant')}; below {FEWEST} the group has no interval, since "
            "differences between people are not known."
        )
    if found.level_kind == "weber":
        yield _of_device(found)
    yield f"{found.title}: motors are audible and were not masked: participants may have used their sound."


def _of_device(found: LevelsFound) -> str:
    """Return what the device's own dynamics leave open."""
    own = found.device
    if own is None:
        return (
            f"{found.title}: the device's own damping, friction and mass are unknown, since they were not measured; "
            "Weber fractions are of what the motors delivered, and smaller ones of the sum with the device's own."
        )
    where = "" if own.sessions == own.of else f" (measured for {own.sessions} of {own.of} sessions)"
    words = (
        f"{found.title}: the device's own damping of {own.damping_nspm:.2g} N·s/m, friction of {own.friction_n:.2g} N "
        f"and mass of {own.mass_kg:.2g} kg{where} add to what the motors delivered; Weber fractions are of the latter"
    )
    with_device = [
        f"{share:.3g} in place of {one.threshold:.3g} at {one.standard:g} {found.unit}"
        for one in found.thresholds
        if one.participant is None and (share := found.with_device(one)) is not None
    ]
    if not with_device:
        return f"{words}."
    return f"{words}. With the device's damping in the standard, those of the group are {listed(with_device)}."


def _of_settings(found: LevelsFound) -> Iterator[str]:
    """Yield what settings cannot show."""
    yield (
        f"{found.title}: settings depend on how a participant decides that two are equal: their scatter is not a "
        "threshold free of a criterion."
    )
    if few := [one for one in found.own_settings if one.hysteresis is None]:
        words = "settings started near one end alone, so that hysteresis is not known"
        yield f"{found.title}: {words} ({listed([str(one.participant) for one in few[:MOST_NAMED]])})."
    yield f"{found.title}: motors are audible and were not masked: participants may have used their sound."


def _shifted(one: ThresholdFound) -> bool:
    return one.flat_width is not None and abs(one.flat_width - one.threshold) > SHIFT * abs(one.threshold)


def _named(found: LevelsFound, some: Sequence[ThresholdFound]) -> str:
    """Return whose thresholds they are: at each standard where there are several, at most `MOST_NAMED` by name."""
    if len(some) > MOST_NAMED:
        return f"{len(some)} of {len(found.own_thresholds)} thresholds"
    several = len({one.standard for one in found.own_thresholds}) > 1
    return listed([f"{one.participant} at {one.standard:g}" if several else str(one.participant) for one in some])
