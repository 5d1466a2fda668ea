"""The table of keyboard commands, from which shortcuts, tips, buttons, menus and the list of keys are made."""

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Any, Final

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QAbstractButton, QWidget


@dataclass(frozen=True, slots=True)
class Command:
    """A keyboard command.

    Attributes
    ----------
    id, words : str
        The command's name in the program, and its description.
    keys : tuple of str
        Alternative keys.
    within : str
        The part of the window in which the keys work; "" for the whole window.
    held : bool
        Whether the key must be held down.
    run : callable
        The action in the study designer, called with the page; None if a part of the page handles it.
    """

    id: str
    words: str
    keys: tuple[str, ...]
    _: KW_ONLY
    within: str = ""
    held: bool = False
    run: Callable[[Any], object] | None = None

    @property
    def key_labels(self) -> tuple[str, ...]:
        """The keys as printed on a keyboard: "Ctrl+Enter", "hold Esc"."""
        return tuple(f"{'hold ' * self.held}{_key_label(keys)}" for keys in self.keys)

    def action(self, widget: QWidget, run: Callable[[], object]) -> QAction:
        """Add the command's action to a widget; its keys work anywhere in the window while the widget is shown."""
        action = QAction(self.words, widget, toolTip=_tip_text(self), shortcutContext=Qt.ShortcutContext.WindowShortcut)
        action.setShortcuts([QKeySequence(keys) for keys in self.keys])
        action.triggered.connect(lambda _checked=False: run())
        widget.addAction(action)
        return action


_IN_LISTS: Final = "outline, lists"
COMMANDS: Final = (
    Command("outline", "Outline", ("Ctrl+1",), run=lambda page: page.parts.focus_outline()),
    Command("form", "Form", ("Ctrl+2",), run=lambda page: page.parts.focus_form()),
    Command("views", "Views, then their tabs", ("Ctrl+3",), run=lambda page: page.parts.focus_pane()),
    Command("problems", "Problems", ("Ctrl+4",), run=lambda page: page.parts.focus_problems()),
    Command("header", "Header", ("Ctrl+5",), run=lambda page: page.parts.focus_header()),
    Command("next part", "Next part", ("F6",), run=lambda page: page.parts.cycle(1)),
    Command("part before", "Previous part", ("Shift+F6",), run=lambda page: page.parts.cycle(-1)),
    Command("find", "Find in the study", ("Ctrl+F",), run=lambda page: page.parts.focus_find()),
    Command("next problem", "Next problem", ("F8",), run=lambda page: page.open_next_problem()),
    Command("file", "Switch between form and file", ("Ctrl+E",), run=lambda page: page.parts.switch_to_file()),
    Command("home", "Home", ("Alt+Home",), run=lambda page: page.leave_for_home()),
    Command("back", "Previous element", ("Alt+Left",), run=lambda page: page.ask("back")),
    Command("next question", "Text of the next question", ("Alt+PgDown",), run=lambda page: page.write_question(1)),
    Command(
        "question before", "Text of the previous question", ("Alt+PgUp",), run=lambda page: page.write_question(-1)
    ),
    Command("page", "Participant's page", ("Ctrl+Return",)),
    Command("leave page", "Leave the page", ("Escape",), within="page"),
    Command("language", "Show the page in the next language", ("Ctrl+L",)),
    Command("add", "Add", ("Insert",), run=lambda page: page.ask_to_add()),
    Command("open entry", "Open the element that an entry refers to", ("Return",), within="lists"),
    Command("open liquid", "Open the liquid of a condition", ("Shift+Return",), within="lists"),
    Command("duplicate", "Duplicate", ("Ctrl+D",), run=lambda page: page.duplicate()),
    Command("series", "Make copies that differ in one number", ("Ctrl+Shift+D",), run=lambda page: page.make_series()),
    Command("rename", "Rename", ("F2",), run=lambda page: page.rename()),
    Command("delete", "Delete", ("Delete",), within=_IN_LISTS, run=lambda page: page.delete()),
    Command("up", "Move up", ("Alt+Up",), run=lambda page: page.move_by(-1)),
    Command("down", "Move down", ("Alt+Down",), run=lambda page: page.move_by(1)),
    Command("new", "New study…", ("Ctrl+N",), run=lambda page: page.begin_new()),
    Command("open", "Open file…", ("Ctrl+O",), run=lambda page: page.header.open_file()),
    Command("save", "Save", ("Ctrl+S",), run=lambda page: page.finish("save")),
    Command("undo", "Undo", ("Ctrl+Z",), run=lambda page: page.finish("undo")),
    Command("redo", "Redo", ("Ctrl+Shift+Z", "Ctrl+Y"), run=lambda page: page.finish("redo")),
    Command("play", "Play from here", ("F5",)),
    Command("stop", "Stop playing", ("Escape",), within="during playback", held=True),
    Command("keys", "Keys", ("Shift+F1",), run=lambda page: page.keys_asked.emit()),
    Command("next field", "Next field", ("Tab",), within="field"),
    Command("accept", "Accept", ("Return",), within="field"),
    Command("restore", "Restore", ("Escape",), within="field"),
    Command("remove", "Remove the key, scale point or hypothesis (×)", ("Ctrl+Delete",), within="field"),
    Command("count", "Increase, decrease", ("Up", "Down"), within="field"),
)
_BY_ID: Final = {command.id: command for command in COMMANDS}
_KEY_NAMES: Final = {"Return": "Enter", "Escape": "Esc", "Insert": "Ins", "Delete": "Del"}


def keys_markdown() -> str:
    """Return all commands with their keys as a Markdown table."""
    rows = (
        f"| {', '.join(command.key_labels)} | {command.words}{command.within and f' ({command.within})'} |"
        for command in COMMANDS
    )
    return "\n".join(("| key | action |", "| --- | --- |", *rows, ""))


def add_commands(widget: QWidget, runs: Mapping[str, Callable[[], object]]) -> dict[str, QAction]:
    """Add the actions of commands to a widget; return them by the commands' IDs."""
    return {command_id: _BY_ID[command_id].action(widget, run) for command_id, run in runs.items()}


def connect_button(button: QAbstractButton, action: QAction) -> None:
    """Connect a button to an action, with its tip and enabled state."""
    button.setToolTip(action.toolTip())
    button.clicked.connect(action.trigger)
    action.enabledChanged.connect(button.setEnabled)


def keys_of(action: str) -> tuple[str, ...]:
    """Return the keys of an action in Qt's notation."""
    return _BY_ID[action].keys


def _key_label(keys: str) -> str:
    """Return keys as printed on a keyboard: "Ctrl+Enter"."""
    return "+".join(_KEY_NAMES.get(key, key) for key in keys.split("+"))


def key_cap(action: str) -> str:
    """Return the key cap's text on an action's button: "Ctrl D"."""
    return _BY_ID[action].key_labels[0].replace("+", " ")


def with_key(text: str, action: str) -> str:
    """Return a tip with the key of an action: "Duplicate (Ctrl+D)"."""
    return _tip_text(_BY_ID[action], text)


def _tip_text(command: Command, text: str = "") -> str:
    return f"{text or command.words} ({command.key_labels[0]})"


def command_tip(action: str) -> str:
    """Return the tip of an action, with its key."""
    return with_key(_BY_ID[action].words, action)
