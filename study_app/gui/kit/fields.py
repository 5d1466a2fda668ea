"""Forms made from descriptions: a `Field` describes one value, an `Editor` consists of its label, control and hint."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Any, Literal

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QButtonGroup, QComboBox, QFileDialog, QLineEdit, QSpinBox, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.controls import ActionButton, Check, Choice, Number, Radio, Toggle
from study_app.gui.widgets.labels import label, set_ink, set_property
from study_app.gui.widgets.numbers import read_number, write_number
from study_app.number_text import readings_of, unclear_number
from study_app.session.start import MAX_SEED

MIN_TEXT_WIDTH = 280  # narrower wrapped text would become too high
_UNIT_WIDTH = 28


@dataclass(frozen=True, slots=True)
class Field:
    """One value of a form.

    Attributes
    ----------
    options : the choices with their labels
    limits : limits of an integer
    hint : the line below; ``aside`` is at the right of the label
    parse, write : parse the typed text (ValueError with the reason if it is invalid), and its inverse
    """

    name: str
    label: str
    kind: Literal["line", "count", "choice", "radio", "switch", "check", "file", "folder"] = "line"
    options: tuple[tuple[Any, str], ...] = ()
    limits: tuple[int, int] = (0, 0)
    _: KW_ONLY
    unit: str = ""
    hint: str = ""
    aside: str = ""
    placeholder: str = ""
    file_filter: str = ""
    longest: int = 32767
    parse: Callable[[str], Any] = str
    write: Callable[[Any], str] = str


def choice_field(name: str, label: str, options: Mapping[Any, str], aside: str = "") -> Field:
    """Return the field of a choice between values with labels."""
    return Field(name, label, "choice", tuple(options.items()), aside=aside)


def number_field(
    name: str, label: str, unit: str, limits: tuple[float, float], decimals: int = 1, *, may_miss: bool = True
) -> Field:
    """Return the field of a number within limits; an empty field gives None if it ``may_miss``."""
    permitted = f"A number from {limits[0]:g} to {limits[1]:g} {unit}{'; leave empty if unknown' * may_miss}."

    def parse(text: str) -> float | None:
        value = read_number(text) if text else None
        if len(readings_of(text)) == 2:
            raise ValueError(f"{unclear_number(text)}.")
        if (text or not may_miss) and (value is None or not limits[0] <= value <= limits[1]):
            raise ValueError(permitted)
        return value

    return Field(
        name, label, unit=unit, parse=parse, write=lambda value: "" if value is None else write_number(value, decimals)
    )


def seed_field(aside: str = "") -> Field:
    """Return the field of a seed."""

    def parse(text: str) -> int:
        if not (text.isascii() and text.isdecimal() and int(text) <= MAX_SEED):
            raise ValueError(f"the seed must be a whole number from 0 to {MAX_SEED}")
        return int(text)

    return Field("seed", "Seed", aside=aside, parse=parse)


def typed_file(name: str, text: str) -> Path | None:
    """Return the file whose path was typed; None for an empty text. Raise ValueError if there is no such file."""
    if text and not Path(text).is_file():
        raise ValueError(f"{name} was not found at {text}: choose the file, or leave the field empty")
    return Path(text) if text else None


class _Radios(QWidget):
    """A vertical group of options, of which the first is initially chosen."""

    def __init__(self, options: Iterable[tuple[Any, str]]) -> None:
        super().__init__()
        self._values, labels = zip(*options, strict=True)
        self.group, buttons = QButtonGroup(self), [Radio(text) for text in labels]
        for index, button in enumerate(buttons):
            button.setFont(font("body"))
            self.group.addButton(button, index)
        buttons[0].setChecked(True)
        vbox(*buttons, spacing=4, margins=0, parent=self)
        self.setFocusProxy(buttons[0])

    @property
    def value(self) -> Any:
        return self._values[self.group.checkedId()]


class _Line(QLineEdit):
    """A line edit; ``restored`` is emitted at Esc if the text was changed and must be restored."""

    restored = Signal()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and self.isModified():
            self.restored.emit()
        else:
            super().keyPressEvent(event)


class Editor(QWidget):
    """A label, a control with its unit or a button, and a line below.

    ``changed(name, value)`` is emitted for a valid value that was chosen or completely typed, ``edited(name)`` also at
    every key. Invalid values are reported below, unless the form that contains the editor ``judges`` them.
    """

    changed = Signal(str, object)
    edited = Signal(str)

    def __init__(self, field: Field, button: QWidget | None = None, *, judges: bool = False) -> None:
        super().__init__()
        self.field, self._text, self._hint, self._judges = field, "", field.hint, judges
        self._values = [value for value, _ in field.options]
        self.aside = label(field.aside, "small", "text3")
        self.below = label("", "small", "text2", wraps=True)
        self.below.setMinimumWidth(MIN_TEXT_WIDTH)
        self.control = self._make_control()
        self.control.setFont(font("label" if field.unit else "body", tabular=bool(field.unit)))
        if isinstance(self.control, QAbstractButton):
            vbox(self.control, self.below, spacing=2, margins=0, parent=self)
            self.show_refusal("")
            return
        self.control.setAccessibleName(f"{field.label} in {field.unit}" if field.unit else field.label)
        name_label = label(field.label, "label", "text" if field.unit else "text2")
        name_label.setBuddy(self.control)
        if field.kind in {"file", "folder"}:
            button = ActionButton("", "Choose…" if field.kind == "file" else "Change…", height=40)
            button.setAutoDefault(False)
            button.clicked.connect(self._choose_path)
        if field.unit:
            unit = label(field.unit, "label", "text2")
            unit.setFixedWidth(_UNIT_WIDTH)
            rows = [hbox((name_label, 1), self.control, unit, spacing=8)]
        else:
            buttons = () if button is None else (button,)
            rows = [hbox(name_label, STRETCH, self.aside), hbox((self.control, 1), *buttons, spacing=8)]
        vbox(*rows, self.below, spacing=6, margins=0, parent=self)
        self.show_refusal("")

    def _make_control(self) -> QWidget:
        match self.field.kind:
            case "radio":
                return _Radios(self.field.options)
            case "count":
                lowest, highest = self.field.limits
                count = Number(lowest, highest, lowest)
                count.valueChanged.connect(lambda _value: self.edited.emit(self.field.name))
                return count
            case "choice":
                choice = Choice()
                for value, text in self.field.options:
                    choice.addItem(text, value)
                choice.currentIndexChanged.connect(lambda _at: self.edited.emit(self.field.name))
                choice.activated.connect(lambda _at: self.changed.emit(self.field.name, self.value))
                return choice
            case "switch" | "check":
                box = (Toggle if self.field.kind == "switch" else Check)(self.field.label)
                box.toggled.connect(lambda _on: self.edited.emit(self.field.name))
                box.clicked.connect(lambda on: self.changed.emit(self.field.name, on))
                return box
        line = _Line()
        line.setMaxLength(self.field.longest)
        line.setPlaceholderText(self.field.placeholder)
        if self.field.unit:
            line.setProperty("dense", "true")
            line.setFixedWidth(96)
            line.setAlignment(Qt.AlignmentFlag.AlignRight)
        line.editingFinished.connect(self._submit_text)
        line.textChanged.connect(lambda _text: self.edited.emit(self.field.name))
        line.restored.connect(lambda: self._show_text(self._text))
        return line

    @property
    def value(self) -> Any:
        """The value of the control; raises ValueError if it is invalid."""
        match self.control:
            case _Radios():
                return self.control.value
            case QAbstractButton():
                return self.control.isChecked()
            case QComboBox():
                at = self.control.currentIndex()
                return self._values[at] if at >= 0 else None
            case Number():
                if refusal := self.control.refusal:
                    raise ValueError(f"{refusal}.")
                return self.control.value()
            case QLineEdit():
                return self.field.parse(self.control.text().strip())

    def show_options(self, options: Mapping[Any, str]) -> None:
        """Offer other values, with the first one chosen."""
        assert isinstance(self.control, QComboBox)  # noqa: S101 - only choices have options
        self._values = [*options]
        self.control.clear()
        for value, text in options.items():
            self.control.addItem(text, value)

    def show_value(self, value: Any, hint: str | None = None) -> None:
        """Show a value with a hint below, but keep text that is being typed."""
        self._hint = self.field.hint if hint is None else hint
        match self.control:
            case QAbstractButton():
                self.control.setChecked(value)
            case QComboBox():
                self.control.setCurrentIndex(self._values.index(value) if value in self._values else -1)
            case QSpinBox():
                self.control.setValue(value)
            case QLineEdit():
                self._text = self.field.write(value)
                if not self.control.isModified():
                    self._show_text(self._text)

    def show_refusal(self, why: str) -> None:
        self.below.setText(why or self._hint)
        self.below.setVisible(bool(why or self._hint))
        set_ink(self.below, "bad" if why else "text2")
        set_property(self.control, "state", "refused" if why else "")

    def _show_text(self, text: str) -> None:
        assert isinstance(self.control, QLineEdit)  # noqa: S101 - only lines are typed
        self.control.setText(text)  # also clears isModified()
        self.control.setCursorPosition(0)
        self.show_refusal("")

    def _submit_text(self) -> None:
        assert isinstance(self.control, QLineEdit)  # noqa: S101 - only lines are typed
        if not self.control.isModified():
            return
        try:
            value = self.value
        except ValueError as refusal:
            if not self._judges:
                self.show_refusal(str(refusal))
            return
        self.control.setModified(False)
        self.show_refusal("")
        self.changed.emit(self.field.name, value)

    def _choose_path(self) -> None:
        assert isinstance(self.control, QLineEdit)  # noqa: S101 - paths can be typed as well
        if self.field.kind == "file":
            chosen, _ = QFileDialog.getOpenFileName(self, self.field.label, self.control.text(), self.field.file_filter)
        else:
            chosen = QFileDialog.getExistingDirectory(self, self.field.label, self.control.text())
        if chosen:
            self.control.setText(chosen)
            self.changed.emit(self.field.name, str(Path(chosen)))
