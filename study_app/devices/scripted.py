"""A device that a simulated person moves: along a given motion, or reaching as people do, with tremor and encoders."""

from __future__ import annotations

from random import Random
from typing import Any

import numpy as np

from study_app.devices.hand import FOLLOW, MOTION_ROW, REACH, STAY, WAVES
from study_app.devices.simulated import SimulatedDevice
from study_app.errors import DeviceError
from study_app.haptics.layout import records
from study_app.haptics.plant import new_handle

MASS_KG = 0.2
VISCOUS_NSPM = 0.5
COULOMB_N = 0.1
STIFFNESS_NPM = 500.0
DAMPING_NSPM = 30.0
QUANTUM_M = 38e-6  # one count of a Falcon at the knee
TREMOR_M = 5e-5  # three waves of this amplitude an axis: 0.06 mm in the mean square root, 0.15 mm at most
TREMOR_HZ = (8.0, 12.0)

_KEPT_MOTIONS = 8


class ScriptedDevice(SimulatedDevice):
    """A handle in the hand of a simulated participant; the same ``random`` moves it to the same bit anywhere.

    Parameters
    ----------
    random : where frequencies and phases of the tremor are drawn from; None: always the same ones
    workspace_m : half extents of where the handle reaches [m]
    force_limit_n : the greatest force it may be asked for [N]
    tremor_m : amplitude of each of the tremor's three waves an axis [m]; 0: a hand of stone
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
        handle = new_handle(
            mass_kg=MASS_KG,
            viscous_nspm=VISCOUS_NSPM,
            coulomb_n=COULOMB_N,
            stiffness_npm=STIFFNESS_NPM,
            damping_nspm=DAMPING_NSPM,
            quantum_m=quantum_m,
        )
        super().__init__(handle, workspace_m, force_limit_n)
        self._motions: list[Any] = []
        draw = (random or Random(0)).random  # noqa: S311 - a hand trembles, it keeps no secrets
        hand = self._state.hand
        hand.tremor_m = tremor_m
        lowest, highest = TREMOR_HZ
        hand.tremor_hz = [[lowest + (highest - lowest) * draw() for _ in range(WAVES)] for _ in range(3)]
        hand.tremor_turn = [[draw() for _ in range(WAVES)] for _ in range(3)]

    def follow(self, t_s: Any, position_m: Any) -> None:
        """Move along the straight lines between given places from the next tick on, and stay at the last.

        Parameters
        ----------
        t_s : (n,) array [s], increasing; only differences count
        position_m : (n, 3) array [m], hand frame

        Raises
        ------
        DeviceError
            The motion is empty, of other shapes, not finite, or its times do not increase.
        """
        times, places = np.asarray(t_s, np.float64), np.asarray(position_m, np.float64)
        if times.ndim != 1 or times.size == 0 or places.shape != (times.size, 3):
            raise DeviceError(
                f"a motion needs times (n,) and positions (n, 3) with n > 0, got {times.shape} and {places.shape}"
            )
        if not (np.isfinite(times).all() and np.isfinite(places).all()):
            raise DeviceError("a motion's times and positions must be finite numbers")
        if (np.diff(times) <= 0.0).any():
            row = int(np.argmax(np.diff(times) <= 0.0)) + 1
            raise DeviceError(
                f"a motion's times must increase; row {row} is at {times[row]} s, after {times[row - 1]} s"
            )
        motion = records(MOTION_ROW, times.size)
        motion.t_s, motion.position_m = times, places
        # The servo may still read the motion before: it lives on until several newer ones have come.
        self._motions = [*self._motions[1 - _KEPT_MOTIONS :], motion]
        self._post(FOLLOW, rows=int(motion.ctypes.data), count=times.size)

    def reach_to(self, x_m: float, y_m: float, z_m: float, duration_s: float | None = None) -> None:
        """Reach for a place [m, hand frame] with minimum jerk, from the next tick on, and stay there.

        Without ``duration_s`` the reach takes 0.3 s and 4 s for every metre.
        """
        if duration_s is not None and not duration_s > 0.0:
            raise DeviceError(f"a reach must last longer than 0 s, got {duration_s} s")
        nanoseconds = 0 if duration_s is None else max(1, round(duration_s * 1e9))
        self._post(REACH, target_m=self._inside(x_m, y_m, z_m), duration_ns=nanoseconds)

    def rest(self) -> None:
        """Stay where the hand is."""
        self._post(STAY)
