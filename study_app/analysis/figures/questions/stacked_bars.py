"""Ratings of any length: the share of each point as a stacked bar, a bar for each setting."""

from typing import Final

from matplotlib.colors import LinearSegmentedColormap, to_hex

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import Sheet
from study_app.analysis.figures.questions.group_rows import LEFT_PT, RIGHT_PT, Look, QuestionFigure, rows
from study_app.analysis.results.question_answers import QuestionFound
from study_app.analysis.tables.asked_questions import AskedQuestion

ROW_PT: Final = 26.0
HALF: Final = 0.32
SWATCH_PT: Final = 18.0
NARROW: Final = 0.03  # share of a bar in which the value is not printed


def colours(points: int) -> list[str]:
    """Return a colour for each point, from the palette of agreement."""
    palette = LinearSegmentedColormap.from_list("points", style.LEVEL_COLOURS)
    return [to_hex(palette(place / (points - 1))) for place in range(points)]


def _ink(colour: str) -> str:
    red, green, blue = (int(colour[place : place + 2], 16) for place in (1, 3, 5))
    return "#000000" if 0.299 * red + 0.587 * green + 0.114 * blue > 130 else "#ffffff"


@style.own_settings()
def draw(asked: AskedQuestion, found: QuestionFound, look: Look) -> Sheet:
    """Draw the counts of all points."""
    groups = found.groups
    sheet, axes = rows(
        [group.name for group in groups], [int(group.numbers["n"]) for group in groups], look, row_pt=ROW_PT
    )
    axes.set_xlim(0, 1)
    inks = colours(len(asked.levels))
    for place, group in enumerate(groups):
        total = max(1, int(group.numbers["n"]))
        left = 0.0
        for count, colour in zip(group.numbers["counts"].values(), inks, strict=True):
            share = count / total
            axes.barh(place, share, left=left, height=2 * HALF, color=colour, gid=f"{group.code}")
            if share > NARROW:
                axes.text(
                    left + share / 2, place, str(count), ha="center", va="center", color=_ink(colour),
                    fontproperties=sheet.font(6.5),
                )  # fmt: skip
            left += share
    _legend(sheet, list(asked.levels.values()), inks)
    return sheet


def _legend(sheet: Sheet, names: list[str], inks: list[str]) -> None:
    """Write the ends of the scale, and between them the points in their colours."""
    y, right = sheet.height_pt - 12, sheet.width_pt - RIGHT_PT
    sheet.text(LEFT_PT, y, names[0], size=6.5, colour=style.TEXT_SOFT)
    sheet.text(right, y, names[-1], size=6.5, colour=style.TEXT_SOFT, ha="right")
    x = (LEFT_PT + right - SWATCH_PT * len(inks)) / 2
    for point, ink in enumerate(inks, start=1):
        sheet.box(x, y - 8.5, SWATCH_PT, 11, ink, rounding=0.5)
        sheet.text(x + SWATCH_PT / 2, y, str(point), size=6.5, colour=_ink(ink), ha="center")
        x += SWATCH_PT


FIGURE: Final = QuestionFigure("rating", draw, "Counts of the answers at each point, as shares of each bar.")
