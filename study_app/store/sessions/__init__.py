"""Session folders from the first claim to the end."""

from study_app.store.recorder import Recorder
from study_app.store.sessions.begin import (
    MAX_SESSION,
    SessionStart,
    UsedIds,
    begin_session,
    check_participant,
    refuse_never_begun,
    used_ids,
)
from study_app.store.sessions.open_session import Place, SessionStore
from study_app.store.sessions.recovery import (
    check_resumable,
    rebuild_session,
    refuse_finished,
    reopen_store,
    sealed_source,
)
from study_app.store.sessions.simulated_sessions import SimulatedStudy

__all__ = [
    "MAX_SESSION",
    "Place",
    "Recorder",
    "SessionStart",
    "SessionStore",
    "SimulatedStudy",
    "UsedIds",
    "begin_session",
    "check_participant",
    "check_resumable",
    "rebuild_session",
    "refuse_finished",
    "refuse_never_begun",
    "reopen_store",
    "sealed_source",
    "used_ids",
]
