"""A device's diagnosis: what goes on while it is examined, then every mode of failure, found or not."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from PySide6.QtCore import QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication, QPaintEvent
from PySide6.QtWidgets import QApplication, QDialog, QFileDialog, QLineEdit, QProgressBar, QWidget

from study_app.devices.doctor import Finding, Report, State, lines
from study_app.devices.doctor_worker import ExaminationClient, start_examination
from study_app.devices.registry import descriptor_of, doctor_of, title_of
from study_app.errors import StoreError
from study_app.gui.theme.theme import RADIUS_CONTROL, Theme, Tone, font
from study_app.gui.theme.themed import Themed, apply_theme, remove_widget
from study_app.gui.widgets.boxes import STRETCH, grid, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip, Icon, Rule, fill_rounded, scrolled, smooth_painter
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import figures, label, set_ink
from study_app.store.support import NAME, write_support
from study_app.store.workstation import MachineSettings
from study_app.workers.server import Crashed, Refused

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
        self.field = QLineEdit(text, readOnly=True, cursorPosition=0)
        self.field.setFont(font("label", weight=400))
        self.field.setAccessibleName("Command for a terminal")
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
            remove_widget(body)
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
        if self.body is not None:
            self.body.setVisible(yes)
        self.more.show_action("minus" if yes else "chevron_down", "Less" if yes else "Why")

    def _body(self, finding: Finding) -> QWidget:
        whole = QWidget()
        cells = grid(14, 4, margins=(34, 0, 8, 6), parent=whole)
        cells.setColumnStretch(1, 1)
        rows = (("Cause", capital(finding.cause)), ("Cure", capital(finding.cure)), ("Detected by", finding.known_by))
        for row, (name, words) in enumerate((name, words) for name, words in rows if words):
            text = label(words, "label", "text", wraps=True)
            text.setFont(font("label", weight=600 if name == "Cure" and self.found else 400))
            text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            cells.addWidget(label(name, "label", "text2"), row, 0, Qt.AlignmentFlag.AlignTop)
            cells.addWidget(text, row, 1)
        if finding.paste:
            cells.addWidget(Paste(finding.paste), len(rows), 1)
        return whole

    def paintEvent(self, _event: QPaintEvent) -> None:
        if not self.found:
            return
        painter = smooth_painter(self)
        fill_rounded(painter, QRectF(self.rect()), RADIUS_CONTROL, self.theme.bad_bg)


LOOK_MS = 100
PREPARING = "Preparing … The first time the driver is compiled, which takes about a minute."
SIZE = QSize(820, 700)


Begin: TypeAlias = Callable[..., ExaminationClient]


class DiagnosisDialog(QDialog):
    """Examines a device, and shows what is wrong with it. Closing it ends the examination.

    ``over(well)`` comes when the examination has said what it found.

    Parameters
    ----------
    name : which device: as ``--device`` takes it
    note : what else should be known, in a sentence
    begin : starts an examination; it takes name and options
    """

    over = Signal(bool)

    def __init__(
        self,
        parent: QWidget | None,
        theme: Theme,
        name: str,
        *,
        options: Mapping[str, str | Path] | None = None,
        note: str = "",
        begin: Begin = start_examination,
    ) -> None:
        super().__init__(parent)
        self._name, self._options, self._begin = name, options or {}, begin
        title = title_of(name)
        self.setWindowTitle(f"Diagnose {title}")
        self.setModal(False)
        self._examination: ExaminationClient | None = None
        self.leaving: ExaminationClient | None = None
        self._wanted = False
        self.report: Report | None = None
        self.rows = [FindingRow(finding) for finding in doctor_of(name).findings()]
        self.step = label(PREPARING, "body", "text2", wraps=True)
        self.note = label(note, "label", "warn", wraps=True)
        self.note.setVisible(bool(note))
        self.seen = label("", "label", "text2", wraps=True, weight=400, tabular=True)
        self.bar = QProgressBar(textVisible=False)
        self.bar.setRange(0, 0)
        self.bar.setFixedHeight(8)
        self.sign = Icon("pulse", "accent", 26)
        self.again = ActionButton("repeat", "Run again")
        self.copy = ActionButton("copy", "Copy report")
        self.support = ActionButton("save", "Save for support …")
        self.close_button = ActionButton("", "Cancel")
        self._lay_out(title)
        self._order(self.rows)
        self._connect()
        self.setMinimumSize(680, 420)
        room = self.screen().availableSize()
        self.resize(SIZE.boundedTo(QSize(room.width() - 40, room.height() - 60)))
        apply_theme(self, theme)
        self._timer = QTimer(self, interval=LOOK_MS)
        self._timer.timeout.connect(self._look)
        self.examine()

    def _lay_out(self, title: str) -> None:
        words = vbox(label(f"Diagnose {title}", "title_dense"), self.step, spacing=4)
        head = hbox((self.sign, 0, Qt.AlignmentFlag.AlignTop), (words, 1), spacing=14)
        self._list = vbox(STRETCH, spacing=2, margins=0)
        inside = QWidget()
        inside.setLayout(self._list)
        self.area = scrolled(inside)
        card = Card(padding=10, gap=0)
        card.column.addWidget(self.area)
        foot = hbox(self.close_button, STRETCH, self.support, self.copy, self.again, spacing=12)
        vbox(
            head,
            self.bar,
            self.note,
            self.seen,
            (card, 1),
            Rule(),
            foot,
            spacing=12,
            margins=(28, 24, 28, 20),
            parent=self,
        )

    def _connect(self) -> None:
        self.close_button.clicked.connect(self.reject)
        self.again.clicked.connect(self.examine)
        self.copy.clicked.connect(self._copy)
        self.support.clicked.connect(self._ask_where)
        for button in (self.again, self.copy, self.support):
            button.setAutoDefault(False)
        self.close_button.setDefault(True)

    def examine(self) -> None:
        self._let_go()
        self.report = None
        self._say(PREPARING, "text2", "pulse", "accent")
        self.seen.hide()
        self.bar.show()
        self.again.setEnabled(False)
        self.copy.setEnabled(False)
        self.support.setEnabled(False)
        self.close_button.show_action("", "Cancel")
        for row in self.rows:
            row.show_waiting()
        self._order(self.rows)
        self._wanted = True
        self._timer.start()
        self._look()

    def _look(self) -> None:
        """Begin as soon as nothing else holds the device; then take what was said since."""
        if self._wanted and (self.leaving is None or self.leaving.ended):
            self._wanted = False
            self._examination = self._begin(self._name, options=self._options)
        for _, answer in [] if self._examination is None else self._examination.answers():
            if isinstance(answer, str):
                self._say(answer, "text", "pulse", "accent")
            else:
                self._finish(answer)

    def _finish(self, said: Report | Refused | Crashed) -> None:
        self._timer.stop()
        self.bar.hide()
        self.again.setEnabled(True)
        self.support.setEnabled(True)
        self.close_button.show_action("", "Close")
        self._let_go()
        if not isinstance(said, Report):
            self._say(_sentence(said.sentence), "bad", "warning", "bad")
            self.over.emit(False)
            return
        self.report = said
        self.copy.setEnabled(True)
        well = said.well
        words = said.conclusion if said.failure is None else _sentence(said.failure)
        self._say(words, "text2" if well else "bad", "check" if well else "warning", "ok" if well else "bad")
        self.seen.setText("Seen: " + "  ·  ".join(said.seen))
        self.seen.setVisible(bool(said.seen))
        for row, finding in zip(self.rows, said.findings, strict=True):
            row.show_finding(finding)
        self._order([self.rows[finding.number - 1] for finding in said.in_order])
        self.over.emit(well)

    def _order(self, rows: Sequence[FindingRow]) -> None:
        """Put rows under each other, and lead the keyboard through them in that order."""
        for row in rows:
            self._list.removeWidget(row)
        before: QWidget = self.close_button
        for place, row in enumerate(rows):
            self._list.insertWidget(place, row)
            self.setTabOrder(before, row.more)
            before = row.more
        self._list.activate()
        self.area.verticalScrollBar().setValue(0)

    def _say(self, words: str, ink: str, sign: str, sign_ink: str) -> None:
        self.step.setText(words)
        set_ink(self.step, ink)  # type: ignore[arg-type]
        self.sign.show_icon(sign, sign_ink)  # type: ignore[arg-type]

    def _copy(self) -> None:
        if self.report is not None:
            QGuiApplication.clipboard().setText("\n".join(lines(self.report)).strip() + "\n")
            self.copy.show_action("check", "Copied")

    def _ask_where(self) -> None:
        dialog = QFileDialog(self, "Save a zip file for support", NAME, "Zip files (*.zip)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("zip")
        dialog.fileSelected.connect(lambda path: self.save_support(Path(path)))
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def save_support(self, path: Path) -> None:
        """Write versions, settings, log, last error and the report to ``path``; say so, or why not."""
        report = "" if self.report is None else "\n".join(lines(self.report)).strip() + "\n"
        try:
            write_support(path, report)
        except StoreError as error:
            self.seen.setText(_sentence(str(error)))
        else:
            self.seen.setText(
                f"Saved as {path}. It contains no participant id, no answers and no parameters of liquids."
            )
        self.seen.show()

    def _let_go(self) -> None:
        """Have the process end: it closes the device first, and nothing waits for that here."""
        if self._examination is not None:
            self._examination.close()
            self.leaving, self._examination = self._examination, None

    def done(self, result: int) -> None:
        """End the examination, however the dialog is closed."""
        self._timer.stop()
        self._wanted = False
        self._let_go()
        super().done(result)


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:] + ("" if words.endswith((".", "!", "?")) else ".")


HELD = (
    "This session uses the device, so some checks cannot run. For a full diagnosis, end the session first; you can "
    "resume it later."
)


def diagnosis(
    parent: QWidget, theme: Theme, name: str, settings: MachineSettings, *, held: bool = False
) -> DiagnosisDialog:
    """Return the diagnosis of a device, begun; ``held`` where a session has it open."""
    options = descriptor_of(name).window_values(settings.device_options)
    made = DiagnosisDialog(parent, theme, name, options=options, note=HELD if held else "")
    made.finished.connect(made.deleteLater)
    if settings.sound:
        made.over.connect(lambda _well: QApplication.beep())
    return made
