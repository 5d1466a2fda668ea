"""Verification of sessions and studies.

Reading order: leaks, reproduction, time_stamps, verify_session; proofs, recorded_streams; whole_study.
"""

from study_app.store.verification.leaks import Telltales
from study_app.store.verification.proofs import proof_text, write_proof
from study_app.store.verification.recorded_streams import check_recording
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.verify_session import Discrepancy, session_discrepancies
from study_app.store.verification.whole_study import verify_study

__all__ = [
    "Discrepancy",
    "Telltales",
    "check_recording",
    "proof_text",
    "reproduce_session",
    "session_discrepancies",
    "verify_study",
    "write_proof",
]
