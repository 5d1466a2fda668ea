"""Writing a journal: one thread appends lines, and another flushes those that are not waited for."""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from study_app.errors import StoreError
from study_app.store.atomic import cannot_write, sync_folder, write_file, write_whole
from study_app.store.clock import SessionClock
from study_app.store.journals.journal import Contents, Line, line_bytes, line_of
from study_app.store.journals.journal_events import problem

RETRY_S = 1.0
"""The background thread repeats a failed flush after this time."""


class Journal:
    """An open journal: one thread appends, and another flushes the lines that are not waited for.

    After a failed write or flush the lines that may not be on the disk are written again before the next line, which
    waits for the disk: the system may have dropped data that it could not flush. The background thread repeats a failed
    flush every `RETRY_S`; until it succeeds, `check_flushed` raises.
    """

    def __init__(self, path: Path, file: BinaryIO, clock: SessionClock) -> None:
        self.path = path
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
            It exists already, or cannot be created.
        """
        try:
            file = path.open("xb", buffering=0)
            sync_folder(path.parent)
        except FileExistsError as error:
            raise StoreError(f"{path} exists already: a journal is never overwritten; use a new session") from error
        except OSError as error:
            raise cannot_write(path, error) from error
        return cls(path, file, clock if clock is not None else SessionClock())

    @classmethod
    def reopen(cls, path: Path, contents: Contents, clock: SessionClock) -> Journal:
        """Open the file to go on after the last whole line of ``contents``, which `scan` has just read.

        An incomplete line at the end is removed by rewriting the complete lines in one step, and stored next to the
        journal.

        Raises
        ------
        StoreError
            It cannot be read or written, or has changed since.
        """
        try:
            if contents.torn_bytes:
                content = path.read_bytes()
                write_file(_unused_beside(path), content[contents.whole_bytes :])
                write_file(path, content[: contents.whole_bytes])
            file = path.open("r+b", buffering=0)
            if file.seek(0, os.SEEK_END) != contents.whole_bytes:
                file.close()
                raise StoreError(
                    f"{path} has changed while it was opened: close the other program that writes it, and try again"
                )
        except OSError as error:
            raise cannot_write(path, error) from error
        journal = cls(path, file, clock)
        journal._lines, journal._size = len(contents.lines), contents.whole_bytes
        journal._hash = contents.hash.copy()
        return journal

    def append(self, event: str, *, t_s: float | None = None, waits: bool = True, **fields: Any) -> Line:
        """Write one line and wait for the disk; return the line as readers get it.

        Without ``waits`` it returns when the system has the line, and the line is flushed in the background.
        ``t_s`` is when it happened, by default now. Infinite and undefined numbers become null, numpy numbers plain.
        Fields cannot be called ``n``, ``at`` or ``previous``, which are the journal's own.

        Raises
        ------
        StoreError
            The line was not written (the disk failed, or a reader would call it damaged), or is not on the disk though
            it was waited for, or a line before it could not be flushed; the journal ends with the line before it and
            can be appended to again.
        """
        if self.file.closed:
            raise StoreError(f"{self.path} is closed: {event!r} came after the session's end and was not recorded")
        line = line_of(self._lines + 1, event, self.clock, t_s, fields, previous=self._hash.hexdigest())
        if (wrong := problem(line)) is not None:
            raise StoreError(
                f"{self.path}, line {line['n']} {wrong}: it was not written; report this to the developers"
            )
        content = line_bytes(line)
        self._refuse_if_replaced()
        try:
            waits = self._write(content) or waits
            if waits:
                self._flush_or_take_back(content)
        except OSError as error:
            raise cannot_write(self.path, error) from error
        self._lines += 1
        self._hash.update(content)
        if not waits:
            self._flush_later()
        return line

    def check_flushed(self) -> None:
        """Raise if lines that were not waited for could not be flushed, and are still not on the disk.

        Raises
        ------
        StoreError
            Gives the reason why the last flush in the background failed.
        """
        if (failed := self._failed) is not None:
            raise cannot_write(self.path, failed)

    @property
    def closed(self) -> bool:
        """Whether it accepts no more lines."""
        return self.file.closed

    def close(self) -> None:
        """Flush lines not yet on the disk, and close the file.

        Raises
        ------
        StoreError
            The last lines could not be flushed; the file is closed nevertheless.
        """
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

    def _refuse_if_replaced(self) -> None:
        """Refuse to write into a file that no longer has the journal's name, or that another program wrote."""
        torn = self._torn  # then the file may be longer
        try:
            found = self.path.stat()
            there = os.path.samestat(found, os.fstat(self.file.fileno()))
        except FileNotFoundError:
            there = False
        except OSError as error:
            raise cannot_write(self.path, error) from error
        if not there:
            raise StoreError(f"{self.path} was moved, deleted or replaced while the session ran: put it back")
        if found.st_size != self._size and not torn:
            raise StoreError(f"{self.path} was written by another program while the session ran: end this session")

    def _write(self, content: bytes) -> bool:
        """Write a line after the last whole one; return whether it must be waited for because something failed."""
        with self._changed:
            failed = self._torn
            try:
                if self._torn:
                    self._take_back()
                self._torn = True
                write_whole(self.file, content)
            except OSError:
                with contextlib.suppress(OSError):  # tried again before the next line
                    self._take_back()
                raise
            self._torn = False
            self._unflushed += content
            self._size += len(content)
        return failed

    def _flush_or_take_back(self, content: bytes) -> None:
        """Wait until the line just written is on the disk; remove it if that fails."""
        with self.flushing:
            try:
                self._flush()
            except OSError:
                with self._changed:
                    del self._unflushed[-len(content) :]
                    self._size -= len(content)
                    with contextlib.suppress(OSError):
                        self._take_back()
                    self._torn = True
                raise

    def _flush(self) -> None:
        """Wait until every line written so far is on the disk; called from both threads."""
        with self.flushing:
            with self._changed:
                if self._torn:
                    self._take_back()
                waiting = len(self._unflushed)
            if waiting:
                try:
                    os.fsync(self.file.fileno())
                except OSError:
                    with self._changed:
                        self._torn = True
                    raise
            with self._changed:
                del self._unflushed[:waiting]
                self._failed = None

    def _flush_later(self) -> None:
        with self._changed:
            self._due = True
            if self._thread is None:
                self._thread = threading.Thread(target=self._flush_behind, name="journal", daemon=True)
                self._thread.start()
            self._changed.notify_all()

    def _flush_behind(self) -> None:
        """Flush lines that are not waited for, and again after a failure; runs in the journal's thread."""
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

    def _take_back(self) -> None:
        """Remove the remains of an interrupted write, and write again the lines that may not be on the disk."""
        self.file.truncate(self._size)
        self.file.seek(self._size - len(self._unflushed))
        write_whole(self.file, bytes(self._unflushed))
        self._torn = False


def _unused_beside(path: Path) -> Path:
    """Return the name of the next file for text removed from the end of the journal at ``path``."""
    names = (path.with_name(f"{path.stem}-torn-{number}.txt") for number in count(1))
    return next(name for name in names if not name.exists())
