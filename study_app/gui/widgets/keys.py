"""The keys of the study designer: the one table for its shortcuts, its tips, its menu and its card of keys."""

from dataclasses import dataclass
from typing import Final

GROUPS: Final = ("Go to", "Selected element", "Study", "Inside a field")


@dataclass(frozen=True, slots=True)
class Keys:
    """The keys of one action.

    Attributes
    ----------
    action : str
        Which action.
    words : str
        What it does.
    keys : tuple of str
        Each does it.
    group : int
        Its group, of `GROUPS`.
    within : str
        Which part of the place listens to it; "" for a shortcut of the whole place.
    held : bool
        Whether the key is held, not pressed.
    """

    action: str
    words: str
    keys: tuple[str, ...]
    group: int
    within: str = ""
    held: bool = False

    @property
    def shown(self) -> tuple[str, ...]:
        """Its keys as they are written on a keyboard: "Ctrl+Enter", "hold Esc"."""
        return tuple(f"{'hold ' * self.held}{key_words(keys)}" for keys in self.keys)


LISTS: Final = "outline, lists"
KEYS: Final = (
    Keys("outline", "Outline", ("Ctrl+1",), 0),
    Keys("form", "Form", ("Ctrl+2",), 0),
    Keys("views", "Views, then their tabs", ("Ctrl+3",), 0),
    Keys("problems", "Problems", ("Ctrl+4",), 0),
    Keys("header", "Header", ("Ctrl+5",), 0),
    Keys("next part", "Next of these parts", ("F6",), 0),
    Keys("part before", "Previous part", ("Shift+F6",), 0),
    Keys("find", "Find in the study", ("Ctrl+F",), 0),
    Keys("next problem", "Next problem", ("F8",), 0),
    Keys("file", "File, and back", ("Ctrl+E",), 0),
    Keys("back", "Previous element", ("Alt+Left",), 0),
    Keys("page", "Participant's page", ("Ctrl+Return",), 0),
    Keys("leave page", "Leave that page", ("Escape",), 0, "page"),
    Keys("language", "That page in the next language", ("Ctrl+L",), 0),
    Keys("add", "Add", ("Insert",), 1),
    Keys("open entry", "Open what an entry names", ("Return",), 1, "lists"),
    Keys("duplicate", "Duplicate", ("Ctrl+D",), 1),
    Keys("series", "Copies that differ in one number", ("Ctrl+Shift+D",), 1),
    Keys("rename", "Rename", ("F2",), 1),
    Keys("delete", "Delete", ("Delete",), 1, LISTS),
    Keys("up", "Move up", ("Alt+Up",), 1),
    Keys("down", "Move down", ("Alt+Down",), 1),
    Keys("copy", "Copy", ("Ctrl+C",), 1, LISTS),
    Keys("paste", "Paste", ("Ctrl+V",), 1, LISTS),
    Keys("several", "Select several", ("Shift+Up", "Shift+Down"), 1, LISTS),
    Keys("new", "New study …", ("Ctrl+N",), 2),
    Keys("open", "Open file …", ("Ctrl+O",), 2),
    Keys("save", "Save", ("Ctrl+S",), 2),
    Keys("undo", "Undo", ("Ctrl+Z",), 2),
    Keys("redo", "Redo", ("Ctrl+Shift+Z", "Ctrl+Y"), 2),
    Keys("play", "Play from here", ("F5",), 2),
    Keys("stop", "Stop playing", ("Escape",), 2, "windows while playing", held=True),
    Keys("keys", "Keys", ("Shift+F1",), 2),
    Keys("next field", "Next field", ("Tab",), 3, "field"),
    Keys("accept", "Accept", ("Return",), 3, "field"),
    Keys("restore", "Restore", ("Escape",), 3, "field"),
    Keys("remove", "Remove its key from the file", ("Ctrl+Delete",), 3, "field"),
    Keys("count", "Count up, down", ("Up", "Down"), 3, "field"),
)
_OF: Final = {one.action: one for one in KEYS}
_NAMES: Final = {"Return": "Enter", "Escape": "Esc", "Insert": "Ins", "Delete": "Del"}


def keys_of(action: str) -> tuple[str, ...]:
    """Return the keys of an action, as Qt names them."""
    return _OF[action].keys


def key_words(keys: str) -> str:
    """Return keys as they are written on a keyboard: "Ctrl+Enter"."""
    return "+".join(_NAMES.get(key, key) for key in keys.split("+"))


def key_cap(action: str) -> str:
    """Return what the cap on the button of an action says: "Ctrl D"."""
    return _OF[action].shown[0].replace("+", " ")


def with_key(words: str, action: str) -> str:
    """Return words followed by the key of an action, for a tip: "Duplicate (Ctrl+D)"."""
    return f"{words} ({_OF[action].shown[0]})"


def tip(action: str) -> str:
    """Return what an action does, with its key."""
    return with_key(_OF[action].words, action)
