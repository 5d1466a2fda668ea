"""Known answers: what a template with an adaptive method finds of simulated people whose threshold is planted."""

import json
import math
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np

from study_app.designer.new_study.templates import FOLDER
from study_app.protocol.checks.expected_precision import threshold_plan
from study_app.protocol.model import Protocol
from study_app.psychophysics.precision import BETWEEN_PEOPLE

FILE: Final = FOLDER / "known_answers.json"
STUDIES: Final = 100
SEED: Final = 1
MIDDLE: Final = (0.05, 0.95)


@dataclass(frozen=True, slots=True)
class KnownAnswer:
    """A planted threshold, and what simulated studies find of it.

    Attributes
    ----------
    planted : float
        Mean threshold of the simulated people, in the unit of the levels.
    unit : str
        That unit; "" of a Weber fraction.
    source : str
        Where the planted threshold is from.
    people : int
        How many take part in each study.
    found, low, high : float
        Mean of the studies' thresholds, and the ends of the middle 90 % of them.
    """

    planted: float
    unit: str
    source: str
    people: int
    found: float
    low: float
    high: float

    @property
    def recovered(self) -> bool:
        """Whether the mean is within 10 % of the planted threshold, which is among the middle 90 %."""
        return abs(self.found / self.planted - 1) <= 0.1 and self.low <= self.planted <= self.high


@cache
def known_answers() -> dict[str, KnownAnswer]:
    """Return the known answers of the templates that have one, as they were computed when the templates were made."""
    found: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return {name: KnownAnswer(**values) for name, values in found.items()}


def simulated(protocol: Protocol, planted: float, unit: str, source: str) -> KnownAnswer:
    """Simulate studies of a protocol's first block with levels, and return what they find.

    Parameters
    ----------
    protocol : Protocol
        The study; its plan says how many people take part.
    planted : float
        Mean threshold of the people; each person's own differs from it by a factor of `BETWEEN_PEOPLE`.
    unit, source : str
        Unit of the levels, and where the planted threshold is from.

    Raises
    ------
    ValueError
        The study has no thresholds, or does not say how many people take part.
    """
    plan = next((one for block in protocol.main_blocks if (one := threshold_plan(protocol, block)) is not None), None)
    people = protocol.analysis.participants if protocol.analysis is not None else None
    if plan is None or people is None or plan.stimulus.spacing != "log":
        raise ValueError("the study has no thresholds on logarithmic levels, or does not say how many take part")
    rng = np.random.default_rng(SEED)
    apart = math.log10(BETWEEN_PEOPLE) * rng.standard_normal((STUDIES, people))
    estimates = plan.simulate((plan.stimulus.coordinate(planted) + apart).ravel(), rng)
    means = 10.0 ** estimates.medians.reshape(STUDIES, people).mean(axis=1)
    low, high = np.quantile(means, MIDDLE)
    figures = (round(float(one), 4) for one in (means.mean(), low, high))
    return KnownAnswer(planted, unit, source, people, *figures)
