"""The emulated service on a TCP port of this machine, in real time: what a client meets instead of Haply's.

Its thread leaves Python once a session is open: commands are received, carried out and answered by compiled code, as
quickly as by a service in C++.
"""

import ctypes
import json
import socket
import sys
import threading
from contextlib import suppress
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
from numba import types

from study_app.devices.emulators.inverse3_service import Service
from study_app.devices.emulators.inverse3_stream import INBOX, OUTBOX, SERVICE, release_due_frames, take_frames
from study_app.haptics.kernels.c_functions import NOW, call_at
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.runtime.clocks import SystemClock, raise_priority

_CALL = call_at(types.intp(types.intp, types.intp, types.uintp, types.int32))
_NOW = call_at(NOW)
_fields = SERVICE.fields
assert _fields is not None
_INBOX_AT, _OUTBOX_AT = int(_fields["inbox"][1]), int(_fields["outbox"][1])
_MOST: Final = 1 << 13


class ServiceServer:
    """Serves ``service`` on ``port`` of this machine, to one session at a time, while it is entered."""

    def __init__(self, service: Service, port: int = 0) -> None:
        self.service = service
        self._clock = SystemClock()
        self._time = np.array([self._clock.now_ns()], np.int64)
        service.compile()
        serve(service.memory, -1, 0, 0, (self._clock.now.address, self._clock.context), self._time)  # it has ended
        service.follow_clock(int(self._time.ctypes.data))
        self._listener = socket.create_server(("127.0.0.1", port))
        self.port = int(self._listener.getsockname()[1])
        self._open: list[socket.socket] = []
        self._threads: list[threading.Thread] = []

    def __enter__(self) -> Self:
        self._start(self._accept)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for endpoint in (self._listener, *self._open):
            with suppress(OSError):
                endpoint.shutdown(socket.SHUT_RDWR)
            endpoint.close()
        for thread in self._threads:
            thread.join()
        self.service.follow_clock(0)

    def drop(self) -> None:
        """Close all connections, as a service that is killed does."""
        for connection in self._open:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _start(self, work: Any, *arguments: Any) -> None:
        thread = threading.Thread(target=work, args=arguments, name="emulated Inverse Service", daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self) -> None:
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._open.append(connection)
            self._start(self._serve, connection)

    def _serve(self, connection: socket.socket) -> None:
        with connection, suppress(OSError):
            head = b""
            while b"\r\n\r\n" not in head:
                more = connection.recv(_MOST)
                if not more:
                    return
                head += more
            if b"upgrade: websocket" in head.lower():
                self._serve_session(connection, head)
            else:
                connection.sendall(self._answer_http(head))

    def _answer_http(self, head: bytes) -> bytes:
        """Answer a GET: "HTTP" 3.4.x, Devices; "Settings Reference" 3.5.x, GET /settings/KEY."""
        known = {"/settings/devices/force_scale": self.service.force_scale, "/devices": self.service.inventory()}
        path = head.split(b" ")[1].decode("latin-1")
        if known.get(path) is None:
            return b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
        body = json.dumps(known[path]).encode()
        return b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\nConnection: close\r\n\r\n%b" % (len(body), body)

    def _serve_session(self, connection: socket.socket, head: bytes) -> None:
        service, memory = self.service, self.service.memory
        self._time[0] = self._clock.now_ns()
        service.connected()
        service.take_bytes(head)
        connection.sendall(service.give_bytes())
        library = ctypes.CDLL("ws2_32" if sys.platform == "win32" else None)
        send, receive = (ctypes.cast(function, ctypes.c_void_p).value or 0 for function in (library.send, library.recv))
        clock = (self._clock.now.address, self._clock.context)
        raise_priority()  # on a busy computer the servo's thread runs before others: so must what answers it
        while serve(memory, connection.fileno(), send, receive, clock, self._time):
            service.process_inbox()
            connection.sendall(service.give_bytes())
        service.disconnected()


@kernel
def serve(memory: Any, file: int, send: int, receive: int, clock: Any, time: Any) -> bool:
    """Answer commands until a message comes that Python must answer (True), or the stream ends (False).

    Parameters
    ----------
    memory : (1,) array
        One row of ``stream.SERVICE``.
    file : int
        Descriptor of a socket that blocks.
    send, receive : int
        Addresses of its functions.
    clock : (int, int)
        Address of the clock's function, and its context.
    time : (1,) array
        Is given the time [ns].
    """
    service = memory[0]
    at = np.intp(memory.ctypes.data)
    while True:
        while service.read < service.written:
            time[0] = _NOW(clock[0], clock[1])
            service.now_ns = time[0]
            release_due_frames(service)
            begin = service.read % OUTBOX
            size = min(service.visible - service.read, OUTBOX - begin)
            if size == 0:
                break
            went = np.int32(_CALL(send, file, at + _OUTBOX_AT + begin, np.uintp(size), np.int32(0)))
            if went <= 0:
                return False
            service.read += went
        if service.ended:
            return False
        came = np.int32(
            _CALL(receive, file, at + _INBOX_AT + service.in_size, np.uintp(INBOX - service.in_size), np.int32(0))
        )
        if came <= 0:
            return False
        service.in_size += came
        time[0] = _NOW(clock[0], clock[1])
        take_frames(service)
        if service.complex_size != 0:
            return True
