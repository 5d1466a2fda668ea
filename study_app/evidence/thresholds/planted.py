"""The studies that are validated, and the threshold that their simulated observers have."""

from dataclasses import dataclass
from typing import Final

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.trials.stimuli import DELAYS
from study_app.protocol.trials.tracks import standards_of, stimulus_of
from study_app.session.simulated.participant import OBSERVER, Observer

SHIPPED: Final[dict[str, Observer]] = {
    "viscosityjnd": OBSERVER,
    "delaydetect": Observer(delay_jnd_s=0.045),
    "delayjnd": OBSERVER,
    "forcedelay": Observer(delay_jnd_s=0.015),
}
"""The shipped studies with thresholds. Planted are a Weber fraction of 0.24 at 75 % correct, which is 0.19 at 71 %
(Jones, Hunter & Lafontaine 1997), 45 ms (Vogels 2004), 25 ms at every standard (below 33 ms: Ellis et al. 1999),
and 15 ms of a force (Rank et al. 2010)."""


@dataclass(frozen=True, slots=True)
class Planted:
    """A study's main block with an adaptive method, and the observer who answers."""

    name: str
    protocol: Protocol
    block: Block
    observer: Observer

    @property
    def threshold(self) -> float:
        """The threshold, as a level: a Weber fraction or a difference [ms]."""
        if stimulus_of(self.protocol, self.block).vary in DELAYS:
            return 1000 * self.observer.delay_jnd_s
        return self.observer.weber_fraction

    @property
    def standards(self) -> tuple[float, ...]:
        """The standards, in the unit of the varied number."""
        return tuple(one for one in standards_of(self.protocol, self.block) if one is not None)

    @property
    def exponent(self) -> float | None:
        """The slope of ln JND over ln standard: 1 by Weber's law, 0 where the JND is constant; None of one standard."""
        if len(self.standards) < 2:
            return None
        return 0.0 if stimulus_of(self.protocol, self.block).vary in DELAYS else 1.0


def planted(name: str, protocol: Protocol) -> Planted:
    """Return what is planted in a study.

    Raises
    ------
    ValueError
        The study has no main block of forced choices of distances from a standard.
    """
    for block in protocol.main_blocks:
        if block.stimulus is None or block.design is None:
            continue
        stimulus = stimulus_of(protocol, block)
        if stimulus.level_kind != "value" and not all(one is None for one in standards_of(protocol, block)):
            return Planted(name, protocol, block, SHIPPED.get(name, OBSERVER))
    raise ValueError(
        f"{name} has no main block with levels above a standard, or with magnitude estimation of a liquid at a pace: "
        "nothing can be planted in it"
    )
