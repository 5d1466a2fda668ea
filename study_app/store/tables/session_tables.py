"""Tables from journals: pure functions of the lines, so that any table can be recreated at any time.

A row is a dictionary from column name to value; ``csv_bytes`` writes rows with the columns of ``columns.py``, in their
order, the same bytes for the same rows on every machine. All tables of 230 trials of two intervals take 30 ms.
"""

from collections.abc import Iterable, Sequence
from typing import Any, Final

from study_app.errors import StoreError
from study_app.store.files.columns import DELIVERED, INTERVALS, RESPONSES, TRIALS, TRIALS_MISSING
from study_app.store.files.csv_files import Column, Row, header, unsealed_columns
from study_app.store.journals import journal_events as events
from study_app.store.session_progress.delivered import is_within_limits
from study_app.store.session_progress.progress import progress_of

VALID: Final = "valid"
_PRESENTED: Final = {"S": "standard", "C": "comparison"}
_TRIAL_VALUE: Final = {column.name: column.of_trial for column in TRIALS}
_END_COLUMNS = header(INTERVALS[[column.name for column in INTERVALS].index("invalid_reasons") :])
_SESSION_COLUMNS = ("study", "participant", "session", "simulated", "pilot")
_TRIAL_COLUMNS = ("trial", "attempt", "block", "phase", "part", "index", "code")
_RECORDED = ("recording", "recording_frames", "samples_recorded", "samples_unrecorded")
_DERIVED = ("trial_started_at", "trial_started_s", "outcome", "valid", *_RECORDED, "recording_lost", "marked", "notes")
_NOT_MEASURED = (*_SESSION_COLUMNS, *_TRIAL_COLUMNS, "of", *_DERIVED, "intervals", "group")
_MEASURED = tuple(name for name in header(TRIALS) if name not in _NOT_MEASURED)
_DELIVERED = header(DELIVERED)


class SessionRows:
    """The rows of a session's tables, updated line by line.

    ``responses`` has one row per response, in the order of confirmation; ``trials`` one per presentation of a trial, in
    order; the running one has no outcome yet. ``intervals`` has one row per interval of a trial with a design.
    """

    def __init__(self, lines: Sequence[events.Event]) -> None:
        self.responses: list[Row] = []
        self.trials: list[Row] = []
        self.intervals: list[Row] = []
        self._start = events.start_of(lines)
        self._session = _session_cells(self._start)
        self._limits = self._start.limits
        self._started: dict[tuple[int, int], events.TrialStarted] = {}
        self._trial_indices: dict[tuple[int, int], int] = {}  # in trials
        self._interval_indices: dict[tuple[int, int, int], int] = {}  # in intervals
        self._failure = self._reconnected = ""
        for line in lines:
            self.process_line(line)

    def table(self, name: str) -> list[Row]:
        """Return the rows of the table with this name."""
        return {"responses": self.responses, "trials": self.trials, "intervals": self.intervals}[name]

    def process_line(self, line: events.Event) -> None:
        """Process one more line."""
        match line:
            case events.TrialStarted():
                self._mark_interrupted()
                key = line.trial, line.attempt
                repeats = bool(self.trials) and self.trials[-1]["trial"] == line.trial
                self._started[key], self._trial_indices[key] = line, len(self.trials)
                self.trials.append(_trial_row(self._session, self._start.group, line))
                if self._reconnected and repeats:
                    _add_note(self.trials[-1], f"presented again: {self._reconnected}")
                self._reconnected = ""
            case events.TrialEnded(outcome=outcome):
                row = self._find_row(line)
                row |= self._measured_cells(line)
                valid = is_within_limits(row, self._start.limits) if outcome != events.UNDELIVERED else False
                row |= {"outcome": outcome, "valid": valid}
            case events.Responses():
                if (trial := self._started.get((line.trial, line.attempt))) is None:
                    raise _unknown_trial_error(line)
                cells = {name: getattr(trial, name) for name in _TRIAL_COLUMNS}
                self.responses += [_response_row(self._session, cells, answer, line.at) for answer in line.items]
            case events.FormAnswered():
                cells = {**dict.fromkeys(_TRIAL_COLUMNS), "form": line.form, "after_block": line.after}
                self.responses += [_response_row(self._session, cells, answer, line.at) for answer in line.items]
            case events.SessionEnded() | events.SessionResumed():
                self._mark_interrupted()
            case events.IntervalStarted():
                self._begin_interval(line)
            case events.IntervalEnded(outcome=outcome):
                row, reasons = self._find_row(line), line.invalid or ()
                row |= {name: line.others.get(name) for name in (*_MEASURED, *_DELIVERED)}
                row["ended_s"] = line.t_s
                row |= {"outcome": outcome, "invalid_reasons": " ".join(reasons) or None}
                row |= {"valid": is_within_limits(row, self._start.limits) if not reasons else False}
            case events.Recorded():
                self._find_row(line).update((name, getattr(line, name)) for name in _RECORDED)
            case events.RecordingLost():
                self._find_row(line)["recording_lost"] = line.reason
            case events.Broke():
                self._failure = line.what
            case events.DeviceReconnected() if self.trials:
                withheld = self._failure == events.CAUSE_WITHHELD
                failed = f"the device failed and was reconnected ({self._failure})"
                self._reconnected = f"{events.CAUSE_WITHHELD} and continued" if withheld else failed
                _add_note(self.trials[-1], self._reconnected)
            case events.Note() if self.trials:
                _add_note(self.trials[-1], line.text, mark=line.kind == "mark")
            case events.Repeat() if self.trials:
                _add_note(self.trials[-1], f"repeated: {line.reason}")

    def _find_row(self, line: events.OfAttempt) -> Row:
        """Return the row of the interval or trial to which a line belongs."""
        trial, attempt, interval = line.which
        trial_index = self._trial_indices.get((trial, attempt))
        index = trial_index if interval is None else self._interval_indices.get((trial, attempt, interval))
        if index is None:
            raise _unknown_trial_error(line)
        return self.trials[index] if interval is None else self.intervals[index]

    def _begin_interval(self, line: events.IntervalStarted) -> None:
        key, number = (line.trial, line.attempt), line.interval
        if key not in self._trial_indices:
            raise _unknown_trial_error(line)
        previous_index = self._interval_indices.get((*key, number - 1))
        self._interval_indices[*key, number] = len(self.intervals)
        previous = None if previous_index is None else self.intervals[previous_index]
        trial = self.trials[self._trial_indices[key]]
        if trial.get("intervals") is None:
            raise StoreError(
                f"line {line.n} of the journal records an interval of trial {line.trial}, which does not have "
                "intervals: restore it from a backup"
            )
        trial["intervals"] += 1
        self.intervals.append(_interval_row(trial, self._started[key], line, previous))

    def _measured_cells(self, line: events.TrialEnded) -> Row:
        """Return the measures of a completed trial, combined from all its intervals if it has a design."""
        attempt_key = line.trial, line.attempt
        if not self._started[attempt_key].has_intervals:
            return {name: line.others.get(name) for name in _MEASURED}
        rows = [self.intervals[index] for key, index in self._interval_indices.items() if key[:2] == attempt_key]
        values = {name: [row[name] for row in rows if row.get(name) is not None] for name in _MEASURED}
        return {name: _combine_values(name, values[name]) for name in _MEASURED}

    def _mark_interrupted(self) -> None:
        """Set the outcome of a trial without an end to interrupted."""
        for rows in (self.trials, self.intervals):
            if rows and rows[-1]["outcome"] is None:
                rows[-1]["outcome"] = "interrupted"


def table_columns(lines: Sequence[events.Event], *, opened: bool) -> dict[str, tuple[Column, ...]]:
    """Return the columns of a session's tables by name, without sealed columns unless ``opened``.

    Only a study with designs has a table of intervals.
    """
    tables = {"responses": RESPONSES, "trials": TRIALS}
    if events.start_of(lines).intervals:
        tables["intervals"] = INTERVALS
    shows_sealed = opened or not events.start_of(lines).measures_sealed
    return {name: columns if shows_sealed else unsealed_columns(columns) for name, columns in tables.items()}


def participant_row(lines: Sequence[events.Event]) -> Row:
    """Return the session's row of the participants table."""
    start, rows, progress = events.start_of(lines), SessionRows(lines), progress_of(lines)
    main = [
        row
        for row in latest_attempts(rows.trials)
        if row["phase"] == "main" and row["outcome"] in ("complete", "timeout")
    ]
    main_rows = latest_attempts(row for row in rows.responses if row["phase"] == "main")
    form_rows = (row for row in rows.responses if row["form"] is not None)
    answered = [row for row in (*main_rows, *form_rows) if row["first_choice_s"] is not None]
    last = lines[-1]
    recorded = last.within_limits if isinstance(last, events.SessionEnded) else None
    verdicts = [row["valid"] for row in main if row["valid"] is not None] if recorded is None else [recorded]
    return {
        **_session_cells(start),
        "group": start.group,
        "status": "unfinished" if progress.ended is None else progress.ended,
        "session_started_at": start.at,
        "session_ended_at": next((line.at for line in reversed(lines) if isinstance(line, events.SessionEnded)), None),
        "resumed": progress.resumed,
        "device": start.device,
        "language": progress.language,
        "trials": len(main),
        "responses": len(answered),
        "validity": None if not verdicts else VALID if all(verdicts) else "invalid",
        **({TRIALS_MISSING.name: progress.missing_trials.count} if start.intervals else {}),
    }


def latest_attempts(rows: Iterable[Row]) -> list[Row]:
    """Return the rows of the last attempt at each trial, in order."""
    rows = list(rows)
    last: dict[int, int] = {}
    for row in rows:
        last[row["trial"]] = max(row["attempt"], last.get(row["trial"], 0))
    return [row for row in rows if row["attempt"] == last[row["trial"]]]


def _interval_row(trial: Row, started: events.TrialStarted, line: events.IntervalStarted, previous: Row | None) -> Row:
    """Return a new row for an interval that begins."""
    row: Row = {name: trial.get(name) for name in header(INTERVALS)} | dict.fromkeys(_END_COLUMNS)
    number = line.interval
    ended_s = None if previous is None else previous["ended_s"]
    arrangement = started.arrangement
    if arrangement is not None and not (0 < number <= len(arrangement) and set(arrangement) <= set(_PRESENTED)):
        raise StoreError(
            f"line {line.n} of the journal records an interval that its trial does not have: restore it from a backup"
        )
    return row | {
        "interval": number,
        "interval_started_s": line.t_s,
        "gap_s": None if ended_s is None else round(line.t_s - ended_s, 6),
        "presented": None if arrangement is None else _PRESENTED[arrangement[number - 1]],
        "standard": started.standard,
        "level": started.level,
        "catch": started.catch,
    }


def _combine_values(name: str, values: list[Any]) -> Any:
    if not values:
        return None
    if _TRIAL_VALUE[name] == "max":
        return max(values)
    total = sum(values)
    combined = total / len(values) if _TRIAL_VALUE[name] == "mean" else total
    return round(combined, 6) if isinstance(combined, float) else combined


def _session_cells(start: events.SessionStarted) -> Row:
    return {name: getattr(start, name) for name in _SESSION_COLUMNS}


def _response_row(session: Row, cells: Row, answer: events.Response, answered_at: str) -> Row:
    """Return the row of an answer, with the answer as text and as number."""
    value = answer.value
    row = {
        **session,
        "form": None,
        "after_block": None,
        **cells,
        "kind": answer.kind,
        "response": " ".join(value) if isinstance(value, list | tuple) else None if value is None else str(value),
        "value": value if isinstance(value, int | float) else None,
        "item": answer.item,
        "number": answer.number,
        "cannot_judge": value is None and answer.given,
        "onset_s": answer.onset_s,
        "first_choice_s": answer.first_s,
        "last_change_s": answer.last_s,
        "changes": answer.changes,
        "answered_at": answered_at,
    }
    return {name: row[name] for name in header(RESPONSES)}


def _trial_row(session: Row, group: str | None, line: events.TrialStarted) -> Row:
    row: Row = dict.fromkeys(header(TRIALS)) | session | {"group": group}
    row["intervals"] = 0 if line.has_intervals else None
    row |= {name: getattr(line, name) for name in (*_TRIAL_COLUMNS, "of")}
    return row | {"trial_started_at": line.at, "trial_started_s": line.t_s, "marked": False}


def _unknown_trial_error(line: events.OfAttempt) -> StoreError:
    return StoreError(
        f"line {line.n} of the journal refers to trial {line.trial}, which never started: restore it from a backup"
    )


def _add_note(row: Row, text: str, *, mark: bool = False) -> None:
    row["marked"] = row["marked"] or mark
    if text:
        row["notes"] = text if row["notes"] is None else f"{row['notes']}\n{text}"
