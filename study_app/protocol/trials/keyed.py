"""Random streams that only the sealed key can repeat: what they draw would reveal what an interval presented.

The key's nonce is the secret. A stream is seeded by HMAC-SHA256 under a sub-key of the secret, so that neither seed nor
protocol tells its numbers (RFC 2104).
"""

from __future__ import annotations

import hmac
import random
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from study_app.protocol.streams import Draw


@dataclass(frozen=True, slots=True, repr=False)
class Key:
    """The opened key of a study; never printed.

    Attributes
    ----------
    codes : mapping
        Block → code → what the code stands for: a condition, or a track such as "8/1".
    secret : bytes
        The nonce, from which sub-keys are derived.
    """

    codes: Mapping[str, Mapping[str, str]]
    secret: bytes


SECRET_BYTES: Final = 32


def draw_secret(draw: Draw) -> bytes:
    """Return a secret drawn with ``draw`` (uniform numbers in [0, 1)); a rehearsal's comes from its seed."""
    return bytes(int(draw() * 256) for _ in range(SECRET_BYTES))


def sub_key(secret: bytes, name: str) -> bytes:
    """Return the sub-key of that name (32 bytes)."""
    return hmac.digest(secret, name.encode(), "sha256")


def keyed_stream(secret: bytes, name: str) -> random.Random:
    """Return the stream of that name; use only its ``.random()``."""
    return random.Random(int.from_bytes(sub_key(sub_key(secret, "levels"), name), "big"))  # noqa: S311 - seeded by a MAC
