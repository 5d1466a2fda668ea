"""While a session's frames are due their thread goes before other programs, as far as the system lets it.

A frame that is being painted is older by all that another program computes meanwhile. The servo's own thread goes
before this one all the same.
"""

import ctypes
import os
import sys
import threading
from typing import Final

from study_app.haptics.runtime.clocks.rtkit import make_high_priority

NICE: Final = -10
ABOVE_NORMAL, NORMAL = 1, 0  # of Windows' threads


class ThreadPriority:
    """Puts the thread that calls it before others, and back."""

    def __init__(self) -> None:
        self._before: int | None = None

    def raise_priority(self) -> bool:
        """Let this thread go before those of other programs; return whether the system let it."""
        if sys.platform == "win32":
            return _prefer(ABOVE_NORMAL)
        if sys.platform == "darwin":
            return True  # the thread of windows is interactive there as it is
        thread = threading.get_native_id()
        before = os.getpriority(os.PRIO_PROCESS, thread)
        try:
            os.setpriority(os.PRIO_PROCESS, thread, NICE)
        except PermissionError:
            try:
                make_high_priority(thread, NICE)
            except OSError:
                return False
        self._before = before
        return True

    def restore(self) -> None:
        """Let this thread be one among others again."""
        if sys.platform == "win32":
            _prefer(NORMAL)
        elif sys.platform != "darwin" and self._before is not None:
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), self._before)
            self._before = None


def _prefer(level: int) -> bool:
    """Set the priority of this thread on Windows."""
    windows = getattr(ctypes, "windll", None)
    if windows is None:
        return False
    kernel = windows.kernel32
    kernel.GetCurrentThread.restype = ctypes.c_void_p
    return bool(kernel.SetThreadPriority(ctypes.c_void_p(kernel.GetCurrentThread()), level))
