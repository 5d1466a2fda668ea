"""Prompts: cards with a question that must be answered before a step."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLineEdit, QScrollArea, QWidget

from study_app.designer.document.elements import element_of, kind_and_title, title_of
from study_app.designer.document.fields import Row, label_of, orphaned_keys, paths_to_delete, references_to
from study_app.designer.document.steps import DeleteElement, DuplicateElement, MakeSeries, StepContext, index_of
from study_app.designer.document.study import Study
from study_app.designer.document.toml_text import Refused
from study_app.designer.parts import make_dense
from study_app.gui.widgets import STRETCH, ActionButton, Card, Choice, add_layout, add_parts, hbox, label, set_ink, vbox
from study_app.number_text import capitalised, typed_numbers
from study_app.protocol.source import Path, names, value_at

_MAX_PX = 560
_PLACES_PX = 200


class Prompt(Card):
    """A question that can be cancelled; ``answered`` carries the choice, ``given_up`` is emitted at Cancel and Esc."""

    answered = Signal(object)
    given_up = Signal()

    def __init__(self, title: str, explanation: str) -> None:
        super().__init__(title, padding=20, gap=10)
        self.setAccessibleName(title)
        self.setMaximumHeight(_MAX_PX)
        explanation_label = label(explanation, "body", "text2", wraps=True)
        self.column.addWidget(explanation_label)
        self.cancel = ActionButton("", "Cancel", height=40)
        self.cancel.clicked.connect(self.given_up)
        self.buttons = hbox(self.cancel, STRETCH, spacing=10)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.given_up.emit()
        else:
            super().keyPressEvent(event)


def places_of_references(study: Study, path: Path) -> tuple[str, ...]:
    """Return the references to an element from other elements, each as the text "Block Liquids: Order"."""
    document = study.document
    places = (*references_to(document, path), *orphaned_keys(document, [path]))
    outside = [place for place in places if place[: len(path)] != path]
    texts = (f"{kind_and_title(document, element_of(study, place))}: {_field_label(study, place)}" for place in outside)
    return tuple(dict.fromkeys(texts))


def _field_label(study: Study, place: Path) -> str:
    inside = ", ".join(label_of(step) for step in place[len(element_of(study, place)) :])
    if value_at(study.document, place) is None:
        return f"{inside} (its only entry)"
    return inside or f"entry {index_of(place) + 1}"


class DeleteCard(Prompt):
    """The references to an element to be deleted, as texts in ``places``, and what to do with them."""

    def __init__(self, study: Study, path: Path, places: tuple[str, ...]) -> None:
        document, count = study.document, len(places)
        used = "It is used in 1 place:" if count == 1 else f"It is used in {count} places:"
        super().__init__(f"Delete {title_of(document, path)}?", used)
        inside = QWidget()
        vbox(*(label(place, "label") for place in places), margins=0, parent=inside)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        area.setWidget(inside)
        area.setFixedHeight(min(_PLACES_PX, inside.sizeHint().height()))
        self.column.addWidget(area)
        also_deleted = (
            element
            for element in paths_to_delete(document, path, study.is_required)
            if element != path and len(element) == 2
        )
        if titles := ", ".join(kind_and_title(document, path) for path in also_deleted if isinstance(path[1], str)):
            self.column.addWidget(label(f"“Delete them too” also deletes {titles}.", "label", wraps=True))
        self.all = ActionButton("trash", "Delete them too", role="danger", height=40)
        self.all.clicked.connect(lambda: self.answered.emit(DeleteElement(path, "all")))
        self.gaps = ActionButton("", "Leave gaps", height=40)
        self.gaps.clicked.connect(lambda: self.answered.emit(DeleteElement(path, "gaps")))
        self.other = make_dense(Choice(), "Use a different one instead", 40)
        self.other.setPlaceholderText("Use another…")
        self.other.setMinimumWidth(180)
        for name in names(document, str(path[0])) if len(path) == 2 else ():
            if name != path[1]:
                self.other.addItem(f"{title_of(document, (path[0], name))} ({name})", name)
        self.other.setCurrentIndex(-1)
        self.other.activated.connect(
            lambda index: self.answered.emit(DeleteElement(path, "other", self.other.itemData(index)))
        )
        add_parts(self.buttons, self.gaps, self.other, self.all)
        add_layout(self.column, self.buttons)
        self.other.setVisible(bool(self.other.count()))
        self.first: QWidget = self.cancel


class ConfirmCard(Prompt):
    """A question before an action with consequences; ``answered`` is emitted if it is confirmed."""

    def __init__(self, title: str, explanation: str, action: str, icon: str = "", breaks: Sequence[str] = ()) -> None:
        super().__init__(title, explanation)
        add_parts(self.column, *(label(f"•  {text}", "label", wraps=True) for text in breaks))
        self.confirm = ActionButton(icon, action, role="danger", height=40)
        self.confirm.clicked.connect(lambda: self.answered.emit(action))
        self.buttons.addWidget(self.confirm)
        add_layout(self.column, self.buttons)
        self.first: QWidget = self.cancel


class SeriesCard(Prompt):
    """A card with the number that varies between copies of an element, its values, and the titles of the copies.

    With ``duplicates`` it is shown before a block is duplicated, and also offers a copy with the same conditions.
    """

    def __init__(self, study: Study, path: Path, numbers: Sequence[Row], *, duplicates: bool = False) -> None:
        title = title_of(study.document, path)
        where = "the session" if path[0] == "blocks" else "the blocks that use the original"
        heading = f"Series of {title}"
        explanation = f"Enter one value per copy of {title}. The copies are added to {where}."
        if duplicates:
            heading = f"Duplicate {title}"
            explanation = "Enter the value for the copy's own conditions, such as a delay, or keep the same conditions."
        super().__init__(heading, explanation)
        self.study, self.path, self.numbers = study, path, numbers
        self.number = make_dense(Choice(), "Value to vary")
        for row in numbers:
            number_title = ", ".join(label_of(step) for step in row.path[2:])
            number_title += " of its conditions" if row.path[:2] != path else ""
            self.number.addItem(f"{number_title} [{row.unit}]" if row.unit else number_title)
        self.values = make_dense(QLineEdit(), "Values for the copies")
        self.values.setPlaceholderText("60 120 240")
        self.copies = label("", "label", wraps=True)
        self.same = ActionButton("", "Same conditions", height=40)
        self.same.clicked.connect(lambda: self.answered.emit(DuplicateElement(path)))
        self.make = ActionButton("bars", "Make the copies", role="primary", height=40)
        add_parts(self.buttons, self.same, self.make)
        add_parts(self.column, hbox(self.number, (self.values, 1), spacing=10), self.copies, self.buttons)
        self.same.setVisible(duplicates)
        self.values.textChanged.connect(self._show_titles)
        self.number.activated.connect(self._show_titles)
        self.values.returnPressed.connect(self.make.click)
        self.make.clicked.connect(lambda: self.answered.emit(self._request()))
        self.first: QWidget = self.values
        self._show_titles()

    def _request(self) -> MakeSeries:
        values = tuple(value for _, value in typed_numbers(self.values.text()))
        return MakeSeries(self.path, self.numbers[self.number.currentIndex()].path, values)

    def _show_titles(self) -> None:
        """Show the titles of the copies, or the reason why they cannot be made."""
        titles, reason = "", ""
        try:
            if self.values.text().strip():
                titles = self._request().step(StepContext(self.study)).announcement
        except (ValueError, Refused) as refusal:
            reason = f"{capitalised(str(refusal))}."
        set_ink(self.copies, "bad" if reason else "text2")
        self.copies.setText(reason or titles)
        self.values.setAccessibleDescription(reason or titles)
        self.make.setEnabled(bool(titles))
