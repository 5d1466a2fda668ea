"""The map of stability: the limit of a free handle, what its friction proves, what limits allow, what a sweep finds."""

import collections
import textwrap
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

from study_app import figure_style as style
from study_app.evidence.stability.damping_limits import (
    DELAYS,
    FREE_HANDLE_KG,
    NOMINAL_S,
    PERIODS_S,
    boundary_nspm,
    passive_nspm,
)
from study_app.evidence.stability.verdict import Verdict
from study_app.haptics.model.scene import Ewma
from study_app.haptics.model.slope_limits import slope_limit

HEIGHT_PT: Final = 256.0
PLOT_PT: Final = 146.0
FOOT_PT: Final = 62.0
FRICTIONS_NSPM: Final = (0.1, 0.3, 1.0, 3.0, 10.0)
MAP_DELAYS: Final = (0, 1, 2, 4)
LIMIT_DELAYS: Final = (1, 2, 4)
COLOURS: Final = dict(zip(MAP_DELAYS, (style.STEPS[0], style.STEPS[1], style.STEPS[3], style.STEPS[4]), strict=True))
CAPTION: Final = (
    "Lines: boundary measured with the servo's own tick, exact encoder, safety off. Dashed: b = B·α/(2 − α), extended "
    "to a delay; no hand can make the loop unstable below it. Bars: limits in use; only at 1 kHz with up to one tick "
    "of delay are they more than half of the boundary."
)
CAPTION_LETTERS: Final = 112
MARKS: Final = dict(zip(MAP_DELAYS, "osD^", strict=True))


@style.own_settings(style.PLOT_SETTINGS)
def draw_map(off: Sequence[Verdict]) -> Figure:
    """Draw the map; ``off`` are the verdicts of a sweep without safety."""
    figure = Figure(figsize=(style.PAGE_WIDTH_PT / 72, HEIGHT_PT / 72), facecolor="white")
    width_pt = style.PAGE_WIDTH_PT
    axes = [
        figure.add_axes((left_pt / width_pt, FOOT_PT / HEIGHT_PT, wide_pt / width_pt, PLOT_PT / HEIGHT_PT))
        for left_pt, wide_pt in ((34, 150), (232, 118), (400, 105))
    ]
    _boundary(axes[0])
    _limits(axes[1])
    _found(axes[2], off)
    caption = textwrap.fill(CAPTION, CAPTION_LETTERS)
    figure.text(34 / width_pt, 6 / HEIGHT_PT, caption, color=style.TEXT_SOFT, linespacing=1.25)
    return figure


def _boundary(axes: Axes) -> None:
    """Draw the maximum stable damping of a handle with some friction, and that which its friction alone proves."""
    for delay in MAP_DELAYS:
        measured = [boundary_nspm(Ewma(), NOMINAL_S, delay, friction_nspm=b) for b in FRICTIONS_NSPM]
        proved = [passive_nspm(b, NOMINAL_S, delay) for b in FRICTIONS_NSPM]
        look: dict[str, Any] = {"color": COLOURS[delay]}
        axes.plot(FRICTIONS_NSPM, measured, marker=MARKS[delay], markersize=3, label=str(delay), **look)
        axes.plot(FRICTIONS_NSPM, proved, linestyle=(0, (3, 2)), linewidth=0.9, **look)
    _logarithmic(axes, FRICTIONS_NSPM, (1, 10, 100))
    axes.set_title(f"Maximum stable damping B [N·s/m]\nof {FREE_HANDLE_KG:g} kg at 1 kHz", pad=26)
    axes.set_xlabel("Friction b of the handle [N·s/m]", loc="right", labelpad=1)
    _name_curves(axes, 4)


def _limits(axes: Axes) -> None:
    """Draw boundary and limit over the tick period."""
    periods_ms = [period_s * 1e3 for period_s in PERIODS_S]
    for delay in LIMIT_DELAYS:
        measured = [boundary_nspm(Ewma(), period_s, delay) for period_s in PERIODS_S]
        allowed = [slope_limit(period_s, delay) for period_s in PERIODS_S]
        look: dict[str, Any] = {"color": COLOURS[delay]}
        axes.plot(periods_ms, measured, marker=MARKS[delay], markersize=3, label=str(delay), **look)
        for period_ms, limit in zip(periods_ms, allowed, strict=True):
            axes.plot((period_ms / 1.18, period_ms * 1.18), (limit, limit), linewidth=2.2, **look)
    _logarithmic(axes, periods_ms, (3, 10, 30, 100))
    axes.set_title("Boundary and limit (bars)\nof B [N·s/m]", pad=26)
    axes.set_xlabel("Time between ticks [ms]", loc="right", labelpad=1)
    _name_curves(axes, 3)


def _found(axes: Axes, off: Sequence[Verdict]) -> None:
    """Draw the share of the sweep's cases that are unstable without safety, over rate and delay."""
    total: collections.Counter[tuple[float, int]] = collections.Counter()
    bad: collections.Counter[tuple[float, int]] = collections.Counter()
    for verdict in off:
        total[verdict.case.rate_hz, verdict.case.delay] += 1
        bad[verdict.case.rate_hz, verdict.case.delay] += not verdict.stable
    rates_hz = sorted({rate_hz for rate_hz, _ in total}, reverse=True)
    shares = np.array([[bad[r, d] / max(total[r, d], 1) for r in rates_hz] for d in DELAYS])
    axes.grid(visible=False)
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto", origin="lower")
    for (row, column), share in np.ndenumerate(shares):
        colour = "white" if share > 0.55 else style.TEXT
        axes.text(column, row, f"{share:.0%}", ha="center", va="center", color=colour)
    axes.set_xticks(range(len(rates_hz)), [f"{1e3 / rate_hz:g}" for rate_hz in rates_hz])
    axes.set_yticks(range(len(DELAYS)), [str(delay) for delay in DELAYS])
    axes.set_title("Unstable cases, safety off,\nby ticks of delay", pad=5)
    axes.set_xlabel("Time between ticks [ms]", loc="right", labelpad=1)


def _logarithmic(axes: Axes, x: Sequence[float], y: Sequence[float]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis, places in ((axes.xaxis, x), (axes.yaxis, y)):
        axis.set_major_locator(FixedLocator(list(places)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))


def _name_curves(axes: Axes, columns: int) -> None:
    axes.legend(
        title="ticks of delay",
        title_fontsize=7.5,
        alignment="left",
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        handlelength=1.2,
        handletextpad=0.4,
        columnspacing=0.9,
        borderpad=0,
        borderaxespad=0.2,
    )
