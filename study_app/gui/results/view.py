"""The results page, and its requests to the process that evaluates studies."""

import importlib.util
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias

from PySide6.QtCore import QSignalBlocker, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QDialog, QWidget

from study_app.analysis.worker_messages import (
    AnalysisClient,
    Answer,
    Done,
    FigureDrawn,
    FindStudies,
    FirstPage,
    LeaveOut,
    OpenKey,
    Order,
    Progress,
    ProposedExclusions,
    ReadStudy,
    SessionsFound,
    StudiesFound,
    StudyFound,
    TakeBack,
    WriteReport,
    WriteTables,
    start_analysis_worker,
)
from study_app.gui.kit.opening import open_here
from study_app.gui.results.cards import ExclusionsCard, SessionsCard
from study_app.gui.results.dialogs import Extra, LeaveOutDialog, WriteDialog, take_back_question, unblind_question
from study_app.gui.results.figures import FiguresPanel, ResultsView, Trouble, kind_of, unblinding_text
from study_app.gui.sessions.session_facts import SessionFacts, session_facts
from study_app.gui.sessions.session_page import SessionPage
from study_app.gui.theme.theme import SHADOW, font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.accessible import plain_tip
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, Chip, scrolled
from study_app.gui.widgets.controls import ActionButton, Choice
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.main_view import Place
from study_app.protocol.participants import EACH_GROUP
from study_app.store.exclusions import Exclusion
from study_app.store.files import StudyFolder
from study_app.store.merged import FOLDER, folders_of
from study_app.workers.server import Crashed, Refused


def _exclusions_path(study: Path) -> Path:
    """Return the file of exclusions or, for a merged study, the folder of its sites, each of which has such a file."""
    folders = folders_of(study)
    return StudyFolder(study).exclusions if "" in folders else study / FOLDER


_STACKED_BELOW = 1160
PANEL_PX, PANEL_WIDE_PX, WIDE_FROM = 400, 430, 1700
STACKED_HEIGHT, EXCLUSIONS = 330, 360
_REASON_LETTERS = 40
_EXTRAS: Final = (
    Extra("wide", "Wide table: one row per participant"),
    Extra("parquet", "Every table also as Parquet"),
    Extra("sav", "Answers for SPSS, jamovi and JASP (.sav)"),
    Extra("psych-ds", "A Psych-DS folder with all tables, for sharing"),
)


_POLL_MS: Final = 40
PATIENCE_S: Final = 0.3
"""The time after which the progress of a request is shown."""
NO_SAV: Final = "Files for SPSS need the package pyreadstat: pip install 'liquid-study[analysis]'"
_BUG: Final = Trouble(
    title="A bug in the program stopped the evaluation",
    sentence="The terminal shows the details.",
    button="Refresh",
    remedy="again",
)
_NO_QUESTIONS: Final = Trouble(
    title="No figures", sentence="This study does not have a questionnaire.", button="Refresh", remedy="again"
)
_NONE_COMPLETE: Final = Trouble(
    title="No complete session to show",
    sentence="Figures appear once there is a complete, included session. Start or continue a session on Home.",
    button="Go to Home",
    remedy="home",
)
_HIDDEN: Final = "Conditions appear as codes. Tests, hypotheses and thresholds are hidden until you unblind the study."

_Decision: TypeAlias = LeaveOut | TakeBack | OpenKey
_REFUSALS: Final = {
    LeaveOut: "Nothing was excluded",
    TakeBack: "The exclusion still applies",
    OpenKey: "The study is still blinded",
}


class ResultsPlace(Place):
    """The results page; while it is shown, a process reads and evaluates the chosen study.

    Another process writes reports and tables, so that the page never waits. ``version_asked`` carries the
    `SessionFacts` of a session with whose version the study should be compared.

    Parameters
    ----------
    results : folder that contains the studies' folders; it need not exist
    """

    version_asked = Signal(object)

    def __init__(
        self,
        results: Path,
        *,
        opener: Callable[[Path], object] = open_here,
        start_worker: Callable[[], AnalysisClient] = start_analysis_worker,
    ) -> None:
        super().__init__()
        self.results = results
        self.view = ResultsView()
        self.dialog: QDialog | None = None
        self.writing: WriteDialog | None = None
        self._opener, self._start_worker = opener, start_worker
        self.reader: AnalysisClient | None = None
        self._writer: AnalysisClient | None = None
        self._orders: dict[int, Order] = {}
        self._sent_s = 0.0
        self._progress: Progress | None = None
        self._redrawn: set[tuple[str, str]] = set()
        self._blocks = 0
        self._listening = QTimer(self, interval=_POLL_MS)
        self._listening.timeout.connect(self._read_answers)
        self.study = Choice()
        self.study.setAccessibleName("Study")
        self.study.setFont(font("body"))
        self.study.setMinimumWidth(200)
        self.study.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToContents)
        self.chips: list[Chip] = []
        self.unblind = ActionButton("eye", "Unblind…", height=44)
        self.export = ActionButton("download", "Export…", height=44)
        self.report = ActionButton("file", "Report…", role="primary", height=44)
        self.sessions = SessionsCard()
        self.exclusions = ExclusionsCard()
        self.split = Choice()
        self.split.setAccessibleName("Groups")
        self.split.setFont(font("body"))
        self.figures = FiguresPanel()
        self._lay_out()
        self._connect()
        self._show_studies()
        self._show_groups()
        self.show_view(ResultsView())

    def _connect(self) -> None:
        self.study.activated.connect(lambda: self._choose_study(self.study.currentData()))
        self.unblind.clicked.connect(self._ask_unblind)
        self.export.clicked.connect(self._ask_tables)
        self.report.clicked.connect(self._ask_report)
        self.exclusions.leave_out.clicked.connect(lambda: self._ask_leave_out(None))
        self.exclusions.take_back_asked.connect(self._ask_take_back)
        self.exclusions.exclude_asked.connect(self._ask_leave_out)
        self.exclusions.open.clicked.connect(lambda: self._opener(self.view.exclusions_file or self.results))
        self.figures.asked.connect(self._apply_remedy)
        self.figures.failed.connect(lambda why: self.message.emit("The figure was not saved", why))
        self.figures.person_asked.connect(self._open_participant)
        self.split.activated.connect(lambda: self._update_view(split=self.split.currentData()))
        self.sessions.rows.opened.connect(self._open_session)
        self.sessions.rows.version_asked.connect(self.version_asked)

    def _lay_out(self) -> None:
        self._chip_box = QWidget()
        self._chips = hbox(spacing=8, margins=0, parent=self._chip_box)
        self._head = hbox(label("Results", "title"), self.study, STRETCH, spacing=12, margins=(SHADOW, 0, SHADOW, 0))
        add_parts(self._head, self.unblind, self.export, self.report)
        self._chip_row = hbox(margins=(SHADOW, 0, SHADOW, 0))
        self._left = QBoxLayout(QBoxLayout.Direction.TopToBottom)
        self._left.setSpacing(12 - 2 * SHADOW)
        add_parts(self._left, (self.sessions, 3), (self.exclusions, 1))
        self._panel = QWidget()
        self._panel.setLayout(self._left)
        self._left.setContentsMargins(0, 0, 0, 0)
        self._row = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._row.setSpacing(16 - 2 * SHADOW)
        self._groups = QWidget()
        hbox(label("Groups", "label"), self.split, spacing=8, margins=0, parent=self._groups)
        self.hidden = label(_HIDDEN, "label", "text2", wraps=True, weight=400)
        above = hbox(self._groups, (self.hidden, 1), spacing=16, margins=(SHADOW, 0, SHADOW, 4))
        above.setAlignment(self._groups, Qt.AlignmentFlag.AlignLeft)
        add_parts(self._row, self._panel, (vbox(above, (self.figures, 1), spacing=0, margins=0), 1))
        inside = QWidget()
        vbox(self._head, self._chip_row, (self._row, 1), spacing=12, margins=(24, 20, 24, 18), parent=inside)
        self.area = scrolled(inside)
        vbox(self.area, margins=0, parent=self)

    def enter(self) -> None:
        self.read_studies()

    def leave(self) -> None:
        self._listening.stop()
        for process in (self.reader, self._writer):
            if process is not None:
                process.close()
        self.reader = self._writer = None
        self._orders = {}
        if self.writing is not None:
            self.writing.close_stopped()
        self._update_view(drawing=None, testing=None)

    def show_view(self, view: ResultsView) -> None:
        """Show a view; only changed parts are updated."""
        previous, self.view = self.view, view
        if view.studies != previous.studies or view.chosen != previous.chosen:
            self._show_studies()
        if (view.sessions, view.without_sessions) != (previous.sessions, previous.without_sessions):
            self.sessions.show_sessions(view.sessions, view.without_sessions)
        if (view.left_out, view.proposed, view.rules) != (previous.left_out, previous.proposed, previous.rules):
            self.exclusions.show_left_out(view.left_out, view.proposed, view.rules)
        if view.groups != previous.groups:
            self._show_groups()
        self.hidden.setVisible(view.sealed is True and bool(view.figures))
        self._show_chips()
        self.unblind.setVisible(view.sealed is True)
        for button in (self.unblind, self.export, self.report):
            button.setEnabled(view.can_be_written)
        if unblinding := any(isinstance(order, OpenKey) for order in self._orders.values()):
            self.unblind.setEnabled(False)
        self.unblind.show_action("eye", "Unblinding…" if unblinding else "Unblind…")
        self.exclusions.leave_out.setEnabled(any(session.excluded is None for session in view.sessions))
        self._panel.setVisible(view.chosen is not None)
        self.figures.show_view(view)

    def _show_studies(self) -> None:
        with QSignalBlocker(self.study):
            self.study.clear()
            for study in self.view.studies:
                kind = kind_of(study)
                self.study.addItem(f"{study.folder.name}  ·  {kind}" if kind else study.folder.name, study.folder)
            places = [study.folder for study in self.view.studies]
            self.study.setCurrentIndex(places.index(self.view.chosen) if self.view.chosen in places else -1)
        self.study.setVisible(bool(self.view.studies))
        self.study.updateGeometry()

    def _show_groups(self) -> None:
        self.split.clear()
        self.split.addItem("All together", "")
        self.split.addItem("Side by side", EACH_GROUP)
        for group in self.view.groups:
            self.split.addItem(f"Only {group}", group)
        self.split.setCurrentIndex(self.split.findData(self.view.split))
        self._groups.setVisible(bool(self.view.groups))

    def _show_chips(self) -> None:
        chips = []
        if self.view.kind == "simulated":
            chips.append(("warn", "info", "Simulated participants", ""))
        if self.view.kind == "pilot":
            chips.append(("warn", "info", "Pilot", "Pilot sessions, stored separately"))
        if self.view.sealed:
            chips.append(("neutral", "lock", "Blinded", "The condition names are sealed"))
        if self.view.opened:
            opened, most = self.view.opened, 2 * _REASON_LETTERS
            text = opened if len(opened) <= most else f"{opened[: most - 1].rstrip()}…"
            chips.append(("neutral", "eye", text, opened))
        if self.view.doubts:
            text = "1 file differs" if len(self.view.doubts) == 1 else f"{len(self.view.doubts)} files differ"
            chips.append(("warn", "warning", f"{text} from the record", "\n".join(self.view.doubts)))
        if [chip.word for chip in self.chips] != [text for _, _, text, _ in chips]:
            for chip in self.chips:
                remove_widget(chip)
            self.chips = []
            for tone, icon, text, tip in chips:
                chip = Chip(tone, icon, text)  # type: ignore[arg-type]  # the tones above
                chip.setToolTip(plain_tip(tip))
                self._chips.addWidget(chip)
                self.chips.append(chip)
            self._arrange()

    def _ask_unblind(self) -> None:
        running = sum(session.needs_care for session in self.view.sessions)
        dialog = unblind_question(self, self.theme, self._study_name(), running)
        decide = partial(self._order_decision, "unblinding the study", OpenKey)
        dialog.accepted.connect(lambda: decide(by=dialog.value("by"), reason=dialog.value("reason")))
        self._open_dialog(dialog)

    def _open_session(self, session: SessionFacts) -> None:
        self._open_dialog(SessionPage(self, self.theme, session, self._opener))

    def _open_participant(self, participant: str) -> None:
        """Open a participant's first session, preferably one that is in the figures."""
        sessions = [session for session in self.view.sessions if session.participant == participant]
        if sessions:
            self._open_session(min(sessions, key=lambda session: (not session.is_counted, session.session)))

    def _ask_leave_out(self, proposed: Exclusion | None) -> None:
        included = [session for session in self.view.sessions if session.excluded is None]
        dialog = LeaveOutDialog(self, self.theme, included, self.view.trials, self.sessions.rows.chosen, proposed)
        decide = partial(self._order_decision, "excluding data", LeaveOut)

        def leave_out() -> None:
            participant, session, trial = dialog.chosen
            details = {"by": dialog.value("by"), "reason": dialog.value("reason"), "rule": dialog.rule}
            decide(participant=participant, session=session, trial=trial, **details)

        dialog.accepted.connect(leave_out)
        self._open_dialog(dialog)

    def _ask_take_back(self, exclusion: Exclusion) -> None:
        dialog = take_back_question(self, self.theme, exclusion)
        subject = {"participant": exclusion.participant, "session": exclusion.session, "trial": exclusion.trial}
        subject |= {"rule": exclusion.rule_or_person} if not exclusion.excluded_at else {}
        decide = partial(self._order_decision, "reversing the exclusion", TakeBack, **subject)
        dialog.accepted.connect(lambda: decide(by=dialog.value("by"), reason=dialog.value("reason")))
        self._open_dialog(dialog)

    def _ask_tables(self) -> None:
        no_sav = "" if importlib.util.find_spec("pyreadstat") else NO_SAV
        extras = [extra._replace(why_not=no_sav) if extra.name == "sav" else extra for extra in _EXTRAS]
        dialog = WriteDialog(
            self,
            self.theme,
            f"Export {self._study_name()}",
            "All participants' answers, trials and counts as CSV files, with a codebook that explains every "
            f"column.{self._code_note()}",
            go_on="Export",
            to=self.results.resolve().parent / f"{self._study_name()}-tables",
            extras=extras,
        )
        dialog.begun.connect(lambda: self._start_writing(WriteTables, *dialog.asked))
        self._open_writing(dialog)

    def _ask_report(self) -> None:
        dialog = WriteDialog(
            self,
            self.theme,
            f"Report of {self._study_name()}",
            "A page with figures, tests and conclusions; every number, table and figure is also saved as a file. This "
            f"takes a few minutes for a large study.{self._code_note()}",
            go_on="Write the report",
            to=self.results.resolve().parent / f"{self._study_name()}-report",
            opens_file=True,
        )
        dialog.begun.connect(lambda: self._start_writing(WriteReport, dialog.asked[0]))
        self._open_writing(dialog)

    def _open_writing(self, dialog: WriteDialog) -> None:
        self.writing = dialog
        dialog.stop_asked.connect(self._stop_writing)
        dialog.opened.connect(lambda: self._opener(dialog.result_path or self.results))
        dialog.finished.connect(self._forget_writing)
        self._open_dialog(dialog)

    def _forget_writing(self) -> None:
        self.writing = None

    def _open_dialog(self, dialog: QDialog) -> None:
        self.dialog = dialog
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _code_note(self) -> str:
        return " Conditions appear as codes because the study is blinded." if self.view.sealed else ""

    def _study_name(self) -> str:
        return "" if self.view.chosen is None else self.view.chosen.name

    @property
    def is_busy(self) -> bool:
        """Whether a request is running."""
        return bool(self._orders) or self._writer is not None

    def show_results(self, results: Path) -> None:
        self.results = results
        self.show_view(ResultsView())
        if self.reader is not None:
            self.read_studies()

    def read_studies(self) -> None:
        """Read the list of studies and the chosen study again."""
        self._send_order(FindStudies(self.results), "looking for studies")

    def choose_study(self, folder: Path) -> None:
        """Select a study, which is read when the page is entered."""
        self.show_view(ResultsView(studies=self.view.studies, chosen=folder))

    def _send_order(self, order: Order, activity: str) -> None:
        if self.reader is None or not self.reader.works:
            if self.reader is not None:
                self.reader.close()
            self.reader = self._start_worker()
            self._orders = {}
        self._orders[self.reader.order(order)] = order
        self._sent_s = time.perf_counter()
        self._progress = Progress(activity, 0.0, stops=not isinstance(order, _Decision))
        self._listening.start()

    def _read_answers(self) -> None:
        """Read the answers to the requests; show the progress if they take long."""
        if self.reader is not None and self._orders:
            for number, answer in self.reader.answers():
                self._handle_answer(number, answer)
            if self._orders and time.perf_counter() - self._sent_s > PATIENCE_S:
                if self._blocks and len(self._redrawn) >= self._blocks:
                    self._update_view(testing=self._progress, drawing=None)
                else:
                    self._update_view(drawing=self._progress, testing=None)
        self._read_writer_answers()
        if not self.is_busy:
            self._listening.stop()

    def _handle_answer(self, number: int, answer: Answer | Refused | Crashed) -> None:
        order = self._orders.get(number)
        if order is None:
            return
        newest = number == max(self._orders)
        match answer:
            case Done():
                del self._orders[number]
                if isinstance(order, OpenKey) and answer.warnings:
                    self.message.emit("Some tables were not updated", "\n".join(answer.warnings))
                self._finish_order(order, newest=newest)
            case Refused():
                del self._orders[number]
                if newest or isinstance(order, _Decision):
                    self._show_refusal(order, answer)
            case Crashed():
                self._orders = {}
                self._update_view(trouble=_BUG, figures=(), drawing=None, testing=None)
            case Progress() if newest:
                self._progress = answer
            case StudiesFound() if newest:
                self._show_found_studies(answer)
            case SessionsFound() if newest:
                self._show_found_sessions(answer)
            case ProposedExclusions() if newest:
                self._update_view(proposed=answer.exclusions, rules=answer.rules)
            case StudyFound() if newest:
                self._blocks = answer.blocks
                trouble = None if answer.n else _NONE_COMPLETE
                self._update_view(
                    trials=answer.trials,
                    doubts=answer.doubts,
                    colours=answer.colours,
                    trouble=trouble if answer.blocks else _NO_QUESTIONS,
                    groups=answer.groups,
                    split=self.view.split if self.view.split in (EACH_GROUP, *answer.groups) and answer.groups else "",
                )
            case FirstPage() if newest:
                places = {name: place for place, name in enumerate(answer.names)}
                figures = sorted(self.view.figures, key=lambda figure: places.get(figure.name, len(places)))
                self._update_view(figures=tuple(figures))
            case FigureDrawn() if newest:
                self._redrawn.add(answer.key)
                keys = [figure.key for figure in self.view.figures]
                figures = [answer if figure.key == answer.key else figure for figure in self.view.figures]
                self._update_view(figures=tuple(figures if answer.key in keys else [*figures, answer]))

    def _show_found_studies(self, answer: StudiesFound) -> None:
        folders = [study.folder for study in answer.studies]
        chosen = self.view.chosen if self.view.chosen in folders else None
        if chosen is None and folders:
            chosen = max(answer.studies, key=lambda study: study.newest_s).folder
        if chosen is None:
            sentence = f"A study's folder is created in {self.results} when its first session starts."
            self.show_view(
                ResultsView(
                    trouble=Trouble(title="No studies yet", sentence=sentence, button="Go to Home", remedy="home")
                )
            )
            return
        self._update_view(studies=answer.studies)
        self._read_study(chosen)

    def _choose_study(self, folder: Path) -> None:
        if folder != self.view.chosen:
            self._read_study(folder)

    def _read_study(self, folder: Path) -> None:
        """Read a study; its current view stays visible until then."""
        if folder != self.view.chosen:
            self.show_view(ResultsView(studies=self.view.studies, chosen=folder))
            self._blocks = 0
        self._redrawn = set()
        self._update_view(trouble=None, untested=False, listed=False)
        self._send_order(ReadStudy(folder), f"reading {folder.name}")

    def _show_found_sessions(self, answer: SessionsFound) -> None:
        facts = session_facts(answer.folder, answer.rows, answer.exclusions, {})
        facts.sort(key=lambda session: (not session.needs_care, session.participant, session.session))
        reveal = answer.reveal
        figures = () if self.view.sealed and reveal is not None else self.view.figures  # the old figures show codes
        self._update_view(
            figures=figures,
            sessions=tuple(facts),
            listed=True,
            left_out=answer.exclusions,
            proposed=(),
            rules=(),
            exclusions_file=_exclusions_path(answer.folder),
            sealed=reveal is None,
            opened="" if reveal is None else unblinding_text(reveal),
        )

    def _finish_order(self, order: Order, *, newest: bool) -> None:
        if isinstance(order, _Decision):
            self._read_study(order.folder)
        elif isinstance(order, ReadStudy) and newest:
            kept = tuple(figure for figure in self.view.figures if figure.key in self._redrawn)
            self._update_view(figures=kept, drawing=None, testing=None)

    def _show_refusal(self, order: Order, refused: Refused) -> None:
        sentence = f"{refused.sentence}."
        if isinstance(order, _Decision):
            self.message.emit(_REFUSALS[type(order)], sentence)
            self._read_study(order.folder)  # it may have changed, and the request cancelled its reading
        elif refused.stopped:
            all_drawn = self._blocks and len(self._redrawn) >= self._blocks
            trouble = (
                None
                if all_drawn
                else Trouble(title="Stopped", sentence="There are no figures yet.", button="Go on", remedy="read")
            )
            self._update_view(untested=bool(all_drawn), trouble=trouble, drawing=None, testing=None)
        elif isinstance(order, FindStudies):
            trouble = Trouble(
                title="The results folder cannot be read", sentence=sentence, button="Refresh", remedy="again"
            )
            self.show_view(ResultsView(trouble=trouble))
        elif refused.lacks_extra:
            sentence = sentence.replace("this needs", "Figures need")
            trouble = Trouble(title="Your data are complete", sentence=sentence, button="Refresh", remedy="again")
            self._update_view(trouble=trouble, figures=(), drawing=None, testing=None)
        elif self.view.listed and not self.view.sessions:
            sentence = "Results will appear once the first session has started."
            trouble = Trouble(title="No sessions yet", sentence=sentence, button="Go to Home", remedy="home")
            self._update_view(trouble=trouble, figures=(), drawing=None, testing=None)
        else:
            trouble = Trouble(title="The study cannot be read", sentence=sentence, button="Refresh", remedy="again")
            self._update_view(trouble=trouble, figures=(), drawing=None, testing=None)

    def _update_view(self, **changes: Any) -> None:
        view = replace(self.view, **changes)
        if view != self.view:
            self.show_view(view)

    def _apply_remedy(self, remedy: str) -> None:
        if remedy == "home":
            self.go_asked.emit("home")
        elif remedy == "stop":
            if self.reader is not None:
                self.reader.stop()
        elif remedy == "read" and self.view.chosen is not None:
            self._read_study(self.view.chosen)
        else:
            self._update_view(trouble=None)
            self.read_studies()

    def _order_decision(self, activity: str, order: Callable[..., _Decision], **details: Any) -> None:
        if self.view.chosen is not None:
            self._send_order(order(folder=self.view.chosen, **details), activity)
            self.show_view(self.view)

    def _start_writing(self, make_order: Callable[..., WriteTables | WriteReport], *details: Any) -> None:
        if self.view.chosen is not None:
            self._writer = self._start_worker()
            self._writer.order(make_order(self.view.chosen, *details))
            self._listening.start()

    def _stop_writing(self) -> None:
        if self._writer is not None:
            self._writer.stop()

    def _read_writer_answers(self) -> None:
        """Show the progress of the writing process, and end it after its last answer."""
        dialog = self.writing
        if self._writer is None:
            return
        last: Done | Refused | None = None
        for _, answer in self._writer.answers():
            if isinstance(answer, Progress) and dialog is not None:
                dialog.show_progress(f"{answer.what[:1].upper()}{answer.what[1:]}…", answer.share)
            elif isinstance(answer, (Done, Refused)):
                last = answer
            elif isinstance(answer, Crashed):
                last = Refused(f"a bug stopped the process that writes the files: {answer.sentence}")
        if last is None:
            return
        self._writer.close()
        self._writer = None
        if dialog is None:
            return
        if isinstance(last, Done):
            dialog.show_written(last.files, last.warnings)
        elif last.stopped:
            dialog.close_stopped()
        else:
            dialog.show_refused(f"{last.sentence}.")

    def _arrange(self) -> None:
        """Place the figures below the sessions in a narrow window, and the chips below the heading if necessary."""
        stacked = self.width() < _STACKED_BELOW
        down, right = QBoxLayout.Direction.TopToBottom, QBoxLayout.Direction.LeftToRight
        self._row.setDirection(down if stacked else right)
        self._left.setDirection(right if stacked else down)
        width = PANEL_WIDE_PX if self.width() >= WIDE_FROM else PANEL_PX
        minimum, maximum = QSize(0, STACKED_HEIGHT), QSize(QWIDGETSIZE_MAX, STACKED_HEIGHT)
        self._panel.setMinimumSize(minimum if stacked else QSize(width, 0))
        self._panel.setMaximumSize(maximum if stacked else QSize(width, QWIDGETSIZE_MAX))
        self.exclusions.setMaximumWidth(EXCLUSIONS if stacked else QWIDGETSIZE_MAX)
        self._left.setAlignment(self.exclusions, Qt.AlignmentFlag.AlignTop if stacked else Qt.AlignmentFlag(0))
        self.figures.set_whole(stacked)
        self._head.removeWidget(self._chip_box)
        self._chip_row.removeWidget(self._chip_box)
        room = self.width() - 48 - self._head.sizeHint().width()
        if sum(chip.sizeHint().width() + 8 for chip in self.chips) + 12 <= room:
            self._head.insertWidget(2, self._chip_box)
        else:
            self._chip_row.addWidget(self._chip_box, 0, Qt.AlignmentFlag.AlignLeft)
        self._chip_box.setVisible(bool(self.chips))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._arrange()
