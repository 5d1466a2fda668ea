"""Named random streams: every choice of a session has a name, and a draw more in one moves no other.

A stream is a ``random.Random`` seeded by SHA-256 of (seed, name), of which only ``.random()`` is used (the one method
Python promises never to change), under our own Fisher–Yates.
"""

from __future__ import annotations

import hashlib
import random
from collections.abc import Callable, Iterable
from typing import TypeAlias, TypeVar

T = TypeVar("T")

Draw: TypeAlias = Callable[[], float]


def stream(seed: int, name: str) -> random.Random:
    """Return the random stream of that name under that seed; use only its ``.random()``."""
    digest = hashlib.sha256(f"{seed}\n{name}".encode()).digest()
    return random.Random(int.from_bytes(digest, "big"))  # noqa: S311 - reproducible, not secret


def study_stream(study: str, name: str) -> random.Random:
    """Return a stream that is the same in every session of a study, for any seed of the session."""
    return stream(0, f"study/{study}/{name}")


def shuffle(items: Iterable[T], draw: Draw) -> tuple[T, ...]:
    """Return ``items`` in random order (Fisher–Yates, Durstenfeld's form), with len(items) − 1 calls of ``draw``.

    ``draw`` gives uniform numbers in [0, 1), as ``stream(…).random`` does.
    """
    order = list(items)
    for last in range(len(order) - 1, 0, -1):
        chosen = int(draw() * (last + 1))
        order[last], order[chosen] = order[chosen], order[last]
    return tuple(order)
