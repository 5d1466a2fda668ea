"""What a hand does from one target to the next, out of a trial's samples.

Times and places are the device's, undelayed: the same clock that decided when a target was reached.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, find_peaks, sosfiltfilt

Array = NDArray[np.float64]

CUTOFF_HZ: Final = 10.0
"""Below this lies what a hand does on purpose; speeds are low-passed here (Butterworth, both ways, order 4 in all)."""

PROMINENCE: Final = 0.1
"""A peak of speed counts as a submovement if it stands out by this share of the reach's highest speed."""

SHORTEST: Final = 32
"""So many samples are needed to be filtered; a shorter reach is one submovement."""

DEFINITIONS: Final = {
    "movement_time_s": "from the lighting of a target to the entry that was held; the dwell itself is not in it",
    "path_mm": "length of the hand's path in that time",
    "overshoot_mm": "farthest place beyond the far edge of the target, along the line between the targets; 0: never",
    "submovements": "peaks of the hand's speed until the target was reached "
    f"(low-pass {CUTOFF_HZ:g} Hz) that stand out by {100 * PROMINENCE:g} % of the highest; 1 is one smooth movement",
}


@dataclass(frozen=True, slots=True)
class Targets:
    """A task of reaching: ``centres_m`` (targets, 3) in the hand's frame, their radius and how long to stay."""

    centres_m: Array
    radius_m: float
    dwell_s: float


@dataclass(frozen=True, slots=True)
class Reach:
    """One reach: its ``target``, when it was lit and when it was reached [s, from the trial's first sample]."""

    target: int
    lit_s: float
    reached_s: float
    movement_time_s: float
    path_mm: float
    overshoot_mm: float
    submovements: int


def targets_of(task: Mapping[str, Any]) -> Targets:
    """Return the targets of a task as a receipt holds it."""
    return Targets(np.asarray(task["targets_mm"], dtype=float) / 1000, task["radius_mm"] / 1000, task["dwell_s"])


def reaches(times_ns: NDArray[np.int64], positions_m: Array, targets: Targets) -> tuple[Reach, ...]:
    """Return the completed reaches of a trial.

    Parameters
    ----------
    times_ns : (n,) array
        From the task's first sample to its last.
    positions_m : (n, 3) array
        Places of the hand.
    """
    seconds = (times_ns - times_ns[0]) / 1e9 if len(times_ns) else np.zeros(0)
    found = []
    for number, (lit, entered, reached) in enumerate(_held(times_ns, positions_m, targets)):
        target = number % len(targets.centres_m)
        way = positions_m[lit : entered + 1]
        found.append(
            Reach(
                target=target,
                lit_s=round(float(seconds[lit]), 9),
                reached_s=round(float(seconds[reached]), 9),
                movement_time_s=round(float(seconds[entered] - seconds[lit]), 9),
                path_mm=1000 * path_length_m(way),
                overshoot_mm=1000 * _overshoot_m(positions_m[lit : reached + 1], targets, target),
                submovements=submovements(seconds[lit : reached + 1], positions_m[lit : reached + 1]),
            )
        )
    return tuple(found)


def _held(times_ns: NDArray[np.int64], positions_m: Array, targets: Targets) -> Iterator[tuple[int, int, int]]:
    """Yield, as samples, when each target was lit, entered for good, and reached."""
    dwell_ns = round(targets.dwell_s * 1e9)
    lit = number = 0
    while lit < len(times_ns):
        centre = targets.centres_m[number % len(targets.centres_m)]
        first = lit if number == 0 else lit + 1  # a target is entered after the sample that lit it
        inside = ((positions_m[first:] - centre) ** 2).sum(axis=1) <= targets.radius_m**2
        edges = np.flatnonzero(np.diff(inside, prepend=False, append=False)) + first
        for entered, left in zip(edges[::2], edges[1::2], strict=True):
            reached = int(np.searchsorted(times_ns, times_ns[entered] + dwell_ns))
            if reached < left:
                yield lit, int(entered), reached
                lit, number = reached, number + 1
                break
        else:
            return


def path_length_m(positions_m: Array) -> float:
    """Return the length of a path (n, 3)."""
    return float(np.linalg.norm(np.diff(positions_m, axis=0), axis=1).sum())


def submovements(seconds: Array, positions_m: Array) -> int:
    """Return how many peaks the speed along a path (n, 3) at ``seconds`` (n,) has; at least 1."""
    if len(seconds) < SHORTEST:
        return 1
    rate_hz = (len(seconds) - 1) / (seconds[-1] - seconds[0])
    if rate_hz <= 2 * CUTOFF_HZ:
        return 1
    speed = np.linalg.norm(np.gradient(positions_m, seconds, axis=0), axis=1)
    smooth = sosfiltfilt(butter(2, CUTOFF_HZ, fs=rate_hz, output="sos"), speed)
    peaks, _ = find_peaks(smooth, prominence=PROMINENCE * float(smooth.max()))
    return max(1, len(peaks))


def _overshoot_m(way: Array, targets: Targets, target: int) -> float:
    """Return how far a path went beyond the far edge of its target, seen from the target before."""
    line = targets.centres_m[target] - targets.centres_m[target - 1]
    length = float(np.linalg.norm(line))
    if length == 0.0:
        return 0.0
    beyond = (way - targets.centres_m[target]) @ (line / length)
    return max(0.0, float(beyond.max()) - targets.radius_m)
