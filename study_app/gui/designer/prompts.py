"""Questions as cards in the place: deleting what is named elsewhere, discarding a study, the values of a series."""

from itertools import zip_longest

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLineEdit, QScrollArea, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import label
from study_app.viewmodels.designer.prompts import DeletePrompt, SeriesPlan, SeriesPrompt
from study_app.viewmodels.designer.requests import DeleteElement, MakeSeries

HIGHEST = 560
PLACES_PX = 200
PLAN_PX = 98
"""The room for what a series makes, or for why it cannot be made: the buttons below it stay where they are."""
WAY_PX, MOST_WAYS = 36, 3
"""The room for buttons with what helps where a series cannot be made, and how many there are at most."""


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
        self.buttons = hbox(self.cancel, STRETCH, spacing=10)

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
        vbox(*(label(words, "label") for words in asked.references), margins=0, parent=inside)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        area.setWidget(inside)
        area.setFixedHeight(min(PLACES_PX, inside.sizeHint().height()))
        self.column.addWidget(area)
        if asked.together:
            self.column.addWidget(label(f"Also deletes: {', '.join(asked.together)}.", "label", wraps=True))
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
        add_parts(self.buttons, self.gaps, self.other, self.all)
        add_layout(self.column, self.buttons)
        self.other.setVisible(bool(asked.others))
        self.first: QWidget = self.all


class DiscardCard(Prompt):
    """Whether a study that was never saved is discarded; ``answered`` comes where it is."""

    def __init__(self, title: str, file: str) -> None:
        super().__init__(
            f"Discard “{title}”?",
            f"{file} was never saved: without its draft nothing of this study is left. This cannot be undone.",
        )
        self.go_on = ActionButton("trash", "Discard the draft", role="danger", height=40)
        self.go_on.clicked.connect(lambda: self.answered.emit(file))
        self.buttons.addWidget(self.go_on)
        add_layout(self.column, self.buttons)
        self.first: QWidget = self.cancel


class SeriesCard(Prompt):
    """Which number of an element differs in a series, its values, and what will be made.

    ``typed`` carries what would be made so far, ``make_asked`` what is to be made; ``chosen`` the path of another
    element.
    """

    typed = Signal(object)
    make_asked = Signal(object)
    chosen = Signal(object)

    def __init__(self, asked: SeriesPrompt) -> None:
        title = asked.title if asked.fields else f"a {asked.title}"
        it = asked.title if asked.fields else f"The {asked.title}"
        super().__init__(
            f"Series of {title}",
            f"{it} gets the first value; each other value makes a copy, listed in the same blocks.",
        )
        self.asked, self.plan = asked, SeriesPlan()
        self.elements = Choice()
        self.elements.setFont(font("label"))
        self.elements.setAccessibleName("Element of which a series is made")
        self.elements.setPlaceholderText(f"Choose a {asked.title} …")
        self.elements.setMinimumWidth(180)
        self.elements.addItems([words for _, words in asked.among])
        paths = [path for path, _ in asked.among]
        self.elements.setCurrentIndex(paths.index(asked.path) if asked.path in paths else -1)
        self.elements.activated.connect(lambda at: self.chosen.emit(paths[at]))
        self.number = Choice()
        self.number.setFont(font("label"))
        self.number.setAccessibleName("Number that differs")
        self.number.addItems([words for _, words in asked.fields])
        self.values = QLineEdit()
        self.values.setFont(font("body"))
        self.values.setAccessibleName("Values of the series")
        self.values.setPlaceholderText("Values, such as 0 60 120 240")
        add_layout(self.column, hbox(self.elements, self.number, (self.values, 1), spacing=10))
        self.elements.setVisible(bool(paths))  # without a parent it would be a window of its own
        self.refusal = label("", "label", "bad", wraps=True)
        self.lines = label("", "label")
        said = QWidget()
        vbox((self.refusal, 1), (self.lines, 1), margins=0, parent=said)
        for text in (self.refusal, self.lines):
            text.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.area.setFixedHeight(PLAN_PX)
        self.area.setWidget(said)
        self.column.addWidget(self.area)
        self.ways = [ActionButton("", "", height=WAY_PX) for _ in range(MOST_WAYS)]
        room = QWidget()
        room.setFixedHeight(WAY_PX)
        hbox(*self.ways, STRETCH, spacing=10, margins=0, parent=room)
        for at, way in enumerate(self.ways):
            way.setProperty("dense", "true")
            way.setFont(font("label"))
            way.clicked.connect(lambda _checked=False, at=at: self.answered.emit(self.plan.ways[at].asks))
        self.column.addWidget(room)
        self.make = ActionButton("bars", "", role="primary", height=40)
        self.make.clicked.connect(self._make)
        self.buttons.addWidget(self.make)
        add_layout(self.column, self.buttons)
        self.values.textEdited.connect(lambda _text: self._type())
        self.values.returnPressed.connect(self._make)
        self.number.activated.connect(lambda _at: self._type())
        self.number.setEnabled(bool(asked.fields))
        self.values.setEnabled(bool(asked.fields))
        self.show_plan(self.plan)
        self.first: QWidget = self.values if asked.fields else self.elements

    def show_plan(self, plan: SeriesPlan) -> None:
        """Show what will be made, or why it cannot be."""
        self.plan = plan
        self.refusal.setText(plan.refusal)
        self.refusal.setVisible(bool(plan.refusal))
        self.values.setAccessibleDescription(" ".join((plan.refusal, *(way.words for way in plan.ways))).strip())
        self.lines.setText("\n".join(plan.lines))
        self.lines.setVisible(bool(plan.lines))
        self.make.show_action("bars", plan.make)
        self.make.setEnabled(bool(plan.lines))
        for button, way in zip_longest(self.ways, plan.ways):
            button.setVisible(way is not None)
            if way is not None:
                button.show_action("", way.words)
                button.setToolTip(way.meaning)
                button.setAccessibleDescription(way.meaning)

    def take_values(self, number: str, values: str) -> None:
        """Take a number and values that were chosen before, unless the element has no such number."""
        if self.number.findText(number) < 0:
            return
        self.number.setCurrentText(number)
        self.values.setText(values)
        self.values.selectAll()
        self._type()

    def _type(self) -> None:
        self.typed.emit(self._request())

    def _request(self) -> MakeSeries:
        return MakeSeries(self.asked.path, self.asked.fields[self.number.currentIndex()][0], self.values.text())

    def _make(self) -> None:
        if self.plan.lines:
            self.make_asked.emit(self._request())
        elif not self.plan.refusal:
            self.show_plan(SeriesPlan(refusal="Type the values, such as 0 60 120 240."))
