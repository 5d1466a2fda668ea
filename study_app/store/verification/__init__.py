"""Verification of sessions and studies."""
