"""The window shown while a session starts, so that the program never looks frozen."""

import time
from collections.abc import Callable

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QAccessible, QCloseEvent, QKeyEvent
from PySide6.QtWidgets import QProgressBar, QWidget

from study_app.gui.theme.theme import LIGHT, Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.accessible import give_role
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Logo
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import figures, label
from study_app.number_text import clock_text

LONG_AFTER_S = 4.0
_STEP = "Preparing the device and the force model…"
FIRST_TIME = (
    "The force model is being compiled. This happens once after each installation or update and takes about a minute."
)


class OpeningWindow(QWidget):
    """The window shown while a session starts: progress, and Cancel (``cancelled``), which ends the preparation."""

    cancelled = Signal()

    def __init__(
        self, title: str, who: str, *, theme: Theme = LIGHT, now_s: Callable[[], float] = time.perf_counter
    ) -> None:
        super().__init__()
        self.setWindowTitle("Liquid Study")
        self.setProperty("role", "window")
        self.setFixedSize(560, 260)
        self.step = label(_STEP, "body", "text2", wraps=True)
        self.elapsed = figures("", "label", "text2")
        self.cancel = ActionButton("", "Cancel")
        self.cancel.clicked.connect(self.close)
        self._bar = QProgressBar(textVisible=False)
        self._bar.setRange(0, 0)
        self._bar.setFixedHeight(8)
        head = hbox(Logo(40), (vbox(label(title, "card"), label(who, "label", "text2"), spacing=2), 1), spacing=14)
        foot = hbox(self.cancel, STRETCH, self.elapsed)
        vbox(head, (self.step, 1), self._bar, foot, spacing=14, margins=(28, 24, 28, 24), parent=self)
        self._now_s, self._started_s = now_s, now_s()
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._show_elapsed)
        self._timer.start(250)
        self._done = False
        self._request_shown = False
        apply_theme(self, theme)
        give_role(self, QAccessible.Role.Window)

    def _show_elapsed(self) -> None:
        seconds = self._now_s() - self._started_s
        self.elapsed.setText(clock_text(seconds))
        if seconds > LONG_AFTER_S and not self._request_shown:
            self.step.setText(FIRST_TIME)

    def show_compiled(self, share: float) -> None:
        if not self._request_shown:
            self.step.setText(FIRST_TIME)
        self._bar.setRange(0, 100)
        self._bar.setValue(round(100 * share))

    def show_line(self, line: str) -> None:
        """Show what the device asks for, in place of the progress."""
        self._request_shown = True
        self.step.setText(line)

    def finish(self) -> None:
        self._done = True
        self._timer.stop()
        self.close()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Cancel on Esc, tapped or held: everything opened so far is closed, with zero force."""
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        self._timer.stop()
        super().closeEvent(event)
        if not self._done:
            self._done = True
            self.cancelled.emit()
