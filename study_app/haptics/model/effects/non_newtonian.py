"""Non-Newtonian drag: a liquid with a yield stress, shear thinning or thickening, or elasticity resists motion."""

import math
from collections.abc import Mapping
from typing import Any, Final

from study_app.haptics.model import laws
from study_app.haptics.model.effect import FLOAT, INT, Effect, Extremes, Fields, Liquid, Parameter, Scene

BIT = 1 << 9

KIND_HERSCHEL_BULKLEY = 0
KIND_CARREAU = 1
KIND_MAXWELL = 2
_KIND_SHEAR_THICKENING = 3

STIFFNESS_NPM: Final = 400.0
"""Greatest elastic stiffness at the hand below the yield stress, of a loop that is stable with `_FULL_NSPM`."""
_FULL_NSPM: Final = 53.0
VISCOUS_SHARE: Final = 0.75
"""Fraction of the slope limit for the viscous force of a liquid that is also elastic. [choice]"""

_REPLACES: Final = ("drag", "unsteady_drag", "history")
_START: Final[dict[str, dict[str, float]]] = {
    "herschel-bulkley": {"yield_stress_pa": 15.0, "consistency_pa_sn": 10.0, "flow_index": 0.25},
    "carreau": {"zero_shear_viscosity_pa_s": 6.0, "time_constant_s": 0.15, "flow_index": 0.3},
    "maxwell": {"zero_shear_viscosity_pa_s": 30.0, "relaxation_time_s": 0.3},
    "shear-thickening": {
        "zero_shear_viscosity_pa_s": 1.0,
        "thickened_viscosity_pa_s": 20.0,
        "onset_shear_rate_per_s": 5.0,
    },
}
"""Initial values in the lab: ketchup, shampoo, slime and cornstarch in water."""
_NOT_MODELLED: Final = "not modelled: thixotropy, impact, fracture, and yielding in unsteady flow"


def steady_n(scene: Scene, liquid: Liquid, speed_mps: float, steepest_nspm: float = math.inf) -> tuple[float, float]:
    """Return the force [N] in uniform motion: that of the yield stress, and the viscous part."""
    diameter_m = scene.body.diameter_m
    return laws.steady_force_n(liquid.non_newtonian, liquid.density_kg_m3, diameter_m, speed_mps, steepest_nspm)


def _bound_n(extremes: Extremes) -> float | None:
    """Return F(v) of uniform motion."""
    if extremes.liquid.non_newtonian is None:
        return None
    return sum(steady_n(extremes.scene, extremes.liquid, extremes.speed_mps)) if extremes.speed_mps > 0 else 0.0


def _exerted_n(extremes: Extremes) -> float | None:
    """Return the force of a body moving against the selected current; strokes shorter than λ build up less stress."""
    rheology = extremes.liquid.non_newtonian
    if rheology is None:
        return None
    even_motion_n = sum(steady_n(extremes.scene, extremes.liquid, extremes.relative_mps))
    if not isinstance(rheology, laws.Maxwell) or extremes.speed_mps == 0.0:
        return even_motion_n
    return even_motion_n / math.hypot(1.0, rheology.relaxation_time_s * extremes.acceleration_mps2 / extremes.speed_mps)


def _problem(liquid: Liquid) -> str | None:
    if liquid.viscosity_pa_s is None:
        return None
    return (
        "viscosity_pa_s describes a Newtonian liquid, but the table non_newtonian specifies a different law: remove "
        "one of them"
    )


def _fill(record: Any, liquid: Liquid, scene: Scene, first: Mapping[str, int]) -> None:
    rheology, diameter_m = liquid.non_newtonian, scene.body.diameter_m
    record.inertia_kg_m = 3 * math.pi * liquid.density_kg_m3 * diameter_m**2
    if isinstance(rheology, laws.HerschelBulkley):
        record.kind = KIND_HERSCHEL_BULKLEY
        record.viscous, record.plastic = laws.viscous_factors(rheology, diameter_m)
        record.exponent = rheology.flow_index / 2
        record.yield_n = laws.yield_n(rheology, diameter_m)
        record.stiffness_npm = STIFFNESS_NPM / scene.scale
        record.full_nspm = _FULL_NSPM / scene.scale
        return
    record.stokes_nspm = 3 * math.pi * diameter_m * rheology.zero_shear_viscosity_pa_s
    if isinstance(rheology, laws.Carreau):
        record.kind = KIND_CARREAU
        record.time_spm = laws.CARREAU_RATE * 2 * rheology.time_constant_s / diameter_m
        record.exponent = (rheology.flow_index - 1) / 2
    elif isinstance(rheology, laws.Maxwell):
        record.kind = KIND_MAXWELL
        record.relaxation_s = rheology.relaxation_time_s if rheology.relaxation_time_s >= laws.RESOLVED_S else 0.0
    else:
        record.kind = _KIND_SHEAR_THICKENING
        record.thickened_nspm = 3 * math.pi * diameter_m * rheology.thickened_viscosity_pa_s
        record.onset_mps = rheology.onset_shear_rate_per_s * diameter_m / 2


_PARAMETERS: Fields = (
    ("kind", INT),  # KIND_*
    ("inertia_kg_m", FLOAT),  # 3π ρ D²
    ("viscous", FLOAT),  # Herschel–Bulkley: a of a w^n [N (s/m)^n]
    ("plastic", FLOAT),  # b of b w^(n/2)
    ("exponent", FLOAT),  # Herschel–Bulkley: n/2; Carreau: (n − 1)/2
    ("yield_n", FLOAT),  # 3π D² · 1.157 τ_y
    ("stiffness_npm", FLOAT),  # greatest F_y / s_y [N/m, scene], at the slope limit below
    ("full_nspm", FLOAT),  # [N·s/m, scene]
    ("stokes_nspm", FLOAT),  # 3π η₀ D, of the other kinds
    ("time_spm", FLOAT),  # Carreau: 0.275 · 2λ/D
    ("relaxation_s", FLOAT),  # Maxwell: λ; 0 where it is too short to be resolved
    ("thickened_nspm", FLOAT),  # 3π η D after shear thickening
    ("onset_mps", FLOAT),  # speed of its onset
)

_STATE: Fields = (
    ("strain", FLOAT, (3,)),  # Herschel–Bulkley: s/s_y, elastic displacement over that of yielding, 0 … 1
    ("ahead_m", FLOAT, (3,)),  # distance of the ball from the place that |dp| counts from
    ("velocity_mps", FLOAT, (3,)),  # Maxwell: the velocity at which a Newtonian liquid exerts the same force
    ("step_m", FLOAT, (3,)),  # motion relative to the current within the tick
)


def _control(field: str, label: str, unit: str, least: float, most: float, **more: Any) -> Parameter:
    return Parameter(
        f"non_newtonian.{field}", label, unit=unit, least=least, most=most, **({"logarithmic": True} | more)
    )


EFFECT = Effect(
    name="non_newtonian",
    label="Non-Newtonian drag",
    bit=BIT,
    bound_n=_bound_n,
    exerted_n=_exerted_n,
    extent="area",
    bars=lambda extremes: (_REPLACES, "replaced by non-Newtonian drag, because the liquid has flow-curve parameters"),
    note=lambda liquid: f"; {liquid.non_newtonian.kind}, {_NOT_MODELLED}",
    model=laws.Rheology,
    missing='kind = "herschel-bulkley", "carreau", "maxwell" or "shear-thickening", ...',
    excludes=_REPLACES,
    replaces=("viscosity_pa_s",),
    problem=_problem,
    parameters=_PARAMETERS,
    state=_STATE,
    fill=_fill,
    start=lambda kind, _centre_m, _reach_m: {"kind": kind or "herschel-bulkley", **_START[kind or "herschel-bulkley"]},
    controls=(
        Parameter(
            "non_newtonian.kind",
            "Flow curve",
            choices=(
                ("herschel-bulkley", "Herschel–Bulkley"),
                ("carreau", "Carreau"),
                ("maxwell", "Maxwell"),
                ("shear-thickening", "Shear thickening"),
            ),
        ),
        _control("yield_stress_pa", "Yield stress", "Pa", 0.0, 500.0, logarithmic=False, decimals=1),
        _control("consistency_pa_sn", "Consistency K", "Pa·sⁿ", 1e-3, 1000.0),
        _control("flow_index", "Flow index n", "", 0.1, 1.0, logarithmic=False),
        _control("zero_shear_viscosity_pa_s", "Zero-shear viscosity", "Pa·s", 1e-3, 1000.0),
        _control("time_constant_s", "Time constant λ", "s", 1e-3, 10.0, decimals=3),
        _control("relaxation_time_s", "Relaxation time λ", "s", 1e-3, 10.0, decimals=3),
        _control("thickened_viscosity_pa_s", "Thickened viscosity", "Pa·s", 1e-3, 1000.0),
        _control("onset_shear_rate_per_s", "Onset shear rate", "1/s", 0.1, 1000.0),
    ),
)
