"""The priority that the system granted to the servo's thread, and advice on how to get more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

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


REFUSED = "the system grants no more"
NOT_ASKED = Grant("normal", "no more was requested")
NO_THREAD = Grant("none", "not in a thread of its own")
