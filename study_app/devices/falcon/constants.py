"""Numbers of the Falcon's wire protocol: the USB bridge (FTDI FT232R), the boot loader and the 16-byte packets.

Sources: FTDI AN232B-04 and the FT232R data sheet; TI SPRUI33 (boot ROM of the TMS320C28x); libnifalcon's documentation
of the protocol (BSD). Importing this module loads neither the compiler nor a driver.
"""

from typing import Final

VENDOR_ID: Final = 0x0403
PRODUCT_ID: Final = 0xCB48
PRODUCT: Final = "FALCON HAPTIC"
ENDPOINT_IN: Final = 0x81
ENDPOINT_OUT: Final = 0x02
USB_PACKET: Final = 64
"""Largest size of a USB packet [bytes]; reads request whole multiples of it."""
STATUS_BYTES: Final = 2
"""Number of modem status bytes at the start of every IN packet of up to ``USB_PACKET`` bytes."""

# Control requests of the bridge: bmRequestType 0x40, wIndex 0.
REQUEST_TYPE: Final = 0x40
REQUEST_RESET: Final = 0
RESET_ALL, PURGE_RX, PURGE_TX = 0, 1, 2
REQUEST_MODEM: Final = 1
DTR_LOW, DTR_HIGH, RTS_LOW, RTS_HIGH = 0x0100, 0x0101, 0x0200, 0x0202
REQUEST_FLOW: Final = 2
REQUEST_BAUD: Final = 3
BAUD_9600, BAUD_142857, BAUD_1500000 = 0x4138, 0x0015, 0x0002
REQUEST_LINE: Final = 4
LINE_8N1: Final = 0x0008
REQUEST_EVENT_CHARACTER: Final = 6
EVENT_ENABLED: Final = 0x0100
REQUEST_LATENCY: Final = 9
LATENCY_BOOT_MS, LATENCY_RUN_MS = 16, 1

# Boot.
PING: Final = b"\x0a\x43\x0d"
PONG: Final = b"\x0a\x44\x2c\x0d"
AUTOBAUD: Final = b"A"
CHUNK: Final = USB_PACKET - STATUS_BYTES
"""Bytes of firmware sent at a time: their echo fills one USB packet."""
BOOT_KEY: Final = 0x08AA

# Packets, both ways.
PACKET: Final = 16
START, STOP, ZERO = 0x3C, 0x3E, 0x41
FLAG_HOMING, FLAG_GREEN, FLAG_BLUE, FLAG_RED = 0x01, 0x02, 0x04, 0x08
HOMED_SHIFT: Final = 4
"""Bits 4 to 6 of the device's status byte: arms 1 to 3 are homed; bits 0 to 3 are the buttons."""
MOST_TORQUE: Final = 4095
COUNTS_PER_TURN: Final = 1280

# What libusb's functions return.
SUCCESS, ERROR_IO, ERROR_ACCESS, ERROR_NO_DEVICE, ERROR_NOT_FOUND, ERROR_BUSY = 0, -1, -3, -4, -5, -6
ERROR_TIMEOUT, ERROR_OVERFLOW, ERROR_PIPE, ERROR_NOT_SUPPORTED = -7, -8, -9, -12


def quiet_packet(flags: int = 0) -> bytes:
    """Return the packet with zero torque and these lights and homing flags."""
    return bytes([START, *([ZERO] * 12), ZERO + flags, ZERO, STOP])


def milliseconds(seconds: float) -> int:
    """Return a time-out in milliseconds for C functions: at least 1, since 0 means unlimited."""
    return max(1, round(seconds * 1000.0))
