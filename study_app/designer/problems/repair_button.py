"""Buttons that put something right: a repair, at a field and in the list of problems, and a name that is free."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFocusEvent, QMouseEvent
from PySide6.QtWidgets import QWidget

from study_app.designer.problems.problem_rows import ProblemRow
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import hbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label

LONGEST = 20
"""So many letters of a name a button has room for in a narrow card."""


class RepairButton(ActionButton):
    """Makes a repair of ``problem``; ``by_keys`` says whether a key led to it, not a click."""

    def __init__(self, problem: ProblemRow, words: str) -> None:
        super().__init__("", words, height=32)
        self.setProperty("dense", "true")
        self.setFont(font("label"))
        self.by_keys = False
        self.offer(problem, words)

    def offer(self, problem: ProblemRow, words: str) -> None:
        """Offer a repair of a problem from now on."""
        self.problem = problem
        self.show_action("", words)
        self.setAccessibleName(f"{words}: {problem.name}")

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.by_keys = event.reason() != Qt.FocusReason.MouseFocusReason

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.by_keys = False
        super().mousePressEvent(event)


class NameRefusal(QWidget):
    """Why a name is not taken, and a button with one that is free, which ``chosen`` carries.

    Parameters
    ----------
    does
        What is done at once with the name that is free, such as "Rename to".
    """

    chosen = Signal(str)

    def __init__(self, does: str) -> None:
        super().__init__()
        self._does, self._free = does, ""
        self.words = label("", "label", "bad", wraps=True)
        self.use = ActionButton("", "", height=32)
        self.use.setProperty("dense", "true")
        self.use.setFont(font("label"))
        self.use.clicked.connect(lambda: self.chosen.emit(self._free))
        hbox((self.words, 1), self.use, spacing=8, margins=0, parent=self)
        self.show_refusal("")

    def text(self) -> str:
        """Return why the name is not taken, "" where it is."""
        return self.words.text()

    def show_refusal(self, sentence: str, free: str = "") -> None:
        """Say why a name is not taken, "" for nothing, and offer one that is free."""
        self._free = free
        self.words.setText(f"{sentence[:1].upper()}{sentence[1:]}")
        words = f"{self._does} {free}"
        self.use.show_action("", words if len(free) <= LONGEST else f"{self._does.split()[0]} it")
        self.use.setAccessibleName(words)
        self.use.setVisible(bool(free))
        self.setVisible(bool(sentence))
