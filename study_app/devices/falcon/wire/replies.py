"""The delay of a Falcon's replies, and which of them are accepted: recent ones that are plausible for a hand.

A reply cannot be matched to its packet, so replies with a constant delay look like punctual ones after a loss. So the
delay is measured: when for ``SLOWER_READS`` reads more replies are owed than the delay explains, or for
``FASTER_READS`` fewer, no packet is sent until a read has no reply; the number of these reads is the delay. Replies
still owed then are lost. A longer delay is adopted at once, a shorter one after two measurements in a row, since a lost
reply looks like a shorter one. If the force changes too fast for a measurement, the delay is set to explain the owed
replies. Positions later than ``MOST_DELAY`` are not used, nor those read while more than ``MOST_OWED`` replies are owed
beyond the delay.

There is no checksum, so a byte corrupted into a permitted one passes the parser. An implausible jump of an arm
therefore needs a second reply that confirms it; likewise buttons, the end of the out-stroke and arms no longer homed.
The functions work on the exchange's record (``exchange.FALCON``).
"""

from typing import Any, Final

from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.device_dynamics import MOST_DELAY

MOST_OWED: Final = 4
SLOWER_READS: Final = 8
FASTER_READS: Final = 200
GIVEN_UP_READS: Final = 32
RETEST_TICKS: Final = 30
"""For at least this many ticks after a measurement the motors receive a new command in every tick."""
ALL_HOMED: Final = 0b111
BELIEVED: Final = 3
"""Number of packets in a row that must report that an arm is no longer homed: a single one may be corrupted."""

LEAP: Final = 24.0
"""Greatest deviation of an arm from its predicted motion [counts]: 0.7 to 1.4 mm of the grip within a tick."""
DOUBTS: Final = 2  # greatest number of doubted replies in a row


@kernel
def settle(falcon: Any, packets: int, gap: bool) -> bool:
    """Update the owed replies and the delay; return whether the received reply is recent enough."""
    owed = falcon.owed + falcon.asked - packets
    falcon.asked = 0
    falcon.surplus += max(-owed, 0)
    falcon.owed = max(owed, 0)
    falcon.retest = max(falcon.retest - 1, 0)
    if owed < 0:
        falcon.unsure = 1
    if gap:
        falcon.testing = 0
        _write_off(falcon)
        falcon.tracked = 0
        return False
    if falcon.testing > 0:
        _measure_delay(falcon, packets)
    elif packets > 0:  # no reply gives no information about pending ones
        _look_for_change(falcon)
    return bool(falcon.delay <= MOST_DELAY and _few_owed(falcon))


@kernel
def _look_for_change(falcon: Any) -> None:
    """Begin a measurement if more, or for a long time fewer, replies are owed than the delay explains."""
    more, less = falcon.owed > falcon.delay - 1, falcon.owed < falcon.delay - 1
    falcon.astray = falcon.astray + 1 if more or less else max(falcon.astray - 1, 0)
    due = falcon.unsure != 0 or falcon.delay > MOST_DELAY or falcon.astray >= (SLOWER_READS if more else FASTER_READS)
    if (due and falcon.retest == 0) or (not _few_owed(falcon) and falcon.delay <= MOST_DELAY):
        falcon.testing = 1
    if more and falcon.astray >= GIVEN_UP_READS:  # the force changes too much for a measurement
        _believe_delay(falcon, falcon.owed + 1)


@kernel
def _few_owed(falcon: Any) -> bool:
    """Return whether few enough replies are owed beyond the delay that any received one is recent."""
    return bool(falcon.owed < falcon.delay + MOST_OWED)


@kernel
def _measure_delay(falcon: Any, packets: int) -> None:
    """Wait for a read without a reply: then no reply to an earlier packet is pending."""
    found = falcon.testing
    if packets > 0 and found <= MOST_DELAY:
        falcon.testing += 1
        return
    falcon.testing = 0
    if packets == 0:
        _write_off(falcon)
    if found >= falcon.delay or found == falcon.measured:
        _believe_delay(falcon, found)
    else:  # a reply lost may look like that: once more
        falcon.measured = found
        falcon.unsure = 1
        falcon.retest = MOST_DELAY


@kernel
def give_up_measurement(falcon: Any) -> None:
    """Cancel the measurement and send for some ticks; adopt the delay as far as measured."""
    falcon.delay = max(falcon.delay, falcon.testing)
    falcon.testing = 0
    falcon.retest = MOST_DELAY


@kernel
def _believe_delay(falcon: Any, found: int) -> None:
    falcon.delay = found
    falcon.measured = 0
    falcon.unsure = 0
    falcon.astray = 0
    falcon.retest = RETEST_TICKS


@kernel
def _write_off(falcon: Any) -> None:
    falcon.written_off += falcon.owed
    falcon.owed = 0


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
    """Return whether the encoder counts continue the arms' motion, or confirm counts doubted before."""
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
