"""The link between the force model and the hand: delay, jitter and loss of the force in a study."""

import math
from typing import Annotated, Final

from study_app.haptics.model.ranges import Frozen, within

MOST_DELAY_MS: Final = 200
MOST_JITTER_MS: Final = 50
MOST_LOSS: Final = 0.5
FORCES: Final = 1024
"""Number of stored forces: delay and jitter together are shorter [ticks]."""


class ForceLink(Frozen):
    """A link that sends the force of the effects late, with jitter and loss.

    Parameters
    ----------
    delay_s : float
        Delay of every force [s].
    jitter_s : float
        A force is later by up to this, drawn again at every tick from a uniform distribution [s].
    loss : float
        Share of ticks whose force is lost: the last one is held.
    seed : int
        Of jitter and loss, below 2³².
    """

    delay_s: Annotated[float, within(0, MOST_DELAY_MS / 1000, "beyond, a liquid pushes instead of resisting")] = 0.0
    jitter_s: Annotated[float, within(0, MOST_JITTER_MS / 1000, "networks deviate less")] = 0.0
    loss: Annotated[float, within(0, MOST_LOSS, "beyond, most forces are held ones")] = 0.0
    seed: Annotated[int, within(0, 2**32 - 1, "32 bits")] = 0

    @property
    def acts(self) -> bool:
        """Whether it changes the force."""
        return self.delay_s > 0 or self.jitter_s > 0 or self.loss > 0

    def ticks(self, rate_hz: float) -> tuple[int, int]:
        """Return delay and jitter in whole ticks."""
        return round(self.delay_s * rate_hz), round(self.jitter_s * rate_hz)

    def mean_delay_s(self, rate_hz: float) -> float:
        """Return the approximate mean delay of a force [s].

        A force older than the last one is skipped, so a uniform jitter of J ticks adds about √(πJ/2) ticks.
        """
        return self.delay_s + math.sqrt(math.pi / 2 * self.ticks(rate_hz)[1]) / rate_hz

    def fits(self, rate_hz: float) -> bool:
        """Return whether enough forces are stored for the delay."""
        return sum(self.ticks(rate_hz)) < FORCES


def too_long(rate_hz: float) -> str:
    """Return the error message of a link that does not fit."""
    return f"delay and jitter of the force must be below {1000 * FORCES / rate_hz:g} ms together at {rate_hz:g} Hz"


PROMPT: Final = ForceLink()
"""No link, the default: the force of a tick is sent in that tick."""
