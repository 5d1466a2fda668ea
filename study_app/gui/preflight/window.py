"""Whether to begin: every check with its value, what will run, and one button that says what is accepted by it."""

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QAccessible, QCloseEvent, QKeyEvent
from PySide6.QtWidgets import QAbstractSlider, QGridLayout, QLabel, QWidget

from study_app.gui.preflight.check_rows import CheckRow
from study_app.gui.theme.theme import LIGHT, Theme, font
from study_app.gui.theme.themed import apply_theme, apply_theme_within, remove_widget
from study_app.gui.widgets.accessible import describe_plot, give_role
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, Choice, Number
from study_app.gui.widgets.labels import figures, label
from study_app.gui.widgets.live_plots import LatenessPlot
from study_app.session.preflight import LOUDEST_DB, MEANS, QUIETEST_DB, USUAL_DB, Masking
from study_app.viewmodels.preflight import WAITING, PreflightView, histogram

FULL, LEAST = QSize(1200, 800), QSize(1024, 640)
ASIDE = 352
PAGES = {
    Qt.Key.Key_PageDown: QAbstractSlider.SliderAction.SliderPageStepAdd,
    Qt.Key.Key_PageUp: QAbstractSlider.SliderAction.SliderPageStepSub,
}
NOTHING_YET = "Nothing is created until you start."


class PreflightWindow(QWidget):
    """The checks of a session whose device and servo are ready, at rest.

    ``start_asked`` accepts the warnings shown; ``again_asked`` has everything measured anew; ``cancelled`` goes back.
    With ``asks_masking`` the window asks whether the device's motors are masked.
    """

    start_asked = Signal()
    again_asked = Signal()
    cancelled = Signal()

    def __init__(self, limit_us: float, *, asks_masking: bool = False, theme: Theme = LIGHT) -> None:
        super().__init__()
        self.setWindowTitle("Liquid Study")
        self.setProperty("role", "window")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setMinimumSize(LEAST)
        self.resize(FULL)
        self.theme = theme
        self.who = label("", "label", "text2")
        self.chip = Chip("ok", "check", "")
        self.checks = Card(padding=10, gap=0)
        self.rows: list[CheckRow] = []
        self.masking = MaskingQuestion() if asks_masking else None
        self.plot = LatenessPlot(limit_us)
        describe_plot(self.plot, "Tick lateness", "Histogram of how late the ticks of two seconds began, in µs.")
        self.cancel = ActionButton("", "Cancel", height=46)
        self.again = ActionButton("repeat", "Check again", height=46)
        self.start = ActionButton("play", "Start", role="primary", height=46)
        self._values: dict[str, QLabel] = {}
        self._done = False
        self._busy = False
        around = self.checks.column.contentsMargins()
        self.checks.column.setContentsMargins(4, around.top(), 4, around.bottom())
        self._lay_out()
        self.cancel.clicked.connect(self.close)
        self.again.clicked.connect(self.again_asked)
        self.start.clicked.connect(self._start)
        apply_theme(self, theme)
        give_role(self, QAccessible.Role.Window)
        self.start.setFocus()

    def _lay_out(self) -> None:
        titles = vbox(label("Ready to begin?", "title_dense"), self.who, spacing=4)
        head = hbox((titles, 1), (self.chip, 0, Qt.AlignmentFlag.AlignVCenter))
        inside = QWidget()
        vbox(self.checks, STRETCH, margins=0, parent=inside)
        area = self._area = scrolled(inside)
        middle = hbox((area, 1), self._beside(), spacing=20)
        foot = hbox(self.cancel, self.again, spacing=16)
        self.note = label(NOTHING_YET, "label", "text2")
        add_parts(foot, self.note, STRETCH, self.start)
        vbox(head, (middle, 1), Rule(), foot, spacing=16, margins=(32, 22, 32, 20), parent=self)

    def _beside(self) -> QWidget:
        """Return the column next to the checks: how late the servo is, and what will run; it scrolls if it must."""
        lateness = Card("Servo lateness", label("measured at rest, µs", "small", "text2"), padding=18, gap=6)
        self.plot.setMinimumHeight(150)
        lateness.column.addWidget(self.plot, 1)
        self.runs = Card("What will run", padding=18, gap=8)
        self._grid = QGridLayout()
        self._grid.setVerticalSpacing(9)
        self._grid.setColumnStretch(1, 1)
        add_layout(self.runs.column, self._grid)
        if self.masking is not None:
            self.runs.column.addWidget(self.masking)
        side = scrolled(vbox((lateness, 1), self.runs, spacing=12, margins=0))
        side.setFixedWidth(ASIDE)
        return side

    def show_view(self, view: PreflightView) -> None:
        self.who.setText(f"{view.study}  ·  {view.who}")
        self._show_chip(view)
        self.start.show_action("play", view.start_words)
        self.start.setEnabled(not view.busy and not view.failures)
        self.again.setEnabled(not view.busy)
        if self._busy and not view.busy:
            self.start.setFocus()  # what was pressed lost the keyboard to Cancel meanwhile
        self._busy = view.busy
        self._show_checks(view)
        self._show_rows(view)
        edges, counts, p99_us = histogram(view.lateness_us)
        self.plot.show_histogram(edges, counts, p99_us)

    def _show_chip(self, view: PreflightView) -> None:
        if view.busy:
            self.chip.show_state("neutral", "clock", WAITING.capitalize())
        elif view.failures:
            self.chip.show_state("bad", "cross", view.passed)
        elif view.warnings:
            self.chip.show_state("warn", "warning", view.passed)
        else:
            self.chip.show_state("ok", "check", view.passed)

    def _show_checks(self, view: PreflightView) -> None:
        if [row.check for row in self.rows] == list(view.checks):
            return
        for row in self.rows:
            remove_widget(row)
        self.rows = [CheckRow(check, last=check is view.checks[-1]) for check in view.checks]
        for row in self.rows:
            self.checks.column.addWidget(row)
            apply_theme_within(row, self.theme)

    def _show_rows(self, view: PreflightView) -> None:
        for place, (name, words) in enumerate(view.rows):
            if name not in self._values:
                value = figures("", "label")
                value.setFont(font("label", weight=600, tabular=True))
                value.setAlignment(Qt.AlignmentFlag.AlignRight)
                value.setWordWrap(True)
                self._grid.addWidget(label(name, "label", "text2"), place, 0)
                self._grid.addWidget(value, place, 1)
                self._values[name] = value
            self._values[name].setText(words)

    def values(self) -> tuple[QLabel, ...]:
        """Return the values of what will run."""
        return tuple(self._values.values())

    def _start(self) -> None:
        """Begin, once."""
        if not self._done and self.start.isEnabled():
            self._done = True
            self.start_asked.emit()

    def finish(self) -> None:
        """Close because the session's windows open, or it was called off elsewhere."""
        self._done = True
        self.close()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            chosen = next((button for button in (self.cancel, self.again) if button.hasFocus()), self.start)
            chosen.click()
        elif event.key() in PAGES:
            self._area.verticalScrollBar().triggerAction(PAGES[Qt.Key(event.key())])
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        if not self._done:
            self._done = True
            self.cancelled.emit()


class MaskingQuestion(QWidget):
    """A choice, and for noise its level in dB."""

    def __init__(self) -> None:
        super().__init__()
        self.means = Choice()
        self.means.setAccessibleName("Motors masked?")
        for means, words in MEANS.items():
            self.means.addItem(words, means)
        self.noise_db = Number(QUIETEST_DB, LOUDEST_DB, USUAL_DB)
        self.noise_db.setAccessibleName("Level of the noise in dB")
        self.noise_db.setSuffix(" dB")
        self.noise_db.setVisible(False)
        self.means.currentIndexChanged.connect(lambda: self.noise_db.setVisible(self._is_noise))
        row = hbox((self.means, 1), self.noise_db)
        vbox(label("Motors masked?", "label", "text2"), row, margins=0, parent=self)

    @property
    def _is_noise(self) -> bool:
        return bool(self.means.currentData() == "noise")

    def answer(self) -> Masking:
        """Return what was chosen."""
        return Masking(self.means.currentData(), self.noise_db.value() if self._is_noise else None)
