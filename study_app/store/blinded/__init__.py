"""Blinding: the sealed key, sealed columns, unblinding."""

from study_app.store.blinded.allocation import (
    Claim,
    check_choice,
    check_session,
    claims,
    planned_sessions,
    session_protocol,
    simulated_groups,
)
from study_app.store.blinded.blinding import (
    Codes,
    Key,
    check_conditions,
    complete_protocol,
    open_events,
    opened_key,
    participant_group,
    place_number,
    protocol_errors,
    read_key,
    recorded_protocol,
    revealed_key,
    sealed_hash,
)
from study_app.store.blinded.sealing import recording_bytes

__all__ = [
    "Claim",
    "Codes",
    "Key",
    "check_choice",
    "check_conditions",
    "check_session",
    "claims",
    "complete_protocol",
    "open_events",
    "opened_key",
    "participant_group",
    "place_number",
    "planned_sessions",
    "protocol_errors",
    "read_key",
    "recorded_protocol",
    "recording_bytes",
    "revealed_key",
    "sealed_hash",
    "session_protocol",
    "simulated_groups",
]
