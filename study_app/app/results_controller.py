"""Results: where their place meets the process that reads and evaluates studies.

The process lives while the place is shown; reports and tables are written by one of their own. Nothing here waits.
"""

import importlib.util
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias

from PySide6.QtCore import QObject, QTimer

from study_app.analysis.worker_messages import (
    AnalysisClient,
    Answer,
    Done,
    FigureDrawn,
    FindStudies,
    LeaveOut,
    OpenKey,
    Order,
    Progress,
    ReadStudy,
    SessionsFound,
    StudiesFound,
    StudyFound,
    TakeBack,
    WriteReport,
    WriteTables,
    start_analysis_worker,
)
from study_app.gui.application import open_here
from study_app.gui.results.figures import ResultsView, Trouble, unblinded_words
from study_app.gui.results.view import ResultsPlace
from study_app.gui.sessions.session_facts import session_facts
from study_app.gui.watch.window import watch
from study_app.store.folders import StudyFolder
from study_app.store.sites.merged import FOLDER, folders_of
from study_app.workers.server import Crashed, Refused


def exclusions_at(study: Path) -> Path:
    """Return the list of exclusions; of a merged study the folder of its sites, each of which has one."""
    folders = folders_of(study)
    return StudyFolder(study).exclusions if "" in folders else study / FOLDER


LISTEN_MS: Final = 40
PATIENCE_S: Final = 0.3
"""What takes longer than this says that it goes on."""
NO_SAV: Final = "Files for SPSS need the package pyreadstat: pip install 'liquid-study[analysis]'"
MISTAKE: Final = Trouble(
    "A bug in the program stopped the evaluation", "The terminal shows the details.", "Refresh", "again"
)

Decided: TypeAlias = LeaveOut | TakeBack | OpenKey
REFUSALS: Final = {
    LeaveOut: "It was not excluded",
    TakeBack: "It is still excluded",
    OpenKey: "The study is still blinded",
}


class ResultsController(QObject):
    """Gives the place of results what it shows, and carries out what is asked for there.

    Parameters
    ----------
    results : folder that holds the studies' folders; it need not exist
    """

    def __init__(
        self,
        results: Path,
        *,
        opener: Callable[[Path], object] = open_here,
        start_worker: Callable[[], AnalysisClient] = start_analysis_worker,
    ) -> None:
        super().__init__()
        self._start_worker = start_worker
        self.results = results
        no_sav = "" if importlib.util.find_spec("pyreadstat") else NO_SAV
        self.place = ResultsPlace(handed_to=results.resolve().parent, no_sav=no_sav)
        self.view = ResultsView()
        self._opener = opener
        self.reader: AnalysisClient | None = None
        self._writer: AnalysisClient | None = None
        self._orders: dict[int, Order] = {}
        self._since_s = 0.0
        self._going: Progress | None = None
        self._redrawn: set[str] = set()
        self._blocks = 0
        self._listening = QTimer(self, interval=LISTEN_MS)
        self._listening.timeout.connect(self._listen)
        self._connect()

    def _connect(self) -> None:
        place = self.place
        place.entered.connect(self.look)
        place.left.connect(self.close)
        place.study_asked.connect(self._choose)
        place.remedy_asked.connect(self._mend)
        place.leave_out_asked.connect(lambda asked: self._decide("leaving out", LeaveOut, *asked))
        place.take_back_asked.connect(lambda asked: self._decide("taking the exclusion back", TakeBack, *asked))
        place.unblind_asked.connect(lambda by, reason: self._decide("opening the key", OpenKey, by, reason))
        place.tables_asked.connect(lambda to, extras: self._write(WriteTables, to, extras))
        place.report_asked.connect(lambda to, _extras: self._write(WriteReport, to))
        place.stop_asked.connect(self._stop_writing)
        place.open_asked.connect(self._opener)
        place.watch_asked.connect(watch)

    @property
    def busy(self) -> bool:
        """Whether something was asked for and has not come to its end."""
        return bool(self._orders) or self._writer is not None

    def show_results(self, results: Path) -> None:
        self.results = results
        self.view = ResultsView()
        self.place.hand_to(results.resolve().parent)
        if self.reader is not None:
            self.look()

    def look(self) -> None:
        """Look which studies there are, and read the chosen one again."""
        self._ask(FindStudies(self.results), "looking for studies")

    def choose(self, folder: Path) -> None:
        """Show this study when the place is entered next."""
        self.view = ResultsView(studies=self.view.studies, chosen=folder)

    def close(self) -> None:
        self._listening.stop()
        for process in (self.reader, self._writer):
            if process is not None:
                process.close()
        self.reader = self._writer = None
        self._orders = {}
        if self.place.writing is not None:
            self.place.writing.stopped()
        self._show(drawing=None, testing=None)

    def _ask(self, order: Order, what: str) -> None:
        if self.reader is None or not self.reader.works:
            if self.reader is not None:
                self.reader.close()
            self.reader = self._start_worker()
            self._orders = {}
        self._orders[self.reader.order(order)] = order
        self._since_s = time.monotonic()
        self._going = Progress(what, 0.0)
        self._listening.start()

    def _listen(self) -> None:
        """Take the answers to the last request; say what goes on where that takes long."""
        if self.reader is not None and self._orders:
            for number, answer in self.reader.answers():
                self._take(number, answer)
            if self._orders and time.monotonic() - self._since_s > PATIENCE_S:
                if self._blocks and len(self._redrawn) >= self._blocks:
                    self._show(testing=self._going, drawing=None)
                else:
                    self._show(drawing=self._going, testing=None)
        self._listen_to_writer()
        if not self.busy:
            self._listening.stop()

    def _take(self, number: int, answer: Answer | Refused | Crashed) -> None:
        order = self._orders.get(number)
        if order is None:
            return
        newest = number == max(self._orders)
        match answer:
            case Done():
                del self._orders[number]
                if isinstance(order, OpenKey) and answer.warnings:
                    self.place.message.emit("Some tables were not updated", "\n".join(answer.warnings))
                self._end(order, newest=newest)
            case Refused():
                del self._orders[number]
                if newest or isinstance(order, Decided):
                    self._refused(order, answer)
            case Crashed():
                self._orders = {}
                self._show(trouble=MISTAKE, figures=(), drawing=None, testing=None)
            case Progress() if newest:
                self._going = answer
            case StudiesFound() if newest:
                self._take_studies(answer)
            case SessionsFound() if newest:
                self._take_sessions(answer)
            case StudyFound() if newest:
                self._blocks = answer.blocks
                nothing = Trouble("No figures", "This study has no questionnaire.", "Refresh", "again")
                self._show(
                    trials=answer.trials,
                    doubts=answer.doubts,
                    colours=answer.colours,
                    trouble=None if answer.blocks else nothing,
                )
            case FigureDrawn() if newest:
                self._redrawn.add(answer.name)
                there = [figure.name for figure in self.view.figures]
                figures = [answer if figure.name == answer.name else figure for figure in self.view.figures]
                self._show(figures=tuple(figures if answer.name in there else [*figures, answer]))

    def _take_studies(self, found: StudiesFound) -> None:
        there = [one.folder for one in found.studies]
        chosen = self.view.chosen if self.view.chosen in there else None
        if chosen is None and there:
            chosen = max(found.studies, key=lambda one: one.newest_s).folder
        if chosen is None:
            sentence = f"The first session of a study creates its folder in {self.results}."
            self.view = ResultsView(trouble=Trouble("No studies yet", sentence, "Go to Home", "home"))
            self.place.show_view(self.view)
            return
        self._show(studies=found.studies)
        self._read(chosen)

    def _choose(self, folder: Path) -> None:
        if folder != self.view.chosen:
            self._read(folder)

    def _read(self, folder: Path) -> None:
        """Read a study; what is shown of it stays until it is known anew."""
        if folder != self.view.chosen:
            self.view = ResultsView(studies=self.view.studies, chosen=folder)
            self._blocks = 0
        self._redrawn = set()
        self._show(trouble=None, untested=False, listed=False)
        self._ask(ReadStudy(folder), f"reading {folder.name}")

    def _take_sessions(self, found: SessionsFound) -> None:
        facts = session_facts(found.folder, found.rows, found.exclusions, {})
        facts.sort(key=lambda one: (not one.needs_care, one.participant, one.session))
        reveal = found.reveal
        self._show(
            sessions=tuple(facts),
            listed=True,
            left_out=found.exclusions,
            exclusions_file=exclusions_at(found.folder),
            sealed=reveal is None,
            opened="" if reveal is None else unblinded_words(reveal),
        )

    def _end(self, order: Order, *, newest: bool) -> None:
        if isinstance(order, Decided):
            self._read(order.folder)
        elif isinstance(order, ReadStudy) and newest:
            kept = tuple(figure for figure in self.view.figures if figure.name in self._redrawn)
            self._show(figures=kept, drawing=None, testing=None)

    def _refused(self, order: Order, refused: Refused) -> None:
        sentence = f"{refused.sentence}."
        if isinstance(order, Decided):
            self.place.message.emit(REFUSALS[type(order)], sentence)
            self._read(order.folder)  # it may have changed meanwhile, and what was being read was given up
        elif refused.stopped:
            all_drawn = self._blocks and len(self._redrawn) >= self._blocks
            trouble = None if all_drawn else Trouble("Stopped", "There are no figures yet.", "Go on", "read")
            self._show(untested=bool(all_drawn), trouble=trouble, drawing=None, testing=None)
        elif isinstance(order, FindStudies):
            trouble = Trouble("The results folder cannot be read", sentence, "Refresh", "again")
            self.view = ResultsView(trouble=trouble)
            self.place.show_view(self.view)
        elif refused.lacks_extra:
            sentence = sentence.replace("this needs", "Figures need")
            trouble = Trouble("Your data are complete", sentence, "Refresh", "again")
            self._show(trouble=trouble, figures=(), drawing=None, testing=None)
        elif self.view.listed and not self.view.sessions:
            sentence = "Results appear after the first session has started."
            trouble = Trouble("No sessions yet", sentence, "Go to Home", "home")
            self._show(trouble=trouble, figures=(), drawing=None, testing=None)
        else:
            trouble = Trouble("The study cannot be read", sentence, "Refresh", "again")
            self._show(trouble=trouble, figures=(), drawing=None, testing=None)

    def _show(self, **changes: Any) -> None:
        view = replace(self.view, **changes)
        if view != self.view:
            self.view = view
            self.place.show_view(view)

    def _mend(self, remedy: str) -> None:
        if remedy == "stop":
            if self.reader is not None:
                self.reader.stop()
        elif remedy == "read" and self.view.chosen is not None:
            self._read(self.view.chosen)
        else:
            self._show(trouble=None)
            self.look()

    def _decide(self, what: str, order: Callable[..., Decided], *details: Any) -> None:
        if self.view.chosen is not None:
            self._ask(order(self.view.chosen, *details), what)

    def _write(self, make: Callable[..., WriteTables | WriteReport], *details: Any) -> None:
        if self.view.chosen is not None:
            order = make(self.view.chosen, *details)
            self._writer = self._start_worker()
            self._writer.order(order)
            self._opens = partial(_what_to_open, order)
            self._listening.start()

    def _stop_writing(self) -> None:
        if self._writer is not None:
            self._writer.stop()

    def _listen_to_writer(self) -> None:
        """Pass on how far it is; where it has come to its end, end the process."""
        dialog = self.place.writing
        if self._writer is None:
            return
        last: Done | Refused | None = None
        for _, answer in self._writer.answers():
            if isinstance(answer, Progress) and dialog is not None:
                dialog.show_progress(f"{answer.what[:1].upper()}{answer.what[1:]} …", answer.share)
            elif isinstance(answer, (Done, Refused)):
                last = answer
            elif isinstance(answer, Crashed):
                last = Refused(f"a bug ended the process that writes the files: {answer.sentence}")
        if last is None:
            return
        self._writer.close()
        self._writer = None
        if dialog is None:
            return
        if isinstance(last, Done):
            dialog.show_written(last.files, self._opens(last.files), last.warnings)
        elif last.stopped:
            dialog.stopped()
        else:
            dialog.show_refused(f"{last.sentence}.")


def _what_to_open(order: WriteTables | WriteReport, files: tuple[Path, ...]) -> Path:
    return files[0] if isinstance(order, WriteReport) else order.to
