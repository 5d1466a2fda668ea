"""The editors of the rows of a form, one for each kind of value."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from study_app.designer.document.fields import Row
from study_app.designer.document.steps import AddNamed, Do, LeaveText, RemoveKey, SetText, SetValue, SwitchKind
from study_app.designer.document.study import Study
from study_app.designer.form.rows import FormRow, choice_words, is_right_to_left, new_words
from study_app.designer.form.typed_fields import FIELD_PX, TypedLine, TypedText
from study_app.designer.place.segments import Segments, cut_text, small_button
from study_app.gui.kit.commands import with_key
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox
from study_app.gui.widgets.controls import ActionButton, Check, Choice, IconButton, Toggle
from study_app.gui.widgets.labels import Elided, label
from study_app.number_text import number_of, typed_numbers

MOST_SEGMENTS, SEGMENT_LETTERS = 4, 34
NUMBER_PX = 96


class Field(Themed, QWidget):
    """Edits the value of one row.

    ``asked`` carries a request, ``came`` says that it is focused; ``caption`` stands above an editor that takes the
    width of the form.
    """

    asked = Signal(object)
    came = Signal()
    caption = ""

    def __init__(self, row: FormRow) -> None:
        super().__init__()
        self.row = row
        self.refusal = ""
        self.box: QBoxLayout = hbox(spacing=8, margins=0, parent=self)

    def show_row(self, row: FormRow) -> None:
        self.row = row
        self.show_value()

    def show_value(self) -> None:
        raise NotImplementedError

    def take_keyboard(self) -> None:
        self.setFocus(Qt.FocusReason.OtherFocusReason)

    def set_value(self, value: Any, *, typing: bool = False) -> None:
        self.asked.emit(SetValue(self.row.row.path, value, typing))

    def placeholder(self) -> str:
        """Return what counts where nothing is written."""
        default = self.row.row.default
        if default in (None, "", [], {}):
            return ""
        return f"{written(default)} (default)"


class LineField(Field):
    """A plain text, one number, or numbers side by side, in one line."""

    typed_in: Callable[[str], Any] = TypedLine

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.line = self.typed_in(row.row.label)
        if row.row.kind in {"number", "whole number"}:
            self.line.setFixedWidth(NUMBER_PX + (48 if self.placeholder() else 0))
            self.line.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.box.addWidget(self.line)
        if row.row.unit:
            self.box.addWidget(label(row.row.unit, "label", "text2"))
        if row.row.kind in {"number", "whole number"}:
            permitted = cut_text(row.range, "small", "text2", right=True)
            self.box.addWidget(permitted, 1)
        self.line.typed.connect(self._take)
        self.line.came.connect(self.came)
        if row.row.kind in {"number", "whole number"}:
            self.line.stepped.connect(self._step)
        self.setFocusProxy(self.line)
        self.show_value()

    def _step(self, by: int) -> None:
        """Count up or down, in the last digit that is shown."""
        shown = self.line.text().strip() or str(self.row.row.default or 0)
        number = number_of(shown)
        if number is None or self.line.isReadOnly():
            return
        digits = len(shown.replace(",", ".").partition(".")[2]) if isinstance(number, float) else 0
        value = round(number + by * 10.0**-digits, digits)
        self.line.setText(f"{value:.{digits}f}")
        self._take(self.line.text())

    def show_value(self) -> None:
        value = self.row.row.value
        self.line.setPlaceholderText(self.placeholder())
        if not self.refusal:
            self.line.show_text("" if value is None else written(value))

    def _take(self, text: str) -> None:
        row, before = self.row.row, self.refusal
        self.refusal = ""
        value: Any = text
        if not text.strip() and row.value is not None and not row.required and row.kind != "text":
            self.asked.emit(RemoveKey(row.path))
        elif row.kind in {"number", "whole number"}:
            value = number_of(text)
            if value is None or (row.kind == "whole number" and isinstance(value, float)):
                wanted = "a whole number" if row.kind == "whole number" else "a number"
                self.refusal = f"“{text}” is not {wanted}. {kept(row.value)}"
        elif row.kind in {"numbers", "vector"}:
            try:
                value = [number for _, number in typed_numbers(text)]
            except ValueError as unclear:
                self.refusal = f"{unclear}. {kept(row.value)}"
        self.line.show_refused(bool(self.refusal))
        if self.refusal or before:
            self.came.emit()  # the form shows what is wrong with it, or no longer
        if not self.refusal and (text.strip() or row.kind == "text" or row.required):
            self.set_value(value, typing=True)


class SwitchField(Field):
    """True or false."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.toggle = Toggle()
        self.toggle.setFont(font("label"))
        self.toggle.setAccessibleName(row.row.label)
        self.toggle.clicked.connect(lambda checked: self.set_value(bool(checked)))
        add_parts(self.box, self.toggle, STRETCH)
        self.setFocusProxy(self.toggle)
        self.show_value()

    def show_value(self) -> None:
        row = self.row.row
        self.toggle.setChecked(bool(row.default if row.value is None else row.value))


class ChoiceField(Field):
    """One of some words: few and short ones side by side, others in a list; a reference has an arrow to its element."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        words = [choice_words(choice, None) for choice in row.row.choices]
        few = 1 < len(words) <= MOST_SEGMENTS and sum(len(one) + 3 for one in words) <= SEGMENT_LETTERS
        self.segments = Segments(row.row.label) if few and row.row.kind != "reference" else None
        self.list: Choice | None = None
        if self.segments is not None:
            self.segments.chosen.connect(self._choose)
            add_parts(self.box, self.segments, STRETCH)
        else:
            self.list = Choice()
            self.list.setProperty("dense", "true")
            self.list.setFont(font("label", weight=400))
            self.list.setFixedHeight(FIELD_PX)
            self.list.setAccessibleName(row.row.label)
            self.list.setMinimumContentsLength(12)
            self.list.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            self.list.activated.connect(self._pick)
            self.box.addWidget(self.list, 1)
        self._values: list[str | None] = []
        opens = f"Open what {row.row.label} names"
        self.arrow = IconButton("arrow_right", opens, with_key(f"{opens}; back", "back"), size=FIELD_PX)
        self.arrow.clicked.connect(lambda: self.asked.emit(Do("select", (self.row.target,))))
        if row.row.kind == "reference":
            self.box.addWidget(self.arrow)
        self.setFocusProxy(self.segments or self.list or self.arrow)
        self.show_value()

    def show_value(self) -> None:
        row = self.row.row
        shown = row.default if row.value is None else row.value
        values = [(choice.value, self.words(choice)) for choice in row.choices]
        if row.kind == "reference":
            values = [(name, f"{name} ({note})" if note else name) for name, note in self.row.notes]
        if self.segments is not None:
            plain = [(choice.value, choice_words(choice, None)) for choice in row.choices]
            self.segments.show_values(plain, shown)
            return
        assert self.list is not None  # noqa: S101 - one of the two is there
        if shown is not None and shown not in [value for value, _ in values]:
            values.append((shown, str(shown)))
        values += [(section, new_words(section)) for section in row.sections]
        if [words for _, words in values] != [self.list.itemText(at) for at in range(self.list.count())]:
            self.list.clear()
            self.list.addItems([words for _, words in values])
            for at, choice in enumerate(row.choices):
                self.list.setItemData(at, choice.sentence, Qt.ItemDataRole.ToolTipRole)
        self._values = [value for value, _ in values]
        known = self._values[: len(values) - len(row.sections)]
        self.list.setCurrentIndex(known.index(shown) if shown in known else -1)
        self.list.setPlaceholderText("" if known else "Nothing can be named yet")
        self.arrow.setEnabled(self.row.target is not None)

    def words(self, choice: Any) -> str:
        return choice_words(choice, self.row.row.default)

    def _pick(self, at: int) -> None:
        """Choose a value; one of the last entries adds an element and names it."""
        sections = self.row.row.sections
        new = at - (len(self._values) - len(sections))
        if new < 0:
            self._choose(self._values[at])
            return
        self.show_value()
        self.asked.emit(AddNamed(self.row.row.path, sections[new]))

    def _choose(self, value: Any) -> None:
        row = self.row.row
        if row.kind == "kind":
            self.asked.emit(SwitchKind(row.path[:-1], value))
        elif value is not None and value != row.value:
            self.set_value(value)
        self.came.emit()


class ChecksField(Field):
    """Several of some words."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(0)
        self.checks: dict[str, Check] = {}
        for choice in row.row.choices:
            made = Check(choice_words(choice, None))
            made.setFont(font("label", weight=400))
            made.setAccessibleName(f"{row.row.label}, {made.text()}")
            made.setToolTip(choice.sentence)
            made.clicked.connect(self._take)
            self.checks[str(choice.value)] = made
            self.box.addWidget(made)
        if self.checks:
            self.setFocusProxy(next(iter(self.checks.values())))
        self.show_value()

    def show_value(self) -> None:
        row = self.row.row
        chosen = row.value if isinstance(row.value, tuple) else row.default or ()
        for value, check in self.checks.items():
            check.setChecked(value in chosen)

    def _take(self) -> None:
        row = self.row.row
        there = [value for value in row.value or () if value in self.checks and self.checks[value].isChecked()]
        there += [value for value, check in self.checks.items() if check.isChecked() and value not in there]
        self.set_value(there)


class UnknownField(Field):
    """A key that does not belong to the table: its value, which can only be removed here."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.value = Elided("label", "text2")
        self.box.addWidget(self.value, 1)
        self.show_value()

    def show_value(self) -> None:
        self.value.show_text(written(self.row.row.value))


def add_button(name: str, words: str = "") -> ActionButton:
    """Return a quiet button with a plus."""
    made = small_button("plus", words or name, role="plain", height=32)
    made.setAccessibleName(name)
    return made


def kept(value: Any) -> str:
    """Return which value a study keeps while what was typed is refused."""
    if value is None:
        return "The study does not use it; Esc clears the field."
    return f"The study keeps {written(value)}; Esc restores it."


def written(value: Any) -> str:
    """Return a value as it is typed: numbers of a list with spaces between."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple | list):
        return "  ".join(written(part) for part in value)
    return str(value)


class LanguagesField(Field):
    """A text in each language, side by side, or below each other where there are more than two or several lines."""

    one: type[TypedLine | TypedText] = TypedLine
    """What a text of one paragraph is typed into."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        several, down = row.row.kind == "paragraphs", stacked(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(4)
        self.outer = self.box
        self.box = QVBoxLayout() if down else QHBoxLayout()
        self.box.setSpacing(8)
        add_layout(self.outer, self.box)
        self.lines: dict[str, TypedLine | TypedText] = {}
        for code, language in row.languages:
            name = row.row.label if len(row.languages) == 1 else f"{row.row.label}, {language}"
            made = (TypedText if several else self.one)(name)
            if len(row.languages) > 1:
                made.setPlaceholderText(f"Missing in {language}")
                made.setToolTip(language)
            if is_right_to_left(code):
                made.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
            made.typed.connect(lambda text, code=code: self.asked.emit(SetText(self.row.row.path, code, text)))
            made.left.connect(lambda: self.asked.emit(LeaveText(self.row.row.path)))
            made.came.connect(self.came)
            self.lines[code] = made
            if down and len(row.languages) > 1:
                self.box.addWidget(label(language, "small", "text2"))
            self.box.addWidget(made)
        if len(self.lines) > 1:
            for line in self.lines.values():
                line.beside = tuple(self.lines.values())
        self.setFocusProxy(next(iter(self.lines.values())))
        self.show_value()

    @cached_property
    def copied(self) -> QLabel:
        """Which texts are those of the first language; made when it is first needed."""
        made = label("", "small", "warn")
        made.hide()
        self.outer.addWidget(made)
        return made

    @property
    def some_missing(self) -> bool:
        written = [bool(line.words().strip()) for line in self.lines.values()]
        return any(written) and not all(written)

    def show_value(self) -> None:
        """Show each text; a plain one stands for the first language. A text that is that of the first one is marked."""
        value = self.row.row.value
        named, copies = self.row.languages[0][1], self.row.copied
        if copies or "copied" in self.__dict__:
            self.copied.setText(f"As in {named}, not translated yet: {', '.join(copies)}")
            self.copied.setVisible(bool(copies))
        for number, (code, line) in enumerate(self.lines.items()):
            text = value.get(code, "") if isinstance(value, dict) else value if number == 0 else ""
            line.show_text(text if isinstance(text, str) else "")

    def take_keyboard(self) -> None:
        first = next((line for line in self.lines.values() if not line.words()), self)
        first.setFocus(Qt.FocusReason.OtherFocusReason)


def stacked(row: FormRow) -> bool:
    """Return whether texts in several languages are below each other, each with its language."""
    return len(row.languages) > 2 or row.row.kind == "paragraphs"


@dataclass(frozen=True, slots=True)
class SpecialEditor:
    """An editor of certain keys; bounds, faults, help and removal stay those of the row."""

    keys: tuple[tuple[str, str], ...]  # title of the model in the JSON Schema, such as "Block", and the key
    make: Callable[[FormRow], Field]  # makes the editor of a row
    wide: bool = False  # whether it takes the width of the form, with the label above it
    labelled: bool = True  # whether the label is shown; a screen reader says it in any case
    # returns what makes another editor necessary, beyond what does for every row
    structure: Callable[[FormRow], object] = lambda _row: None
    # returns what it shows beyond the value of its row, of a study that may have faults: a frozen value
    facts: Callable[[Study, Row], Any] | None = None
