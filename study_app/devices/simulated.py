"""A device made of ``haptics.plant`` and a hand: all that the mouse and the scripted device share.

Its read steps hand and handle to the time given, inside the servo's loop; its write holds the force for the next step.
"""

from __future__ import annotations

from functools import cache
from types import TracebackType
from typing import Any, Self

import numpy as np

from study_app.devices.base import Device
from study_app.devices.hand import HAND, HOLD, ORDER, move_hand, post
from study_app.haptics.cfunctions import READ, READ_LOST, READ_NEW, READ_NOTHING_NEW, WRITE, c_function, record_at
from study_app.haptics.layout import READING, records
from study_app.haptics.plant import HANDLE, let_go, measure, move, push

SIMULATED = np.dtype(
    [
        ("handle", HANDLE),
        ("hand", HAND),
        ("last_ns", np.int64),  # time of the last read
        ("started", np.int64),  # 1 after the first read
        ("buttons", np.int64),
        ("unplugged", np.int64),  # 1: answers no more
    ],
    align=True,
)

_simulated_at = record_at(SIMULATED)
_reading_at = record_at(READING)

_LONGEST_STEP_S = 0.05  # a loop that stood still for longer must not spend longer still on catching up


class SimulatedDevice(Device):
    """A handle that somebody moves; ``name``, hand and numbers come from the subclass.

    Parameters
    ----------
    handle : record of ``plant.HANDLE``
    workspace_m : half extents of the end stops [m]
    force_limit_n : the greatest force it may be asked for [N]
    """

    name = ""

    def __init__(self, handle: Any, workspace_m: tuple[float, float, float], force_limit_n: float) -> None:
        self.workspace_m = workspace_m
        self.force_limit_n = force_limit_n
        self._memory = records(SIMULATED, 1)
        self._state = self._memory[0]
        self._state.handle = handle
        self._state.handle.stop_m = workspace_m
        self._order = records(ORDER, 1)
        self.context = int(self._memory.ctypes.data)
        self.read, self.write = _functions()
        self.hold(0.0, 0.0, 0.0)

    def press(self, buttons: int) -> None:
        """Hold down exactly these buttons: button 1 is bit 0."""
        self._state.buttons = buttons

    def release(self) -> None:
        """Let go of every button."""
        self._state.buttons = 0

    def hold(self, x_m: float, y_m: float, z_m: float) -> None:
        """Hold the handle at a place at once [m, hand frame]."""
        self._post(HOLD, target_m=self._inside(x_m, y_m, z_m))

    def unplug(self) -> None:
        """Answer no more, as a device whose cable was pulled."""
        self._state.unplugged = 1

    @property
    def aim_m(self) -> tuple[float, float, float]:
        """Where the hand (or the pointer) means to be now [m, hand frame]."""
        x, y, z = self._state.hand.aim_m
        return float(x), float(y), float(z)

    @property
    def moving(self) -> bool:
        """Whether the last order is still being carried out."""
        hand = self._state.hand
        return bool(hand.moving) or bool(hand.serial != hand.taken)

    def open(self) -> None:
        """Plug it in."""
        self._state.unplugged = 0

    def close(self) -> None:
        """Take the force off the handle."""
        let_go(self._state.handle)

    def describe(self) -> dict[str, Any]:
        """Return name and numbers for the receipt."""
        handle = self._state.handle
        return {
            "name": self.name,
            "workspace_m": list(self.workspace_m),
            "force_limit_n": self.force_limit_n,
            "mass_kg": float(handle.mass_kg),
            "viscous_nspm": float(handle.viscous_nspm),
            "coulomb_n": float(handle.coulomb_n),
            "stiffness_npm": float(handle.stiffness_npm),
            "damping_nspm": float(handle.damping_nspm),
            "quantum_m": float(handle.quantum_m),
        }

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _inside(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float, float]:
        """Return the nearest place the handle can reach."""
        x, y, z = (min(max(v, -half), half) for v, half in zip((x_m, y_m, z_m), self.workspace_m, strict=True))
        return x, y, z

    def _post(self, kind: int, **fields: Any) -> None:
        order = self._order[0]
        order.kind = kind
        for name, value in fields.items():
            setattr(order, name, value)
        post(self._state.hand, order)


@cache
def _functions() -> tuple[Any, Any]:
    """Compile read and write, once for all simulated devices."""
    return c_function(READ, _read), c_function(WRITE, _write)


def _read(context: int, now_ns: int, reading: int) -> int:
    device = _simulated_at(context)
    if device.unplugged != 0:
        return READ_LOST
    elapsed_s = 0.0
    if device.started != 0:
        if now_ns <= device.last_ns:
            return READ_NOTHING_NEW
        elapsed_s = min((now_ns - device.last_ns) * 1e-9, _LONGEST_STEP_S)
    device.started = 1
    device.last_ns = now_ns
    move_hand(device.hand, now_ns, elapsed_s)
    move(device.handle, device.hand.was_m, device.hand.place_m, elapsed_s)
    out = _reading_at(reading)
    measure(device.handle, out.position_m)
    out.buttons = device.buttons
    return READ_NEW


def _write(context: int, fx: float, fy: float, fz: float) -> int:
    device = _simulated_at(context)
    push(device.handle, fx, fy, fz)
    return READ_LOST if device.unplugged != 0 else 0
