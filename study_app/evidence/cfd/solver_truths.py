"""The solved flows as references for models of a liquid."""

import math
from importlib.resources.abc import Traversable

import numpy as np

from study_app.evidence.cfd import stored_flows
from study_app.evidence.hand_motions import along_x
from study_app.evidence.reference_solutions import Case, Truth
from study_app.haptics.model.scene import Scene
from study_app.lab.identify.measured_force import vectors_x


def solver_truths(scene: Scene, folder: Traversable | None = None) -> tuple[Truth, ...]:
    """Return the fluid solver's results for the scene's liquid and body, at the scene's rate; often none.

    Raises
    ------
    StudyError
        There are no tables, or one cannot be understood.
    """
    liquid = scene.liquids[0]
    ours = (liquid.density_kg_m3, liquid.viscosity_pa_s or math.nan, scene.body.diameter_m)
    more = (*stored_flows.training(), *stored_flows.held_out()) if folder is None else ()
    tables = (*stored_flows.stored(folder), *more)
    without = stored_flows.left_out() if folder is None else {}
    found = []
    for table in tables:
        notes = table.notes
        *of, computing_s = (float(notes[name]) for name in stored_flows.OF_THE_MODEL)
        if not np.allclose(of, ours, rtol=0.01, atol=0):
            continue
        t_s, velocity_mps, force_n = table.columns.values()
        even_s = np.arange(t_s[0], t_s[-1], 1 / scene.rate_hz)
        even_mps = np.interp(even_s, t_s, velocity_mps)
        way_m = np.concatenate([[0.0], np.cumsum((even_mps[1:] + even_mps[:-1]) / 2 * np.diff(even_s))])
        case = Case(
            along_x(even_s - even_s[0], way_m, even_mps),
            vectors_x(np.interp(even_s, t_s, force_n)),
            np.ones(len(even_s), bool),
        )
        source = f"fluid solver: {notes.get('command', 'unknown command')}"
        title = notes.get("title", "a solved flow")
        left_out = without.get(table.case.name) if folder is None else None
        found.append(Truth(title, source, (case,), computing_s, notes.get("machine", ""), left_out))
    return tuple(found)
