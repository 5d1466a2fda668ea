"""The solved cases: a ball in liquids of a shipped protocol that starts and stops, and motions for fitting a law."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from study_app.errors import StudyError
from study_app.evidence.cfd.profiles import (
    MULTI_SINE,
    OSCILLATION_KC4,
    OSCILLATION_KC5,
    RETURN,
    REVERSAL,
    STOPPING,
    VelocityProfile,
)
from study_app.protocol.load import load_scene
from study_app.protocol.source.files import shipped_file

PROTOCOL: Final = "physical_liquids"
LIQUIDS: Final = ("honey", "glycerin")
HIGHEST_REYNOLDS: Final = 200.0
"""Up to about 210 the flow behind a sphere is axisymmetric (Johnson & Patel 1999, J. Fluid Mech. 378:19)."""

TRAINING: Final = (
    (MULTI_SINE, "honey", 0.3),
    (MULTI_SINE, "glycerin", 10.0),
    (MULTI_SINE, "gear_oil", 60.0),
    (OSCILLATION_KC5, "glycerin", 20.0),
    (OSCILLATION_KC4, "gear_oil", 100.0),
    (REVERSAL, "glycerin", 10.0),
    (STOPPING, "honey", 1.0),
    (STOPPING, "gear_oil", 100.0),
)
"""Motions by profile, liquid and Reynolds number, that the constants of unsteady drag are fitted to.

They are added to those of `cases`, which alone do not determine the constants: none of them goes back through its own
wake.
"""
HELD_OUT: Final = (
    (MULTI_SINE, "tar", 0.16),
    (OSCILLATION_KC4, "honey", 3.0),
    (OSCILLATION_KC5, "gear_oil", 60.0),
    (REVERSAL, "honey", 2.0),
    (REVERSAL, "glycerin", 30.0),
    (REVERSAL, "gear_oil", 60.0),
    (REVERSAL, "gear_oil", 100.0),
    (RETURN, "glycerin", 30.0),
    (STOPPING, "gear_oil", 60.0),
)
"""Motions as those of `TRAINING`, and a return after a pause, that no fit uses: the constants are tested by them.

The reversal at Re 60 and the return also served to choose the form of the law.
"""


@dataclass(frozen=True, slots=True)
class Case:
    """A ball in one liquid that moves along a profile with the speed ``speed_mps`` as U."""

    liquid_id: str
    density_kg_m3: float
    viscosity_pa_s: float
    diameter_m: float
    speed_mps: float
    profile: VelocityProfile = STOPPING

    def __post_init__(self) -> None:
        if self.reynolds > HIGHEST_REYNOLDS:
            raise StudyError(
                f"{self.liquid_id} at {self.speed_mps:g} m/s has a Reynolds number of {self.reynolds:.0f}: the flow is "
                f"axisymmetric, as the solver takes it to be, up to {HIGHEST_REYNOLDS:g}"
            )

    @property
    def name(self) -> str:
        """Name of the file without its ending."""
        motion = "" if self.profile is STOPPING else f"{self.profile.name}-"
        return f"{motion}{self.liquid_id}-{round(self.speed_mps * 1000)}mmps"

    @property
    def title(self) -> str:
        """Motion and speed in words."""
        return f"{self.profile.words} at {self.speed_mps:.3g} m/s"

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
    """Return each liquid at the greatest speed of its protocol, in the scene and, as at scale 1, of the hand."""
    found = []
    for liquid_id in LIQUIDS:
        scene = load_scene(shipped_file(PROTOCOL), liquid_id)
        fastest_mps = scene.motion_in(scene.liquids[0]).speed_mps or math.nan
        found += [_case(liquid_id, speed_mps) for speed_mps in (fastest_mps / scene.scale, fastest_mps)]
    return tuple(found)


def training_cases() -> tuple[Case, ...]:
    """Return the motions of `TRAINING`."""
    return _by_reynolds(TRAINING)


def held_out_cases() -> tuple[Case, ...]:
    """Return the motions of `HELD_OUT`."""
    return _by_reynolds(HELD_OUT)


def _by_reynolds(motions: Sequence[tuple[VelocityProfile, str, float]]) -> tuple[Case, ...]:
    found = []
    for profile, liquid_id, reynolds in motions:
        one = _case(liquid_id, 1e-3)
        found.append(_case(liquid_id, 1e-3 * reynolds / one.reynolds, profile))
    return tuple(found)


def _case(liquid_id: str, speed_mps: float, profile: VelocityProfile = STOPPING) -> Case:
    scene = load_scene(shipped_file(PROTOCOL), liquid_id)
    (liquid,) = scene.liquids
    return Case(
        liquid_id, liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan, scene.body.diameter_m, speed_mps, profile
    )
