"""A user of the designer with keys alone."""

from collections.abc import Callable

from PySide6.QtCore import QModelIndex, QPoint
from PySide6.QtWidgets import QAbstractButton, QApplication, QComboBox, QLineEdit, QPlainTextEdit, QWidget

from study_app.gui.designer.outline.rows import ROW_ROLE
from study_app.gui.designer.segments import Segments
from study_app.gui.participant.intervals.choice_page import ChoiceWidget
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.window import ParticipantWindow
from tests.app.designer.support.users import User, name_of, place_of, wait_until

MOST_TABS = 120
VIEWS = "View of the study"
"""The tabs of the views, to which their key goes when it is pressed again."""
COLUMN_PX = 480


class KeyUser(User):
    """Uses keys alone."""

    AREAS = (("Header", "ctrl+5"), ("Outline", "ctrl+1"), ("Form", "ctrl+2"), ("Views of the study", "ctrl+3"))

    def reach(self, part: QWidget) -> None:
        """Go to a part: to its area by Ctrl and a digit, then by Tab."""
        focused = self._focused()
        if focused is not None and self._is_at(part, focused):
            return
        for name, keys in self.AREAS:
            area = next((one for one in self.window.findChildren(QWidget) if one.accessibleName() == name), None)
            if area is not None and area.isAncestorOf(part) and not (focused and area.isAncestorOf(focused)):
                self.key(keys, 2 if part.accessibleName() == VIEWS else 1)
        seen: list[str] = []
        keys = self._leads(self._focused(), part)
        for _ in range(MOST_TABS):
            focused = self._focused()
            if focused is not None and self._is_at(part, focused):
                return
            if focused is not None and _of_a_group(focused, part):
                self._go_within_group(part)
                return
            seen.append("" if focused is None else name_of(focused))
            self.key(keys)
        raise AssertionError(f"{name_of(part)!r} is not reached by Tab, which goes through {seen[-30:]}")

    @staticmethod
    def _focused() -> QWidget | None:
        popup = QApplication.activePopupWidget()
        return QApplication.focusWidget() if popup is None else popup.focusWidget()

    @staticmethod
    def _is_at(part: QWidget, focused: QWidget) -> bool:
        return focused is part or focused is part.focusProxy()

    @staticmethod
    def _leads(focused: QWidget | None, part: QWidget) -> str:
        """Return the key that leads to a part: in a column Tab goes down, between columns to the right.

        `QWidget.nextInFocusChain` would tell, but its wrappers own each other: they take parts of the program along.
        """
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
            upright = abs(way.y()) > abs(way.x()) / 4 and not isinstance(focused.parent(), Segments)
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
        part = self.part(name, Segments, QComboBox)
        if isinstance(part, Segments):
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
        wait_until(lambda: self.sees("What can be added"), "the list of additions", 3000)
        listed = self.part("What can be added")
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
        self.hand.come_forward(window)
        if isinstance(window.widget, QuestionnaireWidget):
            for _ in window.widget.fields:
                self.key("3")
        self.key("1" if isinstance(window.widget, ChoiceWidget) else "Return")


def _of_a_group(focused: QWidget, part: QWidget) -> bool:
    """Return whether two buttons are of one group, in which the arrow keys go from one to another."""
    if not (isinstance(focused, QAbstractButton) and isinstance(part, QAbstractButton)):
        return False
    return focused.group() is not None and focused.group() is part.group()
