"""Measured motion and force: rows of a stream, and velocities from positions without lag."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]

FORCES: Final = ("fx_n", "fy_n", "fz_n")
HALF_S: Final = 0.0125
"""Half width of the window for velocities: a tenth of the period of strokes of 4 Hz in total. [choice]"""
GAP_S: Final = 0.05
"""A longer time between two rows restarts the estimation, since the motion between them is unknown."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Rows of a stream in the scene frame.

    ``t_s`` (n,) increases; ``position_m``, ``velocity_mps`` and ``force_n`` (the liquid's on the body) are (n, 3).
    Where ``usable`` (n,) is false only the motion is known.
    """

    t_s: Floats
    position_m: Floats
    velocity_mps: Floats
    force_n: Floats
    usable: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.t_s)

    def part(self, first: int, behind: int | None = None) -> Rows:
        """Return the rows from one number on, up to another."""
        return Rows(*(getattr(self, name)[first:behind] for name in self.__slots__))


def no_rows() -> Rows:
    """Return no rows."""
    return Rows(np.empty(0), np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3)), np.empty(0, bool))


def joined(*parts: Rows) -> Rows:
    """Return successive rows joined."""
    return Rows(*(np.concatenate([getattr(it, name) for it in parts]) for name in Rows.__slots__))


class CentredVelocity:
    """Computes velocities of a stream without them: the slope through the positions 12.5 ms to both sides.

    A row is returned once the positions after it are known. A gap restarts the window.
    """

    def __init__(self) -> None:
        self._t_s: Floats = np.empty(0)
        self._position_m: Floats = np.empty((0, 3))
        self._force_n: Floats = np.empty((0, 3))

    def take(self, t_s: Floats, position_m: Floats, force_n: Floats) -> Rows:
        """Return the rows that are complete: times (n,) [s], positions [m] and forces [N] (n, 3) are the next ones."""
        self._t_s = np.concatenate([self._t_s, t_s])
        self._position_m = np.concatenate([self._position_m, position_m])
        self._force_n = np.concatenate([self._force_n, force_n])
        gaps = np.flatnonzero(np.diff(self._t_s) > GAP_S)
        if len(gaps):
            self._drop(int(gaps[-1]) + 1)
        if len(self._t_s) < 3:
            return no_rows()
        half = max(1, round(HALF_S / float(np.median(np.diff(self._t_s)))))
        width = 2 * half + 1
        if len(self._t_s) < width:
            return no_rows()
        times_s = np.lib.stride_tricks.sliding_window_view(self._t_s, width)
        places_m = np.lib.stride_tricks.sliding_window_view(self._position_m, width, axis=0)
        lever_s = times_s - times_s.mean(axis=1, keepdims=True)
        slopes = np.einsum("nw,naw->na", lever_s, places_m) / np.sum(lever_s**2, axis=1)[:, np.newaxis]
        inner = slice(half, half + len(slopes))
        out = Rows(self._t_s[inner], self._position_m[inner], slopes, self._force_n[inner], np.ones(len(slopes), bool))
        self._drop(len(slopes))
        return out

    def _drop(self, count: int) -> None:
        self._t_s, self._position_m = self._t_s[count:], self._position_m[count:]
        self._force_n = self._force_n[count:]
