"""The files of a fit: a report, a preset for other commands, the residuals as a table, and a figure."""

import hashlib
from pathlib import Path
from typing import Final

import numpy as np

from study_app import figure_style as style
from study_app.haptics.runtime.offline import Table
from study_app.lab.identify import fit_figure, flow_curve_figure
from study_app.lab.identify.estimates import CONFIDENCE, Estimates
from study_app.lab.identify.fit import Fit
from study_app.lab.identify.flow_curve import CurveFit
from study_app.lab.identify.measured_force import FLOW_CURVE
from study_app.lab.identify.parameters import Parameter
from study_app.protocol.scene_file import for_new_file, scene_text
from study_app.store.atomic import write_file
from study_app.store.output_files import make_folder
from study_app.store.tables import csv_files

COLUMNS: Final = tuple(f"{kind}_{axis}_n" for kind in ("measured", "fitted", "residual") for axis in "xyz")


def text(found: Estimates) -> str:
    """Return the report: the parameters before and after with their intervals, the residual, and warnings."""
    rows = [
        ["parameter", "from", "fitted", f"{100 * CONFIDENCE:g} % interval"],
        *([it.name, f"{it.value:.5g}", *found.row(it)] for it in found.parameters),
    ]
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    table = [
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    return "\n".join((f"{found.liquid_id}: {found.summary()}", *table, *(f"warning: {it}" for it in found.warnings)))


def write(found: Fit | CurveFit, to: Path, source: Path) -> tuple[Path, ...]:
    """Write preset (TOML), report (text), residuals (CSV) and figure into the folder ``to``; return the files.

    ``source`` is the file that was measured: the preset names it with its hash.

    Raises
    ------
    StudyError
        A file cannot be written.
    """
    make_folder(to)
    name = f"{found.liquid_id}-fit"
    written = [to / f"{found.liquid_id}.toml", to / f"{name}.txt", to / f"{name}.csv"]
    write_file(written[0], preset(found, source).encode())
    write_file(written[1], f"{text(found)}\n".encode())
    if isinstance(found, CurveFit):
        table, drawn, what = curve_residuals(found), flow_curve_figure.draw(found), "flow curve"
    else:
        table, drawn, what = residuals(found), fit_figure.draw(found), "force"
    csv_files.write_columns(written[2], table)
    for kind in style.FORMATS:
        written.append(to / f"{name}.{kind}")
        write_file(
            written[-1],
            style.file_bytes(drawn, kind, f"{found.liquid_id}: measured and fitted {what}", style.PLOT_SETTINGS),
        )
    return tuple(written)


def residuals(found: Fit) -> Table:
    """Return times, measured and fitted forces and residuals, one row per measurement."""
    table = np.recarray(len(found.motion.t_s), [(name, np.float64) for name in ("t_s", *COLUMNS)])
    table["t_s"] = found.motion.t_s
    values = np.column_stack([found.measured_n, found.fitted_n, found.residual_n])
    for name, column in zip(COLUMNS, values.T, strict=True):
        table[name] = column
    return table


def curve_residuals(found: CurveFit) -> Table:
    """Return shear rates, measured and fitted stresses and residuals, one row per shear rate."""
    columns = (found.curve.rate_per_s, found.curve.stress_pa, found.fitted_pa, found.curve.stress_pa - found.fitted_pa)
    names = (*FLOW_CURVE, "fitted_pa", "residual_pa")
    table = np.recarray(len(found.fitted_pa), [(name, np.float64) for name in names])
    for name, column in zip(names, columns, strict=True):
        table[name] = column
    return table


def preset(found: Estimates, source: Path) -> str:
    """Return the fitted scene as a scene file, each fitted number with its interval in a comment.

    The fit takes velocities from the measured motion, never from an estimator; the file names that of new files.
    """
    digest = hashlib.sha256(source.read_bytes()).hexdigest()
    said = (
        f"Fitted to {source.name} (SHA-256 {digest[:16]}…), {found.summary()}.",
        *(f"Warning: {warning}." for warning in found.warnings),
    )
    notes = {_place(it, found): f"{100 * CONFIDENCE:g} %: {found.row(it)[1]}" for it in found.parameters}
    return scene_text(for_new_file(found.scene), said=said, notes=notes)


def _place(it: Parameter, found: Estimates) -> tuple[str, ...]:
    """Return the place of a parameter in a scene file."""
    if it.table == "body":
        return "scene", "body", it.field
    return "liquids", found.liquid_id, *(() if it.table == "liquid" else (it.table,)), it.field
