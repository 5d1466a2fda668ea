"""A simulated hand: its motion (to the pointer, along a given motion, on a reach, or at rest), and its orders.

Orders may come from any thread, one at a time, through a seqlock: the writer makes the serial odd, writes the order,
and makes the serial even. The reader, inside the servo, takes an order only if it is complete, and otherwise tries
again at the next tick, so neither ever waits for the other.

Only sums, products, divisions and square roots are used, which IEEE 754 rounds alike everywhere, so that a scripted
hand moves identically on every machine.
"""

import math
from random import Random
from typing import Any

import numpy as np

from study_app.errors import DeviceError
from study_app.haptics.kernels import fence, kernel, move, record_at
from study_app.haptics.model.layout import records
from study_app.haptics.model.ranges import Vector

STAY, POINT, HOLD, REACH, FOLLOW = range(5)

_WAVES = 3  # number of waves of the tremor per axis
_MAX_STEP_S = 0.05  # longest simulated time after a pause of the loop [s]

_ORDER = np.dtype(
    [
        ("kind", np.int64),  # STAY ... FOLLOW
        ("target_m", np.float64, (3,)),  # of POINT, HOLD and REACH
        ("duration_ns", np.int64),  # of REACH; 0: chosen from the distance
        ("rows", np.intp),  # of FOLLOW: address of MOTION_ROW records
        ("count", np.int64),  # of FOLLOW: number of rows
    ],
    align=True,
)

_MOTION_ROW = np.dtype([("t_s", np.float64), ("position_m", np.float64, (3,))], align=True)

HAND = np.dtype(
    [
        ("serial", np.int64),  # serial of the posted order; odd while it is being written
        ("posted", _ORDER),
        ("taken", np.int64),  # serial of the order in force
        ("order", _ORDER),
        ("began_ns", np.int64),
        ("began_m", np.float64, (3,)),  # position of the hand when the order began
        ("row", np.int64),  # of FOLLOW: the last row up to now
        ("moving", np.int64),  # 1 while an order is not yet fulfilled
        ("lag_s", np.float64),  # of POINT: time constant of each of two low-passes that smooth the pointer
        ("smooth_m", np.float64, (3,)),  # of POINT: after the first low-pass
        ("aim_m", np.float64, (3,)),  # the hand's target
        ("place_m", np.float64, (3,)),  # its position: aim and tremor
        ("was_m", np.float64, (3,)),  # its previous place
        ("tremor_m", np.float64),  # amplitude of each wave
        ("tremor_hz", np.float64, (3, _WAVES)),
        ("tremor_turn", np.float64, (3, _WAVES)),  # phase at time 0, in turns
    ],
    align=True,
)

_row_at = record_at(_MOTION_ROW)
_ROW_BYTES = _MOTION_ROW.itemsize

_REACH_BASE_S = 0.3  # a reach takes this time [s]
_REACH_SPEED_MPS = 0.25  # plus distance / speed: 60 mm in 0.54 s with a peak of 0.21 m/s


@kernel
def post(hand: Any, order: Any) -> None:
    """Give ``hand`` a new order."""
    hand.serial += 1
    fence()
    hand.posted = order
    fence()
    hand.serial += 1


@kernel
def move_hand(hand: Any, now_ns: int, elapsed_s: float) -> None:
    """Update ``hand.place_m`` to ``now_ns``, ``elapsed_s`` after the last call."""
    _take_order(hand, now_ns)
    since_s = (now_ns - hand.began_ns) * 1e-9
    if hand.order.kind == POINT:
        _follow_pointer(hand, elapsed_s)
    elif hand.order.kind == HOLD:
        for i in range(3):
            hand.aim_m[i] = hand.order.target_m[i]
        hand.moving = 0
    elif hand.order.kind == REACH:
        _move_by_reach(hand, since_s)
    elif hand.order.kind == FOLLOW:
        _move_along_motion(hand, since_s)
    else:
        hand.moving = 0
    for i in range(3):
        hand.was_m[i] = hand.place_m[i]
        hand.place_m[i] = hand.aim_m[i] + tremor(hand, i, now_ns * 1e-9)


@kernel
def move_held_handle(simulated: Any, now_ns: int, elapsed_s: float) -> None:
    """Update ``simulated.hand`` and its ``simulated.handle`` to ``now_ns``, ``elapsed_s`` after the last call."""
    elapsed_s = min(max(elapsed_s, 0.0), _MAX_STEP_S)
    move_hand(simulated.hand, now_ns, elapsed_s)
    move(simulated.handle, simulated.hand.was_m, simulated.hand.place_m, elapsed_s)


@kernel
def _take_order(hand: Any, now_ns: int) -> None:
    serial = hand.serial
    if serial == hand.taken or serial % 2 == 1:
        return
    fence()
    hand.order = hand.posted
    fence()
    if hand.serial != serial:  # it was overwritten meanwhile: the next tick takes the newer one
        hand.order.kind = STAY
        return
    hand.taken = serial
    hand.began_ns = now_ns
    hand.row = 0
    hand.moving = 1
    square_m2 = 0.0
    for i in range(3):
        hand.began_m[i] = hand.aim_m[i]
        distance = hand.order.target_m[i] - hand.aim_m[i]
        square_m2 += distance * distance
    if hand.order.kind == REACH and hand.order.duration_ns <= 0:
        hand.order.duration_ns = int(1e9 * (_REACH_BASE_S + math.sqrt(square_m2) / _REACH_SPEED_MPS))


@kernel
def _follow_pointer(hand: Any, elapsed_s: float) -> None:
    gain = elapsed_s / (hand.lag_s + elapsed_s) if elapsed_s > 0.0 else 0.0
    for i in range(3):
        hand.smooth_m[i] += gain * (hand.order.target_m[i] - hand.smooth_m[i])
        hand.aim_m[i] += gain * (hand.smooth_m[i] - hand.aim_m[i])


@kernel
def _move_by_reach(hand: Any, since_s: float) -> None:
    """Minimum jerk: x = x_0 + (x_1 - x_0)(10 s^3 - 15 s^4 + 6 s^5), Flash & Hogan 1985, eq. 10."""
    progress = since_s * 1e9 / hand.order.duration_ns
    if progress >= 1.0:
        progress = 1.0
        hand.moving = 0
    fraction = progress * progress * progress * (10.0 + progress * (6.0 * progress - 15.0))
    for i in range(3):
        hand.aim_m[i] = hand.began_m[i] + fraction * (hand.order.target_m[i] - hand.began_m[i])


@kernel
def _move_along_motion(hand: Any, since_s: float) -> None:
    motion_s = _row_at(hand.order.rows).t_s + since_s
    last = hand.order.count - 1
    while hand.row < last and _row_at(hand.order.rows + (hand.row + 1) * _ROW_BYTES).t_s <= motion_s:
        hand.row += 1
    before = _row_at(hand.order.rows + hand.row * _ROW_BYTES)
    after = _row_at(hand.order.rows + min(hand.row + 1, last) * _ROW_BYTES)
    fraction = 0.0
    if hand.row == last:
        hand.moving = 0
    else:
        fraction = (motion_s - before.t_s) / (after.t_s - before.t_s)
    for i in range(3):
        hand.aim_m[i] = before.position_m[i] + fraction * (after.position_m[i] - before.position_m[i])


@kernel
def tremor(hand: Any, axis: int, time_s: float) -> Any:
    """Return the displacement by physiological tremor (8 to 12 Hz) along ``axis`` [m]."""
    offset = 0.0
    for k in range(_WAVES):
        turn = hand.tremor_hz[axis, k] * time_s + hand.tremor_turn[axis, k]
        offset += wave(turn)
    return hand.tremor_m * offset


@kernel
def wave(turn: float) -> float:
    """Return sin(2 pi turn) with an error below 0.0012, by two parabolas, bit-identical on every machine."""
    phase = 2.0 * (turn - math.floor(turn)) - 1.0  # in half turns, [-1, 1), shifted by half a turn, hence the sign
    arch = 4.0 * phase * (1.0 - abs(phase))
    return -(0.225 * (arch * abs(arch) - arch) + arch)


_TREMOR_HZ = (8.0, 12.0)

_MOTIONS_TO_KEEP = 8


class HandOrders:
    """A simulated hand that accepts orders, and the buttons under its fingers.

    Parameters
    ----------
    state : record with the fields ``hand`` (``hand.HAND``), ``handle`` (``plant.HANDLE``) and ``buttons``
    workspace_m : half extents of the hand's range of motion [m]; positions outside are moved to its border
    """

    def __init__(self, state: Any, workspace_m: tuple[float, float, float]) -> None:
        self.workspace_m = workspace_m
        self.state = state
        self._order = records(_ORDER, 1)
        self._motions: list[Any] = []

    @property
    def held(self) -> bool:
        return bool(self.state.handle.held)

    @held.setter
    def held(self, held: bool) -> None:
        self.state.handle.held = int(held)

    @property
    def force_n(self) -> Vector:
        """The force of the motors on the handle [N, hand frame]."""
        x, y, z = self.state.handle.force_n
        return float(x), float(y), float(z)

    def press(self, buttons: int) -> None:
        """Press exactly these buttons: button 1 is bit 0."""
        self.state.buttons = buttons

    def release(self) -> None:
        self.state.buttons = 0

    def hold(self, x_m: float, y_m: float, z_m: float) -> None:
        """Hold the handle at a position at once [m, hand frame]."""
        self._post(HOLD, target_m=self._within_workspace(x_m, y_m, z_m))

    def follow(self, t_s: Any, position_m: Any) -> None:
        """Move along straight lines between the given positions from the next tick onwards, and stay at the last.

        Only differences of the increasing times (n,) [s] matter; positions (n, 3) are in the hand frame [m].

        Raises
        ------
        DeviceError
            The motion is empty, has wrong shapes, is not finite, or its times do not increase.
        """
        try:
            times, places = np.asarray(t_s, np.float64), np.asarray(position_m, np.float64)
        except (TypeError, ValueError) as error:
            raise DeviceError(f"a motion's times and positions must be numbers: {error}") from error
        if times.ndim != 1 or times.size == 0 or places.shape != (times.size, 3):
            raise DeviceError(
                "the times of a motion must have the shape (n,) and the positions (n, 3), with n > 0, not "
                f"{times.shape} and {places.shape}"
            )
        if not (np.isfinite(times).all() and np.isfinite(places).all()):
            raise DeviceError("a motion's times and positions must be finite numbers")
        if (np.diff(times) <= 0.0).any():
            row = int(np.argmax(np.diff(times) <= 0.0)) + 1
            raise DeviceError(
                f"a motion's times must increase: row {row} is at {times[row]} s, but the row before is at "
                f"{times[row - 1]} s"
            )
        motion = records(_MOTION_ROW, times.size)
        motion.t_s, motion.position_m = times, places
        # The servo may still read an earlier motion, so the last few are kept.
        self._motions = [*self._motions[1 - _MOTIONS_TO_KEEP :], motion]
        self._post(FOLLOW, rows=int(motion.ctypes.data), count=times.size)

    def reach_to(self, x_m: float, y_m: float, z_m: float, duration_s: float | None = None) -> None:
        """Reach for a position [m, hand frame] with minimum jerk, from the next tick onwards, and stay there.

        Without ``duration_s`` the reach takes 0.3 s plus 4 s per metre.
        """
        if duration_s is not None and not duration_s > 0.0:
            raise DeviceError(f"a reach must last longer than 0 s, not {duration_s} s")
        nanoseconds = 0 if duration_s is None else max(1, round(duration_s * 1e9))
        self._post(REACH, target_m=self._within_workspace(x_m, y_m, z_m), duration_ns=nanoseconds)

    def rest(self) -> None:
        self._post(STAY)

    @property
    def aim_m(self) -> Vector:
        """The current target of the hand or pointer [m, hand frame]."""
        x, y, z = self.state.hand.aim_m
        return float(x), float(y), float(z)

    @property
    def moving(self) -> bool:
        hand = self.state.hand
        return bool(hand.moving) or bool(hand.serial != hand.taken)

    def _tremble(self, random: Random | None, tremor_m: float) -> None:
        """Draw the frequencies and phases of a tremor with this amplitude; if ``random`` is None they are fixed."""
        draw = (random or Random(0)).random  # noqa: S311 - a simulated tremor, not a secret
        hand = self.state.hand
        hand.tremor_m = tremor_m
        lowest, highest = _TREMOR_HZ
        hand.tremor_hz = [[lowest + (highest - lowest) * draw() for _ in range(_WAVES)] for _ in range(3)]
        hand.tremor_turn = [[draw() for _ in range(_WAVES)] for _ in range(3)]

    def _within_workspace(self, x_m: float, y_m: float, z_m: float) -> Vector:
        """Return the nearest position that the handle can reach."""
        x, y, z = (min(max(v, -half), half) for v, half in zip((x_m, y_m, z_m), self.workspace_m, strict=True))
        return x, y, z

    def _post(self, kind: int, **fields: Any) -> None:
        order = self._order[0]
        order.kind = kind
        for name, value in fields.items():
            setattr(order, name, value)
        post(self.state.hand, order)


def hand_of(device: object) -> HandOrders | None:
    """Return the simulated hand of ``device``: the device itself or its ``hand``; None if a person holds it."""
    hand = device if isinstance(device, HandOrders) else getattr(device, "hand", None)
    return hand if isinstance(hand, HandOrders) else None
