"""Weber exponents of a block of levels: how the just-noticeable difference (JND) grows with the standard.

An exponent of 1 is Weber's law, JND ∝ standard; 0 is a constant JND.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from study_app.analysis.designs.estimated_exponents import mean_exponent
from study_app.analysis.results.level_results import ExponentFound, ThresholdFound


def jnd_slope(standards: ArrayLike, jnds: ArrayLike) -> float:
    """Return the least-squares slope of ln JND on ln standard.

    Parameters
    ----------
    standards, jnds : (k,) array
        Two different standards or more, and the JND at each, all above zero, in the same unit.
    """
    slope, _ = np.polyfit(np.log(np.asarray(standards, float)), np.log(np.asarray(jnds, float)), 1)
    return float(slope)


def weber_exponents(thresholds: Sequence[ThresholdFound], level_kind: str) -> Iterator[ExponentFound]:
    """Yield the exponent of the group, followed by those of the participants with thresholds at two standards or more.

    Parameters
    ----------
    level_kind : str
        What a level is. A JND is weber × standard, or the difference itself; a value has none.
    """
    if level_kind == "value":
        return
    own = []
    for person in dict.fromkeys(one.participant for one in thresholds if one.participant is not None):
        places = [
            (one.standard, one.threshold * (one.standard if level_kind == "weber" else 1.0))
            for one in thresholds
            if one.participant == person and one.standard is not None and one.standard > 0 and one.threshold > 0
        ]
        if len(places) >= 2:
            own.append(ExponentFound(person, len(places), jnd_slope(*np.array(places).T)))
    if own:
        yield mean_exponent(own)
    yield from own
