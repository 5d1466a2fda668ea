"""A Falcon's bridge of this process that other processes open by the path of a Unix socket.

The bridge outlives a program that is killed, as a real one does. One program uses it at a time; the next one waits.
"""

import ctypes
import threading
import time
from multiprocessing.connection import Client, Listener
from types import SimpleNamespace
from typing import Any

from study_app.devices.falcon import constants
from study_app.devices.falcon.constants import milliseconds
from study_app.devices.falcon.failures import FalconLost, FalconNotFound, usb_failure
from study_app.devices.falcon.transport import send_zero_torque
from study_app.errors import DeviceError


class Recorder:
    """A bridge that accepts and records all packets."""

    def __init__(self) -> None:
        self.sent = list[bytes]()
        self.controls = list[tuple[int, int]]()

    def note_claim(self) -> None:
        """Record that a program has claimed the bridge."""

    def pause(self, _seconds: float) -> None:
        """Do not wait."""

    def control(self, request: int, value: int) -> int:
        self.controls.append((request, value))
        return constants.SUCCESS

    def write(self, data: bytes, _timeout_ms: int) -> tuple[int, int]:
        self.sent.append(data)
        return constants.SUCCESS, len(data)


class Server(threading.Thread):
    """Serves the methods of ``bridge``, an emulator or a `Recorder`, at the Unix socket ``path``.

    The first ``refusals`` programs are sent away; ``programs`` counts those that were served.
    """

    def __init__(self, path: Any, bridge: Any = None) -> None:
        super().__init__(daemon=True)
        self.path, self.bridge = str(path), Recorder() if bridge is None else bridge
        self.refusals = self.programs = 0
        self._ending = False
        self._listener = Listener(self.path, family="AF_UNIX")

    def __enter__(self) -> "Server":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending = True
        Client(self.path).close()
        self.join()
        self._listener.close()

    def run(self) -> None:
        while True:
            connection = self._listener.accept()
            with connection:
                if self._ending:
                    return
                if self.refusals:
                    self.refusals -= 1
                    continue
                self.programs += 1
                try:
                    while True:
                        name, *arguments = connection.recv()
                        attribute = getattr(self.bridge, name)
                        connection.send(attribute(*arguments) if callable(attribute) else attribute)
                except (EOFError, OSError):
                    pass

    def wait_for(self, count: int, timeout_s: float = 30.0) -> None:
        """Wait until a `Recorder` was sent so many packets."""
        ends_s = time.perf_counter() + timeout_s
        while len(self.bridge.sent) < count:
            assert time.perf_counter() < ends_s, self.bridge.sent
            time.sleep(0.002)


class ServedTransport:
    """The bridge that a `Server` offers."""

    serial = None

    def __init__(self, path: str) -> None:
        self.name = path
        self._connection: Any = None
        self.reopen()

    def reopen(self) -> None:
        self.close()
        try:
            self._connection = Client(self.name)
        except OSError as error:
            raise FalconNotFound("not-found", f"connecting to {self.name}: {error.strerror}") from error
        self._ask("note_claim")

    def control(self, request: int, value: int) -> None:
        _check(self._ask("control", request, value), "configuring the USB bridge")

    def write(self, data: bytes, timeout_s: float) -> None:
        _check(self._ask("write", data, milliseconds(timeout_s))[0], "sending")

    def read(self, size: int, timeout_s: float) -> bytes:
        code, data = self._ask("read", size, milliseconds(timeout_s))
        _check(code if code != constants.ERROR_TIMEOUT else 0, "receiving")
        return bytes(data)

    def calls(self) -> Any:
        """Return the bridge as compiled code sees it; good until `close` or `reopen`."""
        from tests.devices.falcon.support.scripted_bridge import BULK_CALL

        self._transfer = BULK_CALL(self._move)
        return SimpleNamespace(handle=0, transfer=ctypes.cast(self._transfer, ctypes.c_void_p).value or 0)

    def now_s(self) -> float:
        return float(self._ask("now_ns")) * 1e-9

    def pause(self, seconds: float) -> None:
        self._ask("pause", seconds)

    def close(self) -> None:
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def _ask(self, *request: Any) -> Any:
        if self._connection is None:
            raise FalconLost("no-device", "using it after it had been closed")
        try:
            self._connection.send(request)
            return self._connection.recv()
        except (EOFError, OSError) as error:
            self.close()
            raise usb_failure(constants.ERROR_NO_DEVICE, "using it") from error

    def _move(self, _handle: int, endpoint: int, data: int, length: int, transferred: int, timeout_ms: int) -> int:
        moved = ctypes.c_int32.from_address(transferred)
        if endpoint == constants.ENDPOINT_OUT:
            code, moved.value = self._ask("write", ctypes.string_at(data, length), timeout_ms)
            return int(code)
        code, came = self._ask("read", length, timeout_ms)
        moved.value = len(came)
        ctypes.memmove(data, came, len(came))
        return int(code)


def _check(code: int, where: str) -> None:
    if code < 0:
        raise usb_failure(code, where)


def end_torque(path: str) -> None:
    """End the torque as the Falcon's guard does."""
    transport = ServedTransport(path)
    try:
        if not send_zero_torque(transport):
            raise DeviceError("the device does not accept packets")
    finally:
        transport.close()
