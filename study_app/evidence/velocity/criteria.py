"""Acceptance limits of the Kalman filter, measured, with other estimators of the same run as references."""

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

from study_app.evidence.stability.damping_boundary import boundary_nspm
from study_app.evidence.stability.stability_cases import GRIPS
from study_app.evidence.velocity import held_handle as held
from study_app.evidence.velocity import imposed_motions as imposed
from study_app.evidence.velocity.wiener_bound import wiener_bound
from study_app.haptics.model.scene import Ewma, Kalman, Lead, Velocity
from study_app.haptics.model.slope_limits import slope_limit

ESTIMATORS: Final[tuple[Velocity, ...]] = (Kalman(), Ewma(), Lead())
"""The estimator that is judged, then its references."""
PERIOD_S: Final = 1e-3
MASSES_KG: Final = (0.05, 0.1, 0.2, 0.25, 0.5)
LOOPS: Final = ((1, 1), (2, 1), (0, 1), (2, 2))
"""Delay of the device and delay believed [ticks]."""
SMOOTH_PERCENT: Final = 2.5
FASTEST_PERCENT: Final = 5.0
HELD_PERCENT: Final = 3.0
REST_NOISE: Final = 1.3
LEAST_LIMIT_NSPM: Final = 53.0
LEAST_LATE_NSPM: Final = 40.0
MOST_COST_NS: Final = 100.0
WHOLE_PERCENT: Final = {"water": 20.0, "glycerin": 14.0, "honey": 18.0, "gear_oil": 15.0}

Progress = Callable[[str], None]


class Row(NamedTuple):
    """One quantity: its values by estimator, and the limit of the first, a least one where ``least`` says so.

    ``bound`` is the least value of a linear estimator (`wiener_bound`), None where it is not computed.
    """

    name: str
    values: tuple[float, ...]
    goal: float | None = None
    least: bool = False
    bound: float | None = None

    @property
    def met(self) -> bool:
        """Whether the first estimator reaches the goal, as far as there is one."""
        if self.goal is None:
            return True
        return self.values[0] >= self.goal if self.least else self.values[0] <= self.goal


def measure(progress: Progress) -> tuple[Row, ...]:
    """Measure everything; ``progress`` is called with the name of each part before it is measured."""
    found: list[Row] = []
    for name, part in PARTS.items():
        progress(name)
        found += part()
    return tuple(found)


def report(rows: Sequence[Row]) -> str:
    """Return the rows as a table."""
    return "\n".join(_lines(rows))


def _lines(rows: Sequence[Row]) -> Iterator[str]:
    width = max(len(row.name) for row in rows)
    names = "".join(f"{it.kind:>9}" for it in ESTIMATORS)
    yield f"{'1 kHz, encoder count 38 µm':{width}} {names}   goal of {ESTIMATORS[0].kind}"
    for row in rows:
        values = "".join(f"{value:9.4g}" if value >= 100 else f"{value:9.2f}" for value in row.values)
        goal = "" if row.goal is None else f"   {'≥' if row.least else '≤'} {row.goal:.3g}: "
        judged = "" if row.goal is None else "met" if row.met else "not met"
        bound = "" if row.bound is None else f"   least of linear estimators {row.bound:.3g}"
        yield f"{row.name:{width}} {values}{goal}{judged}{bound}"


def _each(measured: Callable[[Velocity], Any]) -> tuple[Any, ...]:
    return tuple(measured(velocity) for velocity in ESTIMATORS)


def _imposed() -> Iterator[Row]:
    errors: tuple[Mapping[imposed.Stroke, float], ...] = _each(imposed.errors)
    for stroke in (*imposed.SMOOTH, *imposed.FASTEST, *imposed.SHOWN):
        goal = SMOOTH_PERCENT if stroke in imposed.SMOOTH else FASTEST_PERCENT if stroke in imposed.FASTEST else None
        yield Row(f"error of v·|v|, {stroke} [%]", tuple(found[stroke] for found in errors), goal)


def _noise() -> Iterator[Row]:
    noise: tuple[Mapping[float, float], ...] = _each(imposed.noise_mmps)
    for speed_mps in imposed.NOISE_MPS:
        values = tuple(found[speed_mps] for found in noise)
        where = f"at {1e3 * speed_mps:g} mm/s" if speed_mps else "at rest"
        yield Row(f"noise above 20 Hz {where} [mm/s]", values, values[1] * (1.0 if speed_mps else REST_NOISE))


def _boundaries() -> Iterator[Row]:
    limits = _each(lambda velocity: slope_limit(PERIOD_S, 1, velocity))
    yield Row("slope limit, 1 tick of delay [N·s/m]", limits, LEAST_LIMIT_NSPM, least=True)
    for delay, believed in LOOPS:
        for mass_kg in MASSES_KG:
            values = tuple(boundary_nspm(it, PERIOD_S, delay, believed=believed, mass_kg=mass_kg) for it in ESTIMATORS)
            goal = values[1] if (delay, believed) == (1, 1) else None
            if (delay, believed, mass_kg) == (2, 2, 0.1):
                goal = LEAST_LATE_NSPM
            mistaken = "" if believed == delay else f", believed {believed}"
            yield Row(f"stable damping, {mass_kg:g} kg, delay {delay}{mistaken} [N·s/m]", values, goal, least=True)


def _held() -> Iterator[Row]:
    errors = _each(held.plain_errors)
    yield Row("held, 1–3 Hz ±20 mm, mean error [%]", tuple(map(statistics.mean, errors)), HELD_PERCENT)
    yield Row("held, 1–3 Hz ±20 mm, greatest error [%]", tuple(map(max, errors)))
    quick = _each(lambda velocity: statistics.mean(held.plain_errors(velocity, (held.QUICK,))))
    yield Row(f"held, {held.QUICK}, mean error [%]", quick)


def _whole() -> Iterator[Row]:
    for name, scene in zip(held.WHOLE_LIQUIDS, held.whole_forces(), strict=True):
        bound = 100 * wiener_bound(scene, imposed.COUNT_M, held.DELAY * PERIOD_S)
        for hand in held.HANDS:
            values = tuple(held.error(scene, it, GRIPS[hand], held.WHOLE) for it in ESTIMATORS)
            goal = WHOLE_PERCENT[name] if hand == "middle" else None
            yield Row(f"whole force, {held.WHOLE}, scale 3, {name}, {hand} [%]", values, goal, bound=bound)


def _cost() -> Iterator[Row]:
    yield Row("cost above the plain difference [ns per tick]", _each(imposed.cost_ns), MOST_COST_NS)


PARTS: Final[Mapping[str, Callable[[], Iterator[Row]]]] = {
    "errors in imposed motions": _imposed,
    "noise": _noise,
    "stable damping": _boundaries,
    "closed loops": _held,
    "whole forces": _whole,
    "cost": _cost,
}
