"""The figure of agreement: counts of answers as diverging bars, one panel per setting, neutral apart in grey.

Disagreement grows left and agreement right from one line; neutral answers stand in a column of their own on the same
scale, since splitting them over the line would make half of "neither" look like disagreement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import pandas as pd
from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.analysis.tables.measures import COUNT_COLUMNS, NEUTRAL

PANELS_A_ROW: Final = 3
ROW_PT: Final = 19.0
BAR_PT: Final = 12.4
LABEL_SIZE: Final = 7.5
COUNT_SIZE: Final = 5.8
WIDEST_ANSWER_PT: Final = 15.0
PANEL_PADDING_PT: Final = 7.0
NEUTRAL_GAP_PT: Final = 8.0
TOP_PT: Final = 52.0
HEADER_PT: Final = 7.0
FOOT_PT: Final = 16.0

DISAGREEMENT: Final = (3, 2, 1)
AGREEMENT: Final = (5, 6, 7)


@dataclass(frozen=True, slots=True)
class Panel:
    """One setting: ``name`` identifies its shapes in the file, ``title`` stands above, ``counts`` as ``aggregate``."""

    name: str
    title: str
    counts: pd.DataFrame


@dataclass(frozen=True, slots=True)
class _Widths:
    """Of every panel alike [pt]: one answer, the sides of the line, the neutral column and the column of n."""

    answer: float
    left: float
    right: float
    neutral: float
    n: float

    @property
    def total(self) -> float:
        return self.left + self.right + NEUTRAL_GAP_PT + self.neutral + self.n


@style.own_settings()
def draw(
    panels: Sequence[Panel],
    items: Sequence[str],
    labels: Sequence[str],
    *,
    title: str,
    marks: Sequence[Mark],
    counts: Sequence[str],
    fonts: Sequence[str],
) -> Sheet:
    """Draw the panels over one axis of statements.

    Parameters
    ----------
    items : sequence of str
        Short texts in the order of the questionnaire, which is the order of the rows of every ``Panel.counts``.
    labels : sequence of str
        The names of the seven levels, lowest first.
    counts : sequence of str
        What the figure says about n, the longest first; one is chosen by the room there is.
    """
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, fonts)
    wrapped = [ruler.wrap(item, 118, LABEL_SIZE) for item in items]
    label_pt = max(ruler.text_width(line, LABEL_SIZE) for lines in wrapped for line in lines)
    columns = min(len(panels), PANELS_A_ROW)
    panel_pt = (style.PAGE_WIDTH_PT - 2 * MARGIN_PT - label_pt - 6) / columns
    widths = _widths(panels, panel_pt - 2 * PANEL_PADDING_PT)

    rows = -(-len(panels) // PANELS_A_ROW)
    plot_pt = len(items) * ROW_PT
    row_pt = HEADER_PT + plot_pt + FOOT_PT
    sheet = Sheet(style.PAGE_WIDTH_PT, TOP_PT + rows * row_pt + (rows - 1) * 12, fonts)
    sheet.heading(title, marks, counts)
    left_pt = MARGIN_PT + label_pt + 6
    _legend(sheet, labels, left_pt)
    for place, panel in enumerate(panels):
        row, column = divmod(place, PANELS_A_ROW)
        top, x = TOP_PT + row * (row_pt + 12) + HEADER_PT, left_pt + column * panel_pt
        if column == 0:
            _row_labels(sheet, wrapped, top, plot_pt)
        else:
            sheet.line((x, x), (top - 14, top + plot_pt + 10), color=style.BORDER, linewidth=0.5)
        _panel(sheet, panel, widths, x + (panel_pt - widths.total) / 2, top, plot_pt)
    return sheet


def _widths(panels: Sequence[Panel], room: float) -> _Widths:
    """Give one answer the same width everywhere, the widest that fits, and words above and below their room."""
    tables = [panel.counts for panel in panels]
    left = max(int(table[[f"count_{level}" for level in DISAGREEMENT]].sum(axis=1).max()) for table in tables)
    right = max(int(table[[f"count_{level}" for level in AGREEMENT]].sum(axis=1).max()) for table in tables)
    neutral = max(int(table[f"count_{NEUTRAL}"].max()) for table in tables)
    n = 17.0 if any(_lacks_answers(table).any() for table in tables) else 0.0
    least = (32.0, 26.0, 27.0)
    room -= NEUTRAL_GAP_PT + n
    answer = WIDEST_ANSWER_PT
    while sum(_sides(answer, (left, right, neutral), least)) > room:
        answer *= 0.99
    return _Widths(answer, *_sides(answer, (left, right, neutral), least), n)


def _lacks_answers(counts: pd.DataFrame) -> pd.Series[bool]:
    """Return for each row whether an answer is missing, the trial's having been left out included."""
    return counts["n"] < counts["presented"] + counts["presented_excluded"]


def _sides(answer: float, most: Sequence[int], least: Sequence[float]) -> tuple[float, float, float]:
    left, right, neutral = (max(answer * count, floor) for count, floor in zip(most, least, strict=True))
    return left, right, neutral


def _legend(sheet: Sheet, labels: Sequence[str], x: float) -> None:
    """Name the levels in their order; the neutral one, which stands apart in the panels, stands apart here."""
    short = legend_labels(labels)
    order = [*DISAGREEMENT[::-1], *AGREEMENT, NEUTRAL]
    size, swatch, gap = 7.0, 7.0, 9.0
    total = sum(swatch + 4 + sheet.text_width(short[level - 1], size) + gap for level in order) + gap
    x = min(x + PANEL_PADDING_PT, max(sheet.width_pt - MARGIN_PT - total + gap, MARGIN_PT))
    for level in order:
        if level == NEUTRAL:
            x += gap
        sheet.box(x, 26.6, swatch, swatch, style.LEVEL_COLOURS[level - 1])
        sheet.text(x + swatch + 4, 32.7, short[level - 1], size=size, colour=style.TEXT_SOFT)
        x += swatch + 4 + sheet.text_width(short[level - 1], size) + gap


def legend_labels(labels: Sequence[str]) -> list[str]:
    """Shorten the middle levels by the ending they share with the outer level of their side.

    "Completely disagree, Mostly disagree" becomes "Completely disagree, Mostly".
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
    return short if len(set(short[:3])) == 3 and len(set(short[4:])) == 3 else list(labels)


def _row_labels(sheet: Sheet, wrapped: Sequence[Sequence[str]], top: float, plot_pt: float) -> None:
    for row, lines in enumerate(wrapped):
        middle = top + (row + 0.5) * ROW_PT + 2.7
        for number, line in enumerate(lines):
            sheet.text(MARGIN_PT, middle + (number - (len(lines) - 1) / 2) * 8.4, line, size=LABEL_SIZE)
    sheet.text(MARGIN_PT, top + plot_pt + 10, "counts of answers", size=6.5, colour=style.TEXT_SOFT)


def _panel(sheet: Sheet, panel: Panel, widths: _Widths, x: float, top: float, plot_pt: float) -> None:
    """Draw one panel; the axes' unit is one answer."""
    zero = x + widths.left
    base = zero + widths.right + NEUTRAL_GAP_PT
    sheet.text(zero, top - 5, panel.title, size=8, weight="bold", ha="center")
    sheet.text(base + widths.neutral / 2, top - 5, "neutral", size=6.5, colour=style.TEXT_SOFT, ha="center")
    sheet.text(zero - 3.5, top + plot_pt + 10, "disagree", size=6.5, colour=style.TEXT_SOFT, ha="right")
    sheet.text(zero + 3.5, top + plot_pt + 10, "agree", size=6.5, colour=style.TEXT_SOFT)

    axes = sheet.axes(x, top, widths.total, plot_pt)
    axes.set_label(panel.name)
    axes.set_xlim(-widths.left / widths.answer, (widths.total - widths.left) / widths.answer)
    axes.set_ylim(len(panel.counts) - 0.5, -0.5)
    apart = (base - zero) / widths.answer
    lacking = _lacks_answers(panel.counts)
    for y, (_, row) in enumerate(panel.counts.iterrows()):
        edge = 0.0
        for level in DISAGREEMENT:
            edge -= row[COUNT_COLUMNS[level - 1]]
            _segment(sheet, axes, edge, y, level, int(row[COUNT_COLUMNS[level - 1]]), widths.answer)
        edge = 0.0
        for level in AGREEMENT:
            _segment(sheet, axes, edge, y, level, int(row[COUNT_COLUMNS[level - 1]]), widths.answer)
            edge += row[COUNT_COLUMNS[level - 1]]
        _segment(sheet, axes, apart, y, NEUTRAL, int(row[COUNT_COLUMNS[NEUTRAL - 1]]), widths.answer)
        if lacking.iloc[y]:
            sheet.text(
                x + widths.total,
                top + (y + 0.5) * ROW_PT + 2,
                f"n {row['n']}",
                size=5.8,
                colour=style.TEXT_SOFT,
                ha="right",
            )
    axes.axvline(0, color=style.TEXT_SOFT, linewidth=0.9, zorder=3)
    axes.axvline(apart, color=style.AXIS, linewidth=0.5, zorder=3)


def _segment(sheet: Sheet, axes: Axes, left: float, y: int, level: int, count: int, answer_pt: float) -> None:
    """Draw ``count`` answers of one level from ``left``, with the number inside where it fits."""
    if count == 0:
        return
    bar = axes.barh(
        y,
        count,
        left=left,
        height=BAR_PT / ROW_PT,
        color=style.LEVEL_COLOURS[level - 1],
        edgecolor="white",
        linewidth=min(0.5, 0.15 * answer_pt),
        zorder=2,
    )
    bar[0].set_gid(f"{axes.get_label()}-row{y + 1}-level{level}")
    if sheet.text_width(str(count), COUNT_SIZE) <= count * answer_pt - 0.2:
        axes.text(
            left + count / 2,
            y,
            str(count),
            fontproperties=sheet.font(COUNT_SIZE),
            color=style.LEVEL_INKS[level - 1],
            ha="center",
            va="center_baseline",
            zorder=4,
        )
