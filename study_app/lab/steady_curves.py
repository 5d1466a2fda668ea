"""The steady flow of a setting: its flow curve, and the force over the speed of the hand."""

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.haptics.model.gate import resolve
from study_app.haptics.model.laws.rheology import stress_pa
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import steady

Floats: TypeAlias = NDArray[np.float64]

RATES_PER_S: Final[Floats] = np.geomspace(0.1, 1000.0, 41)
SPEEDS_MPS: Final[Floats] = np.linspace(0.0, 0.3, 31)


@dataclass(frozen=True, slots=True, eq=False)
class SteadyCurves:
    """Steady flow of a setting.

    ``stress_pa`` (n,) is the shear stress [Pa] at `RATES_PER_S`, None for a liquid without viscosity; ``force_n`` (m,)
    the force sent [N] at the speeds `SPEEDS_MPS` of the hand.
    """

    stress_pa: Floats | None
    force_n: Floats


def has_flow_curve(scene: Scene) -> bool:
    """Return whether the liquid of a scene with one liquid is non-Newtonian."""
    return "non_newtonian" in resolve(scene).liquids[0].effects


def steady_curves(scene: Scene) -> SteadyCurves:
    """Return the curves of a scene with one liquid."""
    scene = resolve(scene)
    (liquid,) = scene.liquids
    force_n = np.array([steady(scene, speed).force_n for speed in SPEEDS_MPS.tolist()])
    if has_flow_curve(scene):
        return SteadyCurves(np.array([stress_pa(liquid.non_newtonian, it) for it in RATES_PER_S.tolist()]), force_n)
    return SteadyCurves(None if liquid.viscosity_pa_s is None else liquid.viscosity_pa_s * RATES_PER_S, force_n)
