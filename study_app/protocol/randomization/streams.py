"""Named random streams: each random choice of a session has a stream, so that further draws do not change others.

A stream is a ``random.Random`` seeded by SHA-256 of (seed, name), of which only ``.random()`` is used (the one method
that Python promises never to change), with our own Fisher–Yates shuffle.

Draws that would reveal the content of an interval come from streams that only the sealed key can reproduce. They are
seeded by HMAC-SHA256 under a sub-key of the key's nonce, so that seed and protocol do not determine them (RFC 2104).

**Groups** are allocated in permuted blocks. The participant with entry k of a folder has the group at position k of the
permuted blocks. A permuted block contains every group as often as its share states, shuffled by a stream of the secret.
So the sizes of groups with share 1 never differ by more than one participant, and without the secret the next
allocation cannot be predicted. An entry's position in its group counts the entries of that group from 1; it assigns
rows of squares.
"""

from __future__ import annotations

import hashlib
import hmac
import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias, TypeVar

_T = TypeVar("_T")

Draw: TypeAlias = Callable[[], float]


def stream(seed: int, name: str) -> random.Random:
    """Return the random stream with a name under a seed; use only its ``.random()``."""
    digest = hashlib.sha256(f"{seed}\n{name}".encode()).digest()
    return random.Random(int.from_bytes(digest, "big"))  # noqa: S311 - reproducible, not secret


def study_stream(study: str, name: str) -> random.Random:
    """Return a stream that is the same in every session of a study, regardless of the session's seed."""
    return stream(0, f"study/{study}/{name}")


def shuffle(items: Iterable[_T], draw: Draw) -> tuple[_T, ...]:
    """Return ``items`` in random order (Fisher–Yates, Durstenfeld's variant), with len(items) − 1 calls of ``draw``.

    ``draw`` returns uniform numbers in [0, 1), as ``stream(…).random`` does.
    """
    order = list(items)
    for last in range(len(order) - 1, 0, -1):
        chosen = int(draw() * (last + 1))
        order[last], order[chosen] = order[chosen], order[last]
    return tuple(order)


@dataclass(frozen=True, slots=True, repr=False)
class Key:
    """The opened key of a study; never printed.

    ``codes`` maps block → code → condition, or track such as "8/1". Sub-keys are derived from ``secret``, the nonce.
    """

    codes: Mapping[str, Mapping[str, str]]
    secret: bytes


_SECRET_BYTES: Final = 32


def draw_secret(draw: Draw) -> bytes:
    """Return a secret drawn with ``draw`` (uniform numbers in [0, 1)); a rehearsal draws it from its seed."""
    return bytes(int(draw() * 256) for _ in range(_SECRET_BYTES))


def _sub_key(secret: bytes, name: str) -> bytes:
    """Return the sub-key with a name (32 bytes)."""
    return hmac.digest(secret, name.encode(), "sha256")


def secret_stream(secret: bytes, name: str) -> random.Random:
    """Return the secret stream with a name; use only its ``.random()``."""
    return random.Random(int.from_bytes(_sub_key(_sub_key(secret, "levels"), name), "big"))  # noqa: S311 - seeded by a MAC


def own_code(codes: Sequence[str], secret: bytes, participant: str, block: str, code: str) -> str:
    """Return the code that replaces ``code`` for this participant; ``codes`` are all codes of the block."""
    ordered = sorted(codes)
    shuffled = shuffle(ordered, secret_stream(secret, f"codes/{participant}/{block}").random)
    return shuffled[ordered.index(code)]


def group_of(shares: Mapping[str, int], secret: bytes, entry: int) -> str:
    """Return the group of participant number ``entry`` (from 1) in the folder.

    ``shares`` are the counts of each group in a permuted block, in any order; ``secret`` is the nonce of the sealed
    key.
    """
    return place_in_group(shares, secret, entry)[0]


def place_in_group(shares: Mapping[str, int], secret: bytes, entry: int) -> tuple[str, int]:
    """Return the group of participant number ``entry``, like `group_of`, and the position in it, from 1."""
    groups = [name for name in sorted(shares) for _ in range(shares[name])]
    block, position = divmod(entry - 1, len(groups))
    shuffled = shuffle(groups, secret_stream(secret, f"groups/{block + 1}").random)
    return shuffled[position], block * shares[shuffled[position]] + shuffled[: position + 1].count(shuffled[position])
