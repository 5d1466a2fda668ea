"""Writes the files of a fit: a report, a preset for other commands, a table of residuals, and a figure."""

import hashlib
from pathlib import Path
from typing import Final

from study_app import figure_style as style
from study_app.lab.identify import figures
from study_app.lab.identify.estimates import CONFIDENCE, Estimates
from study_app.lab.identify.fit import CurveFit, Fit
from study_app.lab.identify.measured_force import FLOW_CURVE
from study_app.lab.identify.parameters import Parameter
from study_app.protocol.file_format import scene_text, with_default_estimator
from study_app.store.files import csv_text_of, make_folder, write_files

COLUMNS: Final = ("t_s", *(f"{kind}_{axis}_n" for kind in ("measured", "fitted", "residual") for axis in "xyz"))
_CURVE_COLUMNS: Final[tuple[str, ...]] = (*FLOW_CURVE, "fitted_pa", "residual_pa")


def report_text(estimates: Estimates) -> str:
    """Return the report: initial and fitted parameters, their intervals, the residual, and the warnings."""
    rows = [
        ["parameter", "from", "fitted", f"{100 * CONFIDENCE:g} % interval"],
        *([parameter.name, f"{parameter.value:.5g}", *estimates.row(parameter)] for parameter in estimates.parameters),
    ]
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    table = [
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]
    return "\n".join(
        (
            f"{estimates.liquid_id}: {estimates.summary()}",
            *table,
            *(f"warning: {warning}" for warning in estimates.warnings),
        )
    )


def write_fit(fit: Fit | CurveFit, to: Path, source: Path) -> tuple[Path, ...]:
    """Write preset (TOML), report (text), residuals (CSV) and figure into the folder ``to``; return the files.

    ``source`` is the measured file; the preset contains its name and hash.

    Raises
    ------
    StoreError, AnalysisError
        The folder cannot be created or written.
    """
    make_folder(to, waits=False)
    name = f"{fit.liquid_id}-fit"
    if isinstance(fit, CurveFit):
        residual_pa = fit.curve.stress_pa - fit.fitted_pa
        values = [fit.curve.rate_per_s, fit.curve.stress_pa, fit.fitted_pa, residual_pa]
        columns, figure, what = _CURVE_COLUMNS, figures.draw_curve(fit), "flow curve"
    else:
        values = [fit.motion.t_s, *fit.measured_n.T, *fit.fitted_n.T, *fit.residual_n.T]
        columns, figure, what = COLUMNS, figures.draw_force(fit), "force"
    table = csv_text_of([columns, *zip(*(column.tolist() for column in values), strict=True)])
    title = f"{fit.liquid_id}: measured and fitted {what}"
    figures_by_file = {
        f"{name}.{kind}": style.file_bytes(figure, kind, title, style.PLOT_SETTINGS) for kind in style.FORMATS
    }
    texts = {f"{fit.liquid_id}.toml": preset_file_text(fit, source), f"{name}.txt": f"{report_text(fit)}\n"}
    contents = {file: text.encode() for file, text in texts.items()}
    return write_files(to, {**contents, f"{name}.csv": table.encode(), **figures_by_file})


def preset_file_text(estimates: Estimates, source: Path) -> str:
    """Return the fitted scene as the text of a scene file, with the intervals in comments.

    The fit uses velocities of the measured motion, not those of an estimator; the file has the default estimator.
    """
    digest = hashlib.sha256(source.read_bytes()).hexdigest()
    comment = (
        f"Fitted to {source.name} (SHA-256 {digest[:16]}…), {estimates.summary()}.",
        *(f"Warning: {warning}." for warning in estimates.warnings),
    )
    notes = {
        _path_in_file(parameter, estimates): f"{100 * CONFIDENCE:g} %: {estimates.row(parameter)[1]}"
        for parameter in estimates.parameters
    }
    return scene_text(with_default_estimator(estimates.scene), said=comment, notes=notes)


def _path_in_file(parameter: Parameter, estimates: Estimates) -> tuple[str, ...]:
    """Return the keys that lead to a parameter in a scene file."""
    if parameter.table == "body":
        return "scene", "body", parameter.field
    return "liquids", estimates.liquid_id, *(() if parameter.table == "liquid" else (parameter.table,)), parameter.field
