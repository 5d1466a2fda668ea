"""Questions as cards in the place: what to do with what names a deleted element."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QHBoxLayout, QScrollArea, QVBoxLayout, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.prompts import DeletePrompt
from study_app.viewmodels.designer.requests import DeleteElement

HIGHEST = 560


class Prompt(Card):
    """A question with a way back; ``answered`` carries what was chosen, ``given_up`` comes at Cancel and Esc."""

    answered = Signal(object)
    given_up = Signal()

    def __init__(self, title: str, explanation: str) -> None:
        super().__init__(title, padding=20, gap=10)
        self.setAccessibleName(title)
        self.setMaximumHeight(HIGHEST)
        said = label(explanation, "body", "text2", wraps=True)
        self.column.addWidget(said)
        self.cancel = ActionButton("", "Cancel", height=40)
        self.cancel.clicked.connect(self.given_up)
        self.buttons = QHBoxLayout()
        self.buttons.setSpacing(10)
        self.buttons.addWidget(self.cancel)
        self.buttons.addStretch()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802 - Qt's name
        """Give up at Esc."""
        if event.key() == Qt.Key.Key_Escape:
            self.given_up.emit()
        else:
            super().keyPressEvent(event)


class DeleteCard(Prompt):
    """What names an element that is to be deleted, and what becomes of it."""

    def __init__(self, asked: DeletePrompt) -> None:
        count = len(asked.references)
        places = "It is used in 1 place:" if count == 1 else f"It is used in {count} places:"
        super().__init__(f"Delete {asked.title}?", places)
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(0, 0, 0, 0)
        for words in asked.references:
            column.addWidget(label(words, "label"))
        column.addStretch()
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        area.setWidget(inside)
        area.setMinimumHeight(min(200, 26 * count + 8))
        self.column.addWidget(area, 1)
        self.all = ActionButton("trash", "Delete them too", role="danger", height=40)
        self.all.clicked.connect(lambda: self.answered.emit(DeleteElement(asked.path, "all", also=asked.also)))
        self.gaps = ActionButton("", "Leave the gaps", height=40)
        self.gaps.clicked.connect(lambda: self.answered.emit(DeleteElement(asked.path, "gaps", also=asked.also)))
        self.other = Choice()
        self.other.setFont(font("label"))
        self.other.setAccessibleName("Use another one in its place")
        self.other.setPlaceholderText("Use another …")
        self.other.setMinimumWidth(180)
        for name, title in asked.others:
            self.other.addItem(f"{title} ({name})", name)
        self.other.setCurrentIndex(-1)
        self.other.activated.connect(
            lambda at: self.answered.emit(DeleteElement(asked.path, "other", self.other.itemData(at)))
        )
        for part in (self.gaps, self.other, self.all):
            self.buttons.addWidget(part)
        self.column.addLayout(self.buttons)
        self.other.setVisible(bool(asked.others))
        self.first: QWidget = self.all
