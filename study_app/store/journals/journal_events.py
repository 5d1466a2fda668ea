"""The journal's dictionary: every event, what it says, and its fields beside ``n``, ``event``, ``t_s`` and ``at``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from study_app.store.journals.parsing import PARTICIPANT_ID, RECORDING_NAME, STUDY_NAME
from study_app.store.tables.columns import TRIALS

SHOWN = 200  # characters of a bad value that a message repeats


@dataclass(frozen=True, slots=True)
class Event:
    """One kind of line: its name, its meaning, and the fields that every one of its lines has."""

    name: str
    description: str
    fields: tuple[str, ...] = ()


_SESSION = ("participant", "session", "study", "seed", "language", "operator", "simulated", "pilot", "recordings")
_HASHES = ("key_hash", "protocol_hash", "version")
_WHICH = ("trial", "attempt")

EVENTS: tuple[Event, ...] = (
    Event(
        "session_started",
        "The session began: always the first line; `measures_sealed` says whether sealed columns are encrypted.",
        (*_SESSION, *_HASHES, "device", "limits"),
    ),
    Event(
        "session_resumed",
        "It was taken up again after its program had ended, so long after the line before.",
        ("gap_s", "torn_bytes", "operator", "device", "version"),
    ),
    Event("preflight", "What was found before the first page, and accepted by going on.", ("checks",)),
    Event("page_shown", "A page of text was shown.", ("page",)),
    Event("page_left", "The participant went on from it.", ("page",)),
    Event("language_chosen", "The participant reads in another of the study's languages from here on.", ("language",)),
    Event("trial_started", "A trial was presented.", (*_WHICH, "block", "phase", "part", "index", "of", "code")),
    Event("target_reached", "A target was reached, on the task's clock.", ("trial", "target", "t_task_s")),
    Event(
        "trial_ended",
        "The trial's task was over, and what was measured of it; `sealed` holds the sealed columns, encrypted.",
        (*_WHICH, "outcome"),
    ),
    Event(
        "recorded",
        "The trial's recording is whole on the disk, under these names and checksums.",
        (
            *_WHICH,
            "recording",
            "recording_frames",
            "samples_recorded",
            "samples_unrecorded",
            "frames_recorded",
            "sha256",
            "frames_sha256",
        ),
    ),
    Event("recording_lost", "The trial's recording could not be kept.", (*_WHICH, "reason")),
    Event("item_shown", "A statement was shown.", ("trial", "item")),
    Event("choice", "An answer was chosen; the last one counts.", ("trial", "item", "value")),
    Event("responses", "The page of statements was confirmed: every answer.", (*_WHICH, "items")),
    Event("paused", "The session was paused.", ("by",)),
    Event("resumed", "The pause was over.", ("by",)),
    Event("force_stopped", "The force was stopped.", ("by",)),
    Event("force_restored", "The force came back.", ("by",)),
    Event("note", "The operator wrote a note, or marked the trial.", ("kind", "text")),
    Event("repeat", "The operator had the trial presented again.", ("trial", "reason")),
    Event("broke", "Device, servo or program failed.", ("what",)),
    Event(
        "device_reconnected",
        "The device that had failed was open and homed again, as `described`; the force stayed off until `resumed`.",
        ("device", "described"),
    ),
    Event("session_ended", "The session was over: always the last line.", ("status", "reason")),
)

_OF_ALL = ("n", "event", "t_s", "at")
_BY_NAME = {event.name: event for event in EVENTS}
EVENT_NAMES = frozenset(_BY_NAME)

_MOST_SECONDS = 1e9  # of a session's clock
_MOST = 10**30  # no whole number that the program writes is greater


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_study(value: object) -> bool:
    return isinstance(value, str) and STUDY_NAME.fullmatch(value) is not None


def _is_participant(value: object) -> bool:
    return isinstance(value, str) and PARTICIPANT_ID.fullmatch(value) is not None


def _is_recording(value: object) -> bool:
    return isinstance(value, str) and RECORDING_NAME.fullmatch(value) is not None


def _is_flag(value: object) -> bool:
    return isinstance(value, bool)


def _is_integer(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) <= _MOST


def _is_number(value: object) -> bool:
    return _is_integer(value) or (isinstance(value, float) and math.isfinite(value))


def _is_time(value: object) -> bool:
    if not isinstance(value, str):
        return False
    try:
        moment = datetime.fromisoformat(value)
    except ValueError:
        return False
    return moment.tzinfo is not None and 1 < moment.year < 9999  # in any zone


def _is_object(value: object) -> bool:
    return isinstance(value, dict)


def _are_objects(value: object) -> bool:
    return isinstance(value, list) and all(map(_is_object, value))


def _are_limits(value: object) -> bool:
    return isinstance(value, dict) and all(map(_is_number, value.values()))


def _are_answers(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(answer, dict) and all(name in answer and holds(name, answer[name]) for name in _ANSWER)
        for answer in value
    )


_ANSWER = ("item", "number", "value", "onset_s", "first_s", "last_s", "changes")
_KINDS: Mapping[str, Callable[[object], bool]] = {
    "text": _is_text,
    "study's name": _is_study,
    "participant's id": _is_participant,
    "recording's name": _is_recording,
    "flag": _is_flag,
    "integer": _is_integer,
    "number": _is_number,
    "time": _is_time,
    "object": _is_object,
    "list of objects": _are_objects,
    "table of numbers": _are_limits,
    "list of answers": _are_answers,
}
_MAY_BE_NULL = ("part", "value", "onset_s", "first_s", "last_s", "gap_s", "device", "t_task_s")
_KIND_OF: dict[str, tuple[str, bool]] = {column.name: (column.kind, True) for column in TRIALS} | {
    name: (kind, name in _MAY_BE_NULL)
    for kind, names in {
        "text": "language operator key_hash protocol_hash version device page block phase code item "
        "outcome sealed sha256 frames_sha256 reason by kind text what status previous",
        "study's name": "study",
        "participant's id": "participant",
        "recording's name": "recording recording_frames",
        "flag": "simulated pilot recordings measures_sealed",
        "integer": "n format session seed torn_bytes trial attempt part index of target samples_recorded "
        "samples_unrecorded frames_recorded number value changes",
        "number": "t_s gap_s t_task_s onset_s first_s last_s",
        "time": "at",
        "object": "described",
        "list of objects": "checks",
        "table of numbers": "limits",
        "list of answers": "items",
    }.items()
    for name in names.split()
}
"""What a field of that name holds, in any event that this version knows, and whether it may be null."""


def problem(line: Mapping[str, Any]) -> str | None:
    """Return what is wrong with a line of a journal, or None.

    A line lacks no field of its event, and every field that the dictionary knows is of its kind, in events of another
    version, too.
    """
    event = line.get("event")
    if not isinstance(event, str):
        return "it names no event"
    known = _BY_NAME.get(event)
    if lacking := [name for name in (*_OF_ALL, *(known.fields if known else ())) if name not in line]:
        return f"({event}) lacks {', '.join(lacking)}"
    for name in line:
        if not holds(name, line[name]):
            return f"({event}) holds {name} {shortened(line[name])}, expected: {_KIND_OF[name][0]}"
    return None if 0 <= line["t_s"] <= _MOST_SECONDS else f"({event}) has t_s {line['t_s']:g}"


def shortened(value: object) -> str:
    """Return ``value`` as a message repeats it."""
    shown = repr(value)
    return shown if len(shown) <= SHOWN else f"{shown[:SHOWN]}…"


def unknown_events(lines: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the names of events that the dictionary does not know, each once."""
    yield from {line["event"]: None for line in lines if line["event"] not in EVENT_NAMES}


def holds(name: str, value: object) -> bool:
    """Return whether ``value`` is what a field called ``name`` holds; an unknown field may hold anything."""
    if name not in _KIND_OF:
        return True
    kind, may_be_null = _KIND_OF[name]
    return may_be_null if value is None else _KINDS[kind](value)
