"""Editors of certain keys: sentences, order, points of a scale, kind and list of questions."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QGridLayout, QLabel, QSizePolicy, QWidget

from study_app.designer.document.fields import Row
from study_app.designer.document.names import languages_of
from study_app.designer.document.steps import AddElement, AddEntry, Do, RemoveKey, Request, SetValue, Several
from study_app.designer.document.study import Study
from study_app.designer.form.fields import ChoiceField, Field, LanguagesField, LineField, SpecialEditor, add_button
from study_app.designer.form.rows import (
    STATEMENT,
    FormRow,
    QuestionLine,
    choice_words,
    is_right_to_left,
    question_lines,
)
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine, TypedSentence
from study_app.designer.place.segments import Segments, small_button
from study_app.gui.kit.commands import with_key
from study_app.gui.theme.theme import Tone, TypeRole
from study_app.gui.theme.themed import Themed, remove_widget
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.boxes import grid as grid_of
from study_app.gui.widgets.cards import Chip, Icon, Rule, paint_ground
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import Ink, figures, label
from study_app.protocol import questions
from study_app.protocol.orders.sequences import borders_even, row_count
from study_app.protocol.source.document import value_at
from study_app.protocol.trials import designs, tasks
from study_app.protocol.wording.languages import language_name

ROUNDS: Final = 3
SQUARES: Final[Mapping[Any, Literal["williams", "latin"]]] = {"williams": "williams", "latin": "latin"}


@dataclass(frozen=True, slots=True)
class OrderBalance:
    """Tone, icon and words of the chip of the order, and a sentence that explains it."""

    tone: Tone
    icon: str
    words: str
    sentence: str


def order_balance(study: Study, row: Row) -> OrderBalance | None:
    """Return how balanced the order of a block is; None where it has one condition, or another method orders it."""
    block = value_at(study.document, row.path[:-1])
    conditions = block.get("conditions") if isinstance(block, Mapping) else None
    if not isinstance(conditions, tuple) or len(conditions) < 2 or "design" in block:
        return None
    order, codes = row.default if row.value is None else row.value, len(conditions)
    if order == "fixed":
        return OrderBalance(
            "neutral", "ring", "same for all", "Effects of condition and of position cannot be separated."
        )
    if not isinstance(order, str) or order not in SQUARES:
        return OrderBalance(
            "neutral",
            "ring",
            "balanced on average",
            "Drawn anew in every session: positions are balanced on average only.",
        )
    square, repetitions = SQUARES[order], block.get("repetitions", 1)
    rows = row_count(square, codes)
    numbers = ", ".join(str(rows * number) for number in range(1, ROUNDS + 1))
    carries = square == "williams" and isinstance(repetitions, int) and borders_even(codes, max(1, repetitions))
    if carries or codes == 2:
        return OrderBalance(
            "ok",
            "check",
            f"balanced at {numbers} …",
            f"Positions and carry-over are balanced at every multiple of {rows} participants.",
        )
    return OrderBalance(
        "warn",
        "warning",
        f"in part at {numbers} …",
        f"Only positions are balanced, at every multiple of {rows} participants.",
    )


@dataclass(frozen=True, slots=True)
class ScalePoints:
    """Code and name of each language, and the words of each point in each of them, "" where it is missing."""

    languages: tuple[tuple[str, str], ...]
    points: tuple[tuple[str, ...], ...]


def scale_points(study: Study, row: Row) -> ScalePoints:
    """Return the points of a scale, for the languages of the study and others that it has."""
    labels = row.value if isinstance(row.value, Mapping) else {}
    codes = list(dict.fromkeys([*languages_of(study.document), *labels]))
    columns = [labels[code] if isinstance(labels.get(code), tuple) else () for code in codes]
    count = max(map(len, columns), default=0)
    points = tuple(tuple(str(column[at]) if at < len(column) else "" for column in columns) for at in range(count))
    return ScalePoints(tuple((code, language_name(code)) for code in codes), points)


NUMBER_PX, ICON_PX, OPEN_PX = 18, 18, 32
INSET_PX = NUMBER_PX + ICON_PX + 2 * 8


class QuestionRow(Themed, QWidget):
    """One question.

    Signals: ``opened`` when it is clicked or its button is pressed, ``joined`` when it is clicked with Shift (True) or
    Ctrl (False).
    """

    opened = Signal()
    joined = Signal(bool)

    def __init__(self, line: QuestionLine) -> None:
        super().__init__()
        self.line, self.chosen = line, False
        title = next((text for text in line.texts if text), "without a text")
        self.setAccessibleName(f"Question {line.number}, {line.kind}: {title}")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setMinimumHeight(38)
        number = figures(str(line.number), "label", "bad" if line.faults else "text2")
        number.setFixedWidth(NUMBER_PX)
        across = hbox(number, Icon(line.icon, "text2", ICON_PX), spacing=8, margins=(0, 3, 0, 3), parent=self)
        self.write: ActionButton | None = None
        for at, text in enumerate(line.texts):
            across.addWidget(self._text(text, line.note if at == 0 else ""), 1)
        self.open = IconButton("chevron", f"Open question {line.number}, {title}", size=OPEN_PX, role="plain")
        self.open.clicked.connect(self.opened)
        across.addWidget(self.open)

    def _text(self, text: str, note: str) -> QWidget:
        if not text:
            return self._missing()
        if not note:
            return _column_text(text, "label")
        both = QWidget()
        vbox(_column_text(text, "label"), _column_text(note, "small", "text2"), spacing=0, margins=0, parent=both)
        both.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        return both

    def _missing(self) -> QWidget:
        made = QWidget()
        made.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        self.write = small_button("", "Write", height=32)
        self.write.setAccessibleName(f"Write the missing text of question {self.line.number}")
        self.write.clicked.connect(self.opened)
        missing = Icon("warning", "bad", 16), label("Missing", "label", "bad")
        hbox(*missing, STRETCH, self.write, spacing=6, margins=0, parent=made)
        return made

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton or not self.rect().contains(event.position().toPoint()):
            return
        shift = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        if shift or event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.joined.emit(bool(shift))
        else:
            self.opened.emit()

    def show_chosen(self, chosen: bool) -> None:
        if chosen != self.chosen:
            self.chosen = chosen
            self.setAccessibleDescription("Selected" if chosen else "")
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.chosen:
            paint_ground(self, self.theme.selected)


def _column_text(text: str, role: TypeRole, ink: Ink = "text") -> QLabel:
    """Return a text as wide as its column, whatever its length."""
    made = label(text, role, ink, wraps=True)
    policy = made.sizePolicy()
    policy.setHorizontalPolicy(QSizePolicy.Policy.Ignored)
    made.setSizePolicy(policy)
    return made


class QuestionRows(Themed, QWidget):
    """Questions: all of a questionnaire, or those above or below the one that is edited.

    ``asked`` carries a request: to write the text of one, or to select it with the others.
    """

    asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.column = vbox(spacing=0, margins=0, parent=self)
        self.rows: list[QuestionRow] = []
        self._shown: object = ((), ())
        self.hide()

    def show_lines(self, lines: tuple[QuestionLine, ...], languages: tuple[str, ...] = ()) -> None:
        if self._shown == (lines, languages):
            return
        self._shown = (lines, languages)
        self.setVisible(bool(lines))
        for old in self.findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly):
            remove_widget(old)
        self.rows = []
        if len(languages) > 1:
            heads = QWidget()
            columns = ((_column_text(language, "small", "text2"), 1) for language in languages)
            hbox(*columns, spacing=8, margins=(INSET_PX, 0, OPEN_PX + 8, 0), parent=heads)
            self.column.addWidget(heads)
        for line in lines:
            made = QuestionRow(line)
            made.opened.connect(lambda path=line.path: self.asked.emit(Do("write", (path,))))
            made.joined.connect(lambda between, path=line.path: self.asked.emit(Do("join", (path, between))))
            add_parts(self.column, made, Rule())
            self.rows.append(made)


class Panel(Themed, QWidget):
    """The ground of the form: tinted, with an accent line at its left, where one of several questions is edited."""

    tinted = False

    def paintEvent(self, _event: QPaintEvent) -> None:
        if not self.tinted:
            return
        paint_ground(self, self.theme.selected)
        QPainter(self).fillRect(QRectF(0, 2, 3, self.height() - 4), QColor(self.theme.accent))


class DescriptionField(LineField):
    """A plain text; what is longer than three lines scrolls."""

    typed_in = staticmethod(partial(TypedSentence, most_lines=3))


DESCRIPTION: Final = SpecialEditor((("StudyHead", "description"),), DescriptionField)


QUESTIONS: Final = (*(kind.__name__ for kind in questions.KINDS.own.values()), *questions.KINDS.others)
TASKS: Final = (*(kind.__name__ for kind in tasks.KINDS.own.values()), *tasks.KINDS.others)
DESIGNS: Final = tuple({kind.__name__ for kind in designs.KINDS.values()})
"""The titles of their tables."""


class SentencesField(LanguagesField):
    """A sentence in each language."""

    one = TypedSentence


SENTENCES: Final = SpecialEditor(
    (
        ("Questionnaire", "intro"),
        *((kind, "text") for kind in QUESTIONS),
        *((kind, "instruction") for kind in TASKS),
        *((kind, "question") for kind in DESIGNS),
    ),
    SentencesField,
    wide=True,
)


LETTERS, NARROWEST = 8, 124


class OrderField(ChoiceField):
    """The choice of an order, and a chip that says how even it is."""

    def __init__(self, row: FormRow) -> None:
        self.chip = Chip(small=True)
        super().__init__(row)
        if self.list is not None:
            self.list.setMinimumContentsLength(LETTERS)
        self.box.addWidget(self.chip, 0, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft)
        self.show_value()

    def show_value(self) -> None:
        super().show_value()
        found: OrderBalance | None = self.row.facts
        self.chip.setVisible(found is not None and self.box.indexOf(self.chip) >= 0)
        if found is not None:
            self.chip.show_state(found.tone, found.icon, found.words)
            self.chip.setToolTip(found.sentence)
            self.chip.setAccessibleDescription(found.sentence)

    def minimumSizeHint(self) -> QSize:
        return QSize(max(NARROWEST, self.chip.sizeHint().width()), super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        beside = self.width() >= NARROWEST + self.chip.sizeHint().width() + 8
        directions = QBoxLayout.Direction
        self.box.setDirection(directions.LeftToRight if beside else directions.TopToBottom)


ORDER: Final = SpecialEditor((("Block", "order"),), OrderField, facts=order_balance)


class PointsField(Field):
    """A line for each point, a column for each language."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        grid = grid_of(6, 6)
        for column, (_code, language) in enumerate(row.facts.languages, start=1):
            grid.addWidget(label(language, "small", "text2"), 0, column)
        self.lines: list[list[TypedLine]] = []
        count = len(row.facts.points)
        for at in range(count):
            self._add_line(grid, at, {0: "lowest", count - 1: "highest"}.get(at, ""))
        add_layout(self.box, grid)
        self.add = add_button("Add a point", "Point")
        self.add.clicked.connect(self._ask_to_add)
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.lines[0][0] if self.lines else self.add)
        self.show_value()

    def _add_line(self, grid: QGridLayout, at: int, end: str) -> None:
        grid.addWidget(figures(f"{at + 1}  {end}".strip(), "label", "text2"), at + 1, 0)
        lines = []
        for column, (code, language) in enumerate(self.row.facts.languages, start=1):
            line = TypedLine(f"Point {at + 1}, {language}")
            line.setPlaceholderText(f"Missing in {language}")
            line.typed.connect(lambda text, code=code: self._take(at, code, text))
            line.came.connect(self.came)
            if is_right_to_left(code):
                line.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
            grid.addWidget(line, at + 1, column)
            lines.append(line)
        away = IconButton("cross", f"Remove point {at + 1}", size=FIELD_PX, role="plain")
        away.clicked.connect(lambda: self._ask_to_remove(at))
        grid.addWidget(away, at + 1, len(lines) + 1)
        self.lines.append(lines)

    def show_value(self) -> None:
        for lines, words in zip(self.lines, self.row.facts.points, strict=True):
            for line, text in zip(lines, words, strict=True):
                line.show_text(text)

    def _written(self, code: str) -> int:
        return len((self.row.row.value or {}).get(code, ()))

    def _take(self, at: int, code: str, text: str) -> None:
        path, there = (*self.row.row.path, code), self._written(code)
        if at < there:
            self.asked.emit(SetValue((*path, at), text, typing=True))
        else:
            missing = [*((self.row.row.value or {}).get(code, ())), *[""] * (at - there), text]
            self.asked.emit(SetValue(path, missing, typing=True))

    def _ask_to_add(self) -> None:
        path, number = self.row.row.path, len(self.lines) + 1
        added: list[Request] = [
            AddEntry((*path, code), f"Point {number}") for code, _ in self.row.facts.languages if self._written(code)
        ]
        self.asked.emit(Several("Add point", tuple(added)))

    def _ask_to_remove(self, at: int) -> None:
        path = self.row.row.path
        gone: list[Request] = [
            RemoveKey((*path, code, at)) for code, _ in self.row.facts.languages if at < self._written(code)
        ]
        self.asked.emit(Several(f"Remove point {at + 1}", tuple(gone)))


POINTS: Final = SpecialEditor(
    (("Scale", "labels"),),
    PointsField,
    wide=True,
    structure=lambda row: (row.facts.languages, len(row.facts.points)),
    facts=scale_points,
)


NARROWEST_LIST = 120


class KindField(ChoiceField):
    """A statement has no kind in the file."""

    def __init__(self, row: FormRow) -> None:
        self.all: Segments | None = None
        super().__init__(row)
        self.all = Segments(row.row.label)
        self.all.chosen.connect(lambda kind: None if kind == self.row.row.value else self._choose(kind))
        self.box.addWidget(self.all)
        self.box.addStretch()
        self.show_value()
        self._make_room()

    def words(self, choice: Any) -> str:
        return STATEMENT.capitalize() if choice.value is None else choice_words(choice, None)

    def show_value(self) -> None:
        super().show_value()
        if self.all is not None:
            kinds = [(choice.value, self.words(choice)) for choice in self.row.row.choices]
            self.all.show_values(kinds, self.row.row.value)

    def _make_room(self) -> None:
        if self.all is not None and self.list is not None:
            fits = self.width() >= self.all.sizeHint().width()
            self.all.setVisible(fits)
            self.list.setVisible(not fits)
            self.setFocusProxy(self.all if fits else self.list)

    def minimumSizeHint(self) -> QSize:
        return QSize(NARROWEST_LIST, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()


QUESTION_KIND: Final = SpecialEditor(tuple((kind, "kind") for kind in QUESTIONS), KindField, wide=True, labelled=False)


class QuestionsField(Field):
    """The questions, in their order; each is moved, copied and deleted in its own form."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.rows = QuestionRows()
        self.rows.asked.connect(self.asked)
        self.add = add_button(f"Add to {row.row.label}", "Question")
        self.add.setToolTip(with_key("Add a question", "add"))
        self.add.clicked.connect(lambda: self.asked.emit(AddElement(self.row.row.path)))
        self.box.addWidget(self.rows)
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.show_value()

    def show_value(self) -> None:
        self.rows.show_lines(self.row.facts.lines, self.row.facts.languages)
        self.setFocusProxy(self.rows.rows[0].open if self.rows.rows else self.add)


QUESTION_LIST: Final = SpecialEditor(
    (("Questionnaire", "items"),), QuestionsField, wide=True, facts=lambda study, row: question_lines(study, row.path)
)
