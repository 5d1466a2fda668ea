"""SIMULATED settings: an observer who adjusts until the strength equals the remembered one, as it is taken."""

from typing import Final

from study_app.session.simulated.design_observer import Comparison, Draw

LOOK_S: Final = 0.5
"""How long the observer judges before the next steps [s]: half a swing of a target at 1 Hz."""
FAST: Final = 4
"""Steps at once, until the remembered strength was crossed. [choice]"""
MOST_LOOKS: Final = 60
"""Then the observer leaves a setting as it is: what is remembered may lie beyond the levels."""


class AdjustingObserver:
    """Remembers the standard with noise, takes what is adjusted with noise, and goes on until the two cross.

    The noise of a setting is drawn once, so that settings scatter as the difference of two single impressions does.

    Parameters
    ----------
    attended : Comparison
        What is attended to.
    draw : callable
        Uniform numbers in [0, 1).
    """

    def __init__(self, attended: Comparison, draw: Draw) -> None:
        self._attended = attended
        self._remembered_noise, self._noise = (attended.noisy(self._neutral, draw) for _ in range(2))
        self._hop = FAST
        self._way = 0
        self._looks = 0

    def steps(self, sensed: float, standard: float) -> int:
        """Return the next steps by what is sensed, 0 where the setting is done; ``standard`` is what was sensed of it.

        Both are those of `Comparison.sensed`.
        """
        self._looks += 1
        short = self._taken(standard, self._remembered_noise) - self._taken(sensed, self._noise)
        way = 1 if short > 0 else -1
        crossed = self._way not in {0, way}
        if short == 0 or self._looks > MOST_LOOKS or (crossed and self._hop == 1):
            return 0
        if crossed:
            self._hop = 1
        self._way = way
        return way * self._hop

    @property
    def _neutral(self) -> float:
        return 0.0 if self._attended.delays else 1.0

    def _taken(self, sensed: float, noise: float) -> float:
        return sensed + noise if self._attended.delays else sensed * noise
