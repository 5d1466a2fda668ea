"""What a setting's steady flow is like: its flow curve, and the force over the speed of the hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws.rheology import stress_pa
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.steady_state import steady

Floats: TypeAlias = NDArray[np.float64]

RATES_PER_S: Final[Floats] = np.geomspace(0.1, 1000.0, 41)
SPEEDS_MPS: Final[Floats] = np.linspace(0.0, 0.3, 31)


@dataclass(frozen=True, slots=True, eq=False)
class SteadyCurves:
    """Steady flow of a setting.

    ``stress_pa`` (n,) is the shear stress [Pa] at `RATES_PER_S`, None for a liquid without viscosity; ``force_n`` (m,)
    the force sent [N] at the speeds `SPEEDS_MPS` of the hand. ``is_newtonian`` is whether it has no flow curve.
    """

    stress_pa: Floats | None
    force_n: Floats
    is_newtonian: bool


def steady_curves(scene: Scene) -> SteadyCurves:
    """Return the curves of a scene with one liquid."""
    scene = resolve(scene)
    (liquid,) = scene.liquids
    force_n = np.array([steady(scene, speed).force_n for speed in SPEEDS_MPS.tolist()])
    if "non_newtonian" in liquid.effects:
        stresses_pa = np.array([stress_pa(liquid.non_newtonian, rate) for rate in RATES_PER_S.tolist()])
        return SteadyCurves(stresses_pa, force_n, is_newtonian=False)
    newtonian_pa = None if liquid.viscosity_pa_s is None else liquid.viscosity_pa_s * RATES_PER_S
    return SteadyCurves(newtonian_pa, force_n, is_newtonian=True)
