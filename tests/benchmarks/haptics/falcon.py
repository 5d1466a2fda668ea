"""What the Falcon's part of a tick costs: python tests/benchmarks/haptics/falcon.py prints nanoseconds a tick.

A grip circles at 0.3 m/s through the whole workspace, in whole counts of the encoders; every reply is unpacked, turned
into a position from the one before, and a force into torques and a packet, all in compiled code. Medians and the
slowest of batches of 1,000 ticks; parts take ticks batch by batch. What the USB costs is not in it: the last row is the
whole tick through the servo's own C functions, over a bridge that answers from memory.
"""

import statistics
import time
from typing import Any

import numpy as np

from study_app.devices.falcon.exchange import exchange_functions, new_exchange
from study_app.devices.falcon.mechanics.geometry import GEOMETRIES, SAFE_BOX_M, WORKSPACE_M
from study_app.devices.falcon.mechanics.kinematics import angles, forward, inverse, new_mechanism
from study_app.devices.falcon.sending import push
from study_app.devices.falcon.transport.bulk_calls import BULK, BulkCalls
from study_app.devices.falcon.wire.constants import ENDPOINT_IN, PACKET, ZERO
from study_app.devices.falcon.wire.packets import FLAGS_AT, PARSER, STATUS, feed, pack, strip
from study_app.haptics.kernels.c_functions import READ, WRITE, c_function, call_at, record_at
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.model.layout import new_command, new_reading, records

BATCH = 1_000
BATCHES = 400
SPEED_MPS = 0.3
LIMITS_NS = {"unpack + position + torques + pack": 3_000, "position (forward kinematics, warm)": 1_000}

REPLIES = np.dtype([("tick", np.int64), ("bytes", np.uint8, (BATCH, 2 + PACKET))], align=True)
_replies_at = record_at(REPLIES)
_byte_at = record_at(np.dtype([("value", np.uint8)]))
_count_at = record_at(np.dtype([("value", np.int32)]))
_read, _write = call_at(READ), call_at(WRITE)


def circling(mechanism: Any) -> Any:
    """Return replies (1,) record of a grip that circles and rises, as fast as ``SPEED_MPS``."""
    replies = records(REPLIES, 1)
    theta, packet = np.zeros(3), np.zeros(PACKET, np.uint8)
    radius = 0.9 * WORKSPACE_M[1]
    low, high = SAFE_BOX_M[2]
    for tick in range(BATCH):
        at = 2 * np.pi * round(BATCH * 0.001 * SPEED_MPS / (2 * np.pi * radius)) * tick / BATCH
        rise = 0.5 - 0.5 * np.cos(2 * np.pi * tick / BATCH)
        inverse(mechanism, np.array([radius * np.cos(at), radius * np.sin(at), low + (high - low) * rise]), theta)
        pack(np.round((theta - mechanism.zero_rad) / mechanism.rad_per_count).astype(int), 0, packet)
        packet[FLAGS_AT] = ZERO + 0b111_0000
        replies[0].bytes[tick, 2:] = packet
    return replies


def _bridge(handle: int, endpoint: int, data: int, length: int, transferred: int, _timeout_ms: int) -> int:
    _count_at(transferred).value = length
    if endpoint == ENDPOINT_IN:
        replies = _replies_at(handle)
        row = replies.tick % BATCH
        replies.tick += 1
        for k in range(2 + PACKET):
            _byte_at(data + k).value = replies.bytes[row, k]
        _count_at(transferred).value = 2 + PACKET
    return 0


@kernel
def unpack_all(replies: Any, scratch: Any, parser: Any, status: Any) -> Any:
    """Unpack every reply."""
    packets = 0
    for tick in range(BATCH):
        kept = strip(replies.bytes[tick], 2 + PACKET, scratch)
        packets += feed(parser, scratch, kept, status)
    return packets


@kernel
def place_all(falcon: Any, counts: Any) -> int:
    """Find every position, each from the one before."""
    failed = 0
    for tick in range(BATCH):
        angles(falcon.mechanism, counts[tick], falcon.theta)
        failed += forward(falcon.mechanism, falcon.theta, falcon.position_m)
    return failed


@kernel
def push_all(falcon: Any, forces: Any) -> Any:
    """Convert every force into motor units, where the grip is."""
    for tick in range(BATCH):
        for axis in range(3):
            falcon.force_n[axis] = forces[tick, axis]
        push(falcon)
    return falcon.units[0]


@kernel
def pack_all(falcon: Any) -> int:
    """Pack a packet, over and over."""
    for tick in range(BATCH):
        falcon.units[0] = tick
        pack(falcon.units, 1, falcon.packet)
    return int(falcon.packet[1])


@kernel
def tick_all(falcon: Any, replies: Any, forces: Any, scratch: Any, parser: Any, status: Any) -> int:
    """Do all of it, tick by tick."""
    failed = 0
    for tick in range(BATCH):
        kept = strip(replies.bytes[tick], 2 + PACKET, scratch)
        feed(parser, scratch, kept, status)
        angles(falcon.mechanism, status.encoders, falcon.theta)
        failed += forward(falcon.mechanism, falcon.theta, falcon.position_m)
        for axis in range(3):
            falcon.force_n[axis] = forces[tick, axis]
        push(falcon)
        pack(falcon.units, 1, falcon.packet)
    return failed


@kernel
def exchange_all(context: int, reading: int, command: Any, forces: Any, since_ns: int, read: int, write: int) -> int:
    """Take ticks as the servo does; return how many gave no position."""
    failed = 0
    for tick in range(BATCH):
        failed += _read(read, context, since_ns + tick * 1_000_000, reading)
        for axis in range(3):
            command[0].force_n[axis] = command[0].sent_n[axis] = forces[tick, axis]
        _write(write, context, np.intp(command.ctypes.data))
    return failed


def main() -> None:
    """Measure and print."""
    geometry = GEOMETRIES["libnifalcon"]
    mechanism = new_mechanism(geometry, 6616.0)
    replies = circling(mechanism)
    bridge = c_function(BULK, _bridge)
    memory = new_exchange(BulkCalls(int(replies.ctypes.data), int(bridge.address)), mechanism, geometry)
    falcon = memory[0]
    falcon.homed, falcon.pulled_out, falcon.share = 1, 1, 1.0
    forces = np.random.Generator(np.random.PCG64(1)).normal(0, 2, (BATCH, 3))
    scratch, parser, status = np.zeros(64, np.uint8), records(PARSER, 1)[0], records(STATUS, 1)[0]
    counts = np.zeros((BATCH, 3), np.int64)
    for tick in range(BATCH):
        feed(parser, replies[0].bytes[tick, 2:], PACKET, status)
        counts[tick] = status.encoders
    read, write = (function.address for function in exchange_functions())
    reading, command = new_reading(), new_command()
    parts = {
        "unpack (status bytes, parser)": lambda _: unpack_all(replies[0], scratch, parser, status),
        "position (forward kinematics, warm)": lambda _: place_all(falcon, counts),
        "torques (Jacobian, solve, motor units)": lambda _: push_all(falcon, forces),
        "pack": lambda _: pack_all(falcon),
        "unpack + position + torques + pack": lambda _: tick_all(falcon, replies[0], forces, scratch, parser, status),
        "the servo's read and write, no USB": lambda batch: exchange_all(
            memory.ctypes.data, reading.ctypes.data, command, forces, (1 + batch) * BATCH * 1_000_000, read, write
        ),
    }
    taken: dict[str, list[float]] = {name: [] for name in parts}
    for batch in range(BATCHES + 1):
        for name, part in parts.items():
            began = time.perf_counter_ns()
            part(batch)
            taken[name].append((time.perf_counter_ns() - began) / BATCH)
    print(f"{'ns a tick':40} {'median':>8} {'99 %':>8} {'limit':>8}")
    for name, all_ns in taken.items():
        kept = sorted(all_ns[1:])  # the first compiled
        limit = f"<= {LIMITS_NS[name]}" if name in LIMITS_NS else ""
        print(f"{name:40} {statistics.median(kept):8.0f} {kept[int(0.99 * len(kept))]:8.0f} {limit:>8}")
    print(f"\n{falcon.fresh} of {falcon.ticks} ticks gave a position")


if __name__ == "__main__":
    main()
