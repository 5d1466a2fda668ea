import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.devices.falcon import boot
from study_app.devices.falcon.boot import Block, check
from study_app.errors import DeviceError
from tests.devices.falcon.support.firmware_stream import BLOCKS, stream, words


def reason(data):
    with pytest.raises(DeviceError) as caught:
        check(data)
    text = str(caught.value)
    assert text.startswith("the Falcon cannot be used: the file is not a Falcon's firmware (")
    assert "nvent_firmware.bin, 8492 bytes" in text
    assert "\n" not in text
    return text


def test_a_whole_stream_is_told():
    data = stream()
    found = check(data)
    assert found.size == len(data)
    assert found.sha256 == hashlib.sha256(data).hexdigest()
    assert found.entry == 0x3F8002
    assert found.blocks == tuple(Block(place, size) for place, size in BLOCKS)
    assert found.name is None


def test_the_hash_of_the_usual_one_is_that_which_was_published():
    published = "1119e39c39fab1f37678ea62dfc715b23dd86ee7f13d78f88f707d9f09b896a1"
    assert boot.KNOWN[published[:16], published[-8:]] == "nvent_firmware.bin"


@pytest.mark.parametrize("cut", [1, 21, 22, 23, 24, 30, 59, 300, 622, 623, 624, 625, 642])
def test_one_cut_short_says_where(cut):
    data = stream()
    assert len(data) > cut
    text = reason(data[:cut])
    assert "cut short" in text
    if cut < 22:
        assert f"{cut} bytes are less than its header of 22" in text
    elif cut < 24:
        assert "after 0 blocks" in text
    elif cut < 22 + 606:
        assert "in block 1" in text
        assert f"{cut} bytes, of which block 1 needs {22 + 606}" in text
    assert "after 3 blocks" in reason(data[:-1])


@pytest.mark.parametrize("extra", [b"\0", b"\0\0", b"more"])
def test_bytes_behind_the_end_are_counted(extra):
    data = stream()
    assert f"{len(extra)} bytes follow its end mark at byte {len(data) - 2}" in reason(data + extra)


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (b"", "empty"),
        (b"<!DOCTYPE html>\n<html><body>404: Not Found</body></html>", "web page"),
        (b"\n  <HTML><head>", "web page"),
        (b"<?xml version='1.0'?><Error><Code>AccessDenied</Code></Error>", "web page"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:1119\nsize 8492\n", "git lfs pull"),
        (b":10000000AA080000000000000000000000000000AB\n:00000001FF\n", "hex dump"),
        (b"00000000: aa08 0000 0000 0000 0000 0000 0000 0000  ................\n", "hex dump"),
        (b"0xAA, 0x08, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,\n", "hex dump"),
        (b"aa 08 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 3f 00\n", "hex dump"),
        (stream(key=0xAA08), "swapped"),
        (stream(key=0x1234), "0x1234, not 0x08AA"),
        (b"MZ\x90\x00" + bytes(100), "0x5A4D, not 0x08AA"),
        (stream(reserved=(0, 0, 0, 5, 0, 0, 0, 0)), "numbers where zeros belong"),
        (stream(()), "no block"),
    ],
)
def test_what_is_no_firmware_is_called_what_it_is(data, word):
    assert word in reason(data)


@given(st.binary(max_size=300))
def test_no_bytes_make_it_fail_otherwise(data):
    for candidate in (data, stream()[:22] + data, words(0x08AA) + data):
        try:
            assert check(candidate).size == len(candidate)
        except DeviceError:
            continue


@given(st.integers(0, len(stream()) - 1), st.integers(0, 255))
def test_a_wrong_byte_in_the_frame_is_found_and_one_in_the_words_changes_the_hash(at, byte):
    data = bytearray(stream())
    if data[at] == byte:
        return
    data[at] = byte
    try:
        found = check(bytes(data))
    except DeviceError:
        return
    assert found.sha256 != check(stream()).sha256
    assert sum(2 * block.words + 6 for block in found.blocks) == len(data) - 24
