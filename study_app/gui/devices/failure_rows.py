"""A row for each mode of failure: its state, its symptom and, opened, cause, cure, how it is known, what to paste."""

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QLineEdit, QWidget

from study_app.devices.doctor_report import Finding, State
from study_app.gui.theme.theme import RADIUS_CONTROL, font
from study_app.gui.theme.themed import Themed, apply_theme_within
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.cards import Chip
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import figures, label
from study_app.viewmodels.tones import Tone

STATES: dict[State, tuple[Tone, str, str]] = {
    "ok": ("ok", "check", "OK"),
    "found": ("bad", "warning", "Found"),
    "not checked": ("neutral", "ring", "Not checked"),
}
WAITING: tuple[Tone, str, str] = ("neutral", "clock", "Waiting")


def capital(words: str) -> str:
    """Return a clause with a capital letter, unless its first word is a name that has none."""
    first = words.partition(" ")[0]
    return words[:1].upper() + words[1:] if first.islower() else words


class Paste(QWidget):
    """What a terminal takes, in one line, and a button that copies it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.field = QLineEdit(text)
        self.field.setReadOnly(True)
        self.field.setFont(font("label", weight=400))
        self.field.setAccessibleName("Command for a terminal")
        self.field.setCursorPosition(0)
        self.copy = ActionButton("copy", "Copy", height=38)
        self.copy.setAccessibleName("Copy command")
        self.copy.setAutoDefault(False)
        self.copy.clicked.connect(self._copy)
        hbox((self.field, 1), self.copy, spacing=8, margins=(0, 4, 0, 0), parent=self)

    def _copy(self) -> None:
        QGuiApplication.clipboard().setText(self.field.text())
        self.copy.show_action("check", "Copied")


class FindingRow(Themed, QWidget):
    """One mode of failure: what is tested, or the symptom where it was found; that is tinted and open."""

    def __init__(self, finding: Finding) -> None:
        super().__init__()
        self.finding = finding
        self.found = False
        self.body: QWidget | None = None
        self.chip = Chip(small=True)
        self.more = ActionButton("chevron_down", "Why", role="plain", height=32)
        self.more.setProperty("dense", "true")
        self.more.setAutoDefault(False)
        self.more.setCheckable(True)
        self.more.toggled.connect(self._open)
        number = figures(str(finding.number), "label", "text2")
        number.setFixedWidth(22)
        number.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.words = label("", "body", wraps=True)
        head = hbox(number, (self.words, 1), self.chip, self.more, spacing=12)
        self._column = vbox(head, spacing=4, margins=(10, 4, 8, 4), parent=self)
        self.show_waiting()

    def show_waiting(self) -> None:
        self._show(WAITING, self.finding, found=False)

    def show_finding(self, finding: Finding) -> None:
        """Say what was found; what is found is open."""
        self._show(STATES[finding.state], finding, found=finding.state == "found")

    def _show(self, state: tuple[Tone, str, str], finding: Finding, *, found: bool) -> None:
        body, self.body = self.body, None
        if body is not None:
            self._column.removeWidget(body)
            body.hide()
            body.deleteLater()
        self.finding, self.found = finding, found
        self.chip.show_state(*state)
        self.words.setFont(font("strong" if found else "body"))
        self.words.setText(capital(finding.words))
        self.setAccessibleName(f"{finding.number}. {finding.words}: {state[2]}")
        self.more.setAccessibleName(f"Why: {finding.words}")
        self.more.setChecked(found)
        self._open(found)
        self.update()

    def _open(self, yes: bool) -> None:
        if yes and self.body is None:
            self.body = self._body(self.finding)
            self._column.addWidget(self.body)
            apply_theme_within(self.body, self.theme)
        if self.body is not None:
            self.body.setVisible(yes)
        self.more.show_action("minus" if yes else "chevron_down", "Less" if yes else "Why")

    def _body(self, finding: Finding) -> QWidget:
        whole = QWidget()
        grid = QGridLayout(whole)
        grid.setContentsMargins(34, 0, 8, 6)
        grid.setHorizontalSpacing(14)
        grid.setVerticalSpacing(4)
        grid.setColumnStretch(1, 1)
        rows = (("Cause", capital(finding.cause)), ("Cure", capital(finding.cure)), ("Detected by", finding.known_by))
        for row, (name, words) in enumerate((name, words) for name, words in rows if words):
            text = label(words, "label", "text", wraps=True)
            text.setFont(font("label", weight=600 if name == "Cure" and self.found else 400))
            text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            grid.addWidget(label(name, "label", "text2"), row, 0, Qt.AlignmentFlag.AlignTop)
            grid.addWidget(text, row, 1)
        if finding.paste:
            grid.addWidget(Paste(finding.paste), len(rows), 1)
        return whole

    def paintEvent(self, _event: QPaintEvent) -> None:
        if not self.found:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(self.theme.bad_bg))
        painter.drawRoundedRect(QRectF(self.rect()), RADIUS_CONTROL, RADIUS_CONTROL)
