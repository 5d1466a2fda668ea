"""The figure of recognition: which name was given to which liquid, as counts; the right name framed.

Darker means more, and every count stands in its cell, so that nothing depends on colour alone.
"""

from collections.abc import Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet

CELL_PT: Final = (52.0, 26.0)
NAMES_PT: Final = 14.0
TOP_PT: Final = 30.0
FOOT_PT: Final = 18.0
GROUND: Final = (0.043, 0.396, 0.639)  # style.ACCENT
DARKEST: Final = 0.6
"""Opacity of the ground under all of a row: the counts, always dark, keep a contrast of at least 5."""


@style.own_settings()
def draw(
    table: Sequence[Sequence[int]],
    settings: Sequence[str],
    labels: Sequence[str],
    right: Sequence[int | None],
    *,
    title: str,
    marks: Sequence[Mark],
    counts: Sequence[str],
    foot: str,
    fonts: Sequence[str],
) -> Sheet:
    """Draw a row a setting and a column a name; the last two columns are undecided and unanswered.

    Parameters
    ----------
    table : (settings, labels + 2) counts
    right : sequence
        The column that is right for each setting; None where none is.
    """
    names = [*labels, "undecided", "unanswered"]
    kept = [place for place in range(len(names)) if place <= len(labels) or any(row[place] for row in table)]
    ruler = Sheet(style.PAGE_WIDTH_PT, 72, fonts)
    first_pt = max(ruler.text_width(name, 7.5) for name in settings) + 10
    width, height = CELL_PT
    names_wrapped = [ruler.wrap(names[place], width - 4, 7) for place in kept]
    top = TOP_PT + NAMES_PT + 8.5 * (max(map(len, names_wrapped)) - 1)
    sheet = Sheet(style.PAGE_WIDTH_PT, top + height * len(settings) + FOOT_PT, fonts)
    sheet.heading(title, marks, counts)
    left = MARGIN_PT + first_pt
    for column, place in enumerate(kept):
        gap = 8.0 if place >= len(labels) else 0.0
        x = left + column * width + gap
        colour = style.TEXT if place < len(labels) else style.TEXT_SOFT
        for number, line in enumerate(reversed(names_wrapped[column])):
            sheet.text(x + width / 2, top - 4 - 8.5 * number, line, size=7, colour=colour, ha="center")
        axes = sheet.axes(x, top, width, height * len(settings))
        axes.set_label(f"name{place + 1}")
        _column(sheet, axes, [row[place] for row in table], [sum(row) for row in table], [at == place for at in right])
    for number, name in enumerate(settings):
        sheet.text(left - 6, top + height * (number + 0.5) + 2.6, name, size=7.5, ha="right")
    sheet.text(MARGIN_PT, sheet.height_pt - 6, foot, size=6.5, colour=style.TEXT_SOFT)
    return sheet


def _column(sheet: Sheet, axes: Axes, counts: Sequence[int], totals: Sequence[int], right: Sequence[bool]) -> None:
    rows = len(counts)
    axes.set_xlim(0, 1)
    axes.set_ylim(rows, 0)
    for row, (count, total, is_right) in enumerate(zip(counts, totals, right, strict=True)):
        share = count / total if total else 0.0
        axes.add_patch(
            Rectangle(
                (0.03, row + 0.05),
                0.94,
                0.9,
                facecolor=(*GROUND, DARKEST * share) if count else style.GROUND,
                edgecolor=style.TEXT if is_right else style.BORDER,
                linewidth=1.6 if is_right else 0.5,
                gid=f"{axes.get_label()}-setting{row + 1}",
            )
        )
        axes.text(
            0.5,
            row + 0.5,
            f"{count}" + (f"  ({share:.0%})" if count else ""),
            fontproperties=sheet.font(7.5, "bold" if is_right else "regular"),
            color=style.TEXT,
            ha="center",
            va="center",
        )
