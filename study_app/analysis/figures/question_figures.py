"""Figures of questions other than statements after trials."""

import math
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
    sample_text,
    spread_points,
    tab_separated,
)
from study_app.analysis.results import QuestionResult
from study_app.discovery import by_name
from study_app.protocol.questions import Number

_LEFT_PT: Final = 120.0
_RIGHT_PT: Final = 40.0
_TOP_PT: Final = 30.0
_FOOT_PT: Final = 34.0
_LINE_PT: Final = 8.5


_Draw: TypeAlias = Callable[[PlacedQuestion, QuestionResult, Look], Sheet]


@dataclass(frozen=True, slots=True, kw_only=True)
class _QuestionFigure:
    """A kind of figure: its drawing function and the sentence of its caption.

    ``repeated`` is another caption for participants who answered more than once.
    """

    id: str
    draw: _Draw
    caption: str
    repeated: str = ""


def _draw_rows(names: Sequence[str], ns: Sequence[int], look: Look, *, row_pt: float) -> tuple[Sheet, Axes]:
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


def _draw_group_rows(result: QuestionResult, look: Look, row_pt: float) -> tuple[Sheet, Axes]:
    return _draw_rows(
        [group.name for group in result.groups],
        [int(group.numbers["n"]) for group in result.groups],
        look,
        row_pt=row_pt,
    )


def _draw_end_labels(sheet: Sheet, y: float, low: str, high: str) -> None:
    """Label the ends of the axis."""
    sheet.text(_LEFT_PT, y, low, size=SMALL, colour=style.TEXT_SOFT)
    sheet.text(sheet.width_pt - _RIGHT_PT, y, high, size=SMALL, colour=style.TEXT_SOFT, ha="right")


_ROW_PT: Final = 30.0
_BAND: Final = 0.22
_MOST_PT: Final = 30.0
"""Largest distance of a point from the middle of a row."""
_LARGEST_LINEAR_RATIO: Final = 100.0
"""The largest ratio of two answers on a linear axis."""
_SMALLEST_PART: Final = 0.1
"""The smallest part of the permitted range that answers span if the axis shows the whole range."""


@style.own_settings()
def draw_distribution(question: PlacedQuestion, result: QuestionResult, look: Look) -> Sheet:
    """Draw the distribution of the answers."""
    groups = result.groups
    values = [value for group in groups for value in group.numbers["values"]]
    low, high, decades = _axis_of_answers(question, values)
    place_of = np.log10 if decades else np.asarray
    left, right = place_of([low, high])
    span = float(right - left) or 1.0
    width_pt = style.PAGE_WIDTH_PT - _LEFT_PT - _RIGHT_PT
    per_value = width_pt / (1.06 * span)
    offsets = [spread_points(per_value * place_of(np.array(group.numbers["values"])), _MOST_PT) for group in groups]
    row_pt = max(_ROW_PT, *(2 * np.abs(row_offsets).max(initial=0.0) + 10 for row_offsets in offsets))
    sheet, axes = _draw_group_rows(result, look, row_pt)
    axes.set_xlim(left - 0.03 * span, right + 0.03 * span)
    for place, group in enumerate(groups):
        numbers = group.numbers
        axes.plot([left, right], [place, place], color=style.GRID, linewidth=0.8, zorder=0)
        if numbers["median"] is None:
            continue
        q1, median, q3 = place_of([numbers[name] for name in ("q1", "median", "q3")])
        axes.fill_between([q1, q3], place - _BAND, place + _BAND, color=style.BAND, linewidth=0)
        axes.plot([median] * 2, [place - _BAND, place + _BAND], color=style.ACCENT, linewidth=1.6)
        axes.plot(place_of(numbers["values"]), place + offsets[place] / row_pt, **POINT, gid=f"{group.code}")
    foot_pt = sheet.height_pt - _FOOT_PT + 12
    for decade in decades[1:-1]:
        axes.axvline(decade, color=style.GRID, linewidth=0.6, zorder=0)
        x_pt = _LEFT_PT + per_value * (decade - left + 0.03 * span)
        sheet.text(x_pt, foot_pt, f"{10.0**decade:g}", size=SMALL, colour=style.TEXT_SOFT, ha="center")
    view = question.question.view(0, question.context)
    ends = (
        f"{low:g} {getattr(view, 'low', question.unit)}".strip(),
        f"{high:g} {getattr(view, 'high', question.unit)}".strip(),
    )
    _draw_end_labels(sheet, foot_pt, *ends)
    return sheet


def _axis_of_answers(question: PlacedQuestion, values: Sequence[float]) -> tuple[float, float, range]:
    """Return the ends of the axis of answers, and the decades of a logarithmic axis, which are empty for a linear one.

    The axis of a number ends at its bounds, unless the answers span more than two decades or only a small part of the
    permitted range.
    """
    smallest, largest = min(values, default=0.0), max(values, default=1.0)
    low, high = question.bounds or (smallest, largest)
    if not isinstance(question.question, Number) or not values:
        return low, high, range(0)
    if smallest > 0 and largest / smallest > _LARGEST_LINEAR_RATIO:
        decades = range(math.floor(math.log10(smallest)), math.ceil(math.log10(largest)) + 1)
        return 10.0 ** decades[0], 10.0 ** decades[-1], decades
    if smallest < largest and largest - smallest < _SMALLEST_PART * (high - low):
        return smallest, largest, range(0)
    return low, high, range(0)


_DISTRIBUTION: Final = _QuestionFigure(
    id="distribution",
    draw=draw_distribution,
    caption="Each dot is one answer; the line shows the median and the band the interquartile range.",
)


_OPTION_PT: Final = 20.0


@style.own_settings()
def draw_options(question: PlacedQuestion, result: QuestionResult, look: Look) -> Sheet:
    """Draw the count of each option as a bar."""
    several = len(result.groups) > 1
    bars = [
        (f"{group.name}: {text}" if several else text, int(group.numbers["counts"][option]), int(group.numbers["n"]))
        for group in result.groups
        for option, text in question.levels.items()
    ]
    sheet, axes = _draw_rows([name for name, _, _ in bars], [n for _, _, n in bars], look, row_pt=_OPTION_PT)
    most = max((n for _, _, n in bars), default=1) or 1
    axes.set_xlim(0, most * 1.06)
    for place, (_, count, n) in enumerate(bars):
        axes.barh(place, n, height=0.56, color=style.GROUND)
        axes.barh(place, count, height=0.56, color=style.ACCENT, gid=f"bar-{place}")
        axes.text(count + 0.01 * most, place, str(count), va="center", fontproperties=sheet.font(SMALL))
    return sheet


_OPTIONS: Final = _QuestionFigure(
    id="counts",
    draw=draw_options,
    caption="Bars show the number of participants who chose each option; grey bars show the number who answered.",
    repeated="Bars show how often each option was chosen; grey bars show the total number of answers.",
)


_RATING_PT: Final = 26.0
_HALF: Final = 0.32
_SWATCH_PT: Final = 18.0
_NARROW: Final = 0.03  # proportion of a bar in which the value is not printed


def _point_colours(points: int) -> list[str]:
    """Return a colour for each point, from the palette for agreement."""
    palette = LinearSegmentedColormap.from_list("points", style.LEVEL_COLOURS)
    return [to_hex(palette(place / (points - 1))) for place in range(points)]


def _text_colour(colour: str) -> str:
    red, green, blue = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    return "#000000" if 0.299 * red + 0.587 * green + 0.114 * blue > 130 else "#ffffff"


@style.own_settings()
def draw_ratings(question: PlacedQuestion, result: QuestionResult, look: Look) -> Sheet:
    """Draw the count of each scale point as a segment of a bar."""
    groups = result.groups
    sheet, axes = _draw_group_rows(result, look, _RATING_PT)
    axes.set_xlim(0, 1)
    colours = _point_colours(len(question.levels))
    for place, group in enumerate(groups):
        total = max(1, int(group.numbers["n"]))
        left = 0.0
        for count, colour in zip(group.numbers["counts"].values(), colours, strict=True):
            proportion = count / total
            axes.barh(place, proportion, left=left, height=2 * _HALF, color=colour, gid=f"{group.code}")
            if proportion > _NARROW:
                look_of_count: Style = {"ha": "center", "va": "center", "color": _text_colour(colour)}
                axes.text(left + proportion / 2, place, str(count), fontproperties=sheet.font(SMALL), **look_of_count)
            left += proportion
    _draw_legend(sheet, list(question.levels.values()), colours)
    return sheet


def _draw_legend(sheet: Sheet, names: list[str], colours: list[str]) -> None:
    """Draw the labels of the scale's ends, and between them the numbered scale points in their colours."""
    y = sheet.height_pt - 12
    _draw_end_labels(sheet, y, names[0], names[-1])
    x = (_LEFT_PT + sheet.width_pt - _RIGHT_PT - _SWATCH_PT * len(colours)) / 2
    for point, colour in enumerate(colours, start=1):
        sheet.box(x, y - 8.5, _SWATCH_PT, 11, colour, rounding=0.5)
        sheet.text(x + _SWATCH_PT / 2, y, str(point), size=SMALL, colour=_text_colour(colour), ha="center")
        x += _SWATCH_PT


_RATINGS: Final = _QuestionFigure(
    id="rating",
    draw=draw_ratings,
    caption="Each bar shows the proportion of answers at each point of the scale; labels show the number of answers.",
)


_FIGURES: Final = {figure.id: figure for figure in (_RATINGS, _OPTIONS, _DISTRIBUTION)}
"""All figures by the ID with which a kind of question selects one."""


def question_figure_tasks(
    study: Study, results: Sequence[QuestionResult], forms: Sequence[str] = style.FORMATS
) -> Iterator[FigureTask]:
    """Yield the figure of every answered question that has one, to draw in each of ``forms``.

    Blocks of levels have their own figures once the key is open.
    """
    level_blocks = {block.id for block in study.levels if block.design.adjusts or study.revealed}
    for question, result in zip(study.others.questions, results, strict=True):
        if result.figure is not None and result.n and result.where not in level_blocks:
            name = f"question-{result.where}-{result.item}"
            yield result.where, name, partial(_picture, study, question, result, forms, name)


def _picture(
    study: Study, question: PlacedQuestion, result: QuestionResult, forms: Sequence[str], name: str
) -> Picture:
    figure = by_name(_FIGURES, result.figure or "")
    title = result.short if result.short == result.title else f"{result.title}: {result.short}"
    is_repeated = any(int(group.numbers["n"]) > int(group.numbers["participants"]) for group in result.groups)
    drawn = figure.repeated if is_repeated and figure.repeated else figure.caption
    caption = f"{result.title}: “{result.text}” {drawn} {sample_text(study, study.n)}"
    rows = study.answers_to(question)[["participant", "session", "code", "response"]].rename(
        columns={"response": question.id}
    )
    numbers = tab_separated(study, rows.dropna(axis="columns", how="all"))
    draw = partial(figure.draw, question, result)
    return picture_of(study, result.where, name, title, caption, draw, forms, numbers=numbers)
