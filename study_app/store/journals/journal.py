"""The journal, the primary record of a session: one event per line, each answer flushed before it has effects.

Every line is a self-describing JSON object: ``n`` counts from 1 without a gap, ``event`` is its name, ``t_s`` the
seconds since the session's clock origin, ``at`` the same moment as wall time, ``previous`` the SHA-256 of all bytes of
the file before the line. All tables are derived from these lines alone. Journals of format 1 have no ``previous``;
if a later version resumed one, its lines have it from ``session_resumed`` on.

A line is complete when its newline is on the disk. A program killed while writing leaves at most one incomplete line at
the end, which readers skip and count. Any other invalid line is damage. Lines appended without waiting are flushed in
the background, in order: a power cut may lose the last of them, but no line that was waited for and none before it.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import study_app
from study_app.errors import StoreError
from study_app.protocol.source import without_byte_order_mark
from study_app.store.files.atomic import (
    cannot_write,
    flush_file,
    parse_json,
    read_own,
    read_regular,
    study_root,
    sync_folder,
    write_all,
    write_file,
)
from study_app.store.journals.journal_events import EVENTS, Event, line_problem, read_event, shorten_value

FORMAT = 2
"""Format of the journal and the receipt; lines have ``previous`` since format 2."""
_OTHER_LINE_ENDINGS = (
    "its line endings have been changed to CR LF, as git does with core.autocrlf: restore it from a backup, with the "
    "line “* -text” in the repository's .gitattributes"
)
_BYTE_ORDER_MARK = "begins with a byte order mark, which an editor added: restore it from a backup"
RETRY_S = 1.0
"""Time after which the background thread repeats a failed flush [s]."""


def normalized_text(content: bytes) -> bytes:
    """Return the content of a text file with LF line endings and without a byte order mark."""
    return without_byte_order_mark(content).replace(b"\r\n", b"\n")


def notation_problem(content: bytes) -> str:
    """Return a phrase that says how a file differs from its `normalized_text`."""
    return _OTHER_LINE_ENDINGS if b"\r\n" in content else _BYTE_ORDER_MARK


class SessionClock:
    """Seconds since one origin on a monotonic clock; the wall clock is read only once, so setting it has no effect.

    Parameters
    ----------
    now_ns : callable
        The monotonic clock [ns]: the servo's own, so that recordings and journal share an axis.
    origin_at : datetime, optional
        Wall time at the origin, with its zone; by default derived from the current wall time.
    shown_s : float
        Current time of the clock [s], above 0 in a resumed session.
    """

    def __init__(
        self,
        now_ns: Callable[[], int] = time.perf_counter_ns,
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


@dataclass(frozen=True, slots=True)
class Contents:
    """The contents of a journal: its complete lines, where they end, and any damage after them.

    ``torn_bytes`` counts the bytes after the last newline: an incomplete line of a program that was killed while
    writing. ``damage`` is a sentence on any other damage (a broken line, a missing or duplicate number, a field of the
    wrong type, a line whose predecessors were changed), or None. Every line in ``lines`` has valid fields for its
    event and is unchanged. ``hash`` is the SHA-256 of the complete lines, which the next line stores.
    """

    lines: list[Event]
    whole_bytes: int
    torn_bytes: int = 0
    damage: str | None = None
    hash: Any = field(default_factory=hashlib.sha256, compare=False, repr=False)


def count_events(path: Path, *kinds: str) -> tuple[int, ...]:
    """Return the number of lines of each kind of event in a journal, without parsing it; 0 if it cannot be read."""
    try:
        content = read_regular(path)
    except OSError:
        return (0,) * len(kinds)
    return tuple(content.count(b'"event":"%s",' % kind.encode()) for kind in kinds)


def read(path: Path) -> list[Event]:
    """Return the complete lines of the journal in order; an incomplete last line is left out (`scan` reports it).

    Raises
    ------
    StoreError
        The journal cannot be read, or is damaged before its last line.
    """
    return read_complete(path).lines


def read_complete(path: Path) -> Contents:
    """Read the journal; raise StoreError for any damage other than an incomplete last line."""
    contents = scan(path)
    if contents.damage is not None:
        raise StoreError(contents.damage)
    return contents


def scan(path: Path) -> Contents:
    """Read the journal's complete lines, check each against its event and the lines before, and report any damage."""
    content = read_own(path, study_root(path))
    *raw_lines, tail = content.split(b"\n")
    lines: list[Event] = []
    whole_bytes = 0
    running_hash = hashlib.sha256()
    chained = False
    version: Any = None  # of the program that wrote the current line
    for number, raw_line in enumerate(raw_lines, start=1):
        try:
            line = parse_json(raw_line)
        except ValueError:
            line = None
        if not isinstance(line, dict):
            return Contents(lines, whole_bytes, damage=f"{path}, line {number} is damaged: restore it from a backup")
        if line.get("n") != number:
            found = shorten_value(line.get("n"))
            damage = f"{path}, line {number} has n {found}; lines are missing or duplicated: restore it from a backup"
            return Contents(lines, whole_bytes, damage=damage)
        version = line.get("version", version)
        problem = line_problem(line)
        if problem is None and version == study_app.__version__ and line["event"] not in EVENTS:
            problem = f"contains the event {shorten_value(line['event'])}, which version {version} does not write"
        if problem is not None:
            damage = f"{path}, line {number} {problem}: it has been changed; restore the journal from a backup"
            return Contents(lines, whole_bytes, damage=damage)
        if (problem := _chain_error(line, running_hash.hexdigest(), chained=chained)) is not None:
            first = raw_lines[0] + b"\n"
            if first != normalized_text(first):
                return Contents(lines[:-1], whole_bytes, damage=f"{path}, line 1: {notation_problem(first)}")
            return Contents(lines[:-1], whole_bytes, damage=f"{path}, line {number} {problem}")
        lines.append(read_event(line))
        whole_bytes += len(raw_line) + 1
        running_hash.update(raw_line + b"\n")
        chained = "previous" in line
    return Contents(lines, whole_bytes, torn_bytes=len(tail), hash=running_hash)


def _chain_error(line: Mapping[str, Any], expected_hash: str, *, chained: bool) -> str | None:
    """Return how a line contradicts the previous lines, whose SHA-256 is ``expected_hash``; None if it does not.

    ``chained`` tells whether the previous line has ``previous``: then this one must have it. The first line of a
    journal has it since format 2; a journal of format 1 gets it where it was resumed by a later version.
    """
    is_first, hash_before = line["n"] == 1, line.get("previous")
    if is_first and line.get("format", 1) > FORMAT:
        return f"has format {line['format']}, but this version reads formats up to {FORMAT}: install a newer version"
    if is_first and "format" not in line and "measures_sealed" in line:  # not of a version with format 1
        return "does not contain the key “format”: it has been changed; restore the journal from a backup"
    if hash_before is None:
        is_required = chained or (is_first and line.get("format", 1) > 1)
        return (
            "does not contain the key “previous”: it has been changed; restore the journal from a backup"
            if is_required
            else None
        )
    if hash_before != expected_hash:
        return "does not match the previous line, which has been changed: restore the journal from a backup"
    if not (chained or is_first or line["event"] == "session_resumed"):
        return "has the key “previous” but earlier lines do not: they were changed; restore the journal from a backup"
    return None


def line_of(event: Event, number: int, clock: SessionClock, t_s: float | None, *, previous: str) -> dict[str, Any]:
    """Return the line of an event; ``t_s`` is its time, by default now on ``clock``.

    ``previous`` is the SHA-256 of all previous lines in the form of `line_bytes`.
    """
    moment = clock.seconds() if t_s is None else t_s
    return replace(event, n=number, t_s=round(moment, 6), at=clock.at(moment), previous=previous).line()


def line_bytes(line: Mapping[str, Any]) -> bytes:
    """Return a line as written to the file, with its newline."""
    text = json.dumps(line, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", "backslashreplace") + b"\n"


class Journal:
    """An open journal: one thread appends, and another flushes the lines that were appended without waiting.

    After a failed write or flush the system may have dropped data. The lines that may not be on the disk are therefore
    written again before the next line, which waits for the disk. The background thread repeats a failed flush every
    `RETRY_S`; until it succeeds, `check_flushed` raises.
    """

    def __init__(self, path: Path, file: BinaryIO, clock: SessionClock) -> None:
        self.path = path
        self._real_path = os.path.realpath(path)
        self._process = os.getpid()
        self.clock = clock
        self.file = file
        self._lines = 0
        self._size = 0
        self._hash = hashlib.sha256()  # of all lines
        self._unflushed = bytearray()  # the last bytes of the file, not known to be on the disk
        self._torn = False
        self.flushing = threading.RLock()  # one flush at a time: of two, the system reports a failure to only one
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._due = False
        self._failed: OSError | None = None  # why the last flush in the background failed
        self._closing = False

    @classmethod
    def create(cls, path: Path, clock: SessionClock | None = None) -> Journal:
        """Create the file, which must not exist.

        Raises
        ------
        StoreError
            The file exists already, or cannot be created.
        """
        with contextlib.ExitStack() as failing:
            try:
                file = failing.enter_context(path.open("xb", buffering=0))
                sync_folder(path.parent)
            except FileExistsError as error:
                raise StoreError(f"{path} already exists: a journal is never overwritten; use a new session") from error
            except OSError as error:
                raise cannot_write(path, error) from error
            failing.pop_all()
        return cls(path, file, clock if clock is not None else SessionClock())

    @classmethod
    def reopen(cls, path: Path, contents: Contents, clock: SessionClock) -> Journal:
        """Open the file to append after the last complete line of ``contents``, which `scan` has just read.

        An incomplete line at the end is removed by rewriting the complete lines in one step, and stored next to the
        journal.

        Raises
        ------
        StoreError
            The journal cannot be read or written, or has changed since.
        """
        try:
            if contents.torn_bytes:
                content = path.read_bytes()
                backups = (path.with_name(f"{path.stem}-torn-{number}.txt") for number in count(1))
                write_file(next(name for name in backups if not name.exists()), content[contents.whole_bytes :])
                write_file(path, content[: contents.whole_bytes])
            file = path.open("r+b", buffering=0)
            if file.seek(0, os.SEEK_END) != contents.whole_bytes:
                file.close()
                raise StoreError(
                    f"{path} changed while it was being opened: close the program that is writing to it, and try again"
                )
        except OSError as error:
            raise cannot_write(path, error) from error
        journal = cls(path, file, clock)
        journal._lines, journal._size = len(contents.lines), contents.whole_bytes
        journal._hash = contents.hash.copy()
        return journal

    def append(self, event: Event, *, t_s: float | None = None, waits: bool = True) -> Event:
        """Write one line and wait for the disk; return the event as `read` will return it.

        Without ``waits`` it returns as soon as the operating system has the line, which is flushed in the background.
        ``t_s`` is the time of the event, by default now. Infinite and undefined numbers become null, and numpy numbers
        plain numbers.

        Raises
        ------
        StoreError
            The line was not written (the disk failed, or a reader would call it damaged), it did not reach the disk
            with ``waits``, or a line before it could not be flushed. The journal ends with the line before it and can
            be appended to again.
        """
        if self.is_forked:
            raise StoreError(
                f"{self.path} is being written by process {self._process}: a fork of that process cannot write to it"
            )
        if self.file.closed:
            raise StoreError(
                f"{self.path} is closed: {event.event!r} occurred after the end of the session and was not recorded"
            )
        line = line_of(event, self._lines + 1, self.clock, t_s, previous=self._hash.hexdigest())
        if (problem := line_problem(line)) is not None:
            raise StoreError(
                f"{self.path}, line {line['n']} {problem}: the line was not written; report this to the developers"
            )
        content = line_bytes(line)
        self._check_not_replaced()
        try:
            waits = self._write(content) or waits
            if waits:
                self._flush_or_remove(content)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        self._lines += 1
        self._hash.update(content)
        if not waits:
            self._schedule_flush()
        return read_event(line)

    def check_flushed(self) -> None:
        """Raise an error if lines appended without waiting could not be flushed and are still not on the disk.

        Raises
        ------
        StoreError
            The last flush in the background failed; the message gives the reason.
        """
        if (failed := self._failed) is not None:
            raise cannot_write(self.path, failed)

    @property
    def is_closed(self) -> bool:
        """Whether the journal is closed: it accepts no more lines."""
        return self.file.closed

    @property
    def is_forked(self) -> bool:
        """Whether this is a fork of the process that opened it."""
        return os.getpid() != self._process

    def close(self) -> None:
        """Flush lines not yet on the disk, and close the file.

        Raises
        ------
        StoreError
            The last lines could not be flushed; the file is closed nevertheless.
        """
        if self.is_forked:  # a fork has no such thread, and a lock may never be released
            return
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()
        if self.file.closed:
            return
        try:
            self._flush()
        except OSError as error:
            raise cannot_write(self.path, error) from error
        finally:
            self.file.close()

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _check_not_replaced(self) -> None:
        """Raise an error if the journal's path now names another file, or another program has written to the file."""
        torn = self._torn  # after a torn write the file may be longer
        try:
            status = self.path.stat()
            is_same_file = os.path.samestat(status, os.fstat(self.file.fileno()))
        except FileNotFoundError:
            is_same_file = False
        except OSError as error:
            raise cannot_write(self.path, error) from error
        if not is_same_file or os.path.realpath(self.path) != self._real_path:
            raise StoreError(f"{self.path} was moved, deleted or replaced while the session was running: restore it")
        if status.st_size != self._size and not torn:
            raise StoreError(
                f"{self.path} was changed by another program while the session was running: end this session"
            )

    def _write(self, content: bytes) -> bool:
        """Write a line after the last complete one; return whether an earlier failure requires waiting for the disk."""
        with self._changed:
            had_failed = self._torn
            try:
                if self._torn:
                    self._remove_torn_line()
                self._torn = True
                write_all(self.file, content)
            except OSError:
                with contextlib.suppress(OSError):  # retried before the next line
                    self._remove_torn_line()
                raise
            self._torn = False
            self._unflushed += content
            self._size += len(content)
        return had_failed

    def _flush_or_remove(self, content: bytes) -> None:
        """Wait until the line just written is on the disk; remove it if that fails."""
        with self.flushing:
            try:
                self._flush()
            except OSError:
                with self._changed:
                    del self._unflushed[-len(content) :]
                    self._size -= len(content)
                    with contextlib.suppress(OSError):
                        self._remove_torn_line()
                    self._torn = True
                raise

    def _flush(self) -> None:
        """Wait until every line written so far is on the disk; called from both threads."""
        with self.flushing:
            with self._changed:
                if self._torn:
                    self._remove_torn_line()
                unflushed = len(self._unflushed)
            if unflushed:
                try:
                    flush_file(self.file.fileno())
                except OSError:
                    with self._changed:
                        self._torn = True
                    raise
            with self._changed:
                del self._unflushed[:unflushed]
                self._failed = None

    def _schedule_flush(self) -> None:
        with self._changed:
            self._due = True
            if self._thread is None:
                self._thread = threading.Thread(target=self._flush_in_background, name="journal", daemon=True)
                self._thread.start()
            self._changed.notify_all()

    def _flush_in_background(self) -> None:
        """Flush lines that were appended without waiting, and retry after a failure; runs in the journal's thread."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._due or self._closing, RETRY_S if self._failed else None)
                if self._closing:
                    return
                self._due = False
            try:
                self._flush()
            except OSError as error:
                self._failed = error

    def _remove_torn_line(self) -> None:
        """Remove a partly written line, and write again the lines that may not be on the disk."""
        self.file.truncate(self._size)
        self.file.seek(self._size - len(self._unflushed))
        write_all(self.file, bytes(self._unflushed))
        self._torn = False
