"""A session's page: trials, limits and which were broken, notes, motion, files, exclusions and taking them back."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, Qt, Signal
from PySide6.QtWidgets import QDialog, QScrollArea, QWidget

from study_app.errors import StoreError
from study_app.gui.sessions.decision_dialogs import LeaveOutDialog, TakeBackDialog
from study_app.gui.sessions.motion_plots import MotionPlot
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import apply_theme, apply_theme_within, remove_widget
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.gui.widgets.row_table import CHIP_ROLE, Index, Table
from study_app.store.exclusions import Exclusion, exclude, include
from study_app.viewmodels.session.columns import VALIDITY, status_chip, validity_chip
from study_app.viewmodels.session.record import NO_MOTION, SessionRecord, TrialRecord, motion, read_record
from study_app.viewmodels.sessions import SessionFacts

HEADINGS = ("Trial", "Presented", "Ended", "Limits", "Answers", "Notes")
WIDTHS = ((20, 56), (120, 130), (60, 90), (60, 134), (30, 70), (160, 120))
SIZE = (1040, 700)
NOWHERE = QModelIndex()


class TrialsModel(QAbstractTableModel):
    """The trials of a session as rows of a table."""

    def __init__(self) -> None:
        super().__init__()
        self.trials: tuple[TrialRecord, ...] = ()

    def show(self, trials: tuple[TrialRecord, ...]) -> None:
        """Hold these trials in place of those before."""
        self.beginResetModel()
        self.trials = trials
        self.endResetModel()

    def rowCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(self.trials)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        return 0 if parent.isValid() else len(HEADINGS)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        across = orientation == Qt.Orientation.Horizontal and role == Qt.ItemDataRole.DisplayRole
        return HEADINGS[section] if across else None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Return what a cell says."""
        trial, heading = self.trials[index.row()], HEADINGS[index.column()]
        chip = trial_chip(trial) if heading == "Limits" else None
        if role == CHIP_ROLE:
            return chip
        if role == Qt.ItemDataRole.ToolTipRole:
            return trial_words(trial)
        if role not in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.AccessibleTextRole):
            return None
        said = {
            "Trial": str(trial.number),
            "Presented": trial.words,
            "Ended": trial.outcome,
            "Answers": f"{trial.answers} + {len(trial.unconfirmed)}?" if trial.unconfirmed else str(trial.answers),
            "Notes": trial.notes,
        }
        return chip[2] if chip else said[heading]


def trial_chip(trial: TrialRecord) -> Any:
    """Return what the chip says of a trial's limits, or that it is left out."""
    if trial.excluded is not None:
        return "neutral", "cross", "Excluded"
    return VALIDITY[None if trial.valid is None else "valid" if trial.valid else "invalid"]


def trial_words(trial: TrialRecord) -> str:
    """Return a line on a trial's limits."""
    said = f"Trial {trial.number}: "
    if trial.excluded is not None:
        said += f"excluded from the analysis ({trial.excluded}); "
    if trial.broken:
        said += "; ".join(trial.broken) + "."
    else:
        said += "not measured." if trial.valid is None else "within all limits."
    if trial.lost:
        said += f" The recording was lost: {trial.lost}."
    if trial.unconfirmed:
        said += f" Chosen but not confirmed, so not in any table: {', '.join(trial.unconfirmed)}."
    return said


class SessionPage(QDialog):
    """One session in full, read in a thread; ``changed`` comes when something was left out or taken back."""

    changed = Signal()

    def __init__(self, parent: QWidget, theme: Theme, facts: SessionFacts, opener: Callable[[Path], object]) -> None:
        super().__init__(parent)
        self.facts = facts
        self.record: SessionRecord | None = None
        self.decision: LeaveOutDialog | TakeBackDialog | None = None
        self._theme = theme
        self._reader, self._mover = Background(self), Background(self)
        self._reader.done.connect(self._show)
        self._mover.done.connect(self._show_motion)
        self.setWindowTitle(f"{facts.name}, {facts.study}")
        self.status, self.validity = Chip(*status_chip(facts)), Chip(*validity_chip(facts))
        self.about, self.limits = label("", "body", "text2", wraps=True), label("", "body", wraps=True)
        self.model = TrialsModel()
        self.trials = Table(self.model, WIDTHS, "Trials")
        self.trial = label("", "label", "text2", wraps=True)
        self.motion = MotionPlot()
        self.notes, self.files = (label("", "label", "text2", wraps=True) for _ in range(2))
        self.leave_out = ActionButton("minus", "Exclude …", height=36)
        self.folder = ActionButton("file", "Open the folder", role="plain", height=34)
        self.close_button = ActionButton("", "Close", role="primary", height=40)
        self.none_out = label("Nothing is excluded from the analysis.", "label", "text2", wraps=True)
        self.lines: list[QWidget] = []
        self._lay_out()
        self.trials.selectionModel().selectionChanged.connect(lambda *_changes: self._choose_trial())
        self.leave_out.clicked.connect(self._ask_leave_out)
        self.folder.clicked.connect(lambda: opener(facts.folder))
        self.close_button.clicked.connect(self.accept)
        for button in (self.leave_out, self.folder):
            button.setAutoDefault(False)
        self.leave_out.setEnabled(False)
        apply_theme(self, theme)
        available = self.screen().availableSize()
        self.resize(min(SIZE[0], available.width() - 40), min(SIZE[1], available.height() - 60))
        self.read()

    def read(self) -> None:
        """Read the session's folder again."""
        self._reader.run(partial(_result, read_record, self.facts.folder))

    def _lay_out(self) -> None:
        kind = f"  ·  {self.facts.kind}" if self.facts.kind else ""
        title = label(f"{self.facts.name}  ·  {self.facts.study}{kind}", "title_dense")
        head = hbox(title, self.status, self.validity, STRETCH, spacing=12)
        trials = Card("Trials", padding=16, gap=8)
        add_parts(trials.column, (self.trials, 1), self.trial, self.motion)
        left = vbox((trials, 1))
        out = Card("Excluded", self.leave_out, padding=16, gap=8)
        self._out = out.column
        out.column.addWidget(self.none_out)
        notes = Card("Notes", padding=16, gap=8)
        notes.column.addWidget(self.notes)
        files = Card("Files", self.folder, padding=16, gap=8)
        self.files.setFont(font("small", tabular=True))
        files.column.addWidget(self.files)
        page = QWidget()
        vbox(out, notes, files, STRETCH, margins=0, parent=page)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setFixedWidth(372)
        area.setWidget(page)
        area.setAccessibleName("Exclusions, notes and files")
        body = hbox((left, 1), area, spacing=8)
        foot = hbox(STRETCH, self.close_button)
        vbox(head, self.about, self.limits, (body, 1), foot, spacing=8, margins=(24, 20, 24, 18), parent=self)

    def _show(self, record: SessionRecord | StoreError) -> None:
        if isinstance(record, StoreError):
            sentence = str(record)
            self.limits.setText(f"{sentence[:1].upper()}{sentence[1:]}.")
            set_ink(self.limits, "bad")
            return
        row = self.trials.currentIndex().row()
        self.record = record
        set_ink(self.limits, "text")
        self.status.show_state(*status_chip(record.facts))
        self.validity.show_state(*validity_chip(record.facts))
        self.about.setText(record.about)
        self.limits.setText(record.limits)
        self.model.show(record.trials)
        if record.trials:
            self.trials.selectRow(max(0, row))
        self.notes.setText("\n".join(record.notes) or "No notes.")
        self.files.setText("\n".join(f"{name}  {_size(size)}" for name, size in record.files))
        self.leave_out.setEnabled(record.facts.excluded is None)
        self._show_left_out(record.left_out)
        self._choose_trial()

    def _show_left_out(self, listed: tuple[Exclusion, ...]) -> None:
        for line in self.lines:
            remove_widget(line)
        self.lines = []
        for one in listed:
            what = "Whole session" if one.trial is None else f"Trial {one.trial}"
            back = ActionButton("undo", "Include again …", role="plain", height=30)
            back.setAccessibleName(f"Include again: {what}")
            back.setAutoDefault(False)
            back.clicked.connect(partial(self._ask_take_back, one, what))
            line = QWidget()
            words = label(f"{what}: {one.reason} ({one.rule_or_person})", "label", wraps=True)
            hbox((words, 1), back, margins=0, parent=line)
            apply_theme_within(line, self._theme)
            self._out.addWidget(line)
            self.lines.append(line)
        self.none_out.setVisible(not listed)

    @property
    def chosen(self) -> TrialRecord | None:
        """The trial whose row is chosen."""
        row = self.trials.chosen_row
        return None if row is None else self.model.trials[row]

    def _choose_trial(self) -> None:
        trial = self.chosen
        if trial is None or self.record is None:
            self.trial.setText("")
            self.motion.show_sentence("No trials yet.")
            return
        self.trial.setText(trial_words(trial))
        set_ink(self.trial, "warn" if trial.broken else "text2")
        if self.record.motion_hidden or trial.recording is None:
            self.motion.show_sentence(NO_MOTION if trial.recording is None else self.record.motion_hidden)
            return
        self.motion.show_sentence("Reading …")
        self._mover.run(partial(_result, motion, trial.recording))

    def _show_motion(self, motion: Any) -> None:
        if isinstance(motion, StoreError):
            self.motion.show_sentence(f"The recording cannot be read: {motion}.")
        else:
            self.motion.show_motion(*motion)

    def _ask_leave_out(self) -> None:
        assert self.record is not None  # noqa: S101 - the button is off until it was read
        who = (self.facts.participant, self.facts.session)
        trials = {trial.number: trial.words for trial in self.record.trials if trial.excluded is None}
        dialog = LeaveOutDialog(self, self._theme, [self.facts], {who: tuple(trials.items())}, self.facts)
        dialog.accepted.connect(lambda: self._leave_out(dialog.chosen[2], dialog.by.text(), dialog.reason.text()))
        dialog.finished.connect(dialog.deleteLater)
        self.decision = dialog
        dialog.open()

    def _leave_out(self, trial: int | None, by: str, reason: str) -> None:
        facts = self.facts
        leave_out = partial(exclude, facts.folder.parents[2], facts.participant, facts.session, trial=trial)
        self._decide(partial(leave_out, by=by, reason=reason))

    def _ask_take_back(self, one: Exclusion, what: str) -> None:
        dialog = TakeBackDialog(self, self._theme, what, one.reason)
        dialog.accepted.connect(lambda: self._take_back(one, dialog.by.text(), dialog.reason.text()))
        dialog.finished.connect(dialog.deleteLater)
        self.decision = dialog
        dialog.open()

    def _take_back(self, one: Exclusion, by: str, reason: str) -> None:
        take_back = partial(include, self.facts.folder.parents[2], one.participant, one.session, trial=one.trial)
        self._decide(partial(take_back, by=by, reason=reason))

    def _decide(self, decide: Callable[[], object]) -> None:
        """Carry out a decision in the thread that reads, read the session again, and tell of it."""

        def decided(folder: Path) -> SessionRecord:
            decide()
            return read_record(folder)

        self._reader.run(partial(_result, decided, self.facts.folder))
        self._reader.done.connect(self._tell_change, Qt.ConnectionType.SingleShotConnection)

    def _tell_change(self) -> None:
        self.changed.emit()


def _result(read: Callable[[Path], Any], path: Path) -> Any:
    """Return what ``read`` returns, or the refusal."""
    try:
        return read(path)
    except StoreError as error:
        return error


def _size(size: int) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 1_000_000 else f"{max(1, round(size / 1e3))} kB"
