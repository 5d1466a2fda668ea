"""The journal's dictionary: every event, its meaning, and its fields besides ``n``, ``event``, ``t_s`` and ``at``."""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from study_app.store.folders import PARTICIPANT_ID, RECORDING_NAME, STUDY_NAME
from study_app.store.tables.columns import DELIVERED, TRIALS, VIDEO

SHOWN = 200  # characters of a bad value shown in messages

CAUSE_WITHHELD = "the session was stopped"
"""Text of `broke` for a failed device or video in a study with videos: the cause would reveal the condition."""


@dataclass(frozen=True, slots=True)
class Event:
    """One kind of line: its name, its meaning, the fields that every one of its lines has, and of ``one_of`` one."""

    name: str
    description: str
    fields: tuple[str, ...] = ()
    one_of: tuple[str, ...] = ()


_SESSION = ("participant", "session", "study", "seed", "language", "operator", "simulated", "pilot", "recordings")
_HASHES = ("key_hash", "protocol_hash", "version")
_WHICH = ("trial", "attempt")
_PAGE = ("trial", "form")

EVENTS: tuple[Event, ...] = (
    Event(
        "session_started",
        "The session began: always the first line; `measures_sealed` says whether sealed columns are encrypted.",
        (*_SESSION, *_HASHES, "device", "limits"),
    ),
    Event(
        "session_resumed",
        "It was resumed after its program had ended; `gap_s` is the time since the line before.",
        ("gap_s", "torn_bytes", "operator", "device", "version"),
    ),
    Event(
        "allocated",
        "The participant has this entry in the allocation to groups; `sealed` holds the group. Once per participant.",
        ("entry", "sealed"),
    ),
    Event("preflight", "The checks before the first page, as accepted by the operator.", ("checks",)),
    Event("page_shown", "A page of text was shown.", ("page",)),
    Event(
        "page_left",
        "The participant left it; of a consent `text_sha256` is the SHA-256 of title and paragraphs as they were read, "
        "in UTF-8 with blank lines between them, and `study_version` the version of the study.",
        ("page",),
    ),
    Event("language_chosen", "The participant chose another language of the study.", ("language",)),
    Event(
        "trial_started",
        "A trial was presented; with a design `sealed` contains level, standard, arrangement and catch, encrypted.",
        (*_WHICH, "block", "phase", "part", "index", "of", "code"),
    ),
    Event("interval_started", "An interval of a trial was presented.", (*_WHICH, "interval")),
    Event(
        "interval_ended",
        "The interval's task ended, with its measures; `sealed` contains the sealed columns, encrypted. `invalid` "
        "names the limits that it breaks: the trial is then presented again.",
        (*_WHICH, "interval", "outcome"),
    ),
    Event("feedback_shown", "The participant saw whether the answer was correct.", _WHICH),
    Event("passed_over", "A trial, or the break after it, was not due.", ("reason",), ("trial", "page")),
    Event(
        "stepped",
        "The participant adjusted the level by so many steps, more of the varied number above 0; `scene` is the number "
        "of the presented scene from then on, n/a where no force depends on it.",
        (*_WHICH, "steps", "scene"),
    ),
    Event("target_reached", "A target was reached, on the task's clock.", ("trial", "target", "t_task_s")),
    Event(
        "trial_ended",
        "The trial's task ended, with its measures; `sealed` contains the sealed columns, encrypted.",
        (*_WHICH, "outcome"),
    ),
    Event(
        "recorded",
        "The trial's recording is complete on the disk, with these names and checksums.",
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
    Event("recording_lost", "The trial's recording could not be stored.", (*_WHICH, "reason")),
    Event("outlet_lost", "Markers or samples no longer reach other programs by this outlet.", ("outlet", "reason")),
    Event("form_shown", "A questionnaire was shown on its own.", ("form",)),
    Event("item_shown", "A question was shown, of a trial or a form.", ("item",), _PAGE),
    Event("choice", "An answer was chosen; the last one counts.", ("item", "value"), _PAGE),
    Event("answer_removed", "An answer was taken back, or an earlier one hid its question.", ("item",), _PAGE),
    Event("responses", "The page of questions was confirmed: every answer.", (*_WHICH, "items")),
    Event("form_answered", "The form was confirmed: every answer.", ("form", "items")),
    Event("paused", "The session was paused.", ("by",)),
    Event("resumed", "The pause ended.", ("by",)),
    Event("force_stopped", "The force was stopped.", ("by",)),
    Event("force_restored", "The force was turned on again.", ("by",)),
    Event("note", "The operator wrote a note, or marked the trial.", ("kind", "text")),
    Event("repeat", "The operator repeated the trial.", ("trial", "reason")),
    Event(
        "broke",
        "Device, servo or program failed. In a study with videos `what` does not say whether a device or a video did.",
        ("what",),
    ),
    Event(
        "device_reconnected",
        "The failed device, or video, was opened again; `described` is the device from then on. The force stayed off "
        "until `resumed`.",
        ("device", "described"),
    ),
    Event("session_ended", "The session ended: always the last line.", ("status", "reason")),
)

_OF_ALL = ("n", "event", "t_s", "at")
_BY_NAME = {event.name: event for event in EVENTS}
EVENT_NAMES = frozenset(_BY_NAME)

_MOST_SECONDS = 1e9  # of a session's clock
_MOST = 10**30  # greatest integer that the program writes


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


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _are_answers(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(answer, dict)
        and all(name in answer and holds(_field(answer, name), answer[name]) for name in _ANSWER)
        for answer in value
    )


def _matches(pattern: re.Pattern[str]) -> Callable[[object], bool]:
    return lambda value: isinstance(value, str) and pattern.fullmatch(value) is not None


_ANSWER = ("item", "number", "value", "onset_s", "first_s", "last_s", "changes")
_KINDS: Mapping[str, Callable[[object], bool]] = {
    "text": lambda value: isinstance(value, str),
    "study's name": _matches(STUDY_NAME),
    "participant's id": _matches(PARTICIPANT_ID),
    "recording's name": _matches(RECORDING_NAME),
    "flag": lambda value: isinstance(value, bool),
    "integer": _is_integer,
    "number": _is_number,
    "time": _is_time,
    "object": lambda value: isinstance(value, dict),
    "list of objects": lambda value: isinstance(value, list) and all(isinstance(one, dict) for one in value),
    "table of numbers": lambda value: isinstance(value, dict) and all(map(_is_number, value.values())),
    "answer": lambda value: isinstance(value, str) or _is_number(value) or _are_texts(value),
    "list of answers": _are_answers,
    "list of texts": _are_texts,
}
_MAY_BE_NULL = (
    "level", "standard", "part", "value", "answer", "onset_s", "first_s", "last_s", "gap_s", "device",
    "t_task_s", "scene",
)  # fmt: skip
_KIND_OF: dict[str, tuple[str, bool]] = {
    column.name: (column.kind, True) for column in (*TRIALS, *DELIVERED, *VIDEO)
} | {
    name: (kind, name in _MAY_BE_NULL)
    for kind, names in {
        "text": "language operator key_hash protocol_hash version device page block phase code item "
        "outcome form group sealed arrangement sha256 frames_sha256 reason by kind text what status previous outlet",
        "study's name": "study",
        "participant's id": "participant row_of",
        "recording's name": "recording recording_frames",
        "flag": "simulated pilot recordings measures_sealed intervals",
        "integer": "n format session entry seed torn_bytes trial attempt interval part index of target "
        "samples_recorded samples_unrecorded frames_recorded number value changes protocol_format steps scene",
        "answer": "answer",
        "number": "level standard t_s gap_s t_task_s onset_s first_s last_s",
        "time": "at",
        "object": "described",
        "list of objects": "checks",
        "table of numbers": "limits",
        "list of answers": "items",
        "list of texts": "invalid",
    }.items()
    for name in names.split()
}
"""The type of a field of that name, in any event that this version knows, and whether it may be null."""


def problem(line: Mapping[str, Any]) -> str | None:
    """Return the error in a line of a journal, or None.

    A line must have all fields of its event, and every field in the dictionary must be of its kind, also in events of
    another version.
    """
    event = line.get("event")
    if not isinstance(event, str):
        return "it names no event"
    known = _BY_NAME.get(event)
    if lacking := [name for name in (*_OF_ALL, *(known.fields if known else ())) if name not in line]:
        return f"({event}) lacks {', '.join(lacking)}"
    if known is not None and known.one_of and sum(name in line for name in known.one_of) != 1:
        return f"({event}) is not about one of {', '.join(known.one_of)}"
    for name in line:
        if not holds(field := _field(line, name), line[name]):
            return f"({event}) holds {name} {shortened(line[name])}, expected: {_KIND_OF[field][0]}"
    return None if 0 <= line["t_s"] <= _MOST_SECONDS else f"({event}) has t_s {line['t_s']:g}"


def _field(held: Mapping[str, Any], name: str) -> str:
    """Return whose entry says what a name holds: without a kind of question an answer is a whole number."""
    return "answer" if name == "value" and "kind" in held else name


def shortened(value: object) -> str:
    """Return ``value`` as messages show it."""
    shown = repr(value)
    return shown if len(shown) <= SHOWN else f"{shown[:SHOWN]}…"


def unknown_events(lines: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the names of events that are not in the dictionary, each once."""
    yield from {line["event"]: None for line in lines if line["event"] not in EVENT_NAMES}


def holds(name: str, value: object) -> bool:
    """Return whether ``value`` has the type of the field ``name``; an unknown field may have any."""
    if name not in _KIND_OF:
        return True
    kind, may_be_null = _KIND_OF[name]
    return may_be_null if value is None else _KINDS[kind](value)
