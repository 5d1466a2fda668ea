"""Reception of a session's streams in another process: accuracy of the markers' times, and losses."""

import json
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from study_app.evidence.outlets.listening import MeasuredStream, Received, listening
from study_app.evidence.outlets.pacing import paced
from study_app.evidence.timing.timed_scene import FULL, PlayedHand
from study_app.haptics.runtime.servo import Servo
from study_app.outlets.markers import Marker, SinkThread, marker_of
from study_app.outlets.session_outlets import open_sink

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
