"""What the Inverse3's connection costs: python tests/benchmarks/devices/inverse3.py [SECONDS] prints three tables.

1. The servo at 1 kHz on the scripted hand, on the emulated service within the program, and on the same service behind a
   TCP port: by exchanges in the tick (the driver), and by a thread with a sequence-locked slot, free-running and at
   1 kHz. Lateness of the ticks, age of the position since its command was sent, ticks without a new position.
2. A command and its state over TCP, written and read as the servo does, against a bare C socket echo of as many bytes.
3. The ratios that are asked for. Ratios are compared within one run; the computer's load enters both sides.
"""

import socket
import sys
import threading
import time
from typing import Any

import numpy as np
from numba import types

from study_app.devices.emulators.inverse3 import EmulatedInverse3
from study_app.devices.emulators.inverse3_service import Service
from study_app.devices.registry import open_device
from study_app.devices.simulated import ScriptedDevice
from study_app.errors import StudyError
from study_app.haptics.kernels.c_functions import (
    NOW,
    READ,
    READ_NEW,
    READ_NOTHING_NEW,
    SLEEP,
    WRITE,
    c_function,
    call_at,
    external,
    fence,
    record_at,
)
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import COMMAND, READING, new_command, new_reading, records
from study_app.haptics.runtime.clocks.clock import SystemClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import load
from tests.devices.inverse3.server import ServiceServer

EXCHANGES = 4000
ECHO = 1024
MOST = 1 << 20

_poll = external("poll", types.int32(types.intp, types.uint64, types.int32))
_send = external("send", types.intp(types.int32, types.intp, types.uintp, types.int32))
_recv = external("recv", types.intp(types.int32, types.intp, types.uintp, types.int32))
_call_read, _call_write, _now, _sleep = call_at(READ), call_at(WRITE), call_at(NOW), call_at(SLEEP)

POLLED = np.dtype([("file", np.int32), ("events", np.int16), ("returned", np.int16)])
LOGGED = np.dtype(
    [("context", np.intp), ("read", np.intp), ("write", np.intp), ("count", np.int64), ("age_ns", np.int64, (MOST,))],
    align=True,
)
SLOT = np.dtype(
    [
        ("serial", np.int64),  # odd while it is being written
        ("taken", np.int64),
        ("position_m", np.float64, (3,)),
        ("sent_ns", np.int64),
        ("age_ns", np.int64),
        ("force_serial", np.int64),
        ("force_n", np.float64, (3,)),
        ("run", np.int64),
    ],
    align=True,
)
_logged_at, _slot_at = record_at(LOGGED), record_at(SLOT)
_device_at, _reading_at, _command_at = (
    record_at(EmulatedInverse3().exchange.dtype),
    record_at(READING),
    record_at(COMMAND),
)


def _read_logged(context: int, now_ns: int, reading: int) -> int:
    """Read the driver, and log the age of a new position."""
    log = _logged_at(context)
    answer = _call_read(log.read, log.context, now_ns, reading)
    if answer == READ_NEW and log.count < MOST:
        log.age_ns[log.count] = _device_at(log.context).age_ns
        log.count += 1
    return answer


def _write_logged(context: int, command: int) -> int:
    log = _logged_at(context)
    return _call_write(log.write, log.context, command)


def _read_slot(context: int, now_ns: int, reading: int) -> int:
    """Take the slot if it is whole and new."""
    log = _logged_at(context)
    slot = _slot_at(log.context)
    serial = slot.serial
    if serial == slot.taken or serial % 2 == 1:
        return READ_NOTHING_NEW
    fence()
    out = _reading_at(reading)
    for axis in range(3):
        out.position_m[axis] = slot.position_m[axis]
    sent_ns = slot.sent_ns
    fence()
    if slot.serial != serial:
        return READ_NOTHING_NEW
    slot.taken = serial
    out.delay_ticks = 1
    if log.count < MOST:
        log.age_ns[log.count] = now_ns - sent_ns
        log.count += 1
    return READ_NEW


def _write_slot(context: int, command: int) -> int:
    slot = _slot_at(_logged_at(context).context)
    slot.force_serial += 1
    fence()
    for axis in range(3):
        slot.force_n[axis] = _command_at(command).force_n[axis]
    fence()
    slot.force_serial += 1
    return 0


@kernel
def _exchange(device: Any, reading: Any, command: Any, polled: Any, clock: Any) -> int:
    """Send a force, wait for the state, and take it; return how long that took [ns]."""
    context, read, write = device
    began_ns = _now(clock[0], clock[1])
    _call_read(read, context, began_ns, np.intp(reading.ctypes.data))  # which says when it is
    began_ns = _now(clock[0], clock[1])
    _call_write(write, context, np.intp(command.ctypes.data))
    for _ in range(100):
        _poll(np.intp(polled.ctypes.data), np.uint64(1), np.int32(100))
        now_ns = _now(clock[0], clock[1])
        _call_read(read, context, now_ns, np.intp(reading.ctypes.data))
        if _device_at(context).answered >= _device_at(context).sent:
            break
    return int(now_ns - began_ns)


@kernel
def _run_thread(slot: Any, device: Any, reading: Any, command: Any, polled: Any, clock: Any, pace_ns: int) -> None:
    """Exchange until the slot says no more; publish each position."""
    due_ns = _now(clock[0], clock[1])
    while slot[0].run != 0:
        serial = slot[0].force_serial
        if serial % 2 == 0:
            for axis in range(3):
                command[0].force_n[axis] = command[0].sent_n[axis] = slot[0].force_n[axis]
        sent_ns = _now(clock[0], clock[1])
        _exchange(device, reading, command, polled, clock)
        slot[0].serial += 1
        fence()
        for axis in range(3):
            slot[0].position_m[axis] = reading[0].position_m[axis]
        slot[0].sent_ns = sent_ns
        fence()
        slot[0].serial += 1
        if pace_ns > 0:
            due_ns = max(due_ns + pace_ns, _now(clock[0], clock[1]) - pace_ns)
            _sleep(clock[2], clock[1], due_ns)


@kernel
def _echo(file: int, buffer: Any) -> None:
    """Send back what comes until the stream ends."""
    while True:
        came = _recv(np.int32(file), np.intp(buffer.ctypes.data), np.uintp(buffer.size), np.int32(0))
        if came <= 0:
            return
        _send(np.int32(file), np.intp(buffer.ctypes.data), np.uintp(came), np.int32(0))


@kernel
def _ask_echo(file: int, buffer: Any, clock: Any) -> int:
    began_ns = _now(clock[0], clock[1])
    _send(np.int32(file), np.intp(buffer.ctypes.data), np.uintp(buffer.size), np.int32(0))
    left = buffer.size
    while left > 0:
        came = _recv(np.int32(file), np.intp(buffer.ctypes.data), np.uintp(left), np.int32(0))
        if came <= 0:
            return -1
        left -= came
    return int(_now(clock[0], clock[1]) - began_ns)


class Logged:
    """A driver whose positions' ages are logged."""

    def __init__(self, driver: Any, read: Any = _read_logged, write: Any = _write_logged, context: int = 0) -> None:
        self.name, self.force_limit_n, self.dynamics = driver.name, driver.force_limit_n, driver.dynamics
        self.failure = None
        self.memory = records(LOGGED, 1)
        self.log = self.memory[0]
        self.log.context = context or driver.context
        self.log.read, self.log.write = driver.read.address, driver.write.address
        self.context = int(self.memory.ctypes.data)
        self.read, self.write = c_function(READ, read), c_function(WRITE, write)


def _measure(driver: Any, hand: Any, seconds: float) -> dict[str, Any]:
    with Servo(driver) as servo:
        servo.load(load("rek2024").scene_for("honey"))
        time.sleep(0.5)
        reader = servo.telemetry.reader()
        reader.read()
        first = int(driver.log.count) if isinstance(driver, Logged) else 0
        rows = []
        until = time.monotonic() + seconds
        side = 1.0
        while time.monotonic() < until:
            hand.reach_to(0.03 * side, 0.0, 0.01)
            side = -side
            time.sleep(0.25)
            rows.append(np.asarray(reader.read()).copy())
        servo.check()
    samples = np.concatenate(rows)
    ages = driver.log.age_ns[first : driver.log.count] if isinstance(driver, Logged) else np.zeros(1)
    return {
        "late": np.percentile(samples["lateness_ns"], [50, 99]) / 1e3,
        "age": np.percentile(ages, [50, 99]) / 1e3,
        "without": 1.0 - float(samples["fresh"].mean()),
        "busy": np.percentile(samples["busy_ns"], [50, 99]) / 1e3,
    }


def _polled(device: Any) -> Any:
    polled = records(POLLED, 1)
    polled[0].file, polled[0].events = int(device.exchange.handle), 1
    return polled


def _clock() -> tuple[SystemClock, tuple[int, int, int]]:
    clock = SystemClock()
    return clock, (clock.now.address, clock.context, clock.sleep.address)


def _by_thread(port: int, service: Service, pace_ns: int, seconds: float) -> dict[str, Any]:
    clock, calls = _clock()
    with open_device(f"inverse3:127.0.0.1:{port}") as device:
        slot = records(SLOT, 1)
        slot[0].run = 1
        driver = Logged(device, _read_slot, _write_slot, int(slot.ctypes.data))
        arguments = ((device.context, device.read.address, device.write.address), new_reading(), new_command())
        polled = _polled(device)
        run = (slot, *arguments, polled, calls, pace_ns)
        slot[0].run = 0
        _run_thread(*run)  # compiles
        slot[0].run = 1
        thread = threading.Thread(target=_run_thread, args=run, daemon=True)
        thread.start()
        try:
            return _measure(driver, service, seconds)
        finally:  # the thread uses the memory of all these, also when the servo gave up
            slot[0].run = 0
            thread.join()
            del clock


def _round_trips(device: Any) -> tuple[Any, Any]:
    """Return times of exchanges and of echoes [ns], taken in turn."""
    clock, calls = _clock()
    server = socket.create_server(("127.0.0.1", 0))
    near = socket.create_connection(server.getsockname())
    far, _ = server.accept()
    for one in (near, far):
        one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    thread = threading.Thread(target=_echo, args=(far.fileno(), np.zeros(ECHO, np.uint8)), daemon=True)
    thread.start()
    buffer, polled = np.zeros(ECHO, np.uint8), _polled(device)
    functions = (device.context, device.read.address, device.write.address)
    reading, command = new_reading(), new_command()
    command[0].force_n = 0.1, 0.2, 0.3
    taken = np.zeros((EXCHANGES + 20, 2))
    for row in taken:
        row[0] = _exchange(functions, reading, command, polled, calls)
        row[1] = _ask_echo(near.fileno(), buffer, calls)
        time.sleep(0.0005)
    near.close()
    thread.join()
    far.close()
    server.close()
    del clock
    return taken[20:, 0], taken[20:, 1]


def main(seconds: float) -> None:
    """Measure and print."""
    found: dict[str, dict[str, Any]] = {}
    scripted = ScriptedDevice()
    found["scripted"] = _measure(scripted, scripted, seconds)
    with EmulatedInverse3() as emulated:
        found["emulated, in the program"] = _measure(Logged(emulated), emulated.hand, seconds)
    service = Service()
    with ServiceServer(service) as server:
        with open_device(f"inverse3:127.0.0.1:{server.port}") as device:
            found["TCP, exchanges in the tick"] = _measure(Logged(device), service, seconds)
        for pace_ns, name in ((0, "TCP, thread and slot, free"), (1_000_000, "TCP, thread and slot, 1 kHz")):
            try:
                found[name] = _by_thread(server.port, service, pace_ns, seconds)
            except StudyError as error:
                print(f"{name}: {error}")
        with open_device(f"inverse3:127.0.0.1:{server.port}") as device:
            exchanges, echoes = _round_trips(device)
    print(f"{'us':30} {'lateness':>15} {'age of position':>17} {'tick took':>15} {'no position':>12}")
    for name, row in found.items():
        columns = "".join(f"{row[key][0]:8.0f} {row[key][1]:8.0f}" for key in ("late", "age", "busy"))
        print(f"{name:30} {columns} {row['without']:11.2%}")
    print(f"{'':30} {'p50':>7} {'p99':>8} {'p50':>7} {'p99':>8} {'p50':>7} {'p99':>8}\n")
    for name, taken in (("exchange over TCP", exchanges), (f"bare C echo of {ECHO} bytes", echoes)):
        median, high = np.percentile(taken, [50, 99]) / 1e3
        print(f"{name:30} {median:7.0f} {high:8.0f}")
    ratio = np.percentile(exchanges, 99) / np.percentile(echoes, 99)
    late = found["emulated, in the program"]["late"][1] / found["scripted"]["late"][1]
    print(f"\np99 lateness, emulated : scripted = {late:.2f} (<= 1.5)")
    print(f"p99 of an exchange : of an echo = {ratio:.2f} (<= 2)")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
