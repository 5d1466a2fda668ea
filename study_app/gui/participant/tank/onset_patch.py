"""When a movement begins on the screen: a corner patch toggles then, for a photodiode.

The patch follows what is *shown*, so that a photodiode on it and a sensor on the hand together measure the whole
latency from hand to eye.
"""

import math

MOVING_MPS = 0.020
RESTING_MPS = 0.008
REST_NS = 100_000_000
BASE_NS = 8_000_000


class OnsetPatch:
    """Toggles at each onset of a movement of the shown proxy.

    A movement begins when the shown proxy, having been slower than 8 mm/s (hand) for 100 ms, becomes faster than
    20 mm/s. Speeds are taken over at least 8 ms, whatever the refresh rate.
    """

    def __init__(self) -> None:
        self.lit = False
        self._position: tuple[float, float, float] | None = None
        self._time_ns = 0
        self._slow_since_ns: int | None = None
        self._rested = True

    def follow(self, position_m: tuple[float, float, float], time_ns: int) -> bool:
        """Take the shown proxy (3,) [m] and the time of its sample [ns]; return whether the patch is lit."""
        if self._position is None:
            self._position, self._time_ns = position_m, time_ns
        step_ns = time_ns - self._time_ns
        if step_ns < BASE_NS:
            return self.lit
        speed = math.dist(position_m, self._position) * 1e9 / step_ns
        if speed > MOVING_MPS:
            self.lit ^= self._rested
            self._rested = False
        if speed >= RESTING_MPS:
            self._slow_since_ns = None
        elif self._slow_since_ns is None:
            self._slow_since_ns = self._time_ns
        if self._slow_since_ns is not None and time_ns - self._slow_since_ns >= REST_NS:
            self._rested = True
        self._position, self._time_ns = position_m, time_ns
        return self.lit
