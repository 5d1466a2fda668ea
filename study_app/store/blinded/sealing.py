"""Texts and files that are encrypted with the secret of a study's key until the study is unblinded.

A sealed text has, in hexadecimal digits, a tag and the JSON of values, encrypted. The tag is the HMAC-SHA256 of owner
and JSON; the JSON is combined with SHAKE-256 of secret and tag by exclusive or. So equal values of two owners look
different, and a changed or moved text is detected (a synthetic initialisation vector as in RFC 5297, with the standard
library's hashes). Spaces make all texts equally long.

A sealed file is encrypted in the same way, piece by piece, after `MARK`, and filled up to a size that does not depend
on its content: of a recording it tells the trial's time to a factor of 2, and journals tell that time anyway.
"""

import hashlib
import hmac
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from study_app.store.files.atomic import parse_json
from study_app.store.journals import journal_events as events

MARK: Final = b"This file is sealed until the study is unblinded: liquid-study unblind RESULTS\n"
_SAMPLE_BYTES: Final = 64
"""Bytes per sample of a sealed recording: more than the samples of any device need."""
_FRAMES_BYTES_PER_S: Final = 6_000
"""Bytes per second for the sealed frames of a recording: enough for more than 240 frames per second."""
_FACTS_BYTES: Final = 16_384  # of a recording without rows
_TAG_BYTES = 16
TASK_BYTES: Final = 4096
"""Bytes of the sealed end of a task: enough for its measures and the times of 300 targets."""
_PIECE_BYTES = 65_536  # encrypted at once
_LENGTH_BYTES = 8


def seal_values(whose: Sequence[object], values: Mapping[str, Any], secret: bytes, block_bytes: int = 1024) -> str:
    """Return values as a sealed text; ``whose`` identifies their owner, and is needed to open it.

    The text is padded to a multiple of ``block_bytes``, so that its length does not depend on the values.
    """
    said = json.dumps(events.plain_json(values), allow_nan=False, separators=(",", ":")).encode()
    said = said.ljust(-(-len(said) // block_bytes) * block_bytes)
    tag = _tag(json.dumps(whose).encode(), said, secret)
    return (tag + _xor_keystream(said, tag, secret)).hex()


def open_text(whose: Sequence[object], text: str, secret: bytes, names: frozenset[str]) -> dict[str, Any] | None:
    """Return the sealed values with these names, or None if the text was changed or has another owner or secret."""
    try:
        content = bytes.fromhex(text)
    except ValueError:
        content = b""
    tag = content[:_TAG_BYTES]
    said = _xor_keystream(content[_TAG_BYTES:], tag, secret)
    return (
        _sealed_columns(said, names)
        if hmac.compare_digest(tag, _tag(json.dumps(whose).encode(), said, secret))
        else None
    )


def samples_bytes(seconds: float, rate_hz: float) -> int:
    """Return the size in bytes of the sealed samples of a recording; it is constant for up to twice the time."""
    return _sealed_bytes(seconds, _SAMPLE_BYTES * rate_hz)


def frames_bytes(seconds: float) -> int:
    """Return the size in bytes of the sealed frames of a recording; it is constant for up to twice the time."""
    return _sealed_bytes(seconds, _FRAMES_BYTES_PER_S)


def recording_bytes(seconds: float, rate_hz: float) -> int:
    """Return the size in bytes of the sealed samples and frames of a recording."""
    return samples_bytes(seconds, rate_hz) + frames_bytes(seconds)


def _sealed_bytes(seconds: float, bytes_per_s: float) -> int:
    return _FACTS_BYTES + round(bytes_per_s * 2.0 ** math.ceil(math.log2(max(seconds, 1.0))))


def seal_file(content: bytes, size: int, secret: bytes) -> bytearray:
    """Return the content of a file sealed into ``size`` bytes, doubled until it fits."""
    while size < _LENGTH_BYTES + len(content):
        size *= 2
    sealed, start = bytearray(len(MARK) + _TAG_BYTES + size), len(MARK) + _TAG_BYTES
    said = memoryview(sealed)[start:]
    said[: _LENGTH_BYTES + len(content)] = len(content).to_bytes(_LENGTH_BYTES) + content
    tag = _tag(MARK, said, secret)
    sealed[:start] = MARK + tag
    _xor_in_place(said, tag, secret)
    return sealed


def open_file(sealed: bytes, secret: bytes) -> bytes | None:
    """Return the content that `seal_file` sealed; None if it was changed or sealed with another secret."""
    start = len(MARK) + _TAG_BYTES
    tag = sealed[len(MARK) : start]
    said = memoryview(bytearray(sealed))[start:]
    _xor_in_place(said, tag, secret)
    if not hmac.compare_digest(tag, _tag(MARK, said, secret)):
        return None
    return bytes(said[_LENGTH_BYTES : _LENGTH_BYTES + int.from_bytes(said[:_LENGTH_BYTES])])


def _sealed_columns(said: bytes, names: frozenset[str]) -> dict[str, Any]:
    """Return the columns of a text with a valid tag, without values that a holder of the key could have forged."""
    try:
        measured = parse_json(said)
    except ValueError:
        return {}
    items = measured.items() if isinstance(measured, dict) else ()
    return {name: value for name, value in items if name in names and events.is_valid_value(name, value)}


def _tag(whose: bytes, said: bytes | memoryview, secret: bytes) -> bytes:
    tag = hmac.new(secret, whose, "sha256")
    tag.update(said)  # releases the lock, so that other threads run
    return tag.digest()[:_TAG_BYTES]


def _xor_in_place(text: memoryview, tag: bytes, secret: bytes) -> None:
    """Encrypt or decrypt a text in place, in pieces, so that other threads can run."""
    for at in range(0, len(text), _PIECE_BYTES):
        text[at : at + _PIECE_BYTES] = _xor_keystream(text[at : at + _PIECE_BYTES], tag + at.to_bytes(8), secret)


def _xor_keystream(text: bytes | memoryview, tag: bytes, secret: bytes) -> bytes:
    stream = hashlib.shake_256(secret + tag).digest(len(text))
    return (int.from_bytes(text) ^ int.from_bytes(stream)).to_bytes(len(text))
