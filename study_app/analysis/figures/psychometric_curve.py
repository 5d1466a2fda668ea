"""The figure of a detection threshold: the share that noticed at each delay, and the curve where one is fitted."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.analysis.statistics.psychometrics.psychometric import Curve, share
from study_app.analysis.statistics.psychometrics.threshold import Threshold
from study_app.analysis.tables.measures import Array

LEFT_PT: Final = 30.0
FOOT_PT: Final = 30.0
HEIGHT_PT: Final = 190.0
TOP_PT: Final = 34.0
RIGHT_PT: Final = 26.0


@style.own_settings()
def draw(
    found: Threshold,
    lowest_ms: float | None,
    *,
    title: str,
    marks: Sequence[Mark],
    counts: Sequence[str],
    fonts: Sequence[str],
) -> Sheet:
    """Draw the figure; ``lowest_ms`` is the lowest delay up to which a statement follows the delay, or None."""
    sheet = Sheet(style.PAGE_WIDTH_PT / 2, HEIGHT_PT, fonts)
    sheet.heading(title, marks, counts)
    axes = sheet.axes(
        MARGIN_PT + LEFT_PT, TOP_PT, sheet.width_pt - LEFT_PT - RIGHT_PT, sheet.height_pt - TOP_PT - FOOT_PT
    )
    curve(sheet, axes, found, lowest_ms)
    sheet.text(MARGIN_PT, sheet.height_pt - 5, "Added delay, ms", size=6.5, colour=style.TEXT_SOFT)
    return sheet


def curve(sheet: Sheet, axes: Axes, found: Threshold, lowest_ms: float | None) -> None:
    """Draw shares as dots, the curve, its threshold with the interval, and the lowest delay dashed."""
    levels = np.array(found.levels)
    asked = np.array(found.asked)
    there = asked > 0
    scale(sheet, axes, levels)
    if lowest_ms is not None:
        axes.axvline(lowest_ms, color=style.TEXT_SOFT, linewidth=0.8, dashes=(3, 2), gid="lowest")
    if found.effect is not None and found.width is not None and found.guess is not None and found.lapse is not None:
        fitted = Curve(found.effect, found.width, found.guess, found.lapse, 0.0)
        xs = np.linspace(levels.min(), levels.max(), 200)
        axes.plot(xs, share(xs, fitted, found.shape), color=style.ACCENT, linewidth=1.4, gid="curve")
        half = float(share(np.array([found.effect]), fitted, found.shape)[0])
        if found.interval is not None:
            ends = [found.interval.low, found.interval.high]
            axes.plot(ends, [half, half], color=style.BAND, linewidth=4, solid_capstyle="butt", gid="interval")
        axes.plot([found.effect], [half], marker="D", markersize=4, color=style.ACCENT, gid="threshold")
    shares = np.array(found.yes)[there] / asked[there]
    axes.plot(
        levels[there], shares, "o", markersize=4, markerfacecolor="white", markeredgecolor=style.TEXT, gid="shares"
    )


def scale(sheet: Sheet, axes: Axes, levels: Array) -> None:
    """Give the axes their scales: delays that were presented, and shares."""
    span = float(np.ptp(levels)) or 1.0
    axes.set_xlim(levels.min() - 0.04 * span, levels.max() + 0.04 * span)
    axes.set_ylim(-0.04, 1.04)
    places = [0.0, 0.5, 1.0]
    axes.set_yticks(places, [f"{place:.0%}" for place in places])
    axes.set_xticks(levels, [f"{level:g}" for level in levels])
    for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
        label.set_fontproperties(sheet.font(6.5))
    for place in places:
        axes.axhline(place, color=style.GRID, linewidth=0.6, zorder=0)
