"""A device opened and run at rest by its servo, as its doctor does: without force, in the time of its clock."""

import time
from collections.abc import Callable
from typing import Any, Final, Protocol, TypeVar

import numpy as np

from study_app.devices.base import Device
from study_app.devices.doctor_report import Report
from study_app.devices.failure_table import DeviceFailure, FailureTable
from study_app.devices.simulated.hand_commands import hand_of
from study_app.errors import DeviceLost, ServoFault
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo

SECONDS: Final = 3.0
LEAST_HZ: Final = 900.0
MOVE: Final = "Hold the handle and move it a little …"
_CHUNK_S = 0.25


class Examined(Device, Protocol):
    """A device that names its modes of failure."""

    @property
    def failure_mode(self) -> str | None:
        """The id of the failure that ended it in its table; None: there was none."""
        ...


D = TypeVar("D", bound=Examined)


def examine_by_table(
    device: D,
    table: FailureTable,
    in_words: Callable[[D, float], tuple[str, ...]],
    *,
    running: str,
    progress: Callable[[str], object],
    seconds: float,
) -> Report:
    """Open a device, run it at rest, and return which of the failures of its table appeared.

    Parameters
    ----------
    device : closed
    table : whose last mode is "rate"
    in_words : returns a description of the device and its new positions per second
    running : the first mode that appears only while it runs
    progress : receives instructions, one line at a time
    seconds : duration of the run
    """
    try:
        device.open()
    except DeviceFailure as failed:
        return Report((), table.findings(failed.mode, table.before(failed.mode)), str(failed))
    with device:
        progress(MOVE)
        samples, fault = run_at_rest(device, seconds)
        mode, fresh_hz = device.failure_mode, fresh_rate_hz(samples)
        words = in_words(device, fresh_hz)
    if mode is None and fresh_hz < LEAST_HZ:
        mode = "rate"
    passed = {one.id for one in table.modes} if fault is None else table.before(running)
    return Report(words, table.findings(mode, passed - {mode}), fault)


def run_at_rest(device: Device, seconds: float) -> tuple[Any, str | None]:
    """Run an open device without force; a simulated hand moves, and its time is virtual.

    Returns
    -------
    samples : (n,) array of ``layout.SAMPLE``
    fault : why the servo stopped itself; None: it did not
    """
    hand = hand_of(device)
    kept: list[Any] = []
    with Servo(device, clock=None if hand is None else VirtualClock()) as servo:
        reader = servo.telemetry.reader()
        for _ in range(max(round(seconds / _CHUNK_S), 1)):
            if hand is None:
                time.sleep(_CHUNK_S)
            else:
                hand.reach_to(0.01 * (-1) ** len(kept), 0.005, 0.0)
                servo.advance(round(_CHUNK_S * servo.rate_hz))
            kept.append(np.asarray(reader.read()).copy())
        fault = None
        try:
            servo.check()
        except (DeviceLost, ServoFault) as failed:
            fault = str(failed)
    return np.concatenate(kept), fault


def fresh_rate_hz(samples: Any) -> float:
    """Return the number of new positions per second in samples at 1 kHz."""
    return float(samples["fresh"].sum()) / max(len(samples), 1) * 1000.0
