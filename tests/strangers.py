"""Servers of this computer that hang, or send something else than what a client expects."""

import itertools
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final, TypeAlias

DRIP_S: Final = 0.02
CLOSE: Final = None
PATIENCE_S: Final = 3.0
HTTP_OK: Final = b"HTTP/1.1 200 OK\r\nConnection: close\r\n"
Parts: TypeAlias = Iterator[bytes | None]
"""What is sent over a connection; `CLOSE` ends it, and after the last part it stays open."""
Answer: TypeAlias = Callable[[bytes, socket.socket], Parts]
"""Answers what a connection begins with."""


def dripped(data: bytes, pause_s: float = DRIP_S) -> Parts:
    """Send bytes one by one, and go on with the last for ever."""
    for at in itertools.count():
        yield data[min(at, len(data) - 1) :][:1]
        time.sleep(pause_s)


def flooded(begin: bytes, again: bytes) -> Parts:
    """Send something again and again."""
    yield begin
    while True:
        yield again * (1 + 20_000 // len(again))


def sent(*parts: bytes | None) -> Callable[..., Parts]:
    return lambda *_: iter(parts)


def http_answer(body: bytes) -> Answer:
    return sent(HTTP_OK + b"Content-Length: %d\r\n\r\n%b" % (len(body), body))


@contextmanager
def serving(answer: Answer, *, at_once: bool = False) -> Iterator[int]:
    """Serve on a port of this computer; ``at_once``: the server speaks first."""
    ended = threading.Event()
    threads: list[threading.Thread] = []

    def serve(connection: socket.socket) -> None:
        with connection, suppress(OSError):
            parts = answer(b"" if at_once else connection.recv(1 << 16), connection)
            while not ended.is_set():
                part = next(parts, b"")
                if part is CLOSE:
                    return
                connection.sendall(part)
                ended.wait(0.0 if part else DRIP_S)

    def accept() -> None:
        with suppress(OSError):
            while True:
                connection, _ = listener.accept()
                connection.settimeout(PATIENCE_S)
                threads.append(threading.Thread(target=serve, args=(connection,)))
                threads[-1].start()

    listener = socket.create_server(("127.0.0.1", 0))
    accepting = threading.Thread(target=accept)
    accepting.start()
    try:
        yield int(listener.getsockname()[1])
    finally:
        ended.set()
        listener.shutdown(socket.SHUT_RDWR)
        for thread in (accepting, *threads):
            thread.join()
        listener.close()
