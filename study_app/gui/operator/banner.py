"""What went wrong and what to do, above everything else in the middle; away while all is well."""

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from study_app.gui.theme.theme import RADIUS_CARD
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label
from study_app.viewmodels.operator import OperatorView

WHAT_TO_DO = (
    "The force is off and every answer so far is on disk. End the session, fix the cause, then start a new one."
)
RECONNECT = (
    "The force is off and every answer so far is on disk. Plug in the device, then reconnect it. The session stays "
    "paused until you resume it; an interrupted trial starts again."
)
WAITS = (
    "The force is off and nothing is lost. Free disk space or reconnect the drive; the session then continues, paused."
)
AFTERWARDS = "The session is closed and the force is off. Everything in the journal is safe."


class Banner(Themed, QWidget):
    """A tinted strip with a sign, what happened, what to do, and a button where the device can be reconnected."""

    reconnect_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.what = label("", "strong", "bad", wraps=True)
        self.then = label(WHAT_TO_DO, "label", "text", wraps=True)
        words = vbox(self.what, self.then, spacing=4)
        sign = Icon("warning", "bad", 24), 0, Qt.AlignmentFlag.AlignTop
        self.reconnect = ActionButton("repeat", "Reconnect", key="C", role="primary")
        self.reconnect.clicked.connect(self.reconnect_asked)
        button = self.reconnect, 0, Qt.AlignmentFlag.AlignVCenter
        hbox(sign, (words, 1), button, spacing=14, margins=(20, 14, 20, 14), parent=self)
        self.reconnect.hide()
        self.hide()

    def show_view(self, view: OperatorView) -> None:
        if view.trouble != self.what.text():
            self.what.setText(view.trouble[:1].upper() + view.trouble[1:])
        offered = view.may_reconnect and not view.over
        advice = RECONNECT if offered else WAITS if view.waits else WHAT_TO_DO
        self.then.setText(AFTERWARDS if view.over else view.reconnection or advice)
        self.reconnect.setVisible(offered)
        self.reconnect.setEnabled(not view.reconnects)
        self.setVisible(bool(view.trouble))

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.bad_bg))
        strip = QRectF(self.rect()).adjusted(SHADOW, 0, -SHADOW, 0)
        painter.drawRoundedRect(strip, RADIUS_CARD, RADIUS_CARD)
