"""Clocks and thread priorities of each operating system."""

from study_app.haptics.runtime.clocks.clock import (
    VIRTUAL,
    Clock,
    SystemClock,
    VirtualClock,
    raise_priority,
    sleep_repeatedly,
)
from study_app.haptics.runtime.clocks.linux import make_high_priority

__all__ = [
    "VIRTUAL",
    "Clock",
    "SystemClock",
    "VirtualClock",
    "make_high_priority",
    "raise_priority",
    "sleep_repeatedly",
]
