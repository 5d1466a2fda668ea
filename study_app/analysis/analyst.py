"""The process that reads and evaluates studies for a window, from both its ends.

It is asked by orders and tells what it finds piece by piece; the libraries and tables of an evaluation stay in it.
"""

from __future__ import annotations

import multiprocessing
import signal
import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final, TypeAlias

from study_app.errors import StudyError
from study_app.store.exclusions import Exclusion

PATIENCE_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class FindStudies:
    """Look which studies there are; told as `StudiesFound`."""

    results: Path


@dataclass(frozen=True, slots=True)
class ReadStudy:
    """Read a study and draw its figures; told as `SessionsFound`, `StudyFound`, `FigureDrawn`, and what is going on."""

    folder: Path


@dataclass(frozen=True, slots=True)
class LeaveOut:
    """Leave a session or a trial out (see ``store.exclusions.exclude``)."""

    folder: Path
    participant: str
    session: int
    trial: int | None
    by: str
    reason: str


@dataclass(frozen=True, slots=True)
class OpenKey:
    """Open the sealed key (see ``store.blinding.reveal``)."""

    folder: Path
    by: str
    reason: str


@dataclass(frozen=True, slots=True)
class WriteTables:
    """Write the tables that ``analysis.export`` writes, with its ``extras``."""

    folder: Path
    to: Path
    extras: tuple[Any, ...] = ()


@dataclass(frozen=True, slots=True)
class WriteReport:
    """Write the report (see ``analysis.report.writing``)."""

    folder: Path
    to: Path


Order: TypeAlias = FindStudies | ReadStudy | LeaveOut | OpenKey | WriteTables | WriteReport


@dataclass(frozen=True, slots=True)
class StudyAt:
    """A study's folder, what its first session is, and when the last one was begun [s since the epoch]."""

    folder: Path
    simulated: bool
    pilot: bool
    newest_s: float


@dataclass(frozen=True, slots=True)
class StudiesFound:
    """The studies under a results folder, in the order of their names."""

    studies: tuple[StudyAt, ...]


@dataclass(frozen=True, slots=True)
class SessionsFound:
    """The sessions of a study as rows of ``store.participants``, what is left out, and how the key was last opened."""

    folder: Path
    rows: tuple[dict[str, Any], ...]
    exclusions: tuple[Exclusion, ...]
    reveal: Mapping[str, str] | None


@dataclass(frozen=True, slots=True)
class StudyFound:
    """A study that could be read.

    ``trials`` are the main trials of each session (participant, number): number and the words for it, by code while
    the key is sealed. ``doubts`` are files not as recorded. ``colours`` are those of figures by what they are for.
    """

    name: str
    title: str
    n: int
    blocks: int
    revealed: bool
    trials: Mapping[tuple[str, int], tuple[tuple[int, str], ...]]
    doubts: tuple[str, ...]
    colours: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FigureDrawn:
    """A figure as SVG; one of an earlier ``name`` gives way. Without ``svg``, ``caption`` says why there is none."""

    name: str
    title: str
    caption: str
    svg: bytes = b""


@dataclass(frozen=True, slots=True)
class Progress:
    """What is being done, and which share of all is done (0 to 1)."""

    what: str
    share: float


@dataclass(frozen=True, slots=True)
class Done:
    """An order was carried out: the files written, and what to be warned of."""

    files: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Refused:
    """An order could not be carried out, and why; nothing was half-done. ``stopped`` where that was asked for."""

    sentence: str
    stopped: bool = False


Answer: TypeAlias = StudiesFound | SessionsFound | StudyFound | FigureDrawn | Progress | Done | Refused


class Stopped(StudyError):
    """An order was given up because that was asked for, or another order came."""


class Analyst:
    """Gives orders to a process of its own; never waits for it.

    A new order stops the one before at its next step, unless that one writes.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, far = context.Pipe()
        self._process = context.Process(target=serve, args=(far,), name="analyst", daemon=True)
        self._process.start()
        far.close()
        self._ordered = 0

    @property
    def works(self) -> bool:
        """Whether there still is somebody to give orders to."""
        return self._process.is_alive()

    @property
    def process_id(self) -> int | None:
        """The process's id."""
        return self._process.pid

    def order(self, order: Order) -> int:
        """Give an order; return the number that its answers have. Answers to earlier orders may still come."""
        self._ordered += 1
        self._send((self._ordered, order))
        return self._ordered

    def stop(self) -> None:
        """Ask that the order that is carried out be given up."""
        self._send((self._ordered, None))

    def answers(self) -> list[tuple[int, Answer]]:
        """Return what was told since; the last of an order is `Done` or `Refused`."""
        found: list[tuple[int, Answer]] = []
        with suppress(EOFError, ConnectionResetError):
            while self._connection.poll():
                found.append(self._connection.recv())
        return found

    def close(self) -> None:
        """End the process, whatever it is doing; a thread waits until it is gone."""
        self._connection.close()
        self._process.terminate()
        threading.Thread(target=_see_off, args=(self._process,), name="analyst ending", daemon=True).start()

    def _send(self, message: tuple[int, Order | None]) -> None:
        with suppress(BrokenPipeError, ConnectionResetError):
            self._connection.send(message)


def _see_off(process: BaseProcess) -> None:
    """Wait until a process that was ended is gone."""
    process.join(PATIENCE_S)
    if process.is_alive():
        process.kill()
        process.join(PATIENCE_S)


def serve(connection: Connection) -> None:
    """Carry out (number, order) one after the other until nobody is there any more; answers are (number, answer)."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program; this ends with its connection
    from study_app.analysis.answering import carry_out  # noqa: PLC0415 - the libraries: only in this process

    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            number, order = connection.recv()
            if order is None:
                continue  # asked to stop what had just come to its end
            try:
                last: Answer = carry_out(order, partial(_tell, connection, number), connection.poll)
            except StudyError as error:
                last = Refused(str(error), stopped=isinstance(error, Stopped))
            connection.send((number, last))


def _tell(connection: Connection, number: int, told: Answer) -> None:
    connection.send((number, told))
