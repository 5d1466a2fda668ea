"""How tests talk to an emulated Falcon without any of the driver's code."""

from study_app.devices.falcon.emulator.emulator import Emulator
from study_app.devices.falcon.wire import constants

MS = 1_000_000
HOMING = constants.FLAG_HOMING


def still(**options):
    """Return an emulated Falcon whose hand does not tremble."""
    return Emulator(**{"tremor_m": 0.0, **options})


def at_work(*, event=True, **options):
    """Return one whose program runs, its bridge set as a driver would."""
    emulator = still(running=True, **options)
    emulator.control(constants.REQUEST_BAUD, constants.BAUD_1500000)
    emulator.control(constants.REQUEST_LATENCY, constants.LATENCY_RUN_MS)
    if event:
        emulator.control(constants.REQUEST_EVENT_CHARACTER, constants.EVENT_ENABLED | constants.STOP)
    emulator.read(64, 10)  # the latency timer ran out long ago: nothing but status
    return emulator


def nibbles(number):
    return bytes(constants.ZERO + ((number >> shift) & 0xF) for shift in (0, 4, 8, 12))


def packet(torques=(0, 0, 0), flags=0):
    """Return the bytes that say so to the device."""
    return b"<" + b"".join(map(nibbles, torques)) + bytes([constants.ZERO + flags, constants.ZERO]) + b">"


def counts_in(reply):
    """Return the encoders (3,) of a reply."""
    words = [sum((reply[1 + 4 * arm + k] - constants.ZERO) << (4 * k) for k in range(4)) for arm in range(3)]
    return [word - 0x10000 if word >= 0x8000 else word for word in words]


def status_in(reply):
    """Return the buttons and the homed bits of a reply."""
    status = reply[13] - constants.ZERO
    return status & 0xF, status >> constants.HOMED_SHIFT


def stripped(data):
    """Return what is left of a read without the modem's status."""
    return b"".join(data[k + 2 : k + 64] for k in range(0, len(data), 64))


def exchanged(emulator, torques=(0, 0, 0), flags=0, *, patience=8):
    """Send a packet and return the reply, b"" where none comes."""
    assert emulator.write(packet(torques, flags), 100) == (0, 16)
    heard = b""
    for _ in range(patience):
        code, data = emulator.read(512, 20)
        assert code == 0
        heard += stripped(data)
        if heard.endswith(b">"):
            break
    return heard


def home(emulator, seconds=3.0):
    """Exchange packets with the homing flag while the hand strokes out, in, out."""
    reply = b""
    for _ in range(round(seconds / 2e-3)):
        reply = exchanged(emulator, flags=HOMING)
        emulator.pause(2e-3)
    return reply
