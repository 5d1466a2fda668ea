"""Devices made of ``haptics.kernels.plant`` and a hand: the mouse, and the common part of it and the scripted device.

Reading such a device advances hand and handle to the given time, inside the servo's loop; writing stores the force for
the next step. With the mouse the liquid is seen instead of felt: a spring and a damper connect a simulated handle to
the pointer, and the liquid's force acts on that handle. The handle lags behind the pointer by force / stiffness, and
keeps moving after the pointer has stopped, as the liquid moves it. In free space it follows smoothly with a delay of 20
ms, from two low-passes of 10 ms, which smooth the pointer's steps.
The scripted device is moved by a simulated hand: along a given motion or in human-like reaches, with tremor and
encoders. `PlayedHand` has no handle: it replays positions.
"""

from random import Random
from typing import Any

import numpy as np

from study_app.devices.base import Device
from study_app.devices.hand import HAND, POINT, HandOrders, move_held_handle
from study_app.haptics.kernels import (
    HANDLE,
    READ_LOST,
    READ_NEW,
    READ_NOTHING_NEW,
    command_at,
    device_functions,
    measure,
    new_handle,
    push,
    reading_at,
    record_at,
    release_handle,
)
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.layout import MEASURED_VELOCITY, records
from study_app.haptics.model.motion import Floats

_SIMULATED = np.dtype(
    [
        ("handle", HANDLE),
        ("hand", HAND),
        ("last_ns", np.int64),  # time of the last read
        ("started", np.int64),  # 1 after the first read
        ("buttons", np.int64),
        ("unplugged", np.int64),  # 1: the device does not respond
        ("measures_velocity", np.int64),  # 1: the device reports the handle's velocity with every sample
    ],
    align=True,
)
_simulated_at = record_at(_SIMULATED)
_POINTED_MASS_KG = 0.2
_POINTED_STIFFNESS_NPM = 400.0  # 8 N displace the handle by 20 mm, a fifth of the workspace
_POINTED_DAMPING_NSPM = 27.0  # 1.5 times critical
_LAG_S = 0.010


class SimulatedDevice(HandOrders, Device):
    """A handle moved by a simulated hand; a subclass defines ``name``, the hand's motion and the parameters.

    Parameters
    ----------
    workspace_m : half extents of the end stops [m]
    force_limit_n : the greatest force that may be commanded [N]
    """

    name = ""

    def __init__(self, handle: Any, workspace_m: tuple[float, float, float], force_limit_n: float) -> None:
        self._memory = records(_SIMULATED, 1)
        super().__init__(self._memory[0], workspace_m)
        self.force_limit_n = force_limit_n
        self.state.handle = handle
        self.state.handle.stop_m = workspace_m
        self.context = int(self._memory.ctypes.data)
        self.read, self.write = device_functions(_read, _write)
        self.hold(0.0, 0.0, 0.0)

    @property
    def dynamics(self) -> Dynamics:
        handle = self.state.handle
        lag_s = 0.0 if self.state.measures_velocity else None
        return Dynamics(
            delay_s=1e-3 * float(handle.delay),
            count_m=float(handle.quantum_m),
            mass_kg=float(handle.mass_kg),
            velocity_lag_s=lag_s,
        )

    def measure_velocity(self) -> None:
        """Report the handle's velocity with every sample, like devices with tachometers."""
        self.state.measures_velocity = 1

    def unplug(self) -> None:
        self.state.unplugged = 1

    def open(self) -> None:
        self.state.unplugged = 0

    def close(self) -> None:
        release_handle(self.state.handle)

    def describe(self) -> dict[str, Any]:
        handle = self.state.handle
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
            "dynamics": self.dynamics.describe(),
        }


def _read(context: int, now_ns: int, reading: int) -> int:
    device = _simulated_at(context)
    if device.unplugged != 0:
        return READ_LOST
    elapsed_s = 0.0
    if device.started != 0:
        if now_ns <= device.last_ns:
            return READ_NOTHING_NEW
        elapsed_s = (now_ns - device.last_ns) * 1e-9
    device.started = 1
    device.last_ns = now_ns
    move_held_handle(device, now_ns, elapsed_s)
    out = reading_at(reading)
    measure(device.handle, out.position_m)
    out.buttons = device.buttons
    out.delay_ticks = device.handle.delay
    if device.measures_velocity != 0:
        out.measured |= MEASURED_VELOCITY
        for axis in range(3):
            out.velocity_mps[axis] = device.handle.velocity_mps[axis]
    return READ_NEW


def _write(context: int, command: int) -> int:
    device, force_n = _simulated_at(context), command_at(command).force_n
    push(device.handle, force_n[0], force_n[1], force_n[2])
    return READ_LOST if device.unplugged != 0 else 0


class PointedDevice(SimulatedDevice):
    """A handle connected to a pointer; the subclass moves the pointer."""

    def __init__(
        self, workspace_m: tuple[float, float, float] = (0.05, 0.05, 0.05), force_limit_n: float = 8.0
    ) -> None:
        handle = new_handle(
            mass_kg=_POINTED_MASS_KG, stiffness_npm=_POINTED_STIFFNESS_NPM, damping_nspm=_POINTED_DAMPING_NSPM
        )
        super().__init__(handle, workspace_m, force_limit_n)
        self.state.hand.lag_s = _LAG_S

    def point_to(self, x_m: float, y_m: float, z_m: float) -> None:
        """Set the pointer's position [m, hand frame]; outside the workspace it is moved to the border."""
        self._post(POINT, target_m=self._within_workspace(x_m, y_m, z_m))


class MouseDevice(PointedDevice):
    """The built-in default: a pointer and its buttons without hardware; a window sets the pointer."""

    name = "mouse"


_MASS_KG = 0.2
_VISCOUS_NSPM = 0.5
_COULOMB_N = 0.1
STIFFNESS_NPM = 500.0
DAMPING_NSPM = 30.0
QUANTUM_M = 38e-6  # one count of a Falcon at the knee
TREMOR_M = 5e-5  # three waves of this amplitude per axis: 0.06 mm RMS, at most 0.15 mm


def new_scripted_handle(quantum_m: float) -> Any:
    """Return the handle in a simulated participant's hand, with encoders of this count [m]."""
    return new_handle(
        mass_kg=_MASS_KG,
        viscous_nspm=_VISCOUS_NSPM,
        coulomb_n=_COULOMB_N,
        stiffness_npm=STIFFNESS_NPM,
        damping_nspm=DAMPING_NSPM,
        quantum_m=quantum_m,
    )


class ScriptedDevice(SimulatedDevice):
    """A handle in the hand of a simulated participant; the same ``random`` gives the same motion, bit for bit.

    Parameters
    ----------
    random : random numbers for frequencies and phases of the tremor; None: fixed ones
    tremor_m : amplitude of each of the tremor's three waves per axis [m]; 0: no tremor
    quantum_m : one count of the encoders [m]; 0: exact
    """

    name = "scripted"

    def __init__(
        self,
        random: Random | None = None,
        *,
        workspace_m: tuple[float, float, float] = (0.05, 0.05, 0.05),
        force_limit_n: float = 8.0,
        tremor_m: float = TREMOR_M,
        quantum_m: float = QUANTUM_M,
    ) -> None:
        super().__init__(new_scripted_handle(quantum_m), workspace_m, force_limit_n)
        self._tremble(random, tremor_m)


_PLACE = np.dtype([("position_m", np.float64, (3,))], align=True)
_PLAYED = np.dtype(
    [
        ("places", np.intp),  # address of the first position
        ("count", np.int64),
        ("next", np.int64),
    ],
    align=True,
)
_place_at = record_at(_PLACE)
_played_at = record_at(_PLAYED)


class PlayedHand:
    """A device that replays positions (n, 3) [m], one per reading, and ignores forces; its own cost is minimal."""

    name = "played"
    force_limit_n = 8.0
    dynamics = UNKNOWN
    failure = None

    def __init__(self, places_m: Floats) -> None:
        self._places_m = np.ascontiguousarray(places_m, np.float64)
        self._memory = records(_PLAYED, 1)
        self._memory[0].places = self._places_m.ctypes.data
        self._memory[0].count = len(self._places_m)
        self.context = int(self._memory.ctypes.data)
        self.read, self.write = device_functions(_read_place, _ignore_force)


def _read_place(context: int, _now_ns: int, reading: int) -> int:
    played = _played_at(context)
    place = _place_at(played.places + 24 * played.next)
    played.next = played.next + 1 if played.next + 1 < played.count else 0
    out = reading_at(reading)
    for axis in range(3):
        out.position_m[axis] = place.position_m[axis]
    out.buttons = 0
    return READ_NEW


def _ignore_force(_context: int, _command: int) -> int:
    return 0
