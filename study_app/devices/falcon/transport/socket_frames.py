"""How a Falcon's bridge is spoken to through a Unix socket: the bytes that client and server agree on.

A stream; all numbers little endian. A request is 8 bytes, and ``length`` bytes more for bulk out:

====  ===================  ===========================================================================
u8    kind                 1 control, 2 bulk out, 3 bulk in, 4 descriptor
u8    endpoint or request  control: ``wire.REQUEST_*``; bulk: the endpoint; descriptor: 0
u16   value                control: the value; else 0
u16   length               bulk out: how many bytes follow; bulk in: the most to return; else 0
u16   timeout_ms           bulk: how long to wait at most; else 0
====  ===================  ===========================================================================

Every request has one answer: i32 return code (0 or libusb's error), u32 length, and ``length`` bytes: of bulk in what
came, status bytes and all; of descriptor u16 vendor, u16 product, the serial number in UTF-8; else none.

A client need not wait for an answer before its next request: as on USB, bulk in, bulk out and control are carried out
together, and requests of one kind in their order. Answers come in the order of the requests. With ``TAGGED`` added to
``kind``, the answer comes as soon as the request is done, and begins with that u8 kind.

The bridge has one interface: while one client has it, any other's first request is answered with ``ERROR_BUSY``. When a
client goes, nothing changes: the last torque persists.
"""

import struct
from typing import Final

CONTROL, BULK_OUT, BULK_IN, DESCRIPTOR = 1, 2, 3, 4
TAGGED: Final = 0x80
REQUEST: Final = struct.Struct("<BBHHH")
ANSWER: Final = struct.Struct("<iI")
IDENTITY: Final = struct.Struct("<HH")
LONGEST_TIMEOUT_MS: Final = 10_000
