"""What a new study can begin as: a card for each template with its picture, and a smaller one for each study."""

import math
from typing import Final

from PySide6.QtCore import QPointF, QRectF, QSize, QSizeF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QFontMetricsF,
    QKeyEvent,
    QLinearGradient,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPen,
)
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QAbstractButton, QSizePolicy

from study_app.designer.new_study.template_choices import PLANNED, SHIPPED, TemplateChoice
from study_app.designer.new_study.templates import FOLDER
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import PARTICIPANT, RADIUS_CARD, TANK, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.labels import clamped

DEEP: Final = "#142E40"


def paint_picture(painter: QPainter, name: str, body: QRectF) -> None:
    """Paint the picture of a template into the upper part of its card: what a participant feels or answers."""
    ground = QPainterPath()
    ground.addRoundedRect(body.adjusted(0, 0, 0, RADIUS_CARD), RADIUS_CARD, RADIUS_CARD)
    painter.save()
    painter.setClipRect(body)
    if name == "questionnaire-only":
        painter.fillPath(ground, QColor(PARTICIPANT.window))
    else:
        water = QLinearGradient(body.topLeft(), body.bottomLeft())
        water.setColorAt(0, QColor(TANK.water_light))
        water.setColorAt(1, QColor(DEEP))
        painter.fillPath(ground, water)
        glass = QColor(TANK.glass)
        glass.setAlpha(70)
        painter.setPen(QPen(glass, 1))
        for high, depth in ((0.12, 2.2), (0.17, 1.6)):
            top, across = body.top() + high * body.height(), [step / 60 for step in range(61)]
            points = (QPointF(body.left() + x * body.width(), top + depth * math.sin(6 * math.pi * x)) for x in across)
            painter.drawPolyline(list(points))
    scale = min(body.width() / 340, body.height() / 180)
    size = QSizeF(340 * scale, 190 * scale)
    picture = QRectF(body.center() - QPointF(size.width() / 2, size.height() / 2), size)
    QSvgRenderer(str(FOLDER / f"{name}.svg")).render(painter, picture)
    painter.restore()


PICTURE_PX, WORDS_PX, COPY_PX = 150, 132, 76
RING = 4
"""The room around a card for the ring [px]."""


class TemplateButton(Themed, QAbstractButton):
    """One thing to begin from: its picture or icon, title, description and figures.

    ``came`` is emitted when it gets the keyboard; it says whether by a click. ``passed`` asks for the card after it or,
    by -1, before it.
    """

    came = Signal(bool)
    passed = Signal(int)

    def __init__(self, choice: TemplateChoice) -> None:
        super().__init__()
        self.choice = choice
        self.setText(choice.title)
        self.setCheckable(True)
        self.setAccessibleName(f"{'Copy of' if choice.copy else 'Template'} {choice.title}")
        words = ", ".join(words for _, words in choice.figures)
        self.setAccessibleDescription(". ".join(filter(None, (choice.description.rstrip("."), choice.note, words))))
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    @property
    def picture(self) -> str:
        """The name of its picture, "" where it has none."""
        name = self.choice.source.removeprefix("template:")
        return name if FOLDER.joinpath(f"{name}.svg").exists() and not self.choice.copy else ""

    def sizeHint(self) -> QSize:
        return QSize(200, 2 * RING + (COPY_PX if self.choice.copy else PICTURE_PX + WORDS_PX))

    @property
    def _wide(self) -> int:
        return self.width() - 2 * RING

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.came.emit(event.reason() == Qt.FocusReason.MouseFocusReason)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in {Qt.Key.Key_Left, Qt.Key.Key_Right}:
            self.passed.emit(1 if event.key() == Qt.Key.Key_Right else -1)
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t, painter = self.theme, QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.accent), 2))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), RADIUS_CARD + RING, RADIUS_CARD + RING)
        painter.translate(RING, RING)
        body = QRectF(0, 0, self._wide, self.height() - 2 * RING).adjusted(1, 1, -1, -1)
        marked, empty = self.isChecked(), not self.picture and not self.choice.copy
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(t.hover if self.underMouse() or (empty and not marked) else t.surface))
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)
        if self.choice.copy:
            self._paint_copy(painter)
        elif empty:
            self._paint_empty(painter)
        else:
            paint_picture(painter, self.picture, QRectF(1, 1, self._wide - 2, PICTURE_PX))
            self._paint_words(painter, PICTURE_PX)
        style = Qt.PenStyle.DashLine if empty and not marked else Qt.PenStyle.SolidLine
        edge = t.accent if marked else t.ctl if empty else t.border
        painter.setPen(QPen(QColor(edge), 2 if marked else 1, style))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)

    def _paint_words(self, painter: QPainter, top: int) -> None:
        t, wide = self.theme, self._wide - 32
        painter.setPen(QColor(t.text))
        painter.setFont(font("strong"))
        painter.drawText(
            QRectF(16, top + 10, wide, 24),
            Qt.AlignmentFlag.AlignVCenter,
            painter.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, wide),
        )
        painter.setPen(QColor(t.text2))
        painter.setFont(font("label", weight=400))
        words = Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignTop
        painter.drawText(QRectF(16, top + 36, wide, 56), words, self.choice.description)
        self._paint_figures(painter, top + WORDS_PX - 32)

    def _paint_figures(self, painter: QPainter, top: int) -> None:
        x = 16.0
        painter.setFont(font("small", weight=500))
        for icon, spoken in self.choice.figures:
            words = spoken.removesuffix(PLANNED)
            draw_icon(painter, icon, QRectF(x, top, 16, 16), self.theme.text2, 1.8)
            painter.setPen(QColor(self.theme.text2))
            painter.drawText(QRectF(x + 22, top - 2, 120, 20), Qt.AlignmentFlag.AlignVCenter, words)
            x += 22 + QFontMetricsF(painter.font()).horizontalAdvance(words) + 16

    def _paint_copy(self, painter: QPainter) -> None:
        t = self.theme
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(t.sunk))
        painter.drawRoundedRect(QRectF(16, 18, 40, 40), 8, 8)
        draw_icon(painter, "lock" if self.choice.note == SHIPPED else "layers", QRectF(27, 29, 18, 18), t.text2)
        painter.setPen(QColor(t.text))
        wide = self._wide - 80
        painter.setFont(font("label", weight=600))
        lines = clamped(self.text(), 2, painter.font(), wide)
        box = QRectF(68, 8, wide, 36) if len(lines) > 1 else QRectF(68, 16, wide, 22)
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, "\n".join(lines))
        painter.setPen(QColor(t.text2))
        painter.setFont(font("small"))
        note = painter.fontMetrics().elidedText(self.choice.note, Qt.TextElideMode.ElideRight, wide)
        painter.drawText(QRectF(68, box.bottom(), wide, 20), Qt.AlignmentFlag.AlignVCenter, note)

    def _paint_empty(self, painter: QPainter) -> None:
        t, middle = self.theme, self._wide / 2
        painter.setPen(QPen(QColor(t.ctl), 1))
        painter.setBrush(QColor(t.surface))
        painter.drawEllipse(QRectF(middle - 22, 78, 44, 44))
        draw_icon(painter, "plus", QRectF(middle - 9, 91, 18, 18), t.text, 2.0)
        painter.setPen(QColor(t.text))
        painter.setFont(font("strong"))
        painter.drawText(QRectF(16, 134, self._wide - 32, 24), Qt.AlignmentFlag.AlignCenter, self.text())
        painter.setPen(QColor(t.text2))
        painter.setFont(font("label", weight=400))
        words = Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop
        painter.drawText(QRectF(28, 166, self._wide - 56, 80), words, self.choice.description)
