"""Settings in their order for each participant and standard, with the point of subjective equality and the standard."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures import answer_figures
from study_app.analysis.figures.levels.level_figure import (
    COLUMNS,
    GAP_PT,
    HEAD_PT,
    LEFT_PT,
    ROW_GAP_PT,
    level_words,
    with_unit,
)
from study_app.analysis.figures.levels.track_figure import FOOT_PT, MARK_PT2, MOST_PANELS, PANEL_PT, level_ticks
from study_app.analysis.figures.page_layout import MARGIN_PT, Sheet
from study_app.analysis.figures.picture import Picture, attempted, files_of, sample_words
from study_app.analysis.results.levels import LevelsFound, SettingFound
from study_app.analysis.results.section_failures import Failures
from study_app.analysis.results.words import counted
from study_app.analysis.tables.study import Study

MARGIN: Final = 0.08
"""Of the axis beyond the lowest and the highest setting, as a share of the span."""


def setting_pictures(
    study: Study,
    levels: Sequence[LevelsFound],
    forms: Sequence[str] = style.FORMATS,
    failures: Failures | None = None,
) -> Iterator[Picture]:
    """Draw the settings of every block whose levels participants set, once the key is open, in each of ``forms``.

    A figure that fails is left out, and kept in ``failures``.
    """
    shown = (found for found in levels if found.own_settings)
    yield from attempted(
        ((found.block, f"settings-{found.block}", partial(_picture, study, found, forms)) for found in shown), failures
    )


def _picture(study: Study, found: LevelsFound, forms: Sequence[str], name: str) -> Picture:
    files = files_of(partial(_draw, study, found), forms, f"{study.name}: {found.title}, settings")
    rest = len(found.own_settings) - MOST_PANELS
    left_out = f" {counted(rest, 'more panel')} not shown." if rest > 0 else ""
    compared = any(one.constant_error is not None for one in found.own_settings)
    standard = " Dashed: standard." if compared else ""
    caption = (
        f"{found.title}: the levels that participants set, in their order. Filled: started high; hollow: started low. "
        f"Line and band: point of subjective equality with its 95 % interval (Student's t).{standard}{left_out} "
        f"{sample_words(study, len(found.people))}"
    )
    return Picture(found.block, name, caption, files)


@style.own_settings()
def _draw(study: Study, found: LevelsFound, fonts: Sequence[str]) -> Sheet:
    shown = found.own_settings[:MOST_PANELS]
    rows = math.ceil(len(shown) / COLUMNS)
    height = HEAD_PT + rows * PANEL_PT + (rows - 1) * ROW_GAP_PT + FOOT_PT + 14
    sheet = Sheet(style.PAGE_WIDTH_PT, height, fonts)
    sheet.heading(f"{found.title}: settings", answer_figures.marks(study), (counted(study.n, "participant"),))
    sheet.text(MARGIN_PT, 28, level_words(found), size=7, colour=style.TEXT_SOFT)
    width = (sheet.width_pt - LEFT_PT - MARGIN_PT - (COLUMNS - 1) * GAP_PT) / COLUMNS
    standards = len({one.standard for one in shown}) > 1
    ends = _ends(found, shown)
    for number, one in enumerate(shown):
        row, column = divmod(number, COLUMNS)
        x, y = LEFT_PT + column * (width + GAP_PT), HEAD_PT + row * (PANEL_PT + ROW_GAP_PT)
        person = str(one.participant)
        sheet.text(x, y - 4, person, size=7, weight="bold")
        if standards and one.standard is not None:
            aside = sheet.text_width(person, 7, "bold") + 6
            words = f"standard {with_unit(found, one.standard)}"
            sheet.text(x + aside, y - 4, words, size=7, colour=style.TEXT_SOFT)
        axes = sheet.axes(x, y, width, PANEL_PT)
        _frame(axes, found, one, ends, first=column == 0)
        _panel(axes, one)
        for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
            label.set_fontproperties(sheet.font(6.5))
    sheet.text(LEFT_PT, height - 10, "Setting", size=7, colour=style.TEXT_SOFT)
    return sheet


def _compared(one: SettingFound) -> float | None:
    """Return the standard as a level that can be drawn among the settings; None where none was presented."""
    return one.standard if one.constant_error is not None else None


def _ends(found: LevelsFound, shown: Sequence[SettingFound]) -> tuple[float, float]:
    """Return the ends of the axis: all settings and standards, with a margin."""
    levels = [level for one in shown for level in (*one.levels, one.low, one.high, _compared(one)) if level is not None]
    if found.spacing == "log":
        low, high = min(level for level in levels if level > 0), max(levels)
        factor = max((high / low) ** MARGIN, 1.05)
        return low / factor, high * factor
    low, high = min(levels), max(levels)
    margin = MARGIN * ((high - low) or 1.0)
    return low - margin, high + margin


def _frame(axes: Axes, found: LevelsFound, one: SettingFound, ends: tuple[float, float], *, first: bool) -> None:
    axes.set_xlim(0.4, one.n + 0.6)
    axes.set_xticks([1, *(place for place in (round(one.n / 2), one.n) if place > 1)])
    if found.spacing == "log":
        axes.set_yscale("log")
        axes.minorticks_off()
    axes.set_ylim(*ends)
    ticks = level_ticks(found, ends)
    axes.set_yticks(ticks, [f"{tick:g}" if first else "" for tick in ticks])
    axes.hlines(ticks, *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)


def _panel(axes: Axes, one: SettingFound) -> None:
    """Draw the PSE with its interval, the standard, and a circle for each setting."""
    if one.low is not None and one.high is not None:
        axes.axhspan(one.low, one.high, color=style.BAND, linewidth=0, zorder=1)
    axes.axhline(one.pse, color=style.ACCENT, linewidth=1.0, zorder=2)
    if (standard := _compared(one)) is not None:
        axes.axhline(standard, color=style.AXIS, linewidth=0.8, linestyle=(0, (4, 3)), zorder=2)
    places, levels = np.arange(1, one.n + 1), np.array(one.levels)
    high = np.array(one.started_high, dtype=bool)
    for which, face in ((high, style.ACCENT), (~high, "white")):
        axes.scatter(
            places[which],
            levels[which],
            s=MARK_PT2,
            facecolors=face,
            edgecolors=style.ACCENT,
            linewidths=0.6,
            zorder=4,
            clip_on=False,
        )
