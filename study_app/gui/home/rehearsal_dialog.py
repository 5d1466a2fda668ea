"""Rehearsing a protocol from the home window: asked here, run as a program of its own, so that nothing here waits."""

from __future__ import annotations

import sys
from pathlib import Path

from PySide6.QtCore import QProcess, QTimer
from PySide6.QtWidgets import QDialog, QHBoxLayout, QProgressBar, QVBoxLayout, QWidget

from study_app.gui.theme.theme import LIGHT, Theme
from study_app.gui.theme.themed import wear
from study_app.gui.widgets.controls import ActionButton, Number
from study_app.gui.widgets.labels import label, set_ink
from study_app.store.folders import rehearsal_folder
from study_app.viewmodels.home import StudyFacts

MAX_PARTICIPANTS = 200
PATIENCE_MS = 2000
DONE = "(simulated)"  # ends the line that is printed of a participant who is done
ARGUMENTS = ("-m", "study_app", "rehearse")


class RehearsalDialog(QDialog):
    """How many simulated participants, then how far it is, then the way to their results; Cancel keeps whole sessions.

    It is accepted when the results are to be shown.

    Parameters
    ----------
    facts
        The protocol.
    results
        Folder that holds the studies' folders; the rehearsal gets one of its own.
    """

    def __init__(
        self, facts: StudyFacts, results: Path, *, theme: Theme = LIGHT, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self.setWindowTitle("Rehearse")
        self.setModal(True)
        self.setMinimumWidth(520)
        self._facts = facts
        self.folder = rehearsal_folder(results, facts.protocol.study.name)
        self.participants = Number(1, MAX_PARTICIPANTS, 5)
        self.seed = Number(0, 2_147_483_647, 1)
        self.said = label(
            "Whole sessions run faster than real time, with simulated participants. "
            f"They are marked as simulated and kept apart, in {self.folder}.",
            "body",
            "text2",
            wraps=True,
        )
        self.progress = QProgressBar()
        self.progress.setRange(0, 0)
        self.progress.setTextVisible(False)
        self.progress.setFixedHeight(8)
        self.progress.hide()
        self.start = ActionButton("fast_forward", "Rehearse", role="primary")
        self.cancel = ActionButton("", "Cancel")
        self.start.setDefault(True)
        self.process = QProcess(self)
        self.process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        self._told = ""
        self._stopping = False
        self.over = False
        self._lay_out()
        wear(self, theme)
        self.start.clicked.connect(self._start)
        self.cancel.clicked.connect(self.reject)
        self.process.readyRead.connect(self._listen)
        self.process.finished.connect(self._finished)
        self.process.errorOccurred.connect(self._failed)

    def _lay_out(self) -> None:
        column = QVBoxLayout(self)
        column.setContentsMargins(28, 24, 28, 24)
        column.setSpacing(12)
        column.addWidget(label(f"Rehearse {self._facts.title}", "title_dense"))
        column.addWidget(self.said)
        row = QHBoxLayout()
        row.setSpacing(16)
        for name, field in (("Simulated participants", self.participants), ("Seed", self.seed)):
            field.setAccessibleName(name)
            one = QVBoxLayout()
            one.setSpacing(6)
            one.addWidget(label(name, "label", "text2"))
            one.addWidget(field)
            row.addLayout(one, 1)
        column.addLayout(row)
        column.addWidget(self.progress)
        foot = QHBoxLayout()
        foot.addWidget(self.cancel)
        foot.addStretch()
        foot.addWidget(self.start)
        column.addSpacing(6)
        column.addLayout(foot)

    def _start(self) -> None:
        if self.over:
            self.accept()
            return
        if self.process.state() != QProcess.ProcessState.NotRunning:
            return
        for field in (self.participants, self.seed, self.start):
            field.setEnabled(False)
        self.progress.setRange(0, self.participants.value())
        self.progress.show()
        self._show_done()
        words = ("--participants", str(self.participants.value()), "--seed", str(self.seed.value()))
        where = ("--results", str(self.folder))
        self.process.start(sys.executable, [*ARGUMENTS, self._facts.source, *words, *where])

    def _listen(self) -> None:
        self._told += bytes(self.process.readAll().data()).decode(errors="replace")
        self._show_done()

    def _show_done(self) -> None:
        """Show how many participants are done, by the lines that the rehearsal printed of them, and the last line."""
        lines = self._told.strip().splitlines()
        done = sum(line.endswith(DONE) for line in lines)
        self.progress.setValue(done)
        counted = f"{done} of {self.participants.value()}"
        self.said.setText(f"{counted}: {lines[-1]}" if lines else f"{counted}: rehearsing …")

    def _failed(self, error: QProcess.ProcessError) -> None:
        """Say that there was no program to run; whatever else fails ends the process too."""
        if error == QProcess.ProcessError.FailedToStart:
            self._told = self.process.errorString()
            self._finished(-1, QProcess.ExitStatus.CrashExit)

    def _finished(self, code: int, _status: QProcess.ExitStatus) -> None:
        if self._stopping:
            super().reject()
            return
        self._listen()
        self.progress.hide()
        if code == 0:
            self.over = True
            self.said.setText(f"Done: {self.participants.value()} simulated sessions, kept in {self.folder}.")
            self.start.show_action("", "Open results")
            self.start.setEnabled(True)
            self.start.setFocus()
            self.cancel.setText("Close")
            return
        lines = self._told.strip().splitlines()
        self.said.setText(lines[-1] if lines else f"The rehearsal ended with exit code {code}.")
        set_ink(self.said, "bad")
        self.cancel.setText("Close")

    def reject(self) -> None:
        """Have the rehearsal stop, if it runs, and close once it has."""
        if self.process.state() == QProcess.ProcessState.NotRunning:
            super().reject()
        elif not self._stopping:
            self._stopping = True
            self.cancel.setEnabled(False)
            self.said.setText("Stopping …")
            self.process.terminate()
            QTimer.singleShot(PATIENCE_MS, self.process, self.process.kill)

    def end(self) -> None:
        """Stop the rehearsal and wait for it: the windows are gone."""
        if self.process.state() != QProcess.ProcessState.NotRunning:
            self.reject()
            if not self.process.waitForFinished(PATIENCE_MS):
                self.process.kill()
                self.process.waitForFinished(PATIENCE_MS)
