"""A wake stored element by element, summed exactly at intervals and compared with the servo's running sums.

The servo keeps sums and takes from them what falls off. Here nothing is ever summed in passing: from the samples in
telemetry alone, by the definition, each stored velocity is kept as it was, with its segment and the time it was stored;
when asked, the whole list is decayed and summed with ``math.fsum``. It shares no code with ``haptics.kernels.effects``.

How far the servo's wakes are from their definition, followed from scene to scene.
"""

import math
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.vector import copy, square, square_distance
from study_app.haptics.model.effects.wake import Wake
from study_app.haptics.model.force_rules import CURRENT
from study_app.haptics.model.layout import LIMITER_GLITCH, SAMPLE, records
from study_app.haptics.model.motion import Floats
from study_app.haptics.model.scene import Everywhere, Liquid, Scene

REST_MPS: Final = 1e-3
REFUSALS_IN_A_ROW: Final = 5
SHORTEST_NS: Final = 200_000
LONGEST_NS: Final = 20_000_000

_BOOK = np.dtype(
    [
        ("length", np.int64),  # N
        ("breaking_cosine", np.float64),
        ("breaking_span_m", np.float64),
        ("resolution_m", np.float64),
        ("vertical", np.float64),
        ("scale", np.float64),
        ("period_ns", np.int64),
        ("tracking", np.int64),  # 1 once a position was accepted
        ("gap_ns", np.float64),  # longer without a sample is a gap
        ("accepted_m", np.float64, (3,)),  # the last accepted position
        ("rejected", np.int64),  # readings refused in a row
        ("accepted_ns", np.int64),
        ("stored", np.int64),
        ("held", np.int64),
        ("segment", np.int64),  # the current one
        ("age_ns", np.int64),  # all intervals so far
        ("arc_m", np.float64),
        ("stored_at_m", np.float64, (3,)),  # scene, without the origin
    ],
    align=True,
)

_ENTRY = np.dtype(
    [
        ("velocity_mps", np.float64, (3,)),
        ("speed_mps", np.float64),  # 0: an element at rest
        ("segment", np.int64),
        ("age_ns", np.int64),  # of the book when it was stored
        ("arc_m", np.float64),
    ],
    align=True,
)


def wake_of(scene: Scene) -> Wake | None:
    """Return the wake that can be stored: that of a single liquid, everywhere, without a current; else None."""
    if len(scene.liquids) != 1:
        return None
    liquid: Liquid = scene.liquids[0]
    if "wake" not in liquid.effects or "current" in liquid.effects or not isinstance(liquid.region, Everywhere):
        return None
    found: Wake | None = liquid.wake
    return found


class Ledger:
    """The wake of one scene, whose `wake_of` is one, from its first sample on."""

    def __init__(self, scene: Scene) -> None:
        wake = wake_of(scene)
        if wake is None:
            raise ValueError("this scene's wake cannot be written down")
        self._wake = wake
        pace = scene.rate_hz / 1000
        length = max(1, math.floor(wake.length * pace))
        self._scaling = max(wake.scaling * pace, length)
        self._log_decay_pns = math.log(wake.decay) * 1e-6
        self._book = records(_BOOK, 1)
        self._entries = records(_ENTRY, length)
        book = self._book[0]
        book.length = length
        book.breaking_cosine = math.cos(math.radians(wake.breaking_angle_deg))
        book.breaking_span_m = wake.breaking_span_m
        book.resolution_m = wake.resolution_m
        book.vertical = 1.0 if wake.axes == "xyz" else 0.0
        book.scale = scene.scale
        book.period_ns = round(1e9 / scene.rate_hz)
        book.gap_ns = CURRENT.gap_ticks * book.period_ns

    def take(self, samples: Any) -> float | None:
        """Write down ``samples`` (recarray of ``SAMPLE``, all of this scene, none missing); compare at the last one.

        Returns
        -------
        |wake - definition| at the last accepted of them, in units of Σ|e|/S; infinite where that is not finite, None
        where there is nothing to compare
        """
        last = _last_accepted(samples)
        if last < 0:
            write_down(self._book[0], self._entries, samples, 0, len(samples))
            return None
        write_down(self._book[0], self._entries, samples, 0, last)
        goes_on = self._book[0].tracking and not _begins_anew(self._book[0], samples[last])
        defined, size_mps = self.definition() if goes_on else (np.zeros(3), 0.0)
        write_down(self._book[0], self._entries, samples, last, len(samples))
        error_mps = float(np.linalg.norm(samples.wake_mps[last] - defined))
        if size_mps == 0.0:
            return None if error_mps == 0.0 else math.inf
        return error_mps / size_mps if math.isfinite(error_mps) else math.inf

    def definition(self) -> tuple[Floats, float]:
        """Return v_wake (3,) as the next tick's drag meets it, and Σ|e|/S, every sum exact to the last digit."""
        book = self._book[0]
        numbers = np.arange(book.stored - book.held, book.stored) % book.length
        held = self._entries[numbers]
        held = held[held.speed_mps > 0.0]
        if held.size == 0:
            return np.zeros(3), 0.0
        speed_mps = held.speed_mps * np.exp(self._log_decay_pns * (book.age_ns - held.age_ns))
        ends = np.flatnonzero(np.diff(held.segment, append=-1))
        sums = [math.fsum(part) for part in np.split(speed_mps, ends[:-1] + 1)]
        direction = held.velocity_mps[ends] / held.speed_mps[ends][:, None]
        tail = np.array([math.fsum(direction[:, axis] * sums) for axis in range(3)]) / self._scaling
        total_mps = math.fsum(speed_mps)
        fill = float(np.linalg.norm(tail)) * total_mps / math.fsum(speed_mps**2)
        return tail * self._gain(fill), total_mps / self._scaling

    @property
    def age_s(self) -> float:
        """How long the wake has run on without being emptied [s]."""
        return float(self._book[0].age_ns) * 1e-9

    def _gain(self, fill: float) -> float:
        y = self._wake.exponent
        return float(fill ** (y - 1) if y >= 1 else (fill**2 + 0.05**2) ** ((y - 1) / 2))


@kernel
def _last_accepted(samples: Any) -> int:
    for i in range(samples.shape[0] - 1, -1, -1):
        if samples[i].fresh == 1 and samples[i].limiters & LIMITER_GLITCH == 0:
            return i
    return -1


@kernel
def _begins_anew(book: Any, sample: Any) -> bool:
    """Return whether the body was lost in a gap: it has moved, and yet its velocity is exactly 0."""
    moved = square_distance(sample.position_m, book.accepted_m) > 0.0
    return bool(sample.time_ns - book.accepted_ns > book.gap_ns and moved and square(sample.velocity_mps) == 0.0)


@kernel
def write_down(book: Any, entries: Any, samples: Any, first: int, end: int) -> None:
    """Take samples ``first`` to ``end`` into the list, as the definition says."""
    for i in range(first, end):
        sample = samples[i]
        if sample.fresh == 0:
            continue
        if sample.limiters & LIMITER_GLITCH:
            book.rejected += 1
            if book.rejected == REFUSALS_IN_A_ROW:
                book.tracking = 0
            continue
        interval_ns = book.period_ns
        if book.tracking != 0 and not _begins_anew(book, sample):
            interval_ns = min(max(sample.time_ns - book.accepted_ns, SHORTEST_NS), LONGEST_NS)
        else:
            _begin(book)
        book.rejected = 0
        book.accepted_ns = sample.time_ns
        copy(sample.position_m, book.accepted_m)
        _enter(book, entries, sample, interval_ns)


@kernel
def _begin(book: Any) -> None:
    book.tracking = 1
    book.stored = 0
    book.held = 0
    book.segment = 0
    book.age_ns = 0
    book.arc_m = 0.0


@kernel
def _enter(book: Any, entries: Any, sample: Any, interval_ns: int) -> None:
    x, y, z = sample.velocity_mps[0], book.vertical * sample.velocity_mps[1], sample.velocity_mps[2]
    speed_mps = math.sqrt(x * x + y * y + z * z)
    book.age_ns += interval_ns
    book.arc_m += speed_mps * (interval_ns * 1e-9)
    rests = speed_mps < REST_MPS
    if not rests and book.stored > 0 and _moved(book, sample) < book.resolution_m:
        return
    if not rests and _breaks(book, entries, x, y, z, speed_mps):
        book.segment += 1
    entry = entries[book.stored % book.length]
    entry.velocity_mps[0] = x
    entry.velocity_mps[1] = y
    entry.velocity_mps[2] = z
    entry.speed_mps = 0.0 if rests else speed_mps
    entry.segment = book.segment
    entry.age_ns = book.age_ns
    entry.arc_m = book.arc_m
    book.stored += 1
    book.held = min(book.held + 1, book.length)
    for axis in range(3):
        book.stored_at_m[axis] = book.scale * sample.position_m[axis]


@kernel
def _moved(book: Any, sample: Any) -> float:
    square = 0.0
    for axis in range(3):
        step_m = book.scale * sample.position_m[axis] - book.stored_at_m[axis]
        square += step_m * step_m
    return math.sqrt(square)


@kernel
def _breaks(book: Any, entries: Any, x: float, y: float, z: float, speed_mps: float) -> bool:
    """Return whether a velocity begins a new segment: looked for from the newest element back."""
    reference = -1
    for number in range(book.stored - 1, book.stored - book.held - 1, -1):
        entry = entries[number % book.length]
        if entry.speed_mps == 0.0:
            continue
        if entry.segment != book.segment:
            break
        reference = number
        if book.arc_m - entry.arc_m >= book.breaking_span_m:
            break
    if reference < 0:
        return True
    e = entries[reference % book.length]
    along = x * e.velocity_mps[0] + y * e.velocity_mps[1] + z * e.velocity_mps[2]
    return bool(along < (book.breaking_cosine - 1e-12) * speed_mps * e.speed_mps)


def prepare() -> None:
    """Compile what writes down, or load it from the cache."""
    _last_accepted(records(SAMPLE, 0))
    write_down(records(_BOOK, 1)[0], records(_ENTRY, 1), records(SAMPLE, 0), 0, 0)


@dataclass(slots=True)
class Drift:
    """How far the wakes of a servo were from their definition at most, in units of Σ|e|/S, looked at now and then.

    ``longest_s`` is the longest time that one of them ran on without being emptied.
    """

    comparisons: int = 0
    worst: float = 0.0
    longest_s: float = 0.0
    _scenes: dict[int, Scene] = field(default_factory=dict)  # not yet seen in samples, by serial
    _serial: int = 0
    _ledger: Ledger | None = None
    _next_tick: int = -1

    def expect(self, serial: int, scene: Scene) -> None:
        """Register the scene that telemetry calls ``serial``."""
        if wake_of(scene) is not None:
            self._scenes[serial] = scene

    def take(self, samples: Any) -> None:
        """Follow ``samples`` (recarray of ``SAMPLE``), those after the last ones.

        A scene of which some are missing is followed no further.
        """
        for part in np.split(samples, np.flatnonzero(np.diff(samples.scene)) + 1):
            if len(part) > 0:
                self._take_part(part)

    def _take_part(self, samples: Any) -> None:
        serial = int(samples.scene[0])
        if serial != self._serial:
            scene = self._scenes.get(serial)
            self._scenes = {later: it for later, it in self._scenes.items() if later > serial}
            self._ledger = Ledger(scene) if scene is not None else None
            self._serial = serial
        elif samples.tick[0] != self._next_tick:
            self._ledger = None
        self._next_tick = int(samples.tick[-1]) + 1
        if self._ledger is None:
            return
        if (np.diff(samples.tick) != 1).any():
            self._ledger = None
            return
        error = self._ledger.take(samples)
        self.longest_s = max(self.longest_s, self._ledger.age_s)
        if error is not None:
            self.comparisons += 1
            self.worst = max(self.worst, error)
