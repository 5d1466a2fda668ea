"""A Falcon's diagnosis: what goes on while it is looked over, then every mode of failure, found or not."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, TypeAlias

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QDialog, QFileDialog, QHBoxLayout, QProgressBar, QScrollArea, QVBoxLayout, QWidget

from study_app.devices.doctor_report import Report, lines
from study_app.devices.falcon.doctor.failure_report import findings_of
from study_app.devices.falcon.doctor.worker import Examination, Said
from study_app.devices.falcon.failure_modes import Facts
from study_app.errors import StoreError
from study_app.gui.devices.failure_rows import FindingRow
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import wear
from study_app.gui.widgets.cards import Card, Icon, Rule
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.store.support import NAME, write_support
from study_app.viewmodels.device_list import TITLES

LOOK_MS = 100
PREPARING = "Preparing … The first time the driver is compiled, which takes about a minute."
SIZE = QSize(820, 700)


class Examined(Protocol):
    """What goes on elsewhere (see ``devices.falcon.doctor.worker.Examination``)."""

    def said(self) -> list[Said]: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


Begin: TypeAlias = Callable[..., Examined]


class DiagnosisDialog(QDialog):
    """Looks a Falcon over, and shows what is wrong with it. Closing it ends the examination.

    ``over(well)`` comes when the examination has said what it found.

    Parameters
    ----------
    parent, theme
        The window it belongs to, and its colours.
    name
        Which Falcon: as ``--device`` takes it.
    firmware
        File of its program, where it needs one.
    note
        What else should be known, in a sentence.
    begin
        What examines; it takes name and firmware.
    """

    over = Signal(bool)

    def __init__(
        self,
        parent: QWidget | None,
        theme: Theme,
        name: str,
        *,
        firmware: Path | None = None,
        note: str = "",
        begin: Begin = Examination,
    ) -> None:
        super().__init__(parent)
        self._name, self._firmware, self._begin = name, firmware, begin
        title = TITLES.get(name.partition(":")[0], name)
        self.setWindowTitle(f"Diagnose {title}")
        self.setModal(False)
        self._examination: Examined | None = None
        self._leaving: threading.Thread | None = None
        self._wanted = False
        self.report: Report | None = None
        self.rows = [FindingRow(finding) for finding in findings_of(Facts())]
        self.step = label(PREPARING, "body", "text2", wraps=True)
        self.note = label(note, "label", "warn", wraps=True)
        self.note.setVisible(bool(note))
        self.seen = label("", "label", "text2", wraps=True)
        self.seen.setFont(font("label", weight=400, tabular=True))
        self.bar = QProgressBar()
        self.bar.setRange(0, 0)
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(8)
        self.sign = Icon("pulse", "accent", 26)
        self.again = ActionButton("repeat", "Examine again")
        self.copy = ActionButton("copy", "Copy report")
        self.support = ActionButton("save", "Save for support …")
        self.close_button = ActionButton("", "Cancel")
        self._lay_out(title)
        self._connect()
        self.setMinimumSize(680, 420)
        room = self.screen().availableSize()
        self.resize(SIZE.boundedTo(QSize(room.width() - 40, room.height() - 60)))
        wear(self, theme)
        self._timer = QTimer(self)
        self._timer.setInterval(LOOK_MS)
        self._timer.timeout.connect(self._look)
        self.examine()

    def _lay_out(self, title: str) -> None:
        words = QVBoxLayout()
        words.setSpacing(4)
        words.addWidget(label(f"Diagnose {title}", "title_dense"))
        words.addWidget(self.step)
        head = QHBoxLayout()
        head.setSpacing(14)
        head.addWidget(self.sign, 0, Qt.AlignmentFlag.AlignTop)
        head.addLayout(words, 1)
        self._list = QVBoxLayout()
        self._list.setContentsMargins(0, 0, 0, 0)
        self._list.setSpacing(2)
        self._list.addStretch()
        inside = QWidget()
        inside.setLayout(self._list)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.area.setWidget(inside)
        card = Card(padding=10, gap=0)
        card.column.addWidget(self.area)
        foot = QHBoxLayout()
        foot.setSpacing(12)
        foot.addWidget(self.close_button)
        foot.addStretch()
        foot.addWidget(self.support)
        foot.addWidget(self.copy)
        foot.addWidget(self.again)
        column = QVBoxLayout(self)
        column.setContentsMargins(28, 24, 28, 20)
        column.setSpacing(12)
        column.addLayout(head)
        column.addWidget(self.bar)
        column.addWidget(self.note)
        column.addWidget(self.seen)
        column.addWidget(card, 1)
        column.addWidget(Rule())
        column.addLayout(foot)

    def _connect(self) -> None:
        self.close_button.clicked.connect(self.reject)
        self.again.clicked.connect(self.examine)
        self.copy.clicked.connect(self._copy)
        self.support.clicked.connect(self._ask_where)
        for button in (self.again, self.copy, self.support):
            button.setAutoDefault(False)
        self.close_button.setDefault(True)

    def examine(self) -> None:
        """Begin, or begin anew."""
        self._let_go()
        self.report = None
        self._say(PREPARING, "text2", "pulse", "accent")
        self.seen.hide()
        self.bar.show()
        self.again.setEnabled(False)
        self.copy.setEnabled(False)
        self.support.setEnabled(False)
        self.close_button.show_action("", "Cancel")
        self._show_waiting()
        self._wanted = True
        self._timer.start()
        self._look()

    def _look(self) -> None:
        """Begin as soon as nothing else holds the Falcon; then take what was said since."""
        if self._wanted and (self._leaving is None or not self._leaving.is_alive()):
            self._wanted = False
            self._examination = self._begin(self._name, firmware=self._firmware)
        for said in [] if self._examination is None else self._examination.said():
            if isinstance(said, str):
                self._say(said, "text", "pulse", "accent")
            else:
                self._finish(said)

    def _finish(self, said: Said) -> None:
        """Show what was found, or why nothing could be looked at."""
        self._timer.stop()
        self.bar.hide()
        self.again.setEnabled(True)
        self.support.setEnabled(True)
        self.close_button.show_action("", "Close")
        self._let_go()
        if not isinstance(said, Report):
            self._say(_sentence(str(said)), "bad", "warning", "bad")
            self.over.emit(False)
            return
        self.report = said
        self.copy.setEnabled(True)
        well = said.well
        words = said.conclusion if said.failure is None else _sentence(said.failure)
        self._say(words, "text2" if well else "bad", "check" if well else "warning", "ok" if well else "bad")
        self.seen.setText("Seen: " + "  ·  ".join(said.seen))
        self.seen.setVisible(bool(said.seen))
        self._show_findings(said)
        self.over.emit(well)

    def _show_waiting(self) -> None:
        """Show every mode before anybody has looked, in its order."""
        for row in self.rows:
            row.show_waiting()
        self._order(self.rows)

    def _show_findings(self, report: Report) -> None:
        """Show every mode as it was found; what is found stands first."""
        for row, finding in zip(self.rows, report.findings, strict=True):
            row.show_finding(finding)
        self._order([self.rows[finding.number - 1] for finding in report.in_order])

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
        """Ask for a file, in a dialog that nothing waits for."""
        dialog = QFileDialog(self, "Save a zip file for whoever helps", NAME, "Zip files (*.zip)")
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
            self.seen.setText(f"Saved as {path}. No participant's id, answer or liquid's value is in it.")
        self.seen.show()

    def _let_go(self) -> None:
        """Have what goes on end, in a thread: the process closes the Falcon first, and nothing waits for that here."""
        examination, self._examination = self._examination, None
        if examination is not None:
            self._leaving = threading.Thread(target=examination.close, name="diagnosis leaving", daemon=True)
            self._leaving.start()

    def done(self, result: int) -> None:
        """End the examination, however the dialog is closed."""
        self._timer.stop()
        self._wanted = False
        self._let_go()
        super().done(result)


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:] + ("" if words.endswith((".", "!", "?")) else ".")
