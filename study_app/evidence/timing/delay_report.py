"""How well delays were kept, as text, Markdown, CSV and a figure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from study_app.evidence.timing.delay_figure import draw
from study_app.evidence.timing.delay_results import BESIDE, Delayed, Shown
from study_app.evidence.timing.output_files import write_report
from study_app.store.tables.csv_files import csv_text_of

BEGIN: Final = "<!-- delays: printed by liquid-study timing --delays --to DIR -->"
END: Final = "<!-- end of delays -->"

COLUMNS: Final = (
    "screen", "frames_follow", "load", "requested_ms", "achieved_ms", "frames", "error_mean_ms", "error_p50_ms",
    "error_p95_ms", "error_p99_ms", "error_max_ms", "error_mean_frames", "error_p50_frames", "error_p95_frames",
    "error_p99_frames", "error_max_frames", "late", "refreshes_missed",
)  # fmt: skip
PERCENTILES: Final = (50.0, 95.0, 99.0)
_HEADINGS: Final = (
    "requested",
    "achieved",
    "mean",
    "p95",
    "p99",
    "worst",
    "mean",
    "p95",
    "p99",
    "worst",
    "late",
    "missed",
)


def write(found: Delayed, to: Path) -> tuple[Path, ...]:
    """Write text, tables (Markdown, CSV) and figure (PNG, SVG) into the folder ``to``; return the files.

    Raises
    ------
    StoreError
        A file cannot be written.
    """
    texts = {"txt": text(found), "md": markdown(found), "csv": csv_text(found)}
    return write_report(to, "delays", texts, draw(found), "Accuracy of visual delays")


def text(found: Delayed) -> str:
    """Return the report for a terminal."""
    lines = [_head(found)]
    for screen in found.screens:
        for load in found.loads:
            trials = found.on(screen, load)
            lines += ["", f"{screen} ({trials[0].paced}), {BESIDE[load]}: errors in ms, then in frames", ""]
            rows = [_HEADINGS, *map(_row, trials)]
            widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
            lines += ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    return "\n".join((*lines, "", *found.limits())) + "\n"


def markdown(found: Delayed) -> str:
    """Return the report as Markdown, between comments, ready for docs/timing.md: a row per screen and delay."""
    one = ("mean", "p95", "p99", "worst", "late")
    heads = [f"{BESIDE[load]}: mean" if name == "mean" else name for load in found.loads for name in one]
    rows = [["screen", "requested", *heads], ["---", *["--:"] * (1 + len(heads))]]
    for screen in found.screens:
        for abreast in zip(*(found.on(screen, load) for load in found.loads), strict=True):
            cells = [cell for trial in abreast for cell in (*_errors(trial), f"{trial.late} of {trial.frames}")]
            rows.append([screen, f"{1e3 * abreast[0].delay_s:g}", *cells])
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    limits = "\n".join(f"- {limit}" for limit in found.limits())
    return f"{BEGIN}\n\n{_head(found)} Errors in ms.\n\n{table}\n\n{limits}\n\n{END}\n"


def csv_text(found: Delayed) -> str:
    """Return the table for machines: CSV, named `COLUMNS`."""
    rows: list[Sequence[object]] = [COLUMNS]
    for trial in found.shown:
        errors_ms = (trial.mean_ms, *map(trial.percentile_ms, PERCENTILES), trial.worst_ms)
        rows.append(
            (
                trial.screen,
                trial.paced,
                trial.load,
                f"{1e3 * trial.delay_s:g}",
                f"{trial.achieved_ms:.3f}",
                trial.frames,
                *(f"{error_ms:.3f}" for error_ms in errors_ms),
                *(f"{error_ms / trial.frame_ms:.4f}" for error_ms in errors_ms),
                trial.late,
                trial.missed,
            )
        )
    return csv_text_of(rows)


def _head(found: Delayed) -> str:
    width, height = found.size_px
    return (
        f"{found.seconds:g} s of reaching at each delay, the tank at {width} × {height}; error: achieved minus "
        "requested delay, from the sample drawn to the end of its painting; late: by more than a frame. "
        f"{found.machine}."
    )


def _row(trial: Shown) -> tuple[str, ...]:
    return (
        f"{1e3 * trial.delay_s:g}",
        f"{trial.achieved_ms:.1f}",
        *_errors(trial),
        *(f"{error_ms / trial.frame_ms:.2f}" for error_ms in _measures_ms(trial)),
        f"{trial.late} of {trial.frames}",
        f"{trial.missed}",
    )


def _errors(trial: Shown) -> tuple[str, ...]:
    return tuple(f"{error_ms:.1f}" for error_ms in _measures_ms(trial))


def _measures_ms(trial: Shown) -> tuple[float, ...]:
    """Return mean, 95th and 99th percentile and the worst [ms]."""
    return trial.mean_ms, trial.percentile_ms(95), trial.percentile_ms(99), trial.worst_ms
