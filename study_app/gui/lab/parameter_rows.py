"""A row for each parameter: slider and field, a list, or a switch. It draws a `FormRow` and says what is asked for."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QLabel, QWidget

from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import Choice, Toggle
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.number_field import NumberField, read_number, write_number
from study_app.gui.widgets.sliders import Range, Slider
from study_app.haptics.model.effect import Parameter, Value
from study_app.lab.parameters import OFF, ON
from study_app.viewmodels.lab import FormRow

LABEL_WIDTH, FIELD_WIDTH, UNIT_WIDTH = 108, 86, 44
GAP = 8
HEIGHT = 36
SWITCHED = {OFF, ON}


class ParameterRow(QWidget):
    """What every row has: ``changed(name, value, held)``, and a line below for why something was refused."""

    changed = Signal(str, object, bool)

    def __init__(self, parameter: Parameter) -> None:
        super().__init__()
        self.parameter = parameter
        self._refused = ""
        self.line = hbox(spacing=GAP, margins=0)
        self.sign = Icon("warning", "bad", 14)
        self.why = label("", "small", "bad", wraps=True)
        self._below = QWidget()
        hbox(
            (self.sign, 0, Qt.AlignmentFlag.AlignTop),
            (self.why, 1),
            spacing=6,
            margins=(0, 0, 0, 4),
            parent=self._below,
        )
        self._below.hide()
        vbox(self.line, self._below, spacing=0, margins=0, parent=self)

    @property
    def refused(self) -> str:
        """Why what was asked for last cannot be, or nothing."""
        return self._refused

    def show_row(self, row: FormRow) -> None:
        raise NotImplementedError

    def show_refused(self, why: str) -> None:
        """Show in one line why a value is refused; the typed text stays."""
        self._refused = why
        self.why.setText(why)
        self._below.setVisible(bool(why))

    def let_go(self) -> None:
        """Release what is held, and hide the refusal, which belongs to another setting."""
        self.show_refused("")

    def parts(self) -> tuple[QWidget, ...]:
        """Return what takes the keyboard, in its order."""
        raise NotImplementedError


class NumberRow(ParameterRow):
    """A number: slider and field, the unit behind them, the preset's value a tick on the slider."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__(parameter)
        self._row: FormRow | None = None
        self.name = _name(parameter.label)
        self.slider = Slider()
        self.field = NumberField()
        self.field.setFixedWidth(FIELD_WIDTH)
        unit = label(parameter.shown_unit, "small", "text2")
        unit.setFixedWidth(UNIT_WIDTH)
        add_parts(self.line, self.name, (self.slider, 1), self.field, unit)
        words = f"{parameter.label}, {parameter.shown_unit}".rstrip(", ")
        self.slider.setAccessibleName(words)
        self.field.setAccessibleName(words)
        self.slider.slid.connect(self._slide)
        self.field.entered.connect(self._enter)
        self.field.unread.connect(self._misread)
        self.field.abandoned.connect(self._forget)
        self.field.stepped.connect(self.slider.step)

    def show_row(self, row: FormRow) -> None:
        """Show the number, unless it is being dragged or typed; changed ones are bold."""
        if self._row is not None and row.value != self._row.value:
            self.show_refused("")
        self._row = row
        it = self.parameter = row.parameter
        span = Range(it.least * it.factor, it.most * it.factor, it.logarithmic, it.whole)
        number = row.value if isinstance(row.value, int | float) else None
        preset = row.preset if isinstance(row.preset, int | float) else None
        if not self.slider.dragged:
            usual = it.default if isinstance(it.default, int | float) else it.least
            at = (usual if number is None else number) * it.factor
            self.slider.show_number(span, at, None if preset is None else preset * it.factor)
        if not self.refused:
            self.field.show_text("" if number is None else self._text(number))
            self.field.show_state("changed" if row.changed else "")
        self.field.setPlaceholderText("none" if number is None else "")
        self.name.setFont(font("label", weight=600 if row.changed else None))
        was = "none" if preset is None else it.shown(preset)
        self.setToolTip(f"{it.shown(it.least)} to {it.shown(it.most)}; initially {was}")
        self.field.setAccessibleDescription(f"initially {was}" if row.changed else "")

    def show_refused(self, why: str) -> None:
        super().show_refused(why)
        changed = "changed" if self._row is not None and self._row.changed else ""
        self.field.show_state("refused" if why else changed)
        if why:
            self.field.setAccessibleDescription(why)

    def let_go(self) -> None:
        """Let go of the knob, too."""
        super().let_go()
        self.slider.let_go()

    def parts(self) -> tuple[QWidget, ...]:
        """Return slider and field."""
        return self.slider, self.field

    def _text(self, value: float) -> str:
        return write_number(value * self.parameter.factor, self.parameter.decimals)

    def _slide(self, shown: float, held: bool) -> None:
        self.show_refused("")
        self.field.show_text(write_number(shown, self.parameter.decimals))
        self.field.put_back()
        self.changed.emit(self.parameter.name, self._value(shown), held)

    def _enter(self, shown: float) -> None:
        self.show_refused("")
        self.changed.emit(self.parameter.name, self._value(shown), False)

    def _value(self, shown: float) -> float:
        """Return what a shown number is in SI: exactly the preset's or the present one's where it reads the same."""
        row = self._row
        for known in (row.preset, row.value) if row is not None else ():
            if isinstance(known, int | float) and read_number(self._text(known)) == shown:
                return float(known)
        return shown / self.parameter.factor

    def _misread(self, text: str) -> None:
        preset = self._row.preset if self._row is not None else None
        example = self._text(preset) if isinstance(preset, int | float) else "1.5"
        said = f"“{text}” is not a number" if text.strip() else "This needs a number"
        self.show_refused(f"{said}: write one such as {example}, or press Esc.")

    def _forget(self) -> None:
        self.show_refused("")
        if self._row is not None:
            self.show_row(self._row)
            self.field.put_back()


class ChoiceRow(ParameterRow):
    """One of a few words."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__(parameter)
        self._value: Value = None
        self.name = _name(parameter.label)
        self.choice = Choice()
        self.choice.setProperty("dense", "true")
        self.choice.setFont(font("label"))
        self.choice.setAccessibleName(parameter.label)
        for value, words in parameter.choices:
            self.choice.addItem(words, value)
        self.choice.activated.connect(self._choose)
        add_parts(self.line, self.name, (self.choice, 1))

    def show_row(self, row: FormRow) -> None:
        """Show which it is; changed ones are bold with an accent edge."""
        if row.value != self._value:
            self.show_refused("")
        self._value = row.value
        self.choice.setCurrentIndex(self.choice.findData(row.value))
        state = "changed" if row.changed else ""
        if self.choice.property("state") != state:
            self.choice.setProperty("state", state)
            self.choice.style().unpolish(self.choice)
            self.choice.style().polish(self.choice)
        for part in (self.name, self.choice):
            part.setFont(font("label", weight=600 if row.changed else None))

    def parts(self) -> tuple[QWidget, ...]:
        """Return the list."""
        return (self.choice,)

    def _choose(self, index: int) -> None:
        """Ask for another one; the view says when it is."""
        self.show_refused("")
        self.choice.setCurrentIndex(self.choice.findData(self._value))
        self.changed.emit(self.parameter.name, self.choice.itemData(index), False)


class SwitchRow(ParameterRow):
    """On or off."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__(parameter)
        self.toggle = Toggle(parameter.label)
        self.toggle.setFont(font("label"))
        self.toggle.clicked.connect(self._switch)
        add_parts(self.line, self.toggle, STRETCH)

    def show_row(self, row: FormRow) -> None:
        """Show whether it is on; changed ones are bold."""
        if (row.value == ON) != self.toggle.isChecked():
            self.show_refused("")
        self.toggle.setChecked(row.value == ON)
        self.toggle.setFont(font("label", weight=600 if row.changed else None))

    def parts(self) -> tuple[QWidget, ...]:
        """Return the switch."""
        return (self.toggle,)

    def _switch(self, on: bool) -> None:
        """Ask for the other; the view says when it is."""
        self.show_refused("")
        self.toggle.setChecked(not on)
        self.changed.emit(self.parameter.name, ON if on else OFF, False)


def row_for(parameter: Parameter) -> ParameterRow:
    """Return the row that suits a parameter."""
    if not parameter.choices:
        return NumberRow(parameter)
    return (SwitchRow if {value for value, _ in parameter.choices} == SWITCHED else ChoiceRow)(parameter)


def _name(words: str) -> QLabel:
    made = label(words, "label", "text")
    made.setFixedWidth(LABEL_WIDTH)
    made.setMinimumHeight(HEIGHT)
    made.setWordWrap(True)
    return made
