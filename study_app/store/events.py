"""The journal's dictionary: every event, what it says, and its fields beside ``n``, ``event``, ``t_s`` and ``at``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from study_app.errors import StoreError
from study_app.store.journal import Line


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
    Event("session_started", "The session began: always the first line.", (*_SESSION, *_HASHES, "device", "limits")),
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
    Event("trial_ended", "The trial's task was over, and what was measured of it.", (*_WHICH, "outcome")),
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
    Event("session_ended", "The session was over: always the last line.", ("status", "reason")),
)

_OF_ALL = ("n", "event", "t_s", "at")
_BY_NAME = {event.name: event for event in EVENTS}


def check_fields(path: Path, lines: Sequence[Line]) -> None:
    """Refuse a journal with a line that lacks a field of its event.

    Raises
    ------
    StoreError
        Names the line and what it lacks.
    """
    for lacking in lacking_fields(lines):
        raise StoreError(f"{path}, {lacking}: it was changed; restore it from a copy")


def unknown_events(lines: Sequence[Line]) -> Iterator[str]:
    """Yield the names of events that the dictionary does not know, each once."""
    yield from {str(line.get("event")): None for line in lines if line.get("event") not in _BY_NAME}


def lacking_fields(lines: Sequence[Line]) -> Iterator[str]:
    """Yield a sentence about every line that lacks a field of its event."""
    for line in lines:
        event = _BY_NAME.get(line.get("event", ""))
        if lacking := [name for name in (*_OF_ALL, *(event.fields if event else ())) if name not in line]:
            yield f"line {line.get('n')} ({line.get('event')}) lacks {', '.join(lacking)}"
