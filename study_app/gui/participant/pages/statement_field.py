"""One statement of a questionnaire and its cells, in columns that all statements share."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFocusEvent, QFont, QFontMetricsF, QPainter, QPen
from PySide6.QtWidgets import QHBoxLayout, QWidget

from study_app.gui.participant.forms.option_button import NO_WORDS
from study_app.gui.participant.forms.scale_field import ScaleField
from study_app.gui.participant.pages.questionnaire_grid import AFTER_STATEMENT, CELL_GAP, Grid
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.boxes import add_layout
from study_app.protocol.questions import ItemView

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

SHRINKING = (1.0, 0.94, 0.88, 0.82, 0.76)  # of words that are larger than they must be, in a window that is too small
WRAP_LEFT = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)

Fitted: TypeAlias = tuple[QFont, QFont, float, float]


@lru_cache(maxsize=256)
def statement_height(text: str, scale: float, weight: int, width_px: int) -> float:
    """Return the height of a statement that is wrapped at a width [px]; a page of statements often comes again."""
    room = QRectF(0, 0, width_px, 1e4)
    return QFontMetricsF(font("statement", scale=scale, weight=weight)).boundingRect(room, WRAP_LEFT, text).height()


class StatementField(ScaleField):
    """A statement with its cells; their names stand over the columns, once for all statements."""

    def __init__(
        self, view: ItemView, labels: tuple[str, ...], judge: str | None, words: Words, parent: QWidget
    ) -> None:
        self.sizes: Grid | None = None
        super().__init__(view, words, parent)
        self.build(labels, judge, NO_WORDS)
        self.statement.fill_row()
        self.cells, self.row = QHBoxLayout(), QHBoxLayout()
        mirrored = self.layoutDirection() == Qt.LayoutDirection.RightToLeft
        for point in reversed(self.points) if mirrored else self.points:  # a scale has the same order in every language
            self.cells.addWidget(point)
            if mirrored:
                point.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        add_layout(self.row, self.cells)
        if self.judge is not None:
            self.row.addWidget(self.judge)
        add_layout(self.grid, self.row, 0, self.ANSWER, Qt.AlignmentFlag.AlignVCenter)
        self.grid.setColumnStretch(self.ANSWER, 0)

    @property
    def note(self) -> str:
        """The small line under the statement says which keys answer, where the keyboard is."""
        if self.missing and self.hasFocus():
            return f"{self._words.please_answer} · {self._words.press_keys}"
        return super().note

    @property
    def columns(self) -> list[tuple[float, float]]:
        """Left end and width of every cell in the row [px]."""
        return [(cell.x(), cell.width()) for cell in self.options]

    @property
    def rule(self) -> float | None:
        """Where the rule between the scale and "cannot judge" is [px]; None without that."""
        if self.judge is None:
            return None
        (first, _), (last, width), (left, wide) = (self.columns[place] for place in (0, -2, -1))
        return (left + wide + first) / 2 if left < first else (last + width + left) / 2

    def set_sizes(self, sizes: Grid) -> None:
        """Take the columns' widths and the row's height."""
        self.sizes, self.scale = sizes, sizes.scale
        margin = self.horizontal_margin
        self.grid.setContentsMargins(margin, 0, margin, 0)
        self.set_words_columns(sizes.number_width, AFTER_STATEMENT * sizes.scale)
        width, height = math.floor(sizes.cell_width), math.floor(sizes.cell_height + 0.01)
        self.cells.setSpacing(round(CELL_GAP * sizes.scale))
        for point in self.points:
            point.set_scale(sizes.text)
            point.setFixedSize(width, height)
        if self.judge is not None:
            self.judge.set_scale(sizes.text)
            self.judge.setFixedSize(math.floor(sizes.judge_width), height)
        self.row.setSpacing(round(sizes.judge_gap))
        self.setFixedHeight(math.floor(sizes.pitch))
        self._tell()

    def fits(self, sizes: Grid, note: str) -> bool:
        """Return whether statement and ``note`` can be read in a row of these sizes, no smaller than they must."""
        return self.fitted(sizes, note) is not None

    def fitted(self, sizes: Grid, note: str) -> Fitted | None:
        """Return the largest fonts with which statement and note fit the row, and their heights [px]; None if none do.

        Words that must be so large (``sizes.text`` beyond ``sizes.scale``) are not made smaller; a note may be.
        """
        must = sizes.text > sizes.scale
        shrunk = ((1.0, 1.0), (1.0, sizes.scale / sizes.text)) if must else ((s, max(s, 0.88)) for s in SHRINKING)
        for shrink, note_shrink in shrunk:
            fitted = self._measured(sizes, note, shrink, note_shrink)
            if fitted[2] + fitted[3] <= sizes.pitch - 3 * sizes.scale:
                return fitted
        return None

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self._tell()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self._tell()

    def _smallest(self, sizes: Grid, note: str) -> Fitted:
        """Return fonts for a row that is alone on its page and still too low."""
        for percent in range(95, 30, -5):
            fitted = self._measured(sizes, note, percent / 100, percent / 100)
            if fitted[2] + fitted[3] <= sizes.pitch - 3 * sizes.scale:
                break
        return fitted

    def _measured(self, sizes: Grid, note: str, shrink: float, note_shrink: float) -> Fitted:
        weight = 500 if self.missing or self.hasFocus() else 400
        face = font("statement", scale=sizes.text * shrink, weight=weight)
        note_face = font("label", scale=sizes.text * note_shrink, weight=600)
        height = statement_height(self.view.text, sizes.text * shrink, weight, math.floor(sizes.statement_width))
        return face, note_face, height, QFontMetricsF(note_face).height() if note else 0.0

    def _tell(self) -> None:
        """Write the words as large as the row can hold them."""
        super()._tell()
        if self.sizes is not None:
            face, note_face, *_ = self.fitted(self.sizes, self.note) or self._smallest(self.sizes, self.note)
            self.set_fonts(face, note_face, self.sizes.text)

    def _paint_ground(self, painter: QPainter) -> None:
        super()._paint_ground(painter)
        if self.rule is None or self.judge is None:
            return
        painter.setPen(QPen(QColor(PARTICIPANT.border), 1))
        x, half, middle = round(self.rule) + 0.5, self.judge.height() * 0.4, self.height() / 2
        painter.drawLine(QPointF(x, middle - half), QPointF(x, middle + half))
