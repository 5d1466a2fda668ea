"""Figures over delay: answers, the detection threshold, and motion."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.analysis.data.measures import LEVELS, Array, quartiles
from study_app.analysis.figures.page_layout import MARGIN_PT, Look, Sheet, Style
from study_app.analysis.statistics.thresholds import Threshold
from study_app.psychophysics.families import success

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


@style.own_settings()
def draw_answers(
    plots: Sequence[tuple[str, Array]],
    settings: Sequence[str],
    delays_ms: Sequence[float] | None,
    lowest_ms: Sequence[float | None],
    foot: str,
    look: Look,
) -> Sheet:
    """Draw statements over delay, or, without ``delays_ms``, over the settings' codes.

    Over delay (true scale, ascending): a thin line per participant (of many: of some), quartile band, thick median.
    Over codes, whose order says nothing: a dot per participant, quartile band, median ring, and no line. ``plots`` are
    short texts and answers (participants, settings), ``lowest_ms`` the lowest delays at which a trend shows.
    """
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, look.fonts)
    columns = min(len(plots), PLOTS_A_ROW)
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - SCALE_PT - 6 - (columns - 1) * ANSWERS_GAP_PT) / columns
    titles = [ruler.wrap(title, width, TITLE_SIZE, "bold") for title, _ in plots]
    title_pt = max(map(len, titles)) * TITLE_LINE_PT
    rows = -(-len(plots) // PLOTS_A_ROW)
    row_pt = title_pt + 6 + ANSWERS_PT + 14
    sheet = look.sheet(ANSWERS_TOP_PT + rows * row_pt + (rows - 1) * 6 + ANSWERS_FOOT_PT)
    legend(sheet, lines=delays_ms is not None)
    for place, (_, values) in enumerate(plots):
        row, column = divmod(place, PLOTS_A_ROW)
        x = MARGIN_PT + SCALE_PT + column * (width + ANSWERS_GAP_PT)
        top = ANSWERS_TOP_PT + row * (row_pt + 6)
        for number, line in enumerate(titles[place]):
            sheet.text(x, top + 6.5 + number * TITLE_LINE_PT, line, size=TITLE_SIZE, weight="bold")
        axes = sheet.axes(x, top + title_pt + 6, width, ANSWERS_PT)
        axes.set_label(f"item{place + 1}")
        axes.set_ylim(BOTTOM, TOP)
        sheet.scale(axes, "y", LEVELS, LEVELS if column == 0 else (), lines=True)
        if delays_ms is not None:
            over_delay(sheet, axes, values, np.asarray(delays_ms, dtype=float), SPREAD)
            _lowest(sheet, axes, lowest_ms[place], float(np.mean(delays_ms)))
        else:
            _over_codes(sheet, axes, values, settings, width)
        counts = (~np.isnan(values)).sum(axis=0)
        if (counts < len(values)).any():  # not every participant answered at every setting
            low, high = int(counts.min()), int(counts.max())
            words = f"n {low}" if low == high else f"n {low}–{high}"
            where: Style = {"transform": axes.transAxes, "ha": "right", "va": "bottom"}
            axes.text(1, 1.0, words, fontproperties=sheet.font(5.8), color=style.TEXT_SOFT, **where)
    sheet.text(MARGIN_PT + SCALE_PT, sheet.height_pt - 6, foot, size=6.5, colour=style.TEXT_SOFT)
    return sheet


def over_delay(sheet: Sheet, axes: Axes, values: Array, delays_ms: Array, spread: float) -> None:
    """Draw (participants, delays) values: thin lines at most ``spread`` apart, band and thick median of all."""
    low, high = float(delays_ms.min()), float(delays_ms.max())
    reach = (high - low) or 1.0
    axes.set_xlim(low - 0.06 * reach, high + 0.06 * reach)
    sheet.scale(axes, "x", round_ticks(low, high, low, high))
    shown = lines_of(len(values))
    offsets = np.linspace(-spread / 2, spread / 2, len(shown)) if len(shown) > 1 else np.zeros(1)
    thin: Style = {
        "alpha": 0.75 if len(values) <= 15 else 0.45,
        "linewidth": 0.45,
        "markersize": 0.9,
        "markeredgewidth": 0,
    }
    for place, offset in zip(shown, offsets, strict=True):
        name = f"{axes.get_label()}-participant{place + 1}"
        axes.plot(delays_ms, values[place] + offset, "o-", color=style.PARTICIPANT, zorder=2, gid=name, **thin)
    q1, median, q3 = (np.array(side) for side in zip(*(quartiles(column) for column in values.T), strict=True))
    band = axes.fill_between(delays_ms, q1, q3, color=style.BAND, alpha=0.85, linewidth=0, zorder=1)
    band.set_gid(f"{axes.get_label()}-quartiles")
    thick: Style = {"linewidth": 1.6, "markersize": 3.6, "markerfacecolor": "white", "markeredgewidth": 1.0}
    axes.plot(delays_ms, median, "o-", color=style.ACCENT, zorder=4, gid=f"{axes.get_label()}-median", **thick)


def round_ticks(low: float, high: float, least: float, most: float) -> list[float]:
    """Return round numbers for an axis from ``low`` to ``high``, of those from ``least`` to ``most``."""
    ticks = MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return [float(tick) for tick in ticks if least <= tick <= most]


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
    dashed: Style = {"linewidth": 0.9, "linestyle": (0, (3, 2)), "zorder": 3, "gid": f"{axes.get_label()}-lowest"}
    axes.axvline(lowest_ms, color=style.TEXT, **dashed)
    across, side = (-2, "right") if lowest_ms > middle_ms else (2, "left")
    look: Style = {"ha": side, "fontproperties": sheet.font(6, "bold"), "color": style.TEXT}
    axes.annotate(f"≤ {lowest_ms:g}", (lowest_ms, TOP), xytext=(across, -6), textcoords="offset points", **look)


def _over_codes(sheet: Sheet, axes: Axes, values: Array, codes: Sequence[str], width_pt: float) -> None:
    axes.set_xlim(-0.6, len(codes) - 0.4)
    slot_pt = width_pt / (len(codes) + 0.2)
    crowded = max(sheet.text_width(code, 6.5) for code in codes) > slot_pt - 1
    axes.set_xticks(range(len(codes)), codes, fontproperties=sheet.font(6.5), rotation=90 if crowded else 0)
    ring: Style = {"markersize": 2.8, "markerfacecolor": "white", "markeredgewidth": 0.9}
    dots: Style = {"markersize": DOT_PT - 0.2, "markeredgewidth": 0}
    for place, column in enumerate(values.T):
        q1, median, q3 = quartiles(column)
        axes.fill_between((place + 0.18, place + 0.42), q1, q3, color=style.BAND, linewidth=0, zorder=1)
        axes.plot(place + 0.3, median, "o-", color=style.ACCENT, zorder=3, **ring)
        xs, ys = _beside_each_other(column, max(1, int(0.6 * slot_pt / DOT_PT)))
        name = f"{axes.get_label()}-{codes[place]}"
        axes.plot(place - 0.18 + xs * DOT_PT / slot_pt, ys, "o", color=style.AXIS, zorder=2, gid=name, **dots)


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


def legend(sheet: Sheet, *, lines: bool) -> None:
    """Write at the right, under the heading, what median, band and single marks are."""
    words = ("median", "middle half (IQR)", "one participant")
    y, x = 30.0, sheet.width_pt - MARGIN_PT + 12 - sum(sheet.text_width(word, 7) + 30 for word in words)
    middle = y - 2.4
    ring: Style = {"marker": "o", "markersize": 3.2, "markerfacecolor": "white", "markeredgewidth": 0.9}
    dot: Style = {"marker": "o", "markersize": DOT_PT, "markeredgewidth": 0}
    for word in words:
        if word == "middle half (IQR)":
            sheet.box(x, y - 6.2, 14, 7.6, style.BAND)
        elif lines:
            colour, width = (style.ACCENT, 1.6) if word == "median" else (style.PARTICIPANT, 0.6)
            sheet.line((x, x + 14), (middle, middle), color=colour, linewidth=width)
        else:
            colour, marker = (style.ACCENT, ring) if word == "median" else (style.AXIS, dot)
            sheet.line((x + 8,), (middle,), color=colour, **marker)
        sheet.text(x + 18, y, word, size=7, colour=style.TEXT_SOFT)
        x += sheet.text_width(word, 7) + 30


CURVE_LEFT_PT: Final = 30.0
CURVE_FOOT_PT: Final = 30.0
HEIGHT_PT: Final = 190.0
CURVE_TOP_PT: Final = 34.0
RIGHT_PT: Final = 26.0


@style.own_settings()
def draw_threshold(found: Threshold, lowest_ms: float | None, look: Look) -> Sheet:
    """Draw shares as dots, the curve, its threshold with the interval, and dashed the lowest delay with a trend."""
    sheet = look.sheet(HEIGHT_PT, style.PAGE_WIDTH_PT / 2)
    room = (sheet.width_pt - CURVE_LEFT_PT - RIGHT_PT, sheet.height_pt - CURVE_TOP_PT - CURVE_FOOT_PT)
    axes = sheet.axes(MARGIN_PT + CURVE_LEFT_PT, CURVE_TOP_PT, *room)
    levels, asked = np.array(found.levels), np.array(found.asked)
    span = float(np.ptp(levels)) or 1.0
    axes.set_xlim(levels.min() - 0.04 * span, levels.max() + 0.04 * span)
    axes.set_ylim(-0.04, 1.04)
    sheet.scale(axes, "y", (0.0, 0.5, 1.0), [f"{share:.0%}" for share in (0.0, 0.5, 1.0)], lines=True)
    sheet.scale(axes, "x", levels)
    if lowest_ms is not None:
        axes.axvline(lowest_ms, color=style.TEXT_SOFT, linewidth=0.8, dashes=(3, 2), gid="lowest")
    if found.effect is not None and found.width is not None and found.guess is not None and found.lapse is not None:
        xs = np.linspace(levels.min(), levels.max(), 200)
        shares = success("logistic", xs, found.effect, found.width, found.guess, found.lapse)
        axes.plot(xs, shares, color=style.ACCENT, linewidth=1.4, gid="curve")
        half = (1 + found.guess - found.lapse) / 2
        if found.interval is not None:
            ends = [found.interval.low, found.interval.high]
            axes.plot(ends, [half, half], color=style.BAND, linewidth=4, solid_capstyle="butt", gid="interval")
        axes.plot([found.effect], [half], marker="D", markersize=4, color=style.ACCENT, gid="threshold")
    there = asked > 0
    shares = np.array(found.yes)[there] / asked[there]
    dots: Style = {"markersize": 4, "markerfacecolor": "white", "markeredgecolor": style.TEXT, "gid": "shares"}
    axes.plot(levels[there], shares, "o", **dots)
    sheet.text(MARGIN_PT, sheet.height_pt - 5, "Added delay, ms", size=6.5, colour=style.TEXT_SOFT)
    return sheet


MOVEMENT_PT: Final = 104.0
MOVEMENT_TOP_PT: Final = 40.0
TITLE_PT: Final = 16.0
MOVEMENT_GAP_PT: Final = 30.0
MOVEMENT_LEFT_PT: Final = 24.0
MOVEMENT_FOOT_PT: Final = 32.0


@style.own_settings()
def draw_movement(plots: Sequence[tuple[str, Array]], delays_ms: Sequence[float], foot: str, look: Look) -> Sheet:
    """Draw measures (their title with the unit, and (participants, delays) values) on scales that begin where these do.

    NaN is a value that is missing.
    """
    columns = len(plots)
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - MOVEMENT_LEFT_PT - (columns - 1) * MOVEMENT_GAP_PT) / columns
    sheet = look.sheet(MOVEMENT_TOP_PT + TITLE_PT + MOVEMENT_PT + MOVEMENT_FOOT_PT)
    legend(sheet, lines=True)
    for place, (title, values) in enumerate(plots):
        x = MARGIN_PT + MOVEMENT_LEFT_PT + place * (width + MOVEMENT_GAP_PT)
        sheet.text(x, MOVEMENT_TOP_PT + 8, title, size=7.5, weight="bold")
        axes = sheet.axes(x, MOVEMENT_TOP_PT + TITLE_PT, width, MOVEMENT_PT)
        axes.set_label(f"measure{place + 1}")
        there = values[~np.isnan(values)]
        low, high = (float(there.min()), float(there.max())) if len(there) else (0.0, 0.0)
        room = 0.08 * (high - low) or 0.5
        axes.set_ylim(low - room, high + room)
        ticks = round_ticks(low - room, high + room, max(0.0, low - room), high + room) if high > low else [low]
        sheet.scale(axes, "y", ticks, [f"{tick:.3g}" for tick in ticks], lines=True)
        over_delay(sheet, axes, values, np.asarray(delays_ms, dtype=float), 0.0)
    sheet.text(MARGIN_PT + MOVEMENT_LEFT_PT, sheet.height_pt - 6, foot, size=6.5, colour=style.TEXT_SOFT)
    return sheet
