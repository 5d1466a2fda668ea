"""The labels over the columns of a questionnaire."""

from collections.abc import Callable

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPaintEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.participant.pages.page_widget import page_painter
from study_app.gui.participant.pages.questionnaire_grid import POINTS, Grid
from study_app.gui.participant.pages.statement_field import WRAP_LEFT, StatementField
from study_app.gui.theme.theme import PARTICIPANT, font

LABEL_WIDTH = 98.0  # in which a label over a column wraps, where there is room
SHARES = (1.0, 1.2, 1.4, 1.6, 1.8)


def label_height(labels: tuple[str, ...], widest: float) -> float:
    """Return the height [px] of labels at scale 1 that may be ``widest`` px wide, where they wrap as they are drawn."""
    metrics = QFontMetricsF(font("label", weight=600))
    room = QRectF(0, 0, min(LABEL_WIDTH, 0.95 * widest), 1e3)  # letters of other sizes are not quite in proportion
    return max((metrics.boundingRect(room, WRAP_LEFT, text).height() for text in labels), default=0.0)


def widest_word(metrics: QFontMetricsF, text: str) -> float:
    """Return the width [px] of the widest word of a text, 0 without any."""
    return max((metrics.horizontalAdvance(word) for word in text.split()), default=0.0)


class Heading(QWidget):
    """The labels over the columns: both ends and the middle, and the one that is pointed at.

    ``row`` returns a row of the part that is shown: its cells say where the columns are.
    """

    def __init__(
        self, labels: tuple[str, ...], judge: str | None, row: Callable[[], StatementField], parent: QWidget
    ) -> None:
        super().__init__(parent)
        self._labels = (*labels, judge) if judge is not None else labels
        self._fixed = {0, len(labels) // 2, len(labels) - 1, *({len(labels)} if judge is not None else ())}
        self._pointed = -1
        self._row = row
        self._sizes: Grid | None = None
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    @property
    def shown(self) -> tuple[str, ...]:
        """The labels that can be read now, from left to right."""
        return tuple(self._labels[column] for column in sorted(self.columns()))

    def set_sizes(self, sizes: Grid) -> None:
        """Take the sizes of the columns."""
        self._sizes = sizes
        self.update()

    def point(self, column: int) -> None:
        """Show the label of ``column`` as well, -1 for none."""
        if column != self._pointed:
            self._pointed = column
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._sizes is None:
            return
        painter = page_painter(self)
        painter.setFont(font("label", scale=self._sizes.text, weight=600))
        flags = int(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap)
        for column in self.columns():
            if column == self._pointed:
                ink = PARTICIPANT.accent
            else:
                ink = PARTICIPANT.text2 if column == POINTS else PARTICIPANT.text
            painter.setPen(QColor(ink))
            painter.drawText(self.column_area(column), flags, self._labels[column])
        painter.end()

    def columns(self) -> set[int]:
        """Return the columns whose label is drawn: one that leaves the pointed one too little room gives way to it."""
        if self._pointed < 0:
            return self._fixed
        neighbours = {
            column
            for column in self._fixed
            if abs(column - self._pointed) == 1 and POINTS not in (column, self._pointed)
        }
        if neighbours and self._sizes is not None:
            room = self._sizes.cell_pitch
            if not all(self._fits(column, room) for column in (*neighbours, self._pointed)):
                return (self._fixed - neighbours) | {self._pointed}
        return self._fixed | {self._pointed}

    def _fits(self, column: int, width: float) -> bool:
        """Return whether a label can be read in ``width`` [px] and the height of the heading."""
        assert self._sizes is not None  # noqa: S101  # asked only when laid out
        metrics = QFontMetricsF(font("label", scale=self._sizes.text, weight=600))
        bounds = metrics.boundingRect(QRectF(0, 0, width, 1e4), WRAP_LEFT, self._labels[column])
        return bounds.width() <= width and bounds.height() <= self.height() + 1

    def _bounds(self, column: int) -> tuple[float, float]:
        """Return between which places [px] a label stands: those of the scale do not cross the rule at its end."""
        row = self._row()
        if row.rule is None or column == POINTS:
            return 0.0, self.width()
        return (row.rule, self.width()) if row.columns[POINTS] < row.columns[0] else (0.0, row.rule)

    def column_area(self, column: int) -> QRectF:
        """Return the room of a label: its column, and on either side as much as it needs, within the row."""
        assert self._sizes is not None  # noqa: S101  # painted only when laid out
        left, width = self._row().columns[column]
        pitch = min(self._sizes.cell_pitch, LABEL_WIDTH * self._sizes.text) if column < POINTS else width
        wide = next((pitch * share for share in SHARES if self._fits(column, pitch * share)), 2 * pitch)
        low, high = self._bounds(column)
        middle = max(min(left + width / 2, high - wide / 2), low + wide / 2)
        return QRectF(middle - wide / 2, 0, wide, self.height())
