"""The figure of motion over delay: a small plot per measure of reaching, every participant shown."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.analysis.figures.small_multiples import legend, over_delay
from study_app.analysis.tables.measures import Array

PLOT_PT: Final = 104.0
TOP_PT: Final = 40.0
TITLE_PT: Final = 16.0
GAP_PT: Final = 30.0
LEFT_PT: Final = 24.0
FOOT_PT: Final = 32.0


@dataclass(frozen=True, slots=True)
class Measured:
    """One measure: its title with the unit, and (participants, delays) values, NaN where there is none."""

    title: str
    values: Array


@style.own_settings()
def draw(
    plots: Sequence[Measured],
    delays_ms: Sequence[float],
    *,
    title: str,
    marks: Sequence[Mark],
    counts: Sequence[str],
    foot: str,
    fonts: Sequence[str],
) -> Sheet:
    """Draw the measures over delay, on true scales that begin where the values do."""
    columns = len(plots)
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - LEFT_PT - (columns - 1) * GAP_PT) / columns
    sheet = Sheet(style.PAGE_WIDTH_PT, TOP_PT + TITLE_PT + PLOT_PT + FOOT_PT, fonts)
    sheet.heading(title, marks, counts)
    legend(sheet, lines=True)
    for place, plot in enumerate(plots):
        x = MARGIN_PT + LEFT_PT + place * (width + GAP_PT)
        sheet.text(x, TOP_PT + 8, plot.title, size=7.5, weight="bold")
        axes = sheet.axes(x, TOP_PT + TITLE_PT, width, PLOT_PT)
        axes.set_label(f"measure{place + 1}")
        _scale(sheet, axes, plot.values)
        over_delay(sheet, axes, plot.values, np.asarray(delays_ms, dtype=float), 0.0)
    sheet.text(MARGIN_PT + LEFT_PT, sheet.height_pt - 6, foot, size=6.5, colour=style.TEXT_SOFT)
    return sheet


def _scale(sheet: Sheet, axes: Axes, values: Array) -> None:
    """Let the axis reach a little beyond the values, with round ticks; where all are equal they stand in the middle."""
    there = values[~np.isnan(values)]
    low, high = (float(there.min()), float(there.max())) if len(there) else (0.0, 0.0)
    room = 0.08 * (high - low) or 0.5
    axes.set_ylim(low - room, high + room)
    found = MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]).tick_values(low - room, high + room)
    ticks = [float(tick) for tick in found if max(0.0, low - room) <= tick <= high + room] if high > low else [low]
    axes.set_yticks(ticks, [f"{tick:.3g}" for tick in ticks], fontproperties=sheet.font(6.5))
    for tick in ticks:
        axes.axhline(tick, color=style.GRID, linewidth=0.6, zorder=0)
