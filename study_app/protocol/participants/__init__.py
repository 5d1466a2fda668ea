"""Groups of participants, and how simulated participants answer."""

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
    "next_group",
    "sequences_in",
]
