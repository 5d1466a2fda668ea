"""The evidence about outlets: the data received by another process, and the effect on the servo."""

from study_app.evidence.outlets.localhost import localhost_only
from study_app.evidence.outlets.streams import compare_streams, measure_streams, streams_evidence
from study_app.evidence.outlets.triggers import measure_triggers, triggers_evidence

__all__ = [
    "compare_streams",
    "localhost_only",
    "measure_streams",
    "measure_triggers",
    "streams_evidence",
    "triggers_evidence",
]
