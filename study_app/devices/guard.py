"""The guard: a small process that ends a device's force if the program dies.

A device without a watchdog may keep its last force. Therefore a child process waits on a pipe from the program. If the
pipe ends without ``_DISMISSAL``, the program has died, and the child calls the driver's function that opens the device
and ends its force. It is run as ``python -m study_app.devices.guard NAME MODULE:FUNCTION ARGUMENT...``.
"""

import pkgutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import IO, Final, Self

from study_app.ending_signals import ENDING_SIGNALS
from study_app.errors import DeviceError
from study_app.haptics.runtime.grants import allow_suspension, refuse_suspension

_DISMISSAL: Final = b"done\n"
READY: Final = b"ready\n"
PATIENCE_S: Final = 10.0
"""Time in which the guard tries to open the device [s]: the system needs a moment to release it from a dead program."""

_RETRY_S = 0.02
_EXIT_TIMEOUT_S = 5.0


class Guard:
    """A process that ends the force of a device if the program dies.

    It can act when the program has died, but not while the program is suspended; therefore Ctrl-Z has no effect until
    the guard is dismissed. As a context manager it starts on entry and is dismissed on exit; after an exception it is
    not dismissed, but ends the force as soon as the device is closed.

    Parameters
    ----------
    name : name of the device, for messages
    ends_force : "MODULE:FUNCTION" of a function that opens the device and ends its force, or raises ``DeviceError``
    arguments : arguments of this function
    died : called in a separate thread if the guard ends before it is dismissed; no force may be sent after that
    """

    def __init__(self, name: str, ends_force: str, *arguments: str, died: Callable[[], object] | None = None) -> None:
        self._name = name
        self._words = (name, ends_force, *arguments)
        self._died = died
        self.child: subprocess.Popen[bytes] | None = None
        self._left: subprocess.Popen[bytes] | None = None
        self.listener: threading.Thread | None = None

    def start(self) -> None:
        """Start the guard and wait until it is ready.

        Raises
        ------
        DeviceError
            The guard does not start, so no force may be sent.
        """
        if self.child is not None:
            return
        command = [sys.executable, "-P", "-m", __spec__.name, *self._words]  # -P: no modules from the current folder
        # In a separate session or console, so that closing the program's terminal does not end the guard.
        child = subprocess.Popen(  # noqa: S603 - our own module, and no shell
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        if child.stdout is None or child.stdout.readline() != READY:
            child.kill()
            child.wait()
            _close_streams(child)
            raise DeviceError(
                f"the guard process for the device '{self._name}' could not be started, so forces cannot be sent: "
                "reinstall liquid-study"
            )
        self.child = child
        refuse_suspension(self)
        self.listener = threading.Thread(target=self._listen, args=(child, child.stdout), name="guard", daemon=True)
        self.listener.start()

    @property
    def watching(self) -> bool:
        return self.child is not None and self.child.poll() is None

    def _listen(self, child: subprocess.Popen[bytes], output: IO[bytes]) -> None:
        output.read()  # the guard sends no more data, so this returns when it ends
        if self.child is child and self._died is not None:
            self._died()

    def stand_down(self) -> None:
        """Dismiss the guard, since the force is zero and the device is closed. A second call does nothing."""
        self._end_process(_DISMISSAL)

    def release(self) -> None:
        """Make the guard end the force after the device is closed; wait for it to exit."""
        self._end_process(b"")

    def leave(self) -> None:
        """Make the guard end the force once the device is reconnected, within a limited time; return at once.

        This is for a lost connection: the device may still exert force when it is reconnected, before a program opens
        it.
        """
        child, self.child = self.child, None
        allow_suspension(self)
        if child is None or child.stdin is None:
            return
        child.stdin.close()
        self._left = child
        threading.Thread(target=_dismiss_child, args=(child, self.listener), name="guard", daemon=True).start()

    def recall(self) -> None:
        """End the process left by `leave`, since the program has opened the device again with another guard.

        Otherwise it would try to open the device, which is in use, until its time limit, and then report a danger.
        """
        left_child, self._left = self._left, None
        if left_child is not None:
            left_child.kill()

    def _end_process(self, message: bytes) -> None:
        child, self.child = self.child, None
        allow_suspension(self)
        if child is None or child.stdin is None:
            return
        with suppress(OSError):  # it may have ended
            child.stdin.write(message)
            child.stdin.flush()
        child.stdin.close()
        try:
            child.wait(_EXIT_TIMEOUT_S if message else PATIENCE_S + _EXIT_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        if self.listener is not None:
            self.listener.join()
        _close_streams(child)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.stand_down()
        else:
            self.release()


def _dismiss_child(child: subprocess.Popen[bytes], listener: threading.Thread | None) -> None:
    child.wait()
    if listener is not None:
        listener.join()
    _close_streams(child)


def _close_streams(child: subprocess.Popen[bytes]) -> None:
    for stream in (child.stdin, child.stdout):
        if stream is not None:
            stream.close()


def watch_program(name: str, ends_force: str, *arguments: str) -> int:
    """Wait until the standard input ends; unless it ends with ``_DISMISSAL``, end the device's force.

    Return the exit code.
    """
    for number in ENDING_SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # it ends only after the program
    end_force = pkgutil.resolve_name(ends_force)
    sys.stdout.buffer.write(READY)
    sys.stdout.flush()
    if sys.stdin.buffer.read().endswith(_DISMISSAL):
        return 0
    deadline_s = time.perf_counter() + PATIENCE_S
    while True:
        try:
            end_force(*arguments)
        except DeviceError as error:
            if time.perf_counter() > deadline_s:
                sys.stderr.write(f"the device '{name}' may still exert force: {error}; turn it off\n")
                return 2
        else:
            return 0
        time.sleep(_RETRY_S)


if __name__ == "__main__":
    sys.exit(watch_program(*sys.argv[1:]))
