"""A card for each protocol, with the facts one chooses by and the two ways to go on."""

from pathlib import Path
from typing import TypeAlias

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtWidgets import QGridLayout, QSizePolicy, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.boxes import add_layout, hbox, vbox
from study_app.gui.widgets.cards import Card, Icon
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import Clamped, Elided, label
from study_app.viewmodels.home import BrokenFacts, DraftFacts, StudyFacts

LEAST_WIDTH = 330
GAP = 18
TITLE_LINES, ABOUT_LINES = 2, 2
Facts: TypeAlias = StudyFacts | BrokenFacts | DraftFacts


class FileCard(Card):
    """A study: its title, where it is from, and its draft where one was not saved; ``edit`` carries its facts.

    Parameters
    ----------
    facts
        What is said of it.
    title
        What it is called; of two lines at most.
    copies
        Whether it is not edited but copied.
    first
        Whether its draft is the one that was edited last.
    sign
        An icon before the title, "" for none.
    """

    edit = Signal(object)

    def __init__(self, facts: Facts, title: str, *, copies: bool = False, first: bool = False, sign: str = "") -> None:
        super().__init__(padding=20, gap=8)
        self.facts = facts
        self.title = Clamped(title, TITLE_LINES, "card", steady=False)
        self.title.setFont(font("card", scale=1.12))
        head = hbox(spacing=8)
        if sign:
            head.addWidget(Icon(sign, "warn", 20), 0, Qt.AlignmentFlag.AlignTop)
        head.addWidget(self.title, 1)
        self.origin = Elided("small", "text2")
        self.origin.show_text(f"{facts.origin}  ·  {Path(facts.source).stem}.toml")
        top = hbox((vbox(head, self.origin, spacing=2), 1))
        add_layout(self.column, top)
        self.draft = label("" if facts.draft is None else f"{facts.draft.words}.", "small", "warn", wraps=True)
        self.pen: ActionButton | IconButton
        if facts.draft is None:
            word, name = ("Make a copy", f"Make a copy of {title}") if copies else ("Edit", f"Edit {title}")
            self.pen = IconButton("copy" if copies else "pen", name, word, size=36, role="plain")
            top.addWidget(self.pen, 0, Qt.AlignmentFlag.AlignTop)
            self.draft.hide()
        else:
            self.pen = ActionButton("pen", "Continue", role="primary" if first else "", height=38)
            self.pen.setAccessibleName(f"Continue {title}, {Path(facts.source).stem}")
            row = hbox((self.draft, 1, Qt.AlignmentFlag.AlignTop), (self.pen, 0, Qt.AlignmentFlag.AlignTop), spacing=12)
            add_layout(self.column, row)
        self.pen.clicked.connect(lambda: self.edit.emit(facts))


class StudyCard(FileCard):
    """A study that can be run; ``new_session`` and ``rehearsal`` carry its facts.

    ``shipped`` says that it ships with the program, ``first`` that it is what one most likely goes on with.
    """

    new_session = Signal(object)
    rehearsal = Signal(object)

    def __init__(self, facts: StudyFacts, *, first: bool, shipped: bool = False) -> None:
        super().__init__(facts, facts.title, copies=shipped, first=first)
        self.facts: StudyFacts = facts
        if facts.draft is None:
            self.column.addWidget(Clamped(facts.description or facts.title, ABOUT_LINES, "body", "text2"))
        else:
            self.draft.setText(f"{facts.draft.words}. Sessions use the saved file.")
        self.column.addStretch()
        time = f"{facts.duration}  ·  {facts.languages}"
        for icon, words in (("layers", facts.extent), ("clock", time), ("device", facts.needs)):
            add_layout(self.column, hbox(Icon(icon, "text2", 18), (label(words, "body"), 1), spacing=10))
        self.held = label("", "label", "text2")
        self.column.addWidget(self.held)
        self.new = ActionButton("plus", "New session", role="primary" if first and facts.draft is None else "")
        self.rehearse = ActionButton("fast_forward", "Rehearse")
        self.new.setAccessibleName(f"New session of {facts.title}, {facts.file_name}")
        self.rehearse.setAccessibleName(f"Rehearse {facts.title}, {facts.file_name}")
        self.new.clicked.connect(lambda: self.new_session.emit(facts))
        self.rehearse.clicked.connect(lambda: self.rehearsal.emit(facts))
        add_layout(self.column, hbox((self.new, 1), (self.rehearse, 1), spacing=12))


class BrokenCard(FileCard):
    """A protocol file that cannot be used, and why, or a study without a file."""

    def __init__(self, facts: BrokenFacts | DraftFacts, *, first: bool = False) -> None:
        if isinstance(facts, DraftFacts):
            super().__init__(facts, facts.title, first=first)
            why = f"{Path(facts.source).name} is written when it is saved."
        else:
            super().__init__(facts, Path(facts.source).stem, first=first, sign="warning")
            self.column.addWidget(label("This file cannot be used.", "strong", "warn"))
            why = facts.problem
        said = label(why, "label", "text2", wraps=True)
        said.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.column.addWidget(said, 1)


class CardGrid(QWidget):
    """The cards side by side, as many in a row as there is room for; ``laid_out`` comes when heights may differ."""

    laid_out = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.cards: list[QWidget] = []
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(GAP)
        self._across, self._least = 0, LEAST_WIDTH
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    @property
    def row_height(self) -> int:
        """The height of the first row of cards at the width that they have."""
        wide = (self.width() - self._grid.contentsMargins().right() + GAP) // max(1, self._across) - GAP
        heights = (
            card.heightForWidth(wide) if card.hasHeightForWidth() else card.sizeHint().height()
            for card in self.cards[: self._across]
        )
        return max(heights, default=0)

    @property
    def whole_height(self) -> int:
        """The height of all rows at the width that they have."""
        grows = self._grid.hasHeightForWidth()
        return self._grid.totalHeightForWidth(self.width()) if grows else self._grid.totalSizeHint().height()

    def show_cards(self, cards: list[QWidget]) -> None:
        for card in self.cards:
            remove_widget(card)
        self.cards = cards
        self._across = 0
        self._least = max([LEAST_WIDTH, *(card.minimumSizeHint().width() for card in cards)])
        self.arrange(self.width())

    def leave_room(self, width: int) -> None:
        """Leave so much room free at the right."""
        self._grid.setContentsMargins(0, 0, width, 0)

    def event(self, event: QEvent) -> bool:
        """Tell when cards came that are shown now."""
        done = super().event(event)
        if event.type() == QEvent.Type.LayoutRequest:
            self.laid_out.emit()
        return done

    def arrange(self, width: int) -> None:
        """Place the cards for a window that leaves them ``width``; a lone card does not stretch over it."""
        across = max(1, (width + GAP) // (self._least + GAP))
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
