"""The servo's samples as a stream of the Lab Streaming Layer, at the servo's rate.

A separate thread reads the telemetry like the recorder's readers, so the servo's thread never calls the library, and
neither a window nor the disk delays the stream. It runs from before the first page to the end of the session, with or
without recordings. Every sample has the time at which the device was read.
"""

import threading
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from study_app.outlets.clock_mapping import ClockMapping
from study_app.outlets.streaming import SAMPLES, close_outlet, library, stream_info

EVERY_S: Final = 0.01
PATIENCE_S: Final = 1.0
CHANNELS: Final = (
    *(f"position_{axis} m" for axis in "xyz"),
    *(f"velocity_{axis} m/s" for axis in "xyz"),
    *(f"force_{axis} N" for axis in "xyz"),
    "limiters",
)


def channels_of(samples: Any) -> NDArray[np.float32]:
    """Return the channels of the stream for samples (array of ``layout.SAMPLE``).

    Returns
    -------
    (n, 10) array
        Position of the handle [m, hand frame], velocity after the estimator [m/s, scene], force that the device sent
        [N, hand frame], and the bits of the limiters that acted.
    """
    out = np.empty((len(samples), len(CHANNELS)), np.float32)
    out[:, 0:3] = samples["position_m"]
    out[:, 3:6] = samples["velocity_mps"]
    out[:, 6:9] = samples["device_force_n"]
    out[:, 9] = samples["limiters"]
    return out


class SampleStream:
    """An outlet of samples, and the thread that feeds it.

    Parameters
    ----------
    telemetry : Telemetry
        The servo's (``haptics.runtime.telemetry``).
    rate_hz : float
        Its nominal rate.
    now_ns : callable
        Its clock [ns].

    Attributes
    ----------
    sent : int
        Samples that were sent so far.
    lost : str
        Why samples are missing; empty while none are.

    Raises
    ------
    OutletError
        The library is not installed.
    """

    title = "LSL samples"

    def __init__(self, telemetry: Any, rate_hz: float, now_ns: Callable[[], int]) -> None:
        lsl = library()
        self.mapping = ClockMapping(now_ns, lsl.local_clock)
        self._outlet: Any = lsl.StreamOutlet(stream_info(lsl, SAMPLES, "Haptics", CHANNELS, rate_hz, "float32"))
        self._reader = telemetry.reader()
        self.sent = 0
        self.lost = ""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name="outlet LSL samples", daemon=True)
        self._thread.start()

    @property
    def described(self) -> Mapping[str, Any]:
        """The record of the stream in the receipt."""
        return {"stream": SAMPLES, "clock_uncertainty_us": round(1e6 * self.mapping.uncertainty_s, 3)}

    @property
    def listens(self) -> bool:
        """Whether a program receives the stream."""
        outlet = self._outlet  # its thread may release it meanwhile
        return bool(outlet is not None and outlet.have_consumers())

    def close(self) -> None:
        """Send the remaining samples, and end the stream."""
        self._ending.set()
        self._thread.join(PATIENCE_S)

    def _work(self) -> None:
        try:
            while not self._ending.wait(EVERY_S):
                self.send_new()
            self.send_new()
            close_outlet(self._outlet)
        except Exception as error:  # noqa: BLE001 - any error of the library: the session goes on without it
            self.lost = f"{type(error).__name__}: {error}"
        self._outlet = None

    def send_new(self) -> None:
        """Send the samples since the last time; called in the stream's thread."""
        samples = self._reader.read()
        if self._reader.dropped:
            self.lost = f"{self._reader.dropped} samples were not sent in time: this computer is too busy"
        if len(samples) == 0:
            return
        self.mapping.measure_if_due()
        times_s = 1e-9 * samples["time_ns"] + self.mapping.offset_s
        self.push(channels_of(samples), times_s)
        self.sent += len(samples)

    def push(self, channels: NDArray[np.float32], times_s: NDArray[np.float64]) -> None:
        """Push samples (n, 10), with their times on the clock of the Lab Streaming Layer [s]."""
        self._outlet.push_chunk(channels, times_s.tolist())
