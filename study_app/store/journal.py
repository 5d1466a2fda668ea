"""The truth about a session: one event a line, on the disk before anything follows from it.

Every line is a JSON object that explains itself: ``n`` counts from 1 without a gap, ``event`` is its name, ``t_s`` the
seconds since the session's clock origin, ``at`` the same moment for people. All tables are derived from these lines
alone. A line is whole when its newline is on the disk; a program killed while writing leaves at most one torn tail,
which readers leave out and count.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, TypeAlias

from study_app.errors import StoreError
from study_app.store.atomic import cannot_read, cannot_write, sync_folder, write_file, write_whole

Line: TypeAlias = dict[str, Any]

_OWN = ("n", "at")


class SessionClock:
    """Seconds since one origin on a monotonic clock; the wall clock is read once, so setting it changes nothing.

    Parameters
    ----------
    now_ns : callable
        The monotonic clock [ns]: the servo's own, so that recordings and journal share an axis.
    origin_at : datetime, optional
        Wall time at the origin, with its zone; by default so that the present moment is now.
    shown_s : float
        What the clock shows at present: more than 0 in a session that goes on [s].
    """

    def __init__(
        self,
        now_ns: Callable[[], int] = time.monotonic_ns,
        origin_at: datetime | None = None,
        *,
        shown_s: float = 0.0,
    ) -> None:
        self._now_ns = now_ns
        self.origin_ns = now_ns() - round(shown_s * 1e9)
        if origin_at is None:
            origin_at = datetime.now().astimezone() - timedelta(seconds=shown_s)
        self.origin_at = origin_at

    def seconds(self) -> float:
        """Return the seconds since the origin."""
        return (self._now_ns() - self.origin_ns) / 1e9

    def at(self, seconds: float) -> str:
        """Return the wall time of ``seconds`` as ISO 8601 with zone."""
        return (self.origin_at + timedelta(seconds=seconds)).isoformat(timespec="milliseconds")


class Journal:
    """An open journal: ``append`` returns when the line is on the disk. One writer, one thread."""

    def __init__(self, path: Path, file: BinaryIO, clock: SessionClock) -> None:
        self.path = path
        self.clock = clock
        self._file = file
        self._lines = 0
        self._size = 0
        self._torn = False

    @classmethod
    def create(cls, path: Path, clock: SessionClock | None = None) -> Journal:
        """Create the file, which must not exist.

        Raises
        ------
        StoreError
            It exists already, or cannot be created.
        """
        try:
            file = path.open("xb", buffering=0)
            sync_folder(path.parent)
        except FileExistsError as error:
            raise StoreError(f"{path} exists already: a journal is never written over; use a new session") from error
        except OSError as error:
            raise cannot_write(path, error) from error
        return cls(path, file, clock if clock is not None else SessionClock())

    @classmethod
    def reopen(cls, path: Path, contents: Contents, clock: SessionClock) -> Journal:
        """Open the file to go on after the last whole line of ``contents``, which `scan` has just read.

        A torn tail is cut off by writing the whole lines anew, in one step.

        Raises
        ------
        StoreError
            It cannot be read or written, or has changed since.
        """
        try:
            if contents.torn_bytes:
                write_file(path, path.read_bytes()[: contents.whole_bytes])
            file = path.open("r+b", buffering=0)
            if file.seek(0, os.SEEK_END) != contents.whole_bytes:
                file.close()
                raise StoreError(f"{path} has changed while it was opened: is another program writing it?")
        except OSError as error:
            raise cannot_write(path, error) from error
        journal = cls(path, file, clock)
        journal._lines, journal._size = len(contents.lines), contents.whole_bytes
        return journal

    def append(self, event: str, *, t_s: float | None = None, **fields: Any) -> Line:
        """Write one line and wait for the disk; return the line as a reader will see it.

        ``t_s`` is when it happened, by default now. Infinite and undefined numbers become null, numpy numbers plain.
        Fields cannot be called ``n`` or ``at``, which are the journal's own.

        Raises
        ------
        StoreError
            The line is not on the disk; the journal ends with its last whole line and can be appended to again.
        """
        if self._file.closed:
            raise StoreError(f"{self.path} is closed: {event!r} came after the session's end and was not recorded")
        line = line_of(self._lines + 1, event, self.clock, t_s, fields)
        content = line_bytes(line)
        try:
            if self._torn:
                self._take_back()
            self._torn = True
            write_whole(self._file, content)
            os.fsync(self._file.fileno())
        except OSError as error:
            with contextlib.suppress(OSError):  # tried again before the next line
                self._take_back()
            raise cannot_write(self.path, error) from error
        self._torn = False
        self._size += len(content)
        self._lines += 1
        return line

    @property
    def closed(self) -> bool:
        """Whether it takes no more lines."""
        return self._file.closed

    def close(self) -> None:
        """Close the file; every line is on the disk already."""
        self._file.close()

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _take_back(self) -> None:
        """Cut off what an interrupted write may have left after the last whole line."""
        self._file.truncate(self._size)
        self._file.seek(self._size)
        self._torn = False


@dataclass(frozen=True, slots=True)
class Contents:
    """What a journal holds: its whole lines, where they end, and what is wrong after them.

    ``torn_bytes`` counts the torn tail of a program that was killed while writing; ``damage`` is the sentence about
    anything worse (a broken line with whole ones after it, a number missing or doubled), else None.
    """

    lines: list[Line]
    whole_bytes: int
    torn_bytes: int = 0
    damage: str | None = None


def read(path: Path) -> list[Line]:
    """Return the whole lines of the journal, in order; a torn tail is left out (`scan` reports it).

    Raises
    ------
    StoreError
        It cannot be read, or is damaged elsewhere than at its end.
    """
    return whole(path).lines


def whole(path: Path) -> Contents:
    """Read the journal to its last whole line; what follows it is a torn tail and nothing worse.

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
    """Read the journal to its last whole line and report what follows it.

    Raises
    ------
    StoreError
        It cannot be read.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise cannot_read(path, error) from error
    *pieces, tail = content.split(b"\n")
    lines: list[Line] = []
    whole_bytes = 0
    for number, piece in enumerate(pieces, start=1):
        line = _parse(piece)
        if line is None:
            if any(_parse(later) is not None for later in pieces[number:]):
                damage = f"{path}, line {number}: damaged, though whole lines follow; restore it from a copy"
                return Contents(lines, whole_bytes, damage=damage)
            return Contents(lines, whole_bytes, torn_bytes=len(content) - whole_bytes)
        if line.get("n") != number:
            damage = f"{path}, line {number}: its n is {line.get('n')!r}: lines are missing or doubled; restore a copy"
            return Contents(lines, whole_bytes, damage=damage)
        lines.append(line)
        whole_bytes += len(piece) + 1
    return Contents(lines, whole_bytes, torn_bytes=len(tail))


def line_of(number: int, event: str, clock: SessionClock, t_s: float | None, fields: Mapping[str, Any]) -> Line:
    """Return a line of a journal; ``t_s`` is when it happened, by default now on ``clock``."""
    if not fields.keys().isdisjoint(_OWN):
        raise ValueError(f"{event}: fields {_OWN} are the journal's own")
    moment = clock.seconds() if t_s is None else t_s
    return {
        "n": number,
        "event": event,
        "t_s": round(moment, 6),
        "at": clock.at(moment),
        **{name: plain(value) for name, value in fields.items()},
    }


def line_bytes(line: Line) -> bytes:
    """Return a line as it stands in the file, newline and all."""
    text = json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", "backslashreplace") + b"\n"


def plain(value: Any) -> Any:
    """Return ``value`` as JSON has it: numpy numbers plain, tuples as lists, numbers that are none as None."""
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
        line = json.loads(piece)
    except ValueError:
        return None
    return line if isinstance(line, dict) else None
