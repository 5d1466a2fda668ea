"""The fluid solver against published drag and our laws, and models against the solver, as text tables and as CSV."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from study_app.evidence.cfd.fits import Fitted, scene_of
from study_app.evidence.cfd.flow_figure import draw
from study_app.evidence.cfd.stored_flows import Table
from study_app.evidence.reference_solutions import measured_drag_n
from study_app.figure_style import PLOT_SETTINGS, file_bytes
from study_app.haptics.model.laws.drag_laws import LAWS
from study_app.haptics.model.scene import Liquid
from study_app.lab.identify.parameters import find
from study_app.store.atomic import write_file
from study_app.store.tables.csv_files import csv_text_of

FITS_FILE: Final = "fits.csv"
COLUMNS: Final = (
    "table", "model", "parameters", "rms_n", "worst_n", "share", "within", "push", "carried",
)  # fmt: skip
MITTAL: Final = {50.0: 1.57, 100.0: 1.09}
"""C_d of a sphere by a spectral method: Mittal 1999, Int. J. Numer. Meth. Fluids 30:921, as quoted in the validation of
Notus CFD, https://doc.notus-cfd.org ("steady flows past a sphere")."""
CONSTANT: Final = 0.47
EDGE: Final = 1e-6


def clift(reynolds: float) -> float:
    """Return C_d of a sphere by Clift, Grace & Weber 1978, Bubbles, Drops and Particles, table 5.12, Re 0.01 to 260."""
    if reynolds <= 20:
        return 24 / reynolds * (1 + 0.1315 * math.pow(reynolds, 0.82 - 0.05 * math.log10(reynolds)))
    return 24 / reynolds * (1 + 0.1935 * math.pow(reynolds, 0.6305))


def steady_markdown(table: Table) -> str:
    """Return steady drag as a Markdown table: the solver's C_d, and by how much others differ from it."""
    names = ["coarser grid", "half the box", "Clift et al. 1978", "Mittal 1999", "experiments", *LAWS, "C_d 0.47"]
    lines = [f"| Re | C_d, solver | {' | '.join(names)} |", "|---:" * (len(names) + 2) + "|"]
    for reynolds, solved, coarse, narrow in zip(*(it.tolist() for it in table.columns.values()), strict=True):
        others = [coarse, narrow, clift(reynolds), MITTAL.get(reynolds), _measured(reynolds)]
        others += [law(reynolds) * 24 / reynolds for law in LAWS.values()]
        shares = ["" if it is None else _signed(it / solved - 1) for it in (*others, CONSTANT)]
        lines.append(f"| {reynolds:g} | {solved:.4g} | {' | '.join(shares)} |")
    return "\n".join(lines)


def fits_markdown(fits: Sequence[Fitted]) -> str:
    """Return the fits as Markdown, a table for every motion."""
    parts = []
    for case in dict.fromkeys(it.case for it in fits):
        lines = [
            f"{case.liquid_id}, {case.speed_mps:g} m/s (Re {case.reynolds:.3g})",
            "",
            "| model | fitted | RMS error | greatest error | within target | push after the stop | other speed |",
            "|---|---|---:|---:|---:|---:|---:|",
        ]
        lines += [_row(it) for it in fits if it.case == case]
        parts.append("\n".join(lines))
    return "\n\n".join([*parts, "\\* at the edge of what a scene permits: the best value may lie beyond."])


def fits_csv(fits: Sequence[Fitted]) -> bytes:
    """Return the fits as CSV, named `COLUMNS`; parameters as ``name=value`` apart by blanks."""
    rows: list[Sequence[str]] = [COLUMNS]
    for it in fits:
        numbers = (it.rms_n, it.worst_n, it.share, it.within, it.push, it.carried)
        given = " ".join(f"{name}={value!r}" for name, value in it.values.items())
        rows.append([it.case.name, it.model.name, given, *(f"{number:.6g}" for number in numbers)])
    return csv_text_of(rows).encode()


def write(tables: Sequence[Table], drag: Table, fits: Sequence[Fitted], to: Path) -> tuple[Path, ...]:
    """Write the fits as CSV, both tables as Markdown and the figure as PNG and SVG into a folder; return the files.

    Raises
    ------
    StoreError
        A file cannot be written.
    """
    figure = draw(tables, fits)
    said = f"{steady_markdown(drag)}\n\n{fits_markdown(fits)}\n"
    files = {FITS_FILE: fits_csv(fits), "cfd.md": said.encode()}
    files |= {
        f"cfd.{kind}": file_bytes(figure, kind, "Models against a fluid solver", PLOT_SETTINGS)
        for kind in ("png", "svg")
    }
    for name, content in files.items():
        write_file(to / name, content)
    return tuple(to / name for name in files)


def _row(it: Fitted) -> str:
    edges = _at_the_edge(it)
    fitted = ", ".join(f"{name} {value:.3g}{'*' if name in edges else ''}" for name, value in it.values.items())
    fitted = fitted or "nothing"
    return (
        f"| {it.model.name} | {fitted} | {it.rms_n:.2g} N ({it.share:.1%}) | {it.worst_n:.2g} N | {it.within:.0%} | "
        f"{_signed(it.push, 0)} | {it.carried:.1%} |"
    )


def _at_the_edge(it: Fitted) -> set[str]:
    """Return which fitted parameters are the least or the greatest that a scene permits."""
    ranges = find(scene_of(it.model, it.case), it.case.liquid_id, it.model.free) if it.model.free else ()
    return {one.name for one in ranges if not one.least * (1 + EDGE) < it.values[one.name] < one.most * (1 - EDGE)}


def _measured(reynolds: float) -> float:
    """Return C_d by the experiments that `truths` interpolates, as of a sphere and liquid of size and density 1."""
    speed_mps = np.array([1.0])
    liquid = Liquid(id="any", density_kg_m3=1.0, viscosity_pa_s=1 / reynolds)
    return float(measured_drag_n(liquid, 1.0, speed_mps)[0]) / (math.pi / 8)


def _signed(share: float, digits: int = 1) -> str:
    return f"{share:+.{digits}%}".replace("-", "−")
