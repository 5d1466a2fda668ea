"""The tab Measures: instant numbers once the window is idle after an edit, simulated ones when the keyboard rests."""

import logging
from dataclasses import replace
from typing import Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.designer.document.study import Study
from study_app.designer.editing import Editing
from study_app.designer.measures.levels import LevelWords
from study_app.designer.measures.measures_view import measures_view
from study_app.designer.measures.simulation import (
    LAPSES,
    Controls,
    Focus,
    MeasureClient,
    Simulated,
    Simulation,
    focus_of,
    needs_precision_check,
    participants_of,
    planned_of,
    precision_of,
    simulation_of,
    start_measure_worker,
    threshold_of,
)
from study_app.designer.measures.study_facts import facts, valid_part
from study_app.designer.problems import ProblemRow, RepairSearch, problem_rows
from study_app.designer.window import DesignerPlace
from study_app.gui.widgets.background import delayed_call
from study_app.number_text import capitalised
from study_app.protocol.model import Protocol
from study_app.workers.server import Crashed

log = logging.getLogger(__name__)

_ANEW: Final = "simulating …"
_IDLE_MS: Final = 20
_REST_MS: Final = 800
_LOOK_MS: Final = 100
_MOST_PARTICIPANTS: Final = 500
_FAILED: Final = "the simulation process does not start"


class MeasuresController(QObject):
    """Shows what the open study can find; ``warned``: the warnings of ``check`` that take simulations are others."""

    warned = Signal()

    def __init__(self, editing: Editing, place: DesignerPlace, repairs: RepairSearch) -> None:
        super().__init__(editing)
        self.warnings: tuple[str, ...] = ()
        self._editing, self._place = editing, place
        self.make = start_measure_worker
        self._client: MeasureClient | None = None
        self._ordered = 0
        self._wanted: Simulation | None = None
        self._failed = ""
        self._answers: dict[Simulation, Simulated] = {}
        self.rest = delayed_call(self, _REST_MS, self._send_order)
        self._look = QTimer(self)
        self._look.setInterval(_LOOK_MS)
        self._look.timeout.connect(self._take_answers)
        self._sound: Study | None = None
        self._participants: int | None = None
        self._thresholds: dict[str, float] = {}
        self._lapses = LAPSES
        self._focus = Focus()
        self._repairs: dict[ProblemRow, tuple[str, ...]] = {}
        self._idle = delayed_call(self, _IDLE_MS, self.show_measures)
        editing.opened_other.connect(self._forget_study)
        editing.changed.connect(self._idle.start)
        repairs.found.connect(self._keep_repairs)
        place.pane.tab_shown.connect(self._idle.start)
        place.entered.connect(self._idle.start)
        place.left.connect(self.leave)
        place.pane.facts.appeared.connect(self._idle.start)
        measures = place.measures
        measures.repair_asked.connect(lambda row, sentence: place.ask("repair", row, sentence))
        measures.controls.participants.entered.connect(self._take_participants)
        measures.controls.threshold.entered.connect(self._take_threshold)
        measures.controls.lapses.entered.connect(self._take_lapses)
        for part in (measures, place.pane.facts):
            part.open_asked.connect(editing.select)

    def show_measures(self) -> None:
        """Show the study's present numbers, and order the missing ones."""
        opened = self._editing.opened
        if opened is None or not self._place.isVisible():
            self._request(None)
            return
        path, problems = opened.selected, problem_rows(opened.study)
        if opened.study.formed is not None:
            self._sound = opened.study
        now, before = (None if study is None else valid_part(study).protocol for study in (opened.study, self._sound))
        lost = now is None or (focus_of(now, path).block is None and focus_of(before, path).block is not None)
        study = opened.study if self._sound is None or not lost else self._sound
        valid = valid_part(study)
        protocol = valid.protocol
        self._focus = focus = focus_of(protocol, path)
        controls = self._controls(opened.study, protocol, focus)
        if protocol is not None:
            measured = self._is_looked_at and (valid.forces or focus.plan is not None)
            self._request(simulation_of(protocol, focus if measured else Focus(), controls))
        else:
            self._request(None)
        if protocol is None or not needs_precision_check(protocol):
            self._set_warnings(())
        repairs = {row: self._repairs.get(row, ()) for row in problems}
        earlier = study is not opened.study
        view = measures_view(study, facts(study), path, controls, self._latest_answer(), repairs, earlier=earlier)
        self._place.measures.show_measures(view)
        self._place.pane.facts.show_measures(view)

    def leave(self) -> None:
        """End the process: it must not share the processor with a session."""
        self._idle.stop()
        self._request(None)
        self._close()

    @property
    def _is_looked_at(self) -> bool:
        pane = self._place.pane
        return pane.isVisible() and (pane.tab == "measures" or pane.facts.isVisible())

    def _forget_study(self) -> None:
        self._participants, self._lapses, self._sound = None, LAPSES, None
        self._thresholds, self._answers, self._repairs = {}, {}, {}
        self._idle.start()

    def _controls(self, study: Study, protocol: Protocol | None, focus: Focus) -> Controls:
        participants = participants_of(study) if self._participants is None else self._participants
        planned = planned_of(study)
        if focus.plan is None or focus.block is None:
            return Controls(participants=participants, lapses=self._lapses, planned=planned)
        asked = self._thresholds.get(focus.block.id)
        low, high = focus.plan.stimulus.levels
        threshold = asked if asked is not None and low <= asked <= high else threshold_of(focus.plan)
        return Controls(
            participants=participants,
            threshold=threshold,
            lapses=self._lapses,
            precision=precision_of(protocol),
            planned=planned,
        )

    # simulations

    @property
    def is_waiting(self) -> bool:
        return self.rest.isActive() or self._look.isActive()

    def _request(self, wanted: Simulation | None) -> None:
        """Request a simulation; cancel one for another element or version."""
        if wanted == self._wanted:
            return
        self._wanted, self._failed = wanted, ""
        self.rest.stop()
        if self._look.isActive():
            self._look.stop()
            if self._client is not None:
                self._client.stop()
        if wanted is not None and wanted in self._answers:
            self._set_warnings(self._answers[wanted].warnings)
        elif wanted is not None:
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
            self._look.stop()
            if isinstance(answer, Simulated):
                self._answers[wanted] = answer
                self._set_warnings(answer.warnings)
                self._idle.start()
            elif isinstance(answer, Crashed) or not answer.stopped:
                self._show_failure(answer.sentence)

    def _show_failure(self, sentence: str) -> None:
        log.info("simulations failed: %s", sentence)
        self._failed = f"{capitalised(sentence)}."
        self._idle.start()

    def _set_warnings(self, warnings: tuple[str, ...]) -> None:
        if warnings != self.warnings:
            self.warnings = warnings
            self.warned.emit()

    def _latest_answer(self) -> Simulated:
        """Return the current simulation's answer; until it is complete, the last answer of the same block."""
        wanted = self._wanted
        if wanted is None:
            return Simulated()
        if (known := self._answers.get(wanted)) is not None:
            return known
        if self._failed:
            return Simulated(warnings=self.warnings, failed=self._failed)
        of_block = (answer for key, answer in reversed(self._answers.items()) if key.block == wanted.block)
        return replace(next(of_block, Simulated()), warnings=self.warnings, waiting=_ANEW)

    def _close(self) -> None:
        self.rest.stop()
        self._look.stop()
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def _keep_repairs(self, row: ProblemRow, sentences: tuple[str, ...]) -> None:
        self._repairs[row] = sentences
        self._idle.start()

    def _take_participants(self, number: float) -> None:
        if (opened := self._editing.opened) is not None:
            asked = min(_MOST_PARTICIPANTS, max(2, round(number)))
            self._participants = None if asked == participants_of(opened.study) else asked
            self.show_measures()

    def _take_threshold(self, number: float) -> None:
        if self._focus.plan is not None and self._focus.block is not None:
            wording = LevelWords(self._focus.plan.stimulus, self._focus.plan.design)
            low, high = self._focus.plan.stimulus.levels
            self._thresholds[self._focus.block.id] = min(high, max(low, number / wording.factor))
            self.show_measures()

    def _take_lapses(self, number: float) -> None:
        self._lapses = min(0.2, max(0.0, number / 100))
        self.show_measures()
