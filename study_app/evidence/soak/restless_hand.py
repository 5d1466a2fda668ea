"""A scripted hand that never does the same for long: reaches, circles, sharp turns, and on request true stillness."""

import math
from random import Random
from typing import Final

import numpy as np

from study_app.devices.scripted import TREMOR_M, ScriptedDevice

REACH_M: Final = 0.04  # how far from the middle it goes, to every side
ROW_S: Final = 4e-3
SLOWEST_MPS: Final = 0.02
FASTEST_MPS: Final = 1.0


class RestlessHand(ScriptedDevice):
    """A hand that draws what it does next from a stream of its own."""

    def __init__(self, random: Random, *, force_limit_n: float = 8.0) -> None:
        super().__init__(random, force_limit_n=force_limit_n)
        self._draw = random.random

    def go_on(self) -> float:
        """Begin another motion; return how long to leave it at that [s]."""
        self._shake(TREMOR_M)
        kind = self._draw()
        if kind < 0.3:
            return self._reach()
        if kind < 0.4:
            self.rest()
            return 0.1 + self._draw()
        return self._circle() if kind < 0.7 else self._tick_sharply()

    def keep_still(self) -> None:
        """Stay, without a tremor: the encoders come to rest."""
        self._shake(0.0)
        self.rest()

    def _shake(self, amplitude_m: float) -> None:
        self.state.hand.tremor_m = amplitude_m

    def _reach(self) -> float:
        duration_s = 0.12 + 1.5 * self._draw() ** 2
        x_m, y_m, z_m = self._place_m()
        self.reach_to(x_m, y_m, z_m, duration_s)
        return duration_s + 0.3 * self._draw()

    def _speed_mps(self) -> float:
        return float(SLOWEST_MPS * (FASTEST_MPS / SLOWEST_MPS) ** self._draw())

    def _place_m(self) -> tuple[float, float, float]:
        x_m, y_m, z_m = (REACH_M * (2 * self._draw() - 1) for _ in range(3))
        return x_m, y_m, z_m

    def _circle(self) -> float:
        """Go around at an even speed, up and down meanwhile."""
        radius_m = REACH_M * (0.1 + 0.9 * self._draw())
        duration_s = 1.0 + 5.0 * self._draw()
        t_s = np.arange(round(duration_s / ROW_S) + 1) * ROW_S
        angle = t_s * self._speed_mps() / radius_m + 2 * math.pi * self._draw()
        y_m = 0.3 * radius_m * np.sin(0.37 * angle)
        self.follow(t_s, np.column_stack([radius_m * np.cos(angle), y_m, radius_m * np.sin(angle)]))
        return duration_s

    def _tick_sharply(self) -> float:
        """Go along straight legs to random places, without slowing down at the corners."""
        legs = 4 + int(8 * self._draw())
        places_m = np.array([self._place_m() for _ in range(legs)])
        lengths_m = np.linalg.norm(np.diff(places_m, axis=0), axis=1)
        t_s = np.concatenate([[0.0], np.cumsum(np.maximum(lengths_m / self._speed_mps(), ROW_S))])
        self.follow(t_s, places_m)
        return float(min(t_s[-1], 8.0))
