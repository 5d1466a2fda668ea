"""How many participants a test of equivalence requires."""

import math
from typing import Final

_LARGEST_MINORITY: Final = 1 / 5
"""The largest minority that the sample has to represent, however wide the bound, as a proportion of the population."""


def smallest_minority(bound: float, largest: float | None) -> float:
    """Return the proportion of people who can shift the mean by the bound, at most `_LARGEST_MINORITY`.

    Each of them differs by ``largest``; None means that differences are unlimited, so that any minority could do so.
    """
    return _LARGEST_MINORITY if largest is None else min(_LARGEST_MINORITY, bound / largest)


def fewest_participants(alpha: float, bound: float, largest: float | None) -> int:
    """Return the minimum number of participants for which equivalence can be shown.

    With fewer, the sample misses the `smallest_minority` with a probability of more than ``alpha``.
    """
    return math.ceil(math.log(alpha) / math.log1p(-smallest_minority(bound, largest)) - 1e-9)
