"""Tables from journals: pure functions of the lines alone, so any table can be made again at any time.

A row is a dictionary from column name to value; ``csv_bytes`` writes rows with the columns of ``columns.py``, in their
order, the same bytes for the same rows on every machine.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from study_app.errors import StoreError
from study_app.store.journals.journal import Line
from study_app.store.tables.columns import RESPONSES, TRIALS, Column, header, unsealed
from study_app.store.tables.csv_files import Row

_SESSION_COLUMNS = ("study", "participant", "session", "simulated", "pilot")
_TRIAL_COLUMNS = ("trial", "attempt", "block", "phase", "part", "index", "code")
_RECORDED = ("recording", "recording_frames", "samples_recorded", "samples_unrecorded")
_DERIVED = ("trial_started_at", "trial_started_s", "outcome", "valid", *_RECORDED, "recording_lost", "marked", "notes")
_MEASURED = tuple(name for name in header(TRIALS) if name not in (*_SESSION_COLUMNS, *_TRIAL_COLUMNS, "of", *_DERIVED))

# What is judged in a trial's row by which limit of the protocol.
_JUDGED = (
    ("lateness_p99_ms", "lateness_ms"),
    ("worst_gap_ms", "worst_gap_ms"),
    ("delay_error_p95_ms", "delay_error_ms"),
    ("first_frame_gap_ms", "frame_gap_ms"),
    ("worst_frame_gap_ms", "frame_gap_ms"),
    ("withheld_share", "withheld_percent"),
)
_LEAST = "targets_reached"  # judged by "targets_percent": the only measure with a least value


class SessionRows:
    """The rows of a session's tables, followed line by line.

    ``responses`` has one row per response, in the order of confirmation; ``trials`` one per presentation of a trial, in
    order; the running one has no outcome yet. ``changed`` is the index of the first row of ``trials`` that was added or
    changed since somebody set it; rows of ``responses`` never change.

    Raises
    ------
    StoreError
        The lines do not begin as a session's do, or tell of a trial that never started.
    """

    def __init__(self, lines: Sequence[Line]) -> None:
        self.responses: list[Row] = []
        self.trials: list[Row] = []
        self.changed = 0
        self._session = _session(lines)
        self._limits = lines[0].get("limits", {})
        self._started: dict[tuple[int, int], Line] = {}
        self._places: dict[tuple[int, int], int] = {}  # in trials
        self._broke = self._reconnected = ""
        for line in lines:
            self.take(line)

    def take(self, line: Line) -> None:
        """Follow one more line."""
        match line["event"]:
            case "trial_started":
                self._interrupt()
                which = line["trial"], line["attempt"]
                repeats = bool(self.trials) and self.trials[-1]["trial"] == line["trial"]
                self._started[which], self._places[which] = line, len(self.trials)
                self.trials.append(_trial(self._session, line))
                if self._reconnected and repeats:
                    _note(self.trials[-1], f"presented again: {self._reconnected}")
                self._reconnected = ""
            case "trial_ended":
                row = self._row_of(line)
                row |= {name: line.get(name) for name in _MEASURED}
                row |= {"outcome": line["outcome"], "valid": within_limits(row, self._limits)}
            case "responses":
                if (trial := self._started.get((line["trial"], line["attempt"]))) is None:
                    raise _never_started(line)
                self.responses += [_response(self._session, trial, answer, line["at"]) for answer in line["items"]]
            case "session_ended" | "session_resumed":
                self._interrupt()
            case "recorded":
                row = self._row_of(line)
                row |= {name: line[name] for name in _RECORDED}
            case "recording_lost":
                self._row_of(line)["recording_lost"] = line["reason"]
            case "broke":
                self._broke = line["what"]
            case "device_reconnected" if self.trials:
                self._reconnected = f"the device failed and was connected again ({self._broke})"
                _note(self._last(), self._reconnected)
            case "note" if self.trials:
                _note(self._last(), line["text"], mark=line["kind"] == "mark")
            case "repeat" if self.trials:
                _note(self._last(), f"repeated: {line['reason']}")

    def _row_of(self, line: Line) -> Row:
        if (place := self._places.get((line["trial"], line["attempt"]))) is None:
            raise _never_started(line)
        self.changed = min(self.changed, place)
        return self.trials[place]

    def _last(self) -> Row:
        self.changed = min(self.changed, len(self.trials) - 1)
        return self.trials[-1]

    def _interrupt(self) -> None:
        """Say of a trial that was left without its end that it was interrupted."""
        if self.trials and self.trials[-1]["outcome"] is None:
            self._last()["outcome"] = "interrupted"


def responses(lines: Sequence[Line]) -> list[Row]:
    """Return one row per response, in the order of confirmation."""
    return SessionRows(lines).responses


def trials(lines: Sequence[Line]) -> list[Row]:
    """Return one row per presentation of a trial, in order; the running one has no outcome yet."""
    return SessionRows(lines).trials


def trial_columns(lines: Sequence[Line], *, opened: bool) -> tuple[Column, ...]:
    """Return the columns of the trials' table: without the sealed ones where they are sealed and not ``opened``."""
    return TRIALS if opened or not lines[0].get("measures_sealed") else unsealed(TRIALS)


def participant(lines: Sequence[Line]) -> Row:
    """Return the session's row of the participants table."""
    start, rows = lines[0], SessionRows(lines)
    ends = [line for line in lines if line["event"] == "session_ended"]
    main = [row for row in latest(rows.trials) if row["phase"] == "main" and row["outcome"] in ("complete", "timeout")]
    answered = [row for row in latest(rows.responses) if row["phase"] == "main" and row["first_choice_s"] is not None]
    verdicts = [row["valid"] for row in main if row["valid"] is not None]
    return {
        **_session(lines),
        "status": ends[-1]["status"] if ends else "unfinished",
        "session_started_at": start["at"],
        "session_ended_at": ends[-1]["at"] if ends else None,
        "resumed": sum(line["event"] == "session_resumed" for line in lines),
        "device": start.get("device"),
        "language": language(lines),
        "trials": len(main),
        "responses": len(answered),
        "validity": None if not verdicts else "valid" if all(verdicts) else "invalid",
    }


def language(lines: Sequence[Line]) -> str:
    """Return the language of the participant's pages: the session's own, or what was chosen instead."""
    chosen = [line["language"] for line in lines if line["event"] == "language_chosen"]
    return str(chosen[-1] if chosen else lines[0]["language"])


def within_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> bool | None:
    """Return whether a trial's measured columns keep the protocol's limits, by size; None where nothing was measured.

    ``limits`` are those of the journal's first line, or ``Limits`` of a protocol as a mapping.
    """
    judged = _judged(measured, limits)
    return not beyond_limits(measured, limits) if judged else None


def beyond_limits(measured: Mapping[str, Any], limits: Mapping[str, float]) -> tuple[tuple[str, float, float], ...]:
    """Return which of a trial's measured columns break a limit: the column's name, its value and the limit.

    Value and limit are in the limit's unit, ms or percent.
    """
    return tuple(one for one in _judged(measured, limits) if not _keeps(*one))


def _keeps(measure: str, value: float, limit: float) -> bool:
    return value >= limit if measure == _LEAST else abs(value) <= limit


def _judged(measured: Mapping[str, Any], limits: Mapping[str, float]) -> list[tuple[str, float, float]]:
    judged = [
        (measure, measured[measure] * (100 if limit.endswith("_percent") else 1), limits[limit])
        for measure, limit in _JUDGED
        if measured.get(measure) is not None and limit in limits
    ]
    reached, targets = measured.get(_LEAST), measured.get("targets")
    if "targets_percent" in limits and reached is not None and targets:
        judged.append((_LEAST, 100 * reached / targets, limits["targets_percent"]))
    return judged


def latest(rows: Iterable[Row]) -> list[Row]:
    """Return the rows of each trial's last attempt, in order."""
    rows = list(rows)
    last: dict[int, int] = {}
    for row in rows:
        last[row["trial"]] = max(row["attempt"], last.get(row["trial"], 0))
    return [row for row in rows if row["attempt"] == last[row["trial"]]]


def _session(lines: Sequence[Line]) -> Row:
    if not lines or lines[0]["event"] != "session_started":
        raise StoreError("the journal does not begin with session_started: it is no journal of a session")
    return {name: lines[0][name] for name in _SESSION_COLUMNS}


def _response(session: Row, trial: Line, answer: Mapping[str, Any], answered_at: str) -> Row:
    row: Row = {
        **session,
        **{name: trial[name] for name in _TRIAL_COLUMNS},
        "item": answer["item"],
        "number": answer["number"],
        "response": answer["value"],
        "cannot_judge": answer["value"] is None and answer["first_s"] is not None,
        "onset_s": answer["onset_s"],
        "first_choice_s": answer["first_s"],
        "last_change_s": answer["last_s"],
        "changes": answer["changes"],
        "answered_at": answered_at,
    }
    return {name: row[name] for name in header(RESPONSES)}


def _trial(session: Row, line: Line) -> Row:
    row: Row = dict.fromkeys(header(TRIALS))
    row |= session
    row |= {name: line[name] for name in (*_TRIAL_COLUMNS, "of")}
    row |= {"trial_started_at": line["at"], "trial_started_s": line["t_s"], "marked": False}
    return row


def _never_started(line: Line) -> StoreError:
    return StoreError(f"the journal's line {line['n']} is about trial {line['trial']}, which never started")


def _note(row: Row, text: str, *, mark: bool = False) -> None:
    row["marked"] = row["marked"] or mark
    if text:
        row["notes"] = text if row["notes"] is None else f"{row['notes']}\n{text}"
