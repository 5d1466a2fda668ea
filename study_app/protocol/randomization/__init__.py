"""Named random streams, and the sequences of codes drawn from them."""

from study_app.protocol.randomization.sequences import enrolment_number, has_even_borders, row_count
from study_app.protocol.randomization.streams import (
    Draw,
    Key,
    draw_secret,
    group_of,
    own_code,
    place_in_group,
    shuffle,
    stream,
)

__all__ = [
    "Draw",
    "Key",
    "draw_secret",
    "enrolment_number",
    "group_of",
    "has_even_borders",
    "own_code",
    "place_in_group",
    "row_count",
    "shuffle",
    "stream",
]
