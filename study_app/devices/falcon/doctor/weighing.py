"""Weighing by the Falcon: it holds its grip at a place against a load, and the motor units are recorded.

At each place the grip comes to rest once from above and once from below, with nothing on it and with a load, so that
friction and the grip's own weight are separated from the load. `calibration.fit` computes motor units per newton from
the notes.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.devices.falcon.device import FalconDevice
from study_app.devices.falcon.failures import usb_failure
from study_app.devices.falcon.wire.constants import ERROR_NO_DEVICE
from study_app.errors import DeviceError
from study_app.haptics.kernels.c_functions import READ_LOST, READ_NEW
from study_app.haptics.model.layout import new_command, new_reading

PLACES_M: Final = (
    (0.0, 0.0, 0.0),
    (0.025, 0.012, -0.015),
    (-0.025, 0.012, 0.015),
    (0.020, -0.012, 0.018),
    (-0.020, -0.012, -0.018),
)
GRAVITY_MPS2: Final = 9.80665
LEAST_N, MOST_N = 1.0, 6.0
"""Range of loads that can be measured, and held in addition to the grip's own weight."""

_STIFFNESS_NPM = 600.0
_DAMPING_NSPM = 8.0
_SMOOTHING_S = 0.005
_PACE_MPS = 0.05
_BESIDE_M = 0.005
_TICK_S = 0.001
_STILL_MPS = 0.002
_STILL_TICKS = 300
_PATIENCE_S = 6.0
_BLIND_TICKS = 20
_WEIGHED_TICKS = 300

Ask = Callable[[str, str], Callable[[], str | None]]
"""(the request: "let-go", "hang", "pull", "reading" or "take-off"; its text) -> a function that returns None until the
operator has answered, then the answer."""


@dataclass(frozen=True, slots=True)
class Notes:
    """The measurements, one row per rest: encoder counts, force on the grip [N] and motor units, each (n, 3)."""

    counts: Any
    forces_n: Any
    units: Any


class Grip:
    """The grip of an open Falcon, kept at a place by a spring; one tick of it takes a millisecond.

    Parameters
    ----------
    device : open and homed
    virtual : whether time is counted in ticks instead of read from the clock
    """

    def __init__(self, device: FalconDevice, *, virtual: bool = False) -> None:
        self._device = device
        self._virtual = virtual
        self._now_ns = 0 if virtual else time.monotonic_ns()
        self._reading, self._command = new_reading(), new_command()
        self._read_m = self._reading["position_m"][0]
        self._asked_n, self._sent_n = self._command["force_n"][0], self._command["sent_n"][0]
        self._addresses = int(self._reading.ctypes.data), int(self._command.ctypes.data)
        self._place_m = np.zeros(3)
        self._velocity_mps = np.zeros(3)
        self._target_m: Any = None
        self._blind = 0
        for _ in range(_BLIND_TICKS):
            self.tick()
        self._target_m = self._place_m.copy()

    @property
    def place_m(self) -> Any:
        """Its place (3,) [m, hand frame]."""
        return self._place_m.copy()

    def tick(self) -> None:
        """Read its place and push it toward its target; without a new position for 20 ticks, send no force."""
        if self._virtual:
            self._now_ns += round(1e9 * _TICK_S)
            elapsed_s = _TICK_S
        else:
            time.sleep(_TICK_S)
            before_ns, self._now_ns = self._now_ns, time.monotonic_ns()
            elapsed_s = (self._now_ns - before_ns) * 1e-9
        device = self._device
        reading, command = self._addresses
        answer = device.read.ctypes(device.context, self._now_ns, reading)
        if answer == READ_LOST:
            device.check()
            raise usb_failure(ERROR_NO_DEVICE, "weighing with it")
        if answer == READ_NEW:
            self._blind = 0
            self._see(self._read_m, elapsed_s)
        else:
            self._blind += 1
        self._asked_n[:] = self._sent_n[:] = self._force_n()
        device.write.ctypes(device.context, command)

    def _see(self, place_m: Any, elapsed_s: float) -> None:
        moved = (place_m - self._place_m) / elapsed_s
        self._velocity_mps += (moved - self._velocity_mps) * elapsed_s / (_SMOOTHING_S + elapsed_s)
        self._place_m[:] = place_m

    def _force_n(self) -> Any:
        if self._target_m is None or self._blind > _BLIND_TICKS:
            return np.zeros(3)
        force_n = _STIFFNESS_NPM * (self._target_m - self._place_m) - _DAMPING_NSPM * self._velocity_mps
        size = float(np.linalg.norm(force_n))
        return force_n * min(1.0, self._device.force_limit_n / size) if size else force_n

    def wait(self, answered: Callable[[], str | None]) -> str:
        """Hold it in place until there is an answer; return the answer."""
        while (answer := answered()) is None:
            self.tick()
        return answer

    def come(self, place_m: Any) -> None:
        """Move it slowly to a place, and wait until it rests there, possibly displaced by its load."""
        way = np.asarray(place_m) - self._target_m
        ticks = max(int(np.linalg.norm(way) / (_PACE_MPS * _TICK_S)), 1)
        began = self._target_m.copy()
        for k in range(ticks):
            self._target_m = began + way * ((k + 1) / ticks)
            self.tick()
        still = 0
        for _ in range(round(_PATIENCE_S / _TICK_S)):
            self.tick()
            still = still + 1 if np.linalg.norm(self._velocity_mps) < _STILL_MPS else 0
            if still >= _STILL_TICKS:
                return
        raise DeviceError(
            "the grip does not come to rest: let nothing touch it, hang the weight on a short string, and start again"
        )

    def weigh(self) -> tuple[Any, Any]:
        """Return the mean encoder counts and motor units (each (3,)) of some tenths of a second."""
        counts, units = np.zeros(3), np.zeros(3)
        for _ in range(_WEIGHED_TICKS):
            self.tick()
            held_at, held_with = self._device.held
            counts += held_at
            units += held_with
        return counts / _WEIGHED_TICKS, units / _WEIGHED_TICKS


def hang(grip: Grip, weight_n: float, ask: Ask) -> Notes:
    """Measure without load at all places, then with a weight of ``weight_n`` newtons; return the measurements."""
    if not LEAST_N <= weight_n <= MOST_N:
        raise DeviceError(
            f"a weight of {1000 * weight_n / GRAVITY_MPS2:.0f} g is {weight_n:.2f} N: take one of "
            f"{LEAST_N:g} to {MOST_N:g} N, 110 to 600 g"
        )
    notes: list[tuple[Any, float, Any]] = []
    grip.wait(ask("let-go", "Let go of the grip; it will hold itself and move slowly. Keep clear of it."))
    notes += _round(grip, 0.0)
    grip.wait(
        ask("hang", f"Hang the weight of {1000 * weight_n / GRAVITY_MPS2:.0f} g on the grip, and let it hang still.")
    )
    notes += _round(grip, weight_n)
    grip.wait(ask("take-off", "Take the weight off and hold the grip: its motors are turned off now."))
    return _noted(notes)


def _round(grip: Grip, load_n: float) -> list[tuple[Any, float, Any]]:
    notes = []
    for place in PLACES_M:
        for side in (1.0, -1.0):
            grip.come(np.add(place, (0.0, side * _BESIDE_M, 0.0)))
            grip.come(place)
            counts, units = grip.weigh()
            notes.append((counts, load_n, units))
    return notes


def pull(grip: Grip, ask: Ask) -> Notes:
    """Measure without load and then with an operator's pull on a scale, at each place; return the measurements."""
    notes: list[tuple[Any, float, Any]] = []
    grip.wait(ask("let-go", "Let go of the grip; it will hold itself and move slowly. Keep clear of it."))
    for number, place in enumerate(PLACES_M, start=1):
        grip.come(place)
        counts, units = grip.weigh()
        notes.append((counts, 0.0, units))
        words = f"Place {number} of {len(PLACES_M)}: pull straight down with the scale, at 200 to 500 g, and hold it so"
        grip.wait(ask("pull", words))
        counts, units = grip.weigh()
        notes.append((counts, _read_scale(grip, ask), units))
        grip.wait(ask("let-go", "Take the scale off, and let go."))
    grip.wait(ask("take-off", "Hold the grip: its motors are turned off now."))
    return _noted(notes)


def _read_scale(grip: Grip, ask: Ask) -> float:
    """Return the scale's reading [N], asking until it is a valid weight."""
    words = "What did the scale show, in grams?"
    while True:
        reading = grip.wait(ask("reading", words))
        try:
            load_n = float(reading.replace(",", ".")) / 1000 * GRAVITY_MPS2
        except ValueError:
            load_n = -1.0
        if 0.0 < load_n <= MOST_N:
            return load_n
        words = f"'{reading}' is not a reading of the scale in grams, above 0 and up to 600. What did it show?"


def _noted(notes: list[tuple[Any, float, Any]]) -> Notes:
    counts, loads_n, units = zip(*notes, strict=True)
    forces_n = np.zeros((len(notes), 3))
    forces_n[:, 1] = -np.array(loads_n)
    return Notes(np.array(counts), forces_n, np.array(units))
