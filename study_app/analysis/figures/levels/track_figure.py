"""Tracks of adaptive methods: level over trial for each participant and standard, with the narrowing interval."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.designs.track_courses import Flags, TrackCourse, courses
from study_app.analysis.figures import answer_figures
from study_app.analysis.figures.levels.level_figure import (
    COLOURS,
    COLUMNS,
    GAP_PT,
    HEAD_PT,
    LEFT_PT,
    ROW_GAP_PT,
    level_words,
)
from study_app.analysis.figures.page_layout import MARGIN_PT, Sheet
from study_app.analysis.figures.picture import Picture, attempted, files_of, sample_words
from study_app.analysis.results.levels import LevelsFound
from study_app.analysis.results.section_failures import Failures
from study_app.analysis.results.words import counted
from study_app.analysis.statistics.outcome import Array
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.study import Study
from study_app.analysis.tables.tracks import tracks

MOST_PANELS: Final = 24
PANEL_PT: Final = 84.0
FOOT_PT: Final = 28.0
MARK_PT2: Final = 7.0
RING_PT2: Final = 26.0
CROSS_PT2: Final = 11.0
"""Areas of the marks of answers, reversals and catch trials."""
LEAST_LEVELS: Final = 3
"""Ticks at 1, 2 and 5 in each decade, as long as so many lie within the axis."""


def track_pictures(
    study: Study,
    levels: Sequence[LevelsFound],
    forms: Sequence[str] = style.FORMATS,
    failures: Failures | None = None,
) -> Iterator[Picture]:
    """Draw the tracks of every block whose levels answers chose, once the key is open, in each of ``forms``.

    A figure that fails is left out, and kept in ``failures``.
    """
    adaptive = [found for found in levels if found.adaptive and found.own_thresholds]
    if not adaptive:
        return
    opened, blocks = tracks(study), {block.id: block for block in study.levels}
    make = partial(_picture, study, opened, forms)
    yield from attempted(
        ((found.block, f"tracks-{found.block}", partial(make, found, blocks[found.block])) for found in adaptive),
        failures,
    )


def _picture(
    study: Study, opened: pd.DataFrame, forms: Sequence[str], found: LevelsFound, block: LevelBlock, name: str
) -> Picture:
    shown = list(courses(block, opened, MOST_PANELS))
    files = files_of(partial(_draw, study, found, shown), forms, f"{study.name}: {found.title}, tracks")
    rest = len(found.own_thresholds) - len(shown)
    left_out = f" {counted(rest, 'more panel')} not shown." if rest > 0 else ""
    success = "correct" if found.counts == "correct" else f"“{found.counts}”"
    marks = " Colours: tracks." if any(one.tracks.max() > 1 for one in shown) else ""
    marks += " Rings: reversals." if any(one.reversals.any() for one in shown) else ""
    marks += " × and +: catch trials, answered correctly and not." if any(one.catches.any() for one in shown) else ""
    caption = (
        f"{found.title}: the level of each trial. Filled: {success}; hollow: not.{marks} Band: 95 % interval of "
        f"the threshold from the answers so far.{left_out} {sample_words(study, len(found.people))}"
    )
    return Picture(found.block, name, caption, files)


@style.own_settings()
def _draw(study: Study, found: LevelsFound, shown: Sequence[TrackCourse], fonts: Sequence[str]) -> Sheet:
    rows = math.ceil(len(shown) / COLUMNS)
    height = HEAD_PT + rows * PANEL_PT + (rows - 1) * ROW_GAP_PT + FOOT_PT + 14
    sheet = Sheet(style.PAGE_WIDTH_PT, height, fonts)
    sheet.heading(f"{found.title}: tracks", answer_figures.marks(study), (counted(study.n, "participant"),))
    sheet.text(MARGIN_PT, 28, level_words(found), size=7, colour=style.TEXT_SOFT)
    width = (sheet.width_pt - LEFT_PT - MARGIN_PT - (COLUMNS - 1) * GAP_PT) / COLUMNS
    standards = len({one.standard for one in shown}) > 1
    ends = _ends(found, shown)
    for number, course in enumerate(shown):
        row, column = divmod(number, COLUMNS)
        x, y = LEFT_PT + column * (width + GAP_PT), HEAD_PT + row * (PANEL_PT + ROW_GAP_PT)
        sheet.text(x, y - 4, course.participant, size=7, weight="bold")
        if standards:
            aside = sheet.text_width(course.participant, 7, "bold") + 6
            sheet.text(x + aside, y - 4, f"standard {course.standard:g}", size=7, colour=style.TEXT_SOFT)
        axes = sheet.axes(x, y, width, PANEL_PT)
        _frame(axes, found, course, ends, first=column == 0)
        _panel(axes, course)
        for label in (*axes.get_xticklabels(), *axes.get_yticklabels()):
            label.set_fontproperties(sheet.font(6.5))
    sheet.text(LEFT_PT, height - 10, "Trial at the standard" if standards else "Trial", size=7, colour=style.TEXT_SOFT)
    return sheet


def _ends(found: LevelsFound, shown: Sequence[TrackCourse]) -> tuple[float, float]:
    """Return the ends of the axis: all levels and the last intervals, with a margin."""
    levels = np.concatenate([(*one.levels, one.low[-1], one.high[-1]) for one in shown])
    levels = levels[levels > 0] if found.spacing == "log" else levels
    low, high = float(levels.min()), float(levels.max())
    if found.spacing == "log":
        factor = max((high / low) ** 0.12, 1.1)
        return low / factor, high * factor
    margin = 0.06 * ((high - low) or 1.0)
    return low - margin, high + margin


def _frame(axes: Axes, found: LevelsFound, course: TrackCourse, ends: tuple[float, float], *, first: bool) -> None:
    n = len(course.levels)
    axes.set_xlim(0.5 - 0.02 * n, n + 0.5 + 0.02 * n)
    axes.set_xticks([1, *(place for place in (round(n / 2), n) if place > 1)])
    if found.spacing == "log":
        axes.set_yscale("log")
        axes.minorticks_off()
    axes.set_ylim(*ends)
    ticks = level_ticks(found, ends)
    axes.set_yticks(ticks, [f"{tick:g}" if first else "" for tick in ticks])
    axes.hlines(ticks, *axes.get_xlim(), color=style.GRID, linewidth=0.6, zorder=0)


def level_ticks(found: LevelsFound, ends: tuple[float, float]) -> list[float]:
    """Return round levels between the ends of an axis: from 1, 2 and 5, in decades where levels are spaced so."""
    low, high = ends
    if found.spacing == "linear":
        step = 10.0 ** math.floor(math.log10(high - low))
        step *= next(times for times in (0.1, 0.2, 0.5, 1.0, 2.0) if (high - low) / (step * times) <= 6)
        return [float(f"{number * step:.12g}") for number in range(math.ceil(low / step), math.floor(high / step) + 1)]
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for digits in ((1,), (1, 3), (1, 2, 5), tuple(range(1, 10))):
        found_ = [float(f"{digit}e{decade}") for decade in decades for digit in digits]
        inside = [tick for tick in found_ if low <= tick <= high]
        if len(inside) >= LEAST_LEVELS:
            return inside
    return inside


def _panel(axes: Axes, course: TrackCourse) -> None:
    """Draw the interval, a line for each track, and a mark for each answer; levels of zero lie on the lower edge."""
    trials = np.arange(1.0, len(course.levels) + 1)
    low, high = axes.get_ylim()
    axes.fill_between(
        trials, np.clip(course.low, low, high), np.clip(course.high, low, high), color=style.BAND, linewidth=0, zorder=1
    )
    levels = np.maximum(course.levels, low)
    for track, colour in zip(sorted(set(course.tracks.tolist())), COLOURS, strict=False):
        of_track = course.tracks == track
        own = of_track & ~course.catches
        chosen = own & ~course.noises
        axes.plot(trials[chosen], levels[chosen], color=colour, linewidth=0.6)
        _marks(axes, trials, levels, own & course.successes, colour, colour)
        _marks(axes, trials, levels, own & ~course.successes, "white", colour)
        _marks(axes, trials, levels, own & course.reversals, "none", colour, RING_PT2)
        for marker, answered in (("x", course.successes), ("+", ~course.successes)):
            which = of_track & course.catches & answered
            axes.scatter(
                trials[which], levels[which], s=CROSS_PT2, marker=marker, color=colour, linewidths=0.8, clip_on=False
            )


def _marks(
    axes: Axes, trials: Array, levels: Array, which: Flags, face: str, edge: str, size: float = MARK_PT2
) -> None:
    """Draw circles; those at an edge are not cut off."""
    axes.scatter(
        trials[which], levels[which], s=size, facecolors=face, edgecolors=edge, linewidths=0.6, zorder=4, clip_on=False
    )
