"""Laws of drag and of flow: published formulas as plain functions, without a scene, compiled or not.

Each law of drag gives it as a multiple of Stokes', F / (3πµD|w|) = C_d Re / 24, which is 1 at Re = 0 where C_d itself
is infinite. Above Re = 2·10⁵ the drag coefficient keeps its value there: the laws do not model the drag crisis. Flow
curves have a rheometer's parameters; they do not model thixotropy, impact, or yielding in unsteady flow other than by
the elastic-plastic state of the kernel. Kernels compile these functions unchanged.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, Final, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from study_app.haptics.model.ranges import Frozen, ViscosityPaS, within

Law: TypeAlias = Literal["constant", "schiller-naumann", "haider-levenspiel", "brown-lawler", "linear"]

LAW_NAMES: Final[dict[Law, str]] = {
    "constant": "constant",
    "schiller-naumann": "Schiller–Naumann",
    "haider-levenspiel": "Haider–Levenspiel",
    "brown-lawler": "Brown–Lawler",
    "linear": "linear",
}
"""The name of each drag law within a sentence."""

HIGHEST_REYNOLDS: Final = 2e5
_CONSTANT_FROM: Final = 4040.0**0.70


def schiller_naumann(reynolds: float) -> float:
    """Return F/F_Stokes for C_d = max(24/Re (1 + 0.15 Re^0.687), 0.44) (Schiller & Naumann 1933).

    The maximum of the two branches, which cross at Re ≈ 990, makes the law continuous, unlike a switch at 1000.
    """
    held = min(reynolds, HIGHEST_REYNOLDS)
    ratio = max(1.0 + 0.15 * math.pow(held, 0.687), 0.44 / 24.0 * held)
    return ratio * max(reynolds / HIGHEST_REYNOLDS, 1.0)


def haider_levenspiel(reynolds: float) -> float:
    """Return F/F_Stokes for C_d = 24/Re (1 + 0.1806 Re^0.6459) + 0.4251/(1 + 6880.95/Re).

    Haider & Levenspiel 1989, Powder Technology 58, for spheres, Re ≤ 2·10⁵.
    """
    held = min(reynolds, HIGHEST_REYNOLDS)
    ratio = 1.0 + 0.1806 * math.pow(held, 0.6459) + 0.4251 / 24.0 * held * held / (held + 6880.95)
    return ratio * max(reynolds / HIGHEST_REYNOLDS, 1.0)


def brown_lawler(reynolds: float) -> float:
    """Return F/F_Stokes for C_d = 24/Re (1 + 0.150 Re^0.681) + 0.407/(1 + 8710/Re).

    Brown & Lawler 2003, Journal of Environmental Engineering 129, for spheres, Re ≤ 2·10⁵.
    """
    held = min(reynolds, HIGHEST_REYNOLDS)
    ratio = 1.0 + 0.150 * math.pow(held, 0.681) + 0.407 / 24.0 * held * held / (held + 8710.0)
    return ratio * max(reynolds / HIGHEST_REYNOLDS, 1.0)


def finite_reynolds(reynolds: float) -> float:
    """Return F/F_Stokes for 1 + (3/16) Re/(1 + 0.450 √Re) + (0.486/24) Re/(1 + (4040/Re)^0.70).

    It has Oseen's term at low Re and a constant C_d at high Re; in between it was fitted to this project's fluid
    solver, within 1.7 % at Re 1 to 200. Used only by ``unsteady_drag``; below Re = 10⁵ within 2.7 % of the mean of the
    published laws.
    """
    grown = math.pow(reynolds, 0.70)
    oseen = 3.0 / 16.0 * reynolds / (1.0 + 0.450 * math.sqrt(reynolds))
    return 1.0 + oseen + 0.486 / 24.0 * reynolds * grown / (grown + _CONSTANT_FROM)


LAWS: Final[dict[Law, Callable[[float], float]]] = {
    "schiller-naumann": schiller_naumann,
    "haider-levenspiel": haider_levenspiel,
    "brown-lawler": brown_lawler,
}
"""The laws of the Reynolds number, cheapest first."""


def drag_n(
    law: Law,
    speed_mps: float,
    *,
    density_kg_m3: float,
    viscosity_pa_s: float | None,
    diameter_m: float,
    drag_coefficient: float,
) -> float:
    """Return the drag [N] on a sphere at a relative speed by a law; only ``constant`` uses the coefficient."""
    if law == "constant":
        return 0.5 * density_kg_m3 * drag_coefficient * math.pi / 4 * diameter_m**2 * speed_mps**2
    if viscosity_pa_s is None or law not in LAWS:
        raise ValueError(
            f"the law {law!r} needs a viscosity" if law in LAWS else (f"{law!r} is not a drag law for a sphere")
        )
    reynolds = density_kg_m3 * speed_mps * diameter_m / viscosity_pa_s
    return 3 * math.pi * viscosity_pa_s * diameter_m * speed_mps * LAWS[law](reynolds)


_YIELD: Final = 1.157
"""Yield drag over 3π D² τ_y, fitted to this project's fluid solver; 1.166 from Beris et al. 1985."""
_PLASTIC: Final = 1.7
"""Factor of the plastic boundary layer, likewise: 3π D² · 1.7 n^1.5 √(τ_v τ_y)."""
CARREAU_RATE: Final = 0.275
"""Mean shear rate of a Carreau liquid around a sphere, over 2|w|/D."""
_THICKENED_WITHIN: Final = 2.0
"""Shear thickening is complete at this multiple of the shear rate of its onset."""
RESOLVED_S: Final = 0.01
"""A shorter relaxation is below what the velocity estimator resolves: the liquid counts as Newtonian."""

_INDICES: Final = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_SHAPES: Final = (1.354, 1.413, 1.458, 1.442, 1.420, 1.382, 1.320, 1.240, 1.140, 1.0)

_StressPa: TypeAlias = Annotated[
    float,
    within(
        0,
        5000,
        "materials with a higher yield stress are solids; toothpaste has 50 to 200 Pa",
        what="Yield stress τ_y [Pa].",
    ),
]
_ConsistencyPaSn: TypeAlias = Annotated[
    float, within(1e-4, 1e5, "water has 0.001 Pa·s, ketchup 10 Pa·sⁿ", what="Consistency K [Pa·sⁿ].")
]
_FlowIndex: TypeAlias = Annotated[
    float,
    within(
        0.1,
        1,
        'below 0.1, the drag on a sphere is unknown; above 1, use "shear-thickening"',
        what="Flow index n; 1: no shear thinning.",
    ),
]
_TimeS: TypeAlias = Annotated[
    float,
    within(
        1e-4,
        1000,
        ("with a shorter time, a liquid behaves as if Newtonian; with a longer time, it behaves like a solid"),
    ),
]
_ShearRate: TypeAlias = Annotated[float, within(0.01, 1e5, "a hand shears a liquid at rates of 0.1 to 100 per second")]


class HerschelBulkley(Frozen):
    """Flow curve τ = τ_y + K γ̇^n: yield stress, consistency, flow index. Bingham: n = 1; power law: τ_y = 0."""

    kind: Literal["herschel-bulkley"] = "herschel-bulkley"
    yield_stress_pa: _StressPa = 0.0
    consistency_pa_sn: _ConsistencyPaSn
    flow_index: _FlowIndex = 1.0


class Carreau(Frozen):
    """Flow curve τ = η₀ γ̇ [1 + (λγ̇)²]^((n−1)/2): shear thinning, without a yield stress."""

    kind: Literal["carreau"] = "carreau"
    zero_shear_viscosity_pa_s: ViscosityPaS = Field(description="Viscosity η₀ at low shear rates [Pa·s].")
    time_constant_s: _TimeS = Field(description="Time constant λ [s]; shear thinning begins at the rate 1/λ.")
    flow_index: _FlowIndex


class Maxwell(Frozen):
    """Stress given by τ + λ dτ/dt = η γ̇: viscoelastic, with relaxation time λ and shear modulus η/λ."""

    kind: Literal["maxwell"] = "maxwell"
    zero_shear_viscosity_pa_s: ViscosityPaS = Field(description="Viscosity η in steady flow [Pa·s].")
    relaxation_time_s: _TimeS = Field(description="Relaxation time λ [s].")


class ShearThickening(Frozen):
    """Viscosity η₀ up to the onset shear rate, thickened from twice that rate; in between, τ is linear in γ̇."""

    kind: Literal["shear-thickening"] = "shear-thickening"
    zero_shear_viscosity_pa_s: ViscosityPaS = Field(description="Viscosity η₀ at low shear rates [Pa·s].")
    thickened_viscosity_pa_s: ViscosityPaS = Field(description="Viscosity at high shear rates [Pa·s].")
    onset_shear_rate_per_s: _ShearRate = Field(description="Shear rate at which thickening begins [1/s].")

    @model_validator(mode="after")
    def _thickens(self) -> Self:
        if self.thickened_viscosity_pa_s < self.zero_shear_viscosity_pa_s:
            raise ValueError(
                f"thickened_viscosity_pa_s = {self.thickened_viscosity_pa_s:g} is less than zero_shear_viscosity_pa_s "
                f'= {self.zero_shear_viscosity_pa_s:g}: for a liquid that thins, write kind = "carreau"'
            )
        return self


Rheology: TypeAlias = Annotated[
    HerschelBulkley | Carreau | Maxwell | ShearThickening,
    Field(discriminator="kind", description="The flow curve of a non-Newtonian liquid."),
]


def shape_factor(flow_index: float) -> float:
    """Return X(n), the drag of a power-law liquid over 3π D² K (w/D)^n (Gu & Tanner 1985), interpolated."""
    for below in range(len(_INDICES) - 1):
        if flow_index <= _INDICES[below + 1]:
            share = (flow_index - _INDICES[below]) / (_INDICES[below + 1] - _INDICES[below])
            return _SHAPES[below] + share * (_SHAPES[below + 1] - _SHAPES[below])
    return 1.0


def herschel_bulkley(speed_mps: float, viscous: float, plastic: float, half_index: float) -> float:
    """Return the viscous part of the force [N]: a w^n + b w^(n/2), from flow and plastic boundary layer."""
    root = math.pow(speed_mps, half_index)
    return (viscous * root + plastic) * root


def carreau(speed_mps: float, stokes_nspm: float, time_spm: float, exponent: float) -> float:
    """Return the force [N]: 3πη₀D w [1 + (t w)²]^((n−1)/2)."""
    rate = time_spm * speed_mps
    return stokes_nspm * speed_mps * math.pow(1.0 + rate * rate, exponent)


def shear_thickening(value: float, slope: float, thickened: float, onset: float, steepest: float) -> float:
    """Return the stress at a shear rate, or the force at a speed: slope · v up to the onset, a ramp, thickened · v.

    The ramp ends at twice the onset, or has the slope ``steepest`` if that is smaller.
    """
    rising = max(min((_THICKENED_WITHIN * thickened - slope) / (_THICKENED_WITHIN - 1.0), steepest), slope)
    return min(max(slope * value, slope * onset + rising * (value - onset)), thickened * value)


def stress_pa(rheology: Any, shear_rate_per_s: float) -> float:
    """Return the shear stress [Pa] of steady shear: the flow curve."""
    rate = shear_rate_per_s
    if isinstance(rheology, HerschelBulkley):
        return float(rheology.yield_stress_pa + rheology.consistency_pa_sn * rate**rheology.flow_index)
    if isinstance(rheology, Carreau):
        exponent = (rheology.flow_index - 1) / 2
        return carreau(rate, rheology.zero_shear_viscosity_pa_s, rheology.time_constant_s, exponent)
    if isinstance(rheology, Maxwell):
        return float(rheology.zero_shear_viscosity_pa_s * rate)
    return shear_thickening(
        rate,
        rheology.zero_shear_viscosity_pa_s,
        rheology.thickened_viscosity_pa_s,
        rheology.onset_shear_rate_per_s,
        math.inf,
    )


def yield_n(rheology: Any, diameter_m: float) -> float:
    """Return the yield force [N] of a sphere at rest, below which the liquid does not flow: 3π D² · 1.157 τ_y."""
    return 3 * math.pi * diameter_m**2 * _YIELD * getattr(rheology, "yield_stress_pa", 0.0)


def viscous_factors(rheology: HerschelBulkley, diameter_m: float) -> tuple[float, float]:
    """Return a and b of `herschel_bulkley`: 3πD² X K D^−n and 3πD² · 1.7 n^1.5 √(K D^−n τ_y)."""
    index, area_m2 = rheology.flow_index, 3 * math.pi * diameter_m**2
    stress = rheology.consistency_pa_sn * diameter_m**-index
    plastic = _PLASTIC * index**1.5 * math.sqrt(stress * rheology.yield_stress_pa)
    return area_m2 * shape_factor(index) * stress, area_m2 * plastic


def creeping_n(
    rheology: Any, diameter_m: float, speed_mps: float, steepest_nspm: float = math.inf
) -> tuple[float, float]:
    """Return the force [N] on a sphere in steady creeping flow: that of the yield stress, and the viscous part.

    ``steepest_nspm`` limits how steeply the force of a liquid that thickens grows.
    """
    if isinstance(rheology, HerschelBulkley):
        viscous, plastic = viscous_factors(rheology, diameter_m)
        parts = herschel_bulkley(speed_mps, viscous, plastic, rheology.flow_index / 2)
        return yield_n(rheology, diameter_m), parts
    stokes_nspm = 3 * math.pi * diameter_m * rheology.zero_shear_viscosity_pa_s
    if isinstance(rheology, Carreau):
        time_spm = CARREAU_RATE * 2 * rheology.time_constant_s / diameter_m
        return 0.0, carreau(speed_mps, stokes_nspm, time_spm, (rheology.flow_index - 1) / 2)
    if isinstance(rheology, Maxwell):
        return 0.0, stokes_nspm * speed_mps
    thickened_nspm = 3 * math.pi * diameter_m * rheology.thickened_viscosity_pa_s
    onset_mps = rheology.onset_shear_rate_per_s * diameter_m / 2
    return 0.0, shear_thickening(speed_mps, stokes_nspm, thickened_nspm, onset_mps, steepest_nspm)


def _inertial_factor(force_n: float, speed_mps: float, inertia_kg_m: float) -> float:
    """Return the factor φ(Re) on the force of creeping flow: Re = ρ|w|D/η with the effective viscosity η = F/(3πD|w|).

    ``inertia_kg_m`` is 3πρD².
    """
    return finite_reynolds(inertia_kg_m * speed_mps * speed_mps / force_n) if force_n > 0.0 else 1.0


def steady_force_n(
    rheology: Any, density_kg_m3: float, diameter_m: float, speed_mps: float, steepest_nspm: float = math.inf
) -> tuple[float, float]:
    """Return the force [N] on a sphere in uniform motion: that of the yield stress, and the viscous part."""
    held_n, viscous_n = creeping_n(rheology, diameter_m, speed_mps)
    ratio = _inertial_factor(held_n + viscous_n, speed_mps, 3 * math.pi * density_kg_m3 * diameter_m**2)
    limited_n = creeping_n(rheology, diameter_m, speed_mps, steepest_nspm)[1]
    return held_n, ratio * limited_n + (ratio - 1.0) * held_n
