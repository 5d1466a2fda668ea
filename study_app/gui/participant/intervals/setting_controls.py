"""Less, more and done, under the tank: by buttons, arrows, wheel and Enter, without a number and without end marks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QPushButton, QWidget

from study_app.gui.participant.intervals.answer_page import sized
from study_app.gui.participant.pages.key_caps import GoButton
from study_app.gui.widgets.boxes import hbox
from study_app.session.device_buttons import STEP_S
from study_app.session.pages import TaskPage
from study_app.session.transitions.events import Stepped, Submitted

if TYPE_CHECKING:
    from study_app.gui.participant.tank.captions import Captions
    from study_app.protocol.wording.languages import Words

STEP_MS: Final = round(1000 * STEP_S)
NOTCH: Final = 120  # of a wheel [eighths of a degree]
BUTTON_PX: Final = (120, 48)
GAP_PX: Final = 16
LEAST_PX: Final = 44
TEXT_PX: Final = 18
KEYS: Final = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}


class SettingControls(QWidget):
    """Says which way the participant moves the level, and that it is set; shown only while it can be set.

    The left key and button are less in every language. What is held makes a step every `STEP_MS`. ``event_made``
    carries the session's events. Without ``buttons``, where no pointer is shown, keys and wheel alone are heard.
    """

    event_made = Signal(object)

    def __init__(
        self, page: TaskPage, words: Words, clock: Callable[[], float], parent: QWidget, *, buttons: bool
    ) -> None:
        super().__init__(parent)
        self._room = parent
        self._clock = clock
        self._adjusts = page.adjusts
        self._buttons = buttons
        self._held = 0
        self._turned = 0
        self._timer = QTimer(self)
        self._timer.setInterval(STEP_MS)
        self._timer.timeout.connect(lambda: self._step(self._held))
        self.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self.less, self.more = (QPushButton(text, self) for text in (f"← {words.less}", f"{words.more} →"))
        self.done = GoButton(words.done, words.enter_key, self)
        hbox(self.less, self.more, self.done, spacing=GAP_PX, margins=0, parent=self)
        for button, name, way in ((self.less, words.less, -1), (self.more, words.more, 1)):
            button.setAccessibleName(name)
            button.setAccessibleDescription(page.question)
            button.setAutoRepeat(True)
            button.setAutoRepeatDelay(STEP_MS)
            button.setAutoRepeatInterval(STEP_MS)
            button.clicked.connect(lambda _=False, way=way: self._step(way))
        self.done.clicked.connect(self._confirm)
        for one in (self.less, self.more, self.done):
            one.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setVisible(self._adjusts and buttons)

    def turn_to(self, page: TaskPage) -> None:
        """Appear where the level of an interval is set, and go with it."""
        self._adjusts = page.adjusts
        self._let_go()
        self.setVisible(self._adjusts and self._buttons)

    def place(self, captions: Captions) -> None:
        """Lie at the foot of the tank among its words, above the way to pause where both have no room side by side."""
        scale = captions.small_scale
        width, height = (round(side * scale) for side in BUTTON_PX)
        for button in (self.less, self.more):
            button.setFont(sized(TEXT_PX * scale))
            button.setStyleSheet("padding: 0 12px; min-height: 0;")
            button.setFixedHeight(max(height, LEAST_PX))
            button.setMinimumWidth(width)
        self.done.set_scale(scale)
        self.adjustSize()
        x, y = (self._room.width() - self.width()) / 2, captions.controls_middle - self.height() / 2
        self.move(round(x), round(min(y, self._room.height() - self.height() - 4)))
        self.raise_()

    def press(self, event: QKeyEvent) -> bool:
        """Take a key that went down; say whether it was one of these."""
        way = KEYS.get(Qt.Key(event.key()), 0)
        if not self._adjusts or (not way and event.key() not in (Qt.Key.Key_Return, Qt.Key.Key_Enter)):
            return False
        if not event.isAutoRepeat():
            if way:
                self._held = way
                self._step(way)
                self._timer.start()
            else:
                self._confirm()
        return True

    def release(self, event: QKeyEvent) -> None:
        """Let go of a key."""
        if not event.isAutoRepeat() and KEYS.get(Qt.Key(event.key()), 0) == self._held:
            self._let_go()

    def turn_wheel(self, event: QWheelEvent) -> None:
        """Step with each notch of the wheel: forwards is more."""
        self._turned += event.angleDelta().y()
        steps = int(self._turned / NOTCH)
        self._turned -= steps * NOTCH
        self._step(steps)

    def _let_go(self) -> None:
        self._held = self._turned = 0
        self._timer.stop()

    def _step(self, steps: int) -> None:
        if self._adjusts and steps:
            self.event_made.emit(Stepped(self._clock(), steps))

    def _confirm(self) -> None:
        self._let_go()
        if self._adjusts:
            self.event_made.emit(Submitted(self._clock()))
