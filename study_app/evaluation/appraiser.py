"""The process that appraises scenes, from both its ends.

It begins as the least important one of the machine, before it loads anything, so that it takes nothing from a servo.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Final, TypeAlias

from study_app.errors import StudyError

if TYPE_CHECKING:
    from study_app.evaluation.appraise import Costs, Errors
    from study_app.haptics.scene import Scene

Told: TypeAlias = "tuple[int, Costs | Errors | str]"

NICEST: Final = 19
PATIENCE_S: Final = 1.0


class Appraiser:
    """Asks a process of its own what scenes cost and how true they are; never waits for it."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, far = context.Pipe()
        self._process = context.Process(target=serve, args=(far,), name="appraiser", daemon=True)
        self._process.start()
        far.close()
        self._asked = 0

    @property
    def works(self) -> bool:
        """Whether there still is somebody to ask."""
        return self._process.is_alive()

    def ask(self, scene: Scene) -> int:
        """Ask about a scene; return the number that its answers have. Answers to earlier questions may still come."""
        self._asked += 1
        with suppress(BrokenPipeError):
            self._connection.send((self._asked, scene))
        return self._asked

    def answers(self) -> list[Told]:
        """Return what was answered since: (number, `Costs`), (number, `Errors`), or (number, a sentence why not)."""
        found: list[Told] = []
        with suppress(EOFError, ConnectionResetError):
            while self._connection.poll():
                found.append(self._connection.recv())
        return found

    def close(self) -> None:
        """End the process, whatever it is doing."""
        self._connection.close()
        self._process.terminate()
        self._process.join(PATIENCE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(PATIENCE_S)
        self._process.close()


def serve(connection: Connection) -> None:
    """Answer (number, scene) with (number, `Costs`), then (number, `Errors`), until nobody is there any more.

    Of several scenes that wait, the newest is measured; one that is followed by another gets no errors.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program; this ends with its connection
    if hasattr(os, "nice"):
        os.nice(NICEST)
    from study_app.evaluation.appraise import costs, errors  # noqa: PLC0415 - the compiler: only in this process

    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            number, scene = _newest(connection)
            try:
                connection.send((number, costs(scene)))
                if not connection.poll():
                    connection.send((number, errors(scene)))
            except StudyError as error:
                connection.send((number, str(error)))


def _newest(connection: Connection) -> tuple[int, Scene]:
    """Wait for a scene, and return the last one that was asked for."""
    asked: tuple[int, Scene] = connection.recv()
    while connection.poll():
        asked = connection.recv()
    return asked
