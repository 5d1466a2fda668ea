"""A user of the designer who knows the parts of its windows by their names: one with keys alone, one with the mouse.

Each key, typed text, click, drag and notch of the wheel is an action. A part that cannot be reached fails.
"""

from collections.abc import Callable

from PySide6.QtCore import QModelIndex
from PySide6.QtWidgets import QAbstractButton, QApplication, QComboBox, QWidget

from study_app.gui.designer.form.element_form import FormCard
from study_app.gui.designer.outline.card import OutlineCard
from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.gui.participant.window import ParticipantWindow
from tests.app.designer.support.inputs import XInput, happens

PATIENCE_MS = 30_000


def wait_until(found: Callable[[], object], what: str, ms: int = PATIENCE_MS) -> None:
    """Handle events until something is so."""
    assert happens(found, ms), f"waited {ms / 1000:g} s in vain for {what}"


def name_of(part: QWidget) -> str:
    """Return what a screen reader calls a part."""
    return part.accessibleName() or (part.text() if isinstance(part, QAbstractButton) else "")


def window_in_front() -> QWidget | None:
    """Return the window that takes keys: an open list, a dialog, or the active window."""
    return QApplication.activePopupWidget() or QApplication.activeModalWidget() or QApplication.activeWindow()


class User:
    """What users share; ``actions`` counts what was done."""

    def __init__(self, window: QWidget, hand: XInput) -> None:
        self.window, self.hand = window, hand
        self.actions = 0

    # looking

    def parts(self, name: str, *kinds: type[QWidget]) -> list[QWidget]:
        """Return the parts of some kinds in the window in front that are shown under a name; it may end in "*"."""
        inside = window_in_front() or self.window
        found = []
        for part in inside.findChildren(QWidget):
            called = name_of(part)
            fits = called.startswith(name[:-1]) if name.endswith("*") else called == name
            if fits and isinstance(part, kinds or QWidget) and part.isVisible() and part.isEnabled():
                found.append(part)
        return found

    def part(self, name: str, *kinds: type[QWidget]) -> QWidget:
        """Return the part of a name; wait for it. One of the form comes before others."""
        what = f"a part called {name!r}"
        wait_until(lambda: self.parts(name, *kinds), what)  # the designer may still be loading
        (form,) = self.window.findChildren(FormCard) or (None,)
        return min(self.parts(name, *kinds), key=lambda part: form is None or not form.isAncestorOf(part))

    def sees(self, name: str) -> bool:
        """Return whether a part of a name is shown."""
        return bool(self.parts(name))

    @property
    def outline(self) -> OutlineCard:
        """The outline."""
        (found,) = self.window.findChildren(OutlineCard)
        return found

    def row(self, title: str, section: str = "") -> QModelIndex:
        """Return the row of the outline with a title, below another one or its heading where one is given."""

        def look() -> QModelIndex | None:
            heading = ""
            for index in self.outline.indexes():
                row, above = index.data(ROW_ROLE), index.parent()
                heading = heading if row.path else row.title
                around = [above.data(ROW_ROLE).title] if above.isValid() else []
                if row.title == title and row.path and (not section or section == heading or section in around):
                    return index
            return None

        wait_until(look, f"{title!r} in the outline", 5000)
        found = look()
        assert found is not None
        return found

    # what each does in their way

    def key(self, keys: str, times: int = 1) -> None:
        """Press keys."""
        for _ in range(times):
            self.actions += 1
            self.hand.key(keys)

    def type(self, text: str) -> None:
        """Type a text: one action."""
        self.actions += 1
        self.hand.write(text)

    def press(self, name: str) -> None:
        """Press a button."""
        raise NotImplementedError

    def write(self, name: str, text: str, *, accept: bool = True) -> None:
        """Write a text or a number in a field, in place of what is there; by keys Enter accepts it."""
        raise NotImplementedError

    def choose(self, name: str, words: str) -> None:
        """Choose one of several words."""
        raise NotImplementedError

    def select(self, title: str, section: str = "") -> None:
        """Select an element in the outline."""
        raise NotImplementedError

    def add(self, words: str) -> None:
        """Add what the list of additions calls so."""
        raise NotImplementedError

    def shortcut(self, keys: str, button: str) -> None:
        """Do what has a key and a button."""
        raise NotImplementedError

    def answer(self, window: ParticipantWindow) -> None:
        """Answer the page of a participant, each question with its third answer; or go on from it."""
        raise NotImplementedError


def place_of(box: QComboBox, words: str) -> int:
    """Return which entry of a list has some words; those in brackets behind may be left out."""
    entries = [box.itemText(at) for at in range(box.count())]
    found = [at for at, entry in enumerate(entries) if entry == words or entry.startswith(f"{words} (")]
    assert found, f"{words!r} is not among {entries}"
    return found[0]
