"""The judged cases by group: the sweep of the first plant, and further groups.

Every group is drawn from the seed and its own name, so that its cases do not depend on the other groups.
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
    physical2_liquids,
    scenes,
)
from study_app.haptics.runtime.closed_loop import BURST_PERIOD_S

_SCALES: Final = (1.0, 3.0, 10.0, 20.0, 40.0)
_RATES_HZ: Final = (250.0, 500.0, 1000.0, 2000.0)
_HANDLES_KG: Final = (0.03, 0.05, 0.1, 0.25)
_FALCON_HANDLES_KG: Final = (0.1, 0.25, 0.6)
"""Handles of the cases that use the Falcon's driver, which reports that its grip is not lighter."""
_FALCON_RATES_HZ: Final = (500.0, 1000.0)
_PHASES: Final = 12
_FIRST_RELEASE_S: Final = 0.6
_CASES: Final = 1500
"""Number of cases in each group of misjudged delays and masses and of disturbed samples."""
_KALMAN_CASES: Final = 250
"""Number of cases from each group that are also judged with the Kalman filter."""

_DRAWN_VALUES: Final[Mapping[str, tuple[Any, ...]]] = {
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


_LINK_VALUES: Final[Mapping[str, tuple[Any, ...]]] = {
    "estimator": ("ewma", "kalman"),
    "motion": (REACHES, CIRCLES, SINE),
    "release_s": (0.6, 0.7, 0.8),
    "force_delay_ms": (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0),
    "force_jitter_ms": (0.0, 0.0, 5.0, 20.0, 50.0),
    "force_loss": (0.0, 0.0, 0.1, 0.5),
}
"""Values for force links of a study; one link in 48 has no effect."""
_DELAYED_HZ: Final = (500.0, 1000.0)
"""Rates at which a session may delay forces; handles must not be lighter than those of `_DRAWN_VALUES`."""
_OUTLIERS: Final[Mapping[str, tuple[Any, ...]]] = {"outliers": (0.002, 0.02), "outlier_mm": (0.5, 2.0, 5.0, 20.0)}
_JUMPS: Final[Mapping[str, tuple[Any, ...]]] = {"burst_ms": (4.0, 8.0, 20.0, 40.0), "jump_mm": (0.5, 2.0, 5.0, 20.0)}
DELAYS: Final[Mapping[str, tuple[Any, ...]]] = {"slows_to": (2, 3, 4), "swaps": (1,)}
_DISTURBED: Final[Mapping[str, Mapping[str, tuple[Any, ...]]]] = {
    "outliers": _OUTLIERS,
    "jumps at a reconnection": _JUMPS,
    "delay that jumps": DELAYS,
    "everything at once": {**_OUTLIERS, **_JUMPS, **DELAYS, "lost": (0.0, 0.1), "duplicated": (0.0, 0.05)},
}
"""Disturbances of a device's samples or delay, by group."""
_LATE_CASES: Final = 1000
"""Number of loops with a force link."""
_DEVICE_CASES: Final = 500
"""Number of loops whose device measures the velocity."""

_MEASURED_VELOCITY_VALUES: Final[Mapping[str, tuple[Any, ...]]] = {
    "estimator": (DEVICE,),
    "motion": (REACHES, CIRCLES, SINE),
    "release_s": (0.6, 0.7, 0.8),
    "velocity_lag": (0.0, 0.5, 1.0, 2.0, 4.0, 7.5),
    "velocity_filter": FILTERS,
    "velocity_noise_mmps": (0.0, 2.0, 10.0),
    "velocity_count_mmps": (0.0, 1.0, 5.0),
}
"""Values for velocities that devices measure; the noise range includes that of ``line`` with 2 to 15 samples."""

_FALCON_VALUES: Final[Mapping[str, tuple[Any, ...]]] = {
    **_DRAWN_VALUES,
    "mass_kg": _FALCON_HANDLES_KG,
    "motion": (REACHES, CIRCLES, SINE),
    "noise_um": (0.0,),
    "jitter": (0.0,),
    "missed": (0.0,),
    "quantum_um": (38.0,),
}
"""Motions within the Falcon's workspace; values that the emulator determines itself are fixed."""


class Group(NamedTuple):
    """Named cases with a common property."""

    name: str
    cases: tuple[Case, ...]


def sweep(seed: str = "stability") -> tuple[Case, ...]:
    """Return the cases of the sweep: each liquid at each scale, rate, delay and grip; the rest is drawn."""
    return tuple(_draw_remaining_values(seed, _case_grid(GRIPS)))


def groups(seed: str = "stability", count: int | None = None) -> tuple[Group, ...]:
    """Return all groups except the sweep, with at most ``count`` cases each."""
    light_values = {**_DRAWN_VALUES, "mass_kg": _HANDLES_KG}
    held_cases, released_cases = [
        tuple(_case_grid(hands)) for hands in (("light", "middle", "firm"), (LETS_GO, THROWN))
    ]
    all_cases = [dataclasses.replace(case, plant=plant) for plant in PLANTS for case in (*held_cases, *released_cases)]
    releases = tuple(_release_cases(f"{seed} releases", PLANTS, _HANDLES_KG))

    def changed_group(name: str, change: Callable[[Case], Case | None], cases: Iterable[Case]) -> Group:
        changed_cases = tuple(case for case in map(change, cases) if case is not None)
        return Group(
            name,
            tuple(
                _draw_remaining_values(
                    f"{seed} {name}", evenly_chosen(changed_cases, min(_CASES, count or _CASES)), light_values
                )
            ),
        )

    changed_cases = [
        Group(
            name,
            tuple(
                _draw_remaining_values(
                    f"{seed} {name}",
                    [dataclasses.replace(case, plant=SECOND) for case in evenly_chosen(cases, count)],
                    light_values,
                )
            ),
        )
        for name, cases in (("second plant, held", held_cases), ("second plant, let go", released_cases))
    ]
    for name, change in _CHANGES.items():
        changed_cases.append(changed_group(name, change, all_cases))
    changed_cases += [
        Group(
            _TITLES.get(name, name),
            tuple(
                map(
                    change,
                    _draw_remaining_values(
                        f"{seed} {name}", evenly_chosen(all_cases, min(_CASES, count or _CASES)), light_values
                    ),
                )
            ),
        )
        for name, change in _MASSES.items()
    ]
    for name, disturbance in _DISTURBED.items():
        cases = evenly_chosen(all_cases, min(_CASES, count or _CASES))
        changed_cases.append(
            Group(name, tuple(_draw_remaining_values(f"{seed} {name}", cases, {**light_values, **disturbance})))
        )
    changed_cases.append(Group("let go in mid-stroke", evenly_chosen(releases, count)))
    in_gap = tuple(_release_in_gap(f"{seed} let go in a gap", releases))
    changed_cases.append(Group("let go in a gap of samples", evenly_chosen(in_gap, min(_CASES, count or _CASES))))
    for name in (*_MISJUDGED, *_MASSES):
        cases = tuple(case for case in map({**_CHANGES, **_MASSES}[name], releases) if case is not None)
        changed_cases.append(
            Group(
                f"let go in mid-stroke, {_TITLES.get(name, name)}", evenly_chosen(cases, min(_CASES, count or _CASES))
            )
        )
    driven = "through the Falcon's driver"
    driven_held = evenly_chosen(
        tuple(_case_grid(("light", "middle", "firm"), (FALCON,), _FALCON_RATES_HZ, (1,))), count
    )
    driven_held = tuple(_draw_remaining_values(f"{seed} {driven}", driven_held, _FALCON_VALUES))
    changed_cases.append(Group(f"{driven}, held", driven_held))
    driven_free = (
        dataclasses.replace(case, delay=1) for case in _release_cases(f"{seed} {driven}", (FALCON,), _FALCON_HANDLES_KG)
    )
    changed_cases.append(Group(f"{driven}, let go in mid-stroke", evenly_chosen(tuple(driven_free), count)))
    changed_cases += _liquid_groups("non-Newtonian liquids", materials, seed, light_values, count)
    changed_cases += _liquid_groups("liquids of physical2", physical2_liquids, seed, light_values, count)
    late_count = min(_LATE_CASES, count or _LATE_CASES)
    changed_cases.append(
        _half_damper_group("late forces", late_count, seed, {**_DRAWN_VALUES, **_LINK_VALUES}, _DELAYED_HZ)
    )
    device_count = min(_DEVICE_CASES, count or _DEVICE_CASES)
    by_device = _half_damper_group(
        "velocity measured by the device", device_count, seed, {**light_values, **_MEASURED_VELOCITY_VALUES}
    )
    kalman_count = min(_KALMAN_CASES, count or _KALMAN_CASES)
    first_and_listed = (Group("first plant", sweep(seed)), *changed_cases)
    by_kalman = [
        Group(
            f"kalman: {name}",
            tuple(dataclasses.replace(case, estimator="kalman") for case in evenly_chosen(cases, kalman_count)),
        )
        for name, cases in first_and_listed
    ]
    return (*changed_cases, by_device, *by_kalman)


def _liquid_groups(
    name: str, names: Callable[[], Iterable[str]], seed: str, choices: Mapping[str, tuple[Any, ...]], count: int | None
) -> Iterator[Group]:
    """Yield groups for liquids outside the sweep: plain cases, misjudged delays, and releases."""
    grid = tuple(_case_grid(GRIPS, names=names))
    yield Group(name, tuple(_draw_remaining_values(f"{seed} {name}", evenly_chosen(grid, count), choices)))
    for change in _MISJUDGED:
        cases = [case for case in map(_CHANGES[change], grid) if case is not None]
        chosen = evenly_chosen(cases, min(_CASES, count or _CASES))
        yield Group(f"{name}, {change}", tuple(_draw_remaining_values(f"{seed} {name} {change}", chosen, choices)))
    released = tuple(_release_cases(f"{seed} {name}", PLANTS, _HANDLES_KG, names))
    yield Group(f"{name}, let go in mid-stroke", evenly_chosen(released, count))


def _half_damper_group(
    name: str, count: int, seed: str, choices: Mapping[str, tuple[Any, ...]], rates_hz: Iterable[float] = _RATES_HZ
) -> Group:
    """Return loops that are held, thrown and released; half of them present the strongest damper."""
    grid = tuple(_case_grid(GRIPS, PLANTS, rates_hz, names=lambda: (*liquids(), *[DAMPER] * len(liquids()))))
    return Group(name, tuple(_draw_remaining_values(f"{seed} {name}", evenly_chosen(grid, count), choices)))


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
"""Changes of the handle's reported or real mass, made after the mass has been drawn."""
_TITLES: Final = {
    "least mass stated at half": "minimum mass reported as 0.5 times the true mass",
    "least mass stated at 1.25 times": "minimum mass reported as 1.25 times the true mass",
}
"""Titles of groups whose older names remain part of the seeds of their cases."""


def _case_grid(
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
    seed: str, cases: Iterable[Case], choices: Mapping[str, tuple[Any, ...]] = _DRAWN_VALUES
) -> Iterator[Case]:
    """Yield cases with the remaining values drawn from ``choices``."""
    draw = Random(seed)  # noqa: S311 - the same cases in every run
    for case in cases:
        yield dataclasses.replace(case, **{name: _random_choice(draw, values) for name, values in choices.items()})


def _release_cases(
    seed: str, plants: Iterable[str], masses_kg: Iterable[float], names: Callable[[], Iterable[str]] = liquids
) -> Iterator[Case]:
    """Yield releases at every phase of strokes of 1 to 4 Hz and ±30 mm, in the loop of a study.

    The damper has its own random stream, so that the liquids' cases are unchanged.
    """
    liquid_stream, damper_stream = Random(seed), {DAMPER: Random(f"{seed} {DAMPER}")}  # noqa: S311 - the same cases in every run
    for plant, liquid, mass_kg, phase in itertools.product(plants, names(), masses_kg, range(_PHASES)):
        draw = damper_stream.get(liquid, liquid_stream)
        case = Case(liquid=liquid, hand=LETS_GO, motion=SINE, mass_kg=mass_kg, plant=plant)
        hz = _random_choice(draw, (1.0, 2.0, 4.0))
        yield dataclasses.replace(
            case,
            scale=scenes()[liquid].scale,
            delay=_random_choice(draw, (0, 1, 1, 2)),
            viscous_nspm=_random_choice(draw, (0.0, 0.5)),
            speed_mps=round(peak_mps(hz, 0.5e-3 * case.way_mm), 5),
            release_s=round(_FIRST_RELEASE_S + phase / (_PHASES * hz), 5),
        )


def _release_in_gap(seed: str, cases: Iterable[Case]) -> Iterator[Case]:
    """Yield releases during missing samples, after which positions may be offset."""
    draw = Random(seed)  # noqa: S311 - the same cases in every run
    for case in cases:
        burst_ms, jump_mm = _random_choice(draw, _JUMPS["burst_ms"]), _random_choice(draw, (0.0, *_JUMPS["jump_mm"]))
        release_s = round(3 * BURST_PERIOD_S - 1e-3 * burst_ms * draw.random(), 5)
        yield dataclasses.replace(case, burst_ms=burst_ms, jump_mm=jump_mm, release_s=release_s)


def peak_mps(frequency_hz: float, amplitude_m: float) -> float:
    """Return the greatest speed [m/s] of a sine."""
    return 2.0 * math.pi * frequency_hz * amplitude_m


def _random_choice(draw: Random, choices: tuple[Any, ...]) -> Any:
    return choices[int(draw.random() * len(choices))]
