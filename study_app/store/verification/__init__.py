"""Verification of sessions and studies.

Reading order: leaks, proofs, reproduction, verify_session; recorded_streams, verify_study.
"""
