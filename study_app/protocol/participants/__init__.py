"""Groups of participants, how simulated participants answer, and how many a test of equivalence requires."""

from study_app.protocol.participants.groups import ASSIGNMENT, EACH_GROUP, RecordedSessions, next_group, sequences_in
from study_app.protocol.participants.raters import (
    CONSISTENT,
    LAPSE_POINTS,
    NOISY,
    REHEARSED,
    STATED,
    SimulatedParticipants,
    compared_kinds,
)
from study_app.protocol.participants.sample_sizes import fewest_participants, smallest_minority

__all__ = [
    "ASSIGNMENT",
    "CONSISTENT",
    "EACH_GROUP",
    "LAPSE_POINTS",
    "NOISY",
    "REHEARSED",
    "STATED",
    "RecordedSessions",
    "SimulatedParticipants",
    "compared_kinds",
    "fewest_participants",
    "next_group",
    "sequences_in",
    "smallest_minority",
]
