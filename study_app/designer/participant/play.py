"""A line below the header with what is said and asked, of the study or of playing it, and the controls that play."""

from dataclasses import dataclass

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QActionGroup, QColor, QKeyEvent, QPaintEvent
from PySide6.QtWidgets import QMenu, QWidget

from study_app.designer.measures.cards import INKS
from study_app.gui.kit.commands import key_cap, keys_of, tip
from study_app.gui.theme.theme import RADIUS_CARD, Tone, font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.accessible import say
from study_app.gui.widgets.boxes import add_parts, hbox, vbox
from study_app.gui.widgets.cards import SHADOW, Card, Icon, smooth_painter
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import label

MOST_PROBLEMS = 6
KEEP = (("keep", "Keep as pilot"), ("delete", "Delete"))
ROLES = {"play": "primary", "copy": "primary", "stop": "danger", "delete": "danger"}
ICONS = {"play": "play", "stop": "stop", "keep": "save", "delete": "trash"}


@dataclass(frozen=True, slots=True)
class Notice:
    """A line with its buttons: what each asks for, and its words; ``listed`` are lines below it.

    ``closes`` says that it needs no answer and can be closed.
    """

    words: str
    actions: tuple[tuple[str, str], ...] = ()
    tone: Tone = "accent"
    icon: str = "info"
    listed: tuple[str, ...] = ()
    closes: bool = False

    @property
    def only_offers_copy(self) -> bool:
        return [action for action, _ in self.actions] == ["copy"]


class NoticeCard(Card):
    """Draws a `Notice`: that of the study is tinted, that of playing gives its first button the keyboard.

    Signals: ``asked`` (the action of a button, "close" of the one that closes it), ``changed`` (whether there is one),
    ``left`` before it is hidden while it has the keyboard.
    """

    asked = Signal(str)
    changed = Signal(bool)
    left = Signal()

    def __init__(self, *, of_playing: bool) -> None:
        super().__init__(padding=10, gap=6)
        self._of_playing, self._other = of_playing, False
        self.notice: Notice | None = None
        self.buttons: dict[str, ActionButton] = {}
        self._lines: list[QWidget] = []
        self.icon, self.words = Icon("info", "accent", 20), label("", "body" if of_playing else "label", wraps=True)
        self.close_button = IconButton("cross", "Close this line", "Close (Esc)", size=36, role="plain")
        self.close_button.clicked.connect(lambda: self.asked.emit("close"))
        self._buttons = hbox(spacing=10)
        self._listed = vbox(spacing=2, margins=(30 + SHADOW, 0, 0, 0))
        across = hbox(self.icon, (self.words, 1), self._buttons, self.close_button, spacing=10)
        add_parts(self.column, across, self._listed)
        self.hide()

    def show_notice(self, notice: Notice | None) -> None:
        if notice == self.notice:
            return
        self.notice = notice
        self.make_room(other=self._other)
        for part in (*self.buttons.values(), *self._lines):
            remove_widget(part)
        self.buttons, self._lines = {}, []
        self.changed.emit(notice is not None)
        self.close_button.setVisible(notice is not None and notice.closes)
        self.words.setText("" if notice is None else notice.words)
        if notice is None:
            return
        self.setAccessibleDescription(notice.words)
        say(self, notice.words)
        self.icon.show_icon(notice.icon, INKS[notice.tone])
        self._lines = [label(line, "label", "text2", wraps=True) for line in notice.listed]
        add_parts(self._listed, *self._lines)
        for action, words in notice.actions:
            icon, cap = ICONS.get(action, "") if self._of_playing else "", key_cap("stop") if action == "stop" else ""
            made = ActionButton(icon, words, cap=cap, role=ROLES.get(action, ""), height=36)
            made.clicked.connect(lambda _checked=False, action=action: self.asked.emit(action))
            self._buttons.addWidget(made)
            made.show()  # at once: a part that is not shown cannot take the keyboard
            self.buttons[action] = made
        if self._of_playing and self.buttons:
            next(iter(self.buttons.values())).setFocus()  # of the window, once it is active again

    def make_room(self, *, other: bool) -> None:
        """Hide what needs no answer while another line is shown (``other``)."""
        self._other = other
        shown = self.notice is not None and not (other and self.notice.only_offers_copy)
        if not shown and self.isAncestorOf(self.window().focusWidget()):
            self.left.emit()  # else Qt hands the keyboard to the next part
        self.setVisible(shown)

    def close_by_key(self) -> bool:
        """Close a line that can be closed; return whether there was one."""
        closes = self.isVisible() and self.notice is not None and (self.notice.closes or "close" in self.buttons)
        if closes:
            self.asked.emit("close")
        return closes

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() != Qt.Key.Key_Escape or not (self._of_playing and self.close_by_key()):
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        if self._of_playing:
            super().paintEvent(event)
            return
        painter = smooth_painter(self)
        painter.setPen(QColor(self.theme.accent))
        painter.setBrush(QColor(self.theme.selected))
        body = QRectF(self.rect()).adjusted(SHADOW, SHADOW - 1, -SHADOW, -SHADOW - 1).adjusted(0.5, 0.5, -0.5, -0.5)
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)


@dataclass(frozen=True, slots=True)
class PlayDevices:
    """The devices to play with: name and words of each, and the chosen one."""

    choices: tuple[tuple[str, str], ...] = ()
    chosen: str = ""

    @property
    def title(self) -> str:
        return dict(self.choices).get(self.chosen, "")


def asks_for_device(title: str, step: str, *, has_force: bool) -> Notice:
    """Return the question before a device other than the scripted hand is used."""
    force = "The force fades in when a trial begins; hold" if has_force else "It has no force. Hold"
    words = f"Play from {step}, with the device {title}? {force} Esc to stop."
    return Notice(words, (("play", "Play"), ("close", "Cancel")), "warn", "device")


def refuses(problems: tuple[str, ...]) -> Notice:
    """Return why the study cannot be played from here."""
    more = (f"and {len(problems) - MOST_PROBLEMS} more",) if len(problems) > MOST_PROBLEMS else ()
    words = "The study cannot be played from here: correct these problems first"
    actions = (("problems", "Show problems"), ("close", "Close"))
    return Notice(words, actions, "bad", "warning", (*problems[:MOST_PROBLEMS], *more))


def under_way(step: str, title: str) -> Notice:
    """Return what is said while a pilot is played."""
    words = f"Playing from {step}, with the device {title}. Hold Esc to stop."
    return Notice(words, (("stop", "Stop"),), "ok", "play")


def ended(step: str, how: str) -> Notice:
    """Return the question after a pilot was played: whether its data are kept."""
    return Notice(f"Played from {step}: {how}. Its data are deleted unless you keep them.", KEEP, "neutral", "flag")


def kept(folder: str) -> Notice:
    """Return where a pilot was kept."""
    return Notice(f"Kept as a pilot in {folder}.", (("close", "Close"),), "ok", "check")


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
