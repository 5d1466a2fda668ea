"""Progress while the force model is compiled: the number of compiled functions and the expected total."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from numba.core import event

EXPECTED: Final = 194
"""Approximate number of functions that a first session compiles; a test compares it with a device and its servo."""


class _Counter(event.Listener):
    """Counts compiled functions, including nested compilations."""

    def __init__(self, progress: Callable[[float], object]) -> None:
        self._progress = progress
        self.compiled = 0

    def on_start(self, event: Any) -> None:
        """Do nothing: a function that starts to compile does not count yet."""

    def on_end(self, event: Any) -> None:
        """Count a function, and report the share."""
        self.compiled += 1
        self._progress(min(0.99, self.compiled / EXPECTED))


@contextmanager
def following_compilation(progress: Callable[[float], object]) -> Iterator[_Counter]:
    """Give ``progress`` the share done (0 to 1) after each function that is compiled within the block."""
    counter = _Counter(progress)
    with event.install_listener("numba:compile", counter):
        yield counter
