"""How late the servo's ticks begin with each emulated device, compared with the scripted hand in the same run.

All devices run alternately for quarter seconds, like the loops of `measurement`, so that other load affects all alike.
"""

import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from study_app.devices.hand import hand_of
from study_app.devices.registry import all_devices, open_device
from study_app.evidence.table import TURN_S, Evidence, check_seconds, take_turns
from study_app.evidence.timing.measurement import PERIOD_NS, ServoLoop, granted_classes

_REFERENCE: Final = "scripted"
_MAX_RATIO: Final = 1.5
_DRAWS: Final = 1000
_REACH_M: Final = 0.02


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceLateness:
    """The lateness of ticks with a device; ``low`` and ``high`` are the ends of the 95 % interval of ``ratio``.

    ``ratio`` is the 99th percentile relative to the scripted hand's; quarter seconds of both devices are resampled
    together.
    """

    name: str
    ticks: int
    p50_us: float
    p99_us: float
    ratio: float
    low: float
    high: float

    @property
    def missed(self) -> bool:
        """Whether the ratio is significantly above the limit."""
        return self.low > _MAX_RATIO

    @property
    def verdict(self) -> str:
        if self.missed:
            return "missed"
        return "met" if self.ratio <= _MAX_RATIO else "undecided: measure for longer"


def emulated_devices() -> tuple[str, ...]:
    """Return the names of the devices that move by themselves, the scripted hand first."""
    names = [device.name for device in all_devices() if device.moves_by_itself]
    return (_REFERENCE, *(name for name in names if name != _REFERENCE))


def time_devices(
    seconds: float,
    names: Sequence[str],
    *,
    ending: threading.Event,
    progress: Callable[[str], object] = lambda _line: None,
) -> tuple[DeviceLateness, ...]:
    """Return the lateness of ticks with each device in ``names``, the scripted hand first.

    Raises
    ------
    StudyError
        The seconds are out of range.
    ServoFault, DeviceLost
        A servo stopped itself.
    """
    check_seconds(seconds, "each device is timed")
    ticks = round(TURN_S * 1e9) // PERIOD_NS
    grant = granted_classes().best or granted_classes().normal

    with ExitStack() as stack:
        devices = {name: stack.enter_context(open_device(name)) for name in names}
        loops = {name: ServoLoop(grant, real_time=True, spin_us=None, device=devices[name]) for name in names}

        def lateness_ns(name: str, number: int) -> NDArray[np.int64]:
            if (hand := hand_of(devices[name])) is not None:
                hand.reach_to(_REACH_M * (-1) ** number, 0.0, 0.0)
            return loops[name].run(ticks).lateness_ns

        arms = {name: partial(lateness_ns, name) for name in names}
        late_ns = take_turns(arms, max(round(seconds / TURN_S), 2), ending=ending, progress=progress)
    return tuple(_compare_lateness(name, late_ns) for name in names)


def _compare_lateness(name: str, late_ns: dict[str, list[NDArray[np.int64]]]) -> DeviceLateness:
    own, reference = late_ns[name], late_ns[_REFERENCE]
    rng = np.random.default_rng(1)
    draws = [_ratio(own, reference, rng.integers(0, len(own), len(own))) for _ in range(_DRAWS)]
    p50_ns, p99_ns = np.percentile(np.concatenate(own), [50, 99])
    low, high = np.percentile(draws, [2.5, 97.5])
    return DeviceLateness(
        name=name,
        ticks=sum(map(len, own)),
        p50_us=1e-3 * float(p50_ns),
        p99_us=1e-3 * float(p99_ns),
        ratio=_ratio(own, reference, np.arange(len(own))),
        low=float(low),
        high=float(high),
    )


def _ratio(own: list[NDArray[np.int64]], reference: list[NDArray[np.int64]], rounds: Any) -> float:
    """Return the ratio of the 99th percentiles of both devices over the same ``rounds``."""
    own_p99, reference_p99 = (
        float(np.percentile(np.concatenate([segments[k] for k in rounds]), 99)) for segments in (own, reference)
    )
    return own_p99 / reference_p99


def lateness_evidence(found: Sequence[DeviceLateness]) -> Evidence:
    """Return the table as text."""
    lines = [f"{'device':<28}{'ticks':>8}{'p50 us':>9}{'p99 us':>9}   p99 : {_REFERENCE} (95 % interval)"]
    for lateness in found:
        ratio = (
            f"   {lateness.ratio:.2f} ({lateness.low:.2f} to {lateness.high:.2f}): {lateness.verdict}"
            if lateness.name != _REFERENCE
            else ""
        )
        lines.append(f"{lateness.name:<28}{lateness.ticks:>8}{lateness.p50_us:>9.0f}{lateness.p99_us:>9.0f}{ratio}")
    text = "\n".join((*lines, f"limit: {_MAX_RATIO:g}; exceeded if the whole interval lies above it")) + "\n"
    return Evidence(text, {"devices.txt": text}, missed=any(lateness.missed for lateness in found))
