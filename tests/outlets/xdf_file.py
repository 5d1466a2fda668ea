"""A writer of XDF files (version 1.0), as LabRecorder writes them: received samples and clock offsets."""

import struct
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any


def _length(content: bytes) -> bytes:
    return b"\x08" + struct.pack("<Q", len(content))


def _chunk(tag: int, content: bytes) -> bytes:
    return _length(struct.pack("<H", tag) + content) + struct.pack("<H", tag) + content


def _value(value: float | str) -> bytes:
    if isinstance(value, float):
        return struct.pack("<f", value)
    return _length(value.encode()) + value.encode()


def write_xdf(
    path: Path, streams: Iterable[tuple[str, Sequence[tuple[Sequence[Any], float]], Sequence[tuple[float, float]]]]
) -> Path:
    """Write streams: each its description (XML), its samples with their stamps [s], and (time, offset) of its clock."""
    content = b"XDF:" + _chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>")
    for number, (xml, samples, offsets) in enumerate(streams, start=1):
        stream = struct.pack("<I", number)
        rows = [b"\x08" + struct.pack("<d", stamp_s) + b"".join(map(_value, row)) for row, stamp_s in samples]
        content += _chunk(2, stream + xml.encode())
        content += _chunk(3, stream + b"\x08" + struct.pack("<Q", len(rows)) + b"".join(rows))
        for time_s, offset_s in offsets:
            content += _chunk(4, stream + struct.pack("<dd", time_s, offset_s))
        content += _chunk(6, stream + b"<?xml version='1.0'?><info></info>")
    path.write_bytes(content)
    return path
