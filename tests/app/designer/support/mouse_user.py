"""A user of the designer with the mouse alone, who types texts and numbers."""

from PySide6.QtCore import QModelIndex, QPoint, QRect
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QScrollArea,
    QWidget,
)

from study_app.gui.designer.segments import Segments
from study_app.gui.participant.intervals.choice_page import ChoiceWidget
from study_app.gui.participant.pages.key_caps import GoButton
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.window import ParticipantWindow
from tests.app.designer.support.users import User, name_of, place_of, wait_until

AIMS_MS, STEP_MS = 200, 40


class MouseUser(User):
    """Uses the mouse alone; texts and numbers are typed into fields that were clicked."""

    def click(self, part: QWidget, times: int = 1) -> None:
        """Click a part, after the wheel has brought it into view."""
        self._aim(part)
        inside = self._bring_into_view(part)
        self.click_at(part.mapToGlobal(inside.center()), times)

    @staticmethod
    def _aim(part: QWidget) -> None:
        """Wait until a part stays where it is: what was done before may still move it."""
        before, still_ms = None, 0
        while still_ms < AIMS_MS:
            here = part.mapToGlobal(QPoint(0, 0)), part.size()
            still_ms = still_ms + STEP_MS if here == before else 0
            before = here
            QTest.qWait(STEP_MS)

    def click_at(self, at: QPoint, times: int = 1) -> None:
        """Click at a place of the screen."""
        self.actions += 1
        self.hand.click(at, times)

    def _bring_into_view(self, part: QWidget) -> QRect:
        """Turn the wheel until a part is seen; return what is seen of it."""
        area: QScrollArea | None = None
        above = part.parentWidget()
        while above is not None and area is None:
            area = above if isinstance(above, QScrollArea) else None
            above = above.parentWidget()
        for _ in range(60):
            seen = part.visibleRegion().boundingRect()
            if area is None or seen.height() >= min(24, part.height()):
                break
            view = area.viewport()
            below = part.mapTo(view, QPoint(0, 0)).y() > 0
            bar = area.verticalScrollBar()
            before = bar.value()
            self.actions += 1
            # near the edge, where no field takes the wheel
            self.hand.turn_wheel(view.mapToGlobal(QPoint(4, view.height() // 2)), below)
            assert bar.value() != before, f"the wheel does not bring {name_of(part)!r} into view"
        seen = part.visibleRegion().boundingRect()
        assert not seen.isEmpty(), f"{name_of(part)!r} cannot be seen"
        return seen

    def press(self, name: str) -> None:
        self.click(self.part(name, QAbstractButton))

    def write(self, name: str, text: str, *, accept: bool = True) -> None:
        part = self.part(name, QLineEdit, QPlainTextEdit)
        self.click(part, 3 if name_of(part) and _text_of(part) else 1)
        self.type(text)

    def choose(self, name: str, words: str) -> None:
        part = self.part(name, Segments, QComboBox)
        if isinstance(part, Segments):
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
        wait_until(lambda: self.sees("What can be added"), "the list of additions", 3000)
        self.type(words)
        listed = self.part("What can be added")
        places = range(listed.count())  # type: ignore[attr-defined]  # a list of Qt
        at = next(at for at in places if listed.item(at).text() == words)  # type: ignore[attr-defined]
        self.click_row(listed, listed.model().index(at, 0))  # type: ignore[attr-defined, arg-type]

    def shortcut(self, keys: str, button: str) -> None:
        self.press(button)

    def answer(self, window: ParticipantWindow) -> None:
        if isinstance(window.widget, QuestionnaireWidget):
            for field in window.widget.fields:
                self.click(field.options[2])
        buttons = [one for one in window.findChildren(GoButton) if one.isVisible() and one.isEnabled()]
        choices = window.widget.buttons if isinstance(window.widget, ChoiceWidget) else buttons
        for button in choices[:1]:
            self.click(button)


def _text_of(part: QWidget) -> str:
    if isinstance(part, QLineEdit):
        return part.text()
    return part.toPlainText() if isinstance(part, QPlainTextEdit) else ""
