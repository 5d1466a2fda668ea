"""Texts and files that are encrypted with the secret of a study's key until the study is unblinded.

A sealed text consists of a tag and the encrypted JSON of the values, in hexadecimal digits. The tag is the HMAC-SHA256
of owner and JSON; the JSON is encrypted by XOR with SHAKE-256 of secret and tag. Equal values of two owners therefore
look different, and a changed or moved text is detected (a synthetic initialisation vector as in RFC 5297, with the
standard library's hashes). The JSON is padded with spaces, so that all texts have the same length.

A sealed file begins with `MARK` and is encrypted in the same way, in chunks. It is padded to a size that does not
depend on its content. The size of a recording reveals the trial's duration to within a factor of 2, but the journal
contains that duration anyway.
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
_METADATA_BYTES: Final = 16_384  # of a recording without rows
_TAG_BYTES = 16
TASK_BYTES: Final = 4096
"""Bytes of the sealed end of a task: enough for its measures and the times of 300 targets."""
_CHUNK_BYTES = 65_536  # encrypted at once
_LENGTH_BYTES = 8


def seal_values(owner: Sequence[object], values: Mapping[str, Any], secret: bytes, block_bytes: int = 1024) -> str:
    """Return values as a sealed text; ``owner`` identifies their owner, and is needed to open it.

    The text is padded to a multiple of ``block_bytes``, so that its length does not depend on the values.
    """
    plaintext = json.dumps(events.plain_json(values), allow_nan=False, separators=(",", ":")).encode()
    plaintext = plaintext.ljust(-(-len(plaintext) // block_bytes) * block_bytes)
    tag = _tag(json.dumps(owner).encode(), plaintext, secret)
    return (tag + _xor_keystream(plaintext, tag, secret)).hex()


def open_text(owner: Sequence[object], text: str, secret: bytes, names: frozenset[str]) -> dict[str, Any] | None:
    """Return the sealed values with these names, or None if the text was changed or has another owner or secret."""
    try:
        content = bytes.fromhex(text)
    except ValueError:
        content = b""
    tag = content[:_TAG_BYTES]
    plaintext = _xor_keystream(content[_TAG_BYTES:], tag, secret)
    return (
        _sealed_columns(plaintext, names)
        if hmac.compare_digest(tag, _tag(json.dumps(owner).encode(), plaintext, secret))
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
    return _METADATA_BYTES + round(bytes_per_s * 2.0 ** math.ceil(math.log2(max(seconds, 1.0))))


def seal_file(content: bytes, size: int, secret: bytes) -> bytearray:
    """Return the content of a file sealed into ``size`` bytes, doubled until it fits."""
    while size < _LENGTH_BYTES + len(content):
        size *= 2
    sealed, start = bytearray(len(MARK) + _TAG_BYTES + size), len(MARK) + _TAG_BYTES
    plaintext = memoryview(sealed)[start:]
    plaintext[: _LENGTH_BYTES + len(content)] = len(content).to_bytes(_LENGTH_BYTES) + content
    tag = _tag(MARK, plaintext, secret)
    sealed[:start] = MARK + tag
    _xor_in_place(plaintext, tag, secret)
    return sealed


def open_file(sealed: bytes, secret: bytes) -> bytes | None:
    """Return the content that `seal_file` sealed; None if it was changed or sealed with another secret."""
    start = len(MARK) + _TAG_BYTES
    tag = sealed[len(MARK) : start]
    plaintext = memoryview(bytearray(sealed))[start:]
    _xor_in_place(plaintext, tag, secret)
    if not hmac.compare_digest(tag, _tag(MARK, plaintext, secret)):
        return None
    return bytes(plaintext[_LENGTH_BYTES : _LENGTH_BYTES + int.from_bytes(plaintext[:_LENGTH_BYTES])])


def _sealed_columns(plaintext: bytes, names: frozenset[str]) -> dict[str, Any]:
    """Return the columns of a text with a valid tag; drop invalid values, which a holder of the key could forge."""
    try:
        content = parse_json(plaintext)
    except ValueError:
        return {}
    items = content.items() if isinstance(content, dict) else ()
    return {name: value for name, value in items if name in names and events.is_valid_value(name, value)}


def _tag(owner: bytes, plaintext: bytes | memoryview, secret: bytes) -> bytes:
    tag = hmac.new(secret, owner, "sha256")
    tag.update(plaintext)  # releases the lock, so that other threads run
    return tag.digest()[:_TAG_BYTES]


def _xor_in_place(data: memoryview, tag: bytes, secret: bytes) -> None:
    """Encrypt or decrypt ``data`` in place, in chunks, so that other threads can run."""
    for start in range(0, len(data), _CHUNK_BYTES):
        chunk = data[start : start + _CHUNK_BYTES]
        data[start : start + _CHUNK_BYTES] = _xor_keystream(chunk, tag + start.to_bytes(8), secret)


def _xor_keystream(data: bytes | memoryview, tag: bytes, secret: bytes) -> bytes:
    keystream = hashlib.shake_256(secret + tag).digest(len(data))
    return (int.from_bytes(data) ^ int.from_bytes(keystream)).to_bytes(len(data))
