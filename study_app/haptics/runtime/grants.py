"""What the system grants to a program that exerts force: a priority, and no suspension by a terminal.

Loads no compiler.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

Level: TypeAlias = Literal["real-time", "raised", "normal", "none"]
Blocks: TypeAlias = Sequence[tuple[int, int]]
"""Memory: (address, bytes) each."""


@dataclass(frozen=True, slots=True)
class Grant:
    """The priority of a thread.

    ``level`` is its priority class ("none": there is no thread), ``how`` the system's name for it; ``locked`` tells
    whether the servo's memory cannot be swapped out, None if that was not requested; ``advice`` says how to get what
    was refused, empty if nothing was.
    """

    level: Level
    how: str = ""
    locked: bool | None = None
    advice: tuple[str, ...] = ()

    @property
    def priority(self) -> str:
        """The priority class in words: "real-time (SCHED_FIFO 60)"."""
        if self.level == "none":
            return f"none: {self.how}"
        return f"{self.level} ({self.how})" if self.how else self.level

    def with_memory(self, *, locked: bool, advice: str) -> Grant:
        """Return a copy with memory locked or not; ``advice`` says how to lock it, if there is no other advice."""
        return replace(self, locked=locked, advice=self.advice if locked or self.advice else (advice,))

    def __str__(self) -> str:
        memory = {None: "", True: ", memory locked", False: ", memory not locked"}[self.locked]
        return "; ".join((f"{self.priority}{memory}", *self.advice))


REFUSED = "the system does not grant a higher priority"
NOT_ASKED = Grant("normal", "a higher priority was not requested")
NO_THREAD = Grant("none", "not in a separate thread")


SUSPENDING: Final = ("SIGTSTP", "SIGTTIN", "SIGTTOU")
"""Signals by which a terminal stops programs: Ctrl-Z, and access to the terminal from the background."""

_pushing: set[int] = set()
_refused: set[int] = set()


def refuse_suspension(by: object) -> None:
    """Ignore the terminal's stop signals until `allow_suspension` is called for all callers of this function.

    Handlers already set stay. Only the main thread can do so; from any other thread nothing changes.
    """
    _pushing.add(id(by))
    _update_handlers()


def allow_suspension(by: object) -> None:
    """End the refusal for ``by``; a second call does nothing."""
    _pushing.discard(id(by))
    _update_handlers()


def _update_handlers() -> None:
    if threading.current_thread() is not threading.main_thread():
        return
    for name in SUSPENDING:
        number = getattr(signal, name, None)  # of POSIX
        if number is None:
            continue
        if _pushing and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.SIG_IGN)
            _refused.add(number)
        elif not _pushing and number in _refused:
            _refused.discard(number)
            if signal.getsignal(number) is signal.SIG_IGN:
                signal.signal(number, signal.SIG_DFL)
