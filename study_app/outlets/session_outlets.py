"""The outlets of a session, which are opened before it, get its events and are closed after it.

If an outlet cannot be opened or fails later, `Outlets.lost` gives the reason; the session continues without it.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol, TypeAlias

from study_app.discovery import Registry, Returns
from study_app.errors import OutletError
from study_app.outlets.markers import Marker, Sink, SinkKind, SinkThread
from study_app.outlets.sinks import SINKS as BUILT_IN_SINKS
from study_app.outlets.streams import SampleStream

SampleChoice: TypeAlias = Literal["off", "single-blind", "always"]
"""Which studies stream samples: none, those that are not double-blind, or all."""


class _SampledServo(Protocol):
    """The part of the servo (``haptics.runtime.servo.Servo``) that outlets use."""

    rate_hz: float
    telemetry: Any

    def now_ns(self) -> int: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class OutletStatus:
    """The state of an outlet, for the pre-flight.

    ``listens`` is whether a program receives its data, None if unknown; ``lost`` is the reason why it does not work, or
    "". ``withheld`` means that it is off because the study is double-blind, ``shows_force`` that it reveals the force
    in a double-blind study.
    """

    title: str
    listens: bool | None = None
    lost: str = ""
    withheld: bool = False
    shows_force: bool = False


_IS_SINK: Final = Returns("a sink", lambda value: callable(value.send) and callable(value.close))
SINKS: Final = Registry("outlet", {kind.name: kind for kind in BUILT_IN_SINKS}, SinkKind, "name", {"open": _IS_SINK})
"""The kinds of sinks by name."""


def is_port(address: str) -> bool:
    """Return whether an address is that of a trigger port, such as ``serial:COM3``, without opening it."""
    name, _, place = address.partition(":")
    kind = SINKS.get(name)
    return kind is not None and ":" in kind.example and bool(place) and place.isprintable()


def port_examples() -> tuple[str, ...]:
    """Return an address of each kind of port for triggers."""
    return tuple(kind.example for kind in SINKS.values() if is_port(kind.example))


def open_sink(address: str, now_ns: Callable[[], int]) -> Sink:
    """Open the sink of an address, such as ``lsl`` or ``serial:/dev/ttyUSB0``.

    Raises
    ------
    OutletError
        The address is invalid, or the sink cannot be opened.
    """
    name, _, place = address.partition(":")
    kind = SINKS.get(name)
    if kind is None or not address.isprintable():
        examples = ", ".join(sink.example for sink in SINKS.values())
        raise OutletError(f"{address!r} is not a marker address: use one such as {examples}")
    return kind.open(place, now_ns)


class Outlets:
    """The outlets of a session: sinks of markers at ``addresses``, and a stream of samples; `mark` never waits."""

    def __init__(self, addresses: Sequence[str], samples: SampleChoice, servo: _SampledServo, blinding: str) -> None:
        self._failed: dict[str, str] = {}
        self._threads: list[SinkThread] = []
        self._samples: SampleStream | None = None
        self._is_double_blind = blinding == "double"
        self._is_withheld = self._is_double_blind and samples == "single-blind"
        for address in addresses:
            kind = SINKS.get(address.partition(":")[0])
            with self._store_failure("Triggers" if kind is None else kind.title):
                self._threads.append(SinkThread(open_sink(address, servo.now_ns)))
        if samples != "off" and not self._is_withheld:
            with self._store_failure(SampleStream.title):
                self._samples = SampleStream(servo.telemetry, servo.rate_hz, servo.now_ns)

    @contextmanager
    def _store_failure(self, title: str) -> Iterator[None]:
        """Catch any error of opening an outlet, which no session depends on, and store it as the reason."""
        try:
            yield
        except OutletError as error:
            self._failed[title] = str(error)
        except Exception as error:  # noqa: BLE001 - any error of a driver
            self._failed[title] = f"{type(error).__name__}: {error}"

    @property
    def described(self) -> dict[str, Any]:
        descriptions = {sink.title: dict(sink.described) for sink in self._open_outlets()}
        return descriptions | {title: {"failed": reason} for title, reason in self._failed.items()}

    @property
    def lost(self) -> dict[str, str]:
        """The reasons why outlets do not work, by title; without those that work."""
        failed = {thread.sink.title: thread.lost for thread in self._threads if thread.lost}
        if self._samples is not None and self._samples.lost:
            failed[self._samples.title] = self._samples.lost
        return self._failed | failed

    def statuses(self) -> tuple[OutletStatus, ...]:
        lost = self.lost
        statuses = [
            OutletStatus(
                title=sink.title,
                listens=sink.listens,
                lost=lost.get(sink.title, ""),
                shows_force=self._is_double_blind and sink is self._samples,
            )
            for sink in self._open_outlets()
        ]
        statuses += [OutletStatus(title=title, lost=reason) for title, reason in self._failed.items()]
        if self._is_withheld:
            statuses.append(OutletStatus(title=SampleStream.title, withheld=True))
        return tuple(statuses)

    def mark(self, marker: Marker) -> None:
        for thread in self._threads:
            thread.mark(marker)

    def close(self) -> None:
        """Send waiting markers and samples for a limited time, and close all outlets."""
        for thread in self._threads:
            thread.close()
        if self._samples is not None:
            self._samples.close()

    def _open_outlets(self) -> Iterator[Sink | SampleStream]:
        yield from (thread.sink for thread in self._threads)
        if self._samples is not None:
            yield self._samples
