"""Added mass: an accelerating ball also accelerates the liquid around it."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import Field

from study_app.haptics.model.effect import (
    FLOAT,
    Effect,
    Extremes,
    Fields,
    Liquid,
    Parameter,
    Scene,
    rate_per_s,
    smoothing_s,
)
from study_app.haptics.model.ranges import Frozen, Smoothing, within

BIT = 1 << 6

SMOOTHING_S: Final = 0.025


class _AddedMass(Frozen):
    """The mass of the liquid that is accelerated with the body."""

    coefficient: Annotated[
        float,
        within(
            0,
            10,
            "a sphere has a coefficient of 0.5",
            what="Added mass divided by the mass of the displaced liquid, C_a.",
        ),
    ] = 0.5
    filter_s: Smoothing | None = Field(
        default=None,
        description="Time over which the acceleration is smoothed [s]; the default depends on the velocity estimator.",
    )


def _accelerated_n(extremes: Extremes, acceleration_mps2: float, change_mps: float) -> float:
    """Return C_a ρ V a."""
    liquid = extremes.liquid
    mass_kg = float(liquid.added_mass.coefficient * liquid.density_kg_m3 * extremes.volume_m3)
    return mass_kg * acceleration_mps2


def _bound_n(extremes: Extremes) -> float:
    """Return C_a ρ V (a + s v), s the shear of the current."""
    return float(extremes.inertial_n(_accelerated_n))


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    mass = liquid.added_mass
    record.mass_kg = mass.coefficient * liquid.density_kg_m3 * scene.body.volume_m3
    record.filter_per_s = rate_per_s(smoothing_s(scene.velocity, mass.filter_s, SMOOTHING_S))


def damping_nspm(mass_kg: float, filter_per_s: float) -> float:
    """Return M/τ: the damping of fast motion by an added mass M smoothed over τ."""
    return float(mass_kg * filter_per_s) if math.isfinite(filter_per_s) else 0.0


_PARAMETERS: Fields = (
    ("mass_kg", FLOAT),  # C_a ρ V
    ("filter_per_s", FLOAT),  # 1/τ
)

_STATE: Fields = (
    ("previous_mps", FLOAT, (3,)),  # w of the tick before
    ("smoothed_mps2", FLOAT, (2, 3)),  # dw/dt, smoothed once and twice
    ("acceleration_mps2", FLOAT, (3,)),  # dw/dt of these two
)

EFFECT = Effect(
    name="added_mass",
    label="Added mass",
    bit=BIT,
    bound_n=_bound_n,
    exerted_n=_bound_n,
    extent="volume",
    accelerated_n=_accelerated_n,
    model=_AddedMass,
    default=_AddedMass(),
    parameters=_PARAMETERS,
    state=_STATE,
    fill=_fill,
    damping_nspm=lambda record, rate: damping_nspm(record.mass_kg, rate * record.filter_per_s),
    open_values={"filter_s": lambda scene: smoothing_s(scene.velocity, None, SMOOTHING_S)},
    controls=(
        Parameter("added_mass.coefficient", "Coefficient", unit="", most=2.0),
        Parameter("added_mass.filter_s", "Smoothing", unit="s", most=0.2, factor=1e3, shown_unit="ms", decimals=1),
    ),
)
