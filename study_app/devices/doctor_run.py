"""A device run at rest by its servo, as its doctor does: without force, in the time of its clock."""

from __future__ import annotations

import time
from typing import Any, Final

import numpy as np

from study_app.devices.base import Device
from study_app.devices.simulated.hand_commands import hand_of
from study_app.errors import DeviceLost, ServoFault
from study_app.haptics.runtime.clocks.clock import VirtualClock
from study_app.haptics.runtime.servo import Servo

SECONDS: Final = 3.0
LEAST_HZ: Final = 900.0
MOVE: Final = "Hold the handle and move it about a little …"
_CHUNK_S = 0.25


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
    """Return how many new positions per second samples at 1 kHz have."""
    return float(samples["fresh"].sum()) / max(len(samples), 1) * 1000.0
