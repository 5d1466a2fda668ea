"""Where everything of a questionnaire lies in a window of a given size: pure arithmetic, tested without widgets.

Order of giving way in a small window: margins and paddings, the room between cells, the width of the statements,
then fewer statements a page. Cells never become smaller than 44 px.
"""

from __future__ import annotations

from dataclasses import dataclass

from study_app.gui.pages.base import page_scale

LEAST_CELL = 44.0
NARROW = 900.0
FEW = 5  # statements a page where a window is too small for all of them
OVERHANG = 16.0  # of a row's ring beyond the margin
NUMBER = 32.0
POINTS = 7


@dataclass(frozen=True, slots=True)
class Grid:
    """Sizes and places [logical px] for a window of ``width`` × ``height``.

    Vertical places are of the page; horizontal ones of a row, which begins ``OVERHANG`` left of the margin.
    """

    scale: float
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


def grid(
    width: float, height: float, *, items: int, statement: float, heading: float, intro: float, judge: bool
) -> Grid:
    """Return the places for a window.

    Parameters
    ----------
    width, height : float
        Of the window [logical px].
    items : int
        Statements in the questionnaire.
    statement : float
        Width of the longest statement on one line, at scale 1 [px].
    heading, intro : float
        Heights of the labels over the columns and of the sentence under the title, at scale 1 [px].
    judge : bool
        Whether there is a column "cannot judge".
    """
    scale = page_scale(width, height)
    tight = height < 740 * scale
    margin = (40 if width >= 1100 else 24) * scale
    top = (12 if tight else 20) * scale
    title = (24 if tight else 28) * scale
    title_top = top + (22 if tight else 32) * scale
    intro_top = title_top + title * 1.25 + (0 if tight else 3) * scale
    rows_top = intro_top + (intro + heading + (10 if tight else 26)) * scale
    foot_top = height - (72 if tight else 104) * scale
    least = (LEAST_CELL + 4) * scale
    room = foot_top - rows_top - (4 if tight else 8) * scale
    per_page = items
    if width < NARROW or items * least > room:
        per_page = max(1, min(items, FEW, int(room // least)))
    pitch = min(room / per_page, 68 * scale)
    gap = (4 if tight else 7) * scale
    content = width - 2 * margin
    judged = (154 if content >= 1100 else 116) * scale if judge else 0.0
    wide = content - NUMBER * scale - 16 * scale - judged
    most, fewest = 120 * scale, min(max((wide - 400 * scale) / POINTS, 52 * scale), 98 * scale)
    cell_pitch = min(max((wide - statement * scale - 8) / POINTS, fewest), most)
    statement_left = (OVERHANG + NUMBER) * scale
    cells_left = OVERHANG * scale + content - judged - POINTS * cell_pitch + 6 * scale
    judge_width = judged - 42 * scale if content >= 1100 else judged - 24 * scale
    return Grid(
        scale=scale,
        margin=margin,
        top=top,
        title=title,
        title_top=title_top,
        intro_top=intro_top,
        tight=tight,
        heading_height=heading * scale,
        foot_top=foot_top,
        rows_top=rows_top,
        pitch=pitch,
        per_page=per_page,
        statement_left=statement_left,
        statement_width=cells_left - statement_left - 16 * scale,
        cells_left=cells_left,
        cell_pitch=cell_pitch,
        cell_width=cell_pitch - 6 * scale,
        cell_height=min(pitch - gap, 50 * scale),
        rule=OVERHANG * scale + content - judge_width - (judged - judge_width) / 2 if judge else None,
        judge_left=OVERHANG * scale + content - judge_width,
        judge_width=judge_width,
        row_width=content + 2 * OVERHANG * scale,
    )
