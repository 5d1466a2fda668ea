"""The check of the Falcon's firmware file, and the boot after power-up.

The firmware is not part of this software; the owner of a Falcon has it. Its file is checked before any of it is sent.
It consists of little-endian words: the key 0x08AA, eight zeros, the entry point, then blocks of (count, destination,
words) and a count of 0. Addresses are two words, the high one first (TI SPRUI33, boot data stream of 8 bits).

The steps of the boot are a ping, setting the speed, the upload with its echo, and a first reply. Each step reads its
answer as a stream, independent of the bridge's packets. A step that fails ends the attempt. The next attempt begins by
reopening the bridge, which helps according to owners of a Falcon.
"""

import hashlib
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any, Final

import numpy as np

from study_app.devices.doctor import DeviceFailure
from study_app.devices.falcon import constants
from study_app.devices.falcon.constants import BOOT_KEY
from study_app.devices.falcon.failures import FAILURES, UsbFailure
from study_app.devices.falcon.replies import PARSER, STATUS, feed, strip
from study_app.devices.falcon.transport import Transport
from study_app.haptics.model.layout import records

_RESERVED_WORDS: Final = 8
_HEADER_BYTES: Final = 2 * (1 + _RESERVED_WORDS + 2)
_BLOCK_HEAD: Final = struct.Struct("<HHH")

KNOWN: Final = {
    ("1119e39c39fab1f3", "09b896a1"): "nvent_firmware.bin",
    ("b2700d5cd5ca217e", "84856c6a"): "test_firmware.bin",
    ("ae838730af34b582", "27ea64a4"): "novint_T0.bin",
    ("e0ae3598670fa1c8", "7ff4e816"): "novint_T2.bin",
}
"""Names of known firmware by the first 16 and last 8 digits of its SHA-256."""

_HEX_DUMP: Final = re.compile(rb"[0-9A-Fa-f\s:|.,x]{32,}")


@dataclass(frozen=True, slots=True)
class Block:
    """A block of ``words`` 16-bit words for the address ``destination``."""

    destination: int
    words: int


@dataclass(frozen=True, slots=True)
class Firmware:
    """The content of a firmware file: size [bytes], hash, entry point and blocks.

    ``name`` is the name of a known file, None for others.
    """

    size: int
    sha256: str
    entry: int
    blocks: tuple[Block, ...]
    name: str | None


def check_firmware(data: bytes) -> Firmware:
    """Check and parse the firmware in ``data``."""
    _refuse_other_files(data)
    _refuse_wrong_header(data)
    high, low = struct.unpack_from("<HH", data, _HEADER_BYTES - 4)
    digest = hashlib.sha256(data).hexdigest()
    name = KNOWN.get((digest[:16], digest[-8:]))
    return Firmware(len(data), digest, high << 16 | low, _parse_blocks(data), name)


def _refuse_other_files(data: bytes) -> None:
    begin = data[:200].lstrip().lower()
    if not data:
        raise _refusal("it is empty")
    if begin.startswith((b"<!doctype", b"<html", b"<?xml")):
        raise _refusal("it is a web page (perhaps a page about the file or an error message), not the file itself")
    if begin.startswith(b"version https://git-lfs"):
        raise _refusal("it is only a Git LFS pointer: fetch the file itself with 'git lfs pull'")
    if begin.startswith(b":") or _HEX_DUMP.fullmatch(data):
        raise _refusal("it is a hex dump, not binary data: use the binary file")


def _refuse_wrong_header(data: bytes) -> None:
    if len(data) < _HEADER_BYTES:
        raise _refusal(f"it is truncated: it has {len(data)} bytes, but the header alone needs {_HEADER_BYTES}")
    key, *reserved = struct.unpack_from(f"<{1 + _RESERVED_WORDS}H", data)
    if key == int.from_bytes(BOOT_KEY.to_bytes(2, "little"), "big"):
        raise _refusal("the two bytes in each of its words are swapped")
    if key != BOOT_KEY:
        raise _refusal(f"it begins with the key 0x{key:04X}, not 0x{BOOT_KEY:04X}")
    if any(reserved):
        raise _refusal("its header has non-zero values in fields that must be zero")


def _parse_blocks(data: bytes) -> tuple[Block, ...]:
    blocks: list[Block] = []
    offset = _HEADER_BYTES
    while True:
        number = len(blocks) + 1
        if len(data) < offset + 2:
            raise _refusal(
                f"it is truncated: it ends at byte {len(data)}, after {len(blocks)} blocks, without an end marker"
            )
        (word_count,) = struct.unpack_from("<H", data, offset)
        if word_count == 0:
            break
        end = offset + _BLOCK_HEAD.size + 2 * word_count
        if len(data) < end:
            raise _refusal(
                f"it is truncated in block {number}: it has {len(data)} bytes, but that block ends at byte {end}"
            )
        _, high, low = _BLOCK_HEAD.unpack_from(data, offset)
        blocks.append(Block(high << 16 | low, word_count))
        offset = end
    if not blocks:
        raise _refusal("it does not contain any blocks to load")
    extra = len(data) - offset - 2
    if extra:
        raise _refusal(f"{extra} bytes follow the end marker at byte {offset}")
    return tuple(blocks)


def _refusal(reason: str) -> DeviceFailure:
    return FAILURES.failure("not-firmware", reason)


_MAX_ATTEMPTS: Final = 10
PINGS: Final = 20
_RUNNING_PROBES: Final = 10
_ROUND_TRIPS: Final = 50

_PING_S: Final = 0.25
_STEP_S: Final = 1.0
PROBE_S: Final = 0.05
_BETWEEN_ATTEMPTS_S: Final = 0.2


class BootFailure(DeviceFailure):
    """The firmware could not be loaded.

    ``step`` is the step at which the last attempt failed ("ping", "autobaud", "echo" or "start"), ``attempt`` its
    number, ``reason`` the observation.
    """

    def __init__(self, step: str, attempt: int, reason: str) -> None:
        self.step, self.attempt, self.reason = step, attempt, reason
        attempts = "1 attempt" if attempt == 1 else f"{attempt} attempts"
        check_file = "; check that the file contains Falcon firmware" if step == "start" else ""
        super().__init__("upload", str(FAILURES.failure("upload", f"in {attempts}: {reason}{check_file}")))


class _StepFailed(Exception):
    """A step of a boot attempt failed."""

    def __init__(self, step: str, reason: str) -> None:
        self.step, self.reason = step, reason
        super().__init__(reason)


class _Line:
    """The bytes received over a bridge, without its status bytes, and the packets in them.

    It reads one USB packet at a time, since a longer read would not end after a full packet, such as the echo of a
    chunk, but wait for the bridge's timer.
    """

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._memory = np.zeros(constants.USB_PACKET, np.uint8)
        self._parser, self._status = records(PARSER, 1), records(STATUS, 1)

    def read_until(self, complete: Callable[[bytes], bool], timeout_s: float, received: bytes = b"") -> bytes:
        """Return ``received`` and the bytes received after it, until they are complete or the time-out is reached."""
        ends_s = self._transport.now_s() + timeout_s
        while not complete(received) and (left_s := ends_s - self._transport.now_s()) > 0.0:
            received += self._memory[: self._read(left_s)].tobytes()
        return received

    def gets_reply(self, timeout_s: float) -> bool:
        """Send a quiet packet; return whether a reply arrives in time."""
        try:
            self._transport.write(constants.quiet_packet(constants.FLAG_HOMING), timeout_s)
        except UsbFailure as failure:
            if failure.kind == "timeout":
                return False
            raise
        ends_s = self._transport.now_s() + timeout_s
        while (left_s := ends_s - self._transport.now_s()) > 0.0:
            if feed(self._parser[0], self._memory, self._read(left_s), self._status[0]) > 0:
                return True
        return False

    def _read(self, timeout_s: float) -> int:
        raw = self._transport.read(constants.USB_PACKET, timeout_s)
        self._memory[: len(raw)] = np.frombuffer(raw, np.uint8)
        return int(strip(self._memory, len(raw), self._memory))


def configure(transport: Transport) -> None:
    """Configure the bridge for a running Falcon, and clear its buffers."""
    _purge(transport)
    transport.control(constants.REQUEST_LATENCY, constants.LATENCY_RUN_MS)
    _set_line(transport, constants.BAUD_1500000)
    _purge(transport)


def set_event_character(transport: Transport, on: bool) -> None:
    """Set whether the bridge sends its data at a packet's last byte, or only when its timer expires."""
    transport.control(constants.REQUEST_EVENT_CHARACTER, constants.STOP | (constants.EVENT_ENABLED if on else 0))


def is_running(transport: Transport) -> bool:
    """Return whether the Falcon runs its firmware, that is, answers a quiet packet. The bridge must be configured."""
    for _ in range(_RUNNING_PROBES):
        if _Line(transport).gets_reply(PROBE_S):
            return True
        _purge(transport)
    return False


def measure_round_trip(transport: Transport) -> float:
    """Return the median time from a packet to its reply [s]; a missing reply counts as 50 ms."""
    return median(_round_trip_s(transport) for _ in range(_ROUND_TRIPS))


def choose_event_character(transport: Transport) -> tuple[float, dict[str, Any]]:
    """Use the bridge's event character if the round trip is shorter with it.

    Return the shorter round trip [s] and the fields for the receipt.
    """
    trip_s = {}
    for on in (False, True):
        set_event_character(transport, on)
        trip_s[on] = measure_round_trip(transport)
    is_shorter = trip_s[True] < trip_s[False]
    if not is_shorter:
        set_event_character(transport, on=False)
    trips = {"with": round(1000 * trip_s[True], 3), "without": round(1000 * trip_s[False], 3)}
    return min(trip_s.values()), {"event_character": is_shorter, "round_trip_ms": trips}


def _round_trip_s(transport: Transport) -> float:
    began_s = transport.now_s()
    if _Line(transport).gets_reply(PROBE_S):
        return transport.now_s() - began_s
    _purge(transport)  # a late reply must not count as the reply to the next packet
    return PROBE_S


def boot_falcon(
    transport: Transport,
    firmware: bytes,
    *,
    attempts: int = _MAX_ATTEMPTS,
    progress: Callable[[str], object] | None = None,
) -> Firmware:
    """Load ``firmware`` and check that it runs; return its description.

    Parameters
    ----------
    transport : the Falcon's bridge; each attempt except the first reopens it
    firmware : the bytes of its file
    attempts : maximum number of attempts
    progress : receives a line about each failed attempt
    """
    image = check_firmware(firmware)
    for attempt in range(1, attempts + 1):
        try:
            _attempt_boot(transport, firmware)
        except _StepFailed as failure:
            if attempt == attempts:
                raise BootFailure(failure.step, attempt, failure.reason) from None
            if progress is not None:
                progress(
                    f"Attempt {attempt} of {attempts} to load the firmware failed: {failure.reason}. Trying again."
                )
            transport.reopen()
            transport.pause(_BETWEEN_ATTEMPTS_S)
        else:
            break
    return image


def _attempt_boot(transport: Transport, firmware: bytes) -> None:
    _ping_loader(transport)
    _send_autobaud(transport)
    _upload_firmware(transport, firmware)
    configure(transport)
    if not is_running(transport):
        raise _StepFailed("start", "the firmware was sent, but the Falcon does not respond")


def _ping_loader(transport: Transport) -> None:
    """Reset the processor with an edge of DTR, and ping its loader until it answers."""
    _purge(transport)
    set_event_character(transport, on=False)
    transport.control(constants.REQUEST_LATENCY, constants.LATENCY_BOOT_MS)
    _set_line(transport, constants.BAUD_9600)
    for level in (constants.RTS_LOW, constants.DTR_LOW, constants.DTR_HIGH):
        transport.control(constants.REQUEST_MODEM, level)
    line = _Line(transport)
    received = b""
    for _ in range(PINGS):
        _send(transport, constants.PING, "ping")
        received = line.read_until(lambda data: constants.PONG in data, _PING_S, received)
        if constants.PONG in received:
            return
    heard = f"answers with {received[:8].hex(' ')}" if received else "does not answer"
    raise _StepFailed("ping", f"its boot loader {heard}")


def _send_autobaud(transport: Transport) -> None:
    """Send an 'A', from whose bits the loader determines the speed of the upload."""
    transport.control(constants.REQUEST_MODEM, constants.DTR_LOW)
    transport.control(constants.REQUEST_BAUD, constants.BAUD_142857)
    _purge(transport)
    _send(transport, constants.AUTOBAUD, "autobaud")
    received = _Line(transport).read_until(lambda data: data.endswith(constants.AUTOBAUD), _STEP_S)
    if not received.endswith(constants.AUTOBAUD):
        heard = f"answers with {received[:8].hex(' ')}" if received else "does not answer"
        raise _StepFailed("autobaud", f"after the byte that sets the speed, its boot loader {heard}")


def _upload_firmware(transport: Transport, firmware: bytes) -> None:
    """Send the firmware in pieces, and check the echo of each."""
    line = _Line(transport)
    for offset in range(0, len(firmware), constants.CHUNK):
        chunk = firmware[offset : offset + constants.CHUNK]
        _send(transport, chunk, "echo")
        _expect_echo(line, chunk, offset)


def _expect_echo(line: _Line, chunk: bytes, offset: int) -> None:
    echo = line.read_until(lambda data: len(data) >= len(chunk), _STEP_S)
    for number, (sent, received_byte) in enumerate(zip(chunk, echo, strict=False), offset):
        if received_byte != sent:
            raise _StepFailed("echo", f"byte {number} of the firmware came back as {received_byte:02x}, not {sent:02x}")
    if len(echo) < len(chunk):
        raise _StepFailed("echo", f"the bridge returned nothing from byte {offset + len(echo)} of the firmware onwards")
    if len(echo) > len(chunk):
        raise _StepFailed(
            "echo", f"the bridge returned extra data after byte {offset + len(chunk) - 1} of the firmware"
        )


def _send(transport: Transport, data: bytes, step: str) -> None:
    try:
        transport.write(data, _STEP_S)
    except UsbFailure as failure:
        if failure.kind != "timeout":
            raise
        raise _StepFailed(step, "the bridge did not accept the data in time") from failure


def _set_line(transport: Transport, divisor: int) -> None:
    transport.control(constants.REQUEST_BAUD, divisor)
    transport.control(constants.REQUEST_LINE, constants.LINE_8N1)
    transport.control(constants.REQUEST_FLOW, 0)


def _purge(transport: Transport) -> None:
    transport.control(constants.REQUEST_RESET, constants.PURGE_RX)
    transport.control(constants.REQUEST_RESET, constants.PURGE_TX)
