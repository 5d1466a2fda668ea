"""Playing a study from the designer: what is said and asked, the header's controls, and the line below the header."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QActionGroup, QKeyEvent
from PySide6.QtWidgets import QMenu, QWidget

from study_app.designer.measures.cards import INKS
from study_app.gui.kit.commands import key_cap, keys_of, tip
from study_app.gui.theme.theme import Tone, font
from study_app.gui.theme.themed import apply_theme_within, remove_widget
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import add_parts, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Card, Icon
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import label

PlayAction: TypeAlias = Literal["play", "stop", "keep", "delete", "problems", "close"]

KEEP: tuple[tuple[PlayAction, str], ...] = (("keep", "Keep as pilot"), ("delete", "Delete"))


@dataclass(frozen=True, slots=True)
class PlayState:
    """A line with its buttons: what each asks for, and its words; ``listed`` are lines below it."""

    tone: Tone
    icon: str
    words: str
    actions: tuple[tuple[PlayAction, str], ...] = ()
    listed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PlayDevices:
    """The devices to play with: name and words of each, and the chosen one."""

    choices: tuple[tuple[str, str], ...] = ()
    chosen: str = ""

    @property
    def title(self) -> str:
        return dict(self.choices).get(self.chosen, "")


def asks_for_device(title: str, step: str, *, has_force: bool) -> PlayState:
    """Return the question before a device other than the scripted hand is used."""
    force = "The force fades in when a trial begins; hold" if has_force else "It has no force. Hold"
    words = f"Play from {step}, with the device {title}? {force} Esc to stop."
    return PlayState("warn", "device", words, (("play", "Play"), ("close", "Cancel")))


def refuses(problems: tuple[str, ...], most: int = 6) -> PlayState:
    """Return why the study cannot be played from here."""
    more = (f"and {len(problems) - most} more",) if len(problems) > most else ()
    words = "The study cannot be played from here: correct these problems first"
    return PlayState("bad", "warning", words, (("problems", "Show problems"), ("close", "Close")),
                     (*problems[:most], *more))  # fmt: skip


def under_way(step: str, title: str) -> PlayState:
    """Return what is said while a pilot is played."""
    words = f"Playing from {step}, with the device {title}. Hold Esc to stop."
    return PlayState("ok", "play", words, (("stop", "Stop"),))


def ended(step: str, how: str) -> PlayState:
    """Return the question after a pilot was played: whether its data are kept."""
    return PlayState("neutral", "flag", f"Played from {step}: {how}. Its data are deleted unless you keep them.", KEEP)


def kept(folder: str) -> PlayState:
    """Return where a pilot was kept."""
    return PlayState("ok", "check", f"Kept as a pilot in {folder}.", (("close", "Close"),))


PLAY, PLAY_NARROW = "Play from here", "Play"


class PlayControls(QWidget):
    """Signals: ``asked``, ``device_chosen`` (name)."""

    asked = Signal()
    device_chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.devices = PlayDevices()
        self.play = ActionButton("play", PLAY, key=keys_of("play")[0])
        self.play.setAccessibleName(PLAY)
        self.play.setToolTip(tip("play"))
        self.device = IconButton("device", "Device to play with")
        self.menu = QMenu(self)
        self.menu.setFont(font("label"))
        hbox(self.play, self.device, spacing=6, margins=0, parent=self)
        self.play.clicked.connect(self.asked)
        self.device.clicked.connect(lambda: self.menu.popup(self.device.mapToGlobal(self.device.rect().bottomLeft())))

    def show_devices(self, devices: PlayDevices) -> None:
        self.devices = devices
        self.menu.clear()
        group = QActionGroup(self.menu)
        for name, words in devices.choices:
            action = self.menu.addAction(words)
            action.setCheckable(True)
            action.setChecked(name == devices.chosen)
            group.addAction(action)
            action.triggered.connect(lambda _checked=False, name=name: self.device_chosen.emit(name))
        self.device.setToolTip(f"Device: {devices.title}")
        self.device.setAccessibleName(f"Device to play with: {devices.title}")

    def show_playing(self, playing: bool) -> None:
        self.play.setEnabled(not playing)
        self.device.setEnabled(not playing)

    def show_wide(self, wide: bool) -> None:
        self.play.show_action("play", PLAY if wide else PLAY_NARROW)


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
