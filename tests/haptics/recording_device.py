"""A device for tests: moves evenly, remembers every force written to it, and fails on command."""

import numpy as np

from study_app.haptics.kernels.c_functions import (
    READ,
    READ_LOST,
    READ_NEW,
    READ_NOTHING_NEW,
    WRITE,
    WRITE_SATURATED,
    c_function,
    fence,
    record_at,
)
from study_app.haptics.model.device_dynamics import UNKNOWN
from study_app.haptics.model.layout import COMMAND, READING, records

WRITES = 8192

PROBE = np.dtype(
    [
        ("velocity_mps", np.float64, (3,)),
        ("began_ns", np.int64),
        ("reads", np.int64),
        ("writes", np.int64),
        ("lost_at_read", np.int64),
        ("lost_at_write", np.int64),
        ("silent_from_read", np.int64),
        ("bad_at_read", np.int64),
        ("stall_at_read", np.int64),
        ("stall_ns", np.int64),
        ("buttons", np.int64),
        ("delay_ticks", np.int64),  # as it says it measured it
        ("share_sent", np.float64),  # of the force, as it says
        ("saturates", np.int64),  # 1 where it says that its motors saturate
        ("measured", np.int64),  # what it says it measured, of the following
        ("measured_mps", np.float64, (3,)),
        ("orientation", np.float64, (4,)),
        ("gripper_m", np.float64),
        ("clock_ahead_ns", np.int64),  # its own clock, before that of the servo
        ("held_when_lost_n", np.float64),  # along x, as it says once it was lost
        ("hangs", np.int64),  # while not 0, a reading does not end
        ("clock", np.intp),
        ("forces_n", np.float64, (WRITES, 3)),
    ],
    align=True,
)
CLOCK = np.dtype([("now_ns", np.int64)], align=True)
NEVER = 1 << 60

_probe_at = record_at(PROBE)
_reading_at = record_at(READING)
_command_at = record_at(COMMAND)
_clock_at = record_at(CLOCK)


def _read(context, now_ns, reading):
    probe = _probe_at(context)
    probe.reads += 1
    if probe.reads == 1:
        probe.began_ns = now_ns
    if probe.reads == probe.stall_at_read:
        _clock_at(probe.clock).now_ns += probe.stall_ns
    while probe.hangs != 0:
        fence()
    if probe.reads >= probe.lost_at_read:
        return READ_LOST
    if probe.reads >= probe.silent_from_read:
        return READ_NOTHING_NEW
    out = _reading_at(reading)
    for axis in range(3):
        out.position_m[axis] = probe.velocity_mps[axis] * (now_ns - probe.began_ns) * 1e-9
    out.buttons = probe.buttons
    out.delay_ticks = probe.delay_ticks
    out.measured = probe.measured
    for axis in range(3):
        out.velocity_mps[axis] = probe.measured_mps[axis]
    for part in range(4):
        out.orientation[part] = probe.orientation[part]
    out.gripper_m = probe.gripper_m
    out.device_time_ns = now_ns + probe.clock_ahead_ns
    if probe.reads == probe.bad_at_read:
        out.position_m[1] = np.nan
    return READ_NEW


def _write(context, command):
    probe, row = _probe_at(context), _command_at(command)
    force = probe.forces_n[probe.writes % WRITES]
    for axis in range(3):
        force[axis] = row.force_n[axis]
        if probe.share_sent != 1.0:
            row.sent_n[axis] = probe.share_sent * row.force_n[axis]
    probe.writes += 1
    if probe.reads >= probe.lost_at_read and probe.held_when_lost_n != 0.0:
        row.sent_n[0] = probe.held_when_lost_n
    if probe.writes >= probe.lost_at_write:
        return READ_LOST
    return WRITE_SATURATED if probe.saturates else 0


class Probe:
    """A device that moves at ``velocity_mps`` from its first reading; pass its memory to share it with a process."""

    name = "probe"
    force_limit_n = 8.0
    failure = None
    read = c_function(READ, _read)
    write = c_function(WRITE, _write)

    def __init__(self, velocity_mps=(0.2, 0.0, 0.0), memory=None, dynamics=UNKNOWN):
        self.dynamics = dynamics
        self.memory = records(PROBE, 1) if memory is None else memory
        self.state = self.memory[0]
        self.state.velocity_mps = velocity_mps
        self.state.delay_ticks = -1
        self.state.share_sent = 1.0
        for name in ("lost_at_read", "lost_at_write", "silent_from_read", "bad_at_read", "stall_at_read"):
            self.state[name] = NEVER
        self.context = self.memory.ctypes.data

    @property
    def forces_n(self):
        return self.state.forces_n[: self.state.writes].copy()

    def stall(self, clock, at_read, stall_ns):
        """Make one reading take ``stall_ns`` of virtual time."""
        self.state.clock, self.state.stall_at_read, self.state.stall_ns = clock.context, at_read, stall_ns
