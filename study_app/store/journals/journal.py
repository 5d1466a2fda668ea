"""The journal, the primary record of a session: one event per line, each answer on the disk before its effects.

Every line is a self-describing JSON object: ``n`` counts from 1 without a gap, ``event`` is its name, ``t_s`` the
seconds since the session's clock origin, ``at`` the same moment as wall time, ``previous`` the SHA-256 of all bytes of
the file before the line. All tables are derived from these lines alone. Journals of format 1 have no ``previous``;
if a later version resumed one, its lines have it from ``session_resumed`` on. A line is complete when its newline is on
the disk; a program killed while writing leaves at most one incomplete line at the end, which readers skip and count;
any other invalid line is damage. Lines not waited for are flushed in the background, in order: a power cut may lose the
last of them, but none that was waited for and none before it.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

import study_app
from study_app.errors import StoreError
from study_app.store.atomic import read_own, study_root
from study_app.store.clock import SessionClock
from study_app.store.journals.journal_events import EVENT_NAMES, problem, shortened
from study_app.store.journals.parsing import parse_json

Line: TypeAlias = dict[str, Any]

FORMAT = 2
"""Of the journal and the receipt; since 2 the lines have ``previous``."""

_OWN = ("n", "at", "previous")


@dataclass(frozen=True, slots=True)
class Contents:
    """The contents of a journal: its complete lines, where they end, and any damage after them.

    ``torn_bytes`` counts what follows the last newline: the torn tail of a program that was killed while writing.
    ``damage`` is the sentence about anything worse (a broken line, a number missing or doubled, a field of another type
    than its event has, a line before which others stand than when it was written), else None. Every line of ``lines``
    has the fields of its event, each of its kind, and was not changed since the next was written. ``hash`` is the
    SHA-256 of the complete lines, with which the next line continues.
    """

    lines: list[Line]
    whole_bytes: int
    torn_bytes: int = 0
    damage: str | None = None
    hash: Any = field(default_factory=hashlib.sha256, compare=False, repr=False)


def count_events(path: Path, *kinds: str) -> tuple[int, ...]:
    """Return the number of lines of each kind of event in a journal, without parsing it; 0 if it cannot be read."""
    try:
        content = path.read_bytes()
    except OSError:
        return (0,) * len(kinds)
    return tuple(content.count(b'"event":"%s",' % kind.encode()) for kind in kinds)


def read(path: Path) -> list[Line]:
    """Return the complete lines of the journal, in order, without an incomplete one at the end (`scan` reports it).

    Raises
    ------
    StoreError
        It cannot be read, or is damaged elsewhere than at its end.
    """
    return whole(path).lines


def whole(path: Path) -> Contents:
    """Read the journal to its last complete line; at most an incomplete line follows it.

    Raises
    ------
    StoreError
        It cannot be read, or is damaged elsewhere than at its end.
    """
    contents = scan(path)
    if contents.damage is not None:
        raise StoreError(contents.damage)
    return contents


def scan(path: Path) -> Contents:
    """Read the journal to its last complete line, check each against its event and the lines before; report the rest.

    Raises
    ------
    StoreError
        It cannot be read, or leads out of the study's folder.
    """
    content = read_own(path, study_root(path))
    *pieces, tail = content.split(b"\n")
    lines: list[Line] = []
    whole_bytes = 0
    hashed = hashlib.sha256()
    chained = False
    version: Any = None  # that wrote the lines
    for number, piece in enumerate(pieces, start=1):
        line = _parse(piece)
        if line is None:
            return Contents(lines, whole_bytes, damage=f"{path}, line {number}: damaged; restore it from a copy")
        if line.get("n") != number:
            shown = shortened(line.get("n"))
            damage = f"{path}, line {number}: its n is {shown}: lines are missing or duplicated; restore it from a copy"
            return Contents(lines, whole_bytes, damage=damage)
        version = line.get("version", version)
        if (wrong := problem(line) or _unknown(line, version)) is not None:
            damage = f"{path}, line {number} {wrong}: it was changed; restore it from a copy"
            return Contents(lines, whole_bytes, damage=damage)
        if (wrong := _break(line, hashed.hexdigest(), chained=chained)) is not None:
            return Contents(lines[:-1], whole_bytes, damage=f"{path}, line {number} {wrong}")
        lines.append(line)
        whole_bytes += len(piece) + 1
        hashed.update(piece + b"\n")
        chained = "previous" in line
    return Contents(lines, whole_bytes, torn_bytes=len(tail), hash=hashed)


def _unknown(line: Line, version: Any) -> str | None:
    """Return a message if a line claims this program's version but has an event unknown to it, else None."""
    if version != study_app.__version__ or line["event"] in EVENT_NAMES:
        return None
    return f"has an event {shortened(line['event'])}, which version {version} does not write"


def _break(line: Line, before: str, *, chained: bool) -> str | None:
    """Return how a line contradicts the lines before it, whose SHA-256 is ``before``, or None.

    ``chained`` tells whether the line before has ``previous``: then this one must have it. The first line of a journal
    has it since format 2; a journal of format 1 gets it where it was resumed by a later version.
    """
    first, hash_before = line["n"] == 1, line.get("previous")
    if first and line.get("format", 1) > FORMAT:
        return f"has format {line['format']}, this version reads {FORMAT}: use a newer version of liquid-study"
    if hash_before is None:
        needed = chained or (first and line.get("format", 1) > 1)
        return "lacks previous: it was changed; restore it from a copy" if needed else None
    if hash_before != before:
        return "was written after another line than the one before it, which was changed: restore it from a copy"
    if not (chained or first or line["event"] == "session_resumed"):
        return "has previous, and the lines before it lack it: they were changed; restore it from a copy"
    return None


def line_of(
    number: int, event: str, clock: SessionClock, t_s: float | None, fields: Mapping[str, Any], *, previous: str
) -> Line:
    """Return a line of a journal; ``t_s`` is when it happened, by default now on ``clock``.

    ``previous`` is the SHA-256 of all lines before it, as `line_bytes` gives them.
    """
    if not fields.keys().isdisjoint(_OWN):
        raise ValueError(f"{event}: fields {_OWN} are the journal's own")
    moment = clock.seconds() if t_s is None else t_s
    return {
        "n": number,
        "event": event,
        "t_s": round(moment, 6),
        "at": clock.at(moment),
        **{name: plain(value) for name, value in fields.items()},
        "previous": previous,
    }


def line_bytes(line: Line) -> bytes:
    """Return a line as in the file, with its newline."""
    text = json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", "backslashreplace") + b"\n"


def plain(value: Any) -> Any:
    """Return ``value`` for JSON: numpy numbers as plain ones, tuples as lists, non-finite numbers as None."""
    if isinstance(value, dict):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # a numpy array or number
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _parse(piece: bytes) -> Line | None:
    try:
        line = parse_json(piece)
    except ValueError:
        return None
    return line if isinstance(line, dict) else None
