"""An emulated Falcon: the USB bridge, the boot loader, the program it runs, its arms, and the hand that holds the grip.

A transfer advances emulated time from byte to byte at the device, until it is complete or reaches its time-out. The
interface is one C function with the signature of ``libusb_bulk_transfer`` (``bulk``), whose handle is the address of
the emulator's memory, and the bridge's control requests. Everything happens in emulated time (``falcon_bridge``) and
depends only on its commands and on ``random``.
"""

from collections.abc import Callable
from functools import cache, cached_property
from random import Random
from typing import Any

import numpy as np

from study_app.devices.emulators import falcon_bridge, falcon_processor
from study_app.devices.emulators.falcon_arm import ARMS, encoder_count, find_angles, find_force, saturate, set_arms
from study_app.devices.emulators.falcon_bridge import BRIDGE, OUT_RING, byte_at, power_up
from study_app.devices.falcon import constants
from study_app.devices.falcon.bulk import BULK, BulkCalls
from study_app.devices.falcon.mechanics import DEFAULT_GEOMETRY, Geometry, geometry_named
from study_app.devices.hand import HAND, HandOrders
from study_app.devices.simulated import TREMOR_M, new_scripted_handle
from study_app.haptics.kernels import HANDLE, c_function, entry_of, kernel, record_at
from study_app.haptics.model.layout import records
from study_app.haptics.model.ranges import Vector

_EMULATOR = np.dtype(
    [
        ("bridge", BRIDGE),
        ("faults", falcon_processor.FAULTS),
        ("loader", falcon_processor.LOADER),
        ("run", falcon_processor.RUN),
        ("arms", ARMS),
        ("handle", HANDLE),
        ("hand", HAND),
        ("powered", np.int64),  # 1 while the mains adapter is on
        ("buttons", np.int64),  # bits 0 to 3, as the grip reports them
        ("moved_ns", np.int64),  # time of the last motion of hand and handle
        ("weight_n", np.float64),  # of the load on the grip
    ],
    align=True,
)

_emulator_at = record_at(_EMULATOR)
_INT = np.dtype([("value", np.int32)])
_int_at = record_at(_INT)


@cache
def bulk() -> Any:
    """Compile the transfer function, once for all emulators."""
    return c_function(BULK, _bulk)


def _bulk(handle: int, endpoint: int, data: int, length: int, transferred: int, timeout_ms: int) -> int:
    e = _emulator_at(handle)
    moved = _int_at(transferred)
    moved.value = 0
    if e.faults.unplugged:
        return constants.ERROR_NO_DEVICE
    _begin_transfer(e)
    end_ns = falcon_bridge.transfer_end_ns(e.bridge, timeout_ms * 1_000_000)
    if endpoint == constants.ENDPOINT_OUT:
        return _bulk_out(e, data, length, moved, end_ns)
    if endpoint == constants.ENDPOINT_IN:
        return _bulk_in(e, data, length, moved, end_ns)
    return constants.ERROR_NOT_FOUND


@kernel
def _begin_transfer(e: Any) -> None:
    """Begin a transfer now; if the clock was changed, shift all times to it."""
    jump_ns = falcon_bridge.begin_transfer(e.bridge)
    if jump_ns != 0:
        falcon_bridge.shift_bridge(e.bridge, jump_ns)
        e.moved_ns += jump_ns
        e.hand.began_ns += jump_ns
        e.run.stalled_ns += jump_ns
    if e.faults.was_unplugged:
        e.faults.was_unplugged = 0
        falcon_bridge.power_up(e.bridge)
    _advance(e, e.bridge.now_ns)


@kernel
def _bulk_out(e: Any, data: int, length: int, moved: Any, end_ns: int) -> int:
    for k in range(length):
        if not falcon_bridge.send(e.bridge, byte_at(data + k).value, end_ns):
            _advance(e, end_ns)
            return constants.ERROR_TIMEOUT
        moved.value = k + 1
        _advance(e, e.bridge.now_ns)
    return constants.SUCCESS


@kernel
def _bulk_in(e: Any, data: int, length: int, moved: Any, end_ns: int) -> int:
    bridge = e.bridge
    while moved.value < length:
        falcon_bridge.drop_overflow(bridge)
        due_ns = falcon_bridge.next_packet_ns(bridge)
        if bridge.out_first < bridge.out_last:
            heard_ns = bridge.out_ns[bridge.out_first % OUT_RING]
            if heard_ns <= min(due_ns, end_ns):  # the device's answer to it may be due sooner
                _advance(e, heard_ns)
                continue
        if due_ns > end_ns:
            _advance(e, end_ns)
            return constants.ERROR_TIMEOUT
        _advance(e, due_ns)
        queued = bridge.back_last - bridge.back_first
        room = length - moved.value
        if room < constants.USB_PACKET and _count_arrived(bridge, queued) + constants.STATUS_BYTES > room:
            return constants.ERROR_OVERFLOW
        noise = int(falcon_processor.draw(e.faults) * 0x10000) if e.faults.status_noise else 0
        length_moved = falcon_bridge.deliver_packet(bridge, data + moved.value, noise)
        moved.value += length_moved
        if length_moved < constants.USB_PACKET:
            return constants.SUCCESS
    return constants.SUCCESS


@kernel
def poll(e: Any, data: int, length: int, moved: Any) -> int:
    """Transfer in the chip's bytes up to now, to address ``data``; ``moved`` is a record of ``_INT``.

    Returns ``ERROR_TIMEOUT`` while the transfer is not complete; the rest is requested later.
    """
    moved.value = 0
    if e.faults.unplugged:
        return constants.ERROR_NO_DEVICE
    _begin_transfer(e)
    return _bulk_in(e, data, length, moved, e.bridge.now_ns)


@kernel
def next_event_ns(e: Any) -> int:
    """Return the time of the next packet from the chip or byte to the device, when a poll may transfer more [ns]."""
    bridge = e.bridge
    due_ns = falcon_bridge.next_packet_ns(bridge)
    if bridge.out_first < bridge.out_last:
        due_ns = min(due_ns, bridge.out_ns[bridge.out_first % OUT_RING])
    return int(due_ns)


@kernel
def _count_arrived(bridge: Any, queued: int) -> int:
    arrived = 0
    while arrived < min(queued, constants.CHUNK):
        if bridge.back_ns[(bridge.back_first + arrived) % falcon_bridge.BACK_RING] > bridge.now_ns:
            break
        arrived += 1
    return arrived


@kernel
def _advance(e: Any, to_ns: int) -> None:
    """Let the device process the bytes that arrive up to ``to_ns``."""
    bridge = e.bridge
    while bridge.out_first < bridge.out_last:
        index = bridge.out_first % OUT_RING
        at_ns = bridge.out_ns[index]
        if at_ns > to_ns:
            break
        bridge.now_ns = max(bridge.now_ns, at_ns)
        bridge.out_first += 1
        if e.powered == 0:
            continue
        if e.loader.state == falcon_processor.RUNNING:
            falcon_processor.receive_byte(e, bridge.out[index], bridge.out_divisor[index], at_ns)
        else:
            falcon_processor.receive_boot_byte(
                e.loader, bridge, e.faults, bridge.out[index], bridge.out_divisor[index], at_ns
            )
            if e.loader.state == falcon_processor.RUNNING:
                run_program(e)
    bridge.now_ns = max(bridge.now_ns, to_ns)


@kernel
def run_program(e: Any) -> None:
    """Start the program with encoders at 0, no torque and no arm homed."""
    e.loader.state = falcon_processor.RUNNING
    _clear_program(e)
    for arm in range(3):
        e.run.origin[arm] = encoder_count(e.arms, arm)
        e.run.before_rad[arm] = e.arms.angle_rad[arm]


@kernel
def _clear_program(e: Any) -> None:
    run = e.run
    run.held = 0
    run.homed = 0
    run.homing = 0
    run.lights = 0
    run.stroke = 0
    run.stalled_ns = 0
    for arm in range(3):
        run.torque[arm] = 0
        run.acting[arm] = 0.0
        run.shown[arm] = 0


@kernel
def control(e: Any, request: int, value: int) -> int:
    """Carry out a control request of the bridge; a rising DTR at 9600 baud resets the device."""
    if e.faults.unplugged:
        return constants.ERROR_NO_DEVICE
    _begin_transfer(e)
    dtr = e.bridge.dtr
    falcon_bridge.control(e.bridge, request, value)
    if e.bridge.dtr > dtr and e.bridge.divisor == constants.BAUD_9600 and e.powered != 0:
        falcon_processor.reset(e.loader)
        _clear_program(e)
    return constants.SUCCESS


@kernel
def set_power(e: Any, on: int) -> None:
    """Turn the mains power on or off; without power the program is lost."""
    if e.powered == on:
        return
    e.powered = on
    falcon_processor.reset(e.loader)
    e.loader.state = falcon_processor.WAITING
    _clear_program(e)


@kernel
def advance_time(e: Any, lasting_ns: int) -> None:
    """Advance the time by a duration, including the motion of hand and handle."""
    _begin_transfer(e)
    end_ns = falcon_bridge.transfer_end_ns(e.bridge, lasting_ns)
    _advance(e, end_ns)
    falcon_processor.move_until(e, end_ns, max(lasting_ns, falcon_processor.LONGEST_NS))


@kernel
def catch_up(e: Any) -> None:
    """Advance to the current time of the clock."""
    _begin_transfer(e)
    falcon_processor.move_until(e, e.bridge.now_ns, falcon_processor.LONGEST_NS)


@kernel
def reset_to_power_up(e: Any) -> None:
    """Reset to the state after connection: arms at the grip's position, no program."""
    find_angles(e.arms, e.handle.position_m)
    e.loader.state = falcon_processor.WAITING


@kernel
def update_force(e: Any) -> None:
    """Set ``arms.force_n`` to the current force of the motors."""
    find_force(e.arms, e.run.acting, e.handle.position_m)
    saturate(e.arms)


_HOUSING_M = (0.055, 0.055, 0.050)
"""Half extents of the housing about the hand's origin, larger than the hand's range of motion."""
_UNITS_PER_NM = 6616.0
"""Motor units for an arm torque of 1 N m: Martin & Hillier 2009; others measured 10 000."""
ALL_HOMED = 0b111


class Emulator(HandOrders):
    """An emulated Falcon with its mains adapter plugged in.

    Orders go to the hand that holds the grip, in the hand frame; while homing is on and it has no other order, the hand
    pulls the grip out, pushes it in, out again, and returns to the centre. Properties give the state at the last step
    of emulated time.

    Parameters
    ----------
    random : random numbers for tremor and faults; None: fixed ones
    geometry : its dimensions, or the name of published ones
    running : whether its program is loaded already
    serial : serial number of its bridge
    workspace_m : half extents of the hand's range [m]
    tremor_m : amplitude of the tremor's waves [m]; 0: no tremor
    units_per_nm : motor units for an arm torque of 1 N m
    arm_offset_rad : assembly error of each arm's encoder zero
    """

    def __init__(
        self,
        random: Random | None = None,
        *,
        geometry: Geometry | str = DEFAULT_GEOMETRY,
        running: bool = False,
        serial: str = "EMULATED",
        workspace_m: tuple[float, float, float] = (0.05, 0.05, 0.05),
        tremor_m: float = TREMOR_M,
        units_per_nm: float = _UNITS_PER_NM,
        arm_offset_rad: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        memory = records(_EMULATOR, 1)
        super().__init__(memory[0], workspace_m)
        self.serial = serial
        self.geometry = geometry_named(geometry) if isinstance(geometry, str) else geometry
        self.recorded: list[tuple[int, int]] = []
        self.memory = memory
        self._address = int(memory.ctypes.data)
        random = random or Random(0)  # noqa: S311 - simulated faults and tremor, not secrets
        self._now_ns = memory["bridge"]["now_ns"]
        self._tremble(random, tremor_m)
        self.faults = falcon_processor.Faults(self.state.faults, random)
        power_up(self.state.bridge)
        set_arms(self.state.arms, self.geometry, units_per_nm, arm_offset_rad)
        self.state.handle = new_scripted_handle(quantum_m=0.0)
        self.state.handle.stop_m = _HOUSING_M
        self.state.hand.place_m = self.state.hand.aim_m
        self.state.powered = 1
        reset_to_power_up(self.state)
        if running:
            run_program(self.state)

    # The bridge's interface to a host.

    def control(self, request: int, value: int) -> int:
        """Carry out a control request of the bridge and append it to ``recorded``; return 0 or a libusb error."""
        self.recorded.append((request, value))
        return int(control(self.state, request, value))

    def write(self, data: bytes, timeout_ms: int) -> tuple[int, int]:
        """Transfer bytes out; return 0 or a libusb error, and the number of bytes accepted."""
        memory = np.frombuffer(data or b"\0", np.uint8)
        return self.transfer(constants.ENDPOINT_OUT, memory, len(data), timeout_ms)

    def read(self, size: int, timeout_ms: int) -> tuple[int, bytes]:
        """Transfer at most ``size`` bytes in, including status bytes; return 0 or a libusb error, and the bytes."""
        memory = np.zeros(max(size, 1), np.uint8)
        code, moved = self.transfer(constants.ENDPOINT_IN, memory, size, timeout_ms)
        return code, memory[:moved].tobytes()

    def poll(self, size: int) -> tuple[int, bytes]:
        """Continue a transfer in without waiting; return 0 or a libusb error, and the bytes received so far.

        ``ERROR_TIMEOUT`` means that it is not complete: nothing more arrives before ``next_event_ns``.
        """
        memory, moved = np.zeros(max(size, 1), np.uint8), records(_INT, 1)[0]
        code = int(poll(self.state, memory.ctypes.data, size, moved))
        return code, memory[: moved.value].tobytes()

    @property
    def next_event_ns(self) -> int:
        """The time at which an incomplete IN transfer may continue [ns]."""
        return int(next_event_ns(self.state))

    def transfer(self, endpoint: int, memory: Any, length: int, timeout_ms: int) -> tuple[int, int]:
        """Transfer ``length`` bytes of ``memory`` at an endpoint; return 0 or a libusb error, and the number moved."""
        moved = np.zeros(1, np.int32)
        call = bulk().ctypes
        code = call(self._address, endpoint, memory.ctypes.data, length, moved.ctypes.data, timeout_ms)
        return int(code), int(moved[0])

    def calls(self) -> BulkCalls:
        return BulkCalls(self._address, int(bulk().address))

    def compile(self) -> None:
        """Compile all functions that run later, or load them from the cache, by running another emulator."""
        spare = Emulator(geometry=self.geometry, running=True)
        spare.control(constants.REQUEST_LATENCY, constants.LATENCY_RUN_MS)
        spare.write(constants.quiet_packet(), 1)
        spare.poll(constants.USB_PACKET)
        _ = spare.next_event_ns, spare.force_n
        spare.look()
        spare.pause(0.0)
        spare.power(False)

    def note_claim(self) -> None:
        """Record that a program has claimed the bridge: the hand is ready to home the grip."""
        self.state.run.stroke_due = 1

    # Time.

    def follow_clock(self, address: int) -> None:
        """Use the int64 [ns] at this address as the time from the next transfer on; 0: the emulator's own time."""
        self.state.bridge.clock = address
        self.state.bridge.joined = 0

    @property
    def now_ns(self) -> int:
        return int(self._now_ns[0])

    def pause(self, seconds: float) -> None:
        self._advance_compiled(self.state, round(seconds * 1e9))

    @cached_property
    def _advance_compiled(self) -> Callable[[Any, int], None]:
        return entry_of(advance_time, self.state, 0)

    def look(self) -> None:
        """Advance to the current time of its clock: process received bytes, and move for a limited time."""
        catch_up(self.state)

    # State and faults.

    def power(self, on: bool) -> None:
        """Connect or disconnect the mains adapter; without it the program is lost and the motors are off."""
        set_power(self.state, 1 if on else 0)

    def set_fault(self, fault: str) -> None:
        """Set a fault in the notation of the command line: ``drop=0.01``, ``frozen`` or ``power-off``."""
        if falcon_processor.fault_spelling(fault.strip()) == falcon_processor.POWER_OFF:
            self.power(False)
        else:
            self.faults.set_fault(fault)

    @property
    def powered(self) -> bool:
        return bool(self.state.powered)

    @property
    def running(self) -> bool:
        return bool(self.state.powered) and int(self.state.loader.state) == falcon_processor.RUNNING

    @property
    def loaded(self) -> int:
        """Bytes of firmware received since it was last reset."""
        return int(self.state.loader.loaded)

    @property
    def homed(self) -> int:
        """Arms that found their index: arm 1 is bit 0."""
        return int(self.state.run.homed)

    @property
    def lights(self) -> int:
        """The lights that are on, as FLAG_GREEN, FLAG_BLUE and FLAG_RED."""
        return int(self.state.run.lights)

    @property
    def torques(self) -> tuple[int, ...]:
        """The last torque command of each motor [units]; 0 without power."""
        return tuple(int(units) for units in self.state.run.torque)

    @property
    def highest_torque(self) -> int:
        return int(self.state.run.highest)

    @property
    def highest_unhomed_torque(self) -> int:
        return int(self.state.run.highest_unhomed)

    @property
    def excessive(self) -> int:
        """Packets with a torque beyond the range of the motors."""
        return int(self.state.run.excessive)

    @property
    def packets(self) -> int:
        return int(self.state.run.packets)

    @property
    def refused(self) -> int:
        return int(self.state.run.refused)

    @property
    def force_n(self) -> Vector:
        """The force of its motors on the hand, by virtual work [N]."""
        update_force(self.state)
        x, y, z = self.state.arms.force_n
        return float(x), float(y), float(z)

    @property
    def position_m(self) -> Vector:
        x, y, z = self.state.handle.position_m
        return float(x), float(y), float(z)

    @property
    def weight_n(self) -> float:
        """The weight of the load on the grip [N]."""
        return float(self.state.weight_n)

    @weight_n.setter
    def weight_n(self, weight_n: float) -> None:
        self.state.weight_n = weight_n
