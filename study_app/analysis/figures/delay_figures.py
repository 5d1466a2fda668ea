"""Figures over delay: answers, the detection threshold, and motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.analysis.data.measures import LEVELS, Array, quartiles
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.analysis.statistics.psychometrics import Curve, Threshold, share

PLOTS_A_ROW: Final = 5
ANSWERS_PT: Final = 112.0
TITLE_SIZE: Final = 7.5
TITLE_LINE_PT: Final = 9.0
ANSWERS_GAP_PT: Final = 11.0
SCALE_PT: Final = 13.0
ANSWERS_TOP_PT: Final = 40.0
ANSWERS_FOOT_PT: Final = 17.0
BOTTOM: Final = 0.55
TOP: Final = 7.5
LEVEL_PT: Final = ANSWERS_PT / (TOP - BOTTOM)
DOT_PT: Final = 1.8
MOST_LINES: Final = 60
"""Of more participants so many are drawn: more lines hide the median and the band."""

SPREAD: Final = 0.24
"""Height over which coinciding lines of participants are drawn apart [levels]."""


@dataclass(frozen=True, slots=True)
class Plot:
    """One statement: its short text and (participants, settings) answers, NaN where there is none.

    ``lowest_ms`` is the lowest delay at which a trend shows, where one does.
    """

    title: str
    values: Array
    lowest_ms: float | None = None


@style.own_settings()
def draw_answers(
    plots: Sequence[Plot],
    settings: Sequence[str],
    delays_ms: Sequence[float] | None,
    *,
    title: str,
    marks: Sequence[Mark],
    counts: Sequence[str],
    foot: str,
    fonts: Sequence[str],
) -> Sheet:
    """Draw the statements over delay, or, without ``delays_ms``, over the settings' codes.

    Over delay (true scale, ascending): a thin line per participant (of many: of some), quartile band, thick median.
    Over codes, whose order says nothing: a dot per participant, quartile band, median ring, and no line.
    """
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, fonts)
    columns = min(len(plots), PLOTS_A_ROW)
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - SCALE_PT - 6 - (columns - 1) * ANSWERS_GAP_PT) / columns
    titles = [ruler.wrap(plot.title, width, TITLE_SIZE, "bold") for plot in plots]
    title_pt = max(map(len, titles)) * TITLE_LINE_PT
    rows = -(-len(plots) // PLOTS_A_ROW)
    row_pt = title_pt + 6 + ANSWERS_PT + 14
    sheet = Sheet(style.PAGE_WIDTH_PT, ANSWERS_TOP_PT + rows * row_pt + (rows - 1) * 6 + ANSWERS_FOOT_PT, fonts)
    sheet.heading(title, marks, counts)
    legend(sheet, lines=delays_ms is not None)
    for place, plot in enumerate(plots):
        row, column = divmod(place, PLOTS_A_ROW)
        x = MARGIN_PT + SCALE_PT + column * (width + ANSWERS_GAP_PT)
        top = ANSWERS_TOP_PT + row * (row_pt + 6)
        for number, line in enumerate(titles[place]):
            sheet.text(x, top + 6.5 + number * TITLE_LINE_PT, line, size=TITLE_SIZE, weight="bold")
        axes = sheet.axes(x, top + title_pt + 6, width, ANSWERS_PT)
        axes.set_label(f"item{place + 1}")
        _levels(sheet, axes, numbers=column == 0)
        if delays_ms is not None:
            over_delay(sheet, axes, plot.values, np.asarray(delays_ms, dtype=float), SPREAD)
            _lowest(sheet, axes, plot.lowest_ms, float(np.mean(delays_ms)))
        else:
            _over_codes(sheet, axes, plot.values, settings, width)
        _counts(sheet, axes, plot.values)
    sheet.text(MARGIN_PT + SCALE_PT, sheet.height_pt - 6, foot, size=6.5, colour=style.TEXT_SOFT)
    return sheet


def _levels(sheet: Sheet, axes: Axes, *, numbers: bool) -> None:
    axes.set_ylim(BOTTOM, TOP)
    for level in LEVELS:
        axes.axhline(level, color=style.GRID, linewidth=0.6, zorder=0)
    if numbers:
        axes.set_yticks(LEVELS, [str(level) for level in LEVELS], fontproperties=sheet.font(6.5))


def over_delay(sheet: Sheet, axes: Axes, values: Array, delays_ms: Array, spread: float) -> None:
    """Draw (participants, delays) values: thin lines at most ``spread`` apart, band and thick median of all."""
    reach = float(np.ptp(delays_ms)) or 1.0
    axes.set_xlim(delays_ms.min() - 0.06 * reach, delays_ms.max() + 0.06 * reach)
    ticks = MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]).tick_values(delays_ms.min(), delays_ms.max())
    ticks = [tick for tick in ticks if delays_ms.min() <= tick <= delays_ms.max()]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontproperties=sheet.font(6.5))
    shown = lines_of(len(values))
    offsets = np.linspace(-spread / 2, spread / 2, len(shown)) if len(shown) > 1 else np.zeros(1)
    for place, offset in zip(shown, offsets, strict=True):
        (drawn,) = axes.plot(
            delays_ms,
            values[place] + offset,
            color=style.PARTICIPANT,
            alpha=0.75 if len(values) <= 15 else 0.45,
            linewidth=0.45,
            marker="o",
            markersize=0.9,
            markeredgewidth=0,
            zorder=2,
        )
        drawn.set_gid(f"{axes.get_label()}-participant{place + 1}")
    q1, median, q3 = (np.array(side) for side in zip(*(quartiles(column) for column in values.T), strict=True))
    band = axes.fill_between(delays_ms, q1, q3, color=style.BAND, alpha=0.85, linewidth=0, zorder=1)
    band.set_gid(f"{axes.get_label()}-quartiles")
    (drawn,) = axes.plot(
        delays_ms,
        median,
        color=style.ACCENT,
        linewidth=1.6,
        marker="o",
        markersize=3.6,
        markerfacecolor="white",
        markeredgewidth=1.0,
        zorder=4,
    )
    drawn.set_gid(f"{axes.get_label()}-median")


def lines_of(participants: int) -> list[int]:
    """Return the places of the participants who are drawn as lines: all of few, of many an even choice."""
    if participants <= MOST_LINES:
        return list(range(participants))
    return [int(place) for place in np.linspace(0, participants - 1, MOST_LINES).round()]


def line_words(participants: int) -> str:
    """Return whom the thin lines are, for a caption."""
    if participants <= MOST_LINES:
        return "participants"
    return f"{MOST_LINES} of the {participants} participants, evenly chosen in the order of their ids"


def _lowest(sheet: Sheet, axes: Axes, lowest_ms: float | None, middle_ms: float) -> None:
    """Mark the lowest delay at which a trend shows: dashed, with its number on the side that has more room."""
    if lowest_ms is None:
        return
    line = axes.axvline(lowest_ms, color=style.TEXT, linewidth=0.9, linestyle=(0, (3, 2)), zorder=3)
    line.set_gid(f"{axes.get_label()}-lowest")
    left = lowest_ms > middle_ms
    axes.annotate(
        f"≤ {lowest_ms:g}",
        (lowest_ms, TOP),
        xytext=(-2 if left else 2, -6),
        textcoords="offset points",
        ha="right" if left else "left",
        fontproperties=sheet.font(6, "bold"),
        color=style.TEXT,
    )


def _over_codes(sheet: Sheet, axes: Axes, values: Array, codes: Sequence[str], width_pt: float) -> None:
    axes.set_xlim(-0.6, len(codes) - 0.4)
    slot_pt = width_pt / (len(codes) + 0.2)
    crowded = max(sheet.text_width(code, 6.5) for code in codes) > slot_pt - 1
    axes.set_xticks(range(len(codes)), codes, fontproperties=sheet.font(6.5), rotation=90 if crowded else 0)
    for place, column in enumerate(values.T):
        q1, median, q3 = quartiles(column)
        axes.fill_between((place + 0.18, place + 0.42), q1, q3, color=style.BAND, linewidth=0, zorder=1)
        axes.plot(
            place + 0.3,
            median,
            color=style.ACCENT,
            marker="o",
            markersize=2.8,
            markerfacecolor="white",
            markeredgewidth=0.9,
            zorder=3,
        )
        xs, ys = _beside_each_other(column, max(1, int(0.6 * slot_pt / DOT_PT)))
        (dots,) = axes.plot(
            place - 0.18 + xs * DOT_PT / slot_pt,
            ys,
            linestyle="none",
            marker="o",
            markersize=DOT_PT - 0.2,
            color=style.AXIS,
            markeredgewidth=0,
            zorder=2,
        )
        dots.set_gid(f"{axes.get_label()}-{codes[place]}")


def _beside_each_other(values: Array, across: int) -> tuple[Array, Array]:
    """Lay equal answers out in rows of ``across`` around their level: x in dots from the middle, y in levels."""
    xs: list[float] = []
    ys: list[float] = []
    for value in np.unique(values[~np.isnan(values)]):
        count = int((values == value).sum())
        rows = -(-count // across)
        pitch = min(DOT_PT / LEVEL_PT, 0.84 / max(rows - 1, 1))
        for row in range(rows):
            here = min(across, count - row * across)
            xs += [number - (here - 1) / 2 for number in range(here)]
            ys += [float(value) + (row - (rows - 1) / 2) * pitch] * here
    return np.array(xs), np.array(ys)


def _counts(sheet: Sheet, axes: Axes, values: Array) -> None:
    """Write the numbers of answers where not every participant answered at every setting."""
    counts = (~np.isnan(values)).sum(axis=0)
    if (counts == len(values)).all():
        return
    low, high = int(counts.min()), int(counts.max())
    axes.text(
        1,
        1.0,
        f"n {low}" if low == high else f"n {low}–{high}",
        transform=axes.transAxes,
        fontproperties=sheet.font(5.8),
        color=style.TEXT_SOFT,
        ha="right",
        va="bottom",
    )


def legend(sheet: Sheet, *, lines: bool) -> None:
    """Write at the right, under the heading, what median, band and single marks are."""
    words = ("median", "middle half (IQR)", "one participant")
    y, x = 30.0, sheet.width_pt - MARGIN_PT + 12 - sum(sheet.text_width(word, 7) + 30 for word in words)
    middle = y - 2.4
    for word in words:
        if word == "middle half (IQR)":
            sheet.box(x, y - 6.2, 14, 7.6, style.BAND)
        elif lines:
            colour, width = (style.ACCENT, 1.6) if word == "median" else (style.PARTICIPANT, 0.6)
            sheet.line((x, x + 14), (middle, middle), color=colour, linewidth=width)
        elif word == "median":
            sheet.line(
                (x + 8,),
                (middle,),
                color=style.ACCENT,
                marker="o",
                markersize=3.2,
                markerfacecolor="white",
                markeredgewidth=0.9,
            )
        else:
            sheet.line((x + 8,), (middle,), color=style.AXIS, marker="o", markersize=DOT_PT, markeredgewidth=0)
        sheet.text(x + 18, y, word, size=7, colour=style.TEXT_SOFT)
        x += sheet.text_width(word, 7) + 30


CURVE_LEFT_PT: Final = 30.0
CURVE_FOOT_PT: Final = 30.0
HEIGHT_PT: Final = 190.0
CURVE_TOP_PT: Final = 34.0
RIGHT_PT: Final = 26.0


@style.own_settings()
def draw_threshold(
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
        MARGIN_PT + CURVE_LEFT_PT,
        CURVE_TOP_PT,
        sheet.width_pt - CURVE_LEFT_PT - RIGHT_PT,
        sheet.height_pt - CURVE_TOP_PT - CURVE_FOOT_PT,
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


MOVEMENT_PT: Final = 104.0
MOVEMENT_TOP_PT: Final = 40.0
TITLE_PT: Final = 16.0
MOVEMENT_GAP_PT: Final = 30.0
MOVEMENT_LEFT_PT: Final = 24.0
MOVEMENT_FOOT_PT: Final = 32.0


@dataclass(frozen=True, slots=True)
class Measured:
    """One measure: its title with the unit, and (participants, delays) values, NaN where there is none."""

    title: str
    values: Array


@style.own_settings()
def draw_movement(
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
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - MOVEMENT_LEFT_PT - (columns - 1) * MOVEMENT_GAP_PT) / columns
    sheet = Sheet(style.PAGE_WIDTH_PT, MOVEMENT_TOP_PT + TITLE_PT + MOVEMENT_PT + MOVEMENT_FOOT_PT, fonts)
    sheet.heading(title, marks, counts)
    legend(sheet, lines=True)
    for place, plot in enumerate(plots):
        x = MARGIN_PT + MOVEMENT_LEFT_PT + place * (width + MOVEMENT_GAP_PT)
        sheet.text(x, MOVEMENT_TOP_PT + 8, plot.title, size=7.5, weight="bold")
        axes = sheet.axes(x, MOVEMENT_TOP_PT + TITLE_PT, width, MOVEMENT_PT)
        axes.set_label(f"measure{place + 1}")
        _scale(sheet, axes, plot.values)
        over_delay(sheet, axes, plot.values, np.asarray(delays_ms, dtype=float), 0.0)
    sheet.text(MARGIN_PT + MOVEMENT_LEFT_PT, sheet.height_pt - 6, foot, size=6.5, colour=style.TEXT_SOFT)
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
