"""How a simulated participant explores a tank: strokes, circles, zigzags and stops, round after round in random order.

Only sums, products, quotients and square roots of the numbers drawn are used, so that a seed gives the same motion
everywhere.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.protocol.orders.schedule import shuffle

Floats: TypeAlias = NDArray[np.float64]
Draw: TypeAlias = Callable[[], float]

RATE_HZ = 200.0
PACE_MPS = (0.06, 0.22)  # slowest and fastest mean pace of a stroke
REST_S = (0.3, 0.9)  # a stop after each figure, to feel what the liquid does
_CORNERS = 128
_TURN = complex(0.9987954562051724, 0.049067674327418015)  # one corner further round the circle


def exploration(draw: Draw, half_m: tuple[float, float, float], duration_s: float) -> tuple[Floats, Floats]:
    """Return a motion of at least ``duration_s`` that begins and stays within ``half_m`` of the middle.

    Parameters
    ----------
    draw : Draw
        Uniform numbers in [0, 1).
    half_m : tuple of float
        Half extents of the tank, hand frame [m].
    duration_s : float
        The least duration [s].

    Returns
    -------
    t_s : (n,) array
        Times [s].
    position_m : (n, 3) array
        Positions, hand frame [m].
    """
    reach_m = 0.7 * np.asarray(half_m)
    pieces = [np.zeros((1, 3))]
    coming: list[Figure] = []
    while sum(map(len, pieces)) < duration_s * RATE_HZ:
        coming = coming or list(shuffle(FIGURES, draw))
        pieces += coming.pop()(draw, reach_m, pieces[-1][-1])
        pieces.append(np.tile(pieces[-1][-1], (_rows(_between(draw, *REST_S)), 1)))
    position_m = np.concatenate(pieces)
    return np.arange(len(position_m)) / RATE_HZ, position_m


def _strokes_across(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
    """Go to and fro from left to right, at any height."""
    y = _between(draw, -1, 1) * reach_m[1] * 0.5
    ends = [np.array([side * reach_m[0], y, 0.0]) for side in (1, -1, 1, -1)]
    return _through(draw, start_m, ends)


def _strokes_up(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
    x = _between(draw, -1, 1) * reach_m[0] * 0.5
    return _through(draw, start_m, [np.array([x, side * reach_m[1], 0.0]) for side in (1, -1, 1)])


def _strokes_in_depth(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
    x = _between(draw, -1, 1) * reach_m[0] * 0.5
    return _through(draw, start_m, [np.array([x, 0.0, side * reach_m[2]]) for side in (1, -1, 1)])


def _zigzag(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
    """Cross the tank in legs that turn by about 90°."""
    across = np.linspace(-1, 1, 6) * reach_m[0]
    side = reach_m[2] * 0.5
    return _through(draw, start_m, [np.array([x, 0.0, side * (1 - 2 * (i % 2))]) for i, x in enumerate(across)])


def _circles(draw: Draw, reach_m: Floats, start_m: Floats) -> list[Floats]:
    """Stir: three rounds about the middle, begun and ended at full pace as a hand does that stops at once."""
    radius_m = min(reach_m[0], reach_m[2]) * _between(draw, 0.6, 1.0)
    pace_mps = _between(draw, *PACE_MPS)
    first = np.array([radius_m, 0.0, 0.0])
    corners = np.empty(_CORNERS + 1, complex)
    corners[0] = 1.0
    for k in range(_CORNERS):
        corners[k + 1] = corners[k] * _TURN
    rows = _rows(3 * 2 * np.pi * radius_m / pace_mps)
    corner = (np.arange(1, rows + 1) * (3 * _CORNERS / rows)) % _CORNERS
    x = np.interp(corner, np.arange(_CORNERS + 1), corners.real)
    z = np.interp(corner, np.arange(_CORNERS + 1), corners.imag)
    return [_stroke(start_m, first, pace_mps), radius_m * np.column_stack((x, np.zeros(rows), z))]


def _through(draw: Draw, start_m: Floats, places_m: list[Floats]) -> list[Floats]:
    """Go from place to place, each stroke at a pace of its own."""
    return [
        _stroke(begin, end, _between(draw, *PACE_MPS))
        for begin, end in zip([start_m, *places_m[:-1]], places_m, strict=True)
    ]


def _stroke(begin_m: Floats, end_m: Floats, pace_mps: float) -> Floats:
    """Return the rows of a minimum-jerk stroke after its first (Flash & Hogan 1985, eq. 10)."""
    way = end_m - begin_m
    rows = _rows(float(np.sqrt((way * way).sum())) / pace_mps)
    share = np.arange(1, rows + 1) / rows
    done = share * share * share * (10.0 + share * (6.0 * share - 15.0))
    return np.asarray(begin_m + done[:, None] * way)


Figure: TypeAlias = Callable[[Draw, Floats, Floats], list[Floats]]
FIGURES: tuple[Figure, ...] = (_strokes_across, _circles, _zigzag, _strokes_up, _strokes_in_depth)


def _rows(duration_s: float) -> int:
    return max(1, round(duration_s * RATE_HZ))


def _between(draw: Draw, low: float, high: float) -> float:
    return low + (high - low) * draw()
