"""The Falcon's firmware file, looked at before a byte of it is sent: a boot stream of TI's loader, whole and no more.

None comes with this software: the owner of a Falcon has it. The stream is little-endian words: the key 0x08AA, eight
zeros, the entry point, then blocks of (count, destination, words) and a count of 0; addresses are two words, the high
one first (TI SPRUI33, boot data stream of 8 bits).
"""

import hashlib
import re
import struct
from dataclasses import dataclass
from typing import Final

from study_app.devices.falcon.failures import Facts, ProgramMissing
from study_app.devices.falcon.wire.constants import BOOT_KEY

_RESERVED_WORDS: Final = 8
_HEADER_BYTES: Final = 2 * (1 + _RESERVED_WORDS + 2)
_BLOCK_HEAD: Final = struct.Struct("<HHH")
_ADVICE: Final = "the usual one is nvent_firmware.bin, 8492 bytes, from the software of your Falcon"

KNOWN: Final = {
    ("1119e39c39fab1f3", "09b896a1"): "nvent_firmware.bin",
    ("b2700d5cd5ca217e", "84856c6a"): "test_firmware.bin",
    ("ae838730af34b582", "27ea64a4"): "novint_T0.bin",
    ("e0ae3598670fa1c8", "7ff4e816"): "novint_T2.bin",
}
"""First 16 and last 8 digits of SHA-256 -> under which name it is known."""

_HEX_DUMP: Final = re.compile(rb"[0-9A-Fa-f\s:|.,x]{32,}")


@dataclass(frozen=True, slots=True)
class Block:
    """``words`` 16-bit words for ``destination``."""

    destination: int
    words: int


@dataclass(frozen=True, slots=True)
class Firmware:
    """What a file holds: its size in bytes, its hash, where it begins to run, and its blocks.

    ``name`` is that of a file which is known to work, None for others.
    """

    size: int
    sha256: str
    entry: int
    blocks: tuple[Block, ...]
    name: str | None


def check(data: bytes) -> Firmware:
    """Return what ``data`` holds."""
    _refuse_other_files(data)
    _refuse_wrong_header(data)
    high, low = struct.unpack_from("<HH", data, _HEADER_BYTES - 4)
    digest = hashlib.sha256(data).hexdigest()
    name = KNOWN.get((digest[:16], digest[-8:]))
    return Firmware(len(data), digest, high << 16 | low, _blocks(data), name)


def _refuse_other_files(data: bytes) -> None:
    begin = data[:200].lstrip().lower()
    if not data:
        raise _refusal("it is empty")
    if begin.startswith((b"<!doctype", b"<html", b"<?xml")):
        raise _refusal("it is a web page: what was saved is the page about the file, or an error, not the file")
    if begin.startswith(b"version https://git-lfs"):
        raise _refusal("it is a Git LFS pointer, a note about the file: fetch the file itself with 'git lfs pull'")
    if begin.startswith(b":") or _HEX_DUMP.fullmatch(data):
        raise _refusal("it is a hex dump, the bytes as text: use the binary file")


def _refuse_wrong_header(data: bytes) -> None:
    if len(data) < _HEADER_BYTES:
        raise _refusal(f"it is cut short: {len(data)} bytes are less than its header of {_HEADER_BYTES}")
    key, *reserved = struct.unpack_from(f"<{1 + _RESERVED_WORDS}H", data)
    if key == int.from_bytes(BOOT_KEY.to_bytes(2, "little"), "big"):
        raise _refusal("the two bytes of each of its words are swapped")
    if key != BOOT_KEY:
        raise _refusal(f"it begins with the key 0x{key:04X}, not 0x{BOOT_KEY:04X}")
    if any(reserved):
        raise _refusal("its header has numbers where zeros belong")


def _blocks(data: bytes) -> tuple[Block, ...]:
    blocks: list[Block] = []
    at = _HEADER_BYTES
    while True:
        number = len(blocks) + 1
        if len(data) < at + 2:
            raise _refusal(f"it is cut short: after {len(blocks)} blocks, at byte {len(data)}, there is no end mark")
        (words,) = struct.unpack_from("<H", data, at)
        if words == 0:
            break
        end = at + _BLOCK_HEAD.size + 2 * words
        if len(data) < end:
            raise _refusal(f"it is cut short in block {number}: {len(data)} bytes, of which block {number} needs {end}")
        _, high, low = _BLOCK_HEAD.unpack_from(data, at)
        blocks.append(Block(high << 16 | low, words))
        at = end
    if not blocks:
        raise _refusal("it has no block: there is nothing in it to load")
    extra = len(data) - at - 2
    if extra:
        raise _refusal(f"{extra} bytes follow its end mark at byte {at}")
    return tuple(blocks)


def _refusal(reason: str) -> ProgramMissing:
    return ProgramMissing(f"the file is not a Falcon's firmware: {reason}; {_ADVICE}", Facts(program="refused"))
