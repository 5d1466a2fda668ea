"""Drag: the liquid resists motion relative to it."""

from __future__ import annotations

from study_app.haptics.kernels.compiled import part
from study_app.haptics.kernels.vector import norm
from study_app.haptics.model import laws
from study_app.haptics.model.effects.drag import LAW_BROWN_LAWLER, LAW_CONSTANT, LAW_HAIDER_LEVENSPIEL, LAW_LINEAR
from study_app.haptics.model.layout import GROWS_AS_SPEED, Record

_schiller_naumann = part(laws.schiller_naumann)
_haider_levenspiel = part(laws.haider_levenspiel)
_brown_lawler = part(laws.brown_lawler)


@part
def drag_force(liquid: Record, local: Record, state: Record) -> None:
    """Add F = −½ ρ C_d A |w| w φ to the force, (3,) [N], with w = v − v_wake − v_current (Rek 2024, §4.1).

    A is the frontal area of the ball, φ the fraction of it in the liquid. C_d is that of the body, or that of a sphere
    at Re = ρ|w|D/µ (``laws``): computed as a multiple of Stokes' −3πµD w, which is finite at rest, unlike C_d. Only the
    constant law grows as the square of a speed. The linear law is a damper, F = −(b/s) w with the damping b at the hand
    and the scene's scale s: F = −b v at the hand.
    """
    w = local.relative_mps
    resistance_nspm = resistance(liquid.drag, norm(w))
    for axis in range(3):
        force_n = -resistance_nspm * w[axis] * local.frontal
        state.force_n[axis] += force_n
        local.damping_n[axis] += force_n
    if liquid.drag.law != LAW_CONSTANT:
        state.growth = max(state.growth, GROWS_AS_SPEED)


@part
def resistance(drag: Record, speed_mps: float) -> float:
    """Return |F|/|w| [N·s/m] of the whole ball at a relative speed."""
    if drag.law == LAW_CONSTANT:
        return float(drag.factor_kg_m * speed_mps)
    if drag.law == LAW_LINEAR:
        return float(drag.damping_nspm)
    return float(drag.stokes_nspm * _over_stokes(drag.law, drag.reynolds_spm * speed_mps))


@part
def _over_stokes(law: int, reynolds: float) -> float:
    """Return the drag as a multiple of Stokes'."""
    if law == LAW_BROWN_LAWLER:
        return _brown_lawler(reynolds)
    if law == LAW_HAIDER_LEVENSPIEL:
        return _haider_levenspiel(reynolds)
    return _schiller_naumann(reynolds)
