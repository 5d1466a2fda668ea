"""The header (study, problems, draft, version, undo, redo, save), notices with their buttons, and *Play*."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from PySide6.QtCore import QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QActionGroup, QColor, QFocusEvent, QKeyEvent, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from study_app.designer.file import FileText
from study_app.designer.form.rows import Form
from study_app.designer.measures.cards import INKS
from study_app.designer.parts import KeysOpenList
from study_app.designer.problems import ProblemRow
from study_app.designer.version_rows import VersionChip
from study_app.gui.kit import choose_protocol, command_tip, key_cap, keys_of, with_key
from study_app.gui.theme import RADIUS_CARD, SHADOW, Themed, Tone, font, remove_widget
from study_app.gui.widgets import (
    STRETCH,
    ActionButton,
    Card,
    Chip,
    Icon,
    IconButton,
    PressedByEnter,
    add_parts,
    announce,
    chip_size,
    hbox,
    label,
    paint_chip,
    smooth_painter,
    vbox,
)
from study_app.number_text import counted

_MAX_PROBLEMS = 6
_KEEP_ACTIONS = (("keep", "Keep as pilot"), ("delete", "Delete"))
_ROLES = {"play": "primary", "copy": "primary", "stop": "danger", "delete": "danger"}
_ICONS = {"play": "play", "stop": "stop", "keep": "save", "delete": "trash"}


@dataclass(frozen=True, slots=True)
class Notice:
    """A notice with buttons, each with its action and text; ``listed`` are the lines below it.

    With ``closes`` it needs no answer and can be closed.
    """

    text: str
    actions: tuple[tuple[str, str], ...] = ()
    tone: Tone = "accent"
    icon: str = "info"
    listed: tuple[str, ...] = ()
    closes: bool = False


class NoticeCard(Card):
    """Shows a `Notice`; a notice about the study is tinted, one about playing focuses its first button.

    Signals: ``asked`` (the action of a button, or "close"); ``left``, emitted before it is hidden while it has the
    focus.
    """

    asked = Signal(str)
    left = Signal()

    def __init__(self, *, of_playing: bool) -> None:
        super().__init__(padding=10, gap=6)
        self._of_playing = of_playing
        self.notice: Notice | None = None
        self.buttons: dict[str, ActionButton] = {}
        self._lines: list[QWidget] = []
        self.icon, self.sentence = Icon("info", "accent", 20), label("", "body" if of_playing else "label", wraps=True)
        self.close_button = IconButton("cross", "Close this message", "Close (Esc)", size=36, role="plain")
        self.close_button.clicked.connect(lambda: self.asked.emit("close"))
        self._buttons = hbox(spacing=10)
        self._listed = vbox(spacing=2, margins=(30 + SHADOW, 0, 0, 0))
        across = hbox(self.icon, (self.sentence, 1), self._buttons, self.close_button, spacing=10)
        add_parts(self.column, across, self._listed)
        self.hide()

    def show_notice(self, notice: Notice | None) -> None:
        if notice == self.notice:
            return
        self.notice = notice
        if notice is None and self.isAncestorOf(self.window().focusWidget()):
            self.left.emit()  # otherwise Qt moves the focus to the next widget
        self.setVisible(notice is not None)
        for part in (*self.buttons.values(), *self._lines):
            remove_widget(part)
        self.buttons, self._lines = {}, []
        self.close_button.setVisible(notice is not None and notice.closes)
        self.sentence.setText("" if notice is None else notice.text)
        if notice is None:
            return
        self.setAccessibleDescription(notice.text)
        announce(self, notice.text)
        self.icon.show_icon(notice.icon, INKS[notice.tone])
        self._lines = [label(line, "label", "text2", wraps=True) for line in notice.listed]
        add_parts(self._listed, *self._lines)
        for action, text in notice.actions:
            icon, cap = _ICONS.get(action, "") if self._of_playing else "", key_cap("stop") if action == "stop" else ""
            button = ActionButton(icon, text, cap=cap, role=_ROLES.get(action, ""), height=36)
            button.clicked.connect(lambda _checked=False, action=action: self.asked.emit(action))
            self._buttons.addWidget(button)
            button.show()  # a hidden widget cannot take the focus
            self.buttons[action] = button
        if self._of_playing and self.buttons:
            next(iter(self.buttons.values())).setFocus()  # takes effect when the window is active again

    def close_by_key(self) -> bool:
        """Close the notice if possible; return whether it was closed."""
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
    """The devices for playing: their names and labels, and the name of the chosen one."""

    choices: tuple[tuple[str, str], ...] = ()
    chosen: str = ""

    @property
    def title(self) -> str:
        return dict(self.choices).get(self.chosen, "")


def device_question(title: str, step: str, *, has_force: bool) -> Notice:
    """Return the question that is shown before a device other than the simulated hand is used."""
    force = "The force fades in when a trial begins. Hold" if has_force else "This device does not produce force. Hold"
    question = f"Play from {step} using the device {title}? {force} Esc to stop."
    return Notice(question, (("play", "Play"), ("close", "Cancel")), "warn", "device")


def refusal_notice(problems: tuple[str, ...]) -> Notice:
    """Return the notice with the problems that prevent playing."""
    more = (f"and {len(problems) - _MAX_PROBLEMS} more",) if len(problems) > _MAX_PROBLEMS else ()
    sentence = "The study cannot be played from here: correct these problems first"
    actions = (("problems", "Show problems"), ("close", "Close"))
    return Notice(sentence, actions, "bad", "warning", (*problems[:_MAX_PROBLEMS], *more))


def playing_notice(step: str, title: str) -> Notice:
    """Return the notice shown while a pilot is played."""
    sentence = f"Playing from {step} using the device {title}. Hold Esc to stop."
    return Notice(sentence, (("stop", "Stop"),), "ok", "play")


def ended_notice(step: str, how: str) -> Notice:
    """Return the question whether to keep the data of a played pilot."""
    return Notice(
        f"Played from {step}: {how}. The recorded data will be deleted unless you save them.",
        _KEEP_ACTIONS,
        "neutral",
        "flag",
    )


def kept_notice(folder: str) -> Notice:
    """Return the notice with the folder of a kept pilot."""
    return Notice(f"Saved as a pilot in {folder}.", (("close", "Close"),), "ok", "check")


PLAY, PLAY_NARROW = "Play from here", "Play"


class _PlayControls(QWidget):
    """The button that plays the study, and its device menu. Signals: ``asked``, ``device_chosen`` (name)."""

    asked = Signal()
    device_chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.devices = PlayDevices()
        self.play = ActionButton("play", PLAY, key=keys_of("play")[0])
        self.play.setAccessibleName(PLAY)
        self.play.setToolTip(command_tip("play"))
        self.device = IconButton("device", "Playback device")
        self.menu = QMenu(self)
        self.menu.setFont(font("label"))
        hbox(self.play, self.device, spacing=6, margins=0, parent=self)
        self.play.clicked.connect(self.asked)
        self.device.clicked.connect(lambda: self.menu.popup(self.device.mapToGlobal(self.device.rect().bottomLeft())))

    def show_devices(self, devices: PlayDevices) -> None:
        self.devices = devices
        self.menu.clear()
        group = QActionGroup(self.menu)
        for name, title in devices.choices:
            action = self.menu.addAction(title)
            action.setCheckable(True)
            action.setChecked(name == devices.chosen)
            group.addAction(action)
            action.triggered.connect(lambda _checked=False, name=name: self.device_chosen.emit(name))
        self.device.setToolTip(f"Device: {devices.title}")
        self.device.setAccessibleName(f"Playback device: {devices.title}")

    def show_playing(self, playing: bool) -> None:
        self.play.setEnabled(not playing)
        self.device.setEnabled(not playing)


_NO_FILE: Final = FileText()
_NO_VERSION: Final = VersionChip()


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyChoice:
    """A study that can be opened."""

    title: str
    file: str  # the name of its file
    source: str  # the name or path by which it is opened
    shipped: bool = False  # whether it ships with the program
    original: str = ""  # the name of the study that it copies; "" if none is known

    @property
    def label(self) -> str:
        origin = "shipped" if self.shipped else self.original and f"copy of {self.original}"
        return f"{self.title}  ·  {self.file}" + (f"  ({origin})" if origin else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class HeaderState:
    """The content of the header."""

    studies: tuple[StudyChoice, ...] = ()  # the studies that can be opened
    chosen: str = ""  # the source of the open study; "" if none
    problems: tuple[Tone, str, str] = ("ok", "check", "No problems")  # tone, icon and text of the chip
    draft: str = ""  # the note on the draft, "" without one
    # the titles of the steps to undo and redo; "" without one
    undo: str = ""
    redo: str = ""
    can_save: bool = False  # whether the study differs from its file, which can be written
    read_only: bool = False  # whether the study cannot be changed
    version: VersionChip = _NO_VERSION  # the version chip, and the text of the save button


@dataclass(frozen=True, slots=True)
class DesignerView:
    """The content of the designer except the outline, which follows later; without a form no study is open."""

    header: HeaderState = HeaderState()
    form: Form | None = None
    file: FileText = _NO_FILE
    problems: tuple[ProblemRow, ...] = ()
    banner: Notice | None = None


def problems_chip(count: int, warnings: int) -> tuple[Tone, str, str]:
    """Return tone, icon and text of the problems chip."""
    if count:
        return "bad", "warning", counted(count, "problem")
    if warnings:
        return "warn", "warning", counted(warnings, "warning")
    return "ok", "check", "No problems"


class _StudyList(KeysOpenList):
    """The studies that can be opened."""

    def add_study(self, study: StudyChoice, *, opened: bool) -> None:
        self.addItem(study.label, study.source)
        if opened:
            self.setItemData(self.count() - 1, f"{study.label}, open", Qt.ItemDataRole.AccessibleTextRole)


NEW, OPEN = "\0new", "\0open"
_WIDE_MIN_PX = 1180
NAME_MAX_PX, NAME_EDGES_PX = 300, 60
WIDEST_PROBLEMS, WIDEST_DRAFT, WIDEST_VERSION = "88 problems", "Draft kept 88:88", "1.8, was 1.8"
"""The widest text of each chip, for which there is always room, so that other texts do not move the header."""


class _ChipButton(Themed, PressedByEnter):
    """A chip that can be pressed; ``effect`` describes what that does."""

    def __init__(self, effect: str) -> None:
        super().__init__()
        self._effect = effect
        self.setProperty("role", "plain")
        self.setProperty("dense", "true")
        self._state: tuple[Tone, str, str] = ("ok", "check", "")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def show_state(self, tone: Tone, icon: str, text: str) -> None:
        self._state = (tone, icon, text)
        self.setAccessibleName(f"{text}: {self._effect}")
        self.updateGeometry()
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(chip_size(self.chip_text, small=False).width(), 32)

    def minimumSizeHint(self) -> QSize:
        return self.sizeHint()

    @property
    def chip_text(self) -> str:
        return self._state[2]

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = smooth_painter(self)
        body = QRectF(0, self.height() / 2 - 14, self.sizeHint().width(), 28)
        paint_chip(painter, body, self.theme, *self._state, small=False)
        if self.hasFocus():
            painter.setPen(QPen(QColor(self.theme.accent), 2))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(body.adjusted(1, 0, -1, 0), 13, 13)


class DesignerHeader(QWidget):
    """The header. Signals: ``study_asked`` (source), ``new_asked``, undo, redo, save.

    ``keyboard_left`` is emitted when a focused button is about to be disabled, and after a click between the buttons or
    on a disabled one.
    """

    study_asked = Signal(str)
    new_asked = Signal()
    keyboard_left = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Header")
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.state = HeaderState()
        self.study = _StudyList()
        self.study.setAccessibleName("Study")
        self.study.setFont(font("body"))
        self.study.setMinimumWidth(150)
        self.study.setMaxVisibleItems(24)
        self.study.setPlaceholderText("Choose a study")
        self.problems = _ChipButton("show the list")
        self.problems.setToolTip(f"{command_tip('problems')}; {command_tip('next problem')}")
        self.version = _ChipButton("show the changes")
        self.draft = Chip("neutral", "save", "")
        self.keys = IconButton("question", "Keys")
        self.undo = IconButton("undo", "Undo")
        self.redo = IconButton("redo", "Redo")
        self.save = ActionButton("save", "Save", role="primary")
        self.play = _PlayControls()
        self.strip = NoticeCard(of_playing=True)
        self.strip.setAccessibleName("Playing")
        self.strip.left.connect(self.play.play.setFocus)
        self._row = hbox(spacing=10, margins=(SHADOW, 0, SHADOW, 0))
        vbox(self._row, self.strip, margins=0, parent=self)
        self.title = label("Study designer", "title")
        self.title.setContentsMargins(0, 0, 6, 0)  # a margin that is hidden together with the title
        left = self.title, self.study, self.problems, self.draft, self.version
        add_parts(self._row, *left, STRETCH, self.keys, self.undo, self.redo, self.play, self.save)
        self.study.activated.connect(self._choose_study)
        self.show_state(self.state)

    def show_state(self, state: HeaderState) -> None:
        before, self.state = self.state, state
        self._announce_changes(before, state)
        if state.studies != before.studies or state.chosen != before.chosen or not self.study.count():
            with QSignalBlocker(self.study):
                self.study.clear()
                for study in state.studies:
                    self.study.add_study(study, opened=study.source == state.chosen)
                self.study.addItem("New study…", NEW)
                self.study.addItem("Open file…", OPEN)
                self.study.setCurrentIndex(self.study.findData(state.chosen) if state.chosen else -1)
        is_open = bool(state.chosen)
        for part in (self.problems, self.undo, self.redo, self.play, self.save):
            part.setVisible(is_open)
        self.problems.show_state(*state.problems)
        self.draft.show_state("neutral", "save", state.draft)
        self.version.show_state(state.version.tone, state.version.icon, state.version.text)
        self.version.setToolTip(state.version.tip)
        for button, action, step_title in ((self.undo, "undo", state.undo), (self.redo, "redo", state.redo)):
            text = ": ".join(filter(None, (action.capitalize(), step_title)))
            self._set_enabled(button, on=bool(step_title) and not state.read_only)
            button.setAccessibleName(text)
            button.setToolTip(with_key(text, action))
        self.save.show_action("save", state.version.save)
        self._set_enabled(self.save, on=state.can_save)
        self._fit_parts()

    def _set_enabled(self, button: QWidget, *, on: bool) -> None:
        """Enable or disable a button; Qt would move the focus from a disabled button to the next widget."""
        if not on and self.window().focusWidget() is button:
            self.keyboard_left.emit()
        button.setEnabled(on)

    def _fit_parts(self) -> None:
        """Hide the title, then the version, if the name of the study is too long; the draft is always shown."""
        state = self.state
        name_px = min(NAME_MAX_PX, self.study.fontMetrics().horizontalAdvance(self.study.currentText()) + NAME_EDGES_PX)
        missing_px = max(0, name_px - self.study.minimumWidth())
        widest = ((self.problems, WIDEST_PROBLEMS), (self.draft, WIDEST_DRAFT), (self.version, WIDEST_VERSION))
        for chip, text in widest:
            chip.setMinimumWidth(chip_size(text, small=False).width())
        self.title.show()
        self.draft.setVisible(bool(state.chosen and state.draft))
        self.version.setVisible(bool(state.chosen and state.version.text))
        for part in (self.title, self.version):
            self._row.invalidate()
            part.setVisible(part.isVisibleTo(self) and self._row.minimumSize().width() + missing_px <= self.width())

    def _announce_changes(self, before: HeaderState, state: HeaderState) -> None:
        """Announce changes that the user did not request: other problems, and a stored draft."""
        if not state.chosen or state.chosen != before.chosen:
            return
        if state.problems != before.problems:
            announce(self, state.problems[2])
        if state.draft.startswith("Draft") and not before.draft.startswith("Draft"):
            announce(self, state.draft)

    def focusInEvent(self, _event: QFocusEvent) -> None:
        self.keyboard_left.emit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.play.play.show_action("play", PLAY if self.width() >= _WIDE_MIN_PX else PLAY_NARROW)
        self._fit_parts()

    def _choose_study(self, index: int) -> None:
        source = self.study.itemData(index)
        self.study.setCurrentIndex(self.study.findData(self.state.chosen) if self.state.chosen else -1)
        if source == NEW:
            self.new_asked.emit()
        elif source == OPEN:
            self.open_file()
        elif source != self.state.chosen:
            self.study_asked.emit(source)

    def open_file(self) -> None:
        if chosen := choose_protocol(self, "Open study"):
            self.study_asked.emit(chosen)
