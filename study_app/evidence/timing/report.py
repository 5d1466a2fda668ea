"""The key above the panels of a figure.

What a measurement of timing leaves in a folder: the same texts, tables and pictures, whichever it was.

The latenesses of all loops as one figure: a panel for each priority class, shares of ticks over lateness.

Both axes are logarithmic, so that one tick in ten thousand is visible.

The findings of ``timing`` as text, Markdown, CSV and a figure.
"""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from study_app import figure_style as style
from study_app.evidence.timing.measurement import LATE_NS, NAMES, PERCENTILES, Kind, Lane, Timed
from study_app.figure_style import PLOT_SETTINGS, file_bytes
from study_app.haptics.runtime.clocks.grants import Level
from study_app.store.atomic import write_file
from study_app.store.tables.csv_files import csv_text_of


def figure_key(figure: Figure, handles: Sequence[Line2D], left_pt: float, *, handlelength: float) -> None:
    """Name the lines above the panels, in one row from ``left_pt`` on."""
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(left_pt / style.PAGE_WIDTH_PT, 1.0),
        ncols=len(handles),
        frameon=False,
        fontsize=7.2,
        handlelength=handlelength,
        columnspacing=2.2,
    )


def write_report(to: Path, name: str, texts: dict[str, str], figure: Figure, title: str) -> tuple[Path, ...]:
    """Write texts by their endings, and a figure as PNG and SVG, into the folder ``to``; return the files.

    Raises
    ------
    StoreError
        A file cannot be written.
    """
    contents = {ending: text.encode() for ending, text in texts.items()}
    contents |= {ending: file_bytes(figure, ending, title, PLOT_SETTINGS) for ending in ("png", "svg")}
    for ending, content in contents.items():
        write_file(to / f"{name}.{ending}", content)
    return tuple(to / f"{name}.{ending}" for ending in contents)


HEIGHT_PT: Final = 224.0
TOP_PT: Final = 36.0
FOOT_PT: Final = 62.0
LEFT_PT: Final = 36.0
GAP_PT: Final = 30.0
RIGHT_PT: Final = 16.0
LETTERS: Final = 132
LOWEST_US: Final = 1.0
BINS_A_DECADE: Final = 10

LOOKS: Final[dict[Kind, dict[str, Any]]] = {
    "servo": {"color": "#0b65a3", "linestyle": "-", "linewidth": 1.7, "zorder": 5},
    "bare": {"color": "#13202c", "linestyle": (0, (1, 1.2)), "linewidth": 1.3, "zorder": 6},
    "thread": {"color": "#b35600", "linestyle": (0, (5, 2)), "linewidth": 1.3, "zorder": 4},
    "qt": {"color": "#7a3e8f", "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.2, "zorder": 3},
}
MARKS: Final[dict[Kind, str]] = {"servo": "o", "bare": "s", "thread": "^", "qt": "D"}

LOADS: Final = {
    "none": "no other load in the program",
    "gui": "the participant's and the operator's windows painting",
    "gui+cpu": "both windows painting, and a busy Python process on every core",
}


@style.own_settings(style.PLOT_SETTINGS)
def draw(found: Timed) -> Figure:
    """Draw what was found."""
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, HEIGHT_PT / 72), facecolor="white")
    levels = found.levels
    width_pt = (style.PAGE_WIDTH_PT - LEFT_PT - RIGHT_PT - GAP_PT * (len(levels) - 1)) / len(levels)
    highest_us = _highest_us(found)
    for number, level in enumerate(levels):
        left = (LEFT_PT + number * (width_pt + GAP_PT)) / style.PAGE_WIDTH_PT
        tall = (HEIGHT_PT - TOP_PT - FOOT_PT) / HEIGHT_PT
        axes = figure.add_axes((left, FOOT_PT / HEIGHT_PT, width_pt / style.PAGE_WIDTH_PT, tall))
        _panel(axes, found, level, highest_us, first=number == 0)
    _key(figure, found)
    text = "\n".join(textwrap.wrap(_caption(found), LETTERS))
    figure.text(4 / style.PAGE_WIDTH_PT, 29 / HEIGHT_PT, text, va="top", fontsize=6.6, color=style.TEXT_SOFT)
    return figure


def _highest_us(found: Timed) -> float:
    most = max(lane.late_us(100) for lane in found.lanes)
    return float(10 ** np.ceil(np.log10(max(most, 2e3))))


def _panel(axes: Axes, found: Timed, level: Level, highest_us: float, *, first: bool) -> None:
    """Draw the lanes of a class as steps, each with a mark at its 99th percentile."""
    decades = np.log10(highest_us / LOWEST_US)
    edges = np.logspace(np.log10(LOWEST_US), np.log10(highest_us), round(BINS_A_DECADE * decades) + 1)
    lanes = [lane for lane in found.lanes if lane.grant.level == level]
    least = 1 / max(lane.ticks for lane in found.lanes)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(LOWEST_US, highest_us)
    axes.set_ylim(0.6 * least, 1.4)
    for lane in lanes:
        shares = np.histogram(np.clip(lane.lateness_ns * 1e-3, LOWEST_US, None), edges)[0] / lane.ticks
        axes.stairs(np.where(shares > 0, shares, 0.1 * least), edges, baseline=None, **LOOKS[lane.kind])
    _tails(axes, lanes, least)
    axes.axvline(LATE_NS * 1e-3, color=style.ZERO, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=1)
    axes.annotate("1 ms", (LATE_NS * 1e-3, 1.3), (2, -1), textcoords="offset points", va="top", fontsize=6.6)
    axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(0, 8)]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda us, _: _duration(us)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:g} %"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.minorticks_off()
    axes.tick_params(labelsize=6.6, labelleft=first)
    axes.set_xlabel("lateness of a tick", fontsize=7, labelpad=2)
    how = lanes[0].grant.how if level != "normal" else ""
    axes.set_title(f"{level.capitalize()} priority{f' ({how})' if how else ''}", pad=5, color=style.TEXT)


def _tails(axes: Axes, lanes: list[Lane], least: float) -> None:
    """Mark the 99th percentiles along the foot of a panel."""
    for lane in lanes:
        look = LOOKS[lane.kind]
        face = look["color"] if lane.kind in {"servo", "thread"} else "white"
        axes.plot(
            [lane.late_us(99)],
            [0.6 * least],
            marker=MARKS[lane.kind],
            markersize=5,
            markerfacecolor=face,
            markeredgecolor=look["color"],
            clip_on=False,
            zorder=8 + look["zorder"],
        )


def _key(figure: Figure, found: Timed) -> None:
    """Name the loops above the panels."""
    kinds = [kind for kind in NAMES if any(lane.kind == kind for lane in found.lanes)]
    handles = []
    for kind in kinds:
        face = LOOKS[kind]["color"] if kind in {"servo", "thread"} else "white"
        look = {name: value for name, value in LOOKS[kind].items() if name != "zorder"}
        handles.append(
            Line2D([], [], marker=MARKS[kind], markersize=4, markerfacecolor=face, label=NAMES[kind], **look)
        )
    figure_key(figure, handles, LEFT_PT - 6, handlelength=3.4)


def _caption(found: Timed) -> str:
    return (
        f"Share of ticks in each of {BINS_A_DECADE} bins per decade; marks at the bottom: the 99th percentile of each. "
        f"{found.seconds:g} s of each loop at 1 kHz alternating every quarter second, {LOADS[found.load]}. "
        f"{found.machine}."
    )


def _duration(us: float) -> str:
    """Return a time on the axis: 10 µs, 1 ms, 1 s."""
    for unit, size in (("s", 1e6), ("ms", 1e3)):
        if us >= size:
            return f"{us / size:g} {unit}"
    return f"{us:g} µs"


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
