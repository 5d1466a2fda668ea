"""Homing: the grip is moved out, in, and out again, with instructions, and the reason if it does not complete.

Arms find their index on the way in; before that the encoder counts have no known origin, so no force is sent. The
following out-stroke confirms the positions, and that the hand is at the required place when the force fades in.
"""

from collections.abc import Callable
from typing import Any, Final

from study_app.devices.falcon.failures import OPEN, Facts, FalconFailure, sentence
from study_app.devices.falcon.wire.replies import ALL_HOMED

PATIENCE_S: Final = 120.0
ADVICES: Final = 6  # number of advice lines in that time
MOVED: Final = 60  # counts of an arm that show motion of the grip: two degrees

STROKES: Final = "Homing (red light): pull the grip of the Falcon all the way out, then push it all the way in."
PULL_OUT: Final = "Homed (blue light): now pull the grip all the way out once more."
READY: Final = "The Falcon is ready (green light)."

_SEEN: Final = {
    "silent": Facts(usb=OPEN, replies=False),
    "limp": Facts(usb=OPEN, replies=True, homed=0, moved=False),
    "not-pushed-in": Facts(usb=OPEN, replies=True, homed=0, moved=True),
    "not-pulled-out": Facts(usb=OPEN, replies=True, homed=ALL_HOMED, moved=True, pulled_out=False),
}


class NotHomed(FalconFailure):
    """Homing did not complete; ``kind`` is the key of the observation."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        super().__init__(f"the Falcon was not homed: {sentence(_SEEN[kind])}", _SEEN[kind])


def home(
    falcon: Any,
    tick: Callable[[], None],
    now_s: Callable[[], float],
    progress: Callable[[str], object],
    *,
    patience_s: float = PATIENCE_S,
) -> None:
    """Run the exchange, without force, until all arms are homed and the grip was pulled out.

    Parameters
    ----------
    falcon : record of ``exchange.FALCON``
    tick : runs one tick of it, and waits a millisecond now_s : the time [s] progress : is given what to do, a line at a
    time
    """
    began_s = now_s()
    advised_s = began_s
    lowest, highest = [0] * 3, [0] * 3
    announced = False
    progress(STROKES)
    while not falcon.pulled_out:
        tick()
        _follow(falcon, lowest, highest)
        if falcon.homed and not announced:
            announced = True
            progress(PULL_OUT)
        kind = _trouble(falcon, lowest, highest)
        if now_s() - began_s > patience_s:
            raise NotHomed(kind)
        if now_s() - advised_s > patience_s / ADVICES:
            advised_s = now_s()
            progress(f"Still homing: {sentence(_SEEN[kind])}.")
    progress(READY)


def _follow(falcon: Any, lowest: list[int], highest: list[int]) -> None:
    counts = [int(count) for count in falcon.status.encoders]
    if falcon.status.count <= 1:
        lowest[:], highest[:] = counts, counts
    elif falcon.status.homed != ALL_HOMED:  # the origin jumps when an arm is homed: that is not motion
        lowest[:] = map(min, lowest, counts)
        highest[:] = map(max, highest, counts)


def _trouble(falcon: Any, lowest: list[int], highest: list[int]) -> str:
    """Return the reason why it is not homed, as far as it is known."""
    if falcon.status.count == 0:
        return "silent"
    if falcon.homed:
        return "not-pulled-out"
    moved = max(high - low for low, high in zip(lowest, highest, strict=True))
    return "not-pushed-in" if moved > MOVED else "limp"
