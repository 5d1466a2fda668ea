"""The buttons of the device: which went down, and steps of an adjustment while one is held."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

CONTINUE: Final = 1 << 0
ANSWERS: Final = (1 << 1, 1 << 2)
"""The device's second button is the first of two answers or less, its third the second answer or more."""
STEP_S: Final = 0.125
"""A button or key that is held makes a step of an adjustment so often [s]."""


class DeviceButtons:
    """Follows the buttons in telemetry."""

    def __init__(self) -> None:
        self._down = 0
        self._next_ns: dict[int, int] = {}  # by button, when it makes its next step

    def pressed(self, samples: Any) -> Any:
        """Return which buttons went down at each of the newest samples (n,), as bits."""
        down = np.concatenate(([self._down], samples["buttons"]))
        self._down = int(down[-1])
        return down[1:] & ~down[:-1]

    def steps(self, pressed: Any, now_ns: int) -> int:
        """Return the steps that are due: one of each press, and of a button that stays down one every `STEP_S`.

        Parameters
        ----------
        pressed : (n,) array
            What `pressed` returned, of the samples that count.
        now_ns : int
            The time of the newest sample [ns].
        """
        steps = 0
        for bit, way in zip(ANSWERS, (-1, 1), strict=True):
            if (pressed & bit).any():
                self._next_ns[bit] = now_ns
            if now_ns >= self._next_ns.get(bit, now_ns + 1):
                self._next_ns[bit] += round(STEP_S * 1e9)
                steps += way
            if not self._down & bit:
                self._next_ns.pop(bit, None)
        return steps

    def forget(self) -> None:
        """Let no button that is down make steps."""
        self._next_ns.clear()
