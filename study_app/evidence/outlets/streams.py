"""Streams to another process: accuracy of the markers' times, losses, and the effect on the servo's lateness."""

import hashlib
import itertools
import json
import math
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from study_app.devices.simulated import PlayedHand
from study_app.errors import WorkerError
from study_app.evidence.cost import hand_motion
from study_app.evidence.table import TURN_S, Evidence, paced_steps, take_turns
from study_app.evidence.timing.measurement import FULL, PERIOD_NS, ServoLoop, granted_classes
from study_app.haptics.runtime.servo import Servo
from study_app.outlets.markers import Marker, SinkThread, marker_of
from study_app.outlets.session_outlets import open_sink
from study_app.outlets.streams import SampleStream

PATIENCE_S: Final = 60.0


class Listener:
    """The process that runs ``outlets.listener``; leaving its context ends it."""

    def __init__(self, *arguments: str, pass_fds: Sequence[int] = ()) -> None:
        self._process = subprocess.Popen(  # noqa: S603 - a fixed command
            [sys.executable, "-m", "study_app.evidence.outlets.listener", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            pass_fds=pass_fds,
        )

    def wait_until_ready(self) -> None:
        assert self._process.stdout is not None  # noqa: S101 - a pipe
        if self._process.stdout.readline() != "ready\n":
            raise WorkerError(f"the listener does not receive anything: {self._process.communicate()[1].strip()}")

    def collect(self) -> Any:
        output, error = self._process.communicate(timeout=PATIENCE_S)
        if self._process.returncode != 0:
            raise WorkerError(f"the listener ended: {error.strip()}")
        return json.loads(output)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()


class _MeasuredStream(SampleStream):
    """A sample stream that hashes the sent samples (SHA-256), and sends nothing while it is held."""

    def __init__(self, telemetry: Any, rate_hz: float, now_ns: Callable[[], int]) -> None:
        self.hashed = hashlib.sha256()
        self.running = threading.Event()
        self.running.set()
        super().__init__(telemetry, rate_hz, now_ns)

    def send_new(self) -> None:
        """Send the samples since the previous call, unless the stream is held."""
        self.running.wait()
        super().send_new()

    def push(self, channels: NDArray[np.float32], times_s: NDArray[np.float64]) -> None:
        self.hashed.update(channels.tobytes())
        super().push(channels, times_s)

    def close(self) -> None:
        """Send the remaining samples and end the stream."""
        self.running.set()
        super().close()


_MAX_ERROR_MS: Final = 1.0
_MARKER_PERIOD_S: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Streamed:
    """The data received in ``seconds``.

    ``errors_us`` are the differences between marker times and the servo clock [µs], ``arrivals_ms`` the transmission
    times of the markers [ms]; both (n,). ``intact`` tells whether every sample arrived unchanged.
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
        """The 99th percentile of the marker time errors [ms]."""
        return float(np.percentile(self.errors_us, 99)) * 1e-3 if len(self.errors_us) else float("inf")

    @property
    def met(self) -> bool:
        """Whether no data were lost and the marker times are accurate."""
        return self.samples_lost == self.markers_lost == 0 and self.intact and self.error_p99_ms <= _MAX_ERROR_MS


def measure_streams(
    seconds: float, *, ending: threading.Event, progress: Callable[[str], object] = lambda _line: None
) -> Streamed:
    """Stream a servo at 1 kHz and twenty markers per second to a listener in another process."""
    servo = Servo(PlayedHand(hand_motion()))
    servo.prepare()
    sink = SinkThread(open_sink("lsl", servo.now_ns))
    samples = _MeasuredStream(servo.telemetry, servo.rate_hz, servo.now_ns)
    sent: list[Marker] = []
    try:
        with Listener() as listener:
            listener.wait_until_ready()
            origin_ns = servo.now_ns()
            servo.start()
            try:
                servo.load(FULL)
                for number in paced_steps(seconds, _MARKER_PERIOD_S, ending=ending, progress=progress):
                    servo.check()
                    sent.append(_trial_marker(number, servo.now_ns(), origin_ns))
                    sink.mark(sent[-1])
            finally:
                servo.stop()
            samples.close()
            sink.close()
            received = listener.collect()
    finally:
        samples.close()
        sink.close()
    return _stream_result(seconds, samples, sent, received)


def _trial_marker(number: int, now_ns: int, origin_ns: int) -> Marker:
    """Return a marker for an event at this moment in a trial with this number."""
    marker = marker_of("trial_started", 1e-9 * (now_ns - origin_ns), origin_ns, {"trial": number, "code": "L1"})
    assert marker is not None  # noqa: S101 - such events are markers
    return marker


def _stream_result(seconds: float, samples: _MeasuredStream, sent: list[Marker], received: dict[str, Any]) -> Streamed:
    times_ns = {marker.text: marker.time_ns for marker in sent}
    markers = received["markers"]
    delays_ns = [[marker[key] - times_ns[marker["text"]] for key in ("time_ns", "arrived_ns")] for marker in markers]
    errors_ns, arrivals_ns = np.array(delays_ns, np.float64).reshape(-1, 2).T
    return Streamed(
        seconds=seconds,
        samples_sent=samples.sent,
        samples_lost=samples.sent - received["samples"],
        intact=received["sha256"] == samples.hashed.hexdigest() and not samples.lost,
        worst_gap_ms=received["worst_gap_ms"],
        markers_sent=len(sent),
        markers_lost=len(sent) - len({json.loads(marker["text"])["trial"] for marker in markers}),
        errors_us=np.abs(errors_ns) * 1e-3,
        arrivals_ms=arrivals_ns * 1e-6,
    )


_MAX_RATIO: Final = 1.10
_DRAWS: Final = 2000


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratio:
    """The ratio of a lateness percentile with outlets to that without, with its 95 % interval.

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
        if self.high <= _MAX_RATIO:
            return "met"
        return "missed" if self.low > _MAX_RATIO else "undecided: measure for longer"


def compare_streams(
    seconds: float, *, ending: threading.Event, progress: Callable[[str], object] = lambda _line: None
) -> tuple[Ratio, ...]:
    """Return the ratios of the median and the 99th percentile of the lateness, with and without outlets.

    With outlets, a stream of samples and twenty markers per second go to a listener in another process; without them,
    its thread is idle. Pairs of segments alternate which condition comes first.
    """
    grants = granted_classes()
    loop = ServoLoop(grants.best or grants.normal, real_time=True, spin_us=None)
    servo, ticks_per_turn = loop.servo, round(TURN_S * 1e9) // PERIOD_NS
    sink = SinkThread(open_sink("lsl", servo.now_ns))
    samples = _MeasuredStream(servo.telemetry, servo.rate_hz, servo.now_ns)
    marking, is_over = threading.Event(), threading.Event()

    def mark() -> None:
        for number in itertools.count():
            marking.wait()
            if is_over.is_set():
                return
            sink.mark(_trial_marker(number, servo.now_ns(), 0))
            time.sleep(_MARKER_PERIOD_S)

    def lateness_ns(active: bool, _round: int) -> NDArray[np.int64]:
        for switch in (samples.running, marking):
            (switch.set if active else switch.clear)()
        return loop.run(ticks_per_turn).lateness_ns

    arms = {active: partial(lateness_ns, active) for active in (False, True)}
    rounds = max(round(seconds / TURN_S), 2)
    try:
        with Listener() as listener:
            listener.wait_until_ready()
            threading.Thread(target=mark, name="markers", daemon=True).start()
            late_ns = take_turns(arms, rounds, ending=ending, progress=progress, alternating=True)
    finally:
        is_over.set()
        marking.set()
        samples.close()
        sink.close()
    return tuple(_ratio_of(late_ns[True], late_ns[False], percentile) for percentile in (50, 99))


def _ratio_of(active: Sequence[NDArray[np.int64]], rest: Sequence[NDArray[np.int64]], percentile: int) -> Ratio:
    """Return the ratio of a percentile of the lateness [ns] over segments (n,), with to without outlets."""
    rng = np.random.default_rng(1)
    active_ns = np.array([np.percentile(segment, percentile) for segment in active])
    rest_ns = np.array([np.percentile(segment, percentile) for segment in rest])
    log_ratios = np.log(active_ns) - np.log(rest_ns)
    draws = [float(np.mean(log_ratios[rng.integers(0, len(log_ratios), len(log_ratios))])) for _ in range(_DRAWS)]
    low, high = np.exp(np.percentile(draws, [2.5, 97.5]))
    return Ratio(
        percentile=percentile,
        with_us=1e-3 * float(np.median(active_ns)),
        without_us=1e-3 * float(np.median(rest_ns)),
        ratio=float(np.exp(log_ratios.mean())),
        low=float(low),
        high=float(high),
    )


def streams_evidence(streams: Streamed, ratios: Sequence[Ratio]) -> Evidence:
    """Return the results as text."""
    p50_us, p50_ms, p99_ms = (
        float(np.percentile(values, proportion)) if len(values) else math.nan
        for values, proportion in ((streams.errors_us, 50), (streams.arrivals_ms, 50), (streams.arrivals_ms, 99))
    )
    lines = [
        f"streams received by another process for {streams.seconds:g} s",
        f"  samples of 10 channels: {streams.samples_sent} sent, {streams.samples_lost} lost, "
        f"{'intact' if streams.intact else 'NOT intact'}",
        f"  longest gap between their times: {streams.worst_gap_ms:.2f} ms",
        f"  markers: {streams.markers_sent} sent, {streams.markers_lost} lost",
        f"  difference between marker time and servo clock: p50 {p50_us:.1f} us, p99 {1e3 * streams.error_p99_ms:.1f} "
        f"us, limit {1e3 * _MAX_ERROR_MS:g} us",
        f"  from event to arrival: p50 {p50_ms:.2f} ms, p99 {p99_ms:.2f} ms",
        f"  {'met' if streams.met else 'missed'}",
        "servo lateness with and without both streams, alternating every 0.25 s",
    ]
    lines += [
        f"  p{ratio.percentile}: {ratio.with_us:.0f} us with, {ratio.without_us:.0f} us without, ratio "
        f"{ratio.ratio:.3f} ({ratio.low:.3f} to {ratio.high:.3f}), limit {_MAX_RATIO:g}: {ratio.verdict}"
        for ratio in ratios
    ]
    text = "\n".join(lines) + "\n"
    missed = not streams.met or any(ratio.percentile == 50 and ratio.verdict == "missed" for ratio in ratios)
    return Evidence(text, {"streams.txt": text}, missed=missed)
