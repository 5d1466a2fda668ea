"""Fits of models to the fluid solver's force on the ball: the best parameters and the remaining errors.

Every model is fitted to every motion by ``identify.fit``; what it found is then tried on the same liquid at the other
speed, where nothing is fitted any more: a parameter of a liquid must not change with the hand.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.evidence.cfd.cases import Case
from study_app.evidence.cfd.profiles import RAMP, STOP
from study_app.evidence.cfd.stored_flows import Table
from study_app.haptics.model.effects.local_wake import LocalWake
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.overrides import override_all
from study_app.haptics.model.scene import Effect, Given, Liquid, Scene
from study_app.haptics.runtime.offline import simulate
from study_app.lab.identify.fit import fit
from study_app.lab.identify.measured_force import along_a_line

RATE_HZ: Final = 1000.0
LAW: Final = "brown-lawler"
RELATIVE: Final = 0.05
FELT_N: Final = 0.05
"""The accuracy target: 5 % of the force or 0.05 N, whichever is more."""


@dataclass(frozen=True, slots=True)
class Model:
    """Effects with a law of drag, and which of their parameters are fitted."""

    name: str
    effects: tuple[Effect, ...]
    law: str = LAW
    free: tuple[str, ...] = ()


MODELS: Final = (
    Model("drag, constant C_d", ("drag",), "constant", ("drag_coefficient",)),
    Model("constant C_d, wake", ("drag", "wake"), "constant", ("drag_coefficient", "length", "scaling", "exponent")),
    Model("drag of the Reynolds number", ("drag",)),
    Model("... and wake", ("drag", "wake"), free=("length", "scaling", "exponent")),
    Model("... and local wake", ("drag", "local_wake"), free=("length", "scaling", "exponent", "spreading_m2ps")),
    Model("... and added mass", ("drag", "added_mass")),
    Model("... added mass, wake", ("drag", "wake", "added_mass"), free=("length", "scaling", "exponent")),
    Model("... and history", ("drag", "history")),
    Model("... history, added mass", ("drag", "added_mass", "history")),
    Model("... history, added mass fitted", ("drag", "added_mass", "history"), free=("coefficient",)),
    Model("unsteady drag", ("unsteady_drag",)),
)
"""From the thesis' drag alone to all that creeping flow has, and the law whose constants are fitted to the solver;
"..." is the drag of the Reynolds number."""

_START: Final = {"length": 300, "scaling": 1000.0}


@dataclass(frozen=True, eq=False)
class Fitted:
    """One model on one motion, at the scene's rate: its parameters, and its error against the solver.

    ``force_n`` (n,) along the motion; ``rms_n`` and ``worst_n`` the error, ``share`` the first of the RMS force,
    ``within`` the share of time in which it meets the accuracy target. ``push`` is the momentum that the liquid gives
    the ball after the stop, as a share of the solver's: 0 for none, below 0 against the former motion. ``carried`` is
    ``share`` at the liquid's other speed with the same parameters. ``warnings`` are those of the fit.
    """

    model: Model
    case: Case
    values: dict[str, float]
    force_n: Floats
    rms_n: float
    worst_n: float
    share: float
    within: float
    push: float
    carried: float
    warnings: tuple[str, ...] = ()


def fit_all(tables: Sequence[Table], progress: Callable[[str], None] = lambda _: None) -> tuple[Fitted, ...]:
    """Return every model fitted to every table, each tried on the others of the same liquid."""
    found = []
    for table in tables:
        progress(f"fitting {len(MODELS)} models to {table.case.liquid_id}, {table.notes['title']} ...")
        others = [it for it in tables if it.case.liquid_id == table.case.liquid_id and it is not table]
        for model in MODELS:
            values, warnings = fit_one(model, table)
            found.append(judge(model, table, values, others, warnings))
    return tuple(found)


def fit_one(model: Model, table: Table) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the parameters of the best fit of the model to the table, and the warnings of the fit."""
    if not model.free:
        return {}, ()
    motion, force_n = even(table)
    found = fit(scene_of(model, table.case), table.case.liquid_id, model.free, motion, force_n)
    return {it.name: found.values[it.name] for it in found.parameters}, found.warnings


def judge(
    model: Model,
    table: Table,
    values: Mapping[str, float],
    others: Sequence[Table] = (),
    warnings: tuple[str, ...] = (),
) -> Fitted:
    """Return the errors of a model with these parameters against the table, and against others of the liquid."""
    motion, solved_n = even(table)
    force_n = force_along(model, table.case, values, motion)
    error_n = np.abs(force_n - solved_n)
    carried = [
        share_of(force_along(model, it.case, values, other) - truth, truth)
        for it in others
        for other, truth in (even(it),)
    ]
    after = motion.t_s > (STOP + RAMP) * table.case.unit_s
    return Fitted(
        model=model,
        case=table.case,
        values=dict(values),
        force_n=force_n,
        rms_n=_rms(error_n),
        worst_n=float(error_n.max()),
        share=share_of(error_n, solved_n),
        within=float(np.mean(error_n <= np.maximum(RELATIVE * np.abs(solved_n), FELT_N))),
        push=float(force_n[after].sum() / solved_n[after].sum()),
        carried=max(carried, default=math.nan),
        warnings=warnings,
    )


def scene_of(model: Model, case: Case, values: Mapping[str, float] | None = None) -> Scene:
    """Return a scene with the model's effects in the liquid of the case, at 1 kHz with given velocities."""
    tables: dict[str, Any] = {}
    if "wake" in model.effects:
        tables["wake"] = Wake(**_START)
    if "local_wake" in model.effects:
        tables["local_wake"] = LocalWake(reach_m=case.diameter_m, **_START)
    liquid = Liquid(
        id=case.liquid_id,
        density_kg_m3=case.density_kg_m3,
        viscosity_pa_s=case.viscosity_pa_s,
        effects=model.effects,
        drag={"law": model.law},
        **tables,
    )
    scene = Scene(scale=1.0, rate_hz=RATE_HZ, body={"diameter_m": case.diameter_m}, liquids=(liquid,), velocity=Given())
    return override_all(scene, dict(values or {}))


def force_along(model: Model, case: Case, values: Mapping[str, float], motion: Motion) -> Floats:
    """Return the model's force (n,) [N] along a motion along x."""
    force_n: Floats = np.array(simulate(scene_of(model, case, values), motion).fx_n)
    return force_n


def even(table: Table) -> tuple[Motion, Floats]:
    """Return a table's motion and force (n,) with a row for every tick, so that all times weigh alike."""
    t_s, velocity_mps, force_n = table.columns.values()
    even_s = np.arange(math.floor(t_s[-1] * RATE_HZ) + 1) / RATE_HZ
    even_n = np.interp(even_s, t_s, force_n)
    return along_a_line(even_s, np.interp(even_s, t_s, velocity_mps), even_n).motion, even_n


def share_of(error_n: Floats, force_n: Floats) -> float:
    """Return the RMS error as a share of the RMS force."""
    return _rms(error_n) / _rms(force_n)


def _rms(values: Floats) -> float:
    return math.sqrt(float(np.mean(values**2)))
