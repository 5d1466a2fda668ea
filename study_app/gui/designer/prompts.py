"""Questions as cards in the place: what to do with what names a deleted element, and the values of a series."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QScrollArea, QVBoxLayout, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.outline_rows import ElementPath
from study_app.viewmodels.designer.prompts import DeletePrompt, SeriesPlan, SeriesPrompt
from study_app.viewmodels.designer.requests import DeleteElement, MakeSeries

HIGHEST = 560
LEAST_PLAN_PX, PLAN_PX, LINE_PX = 62, 190, 18


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
        if asked.together:
            words = f"Delete them too deletes, besides: {', '.join(asked.together)}."
            self.column.addWidget(label(words, "label", wraps=True))
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


class SeriesCard(Prompt):
    """Which number of an element differs in a series, its values, and what will be made.

    ``typed`` carries the number and the values so far.
    """

    typed = Signal(object, str)

    def __init__(self, asked: SeriesPrompt) -> None:
        super().__init__(
            f"Series of {asked.title}",
            f"{asked.title} gets the first value; each other value makes a copy, listed in the same blocks.",
        )
        self.asked, self.plan = asked, SeriesPlan()
        self.number = Choice()
        self.number.setFont(font("label"))
        self.number.setAccessibleName("Number that differs")
        self.number.addItems([words for _, words in asked.fields])
        self.values = QLineEdit()
        self.values.setFont(font("body"))
        self.values.setAccessibleName("Values of the series")
        self.values.setPlaceholderText("Values, such as 0 60 120 240")
        line = QHBoxLayout()
        line.setSpacing(10)
        line.addWidget(self.number)
        line.addWidget(self.values, 1)
        self.column.addLayout(line)
        self.refusal = label("", "label", "bad", wraps=True)
        self.column.addWidget(self.refusal)
        self.lines = label("", "label")
        self.lines.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.area.setWidget(self.lines)
        self.column.addWidget(self.area, 1)
        self.make = ActionButton("bars", "", role="primary", height=40)
        self.make.clicked.connect(self._make)
        self.buttons.addWidget(self.make)
        self.column.addLayout(self.buttons)
        self.values.textEdited.connect(lambda _text: self._type())
        self.values.returnPressed.connect(self._make)
        self.number.activated.connect(lambda _at: self._type())
        self.show_plan(self.plan)
        self.first: QWidget = self.values

    def show_plan(self, plan: SeriesPlan) -> None:
        """Show what will be made, or why it cannot be."""
        self.plan = plan
        self.refusal.setText(plan.refusal)
        self.refusal.setVisible(bool(plan.refusal))
        self.values.setAccessibleDescription(plan.refusal)
        self.lines.setText("\n".join(plan.lines))
        self.area.setVisible(bool(plan.lines))
        wanted = LINE_PX * len(plan.lines) + 8
        self.area.setMinimumHeight(min(LEAST_PLAN_PX, wanted))  # a low window leaves no room for more
        self.area.setMaximumHeight(min(PLAN_PX, wanted))
        self.make.show_action("bars", plan.make)
        self.make.setEnabled(bool(plan.lines))

    def _type(self) -> None:
        self.typed.emit(self._field, self.values.text())

    @property
    def _field(self) -> ElementPath:
        return self.asked.fields[self.number.currentIndex()][0]

    def _make(self) -> None:
        if self.plan.lines:
            self.answered.emit(MakeSeries(self.asked.path, self._field, self.values.text()))
        elif not self.plan.refusal:
            self.show_plan(SeriesPlan(refusal="Type the values, such as 0 60 120 240."))
