"""What ``liquid-study validate-report`` measured of the first page, to be said on it.

Measured by ``liquid-study validate-report --studies 1000``: studies of rek2024 in which nothing differs, of each size
1000 by the answer model and 1000 by the ordinal probit model.
"""

from typing import Final

from study_app.analysis.power.power_curves import interval

STUDIES: Final = 2000
CLAIMS: Final[dict[int, int]] = {5: 11, 12: 33, 24: 36}
"""Participants → in how many of so many empty studies the page claims something."""


def empty_studies(participants: int) -> str:
    """Return in how many of a hundred empty studies the page would say something; ``participants`` take part."""
    n = min(CLAIMS, key=lambda size: abs(size - participants))
    share, low, high = (100 * one for one in (CLAIMS[n] / STUDIES, *interval(CLAIMS[n] / STUDIES, STUDIES)))
    return (
        "In how many of a hundred empty studies would this page say something? Of simulated studies of three liquids "
        f"and seven delays in which nothing differs, with {n} participants, it claims a difference or a noticed delay "
        f"in {share:.1f} of a hundred ({CLAIMS[n]} of {STUDIES} studies, 95 % interval {low:.1f} to {high:.1f}; "
        "liquid-study validate-report)."
    )
