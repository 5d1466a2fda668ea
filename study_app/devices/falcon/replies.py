"""Which replies of a Falcon count: those that were asked for in the turn before, and that a hand can have made.

A reply cannot be matched to its packet, so replies that are always late look like punctual ones after a loss. When more
than ``MOST_OWED`` are owed, nothing but an end of force is sent for two turns: what still comes then was late, and late
positions are not given; else the owed ones are written off as lost.

There is no check sum, so a byte that was garbled into another that may stand there passes the parser. What a hand does
not do, a leap of an arm away from its motion, therefore needs a second reply that says so; likewise buttons, the end of
the out-stroke and arms no longer homed. All of this works on the exchange's record (``exchange.FALCON``).
"""

from __future__ import annotations

from typing import Any, Final

from study_app.haptics.compiled import kernel

MOST_OWED: Final = 4
TEST_TURNS: Final = 2
RETEST_TURNS: Final = 20
ALL_HOMED: Final = 0b111
BELIEVED: Final = 3
"""So many packets in a row must say that an arm is no longer homed: one may have been garbled."""

LEAP: Final = 24.0
"""Counts by which an arm may miss where its motion would have taken it: 0.7 to 1.4 mm of the grip within a turn."""
DOUBTS: Final = 2  # so many replies in a row may be doubted


@kernel
def settle(falcon: Any, packets: int, gap: bool) -> bool:
    """Keep account of what is owed; return whether what came was asked for in the turn before."""
    owed = falcon.owed + falcon.asked - packets
    falcon.asked = 0
    falcon.surplus += max(-owed, 0)
    falcon.owed = max(owed, 0)
    if gap:
        _write_off(falcon)
        falcon.tracked = 0
        return False
    if falcon.testing > 0:
        if packets == 0 and falcon.testing >= TEST_TURNS:
            _write_off(falcon)
        elif falcon.testing > TEST_TURNS:
            falcon.testing = 0
            falcon.retest = RETEST_TURNS
        else:
            falcon.testing += 1
        return False
    if falcon.owed <= MOST_OWED:
        return True
    if falcon.retest > 0:
        falcon.retest -= 1
    elif packets > 0:  # silence tells nothing about what is on its way
        falcon.testing = 1
    return False


@kernel
def _write_off(falcon: Any) -> None:
    falcon.written_off += falcon.owed
    falcon.owed = 0
    falcon.testing = 0
    falcon.retest = 0


@kernel
def believe(falcon: Any) -> bool:
    """Take buttons and homed arms from the newest packet; return whether its encoders count from their index."""
    status = falcon.status
    if status.homed != ALL_HOMED:
        falcon.unhomed += 1
        falcon.tracked = 0
        falcon.beyond = 0
        if falcon.unhomed >= BELIEVED:
            falcon.homed = 0
            falcon.pulled_out = 0
            falcon.share = 0.0
        return False
    falcon.unhomed = 0
    falcon.homed = 1
    if status.buttons == falcon.seen_buttons:
        falcon.buttons = status.buttons
    falcon.seen_buttons = status.buttons
    return True


@kernel
def trust(falcon: Any) -> bool:
    """Return whether the encoders go on as the arms moved, or say again what was doubted before."""
    counts = falcon.status.encoders
    astray, repeated = False, falcon.doubts > 0
    for i in range(3):
        if abs(counts[i] - falcon.counts[i] - falcon.pace[i] * falcon.apart) > LEAP:
            astray = True
        if abs(counts[i] - falcon.doubted[i]) > LEAP:
            repeated = False
    if falcon.tracked != 0 and astray and not repeated and falcon.doubts < DOUBTS:
        falcon.doubts += 1
        falcon.doubted_at = falcon.apart
        for i in range(3):
            falcon.doubted[i] = counts[i]
        return False
    for i in range(3):
        if falcon.tracked == 0:
            falcon.pace[i] = 0.0
        elif astray and falcon.doubts > 0:
            falcon.pace[i] = (counts[i] - falcon.doubted[i]) / (falcon.apart - falcon.doubted_at)
        else:
            falcon.pace[i] = (counts[i] - falcon.counts[i]) / falcon.apart
        falcon.counts[i] = counts[i]
    falcon.tracked = 1
    falcon.apart = 0
    falcon.doubts = 0
    return True
