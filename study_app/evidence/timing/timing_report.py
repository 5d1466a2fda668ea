"""The findings of ``timing`` as text, Markdown, CSV and a figure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from study_app.evidence.timing.lateness import PERCENTILES, Lane, Timed
from study_app.evidence.timing.lateness_figure import LOADS, draw
from study_app.evidence.timing.output_files import write_report
from study_app.store.tables.csv_files import csv_text_of

BEGIN: Final = "<!-- timing: printed by liquid-study timing --to DIR -->"
END: Final = "<!-- end of timing -->"

COLUMNS: Final = (
    "priority", "granted", "loop", "ticks", "overruns", "over_1_ms", "p50_us", "p90_us", "p99_us", "p99_9_us",
    "max_us", "p50_against_bare", "p99_against_bare", "tick_p50_us", "tick_p99_us",
)  # fmt: skip
_HEADINGS: Final = (
    "priority", "loop", "p50", "p90", "p99", "p99.9", "worst", "over 1 ms", "skipped", "p50 : bare",
    "p99 : bare", "tick p99",
)  # fmt: skip


def write(found: Timed, to: Path) -> tuple[Path, ...]:
    """Write text, tables (Markdown, CSV) and figure (PNG, SVG) into the folder ``to``; return the files.

    Raises
    ------
    StoreError
        A file cannot be written.
    """
    texts = {"txt": text(found), "md": markdown(found), "csv": csv_text(found)}
    return write_report(to, "timing", texts, draw(found), "Lateness of ticks")


def text(found: Timed) -> str:
    """Return the report for a terminal."""
    rows = [_HEADINGS, *(_row(found, lane) for lane in found.lanes)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEADINGS))]
    lines = [_head(found), "lateness in µs; skipped: deadlines that passed during a longer tick", ""]
    for row in rows:
        cells = (f"{cell:{'<' if column < 2 else '>'}{widths[column]}}" for column, cell in enumerate(row))
        lines.append("  ".join(cells).rstrip())
    return "\n".join((*lines, "", *map(str, found.limits()), "", *_notes(found))) + "\n"


def markdown(found: Timed) -> str:
    """Return the report as Markdown, between comments, ready for docs/timing.md."""
    marks = ("---", "---", *["--:"] * (len(_HEADINGS) - 2))
    rows = [_HEADINGS, marks, *(_row(found, lane) for lane in found.lanes)]
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    limits = "\n".join(f"- {limit}" for limit in found.limits())
    notes = " ".join(f"{note[0].upper()}{note[1:]}." for note in _notes(found))
    return f"{BEGIN}\n\n{_head(found)} Lateness in µs.\n\n{table}\n\n{limits}\n\n{notes}\n\n{END}\n"


def csv_text(found: Timed) -> str:
    """Return the table for machines: CSV, named `COLUMNS`."""
    rows: list[Sequence[object]] = [COLUMNS]
    for lane in found.lanes:
        busy = (f"{lane.busy_us(50):.3f}", f"{lane.busy_us(99):.3f}") if len(lane.busy_ns) else ("n/a", "n/a")
        rows.append(
            (
                lane.grant.level,
                lane.grant.how,
                lane.name,
                lane.ticks,
                lane.overruns,
                lane.late,
                *(f"{lane.late_us(percent):.3f}" for percent in (*PERCENTILES, 100.0)),
                *(f"{found.ratio(lane, percent):.4g}" for percent in (50.0, 99.0)),
                *busy,
            )
        )
    return csv_text_of(rows)


def _head(found: Timed) -> str:
    painted = "" if found.frames_hz is None else f", {found.frames_hz:.0f} frames per second"
    return (
        f"{found.seconds:g} s of each loop at 1 kHz, alternating every quarter second; {LOADS[found.load]}"
        f"{painted}. {found.machine}."
    )


def _row(found: Timed, lane: Lane) -> tuple[str, ...]:
    ratios = (
        ("1", "1") if lane.kind == "bare" else tuple(_ratio(found.ratio(lane, percent)) for percent in (50.0, 99.0))
    )
    return (
        lane.grant.level,
        lane.name,
        *(_number(lane.late_us(percent)) for percent in (*PERCENTILES, 100.0)),
        f"{lane.late:,}",
        f"{lane.overruns:,}",
        *ratios,
        f"{lane.busy_us(99):.1f}" if len(lane.busy_ns) else "–",
    )


def _notes(found: Timed) -> tuple[str, ...]:
    spin: tuple[str, ...] = ()
    if found.spin_us > 0:
        spin = (f"a spin of {found.spin_us:g} µs before each deadline took {found.spun_share:.1%} of a core",)
    return (*found.notes, *spin)


def _number(us: float) -> str:
    return f"{us:,.0f}" if us >= 100 else f"{us:.1f}"


def _ratio(ratio: float) -> str:
    if ratio >= 1000:
        return "> 1,000"
    return f"{ratio:.2f}" if ratio < 10 else f"{ratio:.0f}"
