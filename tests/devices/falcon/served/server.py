"""An emulated Falcon served in real time on a Unix socket, by the protocol of ``socket_frames``.

So other programs, such as another driver or the guard, can use it. Emulated time is the machine's. A transfer out is
computed at once to its end, and its answer is delayed until then; a transfer in advances from event to event of the
bridge, so that it may be pending while others are carried out.
"""

import math
import select
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import TracebackType
from typing import Final, Self

import click
import numpy as np

from study_app.devices.emulators.falcon_emulator import Emulator
from study_app.devices.falcon import constants
from study_app.devices.falcon.mechanics import DEFAULT_GEOMETRY
from study_app.errors import DeviceError
from tests.devices.falcon.served.bridge import ANSWER, BULK_IN, BULK_OUT, CONTROL, DESCRIPTOR, IDENTITY, REQUEST, TAGGED

_IDLE_S: Final = 0.02  # longest time without a request before the clock is checked
_MOST_BYTES: Final = 1 << 17
_MOST_PENDING: Final = 16  # requests of a client; further ones stay in its socket
_REFUSALS: Final = {
    "unplugged": constants.ERROR_NO_DEVICE,
    "access_denied": constants.ERROR_ACCESS,
    "not_supported": constants.ERROR_NOT_SUPPORTED,
    "busy": constants.ERROR_BUSY,
    "kernel_driver": constants.ERROR_BUSY,
}


@dataclass(slots=True, eq=False)
class _Request:
    kind: int
    at: int
    value: int
    length: int
    timeout_ms: int
    data: bytes  # to be transferred out, or transferred in so far
    tagged: bool
    ends_ns: float = 0.0  # when its time is out; 0: not begun
    answer: bytes = b""
    due_ns: int = 0  # when the answer may go


@dataclass(slots=True, eq=False)
class _Client:
    connection: socket.socket
    asked: bytearray = field(default_factory=bytearray)
    pending: list[_Request] = field(default_factory=list)


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
        emulator.compile()  # a client may ask from now on, and its time-outs are milliseconds
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

    def serve(self, progress: Callable[[], None] | None = None, every_s: float = 1.0) -> None:
        """Answer until `stop`; call ``progress`` at intervals. The path is removed in any case."""
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
                if progress is not None and time.monotonic() - told_s >= every_s:
                    told_s = time.monotonic()
                    progress()
        finally:
            self._close()

    def stop(self) -> None:
        """End `serve`; may be called from any thread or a signal handler."""
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
        """Return the clients with input, at the latest when a pending request may continue."""
        listening = [client.connection for client in self._clients.values() if len(client.pending) < _MOST_PENDING]
        due_ns = min(
            (self._due_ns(request) for client in self._clients.values() for request in client.pending), default=math.inf
        )
        seconds = min(max(due_ns - time.monotonic_ns(), 0) * 1e-9, _IDLE_S)
        ready, _, _ = select.select([self._door, self._heard, *listening], [], [], seconds)
        return set(ready)

    def _due_ns(self, request: _Request) -> float:
        return request.due_ns if request.answer else min(request.ends_ns, self.emulator.next_event_ns)

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
        """Disconnect a client; its last torque command stays."""
        self._clients.pop(client.connection, None)
        client.connection.close()
        if self._owner is client:
            self._owner = None

    def _serve(self, client: _Client) -> None:
        """Go on with all pending requests, at each endpoint in their order; send the answers that are due."""
        while len(client.pending) < _MOST_PENDING and (request := _take_request(client.asked)) is not None:
            client.pending.append(request)
        busy: set[int] = set()
        for request in client.pending:
            if not request.answer and request.kind not in busy:
                self._go_on(client, request)
            if not request.answer:
                busy.add(request.kind)
        in_order = True
        for request in list(client.pending):
            if request.answer and request.due_ns <= time.monotonic_ns() and (request.tagged or in_order):
                client.pending.remove(request)
                try:
                    client.connection.sendall(request.answer)
                except OSError:  # gone, or it does not read its answers
                    self._dismiss(client)
                    return
            elif not request.tagged:
                in_order = False

    def _go_on(self, client: _Client, request: _Request) -> None:
        """Carry out a request as far as possible now; set its answer when it is complete."""
        code, data = self._carry_out(client, request)
        if request.kind == BULK_IN:
            request.data += data
            now_ns = int(self._clock[0])
            if request.ends_ns == 0.0:
                request.ends_ns = now_ns + 1e6 * request.timeout_ms if request.timeout_ms else math.inf
            if code == constants.ERROR_TIMEOUT and now_ns < request.ends_ns:
                return
            data = request.data
        tag = bytes([request.kind | TAGGED]) if request.tagged else b""
        request.answer = tag + ANSWER.pack(code, len(data)) + data
        request.due_ns = self.emulator.now_ns if self._owner is client else 0

    def _carry_out(self, client: _Client, request: _Request) -> tuple[int, bytes]:
        """Return the code and the bytes of the answer."""
        emulator, kind, at = self.emulator, request.kind, request.at
        refused = self._claim(client)
        if refused != constants.SUCCESS:
            return refused, b""
        if kind == CONTROL:
            return emulator.control(at, request.value), b""
        if kind == BULK_OUT and at == constants.ENDPOINT_OUT:
            return emulator.write(request.data, request.timeout_ms)[0], b""
        if kind == BULK_IN and at == constants.ENDPOINT_IN:
            return emulator.poll(request.length - len(request.data))
        if kind == DESCRIPTOR:
            return constants.SUCCESS, IDENTITY.pack(
                constants.VENDOR_ID, constants.PRODUCT_ID
            ) + emulator.serial.encode()
        return (constants.ERROR_NOT_FOUND if kind in {BULK_OUT, BULK_IN} else constants.ERROR_NOT_SUPPORTED), b""

    def _claim(self, client: _Client) -> int:
        """Assign the interface to the first client; return 0 or the error of another client."""
        if self._owner is client:
            return constants.ERROR_NO_DEVICE if self.emulator.faults.is_on("unplugged") else constants.SUCCESS
        for fault, code in _REFUSALS.items():
            if self.emulator.faults.is_on(fault):
                return code
        if self._owner is not None:
            return constants.ERROR_BUSY
        self._owner = client
        self.emulator.claimed()
        return constants.SUCCESS

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


def _take_request(asked: bytearray) -> _Request | None:
    """Return the next request from a client's input; None if it is incomplete."""
    if len(asked) < REQUEST.size:
        return None
    kind, at, value, length, timeout_ms = REQUEST.unpack_from(asked)
    whole = REQUEST.size + (length if kind & ~TAGGED == BULK_OUT else 0)
    if len(asked) < whole:
        return None
    data = bytes(asked[REQUEST.size : whole])
    del asked[:whole]
    return _Request(kind & ~TAGGED, at, value, length, timeout_ms, data, bool(kind & TAGGED))


def _listen(path: Path) -> socket.socket:
    """Return a socket that listens at ``path``, where nothing is yet."""
    family = getattr(socket, "AF_UNIX", None)
    if family is None:
        raise DeviceError("a Falcon cannot be served here: this system's Python has no Unix sockets")
    if path.exists() or path.is_symlink():
        raise DeviceError(f"{path} exists already: name another socket, or remove it if no program serves it")
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


@click.command()
@click.option("--socket", required=True, type=click.Path(path_type=Path), metavar="PATH", help="Unix socket to serve.")
@click.option("--fault", "faults", multiple=True, metavar="NAME", help="frozen, drop=0.01 …; repeatable.")
@click.option("--running", is_flag=True, help="Start with the firmware already loaded.")
@click.option("--geometry", metavar="NAME", help="libnifalcon (default), zm-redux or martin-hillier.")
@click.option("--serial", default="EMULATED", show_default=True, metavar="TEXT", help="Serial number of the bridge.")
@click.option("--seed", default=0, show_default=True, metavar="N", help="Seed of tremor and faults.")
def emulate_falcon(
    socket: Path, faults: tuple[str, ...], running: bool, geometry: str | None, serial: str, seed: int
) -> None:
    """Serve an emulated Falcon to other programs, in real time, until Ctrl-C.

    It emulates the USB bridge, from the boot loader on, with the frames that
    bridge describes; --device falcon-socket:PATH connects our own driver.
    Lights, homing and torques are printed as they change, on a terminal only.
    """
    from tests.devices.falcon.served.server import EmulatorServer

    random = Random(seed)  # noqa: S311 - tremor and faults keep no secrets
    emulator = Emulator(random, geometry=geometry or DEFAULT_GEOMETRY, running=running, serial=serial)
    for fault in faults:
        emulator.take(fault)
    server = EmulatorServer(emulator, socket)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: server.stop())
    click.echo(f"An emulated Falcon at {socket}; press Ctrl-C to end it.")
    server.serve(_state_reporter(emulator) if sys.stdout.isatty() else None)


def _state_reporter(emulator: Emulator) -> Callable[[], None]:
    printed = ""

    def report_state() -> None:
        nonlocal printed
        state = state_of(emulator)
        if state != printed:
            printed = state
            click.echo(state)

    return report_state


def state_of(emulator: Emulator) -> str:
    """Return lights, homing and torques in a line."""

    names = {constants.FLAG_RED: "red", constants.FLAG_GREEN: "green", constants.FLAG_BLUE: "blue"}
    lights = ", ".join(name for flag, name in names.items() if emulator.lights & flag) or "none"
    torques = ", ".join(str(torque) for torque in emulator.torques)
    if not emulator.powered:
        return "no power"
    if not emulator.running:
        return f"no program yet, {emulator.loaded} bytes of it"
    return f"lights {lights} | arms homed {emulator.homed.bit_count()} of 3 | torques {torques}"


if __name__ == "__main__":
    try:
        emulate_falcon(standalone_mode=False)
    except DeviceError as error:
        click.echo(error, err=True)
        sys.exit(2)
