"""Markers: events of the journal for other programs, as text and as a trigger code.

A marker contains only codes and counts from a list of permitted fields: no condition, answer, measure or entered text,
and nothing that the journal seals.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

CODES: Final[Mapping[str, int]] = {
    "session_started": 1,
    "session_resumed": 2,
    "session_ended": 3,
    "trial_started": 10,
    "trial_ended": 11,
    "interval_started": 20,
    "interval_ended": 21,
    "choice": 30,
    "responses": 31,
    "form_answered": 32,
    "force_stopped": 40,
    "force_restored": 41,
    "paused": 42,
    "resumed": 43,
    "broke": 44,
}
"""The trigger code of each event that has one: a byte; 0 is the idle state of a port."""

_UNCODED: Final = frozenset(
    (
        "page_shown",
        "page_left",
        "feedback_shown",
        "stepped",
        "target_reached",
        "form_shown",
        "item_shown",
        "answer_removed",
        "note",
        "repeat",
        "device_reconnected",
    )
)
"""Events that are markers without a trigger code."""

_SAID: Final = ("trial", "attempt", "interval", "block", "phase", "code", "item", "form", "page", "target", "by")
"""The fields of an event that a marker contains; ``code`` is the blinded one, such as L2."""


@dataclass(frozen=True, slots=True)
class Marker:
    """An event for other programs.

    ``time_ns`` is when it happened on the servo's clock, ``t_s`` the same on the session's, which the journal has.
    ``byte`` is its trigger code, None of an event without one.
    """

    event: str
    time_ns: int
    t_s: float
    said: tuple[tuple[str, Any], ...] = ()

    @property
    def byte(self) -> int | None:
        """The trigger code; None of an event without one."""
        return CODES.get(self.event)

    @property
    def text(self) -> str:
        """Return the marker as one line of JSON."""
        line = {"event": self.event, **dict(self.said), "t_s": round(self.t_s, 6)}
        if self.byte is not None:
            line["trigger"] = self.byte
        return json.dumps(line, ensure_ascii=False, separators=(",", ":"))


def marker_of(event: str, t_s: float, origin_ns: int, fields: Mapping[str, Any]) -> Marker | None:
    """Return the marker of an event of the journal, None if the event has no marker.

    Parameters
    ----------
    t_s : float
        When it happened on the session's clock [s].
    origin_ns : int
        The servo's clock at the origin of the session's [ns].
    fields : mapping
        The other fields of the journal's line.
    """
    if event not in CODES and event not in _UNCODED:
        return None
    said = tuple((name, fields[name]) for name in _SAID if fields.get(name) is not None)
    return Marker(event, origin_ns + round(t_s * 1e9), t_s, said)
