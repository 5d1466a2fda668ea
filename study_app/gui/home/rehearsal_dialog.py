"""Rehearsing a protocol from the home window, in a worker process, so that nothing here waits."""

from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QDialog, QProgressBar, QWidget

from study_app.gui.kit.fields import Editor, Field
from study_app.gui.theme.theme import LIGHT, Theme
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.session.simulated.rehearsal_worker import TASK, RehearsalClient, RehearsalOrder
from study_app.session.start import MAX_SEED
from study_app.store.folders import rehearsal_folder
from study_app.viewmodels.home import StudyFacts
from study_app.workers.client import WorkerClient

MAX_PARTICIPANTS = 200
LISTEN_MS = 40


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
        self.participants = Editor(
            Field("participants", "Simulated participants", "count", limits=(1, MAX_PARTICIPANTS))
        )
        self.seed = Editor(Field("seed", "Seed", "count", limits=(0, MAX_SEED)))
        self.participants.show_value(5)
        self.seed.show_value(1)
        self.said = label(
            "Whole sessions run faster than real time, with simulated participants. "
            f"They are marked as simulated and stored separately, in {self.folder}.",
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
        self.worker: RehearsalClient | None = None
        self._done: list[str] = []
        self._stopping = False
        self.over = False
        row, foot = hbox((self.participants, 1), (self.seed, 1), spacing=16), hbox(self.cancel, STRETCH, self.start)
        title = label(f"Rehearse {facts.title}", "title_dense")
        vbox(title, self.said, row, self.progress, 6, foot, spacing=12, margins=(28, 24, 28, 24), parent=self)
        apply_theme(self, theme)
        self.start.clicked.connect(self._start)
        self.cancel.clicked.connect(self.reject)
        self._listening = QTimer(self)
        self._listening.setInterval(LISTEN_MS)
        self._listening.timeout.connect(self._listen)

    def _start(self) -> None:
        if self.over:
            self.accept()
            return
        if self.worker is not None:
            return
        for field in (self.participants, self.seed, self.start):
            field.setEnabled(False)
        self.progress.setRange(0, self.participants.value)
        self.progress.show()
        self._show_done()
        try:
            self.worker = WorkerClient(TASK, name="rehearsal")
        except OSError as error:
            self._fail(str(error))
            return
        self.worker.order(RehearsalOrder(self._facts.source, self.participants.value, self.seed.value, self.folder))
        self._listening.start()

    def _listen(self) -> None:
        """Take the answers since; where the rehearsal is to stop, close once its process has ended."""
        assert self.worker is not None  # noqa: S101 - listening begins with it
        if self._stopping:
            if self.worker.ended:
                self._listening.stop()
                super().reject()
            return
        for _, answer in self.worker.answers():
            if isinstance(answer, str):
                self._done.append(answer)
                self._show_done()
            elif isinstance(answer, Path):
                self._finish()
            else:
                self._fail(answer.sentence)

    def _show_done(self) -> None:
        """Show how many participants are done, and what was said of the last one."""
        self.progress.setValue(len(self._done))
        counted = f"{len(self._done)} of {self.participants.value}"
        self.said.setText(f"{counted}: {self._done[-1]}" if self._done else f"{counted}: rehearsing …")

    def _finish(self) -> None:
        self._let_go()
        self.over = True
        self.said.setText(f"Done: {self.participants.value} simulated sessions, stored in {self.folder}.")
        self.start.show_action("", "Open results")
        self.start.setEnabled(True)
        self.start.setFocus()
        self.cancel.setText("Close")

    def _fail(self, sentence: str) -> None:
        self._let_go()
        self.said.setText(sentence)
        set_ink(self.said, "bad")
        self.cancel.setText("Close")

    def _let_go(self) -> None:
        """Have the process end that has nothing to do any more."""
        self._listening.stop()
        self.progress.hide()
        if self.worker is not None:
            self.worker.close()

    def reject(self) -> None:
        """Have the rehearsal stop, if it runs, and close once it has."""
        if self.worker is None or not self.worker.works:
            super().reject()
        elif not self._stopping:
            self._stopping = True
            self.cancel.setEnabled(False)
            self.said.setText("Stopping …")
            self.worker.close()

    def end(self) -> None:
        """Stop the rehearsal and wait for it: the windows are gone."""
        if self.worker is not None:
            self._stopping = True
            self._listening.stop()
            self.worker.close()
            self.worker.wait_until_ended()
