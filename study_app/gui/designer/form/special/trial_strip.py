"""The design of a block, with a picture of one trial: intervals, pauses, question and feedback with their durations."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QWidget

from study_app.gui.designer.form.row_fields import ChoiceField
from study_app.gui.designer.form.special_editor import SpecialEditor
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.viewmodels.designer.form.form_rows import FormRow
from study_app.viewmodels.designer.special.trial_strip import Phase, TrialStrip

HEIGHT, PICTURE_PX, GAP = 104, 52, 6
LEAST_SHARE = 0.12
"""Of the width, for the shortest phase."""


class StripView(Themed, QWidget):
    """One trial, as wide as its phases are long, but each wide enough for its words."""

    def __init__(self) -> None:
        super().__init__()
        self.strip: TrialStrip | None = None
        self.setFixedHeight(HEIGHT)

    def show_strip(self, strip: TrialStrip) -> None:
        """Show another trial."""
        self.strip = strip
        self.setAccessibleName("One trial")
        self.setAccessibleDescription(strip.sentence)
        self.setToolTip(strip.sentence)
        self.update()

    def sizeHint(self) -> QSize:  # noqa: N802 - Qt's name
        """Return the room for a trial."""
        return QSize(260, HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:  # noqa: N802 - Qt's name
        """Paint the phases from left to right."""
        if self.strip is None:
            return
        painter, phases = QPainter(self), self.strip.phases
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(font("small", weight=600))
        painter.setPen(QColor(self.theme.text2))
        head = QRectF(0, 0, self.width(), 16)
        painter.drawText(head, Qt.AlignmentFlag.AlignLeft, "One trial")
        painter.drawText(head, Qt.AlignmentFlag.AlignRight, f"{self.strip.duration_s:.3g} s")
        whole = self.width() - GAP * (len(phases) - 1)
        x = 0.0
        for phase, width in zip(phases, _widths(phases, whole), strict=True):
            self._phase(painter, phase, QRectF(x, 18, width, HEIGHT - 18))
            x += width + GAP

    def _phase(self, painter: QPainter, phase: Phase, room: QRectF) -> None:
        t = self.theme
        picture = QRectF(room.left(), room.top(), room.width(), PICTURE_PX).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.setPen(QPen(QColor(t.border), 1))
        painter.setBrush(QColor(t.selected if phase.kind == "interval" else t.sunk))
        painter.drawRoundedRect(picture, 6, 6)
        middle = picture.center()
        if phase.kind == "interval":
            self._interval(painter, phase, picture)
        elif phase.kind == "question":
            draw_icon(painter, "list", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), t.accent, 2.0)
        elif phase.kind == "feedback":
            draw_icon(painter, "check", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), t.ok, 2.2)
        painter.setPen(QColor(t.text))
        painter.setFont(font("small"))
        metrics, width = painter.fontMetrics(), int(room.width() + GAP - 2)
        name = metrics.elidedText(phase.name, Qt.TextElideMode.ElideRight, width)
        painter.drawText(QPointF(room.left(), picture.bottom() + 15), name)
        painter.setPen(QColor(t.text2))
        words = metrics.elidedText(phase.duration, Qt.TextElideMode.ElideRight, width)
        painter.drawText(QPointF(room.left(), picture.bottom() + 30), words)

    def _interval(self, painter: QPainter, phase: Phase, picture: QRectF) -> None:
        """Paint the ball on its way, and which interval it is."""
        t, way = self.theme, QPainterPath()
        middle = picture.center().y() - 5
        step = picture.width() / 4
        way.moveTo(picture.left() + 4, middle)
        for number in range(4):
            lift = 8 if number % 2 else -8
            begin = picture.left() + 4 + number * (step - 2)
            way.quadTo(QPointF(begin + step / 2, middle + lift), QPointF(begin + step - 2, middle))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(t.text3), 1, Qt.PenStyle.DotLine))
        painter.drawPath(way)
        painter.setPen(QPen(QColor(t.accent), 2))
        painter.setBrush(QColor(t.surface))
        painter.drawEllipse(QPointF(picture.center().x(), middle), 6, 6)
        painter.setPen(QColor(t.text2))
        painter.setFont(font("key"))
        painter.drawText(picture.adjusted(0, 0, 0, -3), Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom,
                         phase.words)  # fmt: skip


def _widths(phases: tuple[Phase, ...], whole: float) -> list[float]:
    """Return how wide each phase is: as it is long, but none narrower than its words."""
    least = LEAST_SHARE * whole
    rest = whole - least * len(phases)
    total = sum(phase.duration_s for phase in phases) or 1.0
    return [least + max(0.0, rest) * phase.duration_s / total for phase in phases]


class DesignField(ChoiceField):
    """The choice of the design, and one trial below it."""

    def __init__(self, row: FormRow) -> None:
        self.view = StripView()
        super().__init__(row)
        choice = QWidget()
        across = QHBoxLayout(choice)
        across.setContentsMargins(0, 0, 0, 0)
        across.setSpacing(8)
        for part in (self.segments, self.list, self.arrow):
            if part is not None:
                across.addWidget(part, int(part is self.list))
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        for widget in (choice, self.view):
            self.box.addWidget(widget)
        self.show_value()

    def show_value(self) -> None:
        """Show what is chosen, and one trial of it."""
        super().show_value()
        strip: TrialStrip | None = self.row.facts
        self.view.setVisible(strip is not None and self.view.parent() is not None)
        if strip is not None:
            self.view.show_strip(strip)


EDITOR: Final = SpecialEditor((("Block", "design"),), DesignField, wide=True)
