"""The maximum stable damping of a sampled loop, and the force that the servo sends in uniform motion.

Neither needs compiled code. The table of slope limits is ``slope_limits.csv`` in this folder, measured by
``validation.stability`` on the servo's own tick; how its numbers follow from the measurement is said there.
"""

import csv
import math
from functools import cache, lru_cache
from importlib import resources
from typing import Final, Literal, NamedTuple

from study_app.errors import StudyError
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.effects.drag import resistance_n
from study_app.haptics.model.effects.non_newtonian import VISCOUS_SHARE, steady_n
from study_app.haptics.model.effects.unsteady_drag import LATE_SHARE, steady_force_n
from study_app.haptics.model.estimators import LINES, NAMED, DeviceVelocity
from study_app.haptics.model.force_rules import CURRENT, ForceRules
from study_app.haptics.model.gate import effective_speed_mps, resolve
from study_app.haptics.model.scene import Ewma, Given, Kalman, Scene, Velocity, Withdrawn

_SLOWEST_HZ: Final = 500.0
"""Lowest rate for participants [Hz]: with slower servos they would feel the limits rather than the liquids."""
_FASTEST_DELAYED_HZ: Final = 1000.0
_LEAST_DELAYED_KG: Final = 0.1
"""Highest rate, and least mass of the handle, with a force that a study delays. Of 31,750 simulated loops, 9 were
unstable, all of them beyond these limits."""
MEASURED_KG: Final = 0.1
"""Mass of the free handle in the measurement of the table."""
LIGHTER: Final = 2.0
"""The limit of a lighter handle is lower by this power of the mass ratio: at 1.7, released handles of 50 g oscillated
in honey if the delay was one tick longer than assumed; from 1.8 on none of 801 handles of 30 to 250 g did."""
SLEW_N: Final = 1.5
"""Greatest change of the force within a millisecond on a handle of `MEASURED_KG` or more."""
KALMAN_SLEW: Final = 0.8
"""Factor on `SLEW_N` with "kalman": at 1, a released handle oscillated in tar if the delay was one tick longer."""
SLEW_S: Final = 1e-3
_NOMINAL_S: Final = 1e-3
_THESIS: Final = Ewma()
_SAME: Final = 1e-9  # tolerance for periods that differ only by rounding
HAND_MPS: Final = 0.1
"""Hand speed while exploring a liquid [m/s]."""


class DampingLimits(NamedTuple):
    """The maximum stable damping [N·s/m at the hand] of drag, and of added mass and history in addition."""

    drag_nspm: float
    inertia_nspm: float


class Entry(NamedTuple):
    """One line of the table: a velocity estimator, a tick period and a delay, and the limits of such a loop.

    ``parameter`` is the weight of "ewma" and the samples of "line"; None for the others. "line" is a least-squares
    line, as `DeviceVelocity` needs it; its rows were measured by an earlier version.
    """

    estimator: str
    parameter: float | None
    period_s: float
    delay_ticks: int
    limits: DampingLimits


def slope_limit(period_s: float, delay_ticks: int, velocity: Velocity | DeviceVelocity = _THESIS) -> float:
    """Return the greatest damping of drag [N·s/m at the hand]; see `damping_limits`."""
    return damping_limits(period_s, delay_ticks, velocity).drag_nspm


@lru_cache(maxsize=256)
def damping_limits(period_s: float, delay_ticks: int, velocity: Velocity | DeviceVelocity = _THESIS) -> DampingLimits:
    """Return the limits of a loop with a tick period [s], a delay [ticks] and a velocity estimator.

    Between two periods or parameters in the table the lower limit counts, between two delays the longer one; below the
    shortest period, the limit falls in proportion to the period. A given velocity has no estimator; it is taken as the
    thesis' own, "ewma".
    The velocity that a device measures has the limits of a line of the same lag (`DeviceVelocity.line`). The entries
    of "kalman" also hold if the delay is one tick longer or shorter than assumed, and while EWMA replaces it.
    """
    if isinstance(velocity, Withdrawn):
        raise StudyError(": ".join(velocity.refusal))
    limits = [limit for row in _rows(velocity, period_s) for limit in _neighbours(row, period_s, delay_ticks)]
    if not limits:
        raise StudyError(
            f"no force has been shown to be stable at {1 / period_s:g} ticks per second with a delay of {delay_ticks} "
            "ticks: "
            "run at 250 Hz or more, with a delay of at most 4 ticks"
        )
    beyond = min(1.0, period_s / min(entry.period_s for entry in slope_limit_table()))
    return DampingLimits(
        drag_nspm=beyond * min(it.drag_nspm for it in limits),
        inertia_nspm=beyond * min(it.inertia_nspm for it in limits),
    )


def handle_limits(
    period_s: float,
    delay_ticks: int,
    velocity: Velocity | DeviceVelocity,
    mass_kg: float = MEASURED_KG,
    rules: ForceRules = CURRENT,
) -> DampingLimits:
    """Return the limits of `damping_limits` for a handle of this mass, by the rules of a version.

    With "kalman" and "ewma" at 1 kHz, the inertia limits follow from the drag limits (`ForceRules`).
    """
    lighter = min(mass_kg / MEASURED_KG, 1.0) ** LIGHTER
    drag_nspm, inertia_nspm = damping_limits(period_s, delay_ticks, velocity)
    if rules.most_inertia_nspm > 0.0 and abs(period_s - _NOMINAL_S) < _SAME:
        of_drag_nspm = rules.most_inertia_nspm * min(drag_nspm / rules.inertia_drag_nspm, 1.0) ** 3
        if isinstance(velocity, Kalman):
            inertia_nspm = of_drag_nspm
        elif isinstance(velocity, Ewma):
            at_one_tick = damping_limits(period_s, 1, velocity)
            inertia_nspm = max(inertia_nspm, min(rules.ewma_share * of_drag_nspm, at_one_tick.inertia_nspm))
    return DampingLimits(lighter * drag_nspm, lighter * inertia_nspm)


def slew_limit_n(period_s: float, dynamics: Dynamics, velocity: Velocity | DeviceVelocity = _THESIS) -> float:
    """Return the greatest change of the force on a device's handle per tick [N].

    A loop slower than 1 kHz has the same change per millisecond. Without a measured delay "ewma" replaces "kalman".
    """
    share = KALMAN_SLEW if isinstance(velocity, Kalman) and dynamics.delay_s is not None else 1.0
    return share * SLEW_N * min(dynamics.mass_kg / MEASURED_KG, 1.0) * max(period_s / SLEW_S, 1.0)


def _rows(velocity: Velocity | DeviceVelocity, period_s: float) -> tuple[tuple[str, float | None], ...]:
    """Return estimator and parameter of the entries that bound this estimator."""
    if isinstance(velocity, Given):
        velocity = _THESIS
    if isinstance(velocity, DeviceVelocity):
        name, value, measured = "line", float(velocity.line(period_s)), LINES
    elif isinstance(velocity, Ewma):
        name, value, measured = velocity.kind, velocity.alpha, NAMED[velocity.kind].measured
    else:
        return ((velocity.kind, None),)
    below = max((it for it in measured if it <= value), default=measured[0])
    return (name, below), (name, min(it for it in measured if it >= value))


def _neighbours(row: tuple[str, float | None], period_s: float, delay_ticks: int) -> list[DampingLimits]:
    """Return the limits of an estimator at the next longer delay, at the next slower and the next faster rate."""
    known = [it for it in slope_limit_table() if (it.estimator, it.parameter) == row and it.delay_ticks >= delay_ticks]
    delay_ticks = min((entry.delay_ticks for entry in known), default=0)
    periods_s = {entry.period_s for entry in known}
    slower_s = [known_s for known_s in periods_s if known_s >= period_s * (1 - _SAME)]
    faster_s = [known_s for known_s in periods_s if known_s <= period_s * (1 + _SAME)]
    if not slower_s:
        return []
    beside_s = {min(slower_s), max(faster_s, default=min(slower_s))}
    return [entry.limits for entry in known if entry.delay_ticks == delay_ticks and entry.period_s in beside_s]


@cache
def slope_limit_table() -> tuple[Entry, ...]:
    """Return the shipped table."""
    with (resources.files("study_app.haptics.model") / "slope_limits.csv").open(encoding="utf-8") as file:
        return tuple(
            Entry(
                row["estimator"],
                float(row["parameter"]) if row["parameter"] else None,
                float(row["period_ms"]) * 1e-3,
                int(row["delay_ticks"]),
                DampingLimits(float(row["drag_nspm"]), float(row["inertia_nspm"])),
            )
            for row in csv.DictReader(file)
        )


def refusal_reason(rate_hz: float) -> str | None:
    """Return the reason why a servo of this rate must not run a participant, in a sentence, or None."""
    if rate_hz >= _SLOWEST_HZ:
        return None
    return (
        f"the servo runs at {rate_hz:g} Hz; below {_SLOWEST_HZ:g} Hz participants feel the stability limits instead "
        f"of the liquids: set device.rate_hz to 1000"
    )


def delayed_force_fault(rate_hz: float, mass_kg: float) -> str | None:
    """Return the reason why no force may be delayed at this rate with a handle of this mass, or None."""
    if rate_hz > _FASTEST_DELAYED_HZ:
        return (
            f"the servo runs at {rate_hz:g} Hz; above {_FASTEST_DELAYED_HZ:g} Hz a delayed force may be unstable: set "
            "device.rate_hz to 1000"
        )
    if mass_kg < _LEAST_DELAYED_KG:
        return (
            f"the handle has a mass of {1000 * mass_kg:.0f} g; below {1000 * _LEAST_DELAYED_KG:g} g a delayed force "
            "may be unstable: use a heavier handle"
        )
    return None


class Steady(NamedTuple):
    """The sent force [N], the drag before the safety layer, and the limit that reduced it, if any."""

    force_n: float
    drag_n: float
    limit: Literal["slope", "norm"] | None


def steady_force(scene: Scene, hand_mps: float = HAND_MPS) -> Steady:
    """Return the force on a hand in uniform motion at ``hand_mps`` through the scene's liquid at rest.

    Only drag, after the safety layer: without wake, acceleration and buoyancy. The scene has one liquid; the loop one
    tick of delay.
    """
    (liquid,) = resolve(scene).liquids
    if not {"drag", "unsteady_drag", "non_newtonian"} & set(liquid.effects):
        return Steady(0.0, 0.0, None)
    speed_mps = effective_speed_mps(scene, liquid, scene.scale * hand_mps)
    slope_n = slope_limit(1 / scene.rate_hz, 1, scene.velocity) * speed_mps / scene.scale
    if "drag" in liquid.effects:
        drag_n = resistance_n(scene, liquid, speed_mps, liquid.drag.law)
        stable_n = min(drag_n, slope_n)
    elif "non_newtonian" in liquid.effects:
        drag_n = sum(steady_n(scene, liquid, speed_mps))
        held_n, viscous_n = steady_n(scene, liquid, speed_mps, slope_n / speed_mps if speed_mps > 0 else math.inf)
        stable_n = held_n + min(viscous_n, slope_n * (VISCOUS_SHARE if held_n > 0 else 1.0))
    else:
        drag_n, stokes_n = steady_force_n(scene, liquid, speed_mps)
        most_late_n = LATE_SHARE * math.sqrt(2) * max(slope_n - stokes_n, 0.0)  # ball and wake have the same speed
        stable_n = drag_n if drag_n - stokes_n <= most_late_n else min(stokes_n, slope_n) + most_late_n
    force_n = min(stable_n, scene.force_limit_n)
    if force_n == drag_n:
        return Steady(force_n, drag_n, None)
    return Steady(force_n, drag_n, "norm" if force_n == scene.force_limit_n else "slope")
