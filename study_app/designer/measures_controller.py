"""The tab Measures: instant numbers as soon as the window is idle, simulated ones after a pause in typing."""

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
_PAUSE_MS: Final = 800
_POLL_MS: Final = 100
_NOT_WRITTEN: Final = "The preregistration was not written"
_LATE: Final = "The study already has {count}; the text cannot preregister data that already exist."
_REGISTER: Final = "Register this text before the first session."
_FAILED: Final = "the simulation process could not be started"


class MeasuresController(QObject):
    """Shows the measures of the open study; ``warned`` is emitted when the simulated warnings of ``check`` change."""

    warned = Signal()

    def __init__(self, editing: Editing, place: DesignerPlace) -> None:
        super().__init__(editing)
        self.warnings: tuple[str, ...] = ()
        self._editing, self._place = editing, place
        self.make = start_measure_worker
        self._client: MeasureClient | None = None
        self._order_number = 0
        self._requested: Simulation | None = None
        self._answers: dict[Simulation, Simulated] = {}
        self._latest = Simulated()
        self.rest = delayed_call(self, _PAUSE_MS, self._send_order)
        self._poll_timer = QTimer(self)
        self._poll_timer.setInterval(_POLL_MS)
        self._poll_timer.timeout.connect(self._receive_answers)
        self._last_valid: Study | None = None
        self._update_timer = delayed_call(self, _IDLE_MS, self.show_measures)
        editing.opened_other.connect(self._forget_study)
        editing.changed.connect(self._update_timer.start)
        place.pane.tab_shown.connect(self._update_timer.start)
        place.entered.connect(self._update_timer.start)
        place.left.connect(self.leave)
        place.measures.power.preregister.clicked.connect(self.write_preregistration)
        for part in (place.measures, place.pane.facts):
            part.open_asked.connect(editing.select)
            part.appeared.connect(self._update_timer.start)

    def show_measures(self) -> None:
        """Show the current numbers of the study, and request the missing simulation."""
        opened = self._editing.opened
        if opened is None or not self._place.isVisible():
            self._request(None)
            return
        path = opened.selected
        if opened.study.formed is not None:
            self._last_valid = opened.study
        current, last_valid = (
            None if study is None else valid_part(study).protocol for study in (opened.study, self._last_valid)
        )
        uses_last_valid = current is None or (
            block_of(current, path) is None and block_of(last_valid, path) is not None
        )
        study = opened.study if self._last_valid is None or not uses_last_valid else self._last_valid
        valid = valid_part(study)
        if valid.protocol is None or not needs_precision_check(valid.protocol):
            self._set_warnings(())
        shows_power = self._place.measures.isVisible() and valid.is_complete and valid.forces
        self._request(None if valid.protocol is None else simulation_of(valid.protocol, power=shows_power))
        view = measures_view(study, facts(study), path, self._latest, earlier=study is not opened.study)
        self._place.measures.power.changed.setVisible(self._was_changed_after_preregistration(opened))
        self._place.measures.show_measures(view)
        self._place.pane.facts.show_measures(view)

    def _was_changed_after_preregistration(self, opened: Document) -> bool:
        """Return whether the saved study differs from the one that its preregistration describes."""
        try:
            study = study_folder(self._editing.results, str(opened.study.document["study"]["name"]))
            text = study.preregistration.read_text(encoding="utf-8")
            return bool(opened.base) and protocol_hash(opened.saved_source) not in text
        except (StudyError, OSError, UnicodeDecodeError, LookupError, TypeError):
            return False

    def leave(self) -> None:
        """End the worker process, which must not take processor time from a session."""
        self._update_timer.stop()
        self._request(None)
        self._close()

    def _forget_study(self) -> None:
        self._last_valid, self._answers, self._latest = None, {}, Simulated()
        self._update_timer.start()

    def write_preregistration(self) -> None:
        """Write the saved study's preregistration into its results; first ask if it is late or replaces a text."""
        opened = self._editing.opened
        if opened is None:
            return
        self._place.flush()
        if opened.edited or not opened.base:
            self._place.message.emit(_NOT_WRITTEN, "It describes the saved study. Save the study first.")
            return
        from study_app.analysis.planning import preregistration  # noqa: PLC0415 - loads scipy

        result = self._answers.get(self._requested) if self._requested is not None else None
        power = (result and result.table) or None
        try:
            text = preregistration.preregistration_of(str(opened.file), power).encode()
            study = study_folder(self._editing.results, str(opened.study.document["study"]["name"]))
            file = study.preregistration
            differs, sessions = file.exists() and file.read_bytes() != text, len(study.sessions())
        except (StudyError, OSError) as error:
            self._place.message.emit(_NOT_WRITTEN, f"{error}.")
            return
        note = "" if power else self._no_power_sentence()
        reasons = [f"{file} differs from the text generated for this study. If you have registered the file, keep it."]
        late_sentence = _LATE.format(count=counted(sessions, "session")) if sessions else ""
        reasons = [*(reasons if differs else ()), *([late_sentence] if late_sentence else ()), note]
        write = partial(self._write_text, file, text, f"{note} {late_sentence or _REGISTER}".lstrip())
        if not differs and not sessions:
            write()
            return
        question = "Replace the preregistration?" if differs else "Write the preregistration now?"
        card = ConfirmCard(question, " ".join(reasons).rstrip(), "Replace it" if differs else "Write it")
        card.answered.connect(lambda _answer: write())
        self._place.show_prompt(card, card.first)

    def _no_power_sentence(self) -> str:
        """Return the sentence on why the text has no power analysis."""
        if failed := self._latest.failed:
            return f"The text does not include a power analysis: {failed}"
        return "The text does not include a power analysis, because the simulation has not finished."

    def _write_text(self, file: Path, text: bytes, note: str) -> None:
        try:
            write_files(file.parent, {file.name: text})
        except StudyError as error:
            self._place.message.emit(_NOT_WRITTEN, f"{error}.")
            return
        sentence = f"{note} The report will list deviations from this text."
        self._place.file_message.emit("Preregistration written", f"{file}\n\n{sentence}", file)
        self.show_measures()

    # simulations

    @property
    def is_waiting(self) -> bool:
        return self.rest.isActive() or self._poll_timer.isActive()

    def _request(self, simulation: Simulation | None) -> None:
        """Request a simulation, or None, and cancel the previous one if it differs."""
        if simulation == self._requested:
            return
        self._requested = simulation
        self.rest.stop()
        if self._poll_timer.isActive():
            self._poll_timer.stop()
            if self._client is not None:
                self._client.stop()
        if simulation is None:
            return
        if simulation in self._answers:
            self._show_answer(self._answers[simulation])
        else:
            self._latest = replace(self._latest, waiting=WAITING, failed="")
            self.rest.start()

    def _send_order(self) -> None:
        if self._requested is None:
            return
        if self._client is not None and not self._client.works:
            self._close()
        if self._client is None:
            try:
                self._client = self.make()
            except OSError as error:  # the designer also works without these numbers
                log.info("the worker of simulations does not start: %s", error)
                self._show_failure(_FAILED)
                return
        self._order_number = self._client.order(self._requested)
        self._poll_timer.start()

    def _receive_answers(self) -> None:
        requested = self._requested
        if self._client is None or requested is None:
            return
        for number, answer in self._client.answers():
            if number != self._order_number:
                continue
            if isinstance(answer, Simulated):
                self._show_answer(answer)
                if not answer.waiting:
                    self._poll_timer.stop()
                    self._answers[requested] = answer
            elif isinstance(answer, Crashed) or not answer.stopped:
                self._poll_timer.stop()
                self._show_failure(answer.sentence)

    def _show_answer(self, answer: Simulated) -> None:
        self._latest = answer
        self._set_warnings(answer.warnings)
        self._update_timer.start()

    def _show_failure(self, sentence: str) -> None:
        log.info("simulations failed: %s", sentence)
        self._latest = Simulated(warnings=self.warnings, failed=f"{capitalised(sentence)}.")
        self._update_timer.start()

    def _set_warnings(self, warnings: tuple[str, ...]) -> None:
        if warnings != self.warnings:
            self.warnings = warnings
            self.warned.emit()

    def _close(self) -> None:
        self.rest.stop()
        self._poll_timer.stop()
        client, self._client = self._client, None
        if client is not None:
            client.close()
