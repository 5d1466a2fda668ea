"""The sizes of a questionnaire of statements in a window of a given size: pure arithmetic, tested without widgets.

Order of giving way in a small window: margins and paddings, the room between cells, the width of the statements,
then fewer statements a page. Cells never become smaller than 44 px, and words never smaller than they must be read.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from study_app.gui.participant.pages.page_widget import page_scale, words_scale

LEAST_CELL = 44.0
NARROW = 900.0
FEW = 5  # statements a page at most where a window is too small for all of them
NUMBER = 32.0
AFTER_STATEMENT = 16.0
CELL_GAP = 6.0
POINTS = 7


@dataclass(frozen=True, slots=True)
class Asked:
    """What is asked, measured at scale 1 [px].

    ``statement`` is the width of the longest statement on one line, ``judge`` that of the longest word over the column
    "cannot judge", 0 where there is none, and ``word`` that of the labels over the scale.
    """

    statement: float
    judge: float = 0.0
    word: float = 0.0


@dataclass(frozen=True, slots=True)
class Grid:
    """The sizes of a row, from its number to "cannot judge" [logical px].

    ``scale`` is of spaces, ``text`` of words; ``judge_gap`` lies between the scale and "cannot judge", whose width is 0
    where there is none; ``pitch`` is a row's height, 0 until it is known.
    """

    scale: float
    text: float
    tight: bool
    number_width: float
    statement_width: float
    cell_pitch: float
    judge_gap: float
    judge_width: float
    pitch: float = 0.0

    @property
    def cell_width(self) -> float:
        """The width of a cell of the scale."""
        return self.cell_pitch - CELL_GAP * self.scale

    @property
    def cell_height(self) -> float:
        """The height of every cell."""
        return min(self.pitch - (4 if self.tight else 7) * self.scale, 50 * max(self.scale, 0.8 * self.text))

    @property
    def holds(self) -> bool:
        """Whether the cells are large enough to be hit."""
        return min(self.cell_height, self.cell_width) >= LEAST_CELL * self.scale - 0.01

    def with_rows(self, room: float, per_page: int) -> Grid:
        """Return the sizes where ``room`` [px] is divided among so many rows."""
        return replace(self, pitch=math.floor(min(room / per_page, 68 * self.text)))


def parts(items: int, width: float) -> Iterator[int]:
    """Yield how many statements a page could show, most first: all of them, else as even parts as there can be."""
    if width >= NARROW:
        yield items
    for most in range(min(FEW, items), 0, -1):
        yield math.ceil(items / math.ceil(items / most))


def grid(width: float, height: float, asked: Asked, margin: float, *, text_scale: float = 1.0) -> Grid:
    """Return the widths of a row in a window, ``margin`` from its edges to the words [logical px].

    Words are drawn ``text_scale`` times as large as designed at least. Rows may turn out too low for their words or
    their cells: see `Grid.holds`.
    """
    scale = page_scale(width, height)
    text = words_scale(width, height, text_scale)
    content = width - 2 * margin
    roomy = content >= 1100
    judge = max((112 if roomy else 92) * scale, asked.judge * text + 8 * scale) if asked.judge else 0.0
    gap = (42 if roomy else 24) * scale if asked.judge else 0.0
    number, after = NUMBER * text, AFTER_STATEMENT * scale
    wide = content - number - after - judge - gap
    statements = 400 * scale if text <= scale else 480 * text  # as much as these need, cells give way to them
    narrowest = max(52 * scale, asked.word * text / 2 + 2)  # a label may be twice as wide as its column
    fewest = min(max((wide - statements) / POINTS, narrowest), max(98 * scale, narrowest))
    pitch = min(max((wide - asked.statement * text - 8) / POINTS, fewest), 120 * max(scale, 0.8 * text))
    return Grid(
        scale=scale,
        text=text,
        tight=height < 740 * text,
        number_width=number,
        statement_width=wide - POINTS * pitch + CELL_GAP * scale,
        cell_pitch=pitch,
        judge_gap=gap,
        judge_width=judge,
    )
