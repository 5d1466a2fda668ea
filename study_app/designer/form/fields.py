"""The editors of a form's rows, one for each kind of value, and their text fields.

Typed text is submitted after a short delay, at Enter, and when the field is left.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from PySide6.QtCore import QEvent, QMimeData, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence, QResizeEvent
from PySide6.QtWidgets import QApplication, QBoxLayout, QLabel, QLineEdit, QPlainTextEdit, QWidget

from study_app.designer.document.fields import Row
from study_app.designer.document.steps import Do, LeaveText, RemoveKey, SetText, SetValue, SwitchKind
from study_app.designer.document.study import Study
from study_app.designer.form.design_list import DesignList
from study_app.designer.form.rows import FormRow, choice_label, is_right_to_left
from study_app.designer.parts import FIELD_PX, Segments, cut_text, make_dense, small_button
from study_app.gui.kit import keys_of, with_key
from study_app.gui.theme import Themed, font
from study_app.gui.widgets import (
    STRETCH,
    ActionButton,
    Check,
    Choice,
    Elided,
    IconButton,
    Toggle,
    add_parts,
    hbox,
    label,
    plain_tip,
    set_property,
    vbox,
)
from study_app.number_text import number_of, typed_numbers, unclear_number
from study_app.protocol.questions import STATEMENT
from study_app.protocol.wording import language_name

SUBMIT_DELAY_MS = 150
"""Delay from the first unsubmitted key until typed text is submitted, even while typing continues [ms]."""
CLICK_MS = 10
"""Interval of checking whether the click that took the focus from a field has ended [ms]."""
MAX_LINES, SENTENCE_EDGE_PX = 6, 16
"""Greatest number of lines of a sentence, and the total margin above and below them [px]."""
_LINE_BREAK = re.compile(r"\s*[\r\n\u2028\u2029]+\s*")
_WINDOW_REASONS = {Qt.FocusReason.ActiveWindowFocusReason, Qt.FocusReason.PopupFocusReason}
PAGE_KEYS = (QKeySequence.StandardKey.Undo, QKeySequence.StandardKey.Redo, QKeySequence.StandardKey.Save)

LANGUAGE: Final = "language"
"""The field property with the language code of its text."""


def removes_key(event: QKeyEvent) -> bool:
    """Return whether a key press removes the field's key from the file."""
    return QKeySequence(event.keyCombination()) == QKeySequence(keys_of("remove")[0])


def remove_button(name: str, remove: Callable[[], object]) -> IconButton:
    """Return a × button that Tab skips, because a key in its field does the same."""
    button = IconButton("cross", name, with_key(name, "remove"), size=FIELD_PX, role="plain")
    button.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
    button.clicked.connect(lambda _on=False: remove())
    return button


if TYPE_CHECKING:
    _WidgetBase = QWidget
else:
    _WidgetBase = object  # a mixin of Qt's fields


class _Typed(_WidgetBase):
    """Common base of single-line and multi-line fields.

    ``typed`` carries the submitted text; ``focused`` and ``left`` are emitted when the field gets and loses the focus.
    """

    typed: Any
    focused: Any
    left: Any
    submits_while_typing = True
    """Whether text is submitted while typing, not only at Enter and when the field is left."""
    beside: Sequence[_Typed] = ()
    """The fields of a text in several languages, including this one."""

    def begin(self) -> None:
        self.pending = False
        self._before = ""
        self._submit_timer = QTimer(self)
        self._submit_timer.setSingleShot(True)
        self._submit_timer.timeout.connect(self._flush_after_click)

    def note_typing(self) -> None:
        self.pending = True
        if self.submits_while_typing and not self._submit_timer.isActive():
            self._submit_timer.start(SUBMIT_DELAY_MS)

    def flush(self) -> None:
        self._submit_timer.stop()
        if self.pending:
            self.pending = False
            self.typed.emit(self.typed_text())

    def _flush_after_click(self) -> None:
        """Submit the text as soon as no mouse button is pressed and no list is open, before another form is shown."""
        if QApplication.mouseButtons() == Qt.MouseButton.NoButton and QApplication.activePopupWidget() is None:
            self.flush()
            if not self.hasFocus():
                self.left.emit()
        else:
            self._submit_timer.start(CLICK_MS)

    def accept(self) -> None:
        """Submit the typed text; unless it is rejected, Esc restores this text from now on."""
        self.flush()
        if self.property("state") != "refused":
            self._before = self.typed_text()

    def typed_text(self) -> str:
        raise NotImplementedError

    def has_nothing_to_delete(self) -> bool:
        """Return whether there is no text after the caret, and none in the other languages."""
        return self.is_at_end() and not any(field.typed_text() for field in self.beside if field is not self)

    def is_at_end(self) -> bool:
        """Return whether the caret is at the end of a text without a selection, or all of it is selected."""
        raise NotImplementedError

    def accept_shown_text(self) -> None:
        """Accept the shown text as the value of another element: Esc restores it, and no rejection is marked."""
        self.show_refused(False)
        self._before = self.typed_text()

    def restore(self) -> None:
        """Restore the text that was present when the field got the focus."""
        self._submit_timer.stop()
        self.pending = False
        if self.typed_text() != self._before:
            self.show_text(self._before)
            self.typed.emit(self._before)

    def show_text(self, text: str) -> None:
        """Show a text, unless another one is being typed."""
        raise NotImplementedError

    def show_refused(self, refused: bool) -> None:
        """Mark the field as rejected, or remove the mark."""
        set_property(self, "state", "refused" if refused else "")

    def is_page_key(self, event: QEvent) -> bool:
        """Submit the text and ignore the key if the page handles it, such as undo; return whether it does."""
        if event.type() != QEvent.Type.ShortcutOverride or not isinstance(event, QKeyEvent):
            return False
        if not any(event.matches(key) for key in PAGE_KEYS):
            return False
        self.flush()
        event.ignore()
        return True

    def event(self, event: QEvent) -> bool:
        return True if self.is_page_key(event) else super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.restore()
        elif removes_key(event) and self.has_nothing_to_delete():
            event.ignore()  # its row removes the key
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if self.property("state") != "refused":
            self._before = self.typed_text()
        self.focused.emit()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() != Qt.FocusReason.MouseFocusReason:
            self.flush()
            QTimer.singleShot(0, self, self.left.emit)  # only when the focus has moved, because the form may be rebuilt
        else:
            self._submit_timer.start(CLICK_MS)


class TypedLine(_Typed, QLineEdit):
    """A single-line field; ``stepped`` carries 1 for the up arrow key and -1 for the down arrow key."""

    stepped = Signal(int)
    typed = Signal(str)
    focused = Signal()
    left = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.begin()
        self._caret = 0
        make_dense(self, name)
        self.textEdited.connect(lambda _text: self.note_typing())
        self.returnPressed.connect(self.accept)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        steps = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}
        if event.key() in steps and not event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier:
            self.flush()
            self.stepped.emit(steps[Qt.Key(event.key())])
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if event.reason() == Qt.FocusReason.OtherFocusReason and not self.hasSelectedText():
            self.setCursorPosition(self._caret)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() not in _WINDOW_REASONS:
            self._caret = self.cursorPosition()
            self.home(False)  # a long text is shown from its start

    def typed_text(self) -> str:
        return self.text()

    def is_at_end(self) -> bool:
        end = len(self.text().encode("utf-16-le", "surrogatepass")) // 2  # in UTF-16 units, as Qt counts
        return self.selectedText() == self.text() or (not self.hasSelectedText() and self.cursorPosition() == end)

    def show_text(self, text: str) -> None:
        if not self.pending and text != self.text():
            caret = self.cursorPosition()
            self.setText(text)
            self.setCursorPosition(caret if self.hasFocus() else 0)  # Qt leaves the caret at the end of a shorter text


class TypedText(_Typed, QPlainTextEdit):
    """A multi-line field; Tab leaves it."""

    typed = Signal(str)
    focused = Signal()
    left = Signal()

    def __init__(self, name: str) -> None:
        super().__init__()
        self.begin()
        self.setAccessibleName(name)
        self.setTabChangesFocus(True)
        self.setUndoRedoEnabled(False)
        self.setFont(font("label", weight=400))
        self.setFixedHeight(118)
        self._known, self._showing = "", False
        self.textChanged.connect(self._note_change)

    def _note_change(self) -> None:
        """Note typed text; Qt emits the signal for a new font or margin, too."""
        if self.typed_text() != self._known:
            self._known = self.typed_text()
            if not self._showing:
                self.note_typing()

    def typed_text(self) -> str:
        return self.document().toRawText().replace("\u2029", "\n")

    def is_at_end(self) -> bool:
        cursor = self.textCursor()
        return cursor.position() == self.document().characterCount() - 1 and cursor.anchor() in {0, cursor.position()}

    def sizeHint(self) -> QSize:
        return QSize(120, 118)

    def show_text(self, text: str) -> None:
        if not self.pending and text != self.typed_text():
            self._showing = True
            self.setPlainText(text)  # Qt turns each line separator into a paragraph, so the text may differ
            self._showing = False

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() not in _WINDOW_REASONS:
            cursor = self.textCursor()  # in Qt, a line edit loses its selection, but a text edit keeps it
            cursor.clearSelection()
            self.setTextCursor(cursor)


class TypedSentence(TypedText):
    """A sentence that wraps into up to ``max_lines`` lines; Enter accepts it."""

    def __init__(self, name: str, *, max_lines: int = MAX_LINES) -> None:
        super().__init__(name)
        self._most_lines = max_lines
        self.setProperty("dense", "true")
        self.document().setDocumentMargin(0)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        across = self.horizontalScrollBar()
        across.rangeChanged.connect(
            lambda: across.setRange(0, 0)
        )  # otherwise Qt scrolls to a caret after a trailing space
        self.textChanged.connect(self._fit)
        self._fit()

    def _fit(self) -> None:
        block, needed_px = self.document().firstBlock(), 0.0
        while block.isValid():
            needed_px += self.document().documentLayout().blockBoundingRect(block).height()
            block = block.next()
        max_px = self._most_lines * self.fontMetrics().lineSpacing()
        policy = Qt.ScrollBarPolicy.ScrollBarAsNeeded if needed_px > max_px else Qt.ScrollBarPolicy.ScrollBarAlwaysOff
        self.setVerticalScrollBarPolicy(policy)
        self.setFixedHeight(max(FIELD_PX, min(max_px, math.ceil(needed_px)) + SENTENCE_EDGE_PX))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def sizeHint(self) -> QSize:
        return QSize(120, self.height())

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        if event.reason() in {Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason}:
            self.selectAll()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter}:
            self.accept()
            event.ignore()  # as in a single-line field
        else:
            super().keyPressEvent(event)

    def insertFromMimeData(self, source: QMimeData) -> None:
        self.insertPlainText(_LINE_BREAK.sub(" ", source.text()))


MAX_SEGMENTS, SEGMENT_LETTERS = 4, 34
NUMBER_PX, NARROWEST_LIST = 96, 120


class Extra:
    """A widget with facts about a row, below its editor.

    If ``beside_px`` is positive, it is to the right of an editor that leaves this width for it [px].
    """

    beside_px = 0

    def show_facts(self, facts: Any) -> None:
        raise NotImplementedError


class Field(Themed, QWidget):
    """Edits the value of one row.

    ``asked`` carries a request, ``focused`` is emitted when it gets the focus. ``caption`` is the text above an editor
    that is as wide as the form.
    """

    asked = Signal(object)
    focused = Signal()
    caption = ""

    def __init__(self, row: FormRow) -> None:
        super().__init__()
        self.row = row
        self.refusal = ""
        self.extra: Any = None
        self.box: QBoxLayout = hbox(spacing=8)
        self.outer: QBoxLayout = vbox(self.box, spacing=4, margins=0, parent=self)

    def show_row(self, row: FormRow) -> None:
        self.row = row
        self.show_value()
        self.show_extra()

    def add_extra(self, extra: QWidget) -> None:
        """Add a widget with facts below the editor, or to its right as described in `Extra`."""
        self.extra = extra
        self.outer.addWidget(extra, 0, Qt.AlignmentFlag.AlignVCenter)
        self.show_extra()

    def show_extra(self) -> None:
        facts = self.row.facts
        if self.extra is not None:
            self.extra.setVisible(bool(facts))
            if facts:
                self.extra.show_facts(facts)

    def show_value(self) -> None:
        raise NotImplementedError

    def take_keyboard(self) -> None:
        self.setFocus(Qt.FocusReason.OtherFocusReason)

    def minimumSizeHint(self) -> QSize:
        minimum = super().minimumSizeHint()
        beside_px = 0 if self.extra is None else self.extra.beside_px
        return QSize(max(beside_px, self.extra.sizeHint().width()), minimum.height()) if beside_px else minimum

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self.extra is not None and self.extra.beside_px:
            beside = self.width() >= self.extra.beside_px + self.extra.sizeHint().width() + 8
            directions = QBoxLayout.Direction
            self.outer.setDirection(directions.LeftToRight if beside else directions.TopToBottom)

    def set_value(self, value: Any, *, typing: bool = False) -> None:
        self.asked.emit(SetValue(self.row.path, value, typing))

    def placeholder(self) -> str:
        """Return the value that applies if the key is omitted."""
        default = self.row.default
        if default in (None, "", [], {}):
            return ""
        return f"{typed_value(default)} (default)"


class LineField(Field):
    """A plain text, one number, or several numbers, in one line."""

    def __init__(self, row: FormRow, make_line: Callable[[str], Any] = TypedLine) -> None:
        super().__init__(row)
        self.line = make_line(row.label)
        if row.kind in {"number", "whole number"}:
            self.line.setFixedWidth(NUMBER_PX + (48 if self.placeholder() else 0))
            self.line.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.box.addWidget(self.line)
        if row.unit:
            self.box.addWidget(label(row.unit, "label", "text2"))
        if row.kind in {"number", "whole number"}:
            permitted = cut_text(row.range, "small", "text2", right=True)
            self.box.addWidget(permitted, 1)
        self.line.typed.connect(self._submit_text)
        self.line.focused.connect(self.focused)
        if row.kind in {"number", "whole number"}:
            self.line.stepped.connect(self._step_number)
        self.setFocusProxy(self.line)
        self.show_value()

    def _step_number(self, steps: int) -> None:
        """Increment the last digit that is shown by a number of steps."""
        shown = self.line.text().strip() or str(self.row.default or 0)
        number = number_of(shown)
        if number is None or self.line.isReadOnly():
            return
        digits = len(shown.replace(",", ".").partition(".")[2]) if isinstance(number, float) else 0
        value = round(number + steps * 10.0**-digits, digits)
        self.line.setText(f"{value:.{digits}f}")
        self._submit_text(self.line.text())

    def show_value(self) -> None:
        value = self.row.value
        self.line.setPlaceholderText(self.placeholder())
        if not self.refusal:
            self.line.show_text("" if value is None else typed_value(value))

    def _submit_text(self, text: str) -> None:
        row, previous_refusal = self.row, self.refusal
        self.refusal = ""
        value: Any = text
        if not text.strip() and row.value is not None and not row.required and row.kind != "text":
            self.asked.emit(RemoveKey(row.path))
        elif row.kind in {"number", "whole number"}:
            value = number_of(text)
            if value is None or (row.kind == "whole number" and isinstance(value, float)):
                reason = unclear_number(text) if value is None else f"“{text}” is not a whole number"
                self.refusal = f"{reason}. {kept_value_sentence(row.value)}"
        elif row.kind in {"numbers", "vector"}:
            try:
                value = [number for _, number in typed_numbers(text)]
            except ValueError as unclear:
                self.refusal = f"{unclear}. {kept_value_sentence(row.value)}"
        self.line.show_refused(bool(self.refusal))
        if self.refusal or previous_refusal:
            self.focused.emit()  # updates the faults in the form
        if not self.refusal and (text.strip() or row.kind == "text" or row.required):
            self.set_value(value, typing=True)


class SwitchField(Field):
    """True or false."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.toggle = Toggle()
        self.toggle.setFont(font("label"))
        self.toggle.setAccessibleName(row.label)
        self.toggle.clicked.connect(lambda checked: self.set_value(bool(checked)))
        add_parts(self.box, self.toggle, STRETCH)
        self.setFocusProxy(self.toggle)
        self.show_value()

    def show_value(self) -> None:
        row = self.row
        self.toggle.setChecked(bool(row.default if row.value is None else row.value))


class ChoiceField(Field):
    """A choice of a value: a few short ones as segments, others in a list; an arrow opens a reference.

    The kinds of a question are segments if there is room.
    """

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        labels = [self.choice_text(choice, None) for choice in row.choices]
        as_segments = 1 < len(labels) <= MAX_SEGMENTS and sum(len(text) + 3 for text in labels) <= SEGMENT_LETTERS
        as_segments = as_segments and row.kind != "reference"
        self.segments = Segments(row.label) if as_segments or row.kind == "kind" else None
        choice_list = DesignList() if row.path[-1] == "design" else Choice()
        self.list = None if as_segments else make_dense(choice_list, row.label)
        if self.segments is not None:
            self.segments.chosen.connect(self._choose_value)
            self.box.addWidget(self.segments)
        if self.list is not None:
            self.list.setMinimumContentsLength(8 if row.facts else 12)
            self.list.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            self.list.activated.connect(self._choose_at)
            self.box.addWidget(self.list, 1)
        if self.segments is not None:
            self.box.addStretch()
        self._values: list[str | None] = []
        tip = f"Open the element that {row.label} refers to"
        self.arrow = IconButton("arrow_right", tip, with_key(f"{tip}; back", "back"), size=FIELD_PX)
        self.arrow.clicked.connect(lambda: self.asked.emit(Do("select", (self.row.target,))))
        if row.kind == "reference":
            self.box.addWidget(self.arrow)
        self.setFocusProxy(self.segments or self.list or self.arrow)
        self.show_value()
        self._choose_layout()

    def show_value(self) -> None:
        row = self.row
        shown = row.default if row.value is None else row.value
        if self.segments is not None:
            self.segments.show_values([(choice.value, self.choice_text(choice, None)) for choice in row.choices], shown)
        if self.list is None:
            return
        values = [(choice.value, self.choice_text(choice, row.default)) for choice in row.choices]
        if row.kind == "reference":
            values = [(name, f"{name} ({note})" if note else name) for name, note in row.notes]
        if shown is not None and shown not in [value for value, _ in values]:
            values.append((shown, typed_value(shown)))
        values += [(label, label) for label, _ in row.additions]
        if [text for _, text in values] != [self.list.itemText(index) for index in range(self.list.count())]:
            self.list.clear()
            self.list.addItems([text for _, text in values])
            for index, choice in enumerate(row.choices):
                self.list.setItemData(index, choice.sentence, Qt.ItemDataRole.ToolTipRole)
        self._values = [value for value, _ in values]
        if isinstance(self.list, DesignList):
            self.list.show_pictures(self._values)
        known = self._values[: len(values) - len(row.additions)]
        self.list.setCurrentIndex(known.index(shown) if shown in known else -1)
        self.list.setPlaceholderText("" if known else "There is nothing to choose from yet")
        self.arrow.setEnabled(row.target is not None)

    def choice_text(self, choice: Any, default: object) -> str:
        """Return the label of a choice; a question without a kind is a statement."""
        if choice.value is None and self.row.kind == "kind" and "items" in self.row.path:
            return STATEMENT.capitalize()
        return choice_label(choice, default)

    def _choose_layout(self) -> None:
        if self.segments is not None and self.list is not None:
            both: tuple[QWidget, QWidget] = (self.segments, self.list)
            shown, hidden = both if self.width() >= self.segments.sizeHint().width() else both[::-1]
            focused = self.window().focusWidget()
            shown.show()
            self.setFocusProxy(shown)
            if focused is not None and (focused is hidden or hidden.isAncestorOf(focused)):
                shown.setFocus()
            hidden.hide()

    def minimumSizeHint(self) -> QSize:
        minimum = super().minimumSizeHint()
        return minimum if None in {self.segments, self.list} else QSize(NARROWEST_LIST, minimum.height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._choose_layout()

    def _choose_at(self, index: int) -> None:
        """Choose the value of a list entry; the last entries add an element and refer to it."""
        additions = self.row.additions
        addition_index = index - (len(self._values) - len(additions))
        if addition_index < 0:
            self._choose_value(self._values[index])
            return
        self.show_value()
        self.asked.emit(additions[addition_index][1])

    def _choose_value(self, value: Any) -> None:
        row = self.row
        if row.kind == "kind" and value != row.value:
            self.asked.emit(SwitchKind(row.path[:-1], value))
        elif row.kind != "kind" and value is not None and value != row.value:
            self.set_value(value)
        self.focused.emit()


class ChecksField(Field):
    """A selection of several values."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.box.setSpacing(0)
        self.checks: dict[str, Check] = {}
        for choice in row.choices:
            check = Check(choice_label(choice, None))
            check.setFont(font("label", weight=400))
            check.setAccessibleName(f"{row.label}, {check.text()}")
            check.setToolTip(plain_tip(choice.sentence))
            check.clicked.connect(self._apply_checked)
            self.checks[str(choice.value)] = check
            self.box.addWidget(check)
        if self.checks:
            self.setFocusProxy(next(iter(self.checks.values())))
        self.show_value()

    def show_value(self) -> None:
        row = self.row
        chosen = row.value if isinstance(row.value, tuple) else row.default or ()
        for value, check in self.checks.items():
            check.setChecked(value in chosen)

    def _apply_checked(self) -> None:
        row = self.row
        chosen = [value for value in row.value or () if value in self.checks and self.checks[value].isChecked()]
        chosen += [value for value, check in self.checks.items() if check.isChecked() and value not in chosen]
        self.set_value(chosen)


class UnknownField(Field):
    """The value of a key that does not belong to the table; it can only be removed."""

    def __init__(self, row: FormRow) -> None:
        super().__init__(row)
        self.value = Elided("label", "text2")
        self.box.addWidget(self.value, 1)
        self.show_value()

    def show_value(self) -> None:
        self.value.show_text(typed_value(self.row.value))


def add_button(name: str, accessible_name: str = "") -> ActionButton:
    """Return a plain button with a plus sign."""
    button = small_button("plus", accessible_name or name, role="plain", height=32)
    button.setAccessibleName(name)
    return button


def kept_value_sentence(value: Any) -> str:
    """Return the sentence on the value that the study keeps while the typed text is rejected."""
    if value is None:
        return "This text is not in the study; press Esc to clear the field."
    return f"The study still contains {typed_value(value)}; press Esc to restore it."


def typed_value(value: Any) -> str:
    """Return the text to type for a value; numbers of a list are separated by spaces."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple | list):
        return "  ".join(typed_value(part) for part in value)
    return str(value)


class LanguagesField(Field):
    """A text in each language, side by side, or stacked for more than two languages or several lines."""

    def __init__(self, row: FormRow, make_line: type[TypedLine | TypedText] = TypedLine) -> None:
        super().__init__(row)
        is_multiline, stacked = row.kind == "paragraphs", is_stacked(row)
        if stacked:
            self.box.setDirection(QBoxLayout.Direction.TopToBottom)
        self.lines: dict[str, TypedLine | TypedText] = {}
        for code, language in row.languages:
            name = row.label if len(row.languages) == 1 else f"{row.label}, {language}"
            line_edit = (TypedText if is_multiline else make_line)(name)
            line_edit.setProperty(LANGUAGE, code)
            if len(row.languages) > 1:
                line_edit.setPlaceholderText(f"Missing in {language}")
                line_edit.setToolTip(plain_tip(language))
            if is_right_to_left(code):
                line_edit.setLayoutDirection(Qt.LayoutDirection.RightToLeft)
            line_edit.typed.connect(lambda text, code=code: self.asked.emit(SetText(self.row.path, code, text)))
            line_edit.left.connect(lambda: self.asked.emit(LeaveText(self.row.path)))
            line_edit.focused.connect(self.focused)
            self.lines[code] = line_edit
            if stacked and len(row.languages) > 1:
                self.box.addWidget(label(language, "small", "text2"))
            self.box.addWidget(line_edit)
        if len(self.lines) > 1:
            for line in self.lines.values():
                line.beside = tuple(self.lines.values())
        self.setFocusProxy(next(iter(self.lines.values())))
        self.show_value()

    @cached_property
    def untranslated_note(self) -> QLabel:
        """The label of texts that are not translated yet; created on first use."""
        note = label("", "small", "warn")
        note.hide()
        self.outer.addWidget(note)
        return note

    @property
    def has_missing_texts(self) -> bool:
        filled = [bool(line.typed_text().strip()) for line in self.lines.values()]
        return any(filled) and not all(filled)

    def show_value(self) -> None:
        """Show each text, and mark untranslated ones; a plain text is that of the first language."""
        value, untranslated = self.row.value, self.row.untranslated
        if untranslated or "untranslated_note" in self.__dict__:
            source = language_name(untranslated[0].source) if untranslated else ""
            languages = ", ".join(language_name(text.language) for text in untranslated)
            note = f"Same text as in {source}, not yet translated into {languages}"
            if all(text.is_word for text in untranslated):
                note = f"Same word as in {source}: translate it, unless {languages} has the same word"
            self.untranslated_note.setText(note)
            self.untranslated_note.setVisible(bool(untranslated))
        for number, (code, line) in enumerate(self.lines.items()):
            text = value.get(code, "") if isinstance(value, dict) else value if number == 0 else ""
            line.show_text(text if isinstance(text, str) else "")

    def take_keyboard(self) -> None:
        untranslated = {text.language for text in self.row.untranslated}
        to_write = (line for code, line in self.lines.items() if not line.typed_text() or code in untranslated)
        next(to_write, self).setFocus(Qt.FocusReason.OtherFocusReason)


def is_stacked(row: FormRow) -> bool:
    """Return whether the texts of several languages are stacked, each with its language."""
    return len(row.languages) > 2 or row.kind == "paragraphs"


@dataclass(frozen=True, slots=True)
class SpecialEditor:
    """An editor of certain keys; bounds, faults, help and removal stay with the row."""

    keys: tuple[tuple[str, str], ...]  # title of the model in the JSON Schema, such as "Block", and the key
    make: Callable[[FormRow], Field] | None = None  # makes the editor of a row; None for the editor of its kind
    adds: Callable[[Field], QWidget] | None = None  # makes the widget that shows its facts, an `Extra`
    wide: bool = False  # whether it takes the width of the form, with the label above it
    labelled: bool = True  # whether the label is shown; a screen reader says it in any case
    # returns the state that, when it changes, requires a new editor
    structure: Callable[[FormRow], object] = lambda _row: None
    # returns the facts to show besides the value, as an immutable value; the study may have faults
    facts: Callable[[Study, Row], Any] | None = None
