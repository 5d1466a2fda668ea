"""A card for each protocol, with the facts one chooses by and the two ways to go on."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QSizePolicy, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import Clamped, Elided, label
from study_app.viewmodels.home import BrokenFacts, DraftFacts, StudyFacts

LEAST_WIDTH = 330
GAP = 18
LEAST_HEIGHT = 252
ABOUT_LINES = 3


class EditButton(IconButton):
    """The pen of a card: edits a study, or makes a copy of one that ships with the program."""

    def __init__(self, title: str, *, shipped: bool = False) -> None:
        word = "Make a copy" if shipped else "Edit"
        super().__init__("copy" if shipped else "pen", f"{word} of {title}" if shipped else f"{word} {title}", word,
                         size=36, role="plain")  # fmt: skip


class StudyCard(Card):
    """One protocol; ``new_session``, ``rehearsal`` and ``edit`` carry its facts.

    ``shipped`` says that it ships with the program: it is not edited but copied.
    """

    new_session = Signal(object)
    rehearsal = Signal(object)
    edit = Signal(object)

    def __init__(self, facts: StudyFacts, *, first: bool, shipped: bool = False) -> None:
        super().__init__(padding=20, gap=8)
        self.facts = facts
        title = Elided("card")
        title.setFont(font("card", scale=1.12))
        title.show_text(facts.title)
        self.pen = EditButton(facts.title, shipped=shipped)
        self.pen.clicked.connect(lambda: self.edit.emit(facts))
        head = QHBoxLayout()
        head.addWidget(title, 1)
        head.addWidget(self.pen)
        self.column.addLayout(head)
        self.draft = _say_draft(self, facts.draft)
        self.column.addWidget(Clamped(facts.description or facts.title, ABOUT_LINES, "body", "text2"))
        self.column.addStretch()
        time = f"{facts.duration}  ·  {facts.languages}"
        for icon, words in (("layers", facts.extent), ("clock", time), ("device", facts.needs)):
            row = QHBoxLayout()
            row.setSpacing(10)
            row.addWidget(Icon(icon, "text2", 18))
            row.addWidget(label(words, "body"), 1)
            self.column.addLayout(row)
        self.held = label("", "label", "text2")
        below = QHBoxLayout()
        below.addWidget(self.held, 1)
        below.addWidget(label(facts.file_name, "label", "text2"))
        self.column.addLayout(below)
        self.new = ActionButton("plus", "New session", role="primary" if first else "")
        self.rehearse = ActionButton("fast_forward", "Rehearse")
        self.new.setAccessibleName(f"New session of {facts.title}, {facts.file_name}")
        self.rehearse.setAccessibleName(f"Rehearse {facts.title}, {facts.file_name}")
        self.new.clicked.connect(lambda: self.new_session.emit(facts))
        self.rehearse.clicked.connect(lambda: self.rehearsal.emit(facts))
        buttons = QHBoxLayout()
        buttons.setSpacing(12)
        buttons.addWidget(self.new, 1)
        buttons.addWidget(self.rehearse, 1)
        self.column.addLayout(buttons)
        self.setMinimumHeight(LEAST_HEIGHT)


class BrokenCard(Card):
    """A protocol file that cannot be used, and why, or a study without a file; ``edit`` carries its facts."""

    edit = Signal(object)

    def __init__(self, facts: BrokenFacts | DraftFacts) -> None:
        super().__init__(padding=22, gap=10)
        self.facts = facts
        title = Elided("card")
        title.show_text(facts.source if isinstance(facts, BrokenFacts) else facts.title)
        row = QHBoxLayout()
        row.addWidget(Icon("warning", "warn", 20))
        row.addWidget(title, 1)
        self.pen = EditButton(facts.source)
        self.pen.clicked.connect(lambda: self.edit.emit(facts))
        row.addWidget(self.pen)
        self.column.addLayout(row)
        self.draft = _say_draft(self, facts.draft, of_draft=isinstance(facts, DraftFacts))
        words = "This file cannot be used." if isinstance(facts, BrokenFacts) else "This study was never saved."
        self.column.addWidget(label(words, "strong", "warn"))
        said = label(_why(facts), "label", "text2", wraps=True)
        said.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.column.addWidget(said, 1)
        self.setMinimumHeight(LEAST_HEIGHT)


def _say_draft(card: Card, words: str, *, of_draft: bool = False) -> QLabel:
    """Add a line about the draft of a study, where there is one; everything else on a card is of the saved file."""
    saved = words and f"{words}. This card shows the saved file."
    made = label(words if of_draft else saved, "small", "warn", wraps=True)
    card.column.addWidget(made)
    made.setVisible(bool(words))
    return made


def _why(facts: BrokenFacts | DraftFacts) -> str:
    if isinstance(facts, BrokenFacts):
        return facts.problem
    return f"{Path(facts.source).name} is written when it is saved."


class CardGrid(QWidget):
    """The cards side by side, as many in a row as there is room for."""

    def __init__(self) -> None:
        super().__init__()
        self.cards: list[QWidget] = []
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(GAP)
        self._across = 0
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def show_cards(self, cards: list[QWidget]) -> None:
        """Show these cards in place of those before."""
        for card in self.cards:
            remove_widget(card)
        self.cards = cards
        self._across = 0
        self.arrange(self.width())

    def arrange(self, width: int) -> None:
        """Place the cards for a window that leaves them ``width``; a lone card does not stretch over it."""
        least = max([LEAST_WIDTH, *(card.minimumSizeHint().width() for card in self.cards)])
        across = max(1, (width + GAP) // (least + GAP))
        if across == self._across:
            return
        for column in range(self._grid.columnCount()):
            self._grid.setColumnStretch(column, 0)
        self._across = across
        for index, card in enumerate(self.cards):
            self._grid.addWidget(card, index // across, index % across)
        for column in range(min(across, max(2, len(self.cards)))):
            self._grid.setColumnStretch(column, 1)
        self._grid.activate()  # at once, or what is above keeps the room of the arrangement before
