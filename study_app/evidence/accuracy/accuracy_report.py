"""The results of ``accuracy`` as files: CSV, Markdown and a figure."""

import math
from collections.abc import Sequence
from typing import Final

from study_app.evidence.accuracy.accuracy_figure import draw
from study_app.evidence.accuracy.comparison import Accuracy, Row
from study_app.evidence.table import Evidence, Table, plot_files

COLUMNS: Final = (
    "kind", "liquid", "truth", "model", "median_ns", "p99_ns", "ns_per_ms", "rms_error_n", "max_error_n",
    "rms_error_percent", "max_error_percent", "direction_error_deg", "target_percent", "memory_bytes",
    "rate_hz", "ticks_per_s", "times_real_time", "batches", "pareto_front", "gate_choice",
)  # fmt: skip


def _values(row: Row) -> tuple[str | float, ...]:
    ticks_per_s = 1e9 / row.time.median_ns
    error = row.error
    return (
        *(row.kind, row.liquid, row.truth, row.candidate.name),
        *(row.time.median_ns, row.time.p99_ns, row.ns_per_ms),
        *(error.rms_n, error.most_n, 100 * error.rms, 100 * error.most, error.direction_deg, 100 * error.target),
        *(row.memory_bytes, row.candidate.rate_hz, ticks_per_s, ticks_per_s / row.candidate.rate_hz, row.time.batches),
        *(int(row.on_front), int(row.chosen)),
    )


def evidence(found: Accuracy) -> Evidence:
    """Return the tables, as Markdown with the source of each reference and as CSV, and the figure."""
    parts = [f"Machine: {found.machine}.", f"Motion: {found.motion}.", _WHAT]
    parts += [f"**{truth.name}**: {truth.source}." for truth in found.truths]
    parts += [f"Note: {note}." for note in found.notes]
    for truth in found.truths:
        rows = [row for row in found.rows if row.truth == truth.name]
        parts.append(f"## Against the {truth.name} ({rows[0].kind}), {rows[0].liquid}\n\n" + _markdown_table(rows))
    text = "\n\n".join(parts) + "\n"
    cells = [[f"{it:.6g}" if isinstance(it, float) else it for it in _values(row)] for row in found.rows]
    files = {"accuracy.csv": Table(COLUMNS, cells).csv(), "accuracy.md": text}
    return Evidence(text, files, plot_files("accuracy", "What accuracy costs in time", draw, found))


_WHAT: Final = (
    "Times are computation times of one thread, without that of other programs: medians over repeats, in one "
    "interleaved run, of the median and the 99th percentile of batches of 1,000 ticks. Errors: RMS in % of the RMS of "
    "the reference's force, greatest in % of its greatest. Direction: RMS angle where the reference's force is "
    "perceptible. Fewer ticks per second: the error of the force alone, without its effect on stability. Unsteady drag "
    "is compared with each motion of the fluid solver with constants fitted to the other motions. ● no other model is "
    "both faster, in real time, and more accurate, each by its greatest error; ◎ the model that the program runs."
)
_HEADINGS: Final = (
    "", "model", "ns per tick", "p99", "RMS error [N]", "max [N]", "RMS [%]", "max [%]", "direction [°]",
    "memory [kB]", "ticks per second", "times real time",
)  # fmt: skip


def _markdown_table(rows: Sequence[Row]) -> str:
    table = [_HEADINGS, (":-:", ":--", *["--:"] * (len(_HEADINGS) - 2))]
    for row in rows:
        ticks_per_s = 1e9 / row.time.median_ns
        error = row.error
        mark = "◎" if row.chosen else ("●" if row.on_front else "")
        table.append(
            (
                mark,
                row.candidate.name.replace("C_d", "C<sub>d</sub>"),
                _count(row.time.median_ns),
                _count(row.time.p99_ns),
                *(_digits(it) for it in (error.rms_n, error.most_n, 100 * error.rms, 100 * error.most)),
                _digits(error.direction_deg),
                _digits(row.memory_bytes / 1e3),
                _count(ticks_per_s),
                _count(ticks_per_s / row.candidate.rate_hz),
            )
        )
    return "\n".join(f"| {' | '.join(cells)} |" for cells in table)


def _count(value: float) -> str:
    """Return a number to three digits, with separated thousands."""
    if not math.isfinite(value):
        return "–"
    digits = 0 if value == 0 else 2 - math.floor(math.log10(abs(value)))
    return f"{round(value, digits):,.{max(digits, 0)}f}" if value < 100 else f"{round(value, digits):,.0f}"


def _digits(value: float) -> str:
    """Return a number to two digits, small ones as powers of ten."""
    if not math.isfinite(value):
        return "–"
    if value != 0 and abs(value) < 1e-4:
        return f"{value:.0e}"
    return f"{float(f'{value:.2g}'):,g}"
