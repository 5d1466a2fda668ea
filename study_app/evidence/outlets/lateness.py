"""The effect of outlets on the servo: its lateness with and without them, in alternating quarter seconds."""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study_app.evidence.outlets.listening import MeasuredStream, listening
from study_app.evidence.outlets.streams import MARKER_EVERY_S, numbered
from study_app.evidence.timing.loops import PERIOD_NS, ServoLoop, granted
from study_app.evidence.timing.measurement import TICK_S
from study_app.outlets.markers import SinkThread
from study_app.outlets.session_outlets import open_sink

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
