"""Velocity estimators, compiled."""
