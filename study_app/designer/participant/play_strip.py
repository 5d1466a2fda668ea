"""The line below the header that says what is played, and asks before and after."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget

from study_app.designer.participant.play import PlayState
from study_app.gui.kit.commands import key_cap
from study_app.gui.theme.themed import apply_theme_within, remove_widget
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import add_parts, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Card, Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Ink, label

INKS: dict[str, Ink] = {"ok": "ok", "warn": "warn", "bad": "bad", "accent": "accent", "neutral": "text2"}
ROLES = {"play": "primary", "stop": "danger", "delete": "danger"}
ICONS = {"play": "play", "stop": "stop", "keep": "save", "delete": "trash"}


class PlayStrip(Card):
    """Signals: ``asked`` (action), ``changed`` (whether there is one), ``left`` (it closes and had the keyboard)."""

    asked = Signal(str)
    changed = Signal(bool)
    left = Signal()

    def __init__(self) -> None:
        super().__init__(padding=10, gap=6)
        self.setAccessibleName("Playing")
        self.state: PlayState | None = None
        self.icon = Icon("play")
        self.words = label("", "body", wraps=True)
        self.buttons: dict[str, ActionButton] = {}
        self._lines: list[QWidget] = []
        self._row = hbox(self.icon, (self.words, 1), spacing=10)
        self._listed = vbox(spacing=2, margins=(30 + SHADOW, 0, 0, 0))
        add_parts(self.column, self._row, self._listed)
        self.hide()

    def show_state(self, state: PlayState | None) -> None:
        """Show another state, None for nothing; the first button takes the keyboard."""
        if state == self.state:
            return
        self.state = state
        focused = self.window().focusWidget()
        had_focus = focused is not None and self.isAncestorOf(focused)
        for part in (*self.buttons.values(), *self._lines):
            remove_widget(part)
        self.buttons, self._lines = {}, []
        self.setVisible(state is not None)
        self.changed.emit(state is not None)
        if state is None:
            if had_focus:
                self.left.emit()
            return
        self.icon.show_icon(state.icon, INKS[state.tone])
        self.words.setText(state.words)
        self.setAccessibleDescription(state.words)
        say(self, state.words)
        self._lines = [label(line, "label", "text2", wraps=True) for line in state.listed]
        add_parts(self._listed, *self._lines)
        for action, words in state.actions:
            cap = key_cap("stop") if action == "stop" else ""
            made = ActionButton(ICONS.get(action, ""), words, cap=cap, role=ROLES.get(action, ""), height=36)
            made.clicked.connect(lambda _checked=False, action=action: self.asked.emit(action))
            self._row.addWidget(made)
            made.show()  # at once: a part that is not shown cannot take the keyboard
            self.buttons[action] = made
        apply_theme_within(self, self.theme)
        if self.buttons:
            next(iter(self.buttons.values())).setFocus()  # of the window, once it is active again

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and "close" in self.buttons:
            self.asked.emit("close")
        else:
            super().keyPressEvent(event)
