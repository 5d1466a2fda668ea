"""The table of what the passivity controller leaves of a force that a study delays, as it ships.

It is ``delayed_force.csv`` in this folder, measured by ``validation.stability.force_delay`` on the servo's own tick.
"""

from __future__ import annotations

import csv
from functools import cache
from importlib import resources
from typing import Final, NamedTuple

WITHHELD_PERCENT: Final = 5.0
"""A trial in which more is withheld does not present the force that was asked for."""


class Entry(NamedTuple):
    """One line: a liquid in a hand, its force late by ``delay_ms``.

    Parameters
    ----------
    liquid : str
        A liquid of ``rek2024``, or one of ``physical2`` as "physical2_water".
    estimator : str
        The velocity estimator.
    hand : str
        The grip: "light", "middle" or "firm".
    delay_ms : float
        Delay of the force [ms], in addition to that of the device.
    left_percent : float
        RMS of the force sent over RMS of the force asked for [%].
    withheld_percent : float
        Share of the force that is withheld, as in a trial [%].
    """

    liquid: str
    estimator: str
    hand: str
    delay_ms: float
    left_percent: float
    withheld_percent: float


@cache
def table() -> tuple[Entry, ...]:
    """Return the table as it ships."""
    with (resources.files("study_app.protocol.checks") / "delayed_force.csv").open(encoding="utf-8") as file:
        return tuple(
            Entry(
                row["liquid"],
                row["estimator"],
                row["hand"],
                float(row["delay_ms"]),
                float(row["left_percent"]),
                float(row["withheld_percent"]),
            )
            for row in csv.DictReader(file)
        )


def longest_ms(liquid: str, estimator: str, hand: str = "light", withheld_percent: float = WITHHELD_PERCENT) -> float:
    """Return up to which delay [ms] no more than ``withheld_percent`` of the force is withheld; -1 if at none.

    Raises
    ------
    KeyError
        The table has no such liquid, estimator or hand.
    """
    found = sorted(
        (it.delay_ms, it.withheld_percent)
        for it in table()
        if (it.liquid, it.estimator, it.hand) == (liquid, estimator, hand)
    )
    if not found:
        raise KeyError((liquid, estimator, hand))
    longest = -1.0
    for delay_ms, withheld in found:
        if withheld > withheld_percent:
            break
        longest = delay_ms
    return longest
