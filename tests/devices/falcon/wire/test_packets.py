import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.devices.falcon.constants import FLAG_BLUE, FLAG_HOMING, MOST_TORQUE, PACKET, quiet_packet
from study_app.devices.falcon.replies import PARSER, STATUS, feed, number, pack, put_number, strip
from study_app.haptics.model.layout import records

# What a packet is, said once more and otherwise: the parser must find what this finds.
VALID = re.compile(rb"<[\x41-\x50]{12}[\x41-\xc0][\x00-\xff]>", re.DOTALL)


def packed_samples(*torques, flags=0):
    out = np.zeros(PACKET, np.uint8)
    pack(np.array(torques, np.int64), flags, out)
    return bytes(out)


def reply(encoders=(0, 0, 0), buttons=0, homed=0, unknown=0x41):
    """Return the reply of a Falcon, built byte by byte."""
    numbers = b"".join(bytes(0x41 + int(digit, 16) for digit in f"{n & 0xFFFF:04x}"[::-1]) for n in encoders)
    return b"<" + numbers + bytes([0x41 + buttons + (homed << 4), unknown]) + b">"


class Stream:
    """A parser and its last result."""

    def __init__(self):
        self._parser, self._status = records(PARSER, 1), records(STATUS, 1)
        self.parser, self.status = self._parser[0], self._status[0]

    def feed(self, data):
        return feed(self.parser, np.frombuffer(bytearray(data), np.uint8), len(data), self.status)

    @property
    def encoders(self):
        return [int(n) for n in self.status.encoders]


def test_every_number_of_16_bits_comes_back():
    out = np.zeros(6, np.uint8)
    for value in range(-(1 << 15), 1 << 15):
        put_number(out, 1, value)
        assert number(out, 1) == value
    assert out[0] == out[5] == 0


def test_packets_hold_nibbles_from_a_on_the_least_significant_first_in_the_order_of_the_arms():
    assert packed_samples(1, -1, 0x321) == b"<BAAAPPPPBCDAAA>"
    for flags in (0, FLAG_HOMING | FLAG_BLUE):
        assert packed_samples(0, 0, 0, flags=flags) == quiet_packet(flags)
    assert quiet_packet(FLAG_HOMING | FLAG_BLUE) == b"<AAAAAAAAAAAAFA>"


@given(st.lists(st.integers(-(10**12), 10**12), min_size=3, max_size=3))
def test_no_torque_beyond_the_most_is_ever_packed_nor_one_of_the_other_sign(torques):
    packet = np.frombuffer(packed_samples(*torques), np.uint8)
    for arm, torque in enumerate(torques):
        assert number(packet, 1 + 4 * arm) == max(-MOST_TORQUE, min(MOST_TORQUE, torque))


@pytest.mark.parametrize("length", [0, 1, 2, 3, 18, 63, 64, 65, 66, 67, 128, 150, 512])
def test_two_status_bytes_go_at_the_begin_of_every_64(length):
    data = np.arange(length, dtype=np.int64).astype(np.uint8)
    expected = b"".join(bytes(data[k + 2 : k + 64]) for k in range(0, length, 64))
    out = np.zeros(length, np.uint8)
    kept = strip(data, length, out)
    assert bytes(out[:kept]) == expected
    kept = strip(data, length, data)
    assert bytes(data[:kept]) == expected


@pytest.mark.slow
@given(
    st.lists(
        st.sampled_from([b"<", b">", b"A", b"P", b"Q", b"\xc0", b"\x00", reply((1, 2, 3)), reply(unknown=0x3C)])
        | st.builds(lambda at: reply(homed=7)[:at], st.integers(0, 15))
        | st.builds(lambda at: reply(homed=7)[at:], st.integers(0, 15)),
        max_size=40,
    ),
    st.lists(st.integers(0, 40), max_size=40),
)
def test_packets_are_those_that_a_search_from_left_to_right_finds_however_the_stream_is_cut(parts, cuts):
    data = b"".join(parts)
    stream = Stream()
    packet_count, at = 0, 0
    for cut in [*cuts, len(data)]:
        packet_count += stream.feed(data[at : at + cut])
        at = min(at + cut, len(data))
    matches = VALID.findall(data)
    assert packet_count == stream.parser.packets == stream.status.count == len(matches)
    if matches:
        assert stream.encoders == [number(np.frombuffer(matches[-1], np.uint8), at) for at in (1, 5, 9)]
    assert stream.parser.skipped + stream.parser.held + PACKET * packet_count == len(data)
