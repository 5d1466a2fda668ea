"""The tab Measures: instant numbers once the window is idle after an edit, simulated ones when the keyboard rests."""

import logging
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.designer.document.document import Document
from study_app.designer.document.study import Study
from study_app.designer.editing import Editing
from study_app.designer.measures.levels import block_of
from study_app.designer.measures.measures_view import measures_view
from study_app.designer.measures.simulation import (
    WAITING,
    MeasureClient,
    Simulated,
    Simulation,
    needs_precision_check,
    simulation_of,
    start_measure_worker,
)
from study_app.designer.measures.study_facts import facts, valid_part
from study_app.designer.prompts import ConfirmCard
from study_app.designer.window import DesignerPlace
from study_app.errors import StudyError
from study_app.gui.widgets import delayed_call
from study_app.number_text import capitalised, counted
from study_app.protocol.source import protocol_hash
from study_app.store.files import study_folder, write_files
from study_app.workers.server import Crashed

log = logging.getLogger(__name__)

_IDLE_MS: Final = 20
_REST_MS: Final = 800
_LOOK_MS: Final = 100
_NOT_WRITTEN: Final = "The preregistration was not written"
_LATE: Final = "The study already has {count}; the text cannot preregister data that already exist."
_REGISTER: Final = "Register this text before the first session."
_FAILED: Final = "the simulation process could not be started"


class MeasuresController(QObject):
    """Shows what the open study can find; ``warned``: the warnings of ``check`` that need simulations changed."""

    warned = Signal()

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.warnings: tuple[str, ...] = ()
        self._editing, self._place = editing, place
        self.make = start_measure_worker
        self._client: MeasureClient | None = None
        self._ordered = 0
        self._wanted: Simulation | None = None
        self._answers: dict[Simulation, Simulated] = {}
        self._latest = Simulated()
        self.rest = delayed_call(self, _REST_MS, self._send_order)
        self._look = QTimer(self)
        self._look.setInterval(_LOOK_MS)
        self._look.timeout.connect(self._take_answers)
        self._sound: Study | None = None
        self._idle = delayed_call(self, _IDLE_MS, self.show_measures)
        editing.opened_other.connect(self._forget_study)
        editing.changed.connect(self._idle.start)
        place.pane.tab_shown.connect(self._idle.start)
        place.entered.connect(self._idle.start)
        place.left.connect(self.leave)
        place.measures.power.preregister.clicked.connect(self.write_preregistration)
        for part in (place.measures, place.pane.facts):
            part.open_asked.connect(editing.select)
            part.appeared.connect(self._idle.start)

    def show_measures(self) -> None:
        """Show the study's present numbers, and order the missing ones."""
        opened = self._editing.opened
        if opened is None or not self._place.isVisible():
            self._request(None)
            return
        path = opened.selected
        if opened.study.formed is not None:
            self._sound = opened.study
        now, before = (None if study is None else valid_part(study).protocol for study in (opened.study, self._sound))
        lost = now is None or (block_of(now, path) is None and block_of(before, path) is not None)
        study = opened.study if self._sound is None or not lost else self._sound
        valid = valid_part(study)
        if valid.protocol is None or not needs_precision_check(valid.protocol):
            self._set_warnings(())
        shows_power = self._place.measures.isVisible() and valid.whole and valid.forces
        self._request(None if valid.protocol is None else simulation_of(valid.protocol, power=shows_power))
        view = measures_view(study, facts(study), path, self._latest, earlier=study is not opened.study)
        self._place.measures.power.changed.setVisible(self._differs_from_preregistration(opened))
        self._place.measures.show_measures(view)
        self._place.pane.facts.show_measures(view)

    def _differs_from_preregistration(self, opened: Document) -> bool:
        """Return whether the saved study is another one than its preregistration describes."""
        try:
            study = study_folder(self._editing.results, str(opened.study.document["study"]["name"]))
            text = study.preregistration.read_text(encoding="utf-8")
            return bool(opened.base) and protocol_hash(opened.saved_source) not in text
        except (StudyError, OSError, UnicodeDecodeError, LookupError, TypeError):
            return False

    def leave(self) -> None:
        """End the process: it must not share the processor with a session."""
        self._idle.stop()
        self._request(None)
        self._close()

    def _forget_study(self) -> None:
        self._sound, self._answers, self._latest = None, {}, Simulated()
        self._idle.start()

    def write_preregistration(self) -> None:
        """Write the saved study's preregistration into its results; ask before another text is replaced."""
        opened = self._editing.opened
        if opened is None:
            return
        self._place.flush()
        if opened.edited or not opened.base:
            self._place.message.emit(_NOT_WRITTEN, "It describes the saved study. Save the study first.")
            return
        from study_app.analysis.planning import preregistration  # noqa: PLC0415 - loads scipy

        known = self._answers.get(self._wanted) if self._wanted is not None else None
        power = (known and known.table) or None
        try:
            text = preregistration.preregistration_of(str(opened.file), power).encode()
            study = study_folder(self._editing.results, str(opened.study.document["study"]["name"]))
            file = study.preregistration
            differs, sessions = file.exists() and file.read_bytes() != text, len(study.sessions())
        except (StudyError, OSError) as error:
            self._place.message.emit(_NOT_WRITTEN, f"{error}.")
            return
        note = "" if power else self._without_power()
        why = [f"{file} differs from the text generated for this study. If you have registered the file, keep it."]
        late = _LATE.format(count=counted(sessions, "session")) if sessions else ""
        why = [*(why if differs else ()), *([late] if late else ()), note]
        write = partial(self._write_text, file, text, f"{note} {late or _REGISTER}".lstrip())
        if not differs and not sessions:
            write()
            return
        question = "Replace the preregistration?" if differs else "Write the preregistration now?"
        card = ConfirmCard(question, " ".join(why).rstrip(), "Replace it" if differs else "Write it")
        card.answered.connect(lambda _answer: write())
        self._place.show_prompt(card, card.first)

    def _without_power(self) -> str:
        """Return why the text has no power."""
        if failed := self._latest.failed:
            return f"The text does not include a power analysis: {failed}"
        return "The text does not include a power analysis, because the simulation has not finished."

    def _write_text(self, file: Path, text: bytes, note: str) -> None:
        try:
            write_files(file.parent, {file.name: text})
        except StudyError as error:
            self._place.message.emit(_NOT_WRITTEN, f"{error}.")
            return
        said = f"{note} The report will list deviations from this text."
        self._place.file_message.emit("Preregistration written", f"{file}\n\n{said}", file)
        self.show_measures()

    # simulations

    @property
    def is_waiting(self) -> bool:
        return self.rest.isActive() or self._look.isActive()

    def _request(self, wanted: Simulation | None) -> None:
        """Request a simulation; cancel one for another version of the study."""
        if wanted == self._wanted:
            return
        self._wanted = wanted
        self.rest.stop()
        if self._look.isActive():
            self._look.stop()
            if self._client is not None:
                self._client.stop()
        if wanted is None:
            return
        if wanted in self._answers:
            self._show_answer(self._answers[wanted])
        else:
            self._latest = replace(self._latest, waiting=WAITING, failed="")
            self.rest.start()

    def _send_order(self) -> None:
        if self._wanted is None:
            return
        if self._client is not None and not self._client.works:
            self._close()
        if self._client is None:
            try:
                self._client = self.make()
            except OSError as error:  # no process could be started: the designer works without these numbers
                log.info("the worker of simulations does not start: %s", error)
                self._show_failure(_FAILED)
                return
        self._ordered = self._client.order(self._wanted)
        self._look.start()

    def _take_answers(self) -> None:
        wanted = self._wanted
        if self._client is None or wanted is None:
            return
        for number, answer in self._client.answers():
            if number != self._ordered:
                continue
            if isinstance(answer, Simulated):
                self._show_answer(answer)
                if not answer.waiting:
                    self._look.stop()
                    self._answers[wanted] = answer
            elif isinstance(answer, Crashed) or not answer.stopped:
                self._look.stop()
                self._show_failure(answer.sentence)

    def _show_answer(self, answer: Simulated) -> None:
        self._latest = answer
        self._set_warnings(answer.warnings)
        self._idle.start()

    def _show_failure(self, sentence: str) -> None:
        log.info("simulations failed: %s", sentence)
        self._latest = Simulated(warnings=self.warnings, failed=f"{capitalised(sentence)}.")
        self._idle.start()

    def _set_warnings(self, warnings: tuple[str, ...]) -> None:
        if warnings != self.warnings:
            self.warnings = warnings
            self.warned.emit()

    def _close(self) -> None:
        self.rest.stop()
        self._look.stop()
        client, self._client = self._client, None
        if client is not None:
            client.close()
