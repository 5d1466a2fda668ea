"""The tab Measures: instant numbers once the window is idle after an edit, slow ones when the keyboard rests."""

from dataclasses import replace
from typing import Any, Final

from PySide6.QtCore import QObject, QTimer, Signal

from study_app.app.designer.editing import Editing
from study_app.app.designer.measures.measures_worker import Advising, Detecting, Grouping, Measuring, Observing, Wanted
from study_app.app.designer.measures.page_fit import PageFit
from study_app.app.designer.measures.slow_numbers import SlowNumbers
from study_app.app.designer.measures.wanted import (
    LAPSES,
    measuring,
    participants_of,
    planned_of,
    precision_of,
    threshold_of,
    wanted_of,
)
from study_app.app.designer.repair_search import RepairSearch
from study_app.authoring.edited_study import Study
from study_app.authoring.kept_settings import keep_setting, kept_participants
from study_app.authoring.measures.observers import Measurable, Observed
from study_app.authoring.measures.planned import Detectable, GroupPrecision
from study_app.authoring.measures.valid_part import valid_part
from study_app.authoring.study_facts import facts
from study_app.gui.designer.view import DesignerPlace
from study_app.protocol.checks.expected_precision import threshold_plan
from study_app.protocol.model import Protocol
from study_app.protocol.source.document import Path
from study_app.viewmodels.designer.measures.level_plots import Simulated
from study_app.viewmodels.designer.measures.level_words import LevelWords
from study_app.viewmodels.designer.measures.measures_view import Controls, Focus, SlowResults, focus_of, measures_view
from study_app.viewmodels.designer.measures.number_cards import ANEW
from study_app.viewmodels.designer.problem_rows import ProblemRow, problem_rows

IDLE_MS: Final = 20
MOST_PARTICIPANTS: Final = 500
NAMES: Final[dict[type, str]] = {Observing: "observed", Grouping: "group", Measuring: "measurable",
                                 Detecting: "detectable", Advising: "warnings"}  # fmt: skip


class MeasuresController(QObject):
    """Shows what the open study can find.

    Parameters
    ----------
    editing : Editing
        The open study.
    place : DesignerPlace
        Where it is shown.
    repairs : RepairSearch
        Finds the repairs of problems.

    ``warned`` is emitted when the warnings of ``check`` that take simulated observers are others.
    """

    warned = Signal()

    def __init__(self, editing: Editing, place: DesignerPlace, repairs: RepairSearch) -> None:
        super().__init__(editing)
        self.warnings: tuple[str, ...] = ()
        self._editing, self._place = editing, place
        self.slow = SlowNumbers(self)
        self.fit = PageFit(self)
        self._sound: Study | None = None
        self._participants: int | None = None
        self._thresholds: dict[str, float] = {}
        self._lapses = LAPSES
        self._focus = Focus()
        self._repairs: dict[ProblemRow, tuple[str, ...]] = {}
        self._last: dict[tuple[str, str], Any] = {}
        self._idle = QTimer(self)
        self._idle.setSingleShot(True)
        self._idle.setInterval(IDLE_MS)
        self._idle.timeout.connect(self.show)
        editing.opened_other.connect(self._forget)
        editing.changed.connect(self._idle.start)
        repairs.found.connect(self._take_repairs)
        self.slow.came.connect(self._idle.start)
        self.fit.found.connect(self._idle.start)
        place.pane.tab_shown.connect(self._idle.start)
        place.entered.connect(self._idle.start)
        place.left.connect(self.leave)
        place.pane.facts.appeared.connect(self._idle.start)
        measures = place.measures
        measures.repair_asked.connect(place.repair_asked)
        measures.controls.participants_asked.connect(self._take_participants)
        measures.controls.threshold_asked.connect(self._take_threshold)
        measures.controls.lapses_asked.connect(self._take_lapses)
        for part in (measures, place.pane.facts):
            part.open_asked.connect(editing.select)

    def show(self) -> None:
        """Show the numbers of the study as it is now, and order those that are not known."""
        opened = self._editing.opened
        if opened is None or not self._place.isVisible():
            self.slow.want(())
            return
        path, problems = opened.history.selected, problem_rows(opened.study)
        study = self._measured(opened.study, path)
        valid = valid_part(study)
        protocol = valid.protocol
        self._focus = focus = focus_of(protocol, path)
        controls = self._controls(opened.study, protocol, focus)
        wanted = () if protocol is None else wanted_of(protocol, focus, controls)
        wanted = tuple(one for one in wanted if valid.forces or not isinstance(one, Detecting))
        self.slow.want(wanted if self._is_looked_at else tuple(one for one in wanted if isinstance(one, Advising)))
        repairs = {row: self._repairs.get(row, ()) for row in problems}
        parts = self.fit.parts(protocol, focus, path) if self._is_looked_at else None
        ranges = {} if protocol is None else self._ranges(protocol)
        results = replace(self._results(wanted, focus, controls), parts=parts, ranges=ranges)
        view = measures_view(study, facts(study), path, controls, results, repairs)
        view = replace(view, earlier=study is not opened.study)
        if results.warnings != self.warnings:
            self.warnings = results.warnings
            self.warned.emit()
        self._place.measures.show_measures(view)
        self._place.pane.facts.show_measures(view)

    def _measured(self, study: Study, path: Path) -> Study:
        """Return the study to measure: the last one without faults where what an element is measured by is broken."""
        if study.formed is not None:
            self._sound = study
        now, before = (None if one is None else valid_part(one).protocol for one in (study, self._sound))
        lost = now is None or (focus_of(now, path).block is None and focus_of(before, path).block is not None)
        return study if self._sound is None or not lost else self._sound

    def leave(self) -> None:
        """End the process: a session that begins now must not share the processor with it."""
        self._idle.stop()
        self.slow.want(())
        self.slow.close()

    @property
    def _is_looked_at(self) -> bool:
        pane = self._place.pane
        return pane.isVisible() and (pane.tab == "measures" or pane.facts.isVisible())

    def _forget(self) -> None:
        opened = self._editing.opened
        kept = None if opened is None else kept_participants(opened.file)
        self._participants = None if kept is None else _permitted(kept)
        self._lapses, self._sound = LAPSES, None
        self._thresholds, self._last, self._repairs = {}, {}, {}
        self._idle.start()

    def _controls(self, study: Study, protocol: Protocol | None, focus: Focus) -> Controls:
        participants = participants_of(study) if self._participants is None else self._participants
        planned = planned_of(study)
        if focus.plan is None or focus.block is None:
            return Controls(participants, lapses=self._lapses, planned=planned)
        asked = self._thresholds.get(focus.block.id)
        low, high = focus.plan.stimulus.levels
        threshold = asked if asked is not None and low <= asked <= high else threshold_of(focus.plan)
        return Controls(participants, threshold, self._lapses, precision_of(protocol), planned)

    def _ranges(self, protocol: Protocol) -> dict[str, tuple[float, float] | None]:
        """Return the thresholds that blocks can measure, of those for which that was simulated."""
        found = {}
        for block in protocol.main_blocks:
            plan = threshold_plan(protocol, block)
            wanted = None if plan is None else measuring(protocol, plan, block, self._lapses)
            if wanted is not None and isinstance(known := self.slow.found(wanted), Measurable):
                found[block.id] = known.ends
        return found

    def _results(self, wanted: tuple[Wanted, ...], focus: Focus, controls: Controls) -> SlowResults:
        """Return what is known of what is wanted; where nothing is, what was known of the block before."""
        block = "" if focus.block is None else focus.block.id
        found: dict[str, Any] = {}
        progress, failed = {}, {}
        for one in wanted:
            name = NAMES[type(one)]
            if self.slow.known(one):
                found[name] = self._last[name, block] = self.slow.found(one)
            elif why := self.slow.failure(one):
                failed[name] = f"{why[:1].upper()}{why[1:]}."
            else:
                found[name] = self._last.get((name, block))
                counted = self.slow.progress(one)
                progress[name] = ANEW if counted is None else f"{counted[0]} of {counted[1]} simulated"
        observed, measured, group = (found.get(name) for name in ("observed", "measurable", "group"))
        detectable = found.get("detectable")
        return SlowResults(
            Simulated(
                observed if isinstance(observed, Observed) else None,
                measured if isinstance(measured, Measurable) else None,
                group if isinstance(group, GroupPrecision) else None,
                progress,
                failed,
                controls.threshold,
                controls.precision,
                controls.planned,
            ),
            detectable if isinstance(detectable, Detectable) else None,
            found.get("warnings") or (),
        )

    def _take_repairs(self, row: ProblemRow, words: tuple[str, ...]) -> None:
        self._repairs[row] = words
        self._idle.start()

    def _take_participants(self, number: float) -> None:
        """Simulate so many participants from now on, also when the study is opened again."""
        opened = self._editing.opened
        if opened is None:
            return
        asked = _permitted(number)
        self._participants = None if asked == participants_of(opened.study) else asked
        keep_setting(opened.file, "participants", self._participants)
        self.show()

    def _take_threshold(self, number: float) -> None:
        if self._focus.plan is not None and self._focus.block is not None:
            words = LevelWords(self._focus.plan.stimulus, self._focus.plan.design)
            low, high = self._focus.plan.stimulus.levels
            self._thresholds[self._focus.block.id] = min(high, max(low, number / words.factor))
            self.show()

    def _take_lapses(self, number: float) -> None:
        self._lapses = min(0.2, max(0.0, number / 100))
        self.show()


def _permitted(number: float) -> int:
    """Return the nearest number of participants that can be simulated."""
    return min(MOST_PARTICIPANTS, max(2, round(number)))
