"""Frames of a WebSocket client: RFC 6455's own examples (§5.7), frames cut at every byte, and violations."""

import numpy as np
import pytest

from study_app.devices.inverse3.wire import (
    CLOSE,
    INCOMPLETE,
    PING,
    TEXT,
    VIOLATION,
    build_frame,
    next_key,
    parse_header,
)
from tests.compiled import wraps


def parsed(data: bytes) -> tuple[int, int, int]:
    header = np.zeros(2, np.int64)
    size = parse_header(np.frombuffer(data, np.uint8), 0, len(data), header)
    return size, int(header[0]), int(header[1])


def built(opcode: int, payload: bytes, key: int) -> bytes:
    out = np.zeros(len(payload) + 8, np.uint8)
    return out[: build_frame(out, opcode, np.frombuffer(payload, np.uint8), len(payload), key)].tobytes()


def test_build_frame_gives_the_masked_hello_of_the_rfc() -> None:
    assert built(TEXT, b"Hello", 0x37FA213D) == bytes.fromhex("818537fa213d7f9f4d5158")


@pytest.mark.parametrize("size", [0, 1, 125, 126, 127, 400, 65535])
def test_build_frame_uses_the_shortest_length_and_unmasks_to_the_payload(size: int) -> None:
    payload = bytes(k % 251 for k in range(size))
    frame = built(TEXT, payload, 0xA1B2C3D4)
    head = 2 if size < 126 else 4
    assert frame[1] & 0x80
    assert (frame[1] & 0x7F) == (size if size < 126 else 126)
    key = frame[head : head + 4]
    assert bytes(byte ^ key[k % 4] for k, byte in enumerate(frame[head + 4 :])) == payload


@pytest.mark.parametrize(
    ("frame", "header"),
    [
        (b"\x81\x05Hello", (2, TEXT, 5)),
        (b"\x89\x05Hello", (2, PING, 5)),
        (b"\x88\x00", (2, CLOSE, 0)),
        (b"\x81\x7e\x01\x00", (4, TEXT, 256)),
        (b"\x81\x7f\x00\x00\x00\x00\x00\x01\x00\x00", (10, TEXT, 65536)),
    ],
)
def test_parse_header_reads_permitted_frames_and_waits_for_the_rest(frame: bytes, header: tuple[int, int, int]) -> None:
    assert parsed(frame) == header
    for cut in range(header[0]):
        assert parsed(frame[:cut])[0] == INCOMPLETE


@pytest.mark.parametrize(
    "frame",
    [
        b"\x81\x85\0\0\0\0",  # masked by the server
        b"\x01\x05Hello",  # a fragment
        b"\x80\x05Hello",  # a continuation
        b"\x82\x05Hello",  # binary
        b"\xc1\x05Hello",  # an extension's bit
        b"\x83\x05Hello",  # a reserved opcode
        b"\x89\x7e\x00\x80",  # a long control frame
        b"\x81\x7f\x80\x00\x00\x00\x00\x00\x00\x00",  # longer than any
    ],
)
def test_parse_header_refuses_forbidden_frames(frame: bytes) -> None:
    assert parsed(frame)[0] == VIOLATION


@wraps
def test_next_key_does_not_repeat_soon() -> None:
    state = np.array([12345], np.uint64)
    keys = [next_key(state) for _ in range(10_000)]
    assert len(set(keys)) > 9_990
    assert all(0 <= key < 2**32 for key in keys)
