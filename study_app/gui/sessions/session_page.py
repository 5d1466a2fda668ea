"""A session's page: its record, read from its folder without Qt, and the dialog that shows it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QScrollArea, QWidget

from study_app.errors import StoreError
from study_app.gui.sessions.session_facts import (
    VALIDITY,
    SessionFacts,
    broken_limit_text,
    incidents_text,
    session_facts,
    status_chip,
    validity_chip,
)
from study_app.gui.theme.theme import Theme, font
from study_app.gui.theme.themed import Themed, apply_theme
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Card, Chip
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import label, set_ink
from study_app.gui.widgets.row_table import CHIP_ROLE, Rows, Table
from study_app.number_text import capitalised, counted
from study_app.store.blinded import Codes, open_events, opened_key
from study_app.store.exclusions import Exclusion, exclusions
from study_app.store.files import locate_session
from study_app.store.journals import journal
from study_app.store.journals.journal_events import (
    UNDELIVERED,
    Answer,
    Event,
    Note,
    Repeat,
    SessionEnded,
    TrialStarted,
    start_of,
)
from study_app.store.session_progress import (
    MISSING_PERCENT,
    MissingTrials,
    beyond_limits,
    late_device_text,
    progress_of,
)
from study_app.store.tables import SessionRows, participant_row, row_of


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialRecord:
    """One presentation of a trial.

    ``words`` names what was presented. ``broken`` has a sentence for each violated limit; ``valid`` is None if nothing
    was measured. ``excluded`` is the reason for the exclusion from the analysis, or None. ``unconfirmed`` are answers,
    as "item: value", on a page that was left before they were confirmed; no table contains them. ``lost`` is the reason
    why the recording could not be stored, or "".
    """

    number: int
    attempt: int
    words: str
    outcome: str
    valid: bool | None
    broken: tuple[str, ...]
    answers: int
    unconfirmed: tuple[str, ...]
    notes: str
    lost: str
    excluded: str | None


@dataclass(frozen=True, slots=True)
class SessionRecord:
    """The content of a session's page."""

    facts: SessionFacts
    about: str
    limits: str
    trials: tuple[TrialRecord, ...]
    notes: tuple[str, ...]
    files: tuple[tuple[str, int], ...]
    left_out: tuple[Exclusion, ...]


def read_record(folder: Path) -> SessionRecord:
    """Read the record in a session's folder.

    Raises
    ------
    StoreError
        It is not a session folder, or its journal or the list of exclusions cannot be read.
    """
    study, session = locate_session(folder)
    key = opened_key(study)
    lines = open_events(journal.read(session.journal), key)
    if not lines:
        raise StoreError(f"{session.journal} is empty: the session has not begun")
    study_exclusions = exclusions(study.path)
    (facts,) = session_facts(study.path, row_of(session, key), study_exclusions, {})
    session_exclusions = tuple(
        exclusion for exclusion in study_exclusions if exclusion.what[:2] == (facts.participant, facts.session)
    )
    start = start_of(lines)
    rows = SessionRows(lines).trials
    last = lines[-1]
    verdict = last.within_limits if key is None and isinstance(last, SessionEnded) else None
    trials = _trial_records(
        rows, lines, start.limits, session_exclusions, verdict=verdict, codes=key.codes if key else {}
    )
    return SessionRecord(
        facts=facts,
        about=_about_text(lines, incidents_text(facts)),
        limits=_limits_sentence(
            trials,
            progress_of(lines).missing_trials,
            excluded=facts.excluded is not None,
            sealed=key is None and bool(start.measures_sealed),
            verdict=verdict,
        ),
        trials=trials,
        notes=tuple(_note_texts(lines)),
        files=tuple(
            (path.relative_to(session.path).as_posix(), path.stat().st_size)
            for path in sorted(session.path.rglob("*"))
            if path.is_file()
        ),
        left_out=session_exclusions,
    )


def _limits_sentence(
    trials: Sequence[TrialRecord],
    missing: MissingTrials,
    *,
    excluded: bool = False,
    sealed: bool,
    verdict: bool | None = None,
) -> str:
    """Return sentences about undelivered trials and about trials within the study's limits.

    ``verdict`` is the recorded verdict on all limits of a ``sealed`` session, or None if none was recorded.
    """
    lost = f"{_missing_sentence(missing, excluded=excluded)} " if missing.count else ""
    repeated = sum(trial.outcome == UNDELIVERED for trial in trials)
    again = (
        f"{counted(repeated, 'presentation')} exceeded a limit and {'was' if repeated == 1 else 'were'} not followed "
        "by a question. "
        if repeated
        else ""
    )
    delivered = [trial for trial in trials if trial.outcome != UNDELIVERED]
    return f"{lost}{again}{_within_limits_sentence(delivered, sealed=sealed, verdict=verdict)}"


def _missing_sentence(missing: MissingTrials, *, excluded: bool) -> str:
    """Return sentences about undelivered trials, with reasons, and whether the session is included."""
    permitted = missing.limits.get(MISSING_PERCENT)
    states = f" The study allows up to {permitted:g} % of the trials to be missing." if permitted is not None else ""
    if missing.exceed:
        included = "Include it again in Results to analyse it." if excluded else "It was included manually."
        states += f" The session is incomplete. {included}"
    return f"{missing}. These trials were not answered.{states}"


def _within_limits_sentence(trials: Sequence[TrialRecord], *, sealed: bool, verdict: bool | None) -> str:
    judged = [trial for trial in trials if trial.valid is not None]
    outside = [trial for trial in judged if not trial.valid]
    if verdict is False and not outside:
        return "Out of limits: at least one trial exceeded one of the study's limits. Unblinding will show which trial."
    later = " The delay error, the withheld force and the targets reached will be checked after unblinding."
    later = later if sealed and not verdict else ""
    if not judged:
        return f"No trials have been measured yet.{later}"
    if not outside:
        every = "The one trial so far" if len(judged) == 1 else f"All {len(judged)} measured trials"
        return f"{every} met the study's limits.{later}"
    return (
        f"Out of limits: {len(outside)} of {counted(len(judged), 'measured trial')} exceeded one of the study's "
        "limits. The answers are still included; in Results you can exclude trials that you do not trust. The "
        f"column “Limits” and the line below the table show which limit was exceeded.{later}"
    )


def _trial_records(
    rows: Sequence[Mapping[str, Any]],
    lines: Sequence[Event],
    limits: Mapping[str, float],
    session_exclusions: Sequence[Exclusion],
    *,
    verdict: bool | None,
    codes: Codes,
) -> tuple[TrialRecord, ...]:
    """Return the records of trials; if only the session's ``verdict`` is known, each trial's validity is open."""
    reasons = {exclusion.trial: exclusion.reason for exclusion in session_exclusions}
    is_hidden = verdict is False and all(row["valid"] is not False for row in rows)
    answered: dict[tuple[int, int], int] = {}
    unconfirmed = progress_of(lines).unconfirmed
    for row in SessionRows(lines).responses:
        presentation = (row["trial"], row["attempt"])
        answered[presentation] = answered.get(presentation, 0) + (row["first_choice_s"] is not None)
    return tuple(
        TrialRecord(
            number=row["trial"],
            attempt=row["attempt"],
            words=_setting_text(row, codes),
            outcome=row["outcome"] or "running",
            valid=None if is_hidden else row["valid"],
            broken=tuple(broken_limit_text(*limit) for limit in beyond_limits(row, limits)),
            answers=answered.get((row["trial"], row["attempt"]), 0),
            unconfirmed=_choice_texts(unconfirmed.get((row["trial"], row["attempt"]), {})),
            notes=" · ".join(_row_note_texts(row)),
            lost=row["recording_lost"] or "",
            excluded=reasons.get(row["trial"]),
        )
        for row in rows
    )


def _choice_texts(answers: Mapping[str, Answer]) -> tuple[str, ...]:
    """Return answers as "item: value", in the order in which they were first given."""
    in_order = sorted(answers.items(), key=lambda entry: entry[1].first_s or 0.0)
    return tuple(f"{item}: {'cannot judge' if answer.value is None else answer.value}" for item, answer in in_order)


def _row_note_texts(row: Mapping[str, Any]) -> list[str]:
    late = late_device_text(row)
    notes = [("recording lost", row["recording_lost"]), (late, late), ("marked", row["marked"])]
    return [text for text, applies in notes if applies] + (row["notes"] or "").splitlines()


def _setting_text(row: Mapping[str, Any], codes: Codes) -> str:
    """Return what a trial presented, with opened ``codes`` if any: "Part 1, L2", "Part 1, L2: thick, attempt 2"."""
    name = codes.get(row["block"], {}).get(row["code"])
    phase = f"Part {row['part']}" if row["part"] is not None else str(row["phase"]).capitalize()
    again = "" if row["attempt"] == 1 else f", attempt {row['attempt']}"
    return f"{phase}, {row['code']}{f': {name}' if name else ''}{again}"


def _about_text(lines: Sequence[Event], incidents: str) -> str:
    start, row = start_of(lines), participant_row(lines)
    ended = row["session_ended_at"]
    parts = [
        f"group {start.group}" if start.group is not None else "",
        f"device {start.device}",
        f"language {row['language']}",
        f"operator {start.operator}" if start.operator else "",
        f"seed {start.seed}",
        f"ended {_clock_time(ended)}" if ended else "not ended",
        counted(row["resumed"], "resume") if row["resumed"] else "",
        incidents,
    ]
    return capitalised("  ·  ".join(filter(None, parts)))


def _clock_time(recorded: str) -> str:
    """Return a recorded time as hours and minutes in the time zone of this computer."""
    return f"{datetime.fromisoformat(recorded).astimezone():%H:%M}"


def _note_texts(lines: Sequence[Event]) -> list[str]:
    trial, notes = None, []
    for line in lines:
        if isinstance(line, TrialStarted):  # also for notes on its recording, which come later
            trial = line.trial
        if not isinstance(line, Note | Repeat):
            continue
        text = f"repeated: {line.reason}" if isinstance(line, Repeat) else line.text or "marked"
        position = "before the first trial" if trial is None else f"trial {trial}"
        notes.append(f"{_clock_time(line.at)}, {position}: {text}")
    return notes


_HEADINGS = ("Trial", "Presented", "Ended", "Limits", "Answers", "Notes")
_WIDTHS = ((20, 56), (120, 130), (60, 90), (60, 134), (30, 70), (160, 120))
_SIZE = (1040, 700)


def _trial_cell(trial: TrialRecord, heading: str) -> dict[int, Any]:
    """Return the values of the cell in a trial's row under a heading, by their roles."""
    chip = _trial_chip(trial)
    text = {
        "Trial": str(trial.number),
        "Presented": trial.words,
        "Ended": trial.outcome,
        "Limits": chip[2],
        "Answers": f"{trial.answers} + {len(trial.unconfirmed)}?" if trial.unconfirmed else str(trial.answers),
        "Notes": trial.notes,
    }[heading]
    return {
        Qt.ItemDataRole.DisplayRole: text,
        Qt.ItemDataRole.AccessibleTextRole: text,
        Qt.ItemDataRole.ToolTipRole: _trial_limits_text(trial),
        CHIP_ROLE: chip if heading == "Limits" else None,
    }


def _trial_chip(trial: TrialRecord) -> Any:
    """Return the chip with the validity of a trial, or its exclusion."""
    if trial.excluded is not None:
        return "neutral", "cross", "Excluded"
    return VALIDITY[None if trial.valid is None else "valid" if trial.valid else "invalid"]


def _trial_limits_text(trial: TrialRecord) -> str:
    """Return a line about a trial's exclusion, limits, recording and unconfirmed answers."""
    text = f"Trial {trial.number}: "
    if trial.excluded is not None:
        text += f"excluded from the analysis ({trial.excluded}); "
    if trial.broken:
        text += "; ".join(trial.broken) + "."
    else:
        text += "whether it met the limits is not known yet." if trial.valid is None else "within all limits."
    if trial.lost:
        text += f" The recording was lost: {trial.lost}."
    if trial.unconfirmed:
        answers = ", ".join(trial.unconfirmed)
        text += f" These answers were chosen but not confirmed, so they are not in the tables: {answers}."
    return text


class SessionPage(Themed, QDialog):
    """The dialog with the record of a session, which is read in a thread; ``watched`` is the last replay's window."""

    def __init__(self, parent: QWidget, theme: Theme, facts: SessionFacts, opener: Callable[[Path], object]) -> None:
        super().__init__(parent)
        self.facts = facts
        self.record: SessionRecord | None = None
        self.watched: QDialog | None = None
        self._reader = Background(self)
        self._reader.done.connect(self._show_record)
        self._reader.failed.connect(self._show_unread)
        self.setWindowTitle(f"{facts.name}, {facts.study}")
        tone, icon, word = status_chip(facts)
        self.status = Chip(tone, icon, word)
        tone, icon, word = validity_chip(facts)
        self.validity = Chip(tone, icon, word)
        self.about, self.limits = label("", "body", "text2", wraps=True), label("", "body", wraps=True)
        self.model = Rows({heading: heading for heading in _HEADINGS}, _trial_cell)
        self.trials = Table(self.model, _WIDTHS, "Trials")
        self.trial = label("", "label", "text2", wraps=True)
        self.out, self.notes, self.files = (label("", "label", "text2", wraps=True) for _ in range(3))
        self.watch = ActionButton("play", "Watch again", height=36)
        self.folder = ActionButton("file", "Open the folder", role="plain", height=34)
        self.close_button = ActionButton("", "Close", role="primary", height=40)
        self._lay_out()
        self.trials.selectionModel().selectionChanged.connect(lambda *_changes: self._choose_trial())
        for signal in (self.watch.clicked, self.trials.opened):
            signal.connect(self._open_watch_window)
        self.folder.clicked.connect(lambda: opener(facts.folder))
        self.close_button.clicked.connect(self.accept)
        for button in (self.watch, self.folder):
            button.setAutoDefault(False)
        self.watch.setEnabled(False)
        apply_theme(self, theme)
        available = self.screen().availableSize()
        self.resize(min(_SIZE[0], available.width() - 40), min(_SIZE[1], available.height() - 60))
        self.trials.setFocus()
        self.read_folder()

    def read_folder(self) -> None:
        self._reader.run(partial(read_record, self.facts.folder))

    def _lay_out(self) -> None:
        kind = f"  ·  {self.facts.kind}" if self.facts.kind else ""
        title = label(f"{self.facts.name}  ·  {self.facts.study}{kind}", "title_dense")
        head = hbox(title, self.status, self.validity, STRETCH, spacing=12)
        trials = Card("Trials", self.watch, padding=16, gap=8)
        add_parts(trials.column, (self.trials, 1), self.trial)
        left = vbox((trials, 1))
        out = Card("Excluded", padding=16, gap=8)
        out.column.addWidget(self.out)
        notes = Card("Notes", padding=16, gap=8)
        notes.column.addWidget(self.notes)
        files = Card("Files", self.folder, padding=16, gap=8)
        self.files.setFont(font("small", tabular=True))
        files.column.addWidget(self.files)
        page = QWidget()
        vbox(out, notes, files, STRETCH, margins=0, parent=page)
        area = QScrollArea(widgetResizable=True)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setFixedWidth(372)
        area.setWidget(page)
        area.setAccessibleName("Exclusions, notes and files")
        body = hbox((left, 1), area, spacing=8)
        foot = hbox(STRETCH, self.close_button)
        vbox(head, self.about, self.limits, (body, 1), foot, spacing=8, margins=(24, 20, 24, 18), parent=self)

    def _show_unread(self, error: Exception) -> None:
        self.limits.setText(f"{str(error)[:1].upper()}{str(error)[1:]}.")
        set_ink(self.limits, "bad")

    def _show_record(self, record: SessionRecord) -> None:
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
        self.files.setText("\n".join(f"{name}  {_size_text(size)}" for name, size in record.files))
        left_out = (
            f"{'Whole session' if exclusion.trial is None else f'Trial {exclusion.trial}'}: "
            f"{exclusion.reason} ({exclusion.rule_or_person})"
            for exclusion in record.left_out
        )
        self.out.setText("\n".join(left_out) or "Nothing is excluded from the analysis.")
        self._choose_trial()

    @property
    def chosen(self) -> TrialRecord | None:
        row = self.trials.chosen_row
        return None if row is None else self.model.rows[row]

    def _choose_trial(self) -> None:
        trial = self.chosen
        self.watch.setEnabled(trial is not None)
        if trial is None or self.record is None:
            self.trial.setText("No trials yet.")
            return
        self.trial.setText(_trial_limits_text(trial))
        set_ink(self.trial, "warn" if trial.broken else "text2")

    def _open_watch_window(self) -> None:
        from study_app.gui.watch.window import WatchWindow  # noqa: PLC0415 - imports pyqtgraph, so only on demand

        if (trial := self.chosen) is not None:
            self.watched = window = WatchWindow(
                self, self.theme, self.facts.folder, trial.number, attempt=trial.attempt, presented=trial.words
            )
            window.finished.connect(window.deleteLater)
            window.open()


def _size_text(size: int) -> str:
    return f"{size / 1e6:.1f} MB" if size >= 1_000_000 else f"{max(1, round(size / 1e3))} kB"
