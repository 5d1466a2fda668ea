"""The description of a protocol as text, and the differences between two protocols."""

from study_app.protocol.descriptions.protocol_differences import CONDITIONS_DIFFER, differences, document_differences
from study_app.protocol.descriptions.protocol_text import (
    describe,
    describe_scenes,
    limit_label,
    limit_rows,
    number_range,
    shows_feedback,
    trials_text,
)

__all__ = [
    "CONDITIONS_DIFFER",
    "describe",
    "describe_scenes",
    "differences",
    "document_differences",
    "limit_label",
    "limit_rows",
    "number_range",
    "shows_feedback",
    "trials_text",
]
