"""The listener's process and what it received, and a stream of samples that is compared with that."""

import hashlib
import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from study_app.errors import WorkerError
from study_app.outlets.streams import SampleStream

PATIENCE_S: Final = 60.0


@dataclass(frozen=True, slots=True)
class Received:
    """What a listener received.

    ``samples`` counts them, ``sha256`` is that of their channels, ``worst_gap_ms`` the longest time between two.
    ``markers`` are (text, time on the servo's clock [ns], time of arrival [ns]).
    """

    samples: int
    sha256: str
    worst_gap_ms: float
    markers: tuple[tuple[str, int, int], ...]


class Listener:
    """The listener's process; `ready` waits until it receives both streams, `end` ends it."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "study_app.evidence.outlets.listener"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def ready(self) -> None:
        """Wait until both streams are received.

        Raises
        ------
        WorkerError
            They are not.
        """
        assert self._process.stdout is not None  # noqa: S101 - asked for above
        if self._process.stdout.readline() != "ready\n":
            raise WorkerError(f"the listener does not receive the streams: {self._process.communicate()[1].strip()}")

    def end(self) -> Received:
        """End the listener and return what it received.

        Raises
        ------
        WorkerError
            It ended before.
        """
        said, error = self._process.communicate(timeout=PATIENCE_S)
        if self._process.returncode != 0:
            raise WorkerError(f"the listener ended: {error.strip()}")
        found: dict[str, Any] = json.loads(said)
        markers = tuple((one["text"], one["time_ns"], one["arrived_ns"]) for one in found["markers"])
        return Received(found["samples"], found["sha256"], found["worst_gap_ms"], markers)

    def kill(self) -> None:
        """End it without a result."""
        self._process.kill()
        self._process.communicate()


class MeasuredStream(SampleStream):
    """A stream of samples that keeps the SHA-256 of what it sent, and sends nothing while it is held."""

    def __init__(self, telemetry: Any, rate_hz: float, now_ns: Callable[[], int]) -> None:
        self.hashed = hashlib.sha256()
        self.running = threading.Event()
        self.running.set()
        super().__init__(telemetry, rate_hz, now_ns)

    def send_new(self) -> None:
        """Send the samples since the last time, once it is not held."""
        self.running.wait()
        super().send_new()

    def push(self, channels: NDArray[np.float32], times_s: NDArray[np.float64]) -> None:
        """Push samples."""
        self.hashed.update(channels.tobytes())
        super().push(channels, times_s)

    def close(self) -> None:
        """Send the remaining samples, and end the stream."""
        self.running.set()
        super().close()


@contextmanager
def listening() -> Iterator[Listener]:
    """Start a listener, and end it at the latest at the end."""
    listener = Listener()
    try:
        yield listener
    finally:
        listener.kill()
