"""The figures of questions that no block of statements holds."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_hex

from study_app import figure_style as style
from study_app.analysis.data.blocks import PlacedQuestion
from study_app.analysis.data.study_tables import Study
from study_app.analysis.page_layout import (
    MARGIN_PT,
    POINT,
    SMALL,
    FigureTask,
    Look,
    Picture,
    Sheet,
    Style,
    picture_of,
    sample_words,
    spread_points,
    tab_separated,
)
from study_app.analysis.results import QuestionResult
from study_app.discovery import by_name

_LEFT_PT: Final = 120.0
_RIGHT_PT: Final = 40.0
_TOP_PT: Final = 30.0
_FOOT_PT: Final = 34.0
_LINE_PT: Final = 8.5


_Draw: TypeAlias = Callable[[PlacedQuestion, QuestionResult, Look], Sheet]


@dataclass(frozen=True, slots=True)
class _QuestionFigure:
    """A kind of figure: its drawing function and the sentence of its caption."""

    id: str
    draw: _Draw
    caption: str


def rows(names: Sequence[str], ns: Sequence[int], look: Look, *, row_pt: float) -> tuple[Sheet, Axes]:
    """Return a sheet and axes with one row per name; row k is at y = k, the first at the top."""
    sheet = look.sheet(_TOP_PT + row_pt * len(names) + _FOOT_PT)
    axes = sheet.axes(_LEFT_PT, _TOP_PT, sheet.width_pt - _LEFT_PT - _RIGHT_PT, row_pt * len(names))
    axes.set_ylim(len(names) - 0.5, -0.5)
    for place, (name, n) in enumerate(zip(names, ns, strict=True)):
        middle = _TOP_PT + row_pt * (place + 0.5) + 2.5
        sheet.lines(
            _LEFT_PT - 8, middle, sheet.wrap(name, _LEFT_PT - MARGIN_PT - 8, SMALL), _LINE_PT, size=SMALL, ha="right"
        )
        sheet.text(sheet.width_pt - MARGIN_PT, middle, f"n = {n}", size=SMALL, colour=style.TEXT_SOFT, ha="right")
    return sheet, axes


def _rows_of_groups(result: QuestionResult, look: Look, row_pt: float) -> tuple[Sheet, Axes]:
    return rows(
        [group.name for group in result.groups],
        [int(group.numbers["n"]) for group in result.groups],
        look,
        row_pt=row_pt,
    )


def _ends(sheet: Sheet, y: float, low: str, high: str) -> None:
    """Label the ends of the axis."""
    sheet.text(_LEFT_PT, y, low, size=SMALL, colour=style.TEXT_SOFT)
    sheet.text(sheet.width_pt - _RIGHT_PT, y, high, size=SMALL, colour=style.TEXT_SOFT, ha="right")


_ROW_PT: Final = 30.0
_BAND: Final = 0.22
_MOST_PT: Final = 30.0
"""Farthest point from the middle of a row."""


@style.own_settings()
def draw_distribution(asked: PlacedQuestion, result: QuestionResult, look: Look) -> Sheet:
    """Draw the distribution of the answers."""
    groups = result.groups
    values = [value for group in groups for value in group.numbers["values"]]
    low, high = asked.bounds or (min(values, default=0.0), max(values, default=1.0))
    span = (high - low) or 1.0
    per_value = (style.PAGE_WIDTH_PT - _LEFT_PT - _RIGHT_PT) / (1.06 * span)
    offsets = [spread_points(per_value * np.array(group.numbers["values"]), _MOST_PT) for group in groups]
    row_pt = max(_ROW_PT, *(2 * np.abs(own).max(initial=0.0) + 10 for own in offsets))
    sheet, axes = _rows_of_groups(result, look, row_pt)
    axes.set_xlim(low - 0.03 * span, high + 0.03 * span)
    for place, group in enumerate(groups):
        numbers = group.numbers
        axes.plot([low, high], [place, place], color=style.GRID, linewidth=0.8, zorder=0)
        if numbers["median"] is None:
            continue
        axes.fill_between([numbers["q1"], numbers["q3"]], place - _BAND, place + _BAND, color=style.BAND, linewidth=0)
        axes.plot([numbers["median"]] * 2, [place - _BAND, place + _BAND], color=style.ACCENT, linewidth=1.6)
        axes.plot(numbers["values"], place + offsets[place] / row_pt, **POINT, gid=f"{group.code}")
    view = asked.question.view(0, asked.context)
    ends = (f"{low:g} {getattr(view, 'low', '')}".strip(), f"{high:g} {getattr(view, 'high', '')}".strip())
    _ends(sheet, sheet.height_pt - _FOOT_PT + 12, *ends)
    return sheet


_DISTRIBUTION: Final = _QuestionFigure(
    "distribution",
    draw_distribution,
    "Each dot is one answer; the line shows the median and the band the interquartile range.",
)


_OPTION_PT: Final = 20.0


@style.own_settings()
def draw_options(asked: PlacedQuestion, result: QuestionResult, look: Look) -> Sheet:
    """Draw the count of each option."""
    several = len(result.groups) > 1
    bars = [
        (f"{group.name}: {words}" if several else words, int(group.numbers["counts"][option]), int(group.numbers["n"]))
        for group in result.groups
        for option, words in asked.levels.items()
    ]
    sheet, axes = rows([name for name, _, _ in bars], [n for _, _, n in bars], look, row_pt=_OPTION_PT)
    most = max((n for _, _, n in bars), default=1) or 1
    axes.set_xlim(0, most * 1.06)
    for place, (_, count, n) in enumerate(bars):
        axes.barh(place, n, height=0.56, color=style.GROUND)
        axes.barh(place, count, height=0.56, color=style.ACCENT, gid=f"bar-{place}")
        axes.text(count + 0.01 * most, place, str(count), va="center", fontproperties=sheet.font(SMALL))
    return sheet


_OPTIONS: Final = _QuestionFigure(
    "counts",
    draw_options,
    "Bars show the number of participants who chose each option; grey bars show the number who answered.",
)


_RATING_PT: Final = 26.0
_HALF: Final = 0.32
_SWATCH_PT: Final = 18.0
_NARROW: Final = 0.03  # share of a bar in which the value is not printed


def colours(points: int) -> list[str]:
    """Return a colour for each point, from the palette for agreement."""
    palette = LinearSegmentedColormap.from_list("points", style.LEVEL_COLOURS)
    return [to_hex(palette(place / (points - 1))) for place in range(points)]


def _ink(colour: str) -> str:
    red, green, blue = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    return "#000000" if 0.299 * red + 0.587 * green + 0.114 * blue > 130 else "#ffffff"


@style.own_settings()
def draw_ratings(asked: PlacedQuestion, result: QuestionResult, look: Look) -> Sheet:
    """Draw the count of each point."""
    groups = result.groups
    sheet, axes = _rows_of_groups(result, look, _RATING_PT)
    axes.set_xlim(0, 1)
    inks = colours(len(asked.levels))
    for place, group in enumerate(groups):
        total = max(1, int(group.numbers["n"]))
        left = 0.0
        for count, colour in zip(group.numbers["counts"].values(), inks, strict=True):
            share = count / total
            axes.barh(place, share, left=left, height=2 * _HALF, color=colour, gid=f"{group.code}")
            if share > _NARROW:
                look_of_count: Style = {"ha": "center", "va": "center", "color": _ink(colour)}
                axes.text(left + share / 2, place, str(count), fontproperties=sheet.font(SMALL), **look_of_count)
            left += share
    _legend(sheet, list(asked.levels.values()), inks)
    return sheet


def _legend(sheet: Sheet, names: list[str], inks: list[str]) -> None:
    """Draw the labels of the scale's ends, and between them the points in their colours."""
    y = sheet.height_pt - 12
    _ends(sheet, y, names[0], names[-1])
    x = (_LEFT_PT + sheet.width_pt - _RIGHT_PT - _SWATCH_PT * len(inks)) / 2
    for point, ink in enumerate(inks, start=1):
        sheet.box(x, y - 8.5, _SWATCH_PT, 11, ink, rounding=0.5)
        sheet.text(x + _SWATCH_PT / 2, y, str(point), size=SMALL, colour=_ink(ink), ha="center")
        x += _SWATCH_PT


_RATINGS: Final = _QuestionFigure(
    "rating",
    draw_ratings,
    "Each bar shows the proportion of answers at each point of the scale; labels show the number of answers.",
)


_FIGURES: Final = {figure.id: figure for figure in (_RATINGS, _OPTIONS, _DISTRIBUTION)}
"""Every figure by the id that a kind of question names it by."""


def question_figure_tasks(
    study: Study, answered: Sequence[QuestionResult], forms: Sequence[str] = style.FORMATS
) -> Iterator[FigureTask]:
    """Yield the figure of every answered question that has one, to draw in each of ``forms``.

    Blocks of levels have their own figures once the key is open.
    """
    of_levels = {block.id for block in study.levels if block.design.adjusts or study.revealed}
    for asked, result in zip(study.others.questions, answered, strict=True):
        if result.figure is not None and result.n and result.where not in of_levels:
            name = f"question-{result.where}-{result.item}"
            yield result.where, name, partial(_picture, study, asked, result, forms, name)


def _picture(study: Study, asked: PlacedQuestion, result: QuestionResult, forms: Sequence[str], name: str) -> Picture:
    figure = by_name(_FIGURES, result.figure or "")
    title = result.short if result.short == result.title else f"{result.title}: {result.short}"
    caption = f"{result.title}: “{result.text}” {figure.caption} {sample_words(study, study.n)}"
    rows = study.answers_to(asked)[["participant", "session", "code", "response"]].rename(
        columns={"response": asked.id}
    )
    numbers = tab_separated(study, rows.dropna(axis="columns", how="all"))
    draw = partial(figure.draw, asked, result)
    return picture_of(study, result.where, name, title, caption, draw, forms, numbers=numbers)
