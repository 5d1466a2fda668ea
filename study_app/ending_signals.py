"""The signals that ask a program to end, on each system."""

import signal
from typing import Final

_NAMES: Final = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK")
ENDING_SIGNALS: Final = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))
"""Ctrl+C, a request to end, a closed terminal, Ctrl+backslash, and Ctrl+Break on Windows."""
