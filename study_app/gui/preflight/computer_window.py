"""The page of the first start: whether this computer is fit for sessions, and how to mend what is not."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QProgressBar, QScrollArea, QWidget

from study_app.gui.preflight.check_rows import CheckRow
from study_app.gui.theme.theme import Theme
from study_app.gui.theme.themed import apply_theme_within
from study_app.gui.widgets.boxes import STRETCH, add_parts, vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.dialogs import Question
from study_app.gui.widgets.labels import label
from study_app.session.preflight import Check

SIZE = (860, 620)
ABOUT = (
    "Measured for two seconds with the simulated hand. A session measures again, with its own device and limits. "
    "This page is also available under This machine."
)
MEASURING = "Measuring … The first time the force model is compiled, which may take a minute."


class ComputerWindow(Question):
    """The checks; ``asked`` when they are to be made again. It is closed by hand."""

    asked = Signal()

    def __init__(self, parent: QWidget, theme: Theme) -> None:
        super().__init__(parent, theme, "Check of this computer", ABOUT)
        self.setModal(True)
        self.rows: list[CheckRow] = []
        self.state = label(MEASURING, "body", "text2", wraps=True)
        self.bar = QProgressBar()
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(8)
        inside = QWidget()
        self._rows = vbox(STRETCH, spacing=0, margins=0, parent=inside)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setWidget(inside)
        add_parts(self.column, self.state, self.bar, (area, 1))
        again = ActionButton("", "Close", role="primary")
        self.add_buttons("Check again", again)
        self.back.clicked.disconnect(self.reject)
        self.back.clicked.connect(self.asked)
        self.resize(*SIZE)

    def show_measuring(self) -> None:
        self.state.setText(MEASURING)
        self.back.setEnabled(False)
        self.bar.setRange(0, 0)
        self.bar.show()

    def show_compiled(self, share: float) -> None:
        self.bar.setRange(0, 100)
        self.bar.setValue(round(100 * share))

    def show_checks(self, checks: tuple[Check, ...]) -> None:
        for row in self.rows:
            row.hide()
            row.deleteLater()
        self.rows = [CheckRow(check, last=check is checks[-1]) for check in checks]
        for place, row in enumerate(self.rows):
            self._rows.insertWidget(place, row)
            apply_theme_within(row, self._theme)
        passed = sum(check.verdict == "ok" for check in checks)
        self.show_sentence(f"{passed} of {len(checks)} passed.")

    def show_sentence(self, sentence: str) -> None:
        self.state.setText(sentence)
        self.back.setEnabled(True)
        self.bar.hide()
