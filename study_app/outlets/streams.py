"""Streams of the Lab Streaming Layer (extra ``lsl``), and a stream of the servo's samples at the servo's rate.

A separate thread reads the telemetry like the recorder's readers, so the servo's thread never calls the library, and
neither a window nor the disk delays the stream. It runs from before the first page to the end of the session, with or
without recordings. Every sample has the time at which the device was read; the servo's clock is mapped to the
library's by measurements at the start and while the stream runs.
"""

import platform
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import study_app
from study_app.errors import OutletError
from study_app.haptics.model.layout import SAMPLE_FIELDS
from study_app.number_text import counted

MARKERS: Final = "liquid-study markers"
SAMPLES: Final = "liquid-study samples"
_DELIVERY_S: Final = 0.2
"""Time for which a stream with receivers stays open after its last sample, to deliver it."""
_MEASURE_EVERY_S: Final = 5.0
_READINGS: Final = 8
_SEND_EVERY_S: Final = 0.01
PATIENCE_S: Final = 1.0
_STREAMED: Final = tuple(
    sorted((field for field in SAMPLE_FIELDS if field.stream), key=lambda field: field.name == "tick")
)
"""Fields of a sample in the order of their channels; the tick is last, since it was added last."""
TICKS: Final = 2**24
"""Ticks are numbered modulo this, up to which 32-bit floats are exact; they restart at 0 after 4.7 h."""
CHANNELS: Final = tuple(f"{name} {field.unit}".rstrip() for field in _STREAMED for name in field.named(field.stream))


def import_pylsl() -> Any:
    """Return the module ``pylsl``.

    Raises
    ------
    OutletError
        pylsl, or the library that it loads, is not installed.
    """
    try:
        import pylsl  # noqa: PLC0415 - an extra
    except (ImportError, RuntimeError) as error:
        raise OutletError("the Lab Streaming Layer needs pylsl: pip install 'liquid-study[lsl]'") from error
    return pylsl


def stream_info(lsl: Any, name: str, kind: str, labels: Sequence[str], rate_hz: float, form: str) -> Any:
    """Return the description of a stream: its name, its channels and the sender, without session data.

    ``labels`` are the names of the channels, each followed by a space and the unit if it has one.
    """
    source = f"{name} of {platform.node()}"
    info = lsl.StreamInfo(name, kind, len(labels), rate_hz, form, source)
    description = info.desc()
    description.append_child_value("manufacturer", "liquid-study")
    description.append_child_value("version", study_app.__version__)
    channels = description.append_child("channels")
    for label in labels:
        title, _, unit = label.partition(" ")
        channel = channels.append_child("channel")
        channel.append_child_value("label", title)
        if unit:
            channel.append_child_value("unit", unit)
    return info


def close_outlet(outlet: Any) -> None:
    """Wait until a receiving program has the last samples; the library closes the outlet with its last reference."""
    if outlet is not None and outlet.have_consumers():
        time.sleep(_DELIVERY_S)


class ClockMapping:
    """The offset between two clocks, with bounds that are certain.

    A reading of the other clock between two readings of the servo's clock bounds the offset. The bounds of later
    readings are intersected with the earlier ones; if the intersection is empty, the clocks have drifted, and only the
    newest bounds count. Call it from only one thread.
    """

    def __init__(self, now_ns: Callable[[], int], other_s: Callable[[], float]) -> None:
        self._now_ns = now_ns
        self._other_s = other_s
        self._low_s, self._high_s = float("-inf"), float("inf")
        self._due_s = 0.0
        self.measure()

    def measure(self) -> None:
        for _ in range(_READINGS):
            before_ns = self._now_ns()
            other_s = self._other_s()
            after_ns = self._now_ns()
            low_s, high_s = other_s - 1e-9 * after_ns, other_s - 1e-9 * before_ns
            if low_s > self._high_s or high_s < self._low_s:
                self._low_s, self._high_s = low_s, high_s
            else:
                self._low_s, self._high_s = max(low_s, self._low_s), min(high_s, self._high_s)
        self._due_s = time.perf_counter() + _MEASURE_EVERY_S

    def measure_if_due(self) -> None:
        """Measure the offset again if the last measurement is older than `_MEASURE_EVERY_S`."""
        if time.perf_counter() >= self._due_s:
            self.measure()

    @property
    def offset_s(self) -> float:
        """The other clock's time minus the servo's time [s]."""
        return 0.5 * (self._low_s + self._high_s)

    @property
    def uncertainty_s(self) -> float:
        """The maximum error of the offset [s]."""
        return 0.5 * (self._high_s - self._low_s)


def channels_of(samples: Any) -> NDArray[np.float32]:
    """Return the channels of the stream for samples (array of ``layout.SAMPLE``)."""
    names = [field.name for field in _STREAMED]
    columns = [samples[name] % TICKS if name == "tick" else samples[name] for name in names]
    return np.column_stack(columns).astype(np.float32)


class SampleStream:
    """An outlet of samples, and the thread that feeds it.

    Parameters
    ----------
    telemetry : Telemetry
        The servo's telemetry (``haptics.runtime.telemetry``).
    rate_hz : float
        The servo's nominal rate.
    now_ns : callable
        The servo's clock [ns].

    Attributes
    ----------
    sent : int
        Number of samples sent so far.
    lost : str
        The reason why samples are missing; empty if none are.

    Raises
    ------
    OutletError
        The library is not installed.
    """

    title = "LSL samples"

    def __init__(self, telemetry: Any, rate_hz: float, now_ns: Callable[[], int]) -> None:
        lsl = import_pylsl()
        self.mapping = ClockMapping(now_ns, lsl.local_clock)
        self._outlet: Any = lsl.StreamOutlet(stream_info(lsl, SAMPLES, "Haptics", CHANNELS, rate_hz, "float32"))
        self._reader = telemetry.reader()
        self.sent = 0
        self.lost = ""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._send_samples, name="outlet LSL samples", daemon=True)
        self._thread.start()

    @property
    def described(self) -> Mapping[str, Any]:
        return {"stream": SAMPLES, "clock_uncertainty_us": round(1e6 * self.mapping.uncertainty_s, 3)}

    @property
    def listens(self) -> bool:
        outlet = self._outlet  # its thread may release it at any time
        return bool(outlet is not None and outlet.have_consumers())

    def close(self) -> None:
        self._ending.set()
        self._thread.join(PATIENCE_S)

    def _send_samples(self) -> None:
        try:
            while not self._ending.wait(_SEND_EVERY_S):
                self.send_new()
            self.send_new()
            close_outlet(self._outlet)
        except Exception as error:  # noqa: BLE001 - any error of the library: the session continues without it
            self.lost = f"{type(error).__name__}: {error}"
        self._outlet = None

    def send_new(self) -> None:
        """Send the samples since the previous call; only for the stream's thread."""
        samples = self._reader.read()
        if self._reader.dropped:
            self.lost = (
                f"{counted(self._reader.dropped, 'sample')} could not be sent in time: this computer is too busy"
            )
        if len(samples) == 0:
            return
        self.mapping.measure_if_due()
        times_s = 1e-9 * samples["time_ns"] + self.mapping.offset_s
        self.push(channels_of(samples), times_s)
        self.sent += len(samples)

    def push(self, channels: NDArray[np.float32], times_s: NDArray[np.float64]) -> None:
        """Push samples (n, 11), with their times on the clock of the Lab Streaming Layer [s]."""
        self._outlet.push_chunk(channels, times_s.tolist())
