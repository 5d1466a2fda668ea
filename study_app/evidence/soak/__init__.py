"""Soak tests: the servo runs for hours or days with all kinds of faults, to find drift, leaks and failures."""

from study_app.evidence.soak.soak import soak_servo

__all__ = ["soak_servo"]
