"""Editors of certain keys: sentences, order, points of a scale, kind and list of questions, hypotheses."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
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

_ROUNDS: Final = 3
_SQUARES: Final[Mapping[Any, Literal["williams", "latin"]]] = {"williams": "williams", "latin": "latin"}


def _order_balance(study: Study, row: Row) -> tuple[Verdict, str] | None:
    """Return how balanced the order of a block is, and the explanation.

    None if it has only one condition, or another method determines its order.
    """
    block = value_at(study.document, row.path[:-1])
    conditions = block.get("conditions") if isinstance(block, Mapping) else None
    if not isinstance(conditions, tuple) or len(conditions) < 2 or "design" in block:
        return None
    order, codes = row.default if row.value is None else row.value, len(conditions)
    if order == "fixed":
        return ("neutral", "ring", "same for everyone"), "The effects of condition and position cannot be separated."
    if not isinstance(order, str) or order not in _SQUARES:
        drawn = "A new order is drawn for each session, so positions are balanced only on average."
        return ("neutral", "ring", "balanced on average"), drawn
    square, repetitions = _SQUARES[order], block.get("repetitions", 1)
    rows = row_count(square, codes)
    numbers = ", ".join(str(rows * number) for number in range(1, _ROUNDS + 1))
    carries = square == "williams" and isinstance(repetitions, int) and has_even_borders(codes, max(1, repetitions))
    at = f"for any multiple of {rows} participants{' in a group' if study.document.get('groups') else ''}."
    if carries or codes == 2:
        return ("ok", "check", f"balanced for {numbers} …"), f"Positions and carry-over are balanced {at}"
    return ("warn", "warning", f"partly for {numbers} …"), f"Only positions are balanced {at}"


@dataclass(frozen=True, slots=True)
class _ScalePoints:
    """Code and name of each language, and the labels of each point in each language, "" if missing."""

    languages: tuple[tuple[str, str], ...]
    points: tuple[tuple[str, ...], ...]


def _scale_points(study: Study, row: Row) -> _ScalePoints:
    """Return the points of a scale in the study's languages and any additional ones."""
    labels = row.value if isinstance(row.value, Mapping) else {}
    codes = list(dict.fromkeys([*languages_of(study.document), *labels]))
    columns = [labels[code] if isinstance(labels.get(code), tuple) else () for code in codes]
    count = max(map(len, columns), default=0)
    points = tuple(tuple(str(column[at]) if at < len(column) else "" for column in columns) for at in range(count))
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
        for at, text in enumerate(line.texts):
            across.addWidget(self._text_part(text, line.note if at == 0 else ""), 1)
        self.open = IconButton("chevron", f"Open question {line.number}, {title}", size=OPEN_PX, role="plain")
        self.open.clicked.connect(self.opened)
        across.addWidget(self.open)

    def _text_part(self, text: str, note: str) -> QWidget:
        if not text:
            return self._missing_part()
        if not note:
            return _column_text(text, "label")
        both = QWidget()
        vbox(_column_text(text, "label"), _column_text(note, "small", "text2"), spacing=0, margins=0, parent=both)
        both.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        return both

    def _missing_part(self) -> QWidget:
        made = QWidget()
        made.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        self.write = small_button("", "Write", height=32)
        self.write.setAccessibleName(f"Write the missing text for question {self.line.number}")
        self.write.clicked.connect(self.opened)
        faulty = self.line.faults > 0
        ink: Ink = "bad" if faulty else "text2"
        missing = Icon("warning" if faulty else "info", ink, 16), label("Missing", "label", ink)
        hbox(*missing, STRETCH, self.write, spacing=6, margins=0, parent=made)
        return made

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self.rect().contains(event.position().toPoint()):
            self.opened.emit()


def _column_text(text: str, role: TypeRole, ink: Ink = "text") -> QLabel:
    """Return a text label as wide as its column."""
    made = label(text, role, ink, wraps=True)
    policy = made.sizePolicy()
    policy.setHorizontalPolicy(QSizePolicy.Policy.Ignored)
    made.setSizePolicy(policy)
    return made


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
            heads = QWidget()
            columns = ((_column_text(language, "small", "text2"), 1) for language in languages)
            hbox(*columns, spacing=8, margins=(_INSET_PX, 0, OPEN_PX + 8, 0), parent=heads)
            self.column.addWidget(heads)
        for line in lines:
            made = _QuestionRow(line)
            made.opened.connect(lambda path=line.path: self.asked.emit(Do("write", (path,))))
            add_parts(self.column, made, Rule())
            made.show()  # at once: a layout shows it later, and would then move the row that was scrolled to
            self.rows.append(made)


class Panel(Themed, QWidget):
    """The background of the form: tinted, with an accent line at the left while one of several questions is edited."""

    tinted = False

    def paintEvent(self, _event: QPaintEvent) -> None:
        if not self.tinted:
            return
        paint_ground(self, self.theme.selected)
        QPainter(self).fillRect(QRectF(0, 2, 3, self.height() - 4), QColor(self.theme.accent))


DESCRIPTION: Final = SpecialEditor(
    (("StudyHead", "description"),), partial(LineField, typed_in=partial(TypedSentence, most_lines=3))
)


_QUESTIONS: Final = (*(kind.__name__ for kind in questions.KINDS.own.values()), *questions.KINDS.others)
_TASKS: Final = (*(kind.__name__ for kind in TASK_KINDS.own.values()), *TASK_KINDS.others)
_DESIGNS: Final = tuple({kind.__name__ for kind in DESIGN_KINDS.values()})
"""The titles of their tables."""


SENTENCES: Final = SpecialEditor(
    (
        ("Questionnaire", "intro"),
        *((kind, "text") for kind in _QUESTIONS),
        *((kind, "instruction") for kind in _TASKS),
        *((kind, "question") for kind in _DESIGNS),
    ),
    partial(LanguagesField, typed_in=TypedSentence),
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
        cells, languages, last = grid(6, 6), row.facts.languages, len(row.facts.points) - 1
        for column, (_code, language) in enumerate(languages, start=1):
            cells.addWidget(label(language, "small", "text2"), 0, column)
        self.lines: list[list[TypedLine]] = []
        for at in range(last + 1):
            sign = f"{at + 1}  {({0: 'lowest', last: 'highest'}).get(at, '')}".strip()
            cells.addWidget(figures(sign, "label", "text2"), at + 1, 0)
            self.lines.append([TypedLine(f"Point {at + 1}, {language}") for _code, language in languages])
            for column, (line, (code, language)) in enumerate(zip(self.lines[-1], languages, strict=True)):
                line.setProperty(LANGUAGE, code)
                line.setPlaceholderText(f"Missing in {language}")
                if is_right_to_left(code):
                    line.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
                line.typed.connect(partial(self.take_text, at, column))
                line.came.connect(self.came)
                cells.addWidget(line, at + 1, column + 1)
            away = remove_button(f"Remove Point {at + 1}", partial(self.remove, at))
            cells.addWidget(away, at + 1, len(languages) + 1)
        add_layout(self.box, cells)
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

    def _count_written(self, code: str) -> int:
        return len((self.row.value or {}).get(code, ()))

    def take_text(self, at: int, column: int, text: str) -> None:
        code = self.row.facts.languages[column][0]
        path, count = (*self.row.path, code), self._count_written(code)
        missing = [*((self.row.value or {}).get(code, ())), *[""] * (at - count), text]
        changed = SetValue((*path, at), text, typing=True) if at < count else SetValue(path, missing, typing=True)
        self.asked.emit(changed)

    def add_entry(self) -> None:
        path, label = self.row.path, f"Point {len(self.lines) + 1}"
        added = (AddEntry((*path, code), label) for code, _ in self.row.facts.languages if self._count_written(code))
        self.asked.emit(Several("Add point", tuple(added)))

    def remove(self, at: int) -> None:
        path = self.row.path
        gone = (RemoveKey((*path, code, at)) for code, _ in self.row.facts.languages if at < self._count_written(code))
        self.asked.emit(Several(f"Remove point {at + 1}", tuple(gone)))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        at = next((at for at, lines in enumerate(self.lines) if any(line.hasFocus() for line in lines)), None)
        if at is not None and removes_key(event):
            self.remove(at)
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


def _order_of_blocks(study: Study, _row: Row) -> str:
    """Return a sentence on the blocks' order for the planned participants; "" while it is unknown."""
    protocol = valid_part(study).protocol
    if protocol is None or len(protocol.main_blocks) < 2:
        return ""
    sentences = {group: sentences.partition(": ")[2] for group, sentences in block_orders_by_group(protocol).items()}
    return " ".join(
        f"{capitalised(f'{group}: {sentence}' if group else sentence)}." for group, sentence in sentences.items()
    )


def _choice_sentences(_study: Study, row: Row) -> str:
    """Return the sentence about each choice, one per line."""
    described = [choice for choice in row.choices if choice.value is not None and choice.sentence]
    return "\n".join(f"{label_of(choice.value or '')}: {choice.sentence}." for choice in described)


class _Said(Extra, QLabel):
    """A sentence below a choice that explains it."""

    def __init__(self) -> None:
        super().__init__(wordWrap=True)
        self.setFont(font("small"))
        self.setProperty("role", "text2")

    def show_facts(self, facts: Any) -> None:
        self.setText(facts)


BLOCK_ORDER: Final = SpecialEditor((("StudyHead", "block_order"),), adds=lambda _field: _Said(), facts=_order_of_blocks)
GROUP_ASSIGNMENT: Final = SpecialEditor(
    (("StudyHead", "group_assignment"),), adds=lambda _field: _Said(), facts=_choice_sentences
)

_MEASURES: Final[tuple[tuple[str, str], ...]] = (
    ("threshold", "Threshold"), ("exponent", "Exponent"), ("d_prime", "Sensitivity d′"), ("pse", "Setting (PSE)"),
)  # fmt: skip
_RELATIONS: Final = (
    (None, "is different from"), ("higher", "is higher than"), ("lower", "is lower than"), ("equal", "is equal to"),
)  # fmt: skip
BOUND, RATIO = 0.5, 1.25
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
    """A block, or a condition or group in a block, with its measures and their texts.

    A group with a ``pair`` of blocks or conditions (the key is ``pair_of``) is a side of an interaction.
    """

    key: str  # the key of the file that names it
    block: str
    name: str
    words: str
    measures: tuple[tuple[str, str], ...]
    pair_of: str = ""
    pair: tuple[str, ...] = ()

    @property
    def place(self) -> tuple[object, ...]:
        """What tells the item from others: the key, block, name and pair."""
        return self.key, self.block, self.name, self.pair_of, self.pair

    def comparable_with(self, every: tuple["Compared", ...]) -> tuple["Compared", ...]:
        """Return the items it can be compared with: blocks with a common measure, or items of the same block."""
        alike = (item for item in every if item.key == self.key and item.name != self.name and item.pair == self.pair)
        return tuple(
            item for item in alike if self.shared_measures(item) and (self.key == "blocks" or item.block == self.block)
        )

    def shared_measures(self, other: "Compared") -> tuple[tuple[str, str], ...]:
        """Return the measures that both items have."""
        return tuple(measure for measure in self.measures if measure in other.measures)


@dataclass(frozen=True, slots=True)
class Comparable:
    """The items that hypotheses can compare, in file order, and a hint at what cannot be compared yet."""

    items: tuple[Compared, ...]
    hint: str


def _comparable(study: Study, _row: Row) -> Comparable:
    after = _form_measures(study)
    every = tuple(
        item if item.key == "conditions" else replace(item, measures=(*item.measures, *after.get(item.block, ())))
        for item in _comparable_items(study)
    )
    every += tuple(_interaction_sides(every))
    items = tuple(item for item in every if item.comparable_with(every))
    compared = {item.name for item in items if item.key == "blocks"}
    alone = any(
        place[1] not in compared and block.get("phase", "main") == "main" and {"design", "conditions"} <= block.keys()
        for place, block in entries(study.document, "blocks.*")
        if isinstance(block, Mapping)
    )
    return Comparable(items, _ONE_RESULT if alone else "" if items else _NOTHING_TO_COMPARE)


def _measures_of_design(study: Study, block: str) -> tuple[tuple[str, str], ...]:
    """Return the measures of a block with a design; every measure if the block has problems."""
    protocol = valid_part(study).protocol
    valid = None if protocol is None else protocol.blocks.get(block)
    if protocol is None or valid is None:
        return _MEASURES
    known = protocol.measures_of(valid)
    return tuple(measure for measure in _MEASURES if measure[0] in known)


def _comparable_items(study: Study) -> Iterator[Compared]:
    document = study.document
    for place, block in entries(document, "blocks.*"):
        if not isinstance(block, Mapping) or block.get("phase", "main") != "main":
            continue
        name, title = str(place[1]), distinct_title(document, place)
        if "design" in block:
            measures = _measures_of_design(study, name)
        else:
            asked = entries(document, f"questionnaires.{block.get('questionnaire')}.items.*")
            items = ((item, path) for path, item in asked if isinstance(item, Mapping) and "kind" not in item)
            measures = tuple((str(item.get("id")), title_of(document, path)) for item, path in items)
        if not measures:
            continue
        yield Compared(key="blocks", block=name, name=name, words=title, measures=measures)
        conditions = block.get("conditions") if "design" not in block else ()
        for key, inner in (("conditions", conditions), ("groups", names(document, "groups"))):
            for condition in inner if isinstance(inner, tuple | list) else ():
                label = f"{distinct_title(document, (key, str(condition)))} in {title}"
                yield Compared(key=key, block=name, name=str(condition), words=label, measures=measures)


def _form_measures(study: Study) -> dict[str, tuple[tuple[str, str], ...]]:
    """Return the numbers and scores of the valid forms after each block as FORM/ID with their words."""
    protocol, after = valid_part(study).protocol, dict[str, tuple[tuple[str, str], ...]]()
    if protocol is None:
        return after
    for name, form in protocol.forms.items():
        title = distinct_title(study.document, ("questionnaires", name))
        words = {score: f"{capitalised(score)} score" for score in form.scores} | {
            item.id: f"“{protocol.text(item.short, protocol.study.languages[0])}”"
            for item in form.items
            if item.value_type != "text"
        }
        measures = tuple((f"{name}/{measure}", f"{label} ({title})") for measure, label in words.items())
        for block in filter(None, protocol.follows(name)):
            after[block] = (*after.get(block, ()), *measures)
    return after


def _interaction_sides(every: Sequence[Compared]) -> Iterator[Compared]:
    """Yield each group with each pair of blocks, or of conditions of a block, whose difference can be compared."""
    groups = {item.name: item.words.partition(" in ")[0] for item in every if item.key == "groups"}
    for first, second in combinations([item for item in every if item.key != "groups"], 2):
        if groups and first.comparable_with((second,)):
            words = f"{first.words} − {second.words}"
            for group, title in groups.items():
                yield replace(
                    first, key="groups", name=group, words=f"Interaction: {title}, {words}", pair_of=first.key,
                    pair=(first.name, second.name), measures=first.shared_measures(second),
                )  # fmt: skip


class Hypothesis(QWidget):
    """One hypothesis; ``changed`` carries its current table."""

    changed = Signal(object)
    removed = Signal()
    refused = Signal(str)  # why the typed bound is refused; "" if it is valid

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
            box.activated.connect(self._take_choice)
        self.within = label("within", "label")
        self.bound = TypedLine(f"{name}, largest negligible difference")
        self.bound.setFixedWidth(64)
        self.bound.typed.connect(self._take_bound)
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
        listed = (value.get(key) for key in ("blocks", key, "conditions"))
        blocks, named, conditions = (tuple(map(str, entry)) if isinstance(entry, tuple) else () for entry in listed)
        pairs = {"conditions": conditions, "blocks": blocks if len(blocks) > 1 else ()} if key == "groups" else {}
        pair = next(((of, names) for of, names in pairs.items() if names), ("", ()))
        at = [(key, name if key == "blocks" else next(iter(blocks), ""), name, *pair) for name in named]
        items = [next((item for item in known if item.place == place), None) for place in at]
        first, second = (*items, None, None)[:2]
        self.others = () if first is None else first.comparable_with(known)
        self.measures = (
            _MEASURES if first is None else first.measures if second is None else first.shared_measures(second)
        )
        measure, relation = value.get("measure", "threshold"), _relation(value)
        measure = f"{value['form']}/{measure}" if value.get("form") else measure
        first_name, two = (*named, "", "")[:2]
        for box, word in ((self.measure, measure), (self.first, first_name), (self.second, two)):
            box.setPlaceholderText(str(word))  # shown where it is not among the choices
        self._fill_choice(self.measure, self.measures, measure)
        self._fill_choice(self.relation, _RELATIONS, relation)
        self._fill_choice(self.first, tuple((item, item.words) for item in known), first)
        self._fill_choice(self.second, tuple((item, item.words) for item in self.others), second)
        self.bound.show_text("" if (bound := value.get("bound")) is None else typed_value(bound))
        for part in (self.within, self.bound):
            part.setVisible(bound is not None)

    @staticmethod
    def _fill_choice(box: Choice, values: tuple[tuple[Any, str], ...], chosen: Any) -> None:
        labels = [word for _, word in values]
        if labels != [box.itemText(at) for at in range(box.count())]:
            box.clear()
            box.addItems(labels)
        box.setCurrentIndex(next((at for at, (value, _) in enumerate(values) if value == chosen), -1))

    def _take_choice(self) -> None:
        """Emit the chosen hypothesis; replace choices that no longer fit the first item."""
        relation = _RELATIONS[max(0, self.relation.currentIndex())][0]
        if not self.known or self.first.currentIndex() < 0:  # what it compares is not among the choices
            keys = ("measure", "form", "blocks", "conditions", "groups")
            table = {key: self.value[key] for key in keys if key in self.value}
            self.changed.emit(
                table | _relation_keys(relation, self._kept_bound(relation, str(self.value.get("measure"))))
            )
            return
        first, others, at = self.known[self.first.currentIndex()], self.others, self.second.currentIndex()
        fitting = first.comparable_with(self.known)
        second = others[at] if 0 <= at < len(others) and others[at] in fitting else fitting[0]
        chosen, shared = self.measures[max(0, self.measure.currentIndex())], first.shared_measures(second)
        measure = (chosen if chosen in shared else shared[0])[0]
        self.changed.emit(
            _comparison_keys(first, second, measure) | _relation_keys(relation, self._kept_bound(relation, measure))
        )

    def _kept_bound(self, relation: Any, measure: str) -> Any:
        """Return the current bound, the default bound of a new equality, or None."""
        before = self.value.get("bound")
        if relation == "equal" and before is None:
            return RATIO if measure in {"threshold", "pse"} else BOUND
        return before if relation == "equal" or _relation(self.value) != "equal" else None

    def _take_bound(self, text: str) -> None:
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
    form, _, own = measure.rpartition("/")
    table: dict[str, Any] = {"measure": own, **({"form": form} if form else {}), "blocks": [first.block]}
    return table | {first.key: [first.name, second.name]} | ({first.pair_of: [*first.pair]} if first.pair else {})


def _comparisons(every: tuple[Compared, ...]) -> Iterator[dict[str, Any]]:
    """Yield the keys of each possible comparison."""
    for first in every:
        for second in first.comparable_with(every):
            for measure, _ in first.shared_measures(second):
                yield _comparison_keys(first, second, measure)


def _comparison(value: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a hypothesis compares, regardless of the order and the expected direction."""
    return {
        key: frozenset(entry) if isinstance(entry, list | tuple) else entry
        for key, entry in value.items()
        if key not in {"expected", "bound"}
    }


def _items_compared(comparison: Mapping[str, Any]) -> dict[str, Any]:
    """Return a comparison without its measure."""
    return {key: entry for key, entry in comparison.items() if key not in {"measure", "form"}}


def _relation(value: Mapping[str, Any]) -> Any:
    return value.get("expected", None if value.get("bound") is None else "equal")


class _HypothesesField(Field):
    """A sentence with choices for each hypothesis."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.lines = [Hypothesis(f"Hypothesis {at + 1}") for at in range(_hypothesis_count(row))]
        for at, line in enumerate(self.lines):
            line.changed.connect(lambda value, at=at: self._change_hypothesis(at, value))
            line.refused.connect(self._refuse)
            line.removed.connect(partial(self._remove_hypothesis, at))
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
        """Add a hypothesis on a measure without one, if possible on the items that the last hypothesis compares."""
        known = [_comparison(value) for value in self.row.value or () if isinstance(value, Mapping)]
        measures = [(value.get("form"), value.get("measure", "threshold")) for value in known]
        form, items = (measures[-1][0], _items_compared(known[-1])) if known else (None, {})

        def is_repeated(value: Mapping[str, Any]) -> tuple[bool, ...]:
            own = _comparison(value)
            measure = own.get("form"), own["measure"]
            return own in known, measure in measures, measure[0] != form, _items_compared(own) != items

        self.asked.emit(AddEntry(self.row.path, min(_comparisons(self.row.facts.items), key=is_repeated)))

    def _refuse(self, why: str) -> None:
        if why != self.refusal:
            self.refusal = why
            self.came.emit()

    def _remove_hypothesis(self, at: int) -> None:
        path = self.row.path
        self.asked.emit(RemoveKey(path if len(self.lines) == 1 else (*path, at)))

    def _change_hypothesis(self, at: int, value: Mapping[str, Any]) -> None:
        path, before = (*self.row.path, at), self.row.value[at]
        if not isinstance(before, Mapping):
            self.asked.emit(SetValue(path, value))
            return
        asked: list[Request] = [
            SetValue((*path, key), entry)
            for key, entry in value.items()
            if (tuple(entry) if isinstance(entry, list) else entry) != before.get(key)
        ]
        asked += [RemoveKey((*path, key)) for key in before if key not in value]
        if asked:
            self.asked.emit(Several("Change hypothesis", tuple(asked)))


def _hypothesis_count(row: FormRow) -> int:
    """Return the number of a row's hypotheses; 0 if the file has a value of another kind."""
    return len(row.value) if isinstance(row.value, tuple) else 0


HYPOTHESES: Final = SpecialEditor(
    (("Analysis", "contrasts"),), _HypothesesField, wide=True, structure=_hypothesis_count, facts=_comparable
)
