"""The driver of the designer's window: parts by their names, keys, texts and clicks of a user.

`User` looks; `KeyUser` has keys alone, `MouseUser` has the mouse and types only texts. Each key, typed text, click and
notch of the wheel is an action. A part that cannot be reached fails.
"""

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QModelIndex, QObject, QPoint, QRect
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QScrollArea,
    QWidget,
)

from study_app.designer.outline import ROW_ROLE
from study_app.gui.participant.window import ParticipantWindow
from study_app.session.pages import ChoicePage, QuestionnairePage
from tests.designer.support.inputs import Hand, name_of, wait_until, window_in_front

MOST_TABS = 120
COLUMN_PX = 400
STEP_MS = 40
VIEWS = "Study viewThe tabs of the views, to which their key goes when it is pressed again."
AREAS = (("Header", "ctrl+5"), ("Outline", "ctrl+1"), ("Form", "ctrl+2"), ("Study views", "ctrl+3"))


def place_of(box: QComboBox, words: str) -> int:
    """Return the position of the entry with a text; a suffix in brackets may be omitted."""
    entries = [box.itemText(at) for at in range(box.count())]
    positions = [at for at, entry in enumerate(entries) if entry == words or entry.startswith(f"{words} (")]
    assert positions, f"{words!r} is not among {entries}"
    return positions[0]


def are_segments(part: QObject | None) -> bool:
    """Return whether a part is a row of buttons, of which one is chosen."""
    return part is not None and part.property("role") == "segments"


def _of_a_group(focused: QWidget, part: QWidget) -> bool:
    """Return whether two buttons are of one group, in which the arrow keys go from one to another."""
    if not (isinstance(focused, QAbstractButton) and isinstance(part, QAbstractButton)):
        return False
    return focused.group() is not None and focused.group() is part.group()


class User:
    """The base class of users; ``actions`` counts their actions."""

    def __init__(self, window: QWidget, hand: Hand) -> None:
        self.window, self.hand = window, hand
        self.actions = 0

    def parts(self, name: str, *kinds: type[QWidget]) -> list[QWidget]:
        """Return the visible widgets of some kinds in the front window with a name, which may end in "*"."""
        inside = window_in_front() or self.window
        parts = []
        for part in inside.findChildren(QWidget):
            called = name_of(part)
            fits = called.startswith(name[:-1]) if name.endswith("*") else called == name
            if fits and isinstance(part, kinds or QWidget) and part.isVisible() and part.isEnabled():
                parts.append(part)
        return parts

    def part(self, name: str, *kinds: type[QWidget]) -> QWidget:
        """Wait for the widget with a name and return it, preferring those of the form."""
        what = f"a part called {name!r}"
        wait_until(lambda: self.parts(name, *kinds), what)  # the designer may still be loading
        form = self.area("Form")
        return min(self.parts(name, *kinds), key=lambda part: form is None or not form.isAncestorOf(part))

    def sees(self, name: str) -> bool:
        """Return whether a widget with a name is shown."""
        return bool(self.parts(name))

    def area(self, name: str) -> Any:
        """Return the widget of the designer's window with a name, or None before it is loaded."""
        return next((widget for widget in self.window.findChildren(QWidget) if widget.accessibleName() == name), None)

    @property
    def outline(self) -> Any:
        """Return the outline."""
        return self.area("Outline")

    def row(self, title: str, section: str = "") -> QModelIndex:
        """Return the row of the outline with a title, optionally below another row or heading."""

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
        index = look()
        assert index is not None
        return index

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
        """Add the element with this name in the list of additions."""
        raise NotImplementedError

    def shortcut(self, keys: str, button: str) -> None:
        """Run a command that has both a key and a button."""
        raise NotImplementedError

    def answer(self, window: ParticipantWindow) -> None:
        """Answer each question of a participant's page with its third answer, or continue."""
        raise NotImplementedError


class KeyUser(User):
    """A user who uses only keys."""

    def reach(self, part: QWidget) -> None:
        """Move the focus to a widget: to its area by Ctrl and a digit, then by Tab."""
        focused = self._focused()
        if focused is not None and self._is_at(part, focused):
            return
        for name, keys in AREAS:
            area = self.area(name)
            if area is not None and area.isAncestorOf(part) and not (focused and area.isAncestorOf(focused)):
                self.key(keys, 2 if part.accessibleName() == VIEWS else 1)
        names: list[str] = []
        keys = self._leads(self._focused(), part)
        for _ in range(MOST_TABS):
            focused = self._focused()
            if focused is not None and self._is_at(part, focused):
                return
            if focused is not None and _of_a_group(focused, part):
                self._go_within_group(part)
                return
            names.append("" if focused is None else name_of(focused))
            self.key(keys)
        raise AssertionError(f"{name_of(part)!r} is not reached by Tab, which goes through {names[-30:]}")

    @staticmethod
    def _focused() -> QWidget | None:
        popup = QApplication.activePopupWidget()
        return QApplication.focusWidget() if popup is None else popup.focusWidget()

    @staticmethod
    def _is_at(part: QWidget, focused: QWidget) -> bool:
        return focused is part or focused is part.focusProxy()

    @staticmethod
    def _leads(focused: QWidget | None, part: QWidget) -> str:
        """Return the key that leads to a widget: Tab goes down columns, then to the right."""
        # `QWidget.nextInFocusChain` would tell, but its wrappers own each other: they take parts of the program along
        if focused is None:
            return "Tab"
        way = part.mapToGlobal(QPoint(0, 0)) - focused.mapToGlobal(QPoint(0, 0))
        across = abs(way.x()) > COLUMN_PX or abs(way.y()) <= 8
        return "Tab" if (way.x() if across else way.y()) >= 0 else "shift+Tab"

    def _go_within_group(self, part: QWidget) -> None:
        """Go to a button of the group that the focused one belongs to, by the arrow keys."""
        for _ in range(30):
            focused = self._focused()
            assert focused is not None
            if focused is part:
                return
            way = part.mapToGlobal(part.rect().center()) - focused.mapToGlobal(focused.rect().center())
            upright = abs(way.y()) > abs(way.x()) / 4 and not are_segments(focused.parent())
            keys = ("Up", "Down") if upright else ("Left", "Right")
            before = focused
            self.key(keys[(way.y() if upright else way.x()) > 0])
            assert self._focused() is not before, f"no arrow key leads to {name_of(part)!r}"

    def press(self, name: str) -> None:
        self.reach(self.part(name, QAbstractButton))
        self.key("space")

    def write(self, name: str, text: str, *, accept: bool = True) -> None:
        part = self.part(name, QLineEdit, QPlainTextEdit)
        self.reach(part)
        several = isinstance(part, QPlainTextEdit)
        if several or not (isinstance(part, QLineEdit) and part.selectedText() == part.text()):
            self.key("ctrl+a")
        self.type(text)
        if accept and not several:
            self.key("Return")

    def choose(self, name: str, words: str) -> None:
        part: Any = self.part(name, QWidget)
        if are_segments(part):
            self.reach(part)
            wanted = next(button for button in part.buttons if button.text() == words)
            if wanted.isChecked():
                return
            self._go_within_group(wanted)
            if not wanted.isChecked():
                self.key("space")
            return
        assert isinstance(part, QComboBox), part
        self.reach(part)
        wanted_at = place_of(part, words)
        self.key("space")
        wait_until(part.view().isVisible, f"the list of {name!r}", 2000)
        view = part.view()
        for _ in range(part.count() + 1):
            if view.currentIndex().row() == wanted_at:
                break
            self.key("Down" if view.currentIndex().row() < wanted_at else "Up")
        assert view.currentIndex().row() == wanted_at, words
        self.key("Return")

    def select(self, title: str, section: str = "") -> None:
        tree = self.outline.tree
        if not tree.hasFocus():
            self.key("ctrl+1")
        above = self.row(title, section).parent()
        if above.isValid() and not tree.isExpanded(above):
            self._walk_to(lambda: self.row(title, section).parent())
            self.key("Right")
        self._walk_to(lambda: self.row(title, section))

    def _walk_to(self, wanted: Callable[[], QModelIndex]) -> None:
        """Go to a row by the arrow keys; the rows are made anew while the study is edited."""
        tree = self.outline.tree
        for _ in range(100):
            index = wanted()
            if tree.currentIndex() == index:
                return
            current = tree.visualRect(tree.currentIndex()).y() if tree.currentIndex().isValid() else -1
            self.key("Down" if tree.visualRect(index).y() > current else "Up")
        raise AssertionError(f"no arrow key leads to {wanted().data(ROW_ROLE).title!r}")

    def add(self, words: str) -> None:
        if not self.outline.tree.hasFocus():
            self.key("ctrl+1")
        self.key("Insert")
        wait_until(lambda: self.sees("Elements that can be added"), "the list of additions", 3000)
        listed = self.part("Elements that can be added")
        self.type(words)
        for _ in range(listed.count()):  # type: ignore[attr-defined]  # a list of Qt
            if listed.currentItem().text() == words:  # type: ignore[attr-defined]
                break
            self.key("Down")
        assert listed.currentItem().text() == words, words  # type: ignore[attr-defined]
        self.key("Return")

    def shortcut(self, keys: str, button: str) -> None:
        self.key(keys)

    def answer(self, window: ParticipantWindow) -> None:
        self.hand.bring_forward(window)
        if isinstance(window.page, QuestionnairePage):
            for _ in window.page.items:
                self.key("3")
        self.key("1" if isinstance(window.page, ChoicePage) else "Return")


class MouseUser(User):
    """A user who uses only the mouse, and types texts and numbers into clicked fields."""

    def click(self, part: QWidget, times: int = 1) -> None:
        """Click a part, after the wheel has brought it into view."""
        self._aim(part)
        inside = self._bring_into_view(part)
        self.click_at(part.mapToGlobal(inside.center()), times)

    def _aim(self, part: QWidget) -> None:
        """Wait until a widget stops moving after earlier actions."""
        before, still_ms = None, 0
        while still_ms < self.hand.aims_ms:
            here = part.mapToGlobal(QPoint(0, 0)), part.size()
            still_ms = still_ms + STEP_MS if here == before else 0
            before = here
            QTest.qWait(STEP_MS)

    def click_at(self, at: QPoint, times: int = 1) -> None:
        """Click at a place of the screen."""
        self.actions += 1
        self.hand.click(at, times)

    def _bring_into_view(self, part: QWidget) -> QRect:
        """Turn the wheel until a widget is visible; return its visible rectangle."""
        area: QScrollArea | None = None
        above = part.parentWidget()
        while above is not None and area is None:
            area = above if isinstance(above, QScrollArea) else None
            above = above.parentWidget()
        for _ in range(60):
            visible = part.visibleRegion().boundingRect()
            if area is None or visible.height() >= min(24, part.height()):
                break
            view = area.viewport()
            below = part.mapTo(view, QPoint(0, 0)).y() > 0
            bar = area.verticalScrollBar()
            before = bar.value()
            self.actions += 1
            self.hand.turn_wheel(view.mapToGlobal(QPoint(4, view.height() // 2)), below)  # where no field takes it
            assert bar.value() != before, f"the wheel does not bring {name_of(part)!r} into view"
        visible = part.visibleRegion().boundingRect()
        assert not visible.isEmpty(), f"{name_of(part)!r} cannot be seen"
        return visible

    def press(self, name: str) -> None:
        self.click(self.part(name, QAbstractButton))

    def write(self, name: str, text: str, *, accept: bool = True) -> None:
        part = self.part(name, QLineEdit, QPlainTextEdit)
        self.click(part, 3 if name_of(part) and (part.property("text") or part.property("plainText")) else 1)
        self.type(text)

    def choose(self, name: str, words: str) -> None:
        part: Any = self.part(name, QWidget)
        if are_segments(part):
            self.click(next(button for button in part.buttons if button.text() == words))
            return
        assert isinstance(part, QComboBox), part
        self.click(part)
        wait_until(part.view().isVisible, f"the list of {name!r}", 2000)
        self.click_row(part.view(), part.model().index(place_of(part, words), 0))

    def click_row(self, view: QAbstractItemView, index: QModelIndex) -> None:
        """Click a row of a list, after the wheel has brought it into view."""
        for _ in range(60):
            box = view.visualRect(index)
            if view.viewport().rect().contains(box.center()):
                break
            self.actions += 1
            down = box.center().y() > 0
            self.hand.turn_wheel(view.viewport().mapToGlobal(view.viewport().rect().center()), down)
        self.click_at(view.viewport().mapToGlobal(view.visualRect(index).center()))

    def open_outline(self) -> None:
        """Open the outline, where it is a drawer."""
        if not self.outline.isVisible():
            self.press("Outline (Ctrl+1)")

    def select(self, title: str, section: str = "") -> None:
        self.open_outline()
        above = self.row(title, section).parent()
        if above.isValid() and not self.outline.tree.isExpanded(above):
            self.click_row(self.outline.tree, above)
        self.open_outline()
        self.click_row(self.outline.tree, self.row(title, section))

    def add(self, words: str) -> None:
        self.open_outline()
        self.press("Add an element (Insert)")
        wait_until(lambda: self.sees("Elements that can be added"), "the list of additions", 3000)
        self.type(words)
        listed = self.part("Elements that can be added")
        places = range(listed.count())  # type: ignore[attr-defined]  # a list of Qt
        at = next(at for at in places if listed.item(at).text() == words)  # type: ignore[attr-defined]
        self.click_row(listed, listed.model().index(at, 0))  # type: ignore[attr-defined, arg-type]

    def shortcut(self, keys: str, button: str) -> None:
        self.press(button)

    def answer(self, window: ParticipantWindow) -> None:
        page_widget: Any = window.widget
        if isinstance(window.page, QuestionnairePage):
            for field in page_widget.fields:
                self.click(field.options[2])
        self.click(page_widget.buttons[0] if isinstance(window.page, ChoicePage) else page_widget.button)


USERS: dict[str, type[User]] = {"keys": KeyUser, "mouse": MouseUser}
