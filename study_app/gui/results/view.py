"""Results: sessions, exclusions, figures, exports."""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QDialog, QLineEdit, QScrollArea, QSizePolicy, QWidget

from study_app.gui.kit.dialogs import Work
from study_app.gui.kit.fields import Field
from study_app.gui.results.figures import FiguresPanel, ResultsView, excluded_words, in_figures, kind_of, time_of
from study_app.gui.sessions.session_facts import Column, SessionFacts, matching, started_words, states_of
from study_app.gui.sessions.session_page import LeaveOutDialog, SessionPage, take_back_question, unblind_question
from study_app.gui.sessions.sessions_table import SessionsTable
from study_app.gui.theme.theme import font
from study_app.gui.theme.themed import remove_widget
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import QWIDGETSIZE_MAX, SHADOW, Card, Chip, Rule, scrolled
from study_app.gui.widgets.controls import ActionButton, Choice, IconButton
from study_app.gui.widgets.labels import label
from study_app.gui.widgets.main_view import Place
from study_app.number_text import counted
from study_app.store.exclusions import Exclusion

WIDTH = 600
WARNED = 3
"""Of so many files that are not as recorded each is named."""


class Extra(NamedTuple):
    """Something that is written where it is asked for: its name in the command, its words, and why it cannot be."""

    name: str
    words: str
    why_not: str = ""


class WriteDialog(Work):
    """Asks for a folder and what to write there; Cancel leaves nothing behind.

    Parameters
    ----------
    to : the folder that is suggested
    extras : what can be written in addition
    opens : the words on the button that opens what was written
    """

    def __init__(
        self, *words: Any, go_on: str, to: Path, extras: Sequence[Extra] = (), opens: str = "Open the folder"
    ) -> None:
        checks = (Field(extra.name, extra.words, "check", hint=extra.why_not) for extra in extras)
        folder = Field("to", "Folder", "folder", hint="Existing files will be overwritten.")
        super().__init__(
            *words,
            ActionButton("", go_on, role="primary"),
            fields=(*checks, folder),
            needs={"to": "Please choose a folder."},
            width=WIDTH,
        )
        self._opens = opens
        self.result_path: Path | None = None
        self._extras = [extra.name for extra in extras]
        for extra in extras:
            self.editors[extra.name].control.setEnabled(not extra.why_not)
        self.editors["to"].show_value(str(to))
        self.go_on.setFocus()

    @property
    def asked(self) -> tuple[Path, tuple[str, ...]]:
        """The folder, and the names of the extras."""
        return Path(self.value("to")).expanduser(), tuple(name for name in self._extras if self.value(name))

    def show_written(self, files: Sequence[Path], opens: Path, warnings: Sequence[str]) -> None:
        self.result_path = opens
        more = f" {len(warnings) - WARNED} more." if len(warnings) > WARNED else ""
        warned = "".join(f"\n{line}" for line in warnings[:WARNED])
        self.show_done(f"{counted(len(files), 'file')} in {files[0].parent}.{warned}{more}", self._opens)


COLUMNS = (
    Column("participant", "Participant", 90, 76),
    Column("status", "Status", 120, 112),
    Column("validity", "Validity", 110, 114),
    Column("version", "Version", 60, 60),
)
EVERY = "All states"


class SessionsCard(Card):
    """The study's sessions; below, how many are in the figures and why the others are not."""

    def __init__(self) -> None:
        super().__init__(gap=8, padding=14)
        self.column.setContentsMargins(12, self.column.contentsMargins().top(), 12, 14)
        self.search = QLineEdit(placeholderText="Participant", clearButtonEnabled=True)
        self.search.setAccessibleName("Search by participant")
        self.search.setFont(font("body"))
        self.state = Choice()
        self.state.setAccessibleName("State")
        self.state.setFont(font("body"))
        self.state.addItem(EVERY, "")
        self._none = ""
        self.rows = SessionsTable(COLUMNS, "")
        self.head = label("", "label", weight=600, tabular=True)
        self.why = label("", "small", "text2", wraps=True)
        self.details = IconButton("file", "Details of the selected session", size=36, role="plain")
        self.details.setEnabled(False)
        self.details.clicked.connect(self.rows.open_chosen)
        words = "What changed in the study since the selected session"
        self.version = IconButton("designer", words, size=36, role="plain")
        self.version.setEnabled(False)
        self.version.clicked.connect(self.rows.ask_for_version)
        self.rows.chosen_changed.connect(self._enable)
        filters = hbox((self.search, 1), (self.state, 1), self.details, self.version, spacing=8)
        foot = vbox(self.head, self.why, spacing=2, margins=(10, 2, 10, 0))
        add_parts(self.column, filters, (self.rows, 1), Rule(), foot)
        self.search.textChanged.connect(self._filter)
        self.state.currentIndexChanged.connect(self._filter)

    def _enable(self) -> None:
        chosen = self.rows.chosen
        self.details.setEnabled(chosen is not None)
        self.version.setEnabled(chosen is not None and bool(chosen.version))

    def show_sessions(self, found: Sequence[SessionFacts], none: str = "No sessions.") -> None:
        """Show these sessions in place of those before, or the words ``none`` in their place; the filters stay."""
        self._none = none
        self.rows.show_rows(found, datetime.now().astimezone())
        chosen = self.state.currentData()
        with QSignalBlocker(self.state):
            self.state.clear()
            self.state.addItem(EVERY, "")
            for state, words in states_of(found):
                self.state.addItem(words, state)
            self.state.setCurrentIndex(max(0, self.state.findData(chosen)))
        head, why = in_figures(found)
        self.head.setText(head)
        self.why.setText(why)
        self.why.setVisible(bool(why))
        self._filter()

    def _filter(self) -> None:
        state = str(self.state.currentData() or "")
        filtered = bool(state or self.search.text().strip())
        self.rows.none.setText("No session matches." if filtered else self._none)
        self.rows.show_matching(matching(self.search.text(), state))


class ExclusionsCard(Card):
    """What is left out, each with its reason.

    ``take_back_asked`` carries the `Exclusion` that is to count again.
    """

    take_back_asked = Signal(object)

    def __init__(self) -> None:
        self.leave_out = ActionButton("minus", "Exclude …", height=36)
        super().__init__("Excluded", self.leave_out, padding=14, gap=6)
        self.none = label("Nothing is excluded from the analysis.", "label", "text2", wraps=True, weight=400)
        self.open = ActionButton("file", "Open the list", role="plain", height=30)
        inside = QWidget()
        self._rows = vbox(STRETCH, spacing=8, margins=0, parent=inside)
        self.area = QScrollArea(widgetResizable=True)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setWidget(inside)
        self.area.setAccessibleName("Excluded")
        self.area.setMinimumHeight(96)
        self.lines: list[QWidget] = []
        add_parts(self.column, self.none, (self.area, 1), hbox(STRETCH, self.open))
        self.show_left_out(())

    def show_left_out(self, listed: Sequence[Exclusion]) -> None:
        """Show what is left out, the last decision first; the keyboard does not leave with a line."""
        at = self.window().focusWidget()
        if at is not None and any(line.isAncestorOf(at) for line in self.lines):
            self.leave_out.setFocus()
        for line in self.lines:
            remove_widget(line)
        self.lines = [self._line(one) for one in reversed(listed)]
        for place, line in enumerate(self.lines):
            self._rows.insertWidget(place, line)
        self.none.setVisible(not listed)
        for part in (self.area, self.open):
            part.setVisible(bool(listed))
        grows = QSizePolicy.Policy.Preferred if listed else QSizePolicy.Policy.Maximum
        self.setSizePolicy(QSizePolicy.Policy.Preferred, grows)

    def _line(self, one: Exclusion) -> QWidget:
        back = ActionButton("undo", "Include again …", role="plain", height=30)
        back.setAccessibleName(f"Include again: {excluded_words(one)}")
        back.clicked.connect(lambda: self.take_back_asked.emit(one))
        return _line(one, back)


def _line(one: Exclusion, back: ActionButton) -> QWidget:
    """Return one decision: what, why, who and when."""
    made = QWidget()
    what = label(excluded_words(one), "label", wraps=True, weight=600)
    why = label(one.reason, "label", "text2", wraps=True, weight=400)
    now = datetime.now().astimezone()
    at = time_of(one.excluded_at)
    by = one.rule_or_person + ("" if at is None else f", {started_words(at.astimezone(now.tzinfo), now)}")
    who = label(by, "small", "text2")
    vbox(hbox((what, 1), back), why, who, spacing=0, margins=(0, 0, 6, 0), parent=made)
    made.setAccessibleName(f"{excluded_words(one)}: {one.reason} ({by})")
    return made


STACKED_BELOW = 1160
PANEL_PX, PANEL_WIDE_PX, WIDE_FROM = 400, 430, 1700
STACKED_HEIGHT, EXCLUSIONS = 330, 360
REASON_SIGNS = 40
EXTRAS: Final = (
    Extra("wide", "Wide table: one row per participant"),
    Extra("parquet", "Every table also as Parquet"),
    Extra("sav", "Answers for SPSS, jamovi and JASP (.sav)"),
    Extra("psych-ds", "A Psych-DS folder of all tables, to share"),
)


class ResultsPlace(Place):
    """Draws a `ResultsView` and says what is asked for.

    Signals: ``entered`` and ``left``; ``study_asked`` (folder); ``remedy_asked`` (a `Remedy`); ``leave_out_asked``
    and ``take_back_asked`` (participant, session, trial or None, by, reason); ``unblind_asked`` (by, reason);
    ``tables_asked`` and ``report_asked`` (folder, extras); ``stop_asked`` (giving up what is being written);
    ``open_asked`` (path); ``version_asked`` (the `SessionFacts` of a session, to compare the study with its version);
    ``watch_asked`` (the `SessionPage` whose chosen trial is to be watched).
    """

    entered = Signal()
    left = Signal()
    study_asked = Signal(object)
    remedy_asked = Signal(str)
    leave_out_asked = Signal(object)
    take_back_asked = Signal(object)
    unblind_asked = Signal(str, str)
    tables_asked = Signal(object, object)
    report_asked = Signal(object, object)
    stop_asked = Signal()
    open_asked = Signal(object)
    version_asked = Signal(object)
    watch_asked = Signal(object)

    def __init__(self, *, handed_to: Path, no_sav: str = "") -> None:
        super().__init__()
        self.view = ResultsView()
        self.dialog: QDialog | None = None
        self.writing: WriteDialog | None = None
        self._handed_to = handed_to
        self._no_sav = no_sav
        self.study = Choice()
        self.study.setAccessibleName("Study")
        self.study.setFont(font("body"))
        self.study.setMinimumWidth(200)
        self.study.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToContents)
        self.chips: list[Chip] = []
        self.unblind = ActionButton("eye", "Unblind …", height=44)
        self.export = ActionButton("download", "Export …", height=44)
        self.report = ActionButton("file", "Report …", role="primary", height=44)
        self.sessions = SessionsCard()
        self.exclusions = ExclusionsCard()
        self.figures = FiguresPanel()
        self._lay_out()
        self._connect()
        self._show_studies()
        self.show_view(ResultsView())

    def _connect(self) -> None:
        self.study.activated.connect(lambda: self.study_asked.emit(self.study.currentData()))
        self.unblind.clicked.connect(self._ask_unblind)
        self.export.clicked.connect(self._ask_tables)
        self.report.clicked.connect(self._ask_report)
        self.exclusions.leave_out.clicked.connect(self._ask_leave_out)
        self.exclusions.take_back_asked.connect(self._ask_take_back)
        self.exclusions.open.clicked.connect(lambda: self.open_asked.emit(self.view.exclusions_file))
        self.figures.asked.connect(self._remedy)
        self.sessions.rows.opened.connect(self._open_session)
        self.sessions.rows.version_asked.connect(self.version_asked)

    def _lay_out(self) -> None:
        self._chips_there = QWidget()
        self._chips = hbox(spacing=8, margins=0, parent=self._chips_there)
        self._head = hbox(label("Results", "title"), self.study, STRETCH, spacing=12, margins=(SHADOW, 0, SHADOW, 0))
        add_parts(self._head, self.unblind, self.export, self.report)
        self._below = hbox(margins=(SHADOW, 0, SHADOW, 0))
        self._left = QBoxLayout(QBoxLayout.Direction.TopToBottom)
        self._left.setSpacing(12 - 2 * SHADOW)
        add_parts(self._left, (self.sessions, 3), (self.exclusions, 1))
        self._panel = QWidget()
        self._panel.setLayout(self._left)
        self._left.setContentsMargins(0, 0, 0, 0)
        self._row = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._row.setSpacing(16 - 2 * SHADOW)
        add_parts(self._row, self._panel, (self.figures, 1))
        inside = QWidget()
        vbox(self._head, self._below, (self._row, 1), spacing=12, margins=(24, 20, 24, 18), parent=inside)
        self.area = scrolled(inside)
        vbox(self.area, margins=0, parent=self)

    def hand_to(self, folder: Path) -> None:
        self._handed_to = folder

    def enter(self) -> None:
        self.entered.emit()

    def leave(self) -> None:
        self.left.emit()

    def show_view(self, view: ResultsView) -> None:
        """Show what there is; only what has changed is made anew."""
        before, self.view = self.view, view
        if view.studies != before.studies or view.chosen != before.chosen:
            self._show_studies()
        if (view.sessions, view.without_sessions) != (before.sessions, before.without_sessions):
            self.sessions.show_sessions(view.sessions, view.without_sessions)
        if view.left_out != before.left_out:
            self.exclusions.show_left_out(view.left_out)
        self._show_chips()
        self.unblind.setVisible(view.sealed is True)
        for button in (self.unblind, self.export, self.report):
            button.setEnabled(view.can_be_written)
        self.exclusions.leave_out.setEnabled(any(one.excluded is None for one in view.sessions))
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

    def _show_chips(self) -> None:
        chips = []
        if self.view.kind == "simulated":
            chips.append(("warn", "info", "Simulated participants", ""))
        if self.view.kind == "pilot":
            chips.append(("warn", "info", "Pilot", "Pilot sessions, stored separately"))
        if self.view.sealed:
            chips.append(("neutral", "lock", "Blinded: shown by code", "The names of the settings are sealed"))
        if self.view.opened:
            chips.append(("neutral", "eye", _shortened(self.view.opened), self.view.opened))
        if self.view.doubts:
            words = "1 file is" if len(self.view.doubts) == 1 else f"{len(self.view.doubts)} files are"
            chips.append(("warn", "warning", f"{words} not as recorded", "\n".join(self.view.doubts)))
        if [chip.word for chip in self.chips] != [words for _, _, words, _ in chips]:
            for chip in self.chips:
                remove_widget(chip)
            self.chips = []
            for tone, icon, words, tip in chips:
                chip = Chip(tone, icon, words)  # type: ignore[arg-type]  # the tones above
                chip.setToolTip(tip)
                self._chips.addWidget(chip)
                self.chips.append(chip)
            self._arrange()

    def _remedy(self, remedy: str) -> None:
        if remedy == "home":
            self.go_asked.emit("home")
        else:
            self.remedy_asked.emit(remedy)

    def _ask_unblind(self) -> None:
        open_ones = sum(one.needs_care for one in self.view.sessions)
        dialog = unblind_question(self, self.theme, self._name(), running=open_ones)
        dialog.accepted.connect(lambda: self.unblind_asked.emit(dialog.value("by"), dialog.value("reason")))
        self._open(dialog)

    def _open_session(self, session: SessionFacts) -> None:
        page = SessionPage(self, self.theme, session, self.open_asked.emit)
        page.changed.connect(self.entered)
        page.watch_asked.connect(self.watch_asked)
        self._open(page)

    def _ask_leave_out(self) -> None:
        there = [one for one in self.view.sessions if one.excluded is None]
        dialog = LeaveOutDialog(self, self.theme, there, self.view.trials, self.sessions.rows.chosen)
        dialog.accepted.connect(
            lambda: self.leave_out_asked.emit((*dialog.chosen, dialog.value("by"), dialog.value("reason")))
        )
        self._open(dialog)

    def _ask_take_back(self, one: Exclusion) -> None:
        dialog = take_back_question(self, self.theme, excluded_words(one), one.reason)
        dialog.accepted.connect(
            lambda: self.take_back_asked.emit((*one.what, dialog.value("by"), dialog.value("reason")))
        )
        self._open(dialog)

    def _ask_tables(self) -> None:
        extras = [extra._replace(why_not=self._no_sav) if extra.name == "sav" else extra for extra in EXTRAS]
        dialog = WriteDialog(
            self,
            self.theme,
            f"Export {self._name()}",
            "Answers, trials and counts of all participants as CSV, with a codebook that explains every column."
            f"{self._by_code()}",
            go_on="Export",
            to=self._handed_to / f"{self._name()}-tables",
            extras=extras,
        )
        dialog.begun.connect(lambda: self.tables_asked.emit(*dialog.asked))
        self._open_writing(dialog)

    def _ask_report(self) -> None:
        dialog = WriteDialog(
            self,
            self.theme,
            f"Report of {self._name()}",
            "One page with figures, tests and conclusions, and every number, table and figure as a file. Large studies "
            f"take some minutes.{self._by_code()}",
            go_on="Write the report",
            to=self._handed_to / f"{self._name()}-report",
            opens="Open the report",
        )
        dialog.begun.connect(lambda: self.report_asked.emit(*dialog.asked))
        self._open_writing(dialog)

    def _open_writing(self, dialog: WriteDialog) -> None:
        self.writing = dialog
        dialog.stop_asked.connect(self.stop_asked)
        dialog.opened.connect(lambda: self.open_asked.emit(dialog.result_path))
        dialog.finished.connect(self._written)
        self._open(dialog)

    def _written(self) -> None:
        self.writing = None

    def _open(self, dialog: QDialog) -> None:
        self.dialog = dialog
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _by_code(self) -> str:
        return " Settings appear as codes because the key is sealed." if self.view.sealed else ""

    def _name(self) -> str:
        return "" if self.view.chosen is None else self.view.chosen.name

    def _arrange(self) -> None:
        """Put the figures below the sessions in a narrow window, and the chips below the heading where they must be."""
        stacked = self.width() < STACKED_BELOW
        down, right = QBoxLayout.Direction.TopToBottom, QBoxLayout.Direction.LeftToRight
        self._row.setDirection(down if stacked else right)
        self._left.setDirection(right if stacked else down)
        width = PANEL_WIDE_PX if self.width() >= WIDE_FROM else PANEL_PX
        least, most = QSize(0, STACKED_HEIGHT), QSize(QWIDGETSIZE_MAX, STACKED_HEIGHT)
        self._panel.setMinimumSize(least if stacked else QSize(width, 0))
        self._panel.setMaximumSize(most if stacked else QSize(width, QWIDGETSIZE_MAX))
        self.exclusions.setMaximumWidth(EXCLUSIONS if stacked else QWIDGETSIZE_MAX)
        self._left.setAlignment(self.exclusions, Qt.AlignmentFlag.AlignTop if stacked else Qt.AlignmentFlag(0))
        self.figures.show_whole(stacked)
        self._head.removeWidget(self._chips_there)
        self._below.removeWidget(self._chips_there)
        room = self.width() - 48 - self._head.sizeHint().width()
        if sum(chip.sizeHint().width() + 8 for chip in self.chips) + 12 <= room:
            self._head.insertWidget(2, self._chips_there)
        else:
            self._below.addWidget(self._chips_there, 0, Qt.AlignmentFlag.AlignLeft)
        self._chips_there.setVisible(bool(self.chips))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._arrange()


def _shortened(words: str) -> str:
    """Return a line for a chip, the end cut where it is long."""
    return words if len(words) <= 2 * REASON_SIGNS else f"{words[: 2 * REASON_SIGNS - 1].rstrip()}…"
