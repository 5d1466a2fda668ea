"""What the figures of levels share: a sheet of panels, and axes of levels over trials."""

import math
from collections.abc import Callable, Sequence
from typing import Final

from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures
from study_app.analysis.figures.page_layout import MARGIN_PT, Sheet
from study_app.analysis.results.level_results import LevelsFound
from study_app.analysis.results.words import counted
from study_app.analysis.tables.study_tables import Study

COLUMNS: Final = 4
PANEL_PT: Final = 84.0
LEFT_PT: Final = 40.0
GAP_PT: Final = 16.0
HEAD_PT: Final = 42.0
ROW_GAP_PT: Final = 36.0
LEAST_LEVELS: Final = 3
"""Ticks at 1, 2 and 5 in each decade, as long as so many lie within the axis."""


def sheet_of_panels(
    study: Study, title: str, above: str, panels: int, fonts: Sequence[str], *, foot_pt: float = 28.0
) -> Sheet:
    """Return a sheet with room for ``panels``, its heading, and what the vertical axes show."""
    rows = math.ceil(panels / COLUMNS)
    height = HEAD_PT + rows * PANEL_PT + (rows - 1) * ROW_GAP_PT + foot_pt + 14
    sheet = Sheet(style.PAGE_WIDTH_PT, height, fonts)
    sheet.heading(title, answer_figures.marks(study), (counted(study.n, "participant"),))
    sheet.text(MARGIN_PT, 28, above, size=7, colour=style.TEXT_SOFT)
    return sheet


def draw_panels(
    sheet: Sheet, names: Sequence[tuple[str, str]], draw: Callable[[Axes, int, bool], None], below: str
) -> Sheet:
    """Draw a panel under each name and the words after it, and say below what the horizontal axes show.

    ``draw`` takes the axes, the panel's place, and whether it is the first of its row.
    """
    width = (sheet.width_pt - LEFT_PT - MARGIN_PT - (COLUMNS - 1) * GAP_PT) / COLUMNS
    for place, (name, words) in enumerate(names):
        row, column = divmod(place, COLUMNS)
        x, y = LEFT_PT + column * (width + GAP_PT), HEAD_PT + row * (PANEL_PT + ROW_GAP_PT)
        sheet.text(x, y - 4, name, size=7, weight="bold")
        if words:
            aside = sheet.text_width(name, 7, "bold") + 6
            sheet.text(x + aside, y - 4, words, size=7, colour=style.TEXT_SOFT)
        axes = sheet.axes(x, y, width, PANEL_PT)
        draw(axes, place, column == 0)
        for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
            label.set_fontproperties(sheet.font(6.5))
    sheet.text(LEFT_PT, sheet.height_pt - 10, below, size=7, colour=style.TEXT_SOFT)
    return sheet


def over_trials(axes: Axes, found: LevelsFound, trials: int, ends: tuple[float, float], *, first: bool) -> None:
    """Give axes ticks for trials from 1 and, between ``ends``, for levels."""
    axes.set_xticks([1, *(place for place in (round(trials / 2), trials) if place > 1)])
    if found.spacing == "log":
        axes.set_yscale("log")
        axes.minorticks_off()
    axes.set_ylim(*ends)
    ticks = _level_ticks(found, ends)
    axes.set_yticks(ticks, [f"{tick:g}" if first else "" for tick in ticks])
    axes.hlines(ticks, *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)


def _level_ticks(found: LevelsFound, ends: tuple[float, float]) -> list[float]:
    """Return round levels between the ends of an axis: from 1, 2 and 5, in decades where levels are spaced so."""
    low, high = ends
    if found.spacing == "linear":
        step = 10.0 ** math.floor(math.log10(high - low))
        step *= next(times for times in (0.1, 0.2, 0.5, 1.0, 2.0) if (high - low) / (step * times) <= 6)
        return [float(f"{number * step:.12g}") for number in range(math.ceil(low / step), math.floor(high / step) + 1)]
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for digits in ((1,), (1, 3), (1, 2, 5), (1, 2, 3, 5, 7), tuple(range(1, 10))):
        found_ = [float(f"{digit}e{decade}") for decade in decades for digit in digits]
        inside = [tick for tick in found_ if low <= tick <= high]
        if len(inside) >= LEAST_LEVELS:
            return inside
    return inside
