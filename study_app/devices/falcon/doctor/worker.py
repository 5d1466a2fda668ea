"""An examination of a Falcon in a process of its own, from both its ends: nobody waits for it, and it can be cancelled.

Ended early, the process leaves by way of the driver, which sends quiet packets; if it does not leave, it is killed, and
the driver's own guard sends them.
"""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final, NoReturn, TypeAlias

from study_app.devices.doctor_report import Report
from study_app.devices.falcon.doctor.failure_report import report
from study_app.errors import StudyError

PATIENCE_S: Final = 3.0
ENDED: Final = "The examination ended without a word; the terminal may show why."

Said: TypeAlias = str | Report | StudyError
"""A line to tell, what was found, or why it could not be examined."""


class Examination:
    """One examination under way; `said` is to be asked some times a second.

    Parameters
    ----------
    name : "falcon", "falcon:SERIAL", "falcon-emulated" or "falcon-socket:PATH"
    firmware : file of its program
    faults : of an emulated one
    """

    def __init__(self, name: str, *, firmware: Path | None = None, faults: Sequence[str] = ()) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, far = context.Pipe(duplex=False)
        self._process = context.Process(
            target=serve, args=(far, name, firmware, tuple(faults)), name="examination", daemon=True
        )
        self._process.start()
        far.close()
        self._over = False

    @property
    def over(self) -> bool:
        """Whether nothing more will be said."""
        return self._over

    def said(self) -> list[Said]:
        """Return what was said since; the last is a `Report` or an error, once. Never waits."""
        told: list[Said] = []
        try:
            while not self._over and self._connection.poll():
                told.append(self._connection.recv())
                self._over = not isinstance(told[-1], str)
        except (EOFError, OSError):
            self._over = True
            told.append(StudyError(ENDED))
        return told

    def cancel(self) -> None:
        """Ask the process to leave; it lets go of the Falcon first. Does not wait."""
        self._over = True
        self._process.terminate()

    @property
    def gone(self) -> bool:
        """Whether the process has left."""
        return not self._process.is_alive()

    def close(self) -> None:
        """End the process, whatever it is doing, and let go of it."""
        self._over = True
        self._process.terminate()
        self._process.join(PATIENCE_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(PATIENCE_S)
        self._connection.close()
        self._process.close()


def serve(connection: Connection, name: str, firmware: Path | None, faults: tuple[str, ...]) -> None:
    """Examine, and say what comes of it, until nobody listens any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the program; this ends with its connection
    signal.signal(signal.SIGTERM, _leave)
    with suppress(BrokenPipeError, ConnectionResetError):
        try:
            from study_app.devices.falcon.doctor.examine import (  # noqa: PLC0415 - the compiler: only in this process
                examine,
            )

            connection.send(report(examine(name, firmware=firmware, faults=faults, tell=connection.send)))
        except StudyError as error:
            connection.send(StudyError(str(error)))


def _leave(_number: int, _frame: object) -> NoReturn:
    """Leave as an exception does, through every ``with``: the device is closed on the way."""
    sys.exit(0)
