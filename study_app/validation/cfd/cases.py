"""What is solved: a ball that starts, moves evenly and stops at once, in liquids of a shipped protocol at hand speed.

Numbers without units are in ball diameters D, speeds U and liquid densities: times in D/U, forces in ρU²D².
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.errors import StudyError
from study_app.haptics.model.motion import Floats
from study_app.protocol.load import load_scene

PROTOCOL: Final = "physical_liquids"
LIQUIDS: Final = ("honey", "glycerin")
HIGHEST_REYNOLDS: Final = 200.0
"""Up to about 210 the flow behind a sphere is axisymmetric (Johnson & Patel 1999, J. Fluid Mech. 378:19)."""

RAMP: Final = 0.2
STOP: Final = 10.0
END: Final = 20.0
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)


@dataclass(frozen=True, slots=True)
class Case:
    """A ball in one liquid, which gets to ``speed_mps`` in 0.2 D/U, stops after 10 D/U and is watched for 10 more."""

    liquid_id: str
    density_kg_m3: float
    viscosity_pa_s: float
    diameter_m: float
    speed_mps: float

    def __post_init__(self) -> None:
        if self.reynolds > HIGHEST_REYNOLDS:
            raise StudyError(
                f"{self.liquid_id} at {self.speed_mps:g} m/s has a Reynolds number of {self.reynolds:.0f}: the flow is "
                f"axisymmetric, as the solver takes it to be, up to {HIGHEST_REYNOLDS:g}"
            )

    @property
    def name(self) -> str:
        """Name of the file without its ending."""
        return f"{self.liquid_id}-{round(self.speed_mps * 1000)}mmps"

    @property
    def reynolds(self) -> float:
        """Re = ρUD/µ."""
        return self.density_kg_m3 * self.speed_mps * self.diameter_m / self.viscosity_pa_s

    @property
    def unit_s(self) -> float:
        """D/U."""
        return self.diameter_m / self.speed_mps

    @property
    def unit_n(self) -> float:
        """ρU²D²."""
        return self.density_kg_m3 * (self.speed_mps * self.diameter_m) ** 2


def cases() -> tuple[Case, ...]:
    """Return each liquid at the greatest speed its protocol reckons with, in the scene and, as at scale 1, the hand."""
    found = []
    for liquid_id in LIQUIDS:
        scene = load_scene(PROTOCOL, liquid_id)
        (liquid,) = scene.liquids
        fastest_mps = scene.motion_in(liquid).speed_mps or math.nan
        found += [
            Case(liquid_id, liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan, scene.body.diameter_m, speed_mps)
            for speed_mps in (fastest_mps / scene.scale, fastest_mps)
        ]
    return tuple(found)


def moments(step: float) -> Floats:
    """Return the times (n,) at which the flow is solved: ``step`` apart for half a D/U after start and stop.

    Twice as far apart in the D/U after that, four times in the rest.
    """
    part = np.concatenate(
        [
            np.linspace(least, most, round((most - least) / (times * step)), endpoint=False)
            for least, most, times in ((0.0, 0.5, 1), (0.5, 1.5, 2), (1.5, STOP, 4))
        ]
    )
    return np.concatenate([part, STOP + part, [END]])


def speed(t: float) -> float:
    """Return the speed of the ball in U: up and down with least jerk (Flash & Hogan 1985)."""
    return _rise(t / RAMP) - _rise((t - STOP) / RAMP)


def acceleration(t: float) -> float:
    """Return the acceleration of the ball in U²/D."""
    return (_slope(t / RAMP) - _slope((t - STOP) / RAMP)) / RAMP


def linear_drag(t: float, reynolds: float) -> float:
    """Return the force against the motion in creeping flow, exact for an unbounded liquid, in ρU²D².

    Stokes' drag, the inertia of half the displaced liquid, and the Basset integral (Landau & Lifshitz, Fluid Mechanics,
    §24), here by Gauss' rule in √(t − τ), in which it has no singularity.
    """
    viscosity = 1 / reynolds
    memory = 0.0
    for begin in (0.0, STOP):
        least, most = (math.sqrt(max(t - begin - part, 0.0)) for part in (RAMP, 0.0))
        roots = (most - least) / 2 * _NODES + (most + least) / 2
        sign = 1.0 if begin == 0.0 else -1.0
        slopes = np.array([sign * _slope((t - root**2 - begin) / RAMP) / RAMP for root in roots.tolist()])
        memory += (most - least) * float(_WEIGHTS @ slopes)
    return (
        3 * math.pi * viscosity * speed(t)
        + math.pi / 12 * acceleration(t)
        + 1.5 * math.sqrt(math.pi * viscosity) * memory
    )


def linear_drags(t: Floats, reynolds: float) -> Floats:
    """Return `linear_drag` at times (n,)."""
    return np.array([linear_drag(at, reynolds) for at in t.tolist()])


def _rise(x: float) -> float:
    x = min(max(x, 0.0), 1.0)
    return x**3 * (10 - 15 * x + 6 * x**2)


def _slope(x: float) -> float:
    x = min(max(x, 0.0), 1.0)
    return 30 * (x * (1 - x)) ** 2
