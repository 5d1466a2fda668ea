"""Unsteady drag: drag, added mass and history of a ball in one law that is also valid at finite Reynolds numbers."""

import math
from collections.abc import Mapping
from typing import Any, Final

from study_app.haptics.model.effect import FLOAT, Effect, Extremes, Fields, Liquid, Scene, rate_per_s, smoothing_s
from study_app.haptics.model.effects import added_mass, drag, history
from study_app.haptics.model.laws import finite_reynolds

BIT = 1 << 8

EXPONENTIALS = 7
LATE_SHARE: Final = 0.6
"""Fraction of the remaining slope limit that delayed drag may use."""
_HIGHEST_REYNOLDS: Final = 1000.0
"""Above Re 200 no flow solution exists for comparison; up to this value it is closer to experiments."""

_IN_PLACE_OF: Final = (drag.EFFECT, added_mass.EFFECT, history.EFFECT)


def steady_force_n(scene: Scene, liquid: Liquid, speed_mps: float) -> tuple[float, float]:
    """Return the force [N] in uniform motion, and its Stokes part, which acts at once."""
    viscosity_pa_s = liquid.viscosity_pa_s or 0.0
    stokes_n = 3 * math.pi * viscosity_pa_s * scene.body.diameter_m * speed_mps
    reynolds = liquid.density_kg_m3 * speed_mps * scene.body.diameter_m / viscosity_pa_s
    return stokes_n * finite_reynolds(reynolds), stokes_n


def _bound_n(extremes: Extremes) -> float | None:
    """Return the sum of the bounds of the effects that it replaces."""
    if extremes.liquid.viscosity_pa_s is None or extremes.liquid.drag.law == "linear":
        return None
    return sum(effect.bound_n(extremes) or 0.0 for effect in _IN_PLACE_OF)


def _bars(extremes: Extremes) -> tuple[tuple[str, ...], str]:
    """Return the effects that it excludes and why: those that it replaces, or itself at unsuitable Reynolds numbers."""
    reynolds = f"Re is up to {extremes.reynolds:.3g}"
    if extremes.reynolds <= _HIGHEST_REYNOLDS:
        return tuple(
            it.name for it in _IN_PLACE_OF
        ), f"replaced by unsteady drag, because {reynolds} (limit: {_HIGHEST_REYNOLDS:g})"
    return ("unsteady_drag", "history"), (
        f"{reynolds}; unsteady drag has not been checked against flow solutions above {_HIGHEST_REYNOLDS:g}"
    )


def _problem(liquid: Liquid) -> str | None:
    return 'the effect "unsteady_drag" needs the liquid\'s viscosity_pa_s' if liquid.viscosity_pa_s is None else None


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    diameter_m, viscosity_pa_s = scene.body.diameter_m, liquid.viscosity_pa_s or 0.0
    record.stokes_nspm = 3 * math.pi * viscosity_pa_s * diameter_m
    record.reynolds_spm = liquid.density_kg_m3 * diameter_m / viscosity_pa_s
    record.per_m = 1 / diameter_m
    record.mass_kg = 0.5 * liquid.density_kg_m3 * scene.body.volume_m3
    record.factor_kg_rs = 1.5 * diameter_m**2 * math.sqrt(math.pi * liquid.density_kg_m3 * viscosity_pa_s)
    record.filter_per_s = rate_per_s(smoothing_s(scene.velocity, liquid.added_mass.filter_s, added_mass.SMOOTHING_S))
    of_history_s = smoothing_s(scene.velocity, liquid.history.smoothing_s, history.SMOOTHING_S)
    record.history_filter_per_s = rate_per_s(of_history_s)


def _damping_nspm(record: Any, rate: float) -> float:
    """Return the damping of fast motion by its added mass and by its history."""
    of_mass_nspm = added_mass.damping_nspm(record.mass_kg, rate * record.filter_per_s)
    return of_mass_nspm + history.damping_nspm(record.factor_kg_rs, rate * record.history_filter_per_s)


_PARAMETERS: Fields = (
    ("stokes_nspm", FLOAT),  # 3π µ D
    ("reynolds_spm", FLOAT),  # ρ D / µ: Re a unit of speed
    ("per_m", FLOAT),  # 1/D
    ("mass_kg", FLOAT),  # ½ ρ V
    ("factor_kg_rs", FLOAT),  # 1.5 D² √(π ρ µ) [kg/√s]
    ("filter_per_s", FLOAT),  # 1/τ of dw/dt for the added mass
    ("history_filter_per_s", FLOAT),  # 1/τ of dw/dt for the history
)

_STATE: Fields = (
    ("previous_mps", FLOAT, (3,)),  # w of the tick before
    ("smoothed_mps2", FLOAT, (2, 3)),  # dw/dt for the added mass, smoothed once and twice
    ("acceleration_mps2", FLOAT, (3,)),  # dw/dt of these two
    ("history_smoothed_mps2", FLOAT, (2, 3)),  # the same for the history
    ("remembered_mps2", FLOAT, (3,)),
    ("wake_mps", FLOAT, (3,)),  # z
    ("far_wake_mps", FLOAT, (3,)),  # s
    ("excess_mps", FLOAT, (3,)),  # y
    ("memory_mps", FLOAT, (EXPONENTIALS, 3)),  # m
)

EFFECT = Effect(
    name="unsteady_drag",
    label="Unsteady drag",
    bit=BIT,
    bound_n=_bound_n,
    exerted_n=_bound_n,
    bars=_bars,
    excludes=(*(it.name for it in _IN_PLACE_OF), "wake", "local_wake"),
    problem=_problem,
    parameters=_PARAMETERS,
    state=_STATE,
    fill=_fill,
    damping_nspm=_damping_nspm,
)
