"""Commands to a simulated hand, from any thread but one at a time."""

from random import Random
from typing import Any

import numpy as np

from study_app.devices.simulated.hand import FOLLOW, HOLD, MOTION_ROW, ORDER, REACH, STAY, WAVES, post
from study_app.errors import DeviceError
from study_app.haptics.model.layout import records

TREMOR_HZ = (8.0, 12.0)

_KEPT_MOTIONS = 8


class HandOrders:
    """A hand that takes orders, and the buttons under its fingers.

    Parameters
    ----------
    state : record with the fields ``hand`` (``hand.HAND``), ``handle`` (``plant.HANDLE``) and ``buttons``
    workspace_m : half extents of the hand's range of motion [m]; a place outside counts as its border
    """

    def __init__(self, state: Any, workspace_m: tuple[float, float, float]) -> None:
        self.workspace_m = workspace_m
        self.state = state
        self._order = records(ORDER, 1)
        self._motions: list[Any] = []

    @property
    def held(self) -> bool:
        """Whether the hand holds the handle."""
        return bool(self.state.handle.held)

    @held.setter
    def held(self, held: bool) -> None:
        self.state.handle.held = int(held)

    @property
    def force_n(self) -> tuple[float, float, float]:
        """The force of the motors on the handle [N, hand frame]."""
        x, y, z = self.state.handle.force_n
        return float(x), float(y), float(z)

    def press(self, buttons: int) -> None:
        """Press exactly these buttons: button 1 is bit 0."""
        self.state.buttons = buttons

    def release(self) -> None:
        """Release all buttons."""
        self.state.buttons = 0

    def hold(self, x_m: float, y_m: float, z_m: float) -> None:
        """Hold the handle at a place at once [m, hand frame]."""
        self._post(HOLD, target_m=self._inside(x_m, y_m, z_m))

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
        # The servo may still read the last motion, which is kept until several newer ones were given.
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

    @property
    def aim_m(self) -> tuple[float, float, float]:
        """The present target of the hand or pointer [m, hand frame]."""
        x, y, z = self.state.hand.aim_m
        return float(x), float(y), float(z)

    @property
    def moving(self) -> bool:
        """Whether the last order is still being carried out."""
        hand = self.state.hand
        return bool(hand.moving) or bool(hand.serial != hand.taken)

    def _tremble(self, random: Random | None, tremor_m: float) -> None:
        """Draw frequencies and phases of a tremor whose waves have this amplitude; None: always the same ones."""
        draw = (random or Random(0)).random  # noqa: S311 - a hand trembles, it keeps no secrets
        hand = self.state.hand
        hand.tremor_m = tremor_m
        lowest, highest = TREMOR_HZ
        hand.tremor_hz = [[lowest + (highest - lowest) * draw() for _ in range(WAVES)] for _ in range(3)]
        hand.tremor_turn = [[draw() for _ in range(WAVES)] for _ in range(3)]

    def _inside(self, x_m: float, y_m: float, z_m: float) -> tuple[float, float, float]:
        """Return the nearest place the handle can reach."""
        x, y, z = (min(max(v, -half), half) for v, half in zip((x_m, y_m, z_m), self.workspace_m, strict=True))
        return x, y, z

    def _post(self, kind: int, **fields: Any) -> None:
        order = self._order[0]
        order.kind = kind
        for name, value in fields.items():
            setattr(order, name, value)
        post(self.state.hand, order)


def hand_of(device: object) -> HandOrders | None:
    """Return the interface to the simulated hand of ``device``: itself, or its ``hand``; None: a person holds it."""
    hand = device if isinstance(device, HandOrders) else getattr(device, "hand", None)
    return hand if isinstance(hand, HandOrders) else None
