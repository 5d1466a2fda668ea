"""A boot stream that was never anybody's."""

import struct

BLOCKS = ((0x3F8000, 300), (0x3F8200, 7), (0x93A2, 1))


def words(*values):
    return struct.pack(f"<{len(values)}H", *values)


def stream(blocks=BLOCKS, *, key=0x08AA, reserved=(0,) * 8, entry=0x3F8002):
    body = b"".join(
        words(size, place >> 16, place & 0xFFFF, *((40_503 * (k + 1)) & 0xFFFF for k in range(size)))
        for place, size in blocks
    )
    return words(key, *reserved, entry >> 16, entry & 0xFFFF) + body + words(0)
