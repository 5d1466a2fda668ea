"""The guard: a small process that sends zero torque if the program dies.

A Falcon without further packets may keep its last torque. So a child process waits on a pipe from the program; if the
pipe ends without ``WORD``, the program has died, and the child opens the Falcon and sends packets of zero torque. They
keep the homing flag, and the bridge's settings are unchanged, so that the Falcon stays loaded and homed. Run as
``python -m study_app.devices.falcon.guard NAME``, NAME being one of ``transport.open_transport``.
"""

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import IO, Final, Self

from study_app.devices.falcon.transport.transport import Transport, open_transport
from study_app.devices.falcon.wire.constants import FLAG_HOMING, quiet_packet
from study_app.errors import DeviceError
from study_app.haptics.runtime.suspension import allow_suspension, refuse_suspension

WORD: Final = b"done\n"
READY: Final = b"ready\n"
PACKETS: Final = 10
PATIENCE_S: Final = 10.0
"""Time in which the guard tries to open the Falcon: the system needs a moment to release it from a dead program."""

_RETRY_S = 0.02
_BETWEEN_S = 0.002
_WRITE_S = 0.1
_LEAVE_S = 5.0


class Guard:
    """The guard of the Falcon that ``open_transport(name)`` opens.

    It can act when the program has died, not while it is suspended: from its start until it is dismissed Ctrl-Z does
    nothing. As a context manager it starts on entry and is dismissed on exit; after an exception it is not dismissed,
    but sends its packets as soon as the Falcon is closed.

    Parameters
    ----------
    name : of the Falcon
    died : called in a separate thread if the guard ends before it is dismissed: then no force may be sent
    """

    def __init__(self, name: str, died: Callable[[], object] | None = None) -> None:
        self._name = name
        self._died = died
        self.child: subprocess.Popen[bytes] | None = None
        self._left: subprocess.Popen[bytes] | None = None
        self.listener: threading.Thread | None = None

    def start(self) -> None:
        """Start it, and wait until it watches.

        Raises
        ------
        DeviceError
            It does not start: then no force may be sent.
        """
        if self.child is not None:
            return
        command = [sys.executable, "-P", "-m", __spec__.name, self._name]  # -P: no modules of the present folder
        # In a separate session or console: closing the program's terminal does not end its guard.
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
            _close(child)
            raise DeviceError(
                "the Falcon's guard process does not start, so no force may be sent: reinstall liquid-study"
            )
        self.child = child
        refuse_suspension(self)
        self.listener = threading.Thread(target=self._listen, args=(child, child.stdout), name="guard", daemon=True)
        self.listener.start()

    @property
    def watching(self) -> bool:
        """Whether it was started and still runs."""
        return self.child is not None and self.child.poll() is None

    def _listen(self, child: subprocess.Popen[bytes], said: IO[bytes]) -> None:
        said.read()  # it sends no more data; so this returns when the guard ends
        if self.child is child and self._died is not None:
            self._died()

    def stand_down(self) -> None:
        """Dismiss the guard: the torque is zero and the Falcon closed. A second call does nothing."""
        self._end(WORD)

    def release(self) -> None:
        """Let it send its packets after the Falcon is closed; wait for the end."""
        self._end(b"")

    def leave(self) -> None:
        """Let the guard send its packets once the Falcon is connected again, within a limited time; return at once.

        For a lost link: the Falcon may still exert force, and may reconnect before any program opens it.
        """
        child, self.child = self.child, None
        allow_suspension(self)
        if child is None or child.stdin is None:
            return
        child.stdin.close()
        self._left = child
        threading.Thread(target=_see_off, args=(child, self.listener), name="guard", daemon=True).start()

    def recall(self) -> None:
        """End the process that `leave` left behind: the program has opened the Falcon again, with another guard.

        Otherwise it would try until its time limit to open a Falcon that is in use, and report a danger.
        """
        left, self._left = self._left, None
        if left is not None:
            left.kill()

    def _end(self, word: bytes) -> None:
        child, self.child = self.child, None
        allow_suspension(self)
        if child is None or child.stdin is None:
            return
        with suppress(OSError):  # it may have gone
            child.stdin.write(word)
            child.stdin.flush()
        child.stdin.close()
        try:
            child.wait(_LEAVE_S if word else PATIENCE_S + _LEAVE_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        if self.listener is not None:
            self.listener.join()
        _close(child)

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


def _see_off(child: subprocess.Popen[bytes], listener: threading.Thread | None) -> None:
    child.wait()
    if listener is not None:
        listener.join()
    _close(child)


def _close(child: subprocess.Popen[bytes]) -> None:
    for stream in (child.stdin, child.stdout):
        if stream is not None:
            stream.close()


def quiet(transport: Transport) -> int:
    """Send ``PACKETS`` packets of zero torque; return the number sent."""
    sent = 0
    for _ in range(PACKETS):
        with suppress(DeviceError):
            transport.write(quiet_packet(FLAG_HOMING), _WRITE_S)
            sent += 1
        transport.pause(_BETWEEN_S)
    return sent


def open_patiently(name: str) -> Transport:
    """Return the opened Falcon, with attempts for ``PATIENCE_S``; then raise the error."""
    ends_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            return open_transport(name)
        except DeviceError:
            if time.monotonic() > ends_s:
                raise
        time.sleep(_RETRY_S)


def watch(name: str) -> int:
    """Wait for the end of the standard input; without ``WORD`` in it, send zero torque. Return an exit code."""
    for number in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, number):
            signal.signal(getattr(signal, number), signal.SIG_IGN)  # it ends when the program has ended
    sys.stdout.buffer.write(READY)
    sys.stdout.flush()
    if sys.stdin.buffer.read().endswith(WORD):
        return 0
    try:
        transport = open_patiently(name)
    except DeviceError as error:
        sys.stderr.write(f"the Falcon may still push: {error}; turn it off\n")
        return 2
    try:
        return 0 if quiet(transport) else 2
    finally:
        transport.close()


if __name__ == "__main__":
    sys.exit(watch(*sys.argv[1:]))
