"""The session that a seed gives before any is run: its steps, and what its codes stand for, drawn as for a rehearsal.

No sealed key is read: the codes are drawn from the seed, so that a preview reveals nothing of a study that is run.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from study_app.protocol.model import Protocol
from study_app.protocol.orders.durations import own_protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule, draw_key, stream
from study_app.protocol.streams import draw_secret, group_of

PARTICIPANT: Final = "P001"
SEED: Final = 1
"""The participant and the seed of a preview, unless others are asked for."""


@dataclass(frozen=True, slots=True)
class Preview:
    """One session of a study.

    Attributes
    ----------
    protocol : Protocol
        The session's protocol: in a study with groups, with the steps of the participant's group.
    schedule : Schedule
        Its steps in order.
    codes : mapping
        Block → code → condition or track.
    secret : bytes
        What levels are drawn from.
    """

    protocol: Protocol = field(repr=False)
    schedule: Schedule
    codes: Mapping[str, Mapping[str, str]] = field(repr=False)
    secret: bytes = field(repr=False)


def preview(study: Protocol, seed: int = SEED, participant: str = PARTICIPANT) -> Preview:
    """Return the first session of the first participant of a folder that begins with this seed.

    Parameters
    ----------
    study : Protocol
        The study.
    seed : int
        What all randomness of the session comes from, the codes too.
    participant : str
        The participant's id, whose number determines the row of a square.
    """
    draw = stream(seed, "blinding").random
    secret = draw_secret(draw)
    codes = draw_key(study, draw)
    shares = {name: group.share for name, group in study.groups.items()}
    own = own_protocol(study, group_of(shares, secret, 1) if shares else None, 1)
    return Preview(own, build_schedule(own, participant, seed), codes, secret)
