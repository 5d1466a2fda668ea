"""Where a crash of the interpreter or of a library in C leaves its trace: a file in the session's folder."""

import contextlib
import faulthandler
import sys
from io import FileIO
from pathlib import Path


class CrashTrace:
    """Let `faulthandler` write to ``path`` until `close`; a file that stayed empty is removed then.

    The trace holds names of source files and functions and line numbers, no values. A session runs without it where
    the file cannot be opened. A resumed session adds to the file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._enabled_before = faulthandler.is_enabled()
        self._file: FileIO | None = None
        with contextlib.suppress(OSError):
            self._file = path.open("ab", buffering=0)
            faulthandler.enable(self._file)

    def close(self) -> None:
        """Write to the terminal again, if that was so before; it can be called again."""
        file, self._file = self._file, None
        if file is None:
            return
        faulthandler.disable()
        if self._enabled_before and sys.__stderr__ is not None:
            faulthandler.enable(sys.__stderr__)
        file.close()
        with contextlib.suppress(OSError):
            if self._path.stat().st_size == 0:
                self._path.unlink()
