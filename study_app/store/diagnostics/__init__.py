"""The program's log, and the zip file for support."""

from study_app.store.diagnostics.program_log import DEVICE_FAILED, start_log
from study_app.store.diagnostics.support import NAME, write_support

__all__ = ["DEVICE_FAILED", "NAME", "start_log", "write_support"]
