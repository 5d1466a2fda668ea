"""The force stop: one big button, always in the same place, never disabled, no question."""

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QPushButton, QSizePolicy, QStyle, QStyleOptionButton, QStylePainter

from study_app.gui.theme.icons import draw_icon
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.operator import OperatorView

LEAST_WIDTH, LEAST_HEIGHT = 320, 160


class StopButton(Themed, QPushButton):
    """STOP FORCE; it acts when pressed, not when released."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "stop")
        self.setAccessibleName("Stop force")
        self.setMinimumSize(LEAST_WIDTH, LEAST_HEIGHT)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setCursor(Qt.CursorShape.PointingHandCursor)

    def sizeHint(self) -> QSize:
        return QSize(LEAST_WIDTH, LEAST_HEIGHT)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QStylePainter(self)
        option = QStyleOptionButton()
        self.initStyleOption(option)
        painter.drawControl(QStyle.ControlElement.CE_PushButtonBevel, option)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ink = QColor(self.theme.on_stop)
        middle, width = self.height() / 2, self.width()
        draw_icon(painter, "stop", QRectF(0, middle - 68, width, 58), ink, 2.0)
        painter.setPen(ink)
        painter.setFont(font("title", weight=700, scale=1.08))
        centred = Qt.AlignmentFlag.AlignCenter
        painter.drawText(QRectF(0, middle, width, 38), centred, "STOP FORCE")
        painter.setFont(font("label", weight=600))
        painter.drawText(QRectF(8, middle + 42, width - 16, 22), centred, "Hold Esc in any window, or device button 4")


class StopPanel(Card):
    """The button under a line that says whether there is force, with the way back after a stop.

    Of a device that exerts none (``felt``) the line says so.
    """

    stop_asked = Signal()
    fade_in_asked = Signal()

    def __init__(self, *, felt: bool = True) -> None:
        super().__init__(padding=12, gap=10)
        self._felt = felt
        self.sign = Icon("check", "ok", 18)
        self.word = label("", "strong")
        self.fade_in = ActionButton("", "Fade in again", height=36)
        self.stop = StopButton()
        # Pressed, not clicked: the force goes with the finger's first touch.
        self.stop.pressed.connect(self.stop_asked)
        self.fade_in.clicked.connect(self.fade_in_asked)
        row = hbox(self.sign, self.word, STRETCH, self.fade_in, spacing=10, margins=(6, 0, 0, 0))
        keep = self.fade_in.sizePolicy()
        keep.setRetainSizeWhenHidden(True)
        self.fade_in.setSizePolicy(keep)
        self.fade_in.hide()
        add_parts(self.column, row, (self.stop, 1))

    def show_view(self, view: OperatorView) -> None:
        if view.over:
            self._say("minus", "text2", "Force is off")
        elif view.force_on and self._felt:
            self._say("check", "ok", "Force is on")
        elif view.force_on:
            self._say("minus", "text2", "Visual only, no force")
        else:
            self._say("stop", "warn", "Force is off")
        self.fade_in.setVisible(not view.force_on and view.may_resume)

    def _say(self, icon: str, ink: str, word: str) -> None:
        self.sign.show_icon(icon, ink)  # type: ignore[arg-type]  # one of three literals above
        self.word.setText(word)
