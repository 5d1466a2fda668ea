"""A scripted bridge, called by the compiled exchange through a C function of Python."""

import ctypes
import math
from collections import deque
from types import SimpleNamespace

import numpy as np

from study_app.devices.falcon.constants import ENDPOINT_IN, ERROR_TIMEOUT, SUCCESS
from study_app.devices.falcon.exchange import LEAST_MASS_KG, exchange_functions, new_exchange
from study_app.devices.falcon.mechanics import GEOMETRIES, REACHED, inverse, new_mechanism
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.layout import new_command, new_reading
from study_app.haptics.model.slope_limits import SLEW_S, slew_limit_n

MS = 1_000_000
GEOMETRY = GEOMETRIES["libnifalcon"]
UNITS_PER_NM = 6616.0
MODEM_STATUS = b"\x01\x60"
CENTRE_M = (0.0, 0.0, 0.0)
OUT_M = (0.0, 0.0, 0.045)
PUSH_N = (1.0, -0.5, 2.0)
GROWTH_N = slew_limit_n(SLEW_S, Dynamics(mass_kg=LEAST_MASS_KG))  # within a tick
SOMEWHERE_M = (0.02, -0.01, 0.015)

BULK_CALL = ctypes.CFUNCTYPE(
    ctypes.c_int32,
    ctypes.c_ssize_t,
    ctypes.c_uint8,
    ctypes.c_ssize_t,
    ctypes.c_int32,
    ctypes.c_ssize_t,
    ctypes.c_uint32,
)


def counts_at(place_m, mechanism=None):
    """Return the encoders' counts (3,) of a grip at a place [m, hand frame]."""
    mechanism = mechanism if mechanism is not None else new_mechanism(GEOMETRY, UNITS_PER_NM)
    theta = np.zeros(3)
    assert inverse(mechanism, np.add(place_m, [0, 0, GEOMETRY.centre_m]), theta) == REACHED
    return np.round((theta - mechanism.zero_rad) / mechanism.rad_per_count).astype(int)


def reply(place_m=CENTRE_M, *, homed=0b111, buttons=0, counts=None):
    """Return the packet of a Falcon whose grip is at a place."""
    counts = counts_at(place_m) if counts is None else counts
    numbers = bytes(0x41 + (int(count) >> shift & 0xF) for count in counts for shift in (0, 4, 8, 12))
    return b"<" + numbers + bytes([0x41 + (homed << 4) + buttons, 0x41]) + b">"


def torques_in(packet):
    """Return the three torques of a packet to the device."""
    assert (packet[:1], packet[14:]) == (b"<", b"A>")
    digits = np.frombuffer(packet, np.uint8)[1:13].reshape(3, 4) - 0x41
    assert digits.max() < 16
    return (digits.astype(np.int32) @ [1, 16, 256, 4096]).astype(np.int16).tolist()


class FakeBridge:
    """A bridge that records packets in ``sent``, and returns one entry of ``queue`` per read: bytes or an error."""

    def __init__(self):
        self.queue = deque()
        self.sent = []
        self.write_answer = SUCCESS
        self.reads = 0
        self._function = BULK_CALL(self._transfer)
        self.calls = SimpleNamespace(handle=7, transfer=ctypes.cast(self._function, ctypes.c_void_p).value)

    def _transfer(self, handle, endpoint, data, length, transferred, timeout_ms):
        assert handle == 7
        assert timeout_ms > 0
        moved = ctypes.c_int32.from_address(transferred)
        if endpoint != ENDPOINT_IN:
            moved.value = 0 if self.write_answer else length
            if not self.write_answer:
                self.sent.append(ctypes.string_at(data, length))
            return self.write_answer
        assert length % 64 == 0
        self.reads += 1
        entry = self.queue.popleft() if self.queue else ERROR_TIMEOUT
        moved.value = 0
        if isinstance(entry, int):
            return entry
        assert len(entry) <= length
        moved.value = len(entry)
        ctypes.memmove(data, entry, len(entry))
        return SUCCESS


class Ticks:
    """An exchange over a fake bridge, run as the servo would."""

    def __init__(self):
        self.bridge = FakeBridge()
        self.memory = new_exchange(self.bridge.calls, new_mechanism(GEOMETRY, UNITS_PER_NM), GEOMETRY, math.inf)
        self.falcon = self.memory[0]
        self.read, self.write = exchange_functions()
        self.reading, self.command = new_reading(), new_command()
        self.now_ns = 1000 * MS

    def tick(self, *replies, force_n=(0.0, 0.0, 0.0), after_ns=MS):
        """Take a tick in which the joined ``replies`` arrive; return the answers of read and write."""
        self.now_ns += after_ns
        if replies:
            self.bridge.queue.append(MODEM_STATUS + b"".join(replies))
        answer = self.read.ctypes(self.memory.ctypes.data, self.now_ns, self.reading.ctypes.data)
        self.command[0].force_n = self.command[0].sent_n = force_n
        return answer, self.write.ctypes(self.memory.ctypes.data, self.command.ctypes.data)

    def open_gate(self):
        """Home the device, pull the grip out and wait until the full force passes."""
        self.tick()
        self.pull_out()
        while self.falcon.share < 1.0:
            self.tick(reply())

    def pull_out(self):
        """Pull the grip out and let it go back, faster than any hand but seen for long enough at either end."""
        for place_m in (OUT_M, OUT_M, OUT_M, CENTRE_M, CENTRE_M):
            self.tick(reply(place_m))

    @property
    def position_m(self):
        return self.reading[0].position_m.copy()

    @property
    def torques(self):
        return torques_in(self.bridge.sent[-1])


def force_of(ticks, place_m):
    """Return the force that the last torques make at a place, by virtual work and differences."""
    mechanism = ticks.falcon.mechanism

    def theta_at(place):
        theta = np.zeros(3)
        assert inverse(mechanism, np.add(place, [0, 0, GEOMETRY.centre_m]), theta) == REACHED
        return theta

    torque_nm = -np.array(ticks.torques) / UNITS_PER_NM
    return np.array(
        [
            torque_nm @ (theta_at(np.add(place_m, step)) - theta_at(np.subtract(place_m, step))) / 2e-6
            for step in np.eye(3) * 1e-6
        ]
    )
