"""Where everything of a questionnaire lies in a window of a given size: pure arithmetic, tested without widgets.

Order of giving way in a small window: margins and paddings, the room between cells, the width of the statements,
then fewer statements a page. Cells never become smaller than 44 px, and words never smaller than they must be read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from study_app.gui.participant.pages.page_widget import page_scale, words_scale

LEAST_CELL = 44.0
NARROW = 900.0
FEW = 5  # statements a page at most where a window is too small for all of them
OVERHANG = 16.0  # of a row's ring beyond the margin
NUMBER = 32.0
POINTS = 7


@dataclass(frozen=True, slots=True)
class Asked:
    """What is asked, measured at scale 1 [px].

    ``statement`` is the width of the longest statement on one line. ``heading`` gives the height of the labels over the
    columns, where one over the scale and "cannot judge" may be so wide; ``intro`` that of the sentence under the title.
    ``judge`` is the width of the longest word over the column "cannot judge", 0 where there is none; ``word`` is that
    of the labels over the scale.
    """

    items: int
    statement: float
    heading: Callable[[float, float], float]
    intro: Callable[[float], float]
    judge: float = 0.0
    word: float = 0.0


@dataclass(frozen=True, slots=True)
class Grid:
    """Sizes and places [logical px] for a window of ``width`` × ``height``.

    Vertical places are of the page; horizontal ones of a row, which begins ``OVERHANG`` left of the margin. ``scale``
    is of spaces, ``text`` of words.
    """

    scale: float
    text: float
    margin: float
    top: float
    title: float
    title_top: float
    intro_top: float
    tight: bool
    heading_height: float
    foot_top: float
    rows_top: float
    pitch: float
    per_page: int
    number_left: float
    statement_left: float
    statement_width: float
    cells_left: float
    cell_pitch: float
    cell_width: float
    cell_height: float
    rule: float | None
    judge_left: float
    judge_width: float
    row_width: float

    def cell(self, column: int) -> tuple[float, float]:
        """Return left end and width of the cell in ``column`` (0 … 6, 7 for "cannot judge") in its row."""
        if column == POINTS:
            return self.judge_left, self.judge_width
        return self.cells_left + column * self.cell_pitch, self.cell_width

    def mirrored(self) -> Grid:
        """Return the places for a page that is read from right to left: all but the order of the scale is mirrored."""
        width = self.row_width
        return replace(
            self,
            number_left=width - self.number_left - NUMBER * self.text,
            statement_left=width - self.statement_left - self.statement_width,
            cells_left=width - self.cells_left - (POINTS - 1) * self.cell_pitch - self.cell_width,
            rule=None if self.rule is None else width - self.rule,
            judge_left=width - self.judge_left - self.judge_width,
        )


def parts(items: int, width: float) -> Iterator[int]:
    """Yield how many statements a page could show, most first: all of them, else as even parts as there can be."""
    if width >= NARROW:
        yield items
    for most in range(min(FEW, items), 0, -1):
        yield math.ceil(items / math.ceil(items / most))


def grid(width: float, height: float, asked: Asked, per_page: int, *, text_scale: float = 1.0) -> Grid:
    """Return the places for a window [logical px] that shows ``per_page`` statements.

    Words are drawn ``text_scale`` times as large as designed at least. Rows may turn out too low for their words or
    their cells: see `holds`.
    """
    scale = page_scale(width, height)
    text = words_scale(width, height, text_scale)
    across = _across(width, asked, scale, text)
    tight = height < 740 * text
    top = (12 if tight else 20) * scale
    title = (24 if tight else 28) * text
    title_top = top + (22 if tight else 32) * text
    intro_top = title_top + title * 1.25 + (0 if tight else 3) * scale
    intro = asked.intro((width - 2 * across.margin) / text) * text
    heading = asked.heading(2 * across.cell_pitch / text, across.judge_width / text) * text * 1.03
    if per_page < asked.items:
        heading = max(heading, LEAST_CELL * scale)  # the parts' tabs stand beside it
    rows_top = intro_top + intro + heading + (10 if tight else 26) * scale
    foot_top = height - (72 if tight else 104) * text
    room = foot_top - rows_top - (4 if tight else 8) * scale
    pitch = min(room / per_page, 68 * text)
    return replace(
        across,
        top=top,
        title=title,
        title_top=title_top,
        intro_top=intro_top,
        tight=tight,
        heading_height=heading,
        foot_top=foot_top,
        rows_top=rows_top,
        pitch=pitch,
        per_page=per_page,
        cell_height=min(pitch - (4 if tight else 7) * scale, 50 * max(scale, 0.8 * text)),
    )


def holds(places: Grid) -> bool:
    """Return whether the cells are large enough to be hit."""
    return min(places.cell_height, places.cell_width) >= LEAST_CELL * places.scale - 0.01


def _across(width: float, asked: Asked, scale: float, text: float) -> Grid:
    """Return the horizontal places; the vertical ones are still to be found."""
    margin = (40 if width >= 1100 else 24) * scale
    content = width - 2 * margin
    roomy = content >= 1100
    judge_width = max((112 if roomy else 92) * scale, asked.judge * text + 8 * scale) if asked.judge else 0.0
    judged = judge_width + (42 if roomy else 24) * scale if asked.judge else 0.0
    wide = content - NUMBER * text - 16 * scale - judged
    statements = 400 * scale if text <= scale else 480 * text  # as much as these need, cells give way to them
    narrowest = max(52 * scale, asked.word * text / 2 + 2)  # a label may be twice as wide as its column
    fewest = min(max((wide - statements) / POINTS, narrowest), max(98 * scale, narrowest))
    pitch = min(max((wide - asked.statement * text - 8) / POINTS, fewest), 120 * max(scale, 0.8 * text))
    statement_left = OVERHANG * scale + NUMBER * text
    cells_left = OVERHANG * scale + content - judged - POINTS * pitch + 6 * scale
    return Grid(
        scale=scale,
        text=text,
        margin=margin,
        top=0.0,
        title=0.0,
        title_top=0.0,
        intro_top=0.0,
        tight=False,
        heading_height=0.0,
        foot_top=0.0,
        rows_top=0.0,
        pitch=0.0,
        per_page=1,
        number_left=OVERHANG * scale,
        statement_left=statement_left,
        statement_width=cells_left - statement_left - 16 * scale,
        cells_left=cells_left,
        cell_pitch=pitch,
        cell_width=pitch - 6 * scale,
        cell_height=0.0,
        rule=OVERHANG * scale + content - judge_width - (judged - judge_width) / 2 if asked.judge else None,
        judge_left=OVERHANG * scale + content - judge_width,
        judge_width=judge_width,
        row_width=content + 2 * OVERHANG * scale,
    )
