"""Which cases are judged, group by group: the sweep of the first plant, and what it leaves out.

Every group is drawn from the seed and its own name, so that the cases of one do not depend on the others.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from random import Random
from typing import Any, Final, NamedTuple

from study_app.evidence.stability.stability_cases import (
    CIRCLES,
    DAMPER,
    DEVICE,
    FALCON,
    FILTERS,
    FIRST,
    GRIPS,
    LETS_GO,
    PLANTS,
    REACHES,
    SECOND,
    SINE,
    STROKE,
    THROWN,
    Case,
    liquids,
    materials,
    of_physical2,
    scenes,
)
from study_app.haptics.runtime.closed_loop import BURST_PERIOD_S

_SCALES: Final = (1.0, 3.0, 10.0, 20.0, 40.0)
_RATES_HZ: Final = (250.0, 500.0, 1000.0, 2000.0)
_HANDLES_KG: Final = (0.03, 0.05, 0.1, 0.25)
_FALCONS_KG: Final = (0.1, 0.25, 0.6)
"""Handles of the cases through the Falcon's driver, which says that its grip is no lighter."""
_FALCONS_HZ: Final = (500.0, 1000.0)
_PHASES: Final = 12
_FIRST_RELEASE_S: Final = 0.6
_CASES: Final = 1500
"""Of each group of misjudged delays and masses and of disturbed samples."""
_KALMAN_CASES: Final = 250
"""Of each group that is judged with the Kalman filter, too."""

_DRAWN: Final[Mapping[str, tuple[Any, ...]]] = {
    "estimator": ("ewma", "ewma", "ewma", "raw", "raw", "raw"),
    "motion": (REACHES, CIRCLES, STROKE),
    "speed_mps": (0.1, 0.3, 0.6, 1.0),
    "mass_kg": (0.1, 0.25, 0.6),
    "viscous_nspm": (0.0, 0.5),
    "coulomb_n": (0.0, 0.3),
    "quantum_um": (20.0, 38.0, 60.0),
    "noise_um": (0.0, 30.0),
    "jitter": (0.0, 0.2),
    "missed": (0.0, 0.02),
}


_LINKS: Final[Mapping[str, tuple[Any, ...]]] = {
    "estimator": ("ewma", "kalman"),
    "motion": (REACHES, CIRCLES, SINE),
    "release_s": (0.6, 0.7, 0.8),
    "force_delay_ms": (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0),
    "force_jitter_ms": (0.0, 0.0, 5.0, 20.0, 50.0),
    "force_loss": (0.0, 0.0, 0.1, 0.5),
}
"""How a study delays forces; a link that does nothing is one of 48."""
_DELAYED_HZ: Final = (500.0, 1000.0)
"""Rates at which a session may delay forces; it also requires a handle that is no lighter than those of `_DRAWN`."""
_OUTLIERS: Final[Mapping[str, tuple[Any, ...]]] = {"outliers": (0.002, 0.02), "outlier_mm": (0.5, 2.0, 5.0, 20.0)}
_JUMPS: Final[Mapping[str, tuple[Any, ...]]] = {"burst_ms": (4.0, 8.0, 20.0, 40.0), "jump_mm": (0.5, 2.0, 5.0, 20.0)}
DELAYS: Final[Mapping[str, tuple[Any, ...]]] = {"slows_to": (2, 3, 4), "swaps": (1,)}
_DISTURBED: Final[Mapping[str, Mapping[str, tuple[Any, ...]]]] = {
    "outliers": _OUTLIERS,
    "jumps at a reconnection": _JUMPS,
    "delay that jumps": DELAYS,
    "everything at once": {**_OUTLIERS, **_JUMPS, **DELAYS, "lost": (0.0, 0.1), "duplicated": (0.0, 0.05)},
}
"""What is wrong with the samples or the delay of a device, by group."""
_LATE_CASES: Final = 1000
"""Loops with a force link."""
_DEVICE_CASES: Final = 500
"""Loops whose device measures the velocity."""

_MEASURED: Final[Mapping[str, tuple[Any, ...]]] = {
    "estimator": (DEVICE,),
    "motion": (REACHES, CIRCLES, SINE),
    "release_s": (0.6, 0.7, 0.8),
    "velocity_lag": (0.0, 0.5, 1.0, 2.0, 4.0, 7.5),
    "velocity_filter": FILTERS,
    "velocity_noise_mmps": (0.0, 2.0, 10.0),
    "velocity_count_mmps": (0.0, 1.0, 5.0),
}
"""How devices measure it: the noise of ``line`` with 2 to 15 samples at a count of 38 um lies between."""

_FALCONS: Final[Mapping[str, tuple[Any, ...]]] = {
    **_DRAWN,
    "mass_kg": _FALCONS_KG,
    "motion": (REACHES, CIRCLES, SINE),
    "noise_um": (0.0,),
    "jitter": (0.0,),
    "missed": (0.0,),
    "quantum_um": (38.0,),
}
"""Motions within its workspace, and nothing that the emulated Falcon decides itself."""


class Group(NamedTuple):
    """Named cases with a common property."""

    name: str
    cases: tuple[Case, ...]


def sweep(seed: str = "stability") -> tuple[Case, ...]:
    """Return the cases of the sweep: each liquid at each scale, rate, delay and grip; the rest is drawn."""
    return tuple(_draw_remaining_values(seed, _grid(GRIPS)))


def groups(seed: str = "stability", count: int | None = None) -> tuple[Group, ...]:
    """Return all groups except the sweep, with at most ``count`` cases each."""
    light = {**_DRAWN, "mass_kg": _HANDLES_KG}
    held, released = [tuple(_grid(hands)) for hands in (("light", "middle", "firm"), (LETS_GO, THROWN))]
    both = [dataclasses.replace(case, plant=plant) for plant in PLANTS for case in (*held, *released)]
    releases = tuple(_releases(f"{seed} releases", PLANTS, _HANDLES_KG))

    def changed(name: str, change: Callable[[Case], Case | None], cases: Iterable[Case]) -> Group:
        listed = tuple(case for case in map(change, cases) if case is not None)
        return Group(
            name,
            tuple(_draw_remaining_values(f"{seed} {name}", evenly_chosen(listed, min(_CASES, count or _CASES)), light)),
        )

    listed = [
        Group(
            name,
            tuple(
                _draw_remaining_values(
                    f"{seed} {name}",
                    [dataclasses.replace(case, plant=SECOND) for case in evenly_chosen(cases, count)],
                    light,
                )
            ),
        )
        for name, cases in (("second plant, held", held), ("second plant, let go", released))
    ]
    for name, change in _CHANGES.items():
        listed.append(changed(name, change, both))
    listed += [
        Group(
            name,
            tuple(
                map(
                    change,
                    _draw_remaining_values(f"{seed} {name}", evenly_chosen(both, min(_CASES, count or _CASES)), light),
                )
            ),
        )
        for name, change in _MASSES.items()
    ]
    for name, own in _DISTURBED.items():
        cases = evenly_chosen(both, min(_CASES, count or _CASES))
        listed.append(Group(name, tuple(_draw_remaining_values(f"{seed} {name}", cases, {**light, **own}))))
    listed.append(Group("let go in mid-stroke", evenly_chosen(releases, count)))
    in_gap = tuple(_release_in_gap(f"{seed} let go in a gap", releases))
    listed.append(Group("let go in a gap of samples", evenly_chosen(in_gap, min(_CASES, count or _CASES))))
    for name in (*_MISJUDGED, *_MASSES):
        cases = tuple(case for case in map({**_CHANGES, **_MASSES}[name], releases) if case is not None)
        listed.append(Group(f"let go in mid-stroke, {name}", evenly_chosen(cases, min(_CASES, count or _CASES))))
    driven = "through the Falcon's driver"
    driven_held = evenly_chosen(tuple(_grid(("light", "middle", "firm"), (FALCON,), _FALCONS_HZ, (1,))), count)
    driven_held = tuple(_draw_remaining_values(f"{seed} {driven}", driven_held, _FALCONS))
    listed.append(Group(f"{driven}, held", driven_held))
    driven_free = (dataclasses.replace(case, delay=1) for case in _releases(f"{seed} {driven}", (FALCON,), _FALCONS_KG))
    listed.append(Group(f"{driven}, let go in mid-stroke", evenly_chosen(tuple(driven_free), count)))
    listed += _of_liquids("non-Newtonian liquids", materials, seed, light, count)
    listed += _of_liquids("liquids of physical2", of_physical2, seed, light, count)
    late = min(_LATE_CASES, count or _LATE_CASES)
    listed.append(_half_damper("late forces", late, seed, {**_DRAWN, **_LINKS}, _DELAYED_HZ))
    devices = min(_DEVICE_CASES, count or _DEVICE_CASES)
    by_device = _half_damper("velocity measured by the device", devices, seed, {**light, **_MEASURED})
    fewer = min(_KALMAN_CASES, count or _KALMAN_CASES)
    again = (Group("first plant", sweep(seed)), *listed)
    by_kalman = [
        Group(
            f"kalman: {name}",
            tuple(dataclasses.replace(case, estimator="kalman") for case in evenly_chosen(cases, fewer)),
        )
        for name, cases in again
    ]
    return (*listed, by_device, *by_kalman)


def _of_liquids(
    name: str, names: Callable[[], Iterable[str]], seed: str, choices: Mapping[str, tuple[Any, ...]], count: int | None
) -> Iterator[Group]:
    """Yield groups for liquids outside the sweep: plain cases, misjudged delays, and releases."""
    whole = tuple(_grid(GRIPS, names=names))
    yield Group(name, tuple(_draw_remaining_values(f"{seed} {name}", evenly_chosen(whole, count), choices)))
    for change in _MISJUDGED:
        cases = [case for case in map(_CHANGES[change], whole) if case is not None]
        few = evenly_chosen(cases, min(_CASES, count or _CASES))
        yield Group(f"{name}, {change}", tuple(_draw_remaining_values(f"{seed} {name} {change}", few, choices)))
    free = tuple(_releases(f"{seed} {name}", PLANTS, _HANDLES_KG, names))
    yield Group(f"{name}, let go in mid-stroke", evenly_chosen(free, count))


def _half_damper(
    name: str, count: int, seed: str, choices: Mapping[str, tuple[Any, ...]], rates_hz: Iterable[float] = _RATES_HZ
) -> Group:
    """Return loops that are held, thrown and released; half of them present the strongest damper."""
    whole = tuple(_grid(GRIPS, PLANTS, rates_hz, names=lambda: (*liquids(), *[DAMPER] * len(liquids()))))
    return Group(name, tuple(_draw_remaining_values(f"{seed} {name}", evenly_chosen(whole, count), choices)))


def evenly_chosen(cases: Sequence[Case], count: int | None) -> tuple[Case, ...]:
    """Return ``count`` cases, evenly spread over all of them."""
    if count is None or count >= len(cases):
        return tuple(cases)
    return tuple(Random(count).sample(cases, count))  # noqa: S311 - no secret


def _underestimate_delay(less: int) -> Callable[[Case], Case | None]:
    """Return a function that makes a loop underestimate its delay by ``less`` ticks, or returns None if it cannot."""

    def change(case: Case) -> Case | None:
        believed = case.delay - less
        return dataclasses.replace(case, believed=believed) if 0 <= believed <= 4 else None

    return change


def _underestimate_until_measured(less: int) -> Callable[[Case], Case | None]:
    """Return a function that makes a loop start with an underestimated delay on a device that measures it."""

    def change(case: Case) -> Case | None:
        believed = case.delay - less
        return dataclasses.replace(case, believed=believed, slows_to=case.delay) if believed >= 0 else None

    return change


_CHANGES: Final[Mapping[str, Callable[[Case], Case | None]]] = {
    "delay believed one tick too short": _underestimate_delay(1),
    "delay believed one tick too long": _underestimate_delay(-1),
    "device slower by a tick after 0.5 s": lambda case: (
        dataclasses.replace(case, slows_to=case.delay + 1) if case.delay < 4 else None
    ),
    "delay two ticks too short, measured": _underestimate_until_measured(2),
    "delay three ticks too short, measured": _underestimate_until_measured(3),
    "10 % of samples lost": lambda case: dataclasses.replace(case, lost=0.1),
    "5 % of samples repeated": lambda case: dataclasses.replace(case, duplicated=0.05),
    "no sample for 20 ms, again and again": lambda case: dataclasses.replace(case, burst_ms=20.0),
}
_MISJUDGED: Final = tuple(_CHANGES)[:3]
_MASSES: Final[Mapping[str, Callable[[Case], Case]]] = {
    "least mass stated at half": lambda case: dataclasses.replace(case, believed_kg=0.5 * case.mass_kg),
    "least mass stated at 1.25 times": lambda case: dataclasses.replace(case, believed_kg=1.25 * case.mass_kg),
    "mass doubled and halved every 150 ms": lambda case: dataclasses.replace(case, other_kg=2.0 * case.mass_kg),
}
"""Changes of what the device states of its handle, or of the handle itself; made once its mass has been drawn."""


def _grid(
    hands: Iterable[str],
    plants: Iterable[str] = (FIRST,),
    rates_hz: Iterable[float] = _RATES_HZ,
    delays: Iterable[int] = range(5),
    names: Callable[[], Iterable[str]] = liquids,
) -> Iterator[Case]:
    """Yield each liquid, by default of the sweep, at each scale, rate, delay and grip."""
    for liquid, scale, rate_hz, delay, hand, plant in itertools.product(
        names(), _SCALES, rates_hz, delays, hands, plants
    ):
        yield Case(liquid=liquid, scale=scale, rate_hz=rate_hz, delay=delay, hand=hand, plant=plant)


def _draw_remaining_values(
    seed: str, cases: Iterable[Case], choices: Mapping[str, tuple[Any, ...]] = _DRAWN
) -> Iterator[Case]:
    """Yield cases with the remaining values drawn from ``choices``."""
    draw = Random(seed)  # noqa: S311 - the same cases in every run
    for case in cases:
        yield dataclasses.replace(case, **{name: _one(draw, values) for name, values in choices.items()})


def _releases(
    seed: str, plants: Iterable[str], masses_kg: Iterable[float], names: Callable[[], Iterable[str]] = liquids
) -> Iterator[Case]:
    """Yield releases at every phase of strokes of 1 to 4 Hz and ±30 mm, in the loop of a study.

    The damper has its own random stream, so that the liquids' cases are unchanged.
    """
    shared, own = Random(seed), {DAMPER: Random(f"{seed} {DAMPER}")}  # noqa: S311 - the same cases in every run
    for plant, liquid, mass_kg, phase in itertools.product(plants, names(), masses_kg, range(_PHASES)):
        draw = own.get(liquid, shared)
        case = Case(liquid=liquid, hand=LETS_GO, motion=SINE, mass_kg=mass_kg, plant=plant)
        hz = _one(draw, (1.0, 2.0, 4.0))
        yield dataclasses.replace(
            case,
            scale=scenes()[liquid].scale,
            delay=_one(draw, (0, 1, 1, 2)),
            viscous_nspm=_one(draw, (0.0, 0.5)),
            speed_mps=round(peak_mps(hz, 0.5e-3 * case.way_mm), 5),
            release_s=round(_FIRST_RELEASE_S + phase / (_PHASES * hz), 5),
        )


def _release_in_gap(seed: str, cases: Iterable[Case]) -> Iterator[Case]:
    """Yield releases during missing samples, after which positions may be offset."""
    draw = Random(seed)  # noqa: S311 - the same cases in every run
    for case in cases:
        burst_ms, jump_mm = _one(draw, _JUMPS["burst_ms"]), _one(draw, (0.0, *_JUMPS["jump_mm"]))
        release_s = round(3 * BURST_PERIOD_S - 1e-3 * burst_ms * draw.random(), 5)
        yield dataclasses.replace(case, burst_ms=burst_ms, jump_mm=jump_mm, release_s=release_s)


def peak_mps(frequency_hz: float, amplitude_m: float) -> float:
    """Return the greatest speed [m/s] of a sine."""
    return 2.0 * math.pi * frequency_hz * amplitude_m


def _one(draw: Random, choices: tuple[Any, ...]) -> Any:
    return choices[int(draw.random() * len(choices))]
