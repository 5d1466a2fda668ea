"""The controls at the right of the tabs: what is simulated."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QSizePolicy, QWidget

from study_app.designer.measures.number_cards import ControlValues
from study_app.gui.widgets.boxes import STRETCH, hbox
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.numbers import NumberField

FIELD_PX = 48


class Control(QWidget):
    """A number with its words before and its unit behind it; ``entered`` carries what was typed or stepped to."""

    entered = Signal(float)

    def __init__(self, words: str, unit: str, step: float) -> None:
        super().__init__()
        self._value, self._step = 0.0, step
        self.words, self.unit = label(words, "small", "text2"), label(unit, "small", "text2")
        self.field = NumberField()
        self.field.setFixedWidth(FIELD_PX)
        self.setSizePolicy(QSizePolicy.Policy.Maximum, QSizePolicy.Policy.Preferred)
        hbox(self.words, self.field, self.unit, spacing=6, margins=0, parent=self)
        self.show_words(words, unit)
        self.field.entered.connect(self.entered)
        self.field.unread.connect(lambda _text: self.field.put_back())
        self.field.stepped.connect(lambda steps: self.entered.emit(self._value + steps * self._step))

    def show_words(self, words: str, unit: str) -> None:
        """Call the number otherwise."""
        self.words.setText(words.removeprefix("simulated "))
        self.unit.setText(unit)
        self.unit.setVisible(bool(unit))
        self.field.setAccessibleName(f"{words}, {unit}" if unit else words)

    def show_number(self, text: str) -> None:
        self._value = float(text)
        self.field.show_text(text)


class MeasureControls(QWidget):
    """Simulated threshold, lapse rate and participants."""

    participants_asked = Signal(float)
    threshold_asked = Signal(float)
    lapses_asked = Signal(float)

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("What is simulated")
        self.threshold = Control("simulated JND", "%", 1.0)
        self.lapses = Control("lapses", "%", 1.0)
        self.participants = Control("participants", "", 1.0)
        hbox(STRETCH, self.threshold, self.lapses, self.participants, spacing=10, margins=0, parent=self)
        self.threshold.entered.connect(self.threshold_asked)
        self.lapses.entered.connect(self.lapses_asked)
        self.participants.entered.connect(self.participants_asked)

    def show_values(self, shown: ControlValues) -> None:
        """Show other values; threshold and lapses only where observers are simulated."""
        self.participants.show_words("participants", shown.participants_unit)
        self.participants.show_number(str(shown.participants))
        simulated = shown.threshold is not None and shown.lapses is not None
        self.threshold.setVisible(simulated)
        self.lapses.setVisible(simulated)
        if shown.threshold is not None and shown.lapses is not None:
            self.threshold.show_words(shown.threshold_words, shown.threshold_unit)
            self.threshold.show_number(shown.threshold)
            self.lapses.show_number(shown.lapses)
