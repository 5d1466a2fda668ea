"""Servers on this computer that hang or send unexpected data."""

import itertools
import os
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
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
    """Send bytes one by one, and repeat the last one forever."""
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


LENGTH: Final = (60_000).to_bytes(8, "little")
CHUNKED: Final = HTTP_OK + b"Transfer-Encoding: chunked\r\n\r\n"
_SENT: Final[Mapping[str, tuple[bytes | None, ...]]] = {
    "nothing": (),
    "nothing and ends": (CLOSE,),
    "a byte": (b"x",),
    "a byte and ends": (b"x", CLOSE),
    "a length": (LENGTH,),
    "a greeting of mail": (b"220 lab ESMTP\r\n",),
    "a greeting of a shell": (b"SSH-2.0-lab\r\n",),
    "an alert of TLS": (b"\x15\x03\x03\x00\x02\x02\x28", CLOSE),
    "brackets": (b"[" * 60_000,),
    "digits": (b"9" * 60_000,),
    "no text": (b"\xff\xfe\x00\xd8" * 1000,),
    "HTTP's head and ends": (HTTP_OK + b"\r\n", CLOSE),
    "HTTP's status with a bell": (b"HTTP/1.1 200 \x07\x1b[2J\nmore\r\n\r\n", CLOSE),
    "a long status of HTTP": (b"HTTP/1.1 200 " + b"x" * 60_000 + b"\r\n\r\n", CLOSE),
    "HTTP of another version": (b"HTTP/9.9 200 OK\r\n\r\n", CLOSE),
    "an error of HTTP": (b"HTTP/1.1 500 no\r\nContent-Length: 2\r\n\r\nno",),
    "a negative length by HTTP": (HTTP_OK + b"Content-Length: -1\r\n\r\nx", CLOSE),
    "a part of a body by HTTP": (HTTP_OK + b"Content-Length: 99\r\n\r\nx", CLOSE),
    "a chunk without a valid size by HTTP": (CHUNKED + b"x\r\n", CLOSE),
    "HTTP's way to itself": (b"HTTP/1.1 302 Found\r\nLocation: /\r\n\r\n",),
    "HTTP's way to a file": (b"HTTP/1.1 302 Found\r\nLocation: file:///etc/hostname\r\n\r\n",),
}
_DRIPPED: Final[Mapping[str, bytes]] = {
    "zeros": b"\0",
    "a length": b"\x40" + bytes(8),
    "a greeting": LENGTH,
    "HTTP's status": b"HTTP/1.1 200 x",
    "HTTP's head": HTTP_OK + b"x",
    "HTTP's lines": HTTP_OK,
    "a body by HTTP": HTTP_OK + b"Content-Length: 9999\r\n\r\n[1",
    "chunks by HTTP": CHUNKED + b"1\r\n1\r\n" * 1000,
}
_FLOODED: Final[Mapping[str, tuple[bytes, bytes]]] = {
    "zeros": (b"", b"\0"),
    "all bytes": (b"", bytes(range(256))),
    "text": (b"", b"HTTP/1.1 200 OK\r\n"),
    "2^62 bytes": ((1 << 62).to_bytes(8, "little"), b"x"),
    "8 GiB": ((1 << 33).to_bytes(8, "little"), b"x"),
    "a frame of a web socket": (b"\x81\x7f" + (1 << 62).to_bytes(8, "big"), b"x"),
    "HTTP's head": (HTTP_OK, b"x"),
    "HTTP's lines": (HTTP_OK, b"name: value\r\n"),
    "HTTP's 100 Continue": (b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
    "a body by HTTP": (HTTP_OK + b"\r\n", b"1"),
    "a long body by HTTP": (HTTP_OK + b"Content-Length: %d\r\n\r\n" % (1 << 62), b"1"),
}
STRANGERS: Final[Mapping[str, Answer]] = {
    **{f"sends {name}": sent(*parts) for name, parts in _SENT.items()},
    **{f"drips {name}": partial(lambda data, *_: dripped(data), data) for name, data in _DRIPPED.items()},
    **{f"floods {name}": partial(lambda parts, *_: flooded(*parts), parts) for name, parts in _FLOODED.items()},
}
"""Forty kinds of programs that answer in place of what a client asks for."""


def ends_with_each(client: Callable[[int], str], *, at_once: bool = False) -> dict[str, str]:
    """Return a client's message on each kind of wrong server; fail if it takes longer than `PATIENCE_S`."""

    def end(answer: Answer) -> str:
        with serving(answer, at_once=at_once) as port:
            began_s = time.perf_counter()
            said = client(port)
            took_s = time.perf_counter() - began_s
        return said if took_s < PATIENCE_S else f"late, {took_s:.1f} s: {said}"

    with ThreadPoolExecutor(8) as pool:
        return dict(zip(STRANGERS, pool.map(end, STRANGERS.values()), strict=True))


def _speak(connection: socket.socket, parts: Parts, ended: threading.Event) -> None:
    with connection, suppress(OSError):
        connection.settimeout(PATIENCE_S)
        while not ended.is_set():
            part = next(parts, b"")
            if part is CLOSE:
                return
            connection.sendall(part)
            ended.wait(0.0 if part else DRIP_S)


@contextmanager
def visited(port: int) -> Iterator[None]:
    """Let each kind of wrong client connect to a port of this computer."""
    ended = threading.Event()
    with ThreadPoolExecutor(len(STRANGERS)) as pool:
        for answer in STRANGERS.values():
            connection = socket.create_connection(("127.0.0.1", port), PATIENCE_S)
            pool.submit(_speak, connection, answer(b"", connection), ended)
        try:
            yield
        finally:
            ended.set()


@contextmanager
def serving(answer: Answer, *, at_once: bool = False) -> Iterator[int]:
    """Serve on a port of this computer; ``at_once``: the server speaks first."""
    ended = threading.Event()
    threads: list[threading.Thread] = []

    def serve(connection: socket.socket) -> None:
        with suppress(OSError):
            _speak(connection, answer(b"" if at_once else connection.recv(1 << 16), connection), ended)
        connection.close()

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
        if os.name == "posix":
            listener.shutdown(socket.SHUT_RDWR)
        else:  # here closing ends the call of accept
            listener.close()
        for thread in (accepting, *threads):
            thread.join()
        listener.close()
