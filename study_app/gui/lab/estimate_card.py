"""The right column's first card: drag and wake as measured force says, with intervals, and applied on request."""

from typing import Final

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from study_app.gui.lab.measurement_cards import LINE, ReadingCard
from study_app.gui.theme.theme import font
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox
from study_app.gui.widgets.controls import ActionButton, Choice, Toggle
from study_app.gui.widgets.labels import Clamped, Elided, figures, label, set_ink
from study_app.viewmodels.estimation import OFF, PARAMETERS, Choices, EstimateRow
from study_app.viewmodels.lab import LabView

BUTTON: Final = 32
MESSAGE_LINES: Final = 3


class EstimateCard(ReadingCard):
    """Where the force comes from, what is estimated, the values, and how they are applied.

    ``source_chosen`` is a source, ``parameters_chosen`` which parameters; ``apply_asked`` the values now,
    ``follow_asked`` whether they are applied continuously.
    """

    source_chosen = Signal(str)
    parameters_chosen = Signal(str)
    apply_asked = Signal()
    follow_asked = Signal(bool)

    def __init__(self) -> None:
        super().__init__("Estimate", label("", "small", "text2"), "Estimates would reveal which is which.")
        self.source, self.parameters = _choice("Measured force"), _choice("Estimated parameters")
        _offer(self.parameters, PARAMETERS, PARAMETERS[0][0])
        self._offered: Choices = ()
        self.lines: list[tuple[Elided, QLabel, QLabel]] = []
        self._grid = QGridLayout()
        self._grid.setColumnStretch(0, 1)
        self._grid.setHorizontalSpacing(8)
        self._grid.setVerticalSpacing(0)
        self.message = Clamped("", MESSAGE_LINES, "small", "text2")
        self.apply = ActionButton("check", "Apply", height=BUTTON)
        self.apply.setProperty("dense", "true")
        self.follow = Toggle("Continuously")
        self.follow.setFont(font("label"))
        self.follow.setToolTip("Apply estimates as they come, slowly, within the slope and force limits")
        self._inside = QWidget()
        buttons = hbox(self.apply, self.follow, STRETCH, spacing=10)
        inner = QGridLayout(self._inside)
        inner.setContentsMargins(0, 0, 0, 0)
        inner.setVerticalSpacing(6)
        inner.addWidget(self.parameters, 0, 0)
        add_layout(inner, self._grid, 1, 0)
        inner.addWidget(self.message, 2, 0)
        add_layout(inner, buttons, 3, 0)
        add_parts(self.content, self.source, self._inside, STRETCH)
        self.source.activated.connect(lambda index: self.source_chosen.emit(self.source.itemData(index)))
        self.parameters.activated.connect(lambda index: self.parameters_chosen.emit(self.parameters.itemData(index)))
        self.apply.clicked.connect(self.apply_asked)
        self.follow.clicked.connect(self._ask_follow)

    def show_view(self, view: LabView) -> None:
        shown = view.estimate
        if self.show_blind(view.workbench.blind):
            return
        if shown.sources != self._offered:
            self._offered = shown.sources
            _offer(self.source, shown.sources, shown.source)
        if not self.source.view().isVisible():
            self.source.setCurrentIndex(self.source.findData(shown.source))
        self.parameters.setCurrentIndex(self.parameters.findData(shown.parameters))
        self.aside.setText(f"{view.felt}, 95 % interval" if shown.rows else "")
        self._inside.setVisible(shown.source != OFF or bool(shown.message))
        self.message.show_text(shown.message)
        set_ink(self.message, "text2" if shown.sound else "warn")
        self._show_rows(shown.rows, sound=shown.sound)
        self.apply.setEnabled(shown.may_apply)
        self.follow.setEnabled(shown.may_follow)
        with QSignalBlocker(self.follow):
            self.follow.setChecked(shown.follows)

    def _show_rows(self, rows: tuple[EstimateRow, ...], *, sound: bool) -> None:
        while len(self.lines) < len(rows):
            name, value, interval = Elided("label", "text2"), figures("", "label"), figures("", "small", "text2")
            value.setFont(font("label", weight=600, tabular=True))
            name.setFixedHeight(LINE)
            for at, part in enumerate((name, value, interval)):
                side = Qt.AlignmentFlag.AlignVCenter | (Qt.AlignmentFlag.AlignRight if at else Qt.AlignmentFlag(0))
                self._grid.addWidget(part, len(self.lines), at, side)
            self.lines.append((name, value, interval))
        for number, parts in enumerate(self.lines):
            for part in parts:
                part.setVisible(number < len(rows))
            if number < len(rows):
                row, (name, value, interval) = rows[number], parts
                name.show_text(row.name)
                value.setText(row.value)
                interval.setText(row.interval)
                set_ink(value, "text" if sound else "text3")

    def _ask_follow(self, on: bool) -> None:
        self.follow.setChecked(not on)  # the view says when it is
        self.follow_asked.emit(on)


def _choice(name: str) -> Choice:
    made = Choice()
    made.setProperty("dense", "true")
    made.setFont(font("label"))
    made.setAccessibleName(name)
    made.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
    made.setMinimumContentsLength(12)
    return made


def _offer(choice: Choice, choices: Choices, chosen: str) -> None:
    choice.clear()
    for value, words in choices:
        choice.addItem(words, value)
    choice.setCurrentIndex(choice.findData(chosen))
