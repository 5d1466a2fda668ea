"""What the figures of questions share: a row for each setting, its name at the left and its n at the right."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from matplotlib.axes import Axes

from study_app import figure_style as style
from study_app.analysis.figures.page_layout import MARGIN_PT, Mark, Sheet
from study_app.analysis.results.question_answers import QuestionFound
from study_app.analysis.tables.asked_questions import AskedQuestion

LEFT_PT: Final = 120.0
RIGHT_PT: Final = 40.0
TOP_PT: Final = 30.0
FOOT_PT: Final = 34.0
LINE_PT: Final = 8.5


@dataclass(frozen=True, slots=True)
class Look:
    """The title of a figure, what must not be overlooked, how many answered, and the fonts."""

    title: str
    marks: Sequence[Mark]
    counts: Sequence[str]
    fonts: Sequence[str]


Draw: TypeAlias = Callable[[AskedQuestion, QuestionFound, Look], Sheet]


@dataclass(frozen=True, slots=True)
class QuestionFigure:
    """A figure by its id: what draws it, and the sentence of its caption."""

    id: str
    draw: Draw
    caption: str


def rows(names: Sequence[str], ns: Sequence[int], look: Look, *, row_pt: float) -> tuple[Sheet, Axes]:
    """Return a sheet and its axes, in which row k lies around y = k, the first at the top."""
    height = TOP_PT + row_pt * len(names) + FOOT_PT
    sheet = Sheet(style.PAGE_WIDTH_PT, height, look.fonts)
    sheet.heading(look.title, look.marks, look.counts)
    axes = sheet.axes(LEFT_PT, TOP_PT, sheet.width_pt - LEFT_PT - RIGHT_PT, row_pt * len(names))
    axes.set_ylim(len(names) - 0.5, -0.5)
    for place, (name, n) in enumerate(zip(names, ns, strict=True)):
        lines = sheet.wrap(name, LEFT_PT - MARGIN_PT - 8, 7)
        middle = TOP_PT + row_pt * (place + 0.5)
        for number, line in enumerate(lines):
            y = middle + LINE_PT * (number - (len(lines) - 1) / 2) + 2.5
            sheet.text(LEFT_PT - 8, y, line, size=7, ha="right")
        sheet.text(sheet.width_pt - MARGIN_PT, middle + 2.5, f"n = {n}", size=6.5, colour=style.TEXT_SOFT, ha="right")
    return sheet, axes
