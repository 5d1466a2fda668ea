"""Lateness of ticks as text, Markdown, CSV and a figure; and the layout of figures with panels abreast.

The figure has a panel for each priority class, with shares of ticks over lateness. Both axes are logarithmic, so that
one tick in ten thousand is visible.
"""

import textwrap
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from study_app import figure_style as style
from study_app.evidence.table import Evidence, Table, duration, plot_files
from study_app.evidence.timing.measurement import LATE_NS, NAMES, PERCENTILES, Kind, LoopTiming, Timed
from study_app.haptics.runtime.grants import Level

_FOOT_PT: Final = 62.0
_CAPTION_LETTERS: Final = 132


class Layout(NamedTuple):
    """Sizes [pt] of a figure with side-by-side panels."""

    height_pt: float
    top_pt: float
    left_pt: float
    gap_pt: float
    right_pt: float


def panels_abreast(
    layout: Layout, count: int, handles: Sequence[Line2D], handlelength: float, caption: str
) -> tuple[Figure, list[Axes]]:
    """Return a page-wide figure with its panels, a common legend above them and a caption below."""
    width_pt, height_pt = style.PAGE_WIDTH_PT, layout.height_pt
    figure = Figure(figsize=(width_pt / 72, height_pt / 72), facecolor="white")
    panel_pt = (width_pt - layout.left_pt - layout.right_pt - layout.gap_pt * (count - 1)) / count
    panel_height = (height_pt - layout.top_pt - _FOOT_PT) / height_pt
    lefts = [(layout.left_pt + k * (panel_pt + layout.gap_pt)) / width_pt for k in range(count)]
    panels = [figure.add_axes((left, _FOOT_PT / height_pt, panel_pt / width_pt, panel_height)) for left in lefts]
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=((layout.left_pt - 6) / width_pt, 1.0),
        ncols=len(handles),
        frameon=False,
        fontsize=7.2,
        handlelength=handlelength,
        columnspacing=2.2,
    )
    text = "\n".join(textwrap.wrap(caption, _CAPTION_LETTERS))
    figure.text(4 / width_pt, 29 / height_pt, text, va="top", fontsize=6.6, color=style.TEXT_SOFT)
    return figure, panels


_LAYOUT: Final = Layout(height_pt=224, top_pt=36, left_pt=36, gap_pt=30, right_pt=16)
_LOWEST_US: Final = 1.0
_BINS_A_DECADE: Final = 10

_LOOKS: Final[dict[Kind, dict[str, Any]]] = {
    "servo": {"color": "#0b65a3", "linestyle": "-", "linewidth": 1.7, "zorder": 5},
    "bare": {"color": "#13202c", "linestyle": (0, (1, 1.2)), "linewidth": 1.3, "zorder": 6},
    "thread": {"color": "#b35600", "linestyle": (0, (5, 2)), "linewidth": 1.3, "zorder": 4},
    "qt": {"color": "#7a3e8f", "linestyle": (0, (6, 1.5, 1, 1.5)), "linewidth": 1.2, "zorder": 3},
}
_MARKS: Final[dict[Kind, str]] = {"servo": "o", "bare": "s", "thread": "^", "qt": "D"}

_LOADS: Final = {
    "none": "no other load in the program",
    "gui": "the participant's and the operator's windows painting",
    "gui+cpu": "both windows painting, and a busy Python process on every core",
}


@style.own_settings(style.PLOT_SETTINGS)
def draw(timing: Timed) -> Figure:
    """Draw the lateness of all loops."""
    caption = (
        f"Proportion of ticks in each of {_BINS_A_DECADE} bins per decade; marks at the bottom show the 99th "
        f"percentile of each loop. {timing.seconds:g} s of each loop at 1 kHz, alternating every quarter of a second, "
        f"{_LOADS[timing.load]}. {timing.machine}."
    )
    handles = []
    for kind in (kind for kind in NAMES if any(loop.kind == kind for loop in timing.loops)):
        face = _LOOKS[kind]["color"] if kind in {"servo", "thread"} else "white"
        look = {name: value for name, value in _LOOKS[kind].items() if name != "zorder"}
        handles.append(
            Line2D([], [], marker=_MARKS[kind], markersize=4, markerfacecolor=face, label=NAMES[kind], **look)
        )
    figure, panels = panels_abreast(_LAYOUT, len(timing.levels), handles, 3.4, caption)
    highest_us = float(10 ** np.ceil(np.log10(max(2e3, *(loop.late_us(100) for loop in timing.loops)))))
    for axes, level in zip(panels, timing.levels, strict=True):
        _draw_panel(axes, timing, level, highest_us, first=axes is panels[0])
    return figure


def _draw_panel(axes: Axes, timing: Timed, level: Level, highest_us: float, *, first: bool) -> None:
    """Draw the loops of a class as steps, each with a mark at its 99th percentile."""
    decades = np.log10(highest_us / _LOWEST_US)
    edges = np.logspace(np.log10(_LOWEST_US), np.log10(highest_us), round(_BINS_A_DECADE * decades) + 1)
    loops = [loop for loop in timing.loops if loop.grant.level == level]
    minimum = 1 / max(loop.ticks for loop in timing.loops)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(_LOWEST_US, highest_us)
    axes.set_ylim(0.6 * minimum, 1.4)
    for loop in loops:
        shares = np.histogram(np.clip(loop.lateness_ns * 1e-3, _LOWEST_US, None), edges)[0] / loop.ticks
        axes.stairs(np.where(shares > 0, shares, 0.1 * minimum), edges, baseline=None, **_LOOKS[loop.kind])
    _mark_tails(axes, loops, minimum)
    axes.axvline(LATE_NS * 1e-3, color=style.ZERO, linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=1)
    axes.annotate("1 ms", (LATE_NS * 1e-3, 1.3), (2, -1), textcoords="offset points", va="top", fontsize=6.6)
    axes.xaxis.set_major_locator(FixedLocator([10.0**power for power in range(0, 8)]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda us, _: duration(1e3 * us)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:g} %"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.minorticks_off()
    axes.tick_params(labelsize=6.6, labelleft=first)
    axes.set_xlabel("lateness of a tick", fontsize=7, labelpad=2)
    grant_text = loops[0].grant.how if level != "normal" else ""
    axes.set_title(f"{level.capitalize()} priority{f' ({grant_text})' if grant_text else ''}", pad=5, color=style.TEXT)


def _mark_tails(axes: Axes, loops: list[LoopTiming], least: float) -> None:
    """Mark the 99th percentiles along the bottom of a panel."""
    for loop in loops:
        look = _LOOKS[loop.kind]
        face = look["color"] if loop.kind in {"servo", "thread"} else "white"
        axes.plot(
            [loop.late_us(99)],
            [0.6 * least],
            marker=_MARKS[loop.kind],
            markersize=5,
            markerfacecolor=face,
            markeredgecolor=look["color"],
            clip_on=False,
            zorder=8 + look["zorder"],
        )


COLUMNS: Final = (
    "priority", "granted", "loop", "ticks", "overruns", "over_1_ms", "p50_us", "p90_us", "p99_us", "p99_9_us",
    "max_us", "p50_against_bare", "p99_against_bare", "tick_p50_us", "tick_p99_us",
)  # fmt: skip
_HEADINGS: Final = (
    "priority", "loop", "p50", "p90", "p99", "p99.9", "worst", "over 1 ms", "skipped", "p50 : bare",
    "p99 : bare", "tick p99",
)  # fmt: skip


def timing_evidence(timing: Timed) -> Evidence:
    """Return the report for a terminal, as Markdown between comments for docs/timing.md, as CSV, and the figure."""
    head = (
        f"{timing.seconds:g} s of each loop at 1 kHz, alternating every quarter of a second; "
        f"{_LOADS[timing.load]}{'' if timing.frames_hz is None else f', {timing.frames_hz:.0f} frames per second'}. "
        f"{timing.machine}."
    )
    notes = timing.notes
    if timing.spin_us > 0:
        notes += (f"spinning for {timing.spin_us:g} µs before each deadline used {timing.spun_share:.1%} of one core",)
    table = Table(_HEADINGS, [_table_row(timing, loop) for loop in timing.loops], left=2)
    explanation = "lateness in µs; skipped: deadlines that passed during a longer tick"
    text = "\n".join((head, explanation, "", table.text(), "", *map(str, timing.limits()), "", *notes)) + "\n"
    limits = "\n".join(f"- {limit}" for limit in timing.limits())
    notes_text = " ".join(f"{note[0].upper()}{note[1:]}." for note in notes)
    markdown = f"{head} Lateness in µs.\n\n{table.markdown()}\n\n{limits}\n\n{notes_text}\n"
    csv = Table(COLUMNS, [_csv_row(timing, loop) for loop in timing.loops]).csv()
    files = {"timing.txt": text, "timing.md": markdown, "timing.csv": csv}
    return Evidence(text, files, plot_files("timing", "Lateness of ticks", draw, timing))


def _csv_row(timing: Timed, loop: LoopTiming) -> tuple[object, ...]:
    return (
        *(loop.grant.level, loop.grant.how, loop.name, loop.ticks, loop.overruns, loop.late),
        *(f"{loop.late_us(percent):.3f}" for percent in (*PERCENTILES, 100.0)),
        *(f"{timing.ratio(loop, percent):.4g}" for percent in (50.0, 99.0)),
        *(f"{loop.busy_us(percent):.3f}" if len(loop.busy_ns) else "n/a" for percent in (50, 99)),
    )


def _table_row(timing: Timed, loop: LoopTiming) -> tuple[str, ...]:
    ratios = (
        ("1", "1")
        if loop.kind == "bare"
        else tuple(_format_ratio(timing.ratio(loop, percent)) for percent in (50.0, 99.0))
    )
    return (
        loop.grant.level,
        loop.name,
        *(_format_us(loop.late_us(percent)) for percent in (*PERCENTILES, 100.0)),
        f"{loop.late:,}",
        f"{loop.overruns:,}",
        *ratios,
        f"{loop.busy_us(99):.1f}" if len(loop.busy_ns) else "–",
    )


def _format_us(us: float) -> str:
    return f"{us:,.0f}" if us >= 100 else f"{us:.1f}"


def _format_ratio(ratio: float) -> str:
    if ratio >= 1000:
        return "> 1,000"
    return f"{ratio:.2f}" if ratio < 10 else f"{ratio:.0f}"
