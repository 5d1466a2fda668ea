"""The latenesses of all loops as one figure: a panel for each priority class, shares of ticks over lateness.

Both axes are logarithmic, so that one tick in ten thousand is visible.
"""

import textwrap
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from study_app import figure_style as style
from study_app.evidence.timing.figure_key import figure_key
from study_app.evidence.timing.lateness import LATE_NS, Lane, Timed
from study_app.evidence.timing.loops import NAMES, Kind
from study_app.haptics.runtime.clocks.grants import Level

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
