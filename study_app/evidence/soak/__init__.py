"""The servo for hours or days with every kind of fault: drift, leaks and failures."""

from study_app.evidence.soak.soak import soak_servo

__all__ = ["soak_servo"]
