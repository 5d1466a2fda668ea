"""The listener's process and what it received, and a stream of samples that is compared with that.

Progress of a measurement that lasts so many seconds.

Reception of a session's streams in another process: accuracy of the markers' times, and losses.

The effect of outlets on the servo: its lateness with and without them, in alternating quarter seconds.
"""

import hashlib
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from study_app.errors import WorkerError
from study_app.evidence.timing.measurement import FULL, PERIOD_NS, TICK_S, PlayedHand, ServoLoop, granted
from study_app.haptics.runtime.servo import Servo
from study_app.outlets.markers import Marker, SinkThread, marker_of
from study_app.outlets.session_outlets import open_sink
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


def paced(
    seconds: float, every_s: float, *, ending: threading.Event, progress: Callable[[str], object]
) -> Iterator[int]:
    """Yield 0, 1, 2 … for so many seconds, with a pause after each, and report each per cent once.

    Raises
    ------
    KeyboardInterrupt
        ``ending`` was set.
    """
    began_s, shown, number = time.monotonic(), -1, 0
    while (share := (time.monotonic() - began_s) / seconds) < 1:
        if ending.is_set():
            raise KeyboardInterrupt
        if int(100 * share) > shown:
            shown = int(100 * share)
            progress(f"{shown:3} %")
        yield number
        number += 1
        time.sleep(every_s)


MOST_ERROR_MS: Final = 1.0
MARKER_EVERY_S: Final = 0.05


@dataclass(frozen=True, slots=True)
class Streamed:
    """What arrived of so many ``seconds``.

    ``errors_us`` are the distances of the markers' times from the servo's clock [µs], ``arrivals_ms`` how long markers
    took to arrive [ms]; both (n,). ``intact`` says whether every sample arrived with the numbers that were sent.
    """

    seconds: float
    samples_sent: int
    samples_lost: int
    intact: bool
    worst_gap_ms: float
    markers_sent: int
    markers_lost: int
    errors_us: np.ndarray[tuple[int], np.dtype[np.float64]]
    arrivals_ms: np.ndarray[tuple[int], np.dtype[np.float64]]

    @property
    def error_p99_ms(self) -> float:
        """The 99th percentile of the markers' distance from the servo's clock [ms]."""
        return float(np.percentile(self.errors_us, 99)) * 1e-3 if len(self.errors_us) else float("inf")

    @property
    def met(self) -> bool:
        """Whether nothing was lost and the markers' times are accurate."""
        return self.samples_lost == self.markers_lost == 0 and self.intact and self.error_p99_ms <= MOST_ERROR_MS


def stream(
    seconds: float, *, ending: threading.Event, progress: Callable[[str], object] = lambda _line: None
) -> Streamed:
    """Stream a servo at 1 kHz, and twenty markers a second, to a listener in another process."""
    servo = Servo(PlayedHand())
    servo.prepare()
    sink = SinkThread(open_sink("lsl", servo.now_ns))
    samples = MeasuredStream(servo.telemetry, servo.rate_hz, servo.now_ns)
    sent: list[Marker] = []
    try:
        with listening() as listener:
            listener.ready()
            origin_ns = servo.now_ns()
            servo.start()
            try:
                servo.load(FULL)
                for number in paced(seconds, MARKER_EVERY_S, ending=ending, progress=progress):
                    servo.check()
                    sent.append(numbered(number, servo.now_ns(), origin_ns))
                    sink.mark(sent[-1])
            finally:
                servo.stop()
            samples.close()
            sink.close()
            received = listener.end()
    finally:
        samples.close()
        sink.close()
    return _found(seconds, samples, sent, received)


def numbered(number: int, now_ns: int, origin_ns: int) -> Marker:
    """Return the marker of an event that happens now, of a trial with this number."""
    marker = marker_of("trial_started", 1e-9 * (now_ns - origin_ns), origin_ns, {"trial": number, "code": "L1"})
    assert marker is not None  # noqa: S101 - such events are markers
    return marker


def _found(seconds: float, samples: MeasuredStream, sent: list[Marker], received: Received) -> Streamed:
    times_ns = {marker.text: marker.time_ns for marker in sent}
    arrived = [(time_ns - times_ns[text], at_ns - times_ns[text]) for text, time_ns, at_ns in received.markers]
    errors_ns, took_ns = np.array(arrived, np.float64).reshape(-1, 2).T
    return Streamed(
        seconds=seconds,
        samples_sent=samples.sent,
        samples_lost=samples.sent - received.samples,
        intact=received.sha256 == samples.hashed.hexdigest() and not samples.lost,
        worst_gap_ms=received.worst_gap_ms,
        markers_sent=len(sent),
        markers_lost=len(sent) - len({json.loads(text)["trial"] for text, _, _ in received.markers}),
        errors_us=np.abs(errors_ns) * 1e-3,
        arrivals_ms=took_ns * 1e-6,
    )


MOST_RATIO: Final = 1.10
_DRAWS: Final = 2000


@dataclass(frozen=True, slots=True)
class Ratio:
    """A percentile of the lateness with outlets, by that without them, and its 95 % interval.

    Segments of 0.25 s are resampled in pairs, with and without.
    """

    percentile: int
    with_us: float
    without_us: float
    ratio: float
    low: float
    high: float

    @property
    def verdict(self) -> str:
        """The verdict in a word or two."""
        if self.high <= MOST_RATIO:
            return "met"
        return "missed" if self.low > MOST_RATIO else "undecided: measure for longer"


def compare(
    seconds: float, *, ending: threading.Event, progress: Callable[[str], object] = lambda _line: None
) -> tuple[Ratio, ...]:
    """Return the median lateness with and without outlets, and the 99th percentile.

    With outlets, a stream of samples and twenty markers a second go to a listener in another process. Without them its
    thread rests. Each pair of segments begins with the other.

    Parameters
    ----------
    ending : is set by whoever wants no more
    """
    grants = granted()
    grant = grants.best or grants.normal
    loop = ServoLoop(grant, real_time=True, spin_us=None)
    servo = loop.servo
    ticks, rounds = round(TICK_S * 1e9) // PERIOD_NS, max(round(seconds / TICK_S), 2)
    late_ns: dict[bool, list[NDArray[np.int64]]] = {True: [], False: []}
    sink = SinkThread(open_sink("lsl", servo.now_ns))
    samples = MeasuredStream(servo.telemetry, servo.rate_hz, servo.now_ns)
    marking = threading.Event()
    over = threading.Event()

    def mark() -> None:
        number = 0
        while not over.is_set():
            marking.wait()
            sink.mark(numbered(number, servo.now_ns(), 0))
            number += 1
            time.sleep(MARKER_EVERY_S)

    marker = threading.Thread(target=mark, name="markers", daemon=True)
    try:
        with listening() as listener:
            listener.ready()
            marker.start()
            for number in range(rounds):
                for active in (True, False) if number % 2 else (False, True):
                    if ending.is_set():
                        raise KeyboardInterrupt
                    for switch in (samples.running, marking):
                        (switch.set if active else switch.clear)()
                    late_ns[active].append(loop.run(ticks).lateness_ns)
                progress(f"{100 * (number + 1) // rounds:3} %")
    finally:
        over.set()
        marking.set()
        samples.close()
        sink.close()
    return tuple(ratio_of(late_ns[True], late_ns[False], percentile) for percentile in (50, 99))


def ratio_of(active: Sequence[NDArray[np.int64]], rest: Sequence[NDArray[np.int64]], percentile: int) -> Ratio:
    """Return the ratio of a percentile of latenesses [ns] by segments (each (n,)), with and without outlets."""
    rng = np.random.default_rng(1)
    own = np.array([np.percentile(segment, percentile) for segment in active])
    other = np.array([np.percentile(segment, percentile) for segment in rest])
    logs = np.log(own) - np.log(other)
    draws = [float(np.mean(logs[rng.integers(0, len(logs), len(logs))])) for _ in range(_DRAWS)]
    low, high = np.exp(np.percentile(draws, [2.5, 97.5]))
    return Ratio(
        percentile,
        1e-3 * float(np.median(own)),
        1e-3 * float(np.median(other)),
        float(np.exp(logs.mean())),
        float(low),
        float(high),
    )
