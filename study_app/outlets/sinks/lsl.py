"""Markers as a stream of the Lab Streaming Layer, each with the time of its event."""

from collections.abc import Callable, Mapping
from typing import Any

from study_app.outlets.clock_mapping import ClockMapping
from study_app.outlets.marker import CODES, Marker
from study_app.outlets.sink import SinkKind
from study_app.outlets.streaming import MARKERS, close_outlet, library, stream_info


class MarkerStream:
    """An outlet of markers, timed by the servo's clock.

    Raises
    ------
    OutletError
        The library is not installed.
    """

    title = "LSL markers"

    def __init__(self, now_ns: Callable[[], int]) -> None:
        lsl = library()
        info = stream_info(lsl, MARKERS, "Markers", ("marker",), 0.0, "string")
        codes = info.desc().append_child("triggers")
        for event, byte in CODES.items():
            codes.append_child_value(event, str(byte))
        self.mapping = ClockMapping(now_ns, lsl.local_clock)
        self._outlet: Any = lsl.StreamOutlet(info)

    @property
    def described(self) -> Mapping[str, Any]:
        """Its record in the receipt."""
        return {"stream": MARKERS, "clock_uncertainty_us": round(1e6 * self.mapping.uncertainty_s, 3)}

    @property
    def listens(self) -> bool:
        """Whether a program receives the stream."""
        outlet = self._outlet  # its thread may release it meanwhile
        return bool(outlet is not None and outlet.have_consumers())

    def send(self, marker: Marker) -> None:
        """Send a marker with the time of its event."""
        self.mapping.measure_if_due()
        self._outlet.push_sample([marker.text], 1e-9 * marker.time_ns + self.mapping.offset_s)

    def close(self) -> None:
        """End the stream."""
        outlet, self._outlet = self._outlet, None
        close_outlet(outlet)


def _open(_place: str, now_ns: Callable[[], int]) -> MarkerStream:
    return MarkerStream(now_ns)


SINK = SinkKind("lsl", MarkerStream.title, "lsl", _open)
