"""Corrections for asking several questions at once; who belongs to a family the caller says."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import false_discovery_control

from study_app.errors import AnalysisError


def holm(ps: Sequence[float | None]) -> tuple[float | None, ...]:
    """Return Holm's adjusted p of each test of a family (Holm 1979, Scand. J. Stat. 6, 65–70).

    None, a test that gave no p, stays None and counts as a member: it was asked.

    Raises
    ------
    AnalysisError
        A p is not between 0 and 1.
    """
    known = _known(ps)
    adjusted: list[float | None] = [None] * len(ps)
    highest = 0.0
    for place, member in enumerate(sorted(known, key=lambda member: known[member])):
        highest = max(highest, min(1.0, (len(ps) - place) * known[member]))
        adjusted[member] = highest
    return tuple(adjusted)


def false_discovery(ps: Sequence[float | None]) -> tuple[float | None, ...]:
    """Return the p adjusted for the rate of false discoveries (Benjamini & Hochberg 1995), for exploratory blocks.

    None stays None and counts as a test with p = 1.

    Raises
    ------
    AnalysisError
        A p is not between 0 and 1.
    """
    known = _known(ps)
    if not known:
        return (None,) * len(ps)
    adjusted = false_discovery_control(np.array([known.get(member, 1.0) for member in range(len(ps))]))
    return tuple(float(adjusted[member]) if member in known else None for member in range(len(ps)))


def _known(ps: Sequence[float | None]) -> dict[int, float]:
    known = {member: p for member, p in enumerate(ps) if p is not None}
    for p in known.values():
        if not 0.0 <= p <= 1.0:
            raise AnalysisError(f"p = {p} cannot be adjusted; give a p between 0 and 1, or None where a test gave none")
    return known
