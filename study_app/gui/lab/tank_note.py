"""What lies over the tank when something must be said: what is waited for, what went wrong, that the force is off."""

from PySide6.QtCore import QEvent, QObject, QTimer, Signal
from PySide6.QtWidgets import QProgressBar, QWidget

from study_app.gui.widgets.boxes import add_parts, hbox
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Ink, label
from study_app.viewmodels.lab import LabView

SHOWN_AFTER_MS = 300
WIDTH, WIDEST, HIGH = 380, 640, 110
EDGE, FOOT = 16, 56


class TankNote(Card):
    """One sentence and one button; nothing while all is well. Waiting is shown only after 300 ms."""

    cancel_asked = Signal()
    fade_in_asked = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(padding=12, gap=8)
        self.setParent(parent)
        self._view: LabView | None = None
        self.sign = Icon("clock", "text2", 18)
        self.words = label("", "strong", wraps=True)
        self.cancel = ActionButton("", "Cancel", height=36)
        self.fade_in = ActionButton("", "Fade in again", role="primary", height=36)
        self.dismiss = ActionButton("", "Close", height=36)
        self._dismissed = ""
        self.bar = QProgressBar()
        self.bar.setRange(0, 0)
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(6)
        row = hbox(self.sign, (self.words, 1), self.cancel, self.fade_in, self.dismiss, spacing=10)
        add_parts(self.column, row, self.bar)
        self.cancel.clicked.connect(self.cancel_asked)
        self.fade_in.clicked.connect(self.fade_in_asked)
        self.dismiss.clicked.connect(self._put_away)
        self._wait = QTimer(self)
        self._wait.setSingleShot(True)
        self._wait.setInterval(SHOWN_AFTER_MS)
        self._wait.timeout.connect(self._appear)
        parent.installEventFilter(self)
        self.hide()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Resize:
            self.place()
        return super().eventFilter(watched, event)

    def show_view(self, view: LabView) -> None:
        before, self._view = self._view, view
        if view.busy and not view.trouble:
            if self.isHidden() and not self._wait.isActive():
                self._wait.start()
            if not self.isHidden():
                self._appear()
            return
        self._wait.stop()
        self._dismissed = self._dismissed if view.trouble == self._dismissed else ""
        if view.force_on and view.trouble == self._dismissed:
            self.hide()
        elif self.isHidden() or before is None or _said(before) != _said(view):
            self._appear()

    def place(self) -> None:
        """Stand in the middle of the tank's lower edge; what takes many words is wider, and never above the tank."""
        parent = self.parentWidget()
        if parent is not None and not self.isHidden():
            room = parent.width() - 2 * EDGE
            width = min(WIDTH, room)
            if self.heightForWidth(width) > HIGH:
                width = min(WIDEST, room)
            self.resize(width, max(self.minimumSizeHint().height(), self.heightForWidth(width)))
            below = min(FOOT, parent.height() - self.height() - EDGE)
            self.move((parent.width() - width) // 2, max(0, parent.height() - self.height() - below))

    def _put_away(self) -> None:
        """Say this trouble no more; the force is on all the while."""
        if self._view is not None:
            self._dismissed = self._view.trouble
        self.hide()

    def _appear(self) -> None:
        view = self._view
        if view is None:
            return
        icon, ink, words = _said(view)
        self.sign.show_icon(icon, ink)
        self.words.setText(words)
        self.setAccessibleName(words)
        waiting = bool(view.busy) and not view.trouble
        self.bar.setVisible(waiting)
        self.cancel.setVisible(waiting)
        self.fade_in.setVisible(not waiting and not view.force_on and view.may_fade_in)
        self.fade_in.show_action("", "Try again" if view.trouble else "Fade in again")
        self.dismiss.setVisible(bool(view.trouble) and view.force_on)
        self.show()
        self.raise_()
        self.place()


def _said(view: LabView) -> tuple[str, Ink, str]:
    if view.trouble:
        return "warning", "bad", view.trouble
    if view.busy:
        return "clock", "text2", f"{view.busy}\u00a0…"
    return "stop", "warn", "Force is off"
