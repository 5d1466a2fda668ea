"""What ``liquid-study validate-report`` measured of the first page, to be said on it.

Measured by ``liquid-study validate-report --studies 1000``, ended early: 575 studies of rek2024 of each size in which
nothing differs, 300 by the answer model and 275 by the ordinal probit model.
"""

from __future__ import annotations

from typing import Final

CLAIMS: Final[dict[int, tuple[float, float, float]]] = {
    5: (6.3, 4.6, 8.5),
    12: (9.7, 7.6, 12.4),
    24: (14.1, 11.5, 17.2),
}
"""Participants → of a hundred empty studies, those in which the page claims something, and the 95 % interval."""


def empty_studies(participants: int) -> str:
    """Return in how many of a hundred empty studies the page would say something; ``participants`` take part."""
    n = min(CLAIMS, key=lambda size: abs(size - participants))
    share, low, high = CLAIMS[n]
    return (
        "In how many of a hundred empty studies would this page say something? Of simulated studies of three liquids "
        f"and seven delays in which nothing differs, with {n} participants, it claims a difference or a noticed delay "
        f"in {share:g} of a hundred (95 % interval {low:g} to {high:g}; liquid-study validate-report)."
    )
