"""The wake as places on a screen: where the body left the elements that act on it now."""

from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]

MOST_POINTS: Final = 400


@dataclass(frozen=True, slots=True, eq=False)
class Tail:
    """The moving elements of a wake as places, from the oldest to the newest, thinned to at most 400.

    ``positions_m`` (n, 3) [m, hand frame]; ``breaks`` (n,) bool, true where a segment begins; ``ages`` (n,) from 0, the
    newest possible element, to 1, the oldest. ``alive`` of at most ``elements`` are stored now, including those at
    rest, in ``segments`` segments (cells of a local wake).
    """

    positions_m: Floats
    breaks: NDArray[np.bool_]
    ages: Floats
    elements: int
    alive: int
    segments: int


def tail_of(trail: Any, places: Any, elements: int) -> Tail:
    """Return the tail of a trail (``haptics.runtime.recompute``) of at most ``elements`` elements."""
    left, held = int(trail.left), int(trail.held)
    numbers = np.arange(left - held, left)
    found = places[numbers % len(places)]
    moving = found.moving != 0
    numbers, found = numbers[moving], found[moving]
    breaks = np.ones(len(found), bool)
    breaks[1:] = found.segment[1:] != found.segment[:-1]
    kept = _thinned(breaks)
    ages = (left - 1 - numbers[kept]) / max(elements - 1, 1)
    return Tail(
        positions_m=np.array(found.hand_m[kept], np.float64).reshape(-1, 3),
        breaks=breaks[kept],
        ages=np.clip(ages, 0.0, 1.0),
        elements=elements,
        alive=held,
        segments=int(trail.segments),
    )


def _thinned(breaks: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return the rows to draw: evenly spaced ones, the newest, and starts of segments if they fit."""
    count = len(breaks)
    if count <= MOST_POINTS:
        return np.arange(count)
    begins = np.flatnonzero(breaks)
    if len(begins) > MOST_POINTS // 2:
        begins = begins[-(MOST_POINTS // 2) :]
    even = np.linspace(0, count - 1, MOST_POINTS - len(begins)).round().astype(np.int64)
    return np.unique(np.concatenate([begins, even]))
