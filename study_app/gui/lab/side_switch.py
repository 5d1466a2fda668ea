"""Which of two settings is felt: two segments side by side, of which one is in the hand."""

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QSizePolicy, QWidget

from study_app.gui.theme.theme import RADIUS_CONTROL, Theme, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import hbox
from study_app.lab.ab_comparison import Side
from study_app.viewmodels.lab import SIDES, LabView

HEIGHT = 44
WIDEST = 190
BADGE = 20
KEY = "X"


def side_colour(theme: Theme, side: Side) -> str:
    """Return the colour of a side: in the switch, the plots and the tank's words."""
    return theme.trace_x if side == "A" else theme.trace_y


def draw_badge(painter: QPainter, middle: QPointF, theme: Theme, side: Side, letter: str) -> None:
    """Paint a side's letter on a disc of its colour."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(side_colour(theme, side)))
    painter.drawEllipse(middle, BADGE / 2, BADGE / 2)
    painter.setPen(QColor(theme.on_accent))
    painter.setFont(font("key"))
    half = BADGE / 2
    painter.drawText(QRectF(middle.x() - half, middle.y() - half, BADGE, BADGE), Qt.AlignmentFlag.AlignCenter, letter)


class Badge(Themed, QWidget):
    """The letter of a side on its own."""

    def __init__(self) -> None:
        super().__init__()
        self._side: Side = "A"
        self.setFixedSize(BADGE + 2, BADGE + 2)

    def show_side(self, side: Side) -> None:
        if side != self._side:
            self._side = side
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        draw_badge(painter, QRectF(self.rect()).center(), self.theme, self._side, self._side)


class Segment(Themed, QAbstractButton):
    """One side: its letter and its name; the felt one is raised, with an accent edge."""

    def __init__(self, side: Side) -> None:
        super().__init__()
        self._letter: str = side
        self.setCheckable(True)
        self.setFixedHeight(HEIGHT - 8)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def show_name(self, name: str, letter: str) -> None:
        if (name, letter) != (self.text(), self._letter):
            self._letter = letter
            self.setText(name)
            self.setToolTip(name)
            self.updateGeometry()
            self.update()

    def nextCheckState(self) -> None:
        """Leave it to the view which side is felt."""

    def sizeHint(self) -> QSize:
        width = QFontMetricsF(font("strong", scale=0.94)).horizontalAdvance(self.text())
        return QSize(min(round(width) + 60, WIDEST), HEIGHT - 8)

    def minimumSizeHint(self) -> QSize:
        return QSize(110, HEIGHT - 8)

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        body = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        if self.isChecked() or self.underMouse():
            painter.setPen(QPen(QColor(t.accent), 1.6) if self.isChecked() else Qt.PenStyle.NoPen)
            painter.setBrush(QColor(t.surface if self.isChecked() else t.hover))
            painter.drawRoundedRect(body, RADIUS_CONTROL, RADIUS_CONTROL)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.text if self.isChecked() else t.accent), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(body.adjusted(2, 2, -2, -2), RADIUS_CONTROL - 2, RADIUS_CONTROL - 2)
        side: Side = "A" if self._letter in {"A", "1"} else "B"
        draw_badge(painter, QPointF(24, self.height() / 2), t, side, self._letter)
        painter.setPen(QColor(t.text if self.isChecked() else t.text2))
        painter.setFont(font("strong", scale=0.94, weight=600 if self.isChecked() else 500))
        room = QRectF(42, 0, self.width() - 52, self.height())
        shown = painter.fontMetrics().elidedText(self.text(), Qt.TextElideMode.ElideRight, round(room.width()))
        painter.drawText(room, Qt.AlignmentFlag.AlignVCenter, shown)


class SideSwitch(Themed, QWidget):
    """Both sides in a track; ``switched`` when the other one is to be felt. The X key does the same."""

    switched = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setFixedHeight(HEIGHT)
        self.segments = {side: Segment(side) for side in SIDES}
        row = hbox(spacing=2, margins=(4, 4, 34, 4), parent=self)
        for segment in self.segments.values():
            segment.clicked.connect(lambda _on, it=segment: None if it.isChecked() else self.switched.emit())
            row.addWidget(segment)
        self.setToolTip("Feel the other setting (X)")

    def show_view(self, view: LabView) -> None:
        bench = view.workbench
        order: tuple[Side, ...] = SIDES if not bench.blind or bench.first == "A" else SIDES[::-1]
        for number, (place, side) in enumerate(zip(SIDES, order, strict=True), 1):
            segment = self.segments[place]
            segment.show_name(bench.shown_name(side), str(number) if bench.blind else side)
            segment.setChecked(side == bench.felt)
            felt = ", felt now" if side == bench.felt else ""
            segment.setAccessibleName(f"{'' if bench.blind else side + ': '}{bench.shown_name(side)}{felt}")

    def paintEvent(self, _event: QPaintEvent) -> None:
        t = self.theme
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(t.sunk))
        painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL + 2, RADIUS_CONTROL + 2)
        cap = QRectF(self.width() - 28, self.height() / 2 - 10, 20, 20)
        painter.setPen(QPen(QColor(t.ctl), 1))
        painter.setBrush(QColor(t.surface))
        painter.drawRoundedRect(cap.adjusted(0.5, 0.5, -0.5, -0.5), 5, 5)
        painter.setPen(QColor(t.text2))
        painter.setFont(font("key"))
        painter.drawText(cap, Qt.AlignmentFlag.AlignCenter, KEY)
