"""Verification of sessions and studies.

Reading order: leaks, reproduction, time_stamps, verify_session; proofs, recorded_streams; verify_study.
"""
