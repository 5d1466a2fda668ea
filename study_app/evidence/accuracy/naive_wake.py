"""The wake as a list that is processed entirely at every tick, the naive implementation: compiled, numpy, Python.

They are alternatives to ``haptics.kernels.effects.wake`` whose computation time grows with the length of the
list. Each keeps the elements in a ring and answers two questions a tick: `wake` and, after the force, `follow`.
"""

import math
import sys
from typing import Any, Final

import numpy as np

from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.effects.wake import REST_MPS, response
from study_app.haptics.model.layout import Record, records
from study_app.haptics.model.motion import Floats

TAIL: Final = np.dtype(
    [
        ("held", np.int64),
        ("newest", np.int64),  # row of the newest element
        ("segment", np.int64),  # number of the newest segment
        ("stored", np.int64),  # 1 once an element was stored
        ("arc_m", np.float64),
        ("stored_at_m", np.float64, (3,)),
        ("wake_mps", np.float64, (3,)),
        ("relative_mps", np.float64, (3,)),
    ],
    align=True,
)


def new_list(length: int, dtype: type[np.floating[Any]]) -> tuple[Any, Any, Any, Any]:
    """Return an empty list for compiled code: TAIL, elements (N, 3), arcs (N,), segments (N,); -1 is no segment."""
    tail = records(TAIL, 1)
    tail[0].newest = length - 1
    return tail, np.zeros((length, 3), dtype), np.zeros(length), np.full(length, -1)


@kernel
def list_wake(wake: Record, tail: Record, element: Any, segment: Any) -> None:
    """Set ``tail.wake_mps`` from all elements, newest first, in sums of the elements' own precision."""
    zero = element[0, 0] - element[0, 0]
    tx = ty = tz = dx = dy = dz = summed = speeds = squares = zero
    inside, row = -1, tail.newest
    for _ in range(tail.held):
        if segment[row] >= 0:
            x, y, z = element[row, 0], element[row, 1], element[row, 2]
            speed = math.sqrt(x * x + y * y + z * z)
            if segment[row] != inside:
                tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
                dx, dy, dz = x / speed, y / speed, z / speed
                summed, inside = zero, segment[row]
            summed += speed
            speeds += speed
            squares += speed * speed
        row = row - 1 if row > 0 else len(segment) - 1
    tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
    gain = 0.0
    if speeds > 0.0:
        size = math.sqrt(tx * tx + ty * ty + tz * tz) / wake.scaling
        gain = response(size * speeds / squares, wake.exponent) / wake.scaling if size > 0.0 else 0.0
    tail.wake_mps[0], tail.wake_mps[1], tail.wake_mps[2] = gain * tx, gain * ty, gain * tz


@kernel
def list_follow(
    wake: Record, tail: Record, element: Any, arc: Any, segment: Any, h: Any, place_m: Any, interval_s: float
) -> None:
    """Let every element decay, and store the tick's velocity if the rules require it."""
    keep = math.exp(wake.log_decay_per_s * interval_s)
    rows = len(segment)
    for row in range(tail.held):
        for axis in range(3):
            element[row, axis] *= keep
    hx, hy, hz = h[0], h[1] * wake.vertical, h[2]
    speed = math.sqrt(hx * hx + hy * hy + hz * hz)
    tail.arc_m += speed * interval_s
    px, py, pz = place_m[0] - tail.stored_at_m[0], place_m[1] - tail.stored_at_m[1], place_m[2] - tail.stored_at_m[2]
    rests = speed < REST_MPS
    if not rests and tail.stored == 1 and math.sqrt(px * px + py * py + pz * pz) < wake.resolution_m:
        return
    if not rests:
        reference, row = -1, tail.newest
        for _ in range(tail.held):
            if segment[row] == tail.segment:
                reference = row
                if tail.arc_m - arc[row] >= wake.breaking_span_m:
                    break
            row = row - 1 if row > 0 else rows - 1
        if reference < 0:
            tail.segment += 1
        else:
            x, y, z = element[reference, 0], element[reference, 1], element[reference, 2]
            least = (wake.breaking_cosine - 1e-12) * speed * math.sqrt(x * x + y * y + z * z)
            if hx * x + hy * y + hz * z < least:
                tail.segment += 1
    tail.newest = tail.newest + 1 if tail.newest + 1 < rows else 0
    tail.held = min(tail.held + 1, rows)
    tail.stored = 1
    element[tail.newest, 0], element[tail.newest, 1], element[tail.newest, 2] = hx, hy, hz
    arc[tail.newest] = tail.arc_m
    segment[tail.newest] = -1 if rests else tail.segment
    for axis in range(3):
        tail.stored_at_m[axis] = place_m[axis]


class NumpyTail:
    """The list as numpy arrays, newest first; every tick moves all of it on by one."""

    def __init__(self, wake: Record) -> None:
        rows = int(wake.length)
        self._constants = wake
        self._element, self._arc, self._segment = np.zeros((rows, 3)), np.zeros(rows), np.full(rows, -1)
        self._held = self._current = 0
        self._arc_m = 0.0
        self._stored_at_m: Floats | None = None

    @property
    def memory_bytes(self) -> int:
        """Size of the arrays."""
        return self._element.nbytes + self._arc.nbytes + self._segment.nbytes

    def wake(self) -> Floats:
        """Return v_wake (3,)."""
        moving = self._segment >= 0
        if not moving.any():
            return np.zeros(3)
        element, segment = self._element[moving], self._segment[moving]
        speed = np.sqrt((element**2).sum(axis=1))
        starts = np.flatnonzero(np.diff(segment, prepend=-1))
        directions = element[starts] / speed[starts, np.newaxis]
        tail = np.add.reduceat(speed, starts) @ directions / float(self._constants.scaling)
        fill = float(np.sqrt(tail @ tail)) * float(speed.sum()) / float((speed**2).sum())
        felt: Floats = tail * (_response(fill, float(self._constants.exponent)) if fill > 0 else 0.0)
        return felt

    def follow(self, h: Floats, place_m: Floats, interval_s: float) -> None:
        """Take one tick in."""
        constants = self._constants
        self._element *= math.exp(constants.log_decay_per_s * interval_s)
        h = h * np.array([1.0, constants.vertical, 1.0])
        speed = float(np.sqrt(h @ h))
        self._arc_m += speed * interval_s
        rests = speed < REST_MPS
        if not rests and self._stored_at_m is not None:
            way_m = place_m - self._stored_at_m
            if float(np.sqrt(way_m @ way_m)) < constants.resolution_m:
                return
        if not rests and self._breaks(h, speed):
            self._current += 1
        for rows in (self._element, self._arc, self._segment):
            rows[1:] = rows[:-1].copy()
        self._element[0], self._arc[0], self._segment[0] = h, self._arc_m, -1 if rests else self._current
        self._stored_at_m = place_m

    def _breaks(self, h: Floats, speed: float) -> bool:
        same = np.flatnonzero(self._segment == self._current)
        if len(same) == 0:
            return True
        far = same[self._arc_m - self._arc[same] >= self._constants.breaking_span_m]
        reference = self._element[far[0] if len(far) else same[-1]]
        least = (self._constants.breaking_cosine - 1e-12) * speed * math.sqrt(reference @ reference)
        return bool(h @ reference < least)


class PlainTail:
    """The list as a list of tuples (x, y, z, arc, segment), newest first: no library at all."""

    def __init__(self, wake: Record) -> None:
        self._length, self._scaling, self._exponent = int(wake.length), float(wake.scaling), float(wake.exponent)
        self._cosine, self._span_m = float(wake.breaking_cosine) - 1e-12, float(wake.breaking_span_m)
        self._log_decay, self._resolution_m = float(wake.log_decay_per_s), float(wake.resolution_m)
        self._vertical = float(wake.vertical)
        self._tail: list[tuple[float, float, float, float, int]] = []
        self._current, self._arc_m = 0, 0.0
        self._stored_at_m: tuple[float, ...] | None = None

    @property
    def memory_bytes(self) -> int:
        """Size of a full list: a row is a tuple of five, of which four are number objects."""
        row = (0.0, 0.0, 0.0, 0.0, 0)
        return sys.getsizeof([row] * self._length) + self._length * (sys.getsizeof(row) + 4 * sys.getsizeof(0.0))

    def wake(self) -> tuple[float, float, float]:
        """Return v_wake."""
        tx = ty = tz = dx = dy = dz = summed = speeds = squares = 0.0
        inside = -1
        for x, y, z, _, segment in self._tail:
            if segment < 0:
                continue
            speed = math.sqrt(x * x + y * y + z * z)
            if segment != inside:
                tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
                dx, dy, dz = x / speed, y / speed, z / speed
                summed, inside = 0.0, segment
            summed += speed
            speeds += speed
            squares += speed * speed
        tx, ty, tz = tx + dx * summed, ty + dy * summed, tz + dz * summed
        size = math.sqrt(tx * tx + ty * ty + tz * tz) / self._scaling
        if size == 0.0:
            return 0.0, 0.0, 0.0
        gain = _response(size * speeds / squares, self._exponent) / self._scaling
        return gain * tx, gain * ty, gain * tz

    def follow(self, h: Floats, place_m: Floats, interval_s: float) -> None:
        """Take one tick in."""
        keep = math.exp(self._log_decay * interval_s)
        self._tail = [(keep * x, keep * y, keep * z, arc, segment) for x, y, z, arc, segment in self._tail]
        hx, hy, hz = float(h[0]), float(h[1]) * self._vertical, float(h[2])
        at = tuple(place_m.tolist())
        speed = math.sqrt(hx * hx + hy * hy + hz * hz)
        self._arc_m += speed * interval_s
        rests = speed < REST_MPS
        if not rests and self._stored_at_m is not None and math.dist(at, self._stored_at_m) < self._resolution_m:
            return
        if not rests and self._breaks(hx, hy, hz, speed):
            self._current += 1
        self._tail.insert(0, (hx, hy, hz, self._arc_m, -1 if rests else self._current))
        del self._tail[self._length :]
        self._stored_at_m = at

    def _breaks(self, hx: float, hy: float, hz: float, speed: float) -> bool:
        reference = None
        for element in self._tail:
            if element[4] == self._current:
                reference = element
                if self._arc_m - element[3] >= self._span_m:
                    break
        if reference is None:
            return True
        x, y, z = reference[:3]
        return hx * x + hy * y + hz * z < self._cosine * speed * math.sqrt(x * x + y * y + z * z)


def _response(fill: float, exponent: float) -> float:
    """Return the factor of the tail at a fill, by the definition."""
    return float(fill ** (exponent - 1) if exponent >= 1 else (fill**2 + 0.05**2) ** ((exponent - 1) / 2))
