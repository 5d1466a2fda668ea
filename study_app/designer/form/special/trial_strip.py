"""The design of a block, with a picture of one trial: intervals, pauses, question and feedback with their durations."""

from typing import Final

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFontMetrics, QPainter, QPainterPath, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QAbstractButton, QBoxLayout, QWidget

from study_app.designer.form.facts.trial_strip import Phase, TrialStrip
from study_app.designer.form.form_rows import FormRow
from study_app.designer.form.row_fields import ChoiceField
from study_app.designer.form.special_editor import SpecialEditor
from study_app.designer.place.requests import GoTo
from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import add_parts, hbox

HEIGHT, PICTURE_PX, GAP = 104, 52, 6


class PhaseButton(Themed, QAbstractButton):
    """A phase of a trial; a press asks for its field."""

    def __init__(self, strip: QWidget) -> None:
        super().__init__(strip)
        self.phase: Phase | None = None

    def show_phase(self, phase: Phase) -> None:
        self.phase = phase
        opens = f"Opens “{phase.opens}”" if phase.opens else ""
        self.setAccessibleName(f"{phase.name}, {phase.duration}")
        self.setAccessibleDescription(opens)
        self.setToolTip("\n".join(filter(None, (f"{phase.name}, {phase.duration}", opens))))
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus if phase.field else Qt.FocusPolicy.NoFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor if phase.field else Qt.CursorShape.ArrowCursor)
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.phase is None:
            return
        painter, t, phase = QPainter(self), self.theme, self.phase
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        picture = QRectF(0, 0, self.width(), PICTURE_PX).adjusted(1, 1, -1, -1)
        lit = self.hasFocus() or (self.underMouse() and bool(phase.field))
        painter.setPen(QPen(QColor(t.accent if lit else t.border), 2 if self.hasFocus() else 1))
        painter.setBrush(QColor(t.selected if phase.kind == "interval" else t.sunk))
        painter.drawRoundedRect(picture, 6, 6)
        middle = picture.center()
        if phase.kind == "interval":
            self._interval(painter, phase, picture)
        elif phase.kind == "question":
            draw_icon(painter, "list", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), t.accent, 2.0)
        elif phase.kind == "feedback":
            draw_icon(painter, "check", QRectF(middle.x() - 9, middle.y() - 9, 18, 18), t.ok, 2.2)
        painter.setFont(font("small"))
        metrics = painter.fontMetrics()
        for ink, words, below in ((t.text, phase.name, 15), (t.text2, phase.duration, 30)):
            painter.setPen(QColor(ink))
            shown = metrics.elidedText(words, Qt.TextElideMode.ElideRight, self.width())
            painter.drawText(QPointF(0, picture.bottom() + below), shown)

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


class StripView(Themed, QWidget):
    """One trial, as wide as its phases are long, but each wide enough for its words.

    ``opened`` carries the path of the field of the phase that is pressed.
    """

    opened = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.strip: TrialStrip | None = None
        self.phases: list[PhaseButton] = []
        self.setFixedHeight(HEIGHT)

    def show_strip(self, strip: TrialStrip) -> None:
        self.strip = strip
        self.setAccessibleName("One trial")
        self.setAccessibleDescription(strip.sentence)
        while len(self.phases) < len(strip.phases):
            made = PhaseButton(self)
            made.clicked.connect(lambda _checked=False, made=made: self._open(made))
            made.apply_theme(self.theme)
            self.phases.append(made)
        for at, button in enumerate(self.phases):
            button.setVisible(at < len(strip.phases))
            if at < len(strip.phases):
                button.show_phase(strip.phases[at])
        self._place()
        self.update()

    def _open(self, pressed: PhaseButton) -> None:
        if pressed.phase is not None and pressed.phase.field:
            self.opened.emit(pressed.phase.field)

    def _place(self) -> None:
        if self.strip is None:
            return
        phases, x = self.strip.phases, 0.0
        for button, width in zip(self.phases, _widths(phases, self.width() - GAP * (len(phases) - 1)), strict=False):
            button.setGeometry(round(x), 18, round(width), HEIGHT - 18)
            x += width + GAP

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place()

    def sizeHint(self) -> QSize:
        return QSize(260, HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.strip is None:
            return
        painter = QPainter(self)
        painter.setFont(font("small", weight=600))
        painter.setPen(QColor(self.theme.text2))
        head = QRectF(0, 0, self.width(), 16)
        painter.drawText(head, Qt.AlignmentFlag.AlignLeft, "One trial")
        painter.drawText(head, Qt.AlignmentFlag.AlignRight, self.strip.duration)


def _widths(phases: tuple[Phase, ...], whole: float) -> list[float]:
    """Return how wide each phase is: wide enough for its words, and the longer it is, the wider."""
    metrics = QFontMetrics(font("small"))
    words = [max(map(metrics.horizontalAdvance, (phase.name, phase.duration))) + GAP for phase in phases]
    rest, total = max(0.0, whole - sum(words)), sum(phase.duration_s for phase in phases) or 1.0
    share = min(1.0, whole / sum(words))
    return [share * least + rest * phase.duration_s / total for least, phase in zip(words, phases, strict=True)]


class DesignField(ChoiceField):
    """The choice of the design, and one trial below it."""

    def __init__(self, row: FormRow) -> None:
        self.view = StripView()
        super().__init__(row)
        choice = QWidget()
        parts = ((part, int(part is self.list)) for part in (self.segments, self.list, self.arrow) if part is not None)
        hbox(*parts, spacing=8, margins=0, parent=choice)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        add_parts(self.box, choice, self.view)
        self.view.opened.connect(lambda path: self.asked.emit(GoTo(path[:2], path)))
        self.show_value()

    def show_value(self) -> None:
        """Show what is chosen, and one trial of it."""
        super().show_value()
        strip: TrialStrip | None = self.row.facts
        self.view.setVisible(strip is not None and self.view.parent() is not None)
        if strip is not None:
            self.view.show_strip(strip)


EDITOR: Final = SpecialEditor((("Block", "design"),), DesignField, wide=True)
