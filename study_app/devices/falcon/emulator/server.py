"""An emulated Falcon served in real time on a Unix socket, as ``framing`` says.

So other programs, another driver or our own guard, can be put in front of it. Emulated time is the machine's: a
transfer is computed at once up to where it ends, and its answer is held back until that moment has come.
"""

from __future__ import annotations

import select
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import numpy as np

from study_app.devices.falcon import wire
from study_app.devices.falcon.emulator.face import Emulator
from study_app.devices.falcon.framing import ANSWER, BULK_IN, BULK_OUT, CONTROL, DESCRIPTOR, IDENTITY, REQUEST
from study_app.errors import DeviceError

_IDLE_S: Final = 0.02  # how long nobody may ask before it is looked at anyway
_MOST_BYTES: Final = 1 << 17
_REFUSALS: Final = {
    "unplugged": wire.ERROR_NO_DEVICE,
    "access_denied": wire.ERROR_ACCESS,
    "not_supported": wire.ERROR_NOT_SUPPORTED,
    "busy": wire.ERROR_BUSY,
    "kernel_driver": wire.ERROR_BUSY,
}


@dataclass(slots=True, eq=False)
class _Client:
    connection: socket.socket
    asked: bytearray = field(default_factory=bytearray)
    answer: bytes = b""
    due_ns: int = 0  # when the answer may go


class EmulatorServer:
    """Serves ``emulator`` at ``path`` while `serve` runs; as a context manager in a thread of its own.

    Raises
    ------
    DeviceError
        Something is at ``path`` already, it cannot be made there, or this system has no Unix sockets.
    """

    def __init__(self, emulator: Emulator, path: str | Path) -> None:
        self.emulator = emulator
        self.path = Path(path)
        self._clock = np.array([time.monotonic_ns()], np.int64)
        emulator.follow_clock(int(self._clock.ctypes.data))
        self._clients: dict[socket.socket, _Client] = {}
        self._owner: _Client | None = None
        self._changed = threading.Condition()
        self._thread: threading.Thread | None = None
        self._door = _listen(self.path)
        self._bell, self._heard = socket.socketpair()

    @property
    def clients(self) -> int:
        """How many programs are connected."""
        return len(self._clients)

    def serve(self, tell: Callable[[], None] | None = None, every_s: float = 1.0) -> None:
        """Answer until `stop`; call ``tell`` now and then. Leaves nothing at the path, however it ends."""
        told_s = time.monotonic()
        try:
            while True:
                ready = self._wait()
                if self._heard in ready:
                    return
                self._clock[0] = time.monotonic_ns()
                if not ready:
                    self.emulator.look()
                if self._door in ready:
                    self._welcome()
                for connection in ready:
                    if connection in self._clients:
                        self._hear(self._clients[connection])
                for client in list(self._clients.values()):
                    self._serve(client)
                with self._changed:
                    self._changed.notify_all()
                if tell is not None and time.monotonic() - told_s >= every_s:
                    told_s = time.monotonic()
                    tell()
        finally:
            self._close()

    def stop(self) -> None:
        """Let `serve` end; from any thread or a signal's handler."""
        with suppress(OSError):  # it has ended already
            self._bell.send(b".")

    def until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Wait in another thread until something was served after which ``condition`` holds; whether it did."""
        with self._changed:
            return self._changed.wait_for(condition, timeout_s)

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self.serve, name="emulated Falcon", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._thread is not None and self._thread.is_alive():
            self.stop()
            self._thread.join()

    def _wait(self) -> set[socket.socket]:
        """Return who has something to say, at the latest when the next answer is due."""
        waiting = [client for client in self._clients.values() if client.answer]
        listening = [client.connection for client in self._clients.values() if not client.answer]
        seconds = _IDLE_S
        if waiting:
            due_ns = min(client.due_ns for client in waiting)
            seconds = min(max(due_ns - time.monotonic_ns(), 0) * 1e-9, _IDLE_S)
        ready, _, _ = select.select([self._door, self._heard, *listening], [], [], seconds)
        return set(ready)

    def _welcome(self) -> None:
        connection, _ = self._door.accept()
        connection.setblocking(False)
        self._clients[connection] = _Client(connection)

    def _hear(self, client: _Client) -> None:
        try:
            more = client.connection.recv(_MOST_BYTES)
        except BlockingIOError:
            return
        except OSError:
            more = b""
        if not more:
            self._dismiss(client)
        client.asked += more

    def _dismiss(self, client: _Client) -> None:
        """Let a client go; whatever it told the motors last stays."""
        self._clients.pop(client.connection, None)
        client.connection.close()
        if self._owner is client:
            self._owner = None

    def _serve(self, client: _Client) -> None:
        """Carry out the next request that is whole, if the last one is answered; answer what is due."""
        if not client.answer and len(client.asked) >= REQUEST.size:
            kind, at, value, length, timeout_ms = REQUEST.unpack_from(client.asked)
            whole = REQUEST.size + (length if kind == BULK_OUT else 0)
            if len(client.asked) < whole:
                return
            data = bytes(client.asked[REQUEST.size : whole])
            del client.asked[:whole]
            code, told = self._carry_out(client, kind, at, value, length, timeout_ms, data)
            client.answer = ANSWER.pack(code, len(told)) + told
            client.due_ns = self.emulator.now_ns if self._owner is client else 0
        if client.answer and client.due_ns <= time.monotonic_ns():
            try:
                client.connection.sendall(client.answer)
            except OSError:  # gone, or not listening: it has to take one answer before it asks again
                self._dismiss(client)
            client.answer = b""

    def _carry_out(
        self, client: _Client, kind: int, at: int, value: int, length: int, timeout_ms: int, data: bytes
    ) -> tuple[int, bytes]:
        """Return the code and the bytes of the answer."""
        emulator = self.emulator
        refused = self._claim(client)
        if refused != wire.SUCCESS:
            return refused, b""
        if kind == CONTROL:
            return emulator.control(at, value), b""
        if kind == BULK_OUT and at == wire.ENDPOINT_OUT:
            return emulator.write(data, timeout_ms)[0], b""
        if kind == BULK_IN and at == wire.ENDPOINT_IN:
            return emulator.read(length, timeout_ms)
        if kind == DESCRIPTOR:
            return wire.SUCCESS, IDENTITY.pack(wire.VENDOR_ID, wire.PRODUCT_ID) + emulator.serial.encode()
        return (wire.ERROR_NOT_FOUND if kind in {BULK_OUT, BULK_IN} else wire.ERROR_NOT_SUPPORTED), b""

    def _claim(self, client: _Client) -> int:
        """Give the one interface to who asks first; return 0 or why a client cannot have it."""
        if self._owner is client:
            return wire.ERROR_NO_DEVICE if self.emulator.faults.is_on("unplugged") else wire.SUCCESS
        for fault, code in _REFUSALS.items():
            if self.emulator.faults.is_on(fault):
                return code
        if self._owner is not None:
            return wire.ERROR_BUSY
        self._owner = client
        self.emulator.claimed()
        return wire.SUCCESS

    def _close(self) -> None:
        for client in list(self._clients.values()):
            self._dismiss(client)
        self._door.close()
        self._bell.close()
        self._heard.close()
        self.path.unlink(missing_ok=True)
        self.emulator.follow_clock(0)
        with self._changed:
            self._changed.notify_all()


def _listen(path: Path) -> socket.socket:
    """Return a socket that listens at ``path``, where nothing is yet."""
    family = getattr(socket, "AF_UNIX", None)
    if family is None:
        raise DeviceError("a Falcon cannot be served here: this system's Python has no Unix sockets")
    if path.exists() or path.is_symlink():
        raise DeviceError(f"{path} exists already: name another socket, or remove it if nobody serves there")
    door = socket.socket(family, socket.SOCK_STREAM)
    try:
        door.bind(str(path))
        door.listen()
    except OSError as error:
        door.close()
        raise DeviceError(
            f"{path}: no socket can be made there ({error}); name a short path in a folder of yours"
        ) from None
    return door
