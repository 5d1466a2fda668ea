"""Figures of answers to statements, with their captions: by setting, against delay, and of recognition.

Bars of disagreement extend to the left of a line and bars of agreement to the right. Neutral answers have a separate
column on the same scale; if they were centred on the line, half of them would look like disagreement.

In the confusion matrix, darker cells have larger counts; every cell shows its count, so nothing depends on colour.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Final

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from study_app import figure_style as style
from study_app.analysis.data.blocks import Block
from study_app.analysis.data.measures import COUNT_COLUMNS, LEVELS, NEUTRAL, QUARTILES, Array, by_participant, quartiles
from study_app.analysis.data.study_tables import Study, groups_shown
from study_app.analysis.figures.people_figures import WIDTH_PT
from study_app.analysis.page_layout import MARGIN_PT, SMALL, Look, Picture, Sheet, Style, picture_of, tab_separated
from study_app.analysis.statistics.thresholds import Threshold
from study_app.analysis.wording import with_group
from study_app.errors import AnalysisError
from study_app.number_text import counted
from study_app.psychophysics.families import success

_PLOTS_A_ROW: Final = 5
_ANSWERS_PT: Final = 112.0
_TITLE_SIZE: Final = 7.5
_TITLE_LINE_PT: Final = 9.0
_ANSWERS_GAP_PT: Final = 11.0
_SCALE_PT: Final = 13.0
_OWN_SCALE_PT: Final = 26.0
_ANSWERS_TOP_PT: Final = 40.0
_ANSWERS_FOOT_PT: Final = 17.0
_BOTTOM: Final = 0.55
_TOP: Final = 7.5
MOST_LINES: Final = 60
"""The most participants drawn as lines; more lines would hide the median and the band."""

_SPREAD: Final = 0.24
"""Total vertical offset between participants' lines, so that equal answers do not coincide [levels]."""


@style.own_settings()
def draw_answers(
    plots: Sequence[tuple[str, Array]],
    delays_ms: Sequence[float],
    lowest_ms: Sequence[float | None],
    foot: str,
    look: Look,
    *,
    own_scales: Sequence[Array] = (),
) -> Sheet:
    """Draw answers against delay: thin lines for participants, a band of quartiles, and a thick line for the median.

    ``plots`` are titles and answers (participants, delays); ``lowest_ms`` are the lowest delays with a trend. With
    ``own_scales``, the plots show measures, each on the scale of its own array of values.
    """
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, look.fonts)
    columns = min(len(plots), _PLOTS_A_ROW)
    scale_pt, gap_pt = (_OWN_SCALE_PT, _OWN_SCALE_PT) if own_scales else (_SCALE_PT, _ANSWERS_GAP_PT)
    width = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - scale_pt - 6 - (columns - 1) * gap_pt) / columns
    titles = [ruler.wrap(title, width, _TITLE_SIZE, "bold") for title, _ in plots]
    title_pt = max(map(len, titles)) * _TITLE_LINE_PT
    rows = -(-len(plots) // _PLOTS_A_ROW)
    row_pt = title_pt + 6 + _ANSWERS_PT + 14
    sheet = look.sheet(_ANSWERS_TOP_PT + rows * row_pt + (rows - 1) * 6 + _ANSWERS_FOOT_PT)
    _draw_line_legend(sheet)
    for place, (_, values) in enumerate(plots):
        row, column = divmod(place, _PLOTS_A_ROW)
        x = MARGIN_PT + scale_pt + column * (width + gap_pt)
        top = _ANSWERS_TOP_PT + row * (row_pt + 6)
        for number, line in enumerate(titles[place]):
            sheet.text(x, top + 6.5 + number * _TITLE_LINE_PT, line, size=_TITLE_SIZE, weight="bold")
        axes = sheet.axes(x, top + title_pt + 6, width, _ANSWERS_PT)
        axes.set_label(f"item{place + 1}")
        if own_scales:
            _set_scale(sheet, axes, own_scales[place])
        else:
            axes.set_ylim(_BOTTOM, _TOP)
            sheet.scale(axes, "y", LEVELS, LEVELS if column == 0 else (), lines=True)
        _draw_over_delay(sheet, axes, values, np.asarray(delays_ms, dtype=float), 0.0 if own_scales else _SPREAD)
        _draw_lowest_delay(sheet, axes, lowest_ms[place], float(np.mean(delays_ms)))
        counts = (~np.isnan(values)).sum(axis=0)
        if (counts < len(values)).any():  # not every participant answered at every setting
            low, high = int(counts.min()), int(counts.max())
            words = f"n {low}" if low == high else f"n {low}–{high}"
            where: Style = {"transform": axes.transAxes, "ha": "right", "va": "bottom"}
            axes.text(1, 1.0, words, fontproperties=sheet.font(SMALL), color=style.TEXT_SOFT, **where)
    sheet.text(MARGIN_PT + scale_pt, sheet.height_pt - 6, foot, size=SMALL, colour=style.TEXT_SOFT)
    return sheet


def _set_scale(sheet: Sheet, axes: Axes, values: Array) -> None:
    """Set the axis limits to the range of all values without NaN."""
    low, high = (float(np.nanmin(values)), float(np.nanmax(values))) if not np.isnan(values).all() else (0.0, 0.0)
    margin = 0.08 * (high - low) or 0.5
    axes.set_ylim(low - margin, high + margin)
    candidates = MaxNLocator(nbins=4).tick_values(low, high) if high > low else [low]
    ticks = [float(tick) for tick in candidates if low - margin <= tick <= high + margin]
    sheet.scale(axes, "y", ticks, [f"{tick:.3g}" for tick in ticks], lines=True)


def _draw_over_delay(sheet: Sheet, axes: Axes, values: Array, delays_ms: Array, spread: float) -> None:
    """Draw values (participants, delays): thin lines with offsets of ``spread`` in all, band, and thick median."""
    low, high = float(delays_ms.min()), float(delays_ms.max())
    span = (high - low) or 1.0
    axes.set_xlim(low - 0.06 * span, high + 0.06 * span)
    ticks = MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    sheet.scale(axes, "x", [float(tick) for tick in ticks if low <= tick <= high])
    drawn = _drawn_participants(len(values))
    offsets = np.linspace(-spread / 2, spread / 2, len(drawn)) if len(drawn) > 1 else np.zeros(1)
    thin: Style = {
        "alpha": 0.75 if len(values) <= 15 else 0.45,
        "linewidth": 0.45,
        "markersize": 0.9,
        "markeredgewidth": 0,
    }
    for place, offset in zip(drawn, offsets, strict=True):
        name = f"{axes.get_label()}-participant{place + 1}"
        axes.plot(delays_ms, values[place] + offset, "o-", color=style.PARTICIPANT, zorder=2, gid=name, **thin)
    of_delays = [quartiles(column) for column in values.T]
    q1, q3 = [at_delay.q1 for at_delay in of_delays], [at_delay.q3 for at_delay in of_delays]
    band = axes.fill_between(delays_ms, q1, q3, color=style.BAND, alpha=0.85, linewidth=0, zorder=1)
    band.set_gid(f"{axes.get_label()}-quartiles")
    thick: Style = {"linewidth": 1.6, "markersize": 3.6, "markerfacecolor": "white", "markeredgewidth": 1.0}
    medians = [at_delay.median for at_delay in of_delays]
    axes.plot(delays_ms, medians, "o-", color=style.ACCENT, zorder=4, gid=f"{axes.get_label()}-median", **thick)


def _drawn_participants(participants: int) -> list[int]:
    """Return the indices of the participants drawn as lines: all if they are few, otherwise an even selection."""
    if participants <= MOST_LINES:
        return list(range(participants))
    return [int(place) for place in np.linspace(0, participants - 1, MOST_LINES).round()]


def line_text(participants: int) -> str:
    """Return the caption's description of the thin lines."""
    if participants <= MOST_LINES:
        return "participants"
    return f"{MOST_LINES} of the {participants} participants, selected at regular intervals from the sorted IDs"


def _draw_lowest_delay(sheet: Sheet, axes: Axes, lowest_ms: float | None, middle_ms: float) -> None:
    """Mark the shortest delay with a trend by a dashed line, with its value on the side with more space."""
    if lowest_ms is None:
        return
    dashed: Style = {"linewidth": 0.9, "linestyle": (0, (3, 2)), "zorder": 3, "gid": f"{axes.get_label()}-lowest"}
    axes.axvline(lowest_ms, color=style.TEXT, **dashed)
    across, side = (-2, "right") if lowest_ms > middle_ms else (2, "left")
    look: Style = {"ha": side, "fontproperties": sheet.font(SMALL, "bold"), "color": style.TEXT}
    axes.annotate(f"≤ {lowest_ms:g}", (lowest_ms, _TOP), xytext=(across, -7), textcoords="offset points", **look)


def _draw_line_legend(sheet: Sheet) -> None:
    """Draw the legend of median, band and single lines at the right, below the heading."""
    words = ("median", "middle 50 % (IQR)", "one participant")
    y, x = 30.0, sheet.width_pt - MARGIN_PT + 12 - sum(sheet.text_width(word, SMALL) + 30 for word in words)
    for word in words:
        if word == "middle 50 % (IQR)":
            sheet.box(x, y - 6.2, 14, 7.6, style.BAND)
        else:
            colour, width = (style.ACCENT, 1.6) if word == "median" else (style.PARTICIPANT, 0.6)
            sheet.line((x, x + 14), (y - 2.4, y - 2.4), color=colour, linewidth=width)
        sheet.text(x + 18, y, word, size=SMALL, colour=style.TEXT_SOFT)
        x += sheet.text_width(word, SMALL) + 30


_PLASTIC: Final = (0.7548776662, 0.5698402910)
"""Steps of a sequence that spreads points evenly in a plane (Roberts 2018)."""
_PERSON_SPREAD: Final = 0.5
"""Largest distance between participants' points at one delay, as a proportion of the distance between delays."""
_CURVE_LEFT_PT: Final = 30.0
_CURVE_FOOT_PT: Final = 30.0
_CURVE_LINE_PT: Final = 9.0
_HEIGHT_PT: Final = 120.0
_CURVE_TOP_PT: Final = 34.0
_RIGHT_PT: Final = 26.0


@style.own_settings()
def draw_threshold(
    threshold: Threshold, shares_of: Mapping[str, Mapping[float, float]], lowest_ms: float | None, look: Look
) -> Sheet:
    """Draw agreement, the fitted curve, its threshold with interval, and the shortest delay with a trend.

    ``shares_of`` has each participant's proportions by delay, drawn as small points.
    """
    below = (
        "Added delay in ms.   Points: participants; circles: all participants; diamond: threshold with 95 % interval"
        + ("" if lowest_ms is None else "; dashed: shortest delay with a trend")
    )
    lines = Sheet(WIDTH_PT, 72, look.fonts).wrap(below, WIDTH_PT - 2 * MARGIN_PT, SMALL)
    foot_pt = _CURVE_FOOT_PT + _CURVE_LINE_PT * (len(lines) - 1)
    sheet = look.sheet(_HEIGHT_PT + foot_pt, WIDTH_PT)
    room = (sheet.width_pt - _CURVE_LEFT_PT - _RIGHT_PT, _HEIGHT_PT - _CURVE_TOP_PT)
    axes = sheet.axes(MARGIN_PT + _CURVE_LEFT_PT, _CURVE_TOP_PT, *room)
    levels, asked = np.array(threshold.levels), np.array(threshold.asked)
    span = float(np.ptp(levels)) or 1.0
    axes.set_xlim(levels.min() - 0.04 * span, levels.max() + 0.04 * span)
    axes.set_ylim(-0.08, 1.08)
    sheet.scale(axes, "y", (0.0, 0.5, 1.0), [f"{proportion:.0%}" for proportion in (0.0, 0.5, 1.0)], lines=True)
    sheet.scale(axes, "x", levels)
    step = float(np.diff(levels).min()) if len(levels) > 1 else 1.0
    for place, (person, shares_of_person) in enumerate(shares_of.items()):
        x, y = (_PERSON_SPREAD * ((place + 1) * golden % 1 - 0.5) for golden in _PLASTIC)
        points = [(delay + step * x, proportion + 0.12 * y) for delay, proportion in shares_of_person.items()]
        look_of_person: Style = {"color": style.PARTICIPANT, "markersize": 2.2, "markeredgewidth": 0}
        axes.plot(*zip(*points, strict=True), "o", gid=f"person-{person}", **look_of_person)
    if lowest_ms is not None:
        axes.axvline(lowest_ms, color=style.TEXT_SOFT, linewidth=0.8, dashes=(3, 2), gid="lowest")
    half = threshold.half_way
    if half is not None and threshold.effect is not None and threshold.width is not None:
        xs = np.linspace(levels.min(), levels.max(), 200)
        proportions = success(
            "logistic", xs, threshold.effect, threshold.width, threshold.guess or 0.0, threshold.lapse or 0.0
        )
        axes.plot(xs, proportions, color=style.ACCENT, linewidth=1.4, gid="curve")
        if threshold.interval is not None:
            ends = [threshold.interval.low, threshold.interval.high]
            axes.plot(ends, [half, half], color=style.BAND, linewidth=4, solid_capstyle="butt", gid="interval")
        axes.plot([threshold.effect], [half], marker="D", markersize=5, color=style.TEXT, gid="threshold", zorder=4)
        axes.plot([threshold.effect] * 2, [-0.08, half], color=style.TEXT, linewidth=0.8, zorder=3)
        words = f"{threshold.effect:.0f} ms"
        if threshold.interval is not None:
            words += f" [{threshold.interval.low:.0f}, {threshold.interval.high:.0f}]"
        right = threshold.effect < levels.mean()
        ground: Style = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
        where: Style = {"ha": "left" if right else "right", "va": "bottom", "zorder": 5, "bbox": ground}
        at = (threshold.effect, half)
        offset: Style = {"xytext": (6 if right else -6, 5), "textcoords": "offset points"}
        axes.annotate(words, at, fontproperties=sheet.font(8.5, "bold"), color=style.TEXT, **where, **offset)
    was_asked = asked > 0
    proportions = np.array(threshold.yes)[was_asked] / asked[was_asked]
    dots: Style = {"markersize": 4, "markerfacecolor": "white", "markeredgecolor": style.TEXT, "gid": "shares"}
    axes.plot(levels[was_asked], proportions, "o", **dots)
    sheet.text(MARGIN_PT, 28, "Proportion of answers expressing agreement", size=SMALL, colour=style.TEXT_SOFT)
    middle = sheet.height_pt - 5 - _CURVE_LINE_PT * (len(lines) - 1) / 2
    sheet.lines(MARGIN_PT, middle, lines, _CURVE_LINE_PT, size=SMALL, colour=style.TEXT_SOFT)
    return sheet


_FILES: Final = 3
"""Maximum number of named files that have changed since they were recorded."""


def title(block: Block) -> str:
    """Return the title of a block's figure."""
    if block.kind == "delays":
        return "Answers as a function of added delay" if block.revealed else "Answers by condition"
    return f"Agreement for each {_setting_noun(block)}" if block.revealed else "Agreement by condition"


def counts(study: Study, block: Block) -> list[str]:
    """Return texts on n and missing ratings for a block's figure, longest first."""
    people = set(people_by_setting(study, block).values())
    n = len(set(study.answers(block)["participant"]))
    table = study.aggregate(block)
    asked = int(table["presented"].sum())
    lacking = asked - int(table["n"].sum())
    words = f"n = {counted(n, 'participant')}"
    if people != {n} and not study.has_unmatched_sites:
        words = f"n = {_range_text(people)} of {n} participants per {_setting_noun(block)}"
    missing = f", {lacking} of {asked} ratings missing" if lacking else ""
    fewest = str(n) if study.has_unmatched_sites else _range_text(people)
    return [f"{words}{missing}", f"n = {fewest}{missing}"]


def _range_text(values: set[int]) -> str:
    low, high = min(values), max(values)
    return str(low) if low == high else f"{low} to {high}"


def people_by_setting(study: Study, block: Block) -> dict[str, int]:
    """Return the number of participants to whom each setting of a block was presented, by code."""
    rows = _counted_trials(study, block)
    return {code: int(rows.loc[rows["code"] == code, "participant"].nunique()) for code in block.codes}


def _caption(study: Study, block: Block) -> str:
    return " ".join(_caption_sentences(study, block))


def _caption_sentences(study: Study, block: Block) -> Iterator[str]:
    simulated = "simulated participants, not people; " if study.simulated else ""
    yield (
        f"{'Pilot. ' if study.pilot else ''}Agreement with {counted(len(block.items), 'statement')} about "
        f"{counted(study.setting_count(block), _setting_noun(block))} ({simulated}{counts(study, block)[0]})."
    )
    over_delay = block.kind == "delays" and block.revealed
    yield from _marks_of_delays(study, block) if over_delay else _marks_of_bars(block)
    if not study.revealed:
        sites = ", and codes of different sites cannot be matched" if study.sites else ""
        yield f"Conditions appear as codes because the study is blinded; their order has no meaning{sites}."
    trials = _counted_trials(study, block)
    errors = trials["delay_error_mean_ms"].dropna()
    if block.kind == "delays" and block.revealed and len(errors):
        yield (
            f"The axis shows the requested delay; the achieved delay differed from it by {errors.mean():+.1f} "
            f"ms on average (range across trials: {errors.min():+.1f} to {errors.max():+.1f} ms)."
        ).replace("-", "−")
    table = study.aggregate(block)
    yield f"“Cannot judge” answers: {table['cannot_judge'].sum()}; missing answers: {table['missing'].sum()}."
    if study.left_out:
        was = "it was" if study.left_out == 1 else "they were"
        yield f"{counted(study.left_out, 'session is', 'sessions are')} excluded because {was} not completed."
    if study.damaged_sessions:
        yield f"{counted(study.damaged_sessions, 'damaged session is', 'damaged sessions are')} not included."
    if len(rows := study.excluded_sessions):
        yield f"{counted(len(rows), 'session is', 'sessions are')} excluded."
    if len(rows := study.excluded_trials(block)):
        which = counted(len(rows), "trial is", "trials are")
        yield f"{which} excluded, so {'its' if len(rows) == 1 else 'their'} answers are missing here."
    if invalid := int((~trials["valid"].fillna(value=True)).sum()):
        yield f"{invalid} of {len(trials)} trials exceeded the protocol's limits but are included."
    if names := sorted({doubt.path.relative_to(study.folder).as_posix() for doubt in study.doubts if doubt.used}):
        more = f" and {len(names) - _FILES} more" if len(names) > _FILES else ""
        files = counted(len(names), "file is", "files are")
        changed = "it has" if len(names) == 1 else "they have"
        yield f"{files} used although {changed} changed since recording: {', '.join(names[:_FILES])}{more}."


def _marks_of_bars(block: Block) -> Iterator[str]:
    yield (
        "Bars show the number of answers, with disagreement to the left of the line and agreement to the right; "
        "neutral answers are shown separately in grey, on the same scale. Narrow segments are not labelled (the "
        "exported aggregate table contains all counts). If answers are missing, n next to the bar is the number of "
        f"valid answers. The scale points from 1 to 7 are: {', '.join(block.labels)}."
    )


def _marks_of_delays(study: Study, block: Block) -> Iterator[str]:
    yield (
        f"Thin lines: {line_text(len(set(study.answers(block)['participant'])))}, shifted slightly where they "
        f"overlap; thick line: median; band: interquartile range, by {QUARTILES}."
    )
    yield f"Answers range from 1 ({block.labels[0]}) to 7 ({block.labels[-1]})."


def _counted_trials(study: Study, block: Block) -> pd.DataFrame:
    return study.trials[study.trials["counted"] & (study.trials["block"] == block.id)]


def _setting_noun(block: Block) -> str:
    return block.kind.removesuffix("s") if block.revealed else "condition"


_PANELS_A_ROW: Final = 3
_ROW_PT: Final = 19.0
_BAR_PT: Final = 12.4
_LABEL_SIZE: Final = 7.5
_COUNTED: Final = "number of answers"
_WIDEST_ANSWER_PT: Final = 15.0
_PANEL_PADDING_PT: Final = 7.0
_NEUTRAL_GAP_PT: Final = 8.0
_TOP_PT: Final = 52.0
_HEADER_PT: Final = 7.0
_FOOT_PT: Final = 16.0

_DISAGREEMENT: Final = (3, 2, 1)
_AGREEMENT: Final = (5, 6, 7)


@style.own_settings()
def draw_agreement(study: Study, block: Block, look: Look) -> Sheet:
    """Draw one panel per setting with a common axis of statements; one answer has the same width in all panels."""
    tables = [(group, part.aggregate(block)) for group, part in groups_shown(study)]
    panels = [
        (
            setting.code,
            with_group(block.name(setting), group),
            table[table["code"] == setting.code].reset_index(drop=True),
        )
        for setting in block.settings
        for group, table in tables
    ]
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, look.fonts)
    wrapped = [ruler.wrap(item.short, 118, _LABEL_SIZE) for item in block.items]
    label_pt = max(ruler.text_width(line, _LABEL_SIZE) for lines in wrapped for line in lines)
    label_pt = max(label_pt, ruler.text_width(_COUNTED, SMALL))
    most = _PANELS_A_ROW - _PANELS_A_ROW % len(tables) or _PANELS_A_ROW  # the groups of a setting are in one row
    columns = min(len(panels), most)
    panel_pt = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - label_pt - 6) / columns
    widths = _panel_widths([counts for *_, counts in panels], panel_pt - 2 * _PANEL_PADDING_PT)

    rows = -(-len(panels) // columns)
    plot_pt = len(block.items) * _ROW_PT
    row_pt = _HEADER_PT + plot_pt + _FOOT_PT
    sheet = look.sheet(_TOP_PT + rows * row_pt + (rows - 1) * 12)
    left_pt = MARGIN_PT + label_pt + 6
    _draw_level_legend(sheet, block.labels, left_pt)
    for place, (code, name, counts) in enumerate(panels):
        row, column = divmod(place, columns)
        top, x = _TOP_PT + row * (row_pt + 12) + _HEADER_PT, left_pt + column * panel_pt
        if column == 0:
            for number, lines in enumerate(wrapped):
                sheet.lines(MARGIN_PT, top + (number + 0.5) * _ROW_PT + 2.7, lines, 8.4, size=_LABEL_SIZE)
            sheet.text(MARGIN_PT, top + plot_pt + 10, _COUNTED, size=SMALL, colour=style.TEXT_SOFT)
        else:
            sheet.line((x, x), (top - 14, top + plot_pt + 10), color=style.BORDER, linewidth=0.5)
        x += (panel_pt - widths.total) / 2
        _draw_agreement_panel(sheet, code, name, counts, widths, x, top)
    return sheet


@dataclass(frozen=True, slots=True, kw_only=True)
class _PanelWidths:
    """Widths that all panels have [pt]: one answer, both sides of the centre line, neutral column, and n column."""

    answer: float
    left: float
    right: float
    neutral: float
    n: float

    @property
    def total(self) -> float:
        return self.left + self.right + _NEUTRAL_GAP_PT + self.neutral + self.n


def _panel_widths(tables: Sequence[pd.DataFrame], room: float) -> _PanelWidths:
    """Return the widths with the largest width of an answer that fits into ``room``."""
    largest_counts = [
        max(int(table[[f"count_{level}" for level in levels]].sum(axis=1).max()) for table in tables)
        for levels in (_DISAGREEMENT, _AGREEMENT, (NEUTRAL,))
    ]
    n = 17.0 if any(_lacks_answers(table).any() for table in tables) else 0.0
    answer = _WIDEST_ANSWER_PT
    while sum(
        side_widths := [
            max(answer * count, minimum) for count, minimum in zip(largest_counts, (32.0, 26.0, 27.0), strict=True)
        ]
    ) > (room - (_NEUTRAL_GAP_PT + n)):
        answer *= 0.99
    left, right, neutral = side_widths
    return _PanelWidths(answer=answer, left=left, right=right, neutral=neutral, n=n)


def _lacks_answers(counts: pd.DataFrame) -> pd.Series[bool]:
    """Return for each row whether an answer is missing, including answers of excluded trials."""
    return counts["n"] < counts["presented"] + counts["presented_excluded"]


_LEGEND_ROW_PT: Final = 9.5


def _draw_level_legend(sheet: Sheet, labels: Sequence[str], x: float) -> None:
    """Draw the legend of the levels in order, followed by the neutral level as in the panels.

    If the labels are too long for one row, disagreement and agreement have a row each.
    """
    short = _legend_labels(labels)
    size, swatch, gap = SMALL, 7.0, 9.0
    steps = {level: swatch + 4 + sheet.text_width(short[level - 1], size) + gap for level in LEVELS}
    rows = [[*_DISAGREEMENT[::-1], *_AGREEMENT, NEUTRAL]]
    if sum(steps.values()) > sheet.width_pt - 2 * MARGIN_PT:
        rows = [[*_DISAGREEMENT[::-1]], [*_AGREEMENT, NEUTRAL]]
    width = max(sum(steps[level] for level in row) for row in rows)
    left = min(x + _PANEL_PADDING_PT, max(sheet.width_pt - MARGIN_PT - width, MARGIN_PT))
    for number, row in enumerate(rows):
        x, y = left, 26.6 + _LEGEND_ROW_PT * (number - (len(rows) - 1) / 2)
        for level in row:
            if level == NEUTRAL:
                x += gap
            sheet.box(x, y, swatch, swatch, style.LEVEL_COLOURS[level - 1])
            sheet.text(x + swatch + 4, y + 6.1, short[level - 1], size=size, colour=style.TEXT_SOFT)
            x += steps[level]


def _legend_labels(labels: Sequence[str]) -> list[str]:
    """Shorten the middle labels by the ending that they share with the outermost label on their side.

    "Completely disagree, Mostly disagree" becomes "Completely disagree, Mostly", unless two labels become the same.
    """
    short = list(labels)
    for outer, inner in ((1, (2, 3)), (7, (5, 6))):
        ending = labels[outer - 1].split()[1:]
        for level in inner:
            words = labels[level - 1].split()
            shared = 0
            while shared < min(len(ending), len(words) - 1) and words[-1 - shared] == ending[-1 - shared]:
                shared += 1
            short[level - 1] = " ".join(words[: len(words) - shared])
    return short if len({*short[:3], *short[4:]}) == 6 else list(labels)


def _draw_agreement_panel(
    sheet: Sheet, name: str, title: str, counts: pd.DataFrame, widths: _PanelWidths, x: float, top: float
) -> None:
    """Draw one panel; the unit of the axes is one answer, and the IDs of SVG elements begin with ``name``."""
    plot_pt = len(counts) * _ROW_PT
    zero = x + widths.left
    base = zero + widths.right + _NEUTRAL_GAP_PT
    sheet.text(zero, top - 5, title, size=8, weight="bold", ha="center")
    sheet.text(base + widths.neutral / 2, top - 5, "neutral", size=SMALL, colour=style.TEXT_SOFT, ha="center")
    sheet.text(zero - 3.5, top + plot_pt + 10, "disagree", size=SMALL, colour=style.TEXT_SOFT, ha="right")
    sheet.text(zero + 3.5, top + plot_pt + 10, "agree", size=SMALL, colour=style.TEXT_SOFT)

    axes = sheet.axes(x, top, widths.total, plot_pt)
    axes.set_label(name)
    axes.set_xlim(-widths.left / widths.answer, (widths.total - widths.left) / widths.answer)
    axes.set_ylim(len(counts) - 0.5, -0.5)
    neutral_edge = (base - zero) / widths.answer
    has_missing = _lacks_answers(counts)
    for y, (_, row) in enumerate(counts.iterrows()):
        level_counts = {level: int(row[column]) for level, column in enumerate(COUNT_COLUMNS, start=1)}
        edge = -sum(level_counts[level] for level in _DISAGREEMENT)
        lefts: dict[int, float] = {}
        for level in (*_DISAGREEMENT[::-1], *_AGREEMENT):
            lefts[level] = edge
            edge += level_counts[level]
        lefts[NEUTRAL] = neutral_edge
        for level in (*_DISAGREEMENT, *_AGREEMENT, NEUTRAL):
            _draw_answers_of_level(sheet, axes, lefts[level], y, level, level_counts[level], widths.answer)
        if has_missing.iloc[y]:
            place = (x + widths.total, top + (y + 0.5) * _ROW_PT + 2)
            sheet.text(*place, f"n {row['n']}", size=SMALL, colour=style.TEXT_SOFT, ha="right")
    axes.axvline(0, color=style.TEXT_SOFT, linewidth=0.9, zorder=3)
    axes.axvline(neutral_edge, color=style.AXIS, linewidth=0.5, zorder=3)


def _draw_answers_of_level(
    sheet: Sheet, axes: Axes, left: float, y: int, level: int, count: int, answer_pt: float
) -> None:
    """Draw ``count`` answers of one level from ``left``, with the number inside if it fits."""
    if count == 0:
        return
    look: Style = {
        "color": style.LEVEL_COLOURS[level - 1],
        "edgecolor": "white",
        "linewidth": min(0.5, 0.15 * answer_pt),
    }
    bar = axes.barh(y, count, left=left, height=_BAR_PT / _ROW_PT, zorder=2, **look)
    bar[0].set_gid(f"{axes.get_label()}-row{y + 1}-level{level}")
    if sheet.text_width(str(count), SMALL) <= count * answer_pt - 0.2:
        ink, font = style.LEVEL_INKS[level - 1], sheet.font(SMALL)
        place: Style = {"ha": "center", "va": "center_baseline", "zorder": 4}
        axes.text(left + count / 2, y, str(count), fontproperties=font, color=ink, **place)


def answers_picture(
    study: Study,
    block: Block,
    name: str,
    forms: Sequence[str] = style.FORMATS,
    lowest: Mapping[str, float] = MappingProxyType({}),
) -> Picture:
    """Draw a block's answers: diverging bars per setting or, for delays, a plot per statement against delay.

    ``lowest`` maps items to the shortest delay with a trend [ms], which is marked. Raises AnalysisError if no session
    was completed.
    """
    if not len(study.answers(block)):
        columns = ["participant", "session", "status", "excluded"]
        states = ", ".join(
            f"{participant} session {session} {'excluded' if excluded else status}"
            for participant, session, status, excluded in study.participants[columns].head(5).itertuples(index=False)
        )
        raise AnalysisError(
            f"{study.folder}: no completed session contains answers to {block.id!r} yet ({states}). Figures "
            "require completed sessions, but an export contains all available data"
        )
    caption = _caption(study, block)
    if lowest:
        caption += (
            " Dashed line: shortest delay with a trend (step-down test, error rate controlled across all statements); "
            "it is an upper bound for the shortest noticeable delay."
        )
    draw = partial(draw_block, study, block, lowest)
    table = pd.concat(part.aggregate(block).assign(group=group or part.split) for group, part in groups_shown(study))
    numbers = tab_separated(study, table if study.split else table.drop(columns="group"))
    return picture_of(study, block.id, name, title(block), caption, draw, forms, counts(study, block), numbers)


def draw_block(study: Study, block: Block, lowest: Mapping[str, float], look: Look) -> Sheet:
    """Draw the answers of a block; against delay, the median of a participant's repeated answers is drawn."""
    if block.kind != "delays" or not block.revealed:
        return draw_agreement(study, block, look)
    plots, lowest_delays = [], []
    for group, part in groups_shown(study):
        answers = part.answers(block)
        people = sorted(answers["participant"].unique())
        for item in block.items:
            plots.append((with_group(item.short, group), by_participant(answers, people, block.columns, item.id)))
            lowest_delays.append(None if group else lowest.get(item.id))
    footnote = f"Added delay in ms.   1 = {block.labels[0]}, 7 = {block.labels[-1]}."
    return draw_answers(plots, block.delays_ms, lowest_delays, footnote, look)


_CELL_PT: Final = (52.0, 26.0)
_NAMES_PT: Final = 14.0
_MATRIX_TOP_PT: Final = 30.0
_MATRIX_FOOT_PT: Final = 18.0
_GROUND: Final = (0.043, 0.396, 0.639)  # style.ACCENT
_DARKEST: Final = 0.6
"""Opacity of a cell with all answers of a row, at which the dark counts have a contrast of at least 5."""


@style.own_settings()
def draw_recognition(
    table: Sequence[Sequence[int]],
    settings: Sequence[str],
    labels: Sequence[str],
    right: Sequence[int | None],
    look: Look,
) -> Sheet:
    """Draw the confusion matrix: counts (settings, labels + 2), one row per setting, one column per name.

    ``right`` are the columns of the correct names. The last two columns are undecided and unanswered.
    """
    names = [*labels, "undecided", "unanswered"]
    shown_columns = [place for place in range(len(names)) if place <= len(labels) or any(row[place] for row in table)]
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, look.fonts)
    first_pt = max(ruler.text_width(name, 7.5) for name in settings) + 10
    width, height = _CELL_PT
    names_wrapped = [ruler.wrap(names[place], width - 4, SMALL) for place in shown_columns]
    top = _MATRIX_TOP_PT + _NAMES_PT + 8.5 * (max(map(len, names_wrapped)) - 1)
    sheet = look.sheet(top + height * len(settings) + _MATRIX_FOOT_PT)
    left = MARGIN_PT + first_pt
    for column, place in enumerate(shown_columns):
        x = left + column * width + (8.0 if place >= len(labels) else 0.0)
        colour = style.TEXT if place < len(labels) else style.TEXT_SOFT
        for number, line in enumerate(reversed(names_wrapped[column])):
            sheet.text(x + width / 2, top - 4 - 8.5 * number, line, size=SMALL, colour=colour, ha="center")
        axes = sheet.axes(x, top, width, height * len(settings))
        axes.set_label(f"name{place + 1}")
        axes.set_xlim(0, 1)
        axes.set_ylim(len(table), 0)
        for row, counts in enumerate(table):
            _draw_cell(sheet, axes, row, counts[place], sum(counts), right=right[row] == place)
    for number, name in enumerate(settings):
        sheet.text(left - 6, top + height * (number + 0.5) + 2.6, name, size=7.5, ha="right")
    footnote = "Cells show counts with row percentages; correct names are outlined."
    sheet.text(MARGIN_PT, sheet.height_pt - 6, footnote, size=SMALL, colour=style.TEXT_SOFT)
    return sheet


def _draw_cell(sheet: Sheet, axes: Axes, row: int, count: int, total: int, *, right: bool) -> None:
    proportion = count / total if total else 0.0
    ground = (*_GROUND, _DARKEST * proportion) if count else style.GROUND
    edge, width = (style.TEXT, 1.6) if right else (style.BORDER, 0.5)
    look: Style = {"facecolor": ground, "edgecolor": edge, "linewidth": width}
    axes.add_patch(Rectangle((0.03, row + 0.05), 0.94, 0.9, gid=f"{axes.get_label()}-setting{row + 1}", **look))
    words, font = (
        f"{count}" + (f"  ({proportion:.0%})" if count else ""),
        sheet.font(7.5, "bold" if right else "regular"),
    )
    axes.text(0.5, row + 0.5, words, fontproperties=font, color=style.TEXT, ha="center", va="center")
