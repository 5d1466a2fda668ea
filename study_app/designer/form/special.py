"""Editors of special keys: sentences, order, scale points, kind and list of questions, hypotheses."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations
from typing import Any, Final, Literal

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QBoxLayout, QLabel, QSizePolicy, QWidget

from study_app.designer.document.elements import distinct_title, title_of
from study_app.designer.document.fields import Row, label_of
from study_app.designer.document.steps import AddElement, AddEntry, Do, RemoveKey, Request, SetValue, Several
from study_app.designer.document.study import Study
from study_app.designer.form.fields import (
    LANGUAGE,
    Extra,
    Field,
    LanguagesField,
    LineField,
    SpecialEditor,
    TypedLine,
    TypedSentence,
    add_button,
    kept_value_sentence,
    remove_button,
    removes_key,
    typed_value,
)
from study_app.designer.form.rows import FormRow, QuestionLine, is_right_to_left, question_lines
from study_app.designer.measures.cards import Verdict
from study_app.designer.measures.study_facts import valid_part
from study_app.designer.parts import make_dense, small_button
from study_app.gui.kit import with_key
from study_app.gui.theme import Themed, TypeRole, font, remove_widget
from study_app.gui.widgets import (
    STRETCH,
    ActionButton,
    Chip,
    Choice,
    Icon,
    IconButton,
    Ink,
    Rule,
    add_layout,
    add_parts,
    figures,
    grid,
    hbox,
    label,
    paint_ground,
    plain_tip,
    vbox,
)
from study_app.number_text import capitalised, number_of, unclear_number
from study_app.protocol import questions
from study_app.protocol.orders import block_orders_by_group
from study_app.protocol.randomization import has_even_borders, row_count
from study_app.protocol.source import entries, names, value_at
from study_app.protocol.trials import DESIGN_KINDS, TASK_KINDS
from study_app.protocol.wording import language_name, languages_of

_MULTIPLES_SHOWN: Final = 3
_SQUARE_KINDS: Final[Mapping[Any, Literal["williams", "latin"]]] = {"williams": "williams", "latin": "latin"}


def _order_balance(study: Study, row: Row) -> tuple[Verdict, str] | None:
    """Return a verdict on the balance of a block's order, and its explanation.

    None if the block has only one condition, or a design determines its order.
    """
    block = value_at(study.document, row.path[:-1])
    conditions = block.get("conditions") if isinstance(block, Mapping) else None
    if not isinstance(conditions, tuple) or len(conditions) < 2 or "design" in block:
        return None
    order, condition_count = row.default if row.value is None else row.value, len(conditions)
    if order == "fixed":
        return ("neutral", "ring", "same for everyone"), "The effects of condition and position cannot be separated."
    if not isinstance(order, str) or order not in _SQUARE_KINDS:
        explanation = "A new order is drawn for each session, so positions are balanced only on average."
        return ("neutral", "ring", "balanced on average"), explanation
    square, repetitions = _SQUARE_KINDS[order], block.get("repetitions", 1)
    rows = row_count(square, condition_count)
    numbers = ", ".join(str(rows * number) for number in range(1, _MULTIPLES_SHOWN + 1))
    balances_carry_over = (
        square == "williams" and isinstance(repetitions, int) and has_even_borders(condition_count, max(1, repetitions))
    )
    when = f"for any multiple of {rows} participants{' in a group' if study.document.get('groups') else ''}."
    if balances_carry_over or condition_count == 2:
        return ("ok", "check", f"balanced for {numbers} …"), f"Positions and carry-over are balanced {when}"
    return ("warn", "warning", f"partly for {numbers} …"), f"Only positions are balanced {when}"


@dataclass(frozen=True, slots=True)
class _ScalePoints:
    """The languages of a scale, by code and name, and for each point its label in each language, "" if missing."""

    languages: tuple[tuple[str, str], ...]
    points: tuple[tuple[str, ...], ...]


def _scale_points(study: Study, row: Row) -> _ScalePoints:
    """Return the points of a scale in the study's languages and in other languages that the scale has."""
    labels = row.value if isinstance(row.value, Mapping) else {}
    codes = list(dict.fromkeys([*languages_of(study.document), *labels]))
    columns = [labels[code] if isinstance(labels.get(code), tuple) else () for code in codes]
    count = max(map(len, columns), default=0)
    points = tuple(
        tuple(str(column[index]) if index < len(column) else "" for column in columns) for index in range(count)
    )
    return _ScalePoints(tuple((code, language_name(code)) for code in codes), points)


NUMBER_PX, ICON_PX, OPEN_PX = 18, 18, 32
_INSET_PX = NUMBER_PX + ICON_PX + 2 * 8


class _QuestionRow(Themed, QWidget):
    """One question; ``opened`` is emitted when it is clicked or its button is pressed."""

    opened = Signal()

    def __init__(self, line: QuestionLine) -> None:
        super().__init__()
        self.line = line
        title = next((text for text in line.texts if text), "no text yet")
        self.setAccessibleName(f"Question {line.number}, {line.kind}: {title}")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setMinimumHeight(38)
        number = figures(str(line.number), "label", "bad" if line.faults else "text2")
        number.setFixedWidth(NUMBER_PX)
        across = hbox(number, Icon(line.icon, "text2", ICON_PX), spacing=8, margins=(0, 3, 0, 3), parent=self)
        self.write: ActionButton | None = None
        for index, text in enumerate(line.texts):
            across.addWidget(self._text_part(text, line.note if index == 0 else ""), 1)
        self.open = IconButton("chevron", f"Open question {line.number}, {title}", size=OPEN_PX, role="plain")
        self.open.clicked.connect(self.opened)
        across.addWidget(self.open)

    def _text_part(self, text: str, note: str) -> QWidget:
        if not text:
            return self._missing_part()
        if not note:
            return _column_text(text, "label")
        part = QWidget()
        vbox(_column_text(text, "label"), _column_text(note, "small", "text2"), spacing=0, margins=0, parent=part)
        part.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        return part

    def _missing_part(self) -> QWidget:
        part = QWidget()
        part.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        self.write = small_button("", "Write", height=32)
        self.write.setAccessibleName(f"Write the missing text for question {self.line.number}")
        self.write.clicked.connect(self.opened)
        faulty = self.line.faults > 0
        ink: Ink = "bad" if faulty else "text2"
        missing = Icon("warning" if faulty else "info", ink, 16), label("Missing", "label", ink)
        hbox(*missing, STRETCH, self.write, spacing=6, margins=0, parent=part)
        return part

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self.rect().contains(event.position().toPoint()):
            self.opened.emit()


def _column_text(text: str, role: TypeRole, ink: Ink = "text") -> QLabel:
    """Return a label that takes the width of its column."""
    text_label = label(text, role, ink, wraps=True)
    policy = text_label.sizePolicy()
    policy.setHorizontalPolicy(QSizePolicy.Policy.Ignored)
    text_label.setSizePolicy(policy)
    return text_label


class QuestionRows(Themed, QWidget):
    """The questions of a questionnaire, or those above or below the one being edited.

    ``asked`` carries a request to change the text of one.
    """

    asked = Signal(object)

    def __init__(self) -> None:
        super().__init__()
        self.column = vbox(spacing=0, margins=0, parent=self)
        self.rows: list[_QuestionRow] = []
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
            headings = QWidget()
            columns = ((_column_text(language, "small", "text2"), 1) for language in languages)
            hbox(*columns, spacing=8, margins=(_INSET_PX, 0, OPEN_PX + 8, 0), parent=headings)
            self.column.addWidget(headings)
        for line in lines:
            question_row = _QuestionRow(line)
            question_row.opened.connect(lambda path=line.path: self.asked.emit(Do("write", (path,))))
            add_parts(self.column, question_row, Rule())
            question_row.show()  # at once: otherwise the layout shows it later, and moves the row that was scrolled to
            self.rows.append(question_row)


class Panel(Themed, QWidget):
    """The background of the form; tinted, with an accent line at the left, while a question is edited."""

    tinted = False

    def paintEvent(self, _event: QPaintEvent) -> None:
        if not self.tinted:
            return
        paint_ground(self, self.theme.selected)
        QPainter(self).fillRect(QRectF(0, 2, 3, self.height() - 4), QColor(self.theme.accent))


DESCRIPTION: Final = SpecialEditor(
    (("StudyHead", "description"),), partial(LineField, make_line=partial(TypedSentence, max_lines=3))
)


_QUESTIONS: Final = (*(kind.__name__ for kind in questions.KINDS.own.values()), *questions.KINDS.others)
_TASKS: Final = (*(kind.__name__ for kind in TASK_KINDS.own.values()), *TASK_KINDS.others)
_DESIGNS: Final = tuple({kind.__name__ for kind in DESIGN_KINDS.values()})
"""Titles of the models of questions, tasks and designs in the JSON Schema."""


SENTENCES: Final = SpecialEditor(
    (
        ("Questionnaire", "intro"),
        *((kind, "text") for kind in _QUESTIONS),
        *((kind, "instruction") for kind in _TASKS),
        *((kind, "question") for kind in _DESIGNS),
    ),
    partial(LanguagesField, make_line=TypedSentence),
    wide=True,
)


class _BalanceChip(Extra, Chip):
    """A chip that shows how balanced an order is."""

    beside_px = 124

    def show_facts(self, facts: Any) -> None:
        state, sentence = facts
        self.show_state(*state)
        self.setToolTip(plain_tip(sentence))
        self.setAccessibleDescription(sentence)


ORDER: Final = SpecialEditor((("Block", "order"),), adds=lambda _field: _BalanceChip(small=True), facts=_order_balance)


class _PointsField(Field):
    """One line per point, one column per language, and a button that adds a point."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        grid_layout, languages, last = grid(6, 6), row.facts.languages, len(row.facts.points) - 1
        for column, (_code, language) in enumerate(languages, start=1):
            grid_layout.addWidget(label(language, "small", "text2"), 0, column)
        self.lines: list[list[TypedLine]] = []
        for index in range(last + 1):
            position_text = f"{index + 1}  {({0: 'lowest', last: 'highest'}).get(index, '')}".strip()
            grid_layout.addWidget(figures(position_text, "label", "text2"), index + 1, 0)
            self.lines.append([TypedLine(f"Point {index + 1}, {language}") for _code, language in languages])
            for column, (line, (code, language)) in enumerate(zip(self.lines[-1], languages, strict=True)):
                line.setProperty(LANGUAGE, code)
                line.setPlaceholderText(f"Missing in {language}")
                if is_right_to_left(code):
                    line.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
                line.typed.connect(partial(self.submit_text, index, column))
                line.focused.connect(self.focused)
                grid_layout.addWidget(line, index + 1, column + 1)
            remove = remove_button(f"Remove Point {index + 1}", partial(self.remove, index))
            grid_layout.addWidget(remove, index + 1, len(languages) + 1)
        add_layout(self.box, grid_layout)
        self.add = add_button(f"Add to {row.label}", "Point")
        self.add.clicked.connect(self.add_entry)
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.setFocusProxy(self.lines[0][0] if self.lines else self.add)
        self.show_value()

    def show_value(self) -> None:
        for lines, texts in zip(self.lines, self.row.facts.points, strict=True):
            for line, text in zip(lines, texts, strict=True):
                line.show_text(text)

    def take_keyboard(self) -> None:
        """Focus the first missing label, else the first one."""
        missing = (line for lines in self.lines for line in lines if not line.text())
        next(missing, self).setFocus(Qt.FocusReason.OtherFocusReason)

    def _text_count(self, code: str) -> int:
        return len((self.row.value or {}).get(code, ()))

    def submit_text(self, index: int, column: int, text: str) -> None:
        code = self.row.facts.languages[column][0]
        path, count = (*self.row.path, code), self._text_count(code)
        labels = [*((self.row.value or {}).get(code, ())), *[""] * (index - count), text]
        request = SetValue((*path, index), text, typing=True) if index < count else SetValue(path, labels, typing=True)
        self.asked.emit(request)

    def add_entry(self) -> None:
        path, label = self.row.path, f"Point {len(self.lines) + 1}"
        requests = (AddEntry((*path, code), label) for code, _ in self.row.facts.languages if self._text_count(code))
        self.asked.emit(Several("Add point", tuple(requests)))

    def remove(self, index: int) -> None:
        path = self.row.path
        requests = (
            RemoveKey((*path, code, index)) for code, _ in self.row.facts.languages if index < self._text_count(code)
        )
        self.asked.emit(Several(f"Remove point {index + 1}", tuple(requests)))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        index = next((index for index, lines in enumerate(self.lines) if any(line.hasFocus() for line in lines)), None)
        if index is not None and removes_key(event):
            self.remove(index)
        else:
            super().keyPressEvent(event)


POINTS: Final = SpecialEditor(
    (("Scale", "labels"),),
    _PointsField,
    wide=True,
    structure=lambda row: (row.facts.languages, len(row.facts.points)),
    facts=_scale_points,
)


QUESTION_KIND: Final = SpecialEditor(tuple((kind, "kind") for kind in _QUESTIONS), wide=True, labelled=False)


class _QuestionsField(Field):
    """The questions in order; each is moved, copied and deleted in its own form."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.rows = QuestionRows()
        self.rows.asked.connect(self.asked)
        self.add = add_button(f"Add to {row.label}", "Question")
        self.add.setToolTip(plain_tip(with_key("Add a question", "add")))
        self.add.clicked.connect(lambda: self.asked.emit(AddElement(self.row.path)))
        self.box.addWidget(self.rows)
        self.box.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        self.show_value()

    def show_value(self) -> None:
        self.rows.show_lines(self.row.facts.lines, self.row.facts.languages)
        self.setFocusProxy(self.rows.rows[0].open if self.rows.rows else self.add)


QUESTION_LIST: Final = SpecialEditor(
    (("Questionnaire", "items"),), _QuestionsField, wide=True, facts=lambda study, row: question_lines(study, row.path)
)


def _block_order_sentence(study: Study, _row: Row) -> str:
    """Return the sentences on the block order of the planned participants in each group; "" while it is unknown."""
    protocol = valid_part(study).protocol
    if protocol is None or len(protocol.main_blocks) < 2:
        return ""
    sentences = {group: sentences.partition(": ")[2] for group, sentences in block_orders_by_group(protocol).items()}
    return " ".join(
        f"{capitalised(f'{group}: {sentence}' if group else sentence)}." for group, sentence in sentences.items()
    )


def _choice_sentences(_study: Study, row: Row) -> str:
    """Return the sentence on each choice, one per line."""
    described = [choice for choice in row.choices if choice.value is not None and choice.sentence]
    return "\n".join(f"{label_of(choice.value or '')}: {choice.sentence}." for choice in described)


class _Sentence(Extra, QLabel):
    """A sentence below a choice that explains it."""

    def __init__(self) -> None:
        super().__init__(wordWrap=True)
        self.setFont(font("small"))
        self.setProperty("role", "text2")

    def show_facts(self, facts: Any) -> None:
        self.setText(facts)


BLOCK_ORDER: Final = SpecialEditor(
    (("StudyHead", "block_order"),), adds=lambda _field: _Sentence(), facts=_block_order_sentence
)
GROUP_ASSIGNMENT: Final = SpecialEditor(
    (("StudyHead", "group_assignment"),), adds=lambda _field: _Sentence(), facts=_choice_sentences
)

_MEASURES: Final[tuple[tuple[str, str], ...]] = (
    ("threshold", "Threshold"), ("exponent", "Exponent"), ("d_prime", "Sensitivity d′"), ("pse", "Setting (PSE)"),
)  # fmt: skip
_RELATIONS: Final = (
    (None, "is different from"), ("higher", "is higher than"), ("lower", "is lower than"), ("equal", "is equal to"),
)  # fmt: skip
DEFAULT_BOUND, DEFAULT_RATIO = 0.5, 1.25
_WIDE_RANGE, _SHARE_OF_RANGE = 10.0, 0.05
"""On scales with a wider range, the default bound is this share of the range."""
_NOTHING_TO_COMPARE: Final = (
    "A hypothesis compares two main blocks, two conditions of a block, or two groups. Add a second block, condition or "
    "group first."
)
_ONE_RESULT: Final = (
    "A block with a trial design has one result for all its conditions. To compare two delays, use a block for each: "
    f"{with_key('Duplicate', 'duplicate')} asks for the delay of the copy."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """A block, or a condition or group in a block, with its measures, each as ID and label.

    A group with a ``pair`` of blocks or conditions (``pair_of`` is the key) is one side of an interaction. ``ranges``
    are the differences between the largest and the smallest value of measures, if they are limited.
    """

    key: str  # the key that lists it in a hypothesis: "blocks", "conditions" or "groups"
    block: str
    name: str
    label: str
    measures: tuple[tuple[str, str], ...]
    pair_of: str = ""
    pair: tuple[str, ...] = ()
    ranges: Mapping[str, float] = field(default_factory=dict, compare=False)

    @property
    def place(self) -> tuple[object, ...]:
        """The values that identify the item: key, block, name and pair."""
        return self.key, self.block, self.name, self.pair_of, self.pair

    def comparable_with(self, items: tuple["Compared", ...]) -> tuple["Compared", ...]:
        """Return the items with which it can be compared: blocks with a common measure, or items of the same block."""
        candidates = (
            item for item in items if item.key == self.key and item.name != self.name and item.pair == self.pair
        )
        return tuple(
            item
            for item in candidates
            if self.shared_measures(item) and (self.key == "blocks" or item.block == self.block)
        )

    def shared_measures(self, other: "Compared") -> tuple[tuple[str, str], ...]:
        """Return the measures that both items have."""
        return tuple(measure for measure in self.measures if measure in other.measures)


@dataclass(frozen=True, slots=True)
class Comparable:
    """The items that hypotheses can compare, in file order, and a hint on items that cannot be compared yet."""

    items: tuple[Compared, ...]
    hint: str


def _comparable(study: Study, _row: Row) -> Comparable:
    form_measures, ranges = _form_measures(study), _ranges_of_measures(study)
    all_items = tuple(
        replace(
            item,
            measures=item.measures
            if item.key == "conditions"
            else (*item.measures, *form_measures.get(item.block, ())),
            ranges=ranges.get(item.block, {}),
        )
        for item in _comparable_items(study)
    )
    all_items += tuple(_interaction_sides(all_items))
    items = tuple(item for item in all_items if item.comparable_with(all_items))
    compared = {item.name for item in items if item.key == "blocks"}
    has_lone_block = any(
        place[1] not in compared and block.get("phase", "main") == "main" and {"design", "conditions"} <= block.keys()
        for place, block in entries(study.document, "blocks.*")
        if isinstance(block, Mapping)
    )
    return Comparable(items, _ONE_RESULT if has_lone_block else "" if items else _NOTHING_TO_COMPARE)


def _measures_of_design(study: Study, block: str) -> tuple[tuple[str, str], ...]:
    """Return the measures of a block with a design; every measure if the block has problems."""
    protocol = valid_part(study).protocol
    valid_block = None if protocol is None else protocol.blocks.get(block)
    if protocol is None or valid_block is None:
        return _MEASURES
    available = protocol.measures_of(valid_block)
    return tuple(measure for measure in _MEASURES if measure[0] in available)


def _comparable_items(study: Study) -> Iterator[Compared]:
    document = study.document
    for place, block in entries(document, "blocks.*"):
        if not isinstance(block, Mapping) or block.get("phase", "main") != "main":
            continue
        name, title = str(place[1]), distinct_title(document, place)
        if "design" in block:
            measures = _measures_of_design(study, name)
        else:
            measures = tuple(_measures_of_questions(study, str(block.get("questionnaire"))))
        if not measures:
            continue
        yield Compared(key="blocks", block=name, name=name, label=title, measures=measures)
        conditions = block.get("conditions") if "design" not in block else ()
        for key, listed in (("conditions", conditions), ("groups", names(document, "groups"))):
            for condition in listed if isinstance(listed, tuple | list) else ():
                label = f"{distinct_title(document, (key, str(condition)))} in {title}"
                yield Compared(key=key, block=name, name=str(condition), label=label, measures=measures)


def _measures_of_questions(study: Study, questionnaire: str) -> Iterator[tuple[str, str]]:
    """Yield the numeric questions and the scores of a questionnaire, as ID and label."""
    document = study.document
    for path, item in entries(document, f"questionnaires.{questionnaire}.items.*"):
        if isinstance(item, Mapping):
            kind = questions.KINDS.get(str(item.get("kind", questions.STATEMENT)))
            if kind is not None and kind.value_type != "text":
                yield str(item.get("id")), title_of(document, path)
    for path, _ in entries(document, f"questionnaires.{questionnaire}.scores.*"):
        yield str(path[-1]), f"{capitalised(str(path[-1]))} score"


def _form_measures(study: Study) -> dict[str, tuple[tuple[str, str], ...]]:
    """Return for each block the numbers and scores of the questionnaires after it, as FORM/ID and label."""
    protocol, measures_by_block = valid_part(study).protocol, dict[str, tuple[tuple[str, str], ...]]()
    if protocol is None:
        return measures_by_block
    for name, form in protocol.forms.items():
        title = distinct_title(study.document, ("questionnaires", name))
        labels = {score: f"{capitalised(score)} score" for score in form.scores} | {
            item.id: f"“{protocol.text(item.short, protocol.study.languages[0])}”"
            for item in form.items
            if item.value_type != "text"
        }
        measures = tuple((f"{name}/{measure}", f"{text} ({title})") for measure, text in labels.items())
        for block in protocol.blocks_followed_by(name):
            measures_by_block[block] = (*measures_by_block.get(block, ()), *measures)
    return measures_by_block


def _ranges_of_measures(study: Study) -> dict[str, dict[str, float]]:
    """Return for each main block the ranges of its questions and scores, and of the forms after it as FORM/ID."""
    protocol = valid_part(study).protocol
    if protocol is None:
        return {}
    ranges: dict[str, dict[str, float]] = {}
    for block in protocol.main_blocks:
        asked = {"": protocol.questionnaire_of(block.id)} if block.design is None else {}
        for name, form in protocol.forms.items():
            if block.id in protocol.blocks_followed_by(name):
                asked[f"{name}/"] = form
        ranges[block.id] = {
            f"{prefix}{measure}": extent
            for prefix, questionnaire in asked.items()
            if questionnaire is not None
            for measure, extent in questionnaire.ranges(protocol.scales, protocol.study.languages[0]).items()
        }
    return ranges


def _interaction_sides(compared: Sequence[Compared]) -> Iterator[Compared]:
    """Yield an item for each group and each pair of blocks or conditions whose difference can be compared."""
    groups = {item.name: item.label.partition(" in ")[0] for item in compared if item.key == "groups"}
    for first, second in combinations([item for item in compared if item.key != "groups"], 2):
        if groups and first.comparable_with((second,)):
            difference = f"{first.label} − {second.label}"
            for group, title in groups.items():
                yield replace(
                    first, key="groups", name=group, label=f"Interaction: {title}, {difference}", pair_of=first.key,
                    pair=(first.name, second.name), measures=first.shared_measures(second),
                )  # fmt: skip


class Hypothesis(QWidget):
    """The editor of one hypothesis; ``changed`` carries its new table."""

    changed = Signal(object)
    removed = Signal()
    refused = Signal(str)  # the reason for rejecting the typed bound; "" if it is valid

    def __init__(self, name: str) -> None:
        super().__init__()
        self.measures = _MEASURES
        self.known: tuple[Compared, ...] = ()
        self.others: tuple[Compared, ...] = ()
        self.value: Mapping[str, Any] = {}
        boxes = self.measure, self.first, self.relation, self.second = [Choice() for _ in range(4)]
        for box, part in zip(boxes, ("measure", "of what", "relation", "than what"), strict=True):
            make_dense(box, f"{name}, {part}")
            box.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            box.setMinimumContentsLength(6)
            box.activated.connect(self._submit_choice)
        self.within = label("within", "label")
        self.bound = TypedLine(f"{name}, largest negligible difference")
        self.bound.setFixedWidth(64)
        self.bound.typed.connect(self._submit_bound)
        self.away = remove_button(f"Remove {name}", self.removed.emit)
        above = hbox((self.measure, 3), label("of", "label"), (self.first, 5), self.away, spacing=8)
        below = hbox((self.relation, 3), (self.second, 6), self.within, self.bound, spacing=8)
        vbox(above, below, spacing=4, margins=(0, 0, 0, 6), parent=self)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if removes_key(event):
            self.removed.emit()
        else:
            super().keyPressEvent(event)

    def show_value(self, value: Mapping[str, Any], known: tuple[Compared, ...]) -> None:
        self.value, self.known = value, known
        key = next((key for key in ("groups", "conditions") if value.get(key)), "blocks")
        name_lists = (value.get(key) for key in ("blocks", key, "conditions"))
        blocks, named, conditions = (tuple(map(str, entry)) if isinstance(entry, tuple) else () for entry in name_lists)
        pairs = {"conditions": conditions, "blocks": blocks if len(blocks) > 1 else ()} if key == "groups" else {}
        pair = next(((pair_key, names) for pair_key, names in pairs.items() if names), ("", ()))
        places = [(key, name if key == "blocks" else next(iter(blocks), ""), name, *pair) for name in named]
        items = [next((item for item in known if item.place == place), None) for place in places]
        first, second = (*items, None, None)[:2]
        self.others = () if first is None else first.comparable_with(known)
        self.measures = (
            _MEASURES if first is None else first.measures if second is None else first.shared_measures(second)
        )
        measure, relation = value.get("measure", "threshold"), _relation(value)
        measure = f"{value['form']}/{measure}" if value.get("form") else measure
        first_name, second_name = (*named, "", "")[:2]
        for box, shown_name in ((self.measure, measure), (self.first, first_name), (self.second, second_name)):
            box.setPlaceholderText(str(shown_name))  # shown if it is not among the choices
        self._fill_choice(self.measure, self.measures, measure)
        self._fill_choice(self.relation, _RELATIONS, relation)
        self._fill_choice(self.first, tuple((item, item.label) for item in known), first)
        self._fill_choice(self.second, tuple((item, item.label) for item in self.others), second)
        self.bound.show_text("" if (bound := value.get("bound")) is None else typed_value(bound))
        for part in (self.within, self.bound):
            part.setVisible(bound is not None)

    @staticmethod
    def _fill_choice(box: Choice, values: tuple[tuple[Any, str], ...], chosen: Any) -> None:
        labels = [word for _, word in values]
        if labels != [box.itemText(index) for index in range(box.count())]:
            box.clear()
            box.addItems(labels)
        box.setCurrentIndex(next((index for index, (value, _) in enumerate(values) if value == chosen), -1))

    def _submit_choice(self) -> None:
        """Emit the chosen hypothesis; choices that do not fit the first item are replaced."""
        relation = _RELATIONS[max(0, self.relation.currentIndex())][0]
        if not self.known or self.first.currentIndex() < 0:  # the compared item is not among the choices
            keys = ("measure", "form", "blocks", "conditions", "groups")
            table = {key: self.value[key] for key in keys if key in self.value}
            self.changed.emit(
                table | _relation_keys(relation, self._kept_bound(relation, str(self.value.get("measure"))))
            )
            return
        first, others, index = self.known[self.first.currentIndex()], self.others, self.second.currentIndex()
        fitting = first.comparable_with(self.known)
        second = others[index] if 0 <= index < len(others) and others[index] in fitting else fitting[0]
        chosen, shared = self.measures[max(0, self.measure.currentIndex())], first.shared_measures(second)
        measure = (chosen if chosen in shared else shared[0])[0]
        self.changed.emit(
            _comparison_keys(first, second, measure) | _relation_keys(relation, self._kept_bound(relation, measure))
        )

    def _kept_bound(self, relation: Any, measure: str) -> Any:
        """Return the current bound, the default bound of a new equality, or None.

        A hypothesis with a bound and without a direction states an equality, so that a difference has no bound.
        """
        before = self.value.get("bound")
        if relation == "equal" and before is None:
            if measure in {"threshold", "pse"}:
                return DEFAULT_RATIO
            extent = next((item.ranges[measure] for item in self.known if measure in item.ranges), 0.0)
            return _SHARE_OF_RANGE * extent if extent > _WIDE_RANGE else DEFAULT_BOUND
        keeps_direction = relation is not None and _relation(self.value) != "equal"
        return before if relation == "equal" or keeps_direction else None

    def _submit_bound(self, text: str) -> None:
        bound = number_of(text)
        self.refused.emit(
            "" if bound is not None else f"{unclear_number(text)}. {kept_value_sentence(self.value.get('bound'))}"
        )
        if bound is not None:
            self.changed.emit({**self.value, "bound": bound})


def _relation_keys(relation: Any, bound: Any) -> dict[str, Any]:
    """Return the keys that state the relation of a hypothesis."""
    table = {} if relation in {None, "equal"} else {"expected": relation}
    return table if bound is None else {**table, "bound": bound}


def _comparison_keys(first: Compared, second: Compared, measure: str) -> dict[str, Any]:
    """Return the keys that state the items that a hypothesis compares."""
    form, _, measure_id = measure.rpartition("/")
    table: dict[str, Any] = {"measure": measure_id, **({"form": form} if form else {}), "blocks": [first.block]}
    return table | {first.key: [first.name, second.name]} | ({first.pair_of: [*first.pair]} if first.pair else {})


def _comparisons(items: tuple[Compared, ...]) -> Iterator[dict[str, Any]]:
    """Yield the keys of each possible comparison."""
    for first in items:
        for second in first.comparable_with(items):
            for measure, _ in first.shared_measures(second):
                yield _comparison_keys(first, second, measure)


def _comparison_key(value: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a hypothesis without its direction and bound; the order of items does not matter."""
    return {
        key: frozenset(entry) if isinstance(entry, list | tuple) else entry
        for key, entry in value.items()
        if key not in {"expected", "bound"}
    }


def _compared_items(comparison: Mapping[str, Any]) -> dict[str, Any]:
    """Return the compared items of a comparison, without its measure."""
    return {key: entry for key, entry in comparison.items() if key not in {"measure", "form"}}


def _relation(value: Mapping[str, Any]) -> Any:
    return value.get("expected", None if value.get("bound") is None else "equal")


class _HypothesesField(Field):
    """The hypotheses, each as a sentence made of choices."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.lines = [Hypothesis(f"Hypothesis {index + 1}") for index in range(_hypothesis_count(row))]
        for index, line in enumerate(self.lines):
            line.changed.connect(lambda value, index=index: self._change_hypothesis(index, value))
            line.refused.connect(self._refuse)
            line.removed.connect(partial(self._remove_hypothesis, index))
            self.box.addWidget(line)
        self.add, self.why = add_button("Add a hypothesis", "Hypothesis"), label("", "small", "text2", wraps=True)
        self.add.clicked.connect(self._add_hypothesis)
        add_layout(self.box, hbox(self.add, (self.why, 1), spacing=8))
        self.setFocusProxy(self.lines[-1].measure if self.lines else self.add)
        self.show_value()

    def show_value(self) -> None:
        for line, value in zip(self.lines, self.row.value if self.lines else (), strict=False):
            line.show_value(value if isinstance(value, Mapping) else {}, self.row.facts.items)
        self.add.setEnabled(bool(self.row.facts.items))
        self.why.setText(self.row.facts.hint)

    def _add_hypothesis(self) -> None:
        """Add a hypothesis on a measure that has none yet, if possible on the items of the last hypothesis."""
        comparisons = [_comparison_key(value) for value in self.row.value or () if isinstance(value, Mapping)]
        measures = [(value.get("form"), value.get("measure", "threshold")) for value in comparisons]
        form, items = (measures[-1][0], _compared_items(comparisons[-1])) if comparisons else (None, {})

        def repetitions(value: Mapping[str, Any]) -> tuple[bool, ...]:
            comparison = _comparison_key(value)
            measure = comparison.get("form"), comparison["measure"]
            return (
                comparison in comparisons,
                measure in measures,
                measure[0] != form,
                _compared_items(comparison) != items,
            )

        self.asked.emit(AddEntry(self.row.path, min(_comparisons(self.row.facts.items), key=repetitions)))

    def _refuse(self, reason: str) -> None:
        if reason != self.refusal:
            self.refusal = reason
            self.focused.emit()

    def _remove_hypothesis(self, index: int) -> None:
        path = self.row.path
        self.asked.emit(RemoveKey(path if len(self.lines) == 1 else (*path, index)))

    def _change_hypothesis(self, index: int, value: Mapping[str, Any]) -> None:
        path, before = (*self.row.path, index), self.row.value[index]
        if not isinstance(before, Mapping):
            self.asked.emit(SetValue(path, value))
            return
        requests: list[Request] = [
            SetValue((*path, key), entry)
            for key, entry in value.items()
            if (tuple(entry) if isinstance(entry, list) else entry) != before.get(key)
        ]
        requests += [RemoveKey((*path, key)) for key in before if key not in value]
        if requests:
            self.asked.emit(Several("Change hypothesis", tuple(requests)))


def _hypothesis_count(row: FormRow) -> int:
    """Return the number of hypotheses; 0 if the value in the file is not an array."""
    return len(row.value) if isinstance(row.value, tuple) else 0


HYPOTHESES: Final = SpecialEditor(
    (("Analysis", "contrasts"),), _HypothesesField, wide=True, structure=_hypothesis_count, facts=_comparable
)
