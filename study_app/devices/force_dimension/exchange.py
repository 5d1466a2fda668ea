"""The compiled tick of a Force Dimension device, which calls the maker's functions at their addresses.

Each call communicates with the device over USB before it returns. The library's time guard answers some readings from
memory (``TIMEGUARD``); such a reading is not new. Any failure ends the exchange at once: zero force is sent, then
``dhdStop``, which switches off the motors' current.

The maker's axes are x toward the participant, y to the right, z up (examples of the SDK; CHAI3D 3.3.0), a permutation
of those of the hand frame: see ``_from_maker``.
"""

import math
from functools import cache
from typing import Any, Final

import numpy as np
from numba import types

from study_app.devices.driver import COMMON, FIRST_CAUSE, closed_during_call, enter, leave
from study_app.devices.force_dimension.library import FORCE, FORCE_OFF_CAUSE, STATUS_WORDS
from study_app.haptics.kernels import (
    READ_LOST,
    READ_NEW,
    READ_NOTHING_NEW,
    WRITE_SATURATED,
    call_at,
    clear,
    command_at,
    copy,
    device_functions,
    is_finite,
    kernel,
    reading_at,
    record_at,
)
from study_app.haptics.model import layout

# The library's functions end with the device's id (``char ID``). It is passed as a whole word: a C function uses
# the low byte of the register, and the emulated functions use the word as the address of their memory.
VECTOR = types.int32(types.intp, types.intp, types.intp, types.intp)
"""``dhdGetPosition``, ``dhdGetLinearVelocity`` (dhdc.h 3.17.5, lines 264 and 285)."""
FILL = types.int32(types.intp, types.intp)
"""``dhdGetOrientationFrame``, ``dhdGetGripperGap``, ``dhdGetStatus`` (lines 274, 277 and 241)."""
BUTTONS = types.uint32(types.intp)
"""``dhdGetButtonMask`` (line 247)."""
PUSH = types.int32(types.float64, types.float64, types.float64, types.intp)
"""``dhdSetForce`` (line 266)."""
PUSH_ALL = types.int32(*(types.float64,) * 7, types.intp)
"""``dhdSetForceAndTorqueAndGripperForce`` (line 282)."""
STOP = types.int32(types.intp)
"""``dhdStop`` (line 229)."""

TIMEGUARD, MOTOR_SATURATED = 1, 2  # dhdc.h 160, 161
_STATUS_TICKS: Final = 32
"""Number of ticks between reads of the status."""
_NORM_SLACK = 1.001

ERROR, BAD_NUMBER, FORCE_OFF, UNGUARDED = range(FIRST_CAUSE, FIRST_CAUSE + 4)  # reasons for the end of the exchange

_FORCE_DIMENSION = np.dtype(
    [
        *COMMON,
        ("id", np.intp),  # of the device, for every function
        ("get_position", np.intp),  # addresses of the functions
        ("get_velocity", np.intp),
        ("get_orientation", np.intp),
        ("get_gripper", np.intp),
        ("get_buttons", np.intp),
        ("get_status", np.intp),
        ("set_force", np.intp),
        ("set_all_forces", np.intp),
        ("stop", np.intp),
        ("wrist", np.int64),  # 1 if it measures orientation
        ("gripper", np.int64),  # 1 if it has a gripper
        ("active", np.int64),  # 1 if wrist or gripper have motors, whose torque and force are kept at 0
        ("off_cause", np.int64),  # the device's reason for a switched-off force
        ("pushes", np.int64),  # 1 if neither zero force nor ``dhdStop`` was accepted at the end
        # memory filled by the library
        ("position_m", np.float64, (3,)),
        ("velocity_mps", np.float64, (3,)),
        ("rotation", np.float64, (3, 3)),
        ("gap_m", np.float64),
        ("status", np.int32, (STATUS_WORDS,)),
        # counters
        ("guarded", np.int64),  # ticks without a new position because of the library's time guard
        ("saturated", np.int64),  # forces that the motors could not produce, according to the library
    ],
    align=True,
)
COUNTERS: Final = ("ticks", "fresh", "guarded", "saturated")
FUNCTIONS: Final = {
    "get_position": "dhdGetPosition",
    "get_velocity": "dhdGetLinearVelocity",
    "get_orientation": "dhdGetOrientationFrame",
    "get_gripper": "dhdGetGripperGap",
    "get_buttons": "dhdGetButtonMask",
    "get_status": "dhdGetStatus",
    "set_force": "dhdSetForce",
    "set_all_forces": "dhdSetForceAndTorqueAndGripperForce",
    "stop": "dhdStop",
}

_device_at = record_at(_FORCE_DIMENSION)
_call_vector, _call_fill, _call_buttons = (call_at(VECTOR), call_at(FILL), call_at(BUTTONS))
_call_push, _call_push_all, _call_stop = (call_at(PUSH), call_at(PUSH_ALL), call_at(STOP))
_fields = _FORCE_DIMENSION.fields
assert _fields is not None  # noqa: S101 - it is a record
_POSITION, _VELOCITY, _ROTATION, _GAP, _STATUS = (
    int(_fields[name][1]) for name in ("position_m", "velocity_mps", "rotation", "gap_m", "status")
)


def new_exchange(force_limit_n: float) -> Any:
    """Return the memory of an exchange, shape (1,), without a device: its address is the device's ``context``."""
    memory = layout.records(_FORCE_DIMENSION, 1)
    memory[0].force_limit_n = force_limit_n
    return memory


@cache
def exchange_functions() -> tuple[Any, Any]:
    """Compile read and write, once for all devices."""
    return device_functions(_read, _write)


def _read(context: int, now_ns: int, reading: int) -> int:
    device = _device_at(context)
    answer = READ_LOST
    if enter(device):
        answer = _take_sample(device, context, now_ns, reading_at(reading))
        if closed_during_call(device):
            finish(device, context)
        leave(device)
    return answer


def _write(context: int, command: int) -> int:
    device, record = _device_at(context), command_at(command)
    answer = READ_LOST
    if enter(device):
        answer = _send_force(device, context, record.force_n)
        if closed_during_call(device):
            finish(device, context)
        leave(device)
    copy(device.sent_n, record.sent_n)
    return answer


@kernel
def finish(device: Any, _context: int) -> None:
    """Send zero force and switch off the motors' current."""
    accepted_zero = _push(device, 0.0, 0.0, 0.0) >= 0
    accepted_stop = np.int32(_call_stop(device.stop, device.id)) >= 0
    device.pushes = 0 if accepted_zero or accepted_stop else 1
    clear(device.sent_n)


@kernel
def _take_sample(device: Any, context: int, now_ns: int, out: Any) -> int:
    device.now_ns = now_ns
    device.ticks += 1
    if device.unguarded != 0:
        return _end_exchange(device, context, UNGUARDED)
    if device.ticks % _STATUS_TICKS == 0:
        if np.int32(_call_fill(device.get_status, context + _STATUS, device.id)) < 0:
            return _end_exchange(device, context, ERROR)
        if device.status[FORCE] == 0:
            device.off_cause = device.status[FORCE_OFF_CAUSE]
            return _end_exchange(device, context, FORCE_OFF)
    address = context + _POSITION
    status = np.int32(_call_vector(device.get_position, address, address + 8, address + 16, device.id))
    if status < 0:
        return _end_exchange(device, context, ERROR)
    if status == TIMEGUARD:
        device.guarded += 1
        return READ_NOTHING_NEW
    if not is_finite(device.position_m):
        return _end_exchange(device, context, BAD_NUMBER)
    device.fresh += 1
    device.fresh_ns = now_ns
    _from_maker(device.position_m, out.position_m)
    out.buttons = np.int64(np.uint32(_call_buttons(device.get_buttons, device.id)))
    address = context + _VELOCITY
    if np.int32(_call_vector(device.get_velocity, address, address + 8, address + 16, device.id)) >= 0 and is_finite(
        device.velocity_mps
    ):
        _from_maker(device.velocity_mps, out.velocity_mps)
        out.measured |= layout.MEASURED_VELOCITY
    if (
        device.wrist != 0
        and np.int32(_call_fill(device.get_orientation, context + _ROTATION, device.id)) >= 0
        and _put_quaternion(device.rotation, out.orientation)
    ):
        out.measured |= layout.MEASURED_ORIENTATION
    if (
        device.gripper != 0
        and np.int32(_call_fill(device.get_gripper, context + _GAP, device.id)) >= 0
        and math.isfinite(device.gap_m)
    ):
        out.gripper_m = device.gap_m
        out.measured |= layout.MEASURED_GRIPPER
    return READ_NEW


@kernel
def _from_maker(vector: Any, out: Any) -> None:
    """Convert a vector from the maker's axes (toward the participant, right, up) to the hand frame."""
    out[0], out[1], out[2] = vector[1], vector[2], vector[0]


@kernel
def _put_quaternion(rotation: Any, out: Any) -> bool:
    """Convert a rotation matrix of the maker's axes to a unit quaternion w, x, y, z of the hand frame; False: invalid.

    Shepperd's method: the largest of w^2, x^2, y^2, z^2 is found first (S. W. Shepperd, J. Guidance and Control 1,
    1978, 223). Turning the axes by a permutation permutes the vector part alike.
    """
    trace = rotation[0, 0] + rotation[1, 1] + rotation[2, 2]
    i = 0
    for axis in range(1, 3):
        if rotation[axis, axis] > rotation[i, i]:
            i = axis
    j, k = (i + 1) % 3, (i + 2) % 3
    if trace >= rotation[i, i]:
        w = 1.0 + trace
        out[1] = rotation[2, 1] - rotation[1, 2]
        out[2] = rotation[0, 2] - rotation[2, 0]
        out[3] = rotation[1, 0] - rotation[0, 1]
    else:
        w = rotation[k, j] - rotation[j, k]
        out[1 + i] = 1.0 + 2.0 * rotation[i, i] - trace
        out[1 + j] = rotation[i, j] + rotation[j, i]
        out[1 + k] = rotation[i, k] + rotation[k, i]
    x, y, z = out[1], out[2], out[3]
    size = math.sqrt(w * w + x * x + y * y + z * z)
    if not (size > 0.0 and math.isfinite(size)):
        return False
    out[0], out[1], out[2], out[3] = w / size, y / size, z / size, x / size
    return True


@kernel
def _send_force(device: Any, context: int, force_n: Any) -> int:
    if device.unguarded != 0:
        return _end_exchange(device, context, UNGUARDED)
    x_n, y_n, z_n = force_n[0], force_n[1], force_n[2]
    square = x_n * x_n + y_n * y_n + z_n * z_n
    max_n = _NORM_SLACK * device.force_limit_n
    if not square <= max_n * max_n:  # nor NaN: the servo sends neither
        x_n = y_n = z_n = 0.0
    status = _push(device, x_n, y_n, z_n)
    if status < 0:
        return _end_exchange(device, context, ERROR)
    device.sent_n[0], device.sent_n[1], device.sent_n[2] = x_n, y_n, z_n
    if status == MOTOR_SATURATED:
        device.saturated += 1
        return WRITE_SATURATED
    return 0


@kernel
def _push(device: Any, x_n: float, y_n: float, z_n: float) -> Any:
    """Send a force of the hand frame in the maker's axes; motors of wrist and gripper get 0."""
    if device.active != 0:
        return np.int32(_call_push_all(device.set_all_forces, z_n, x_n, y_n, 0.0, 0.0, 0.0, 0.0, device.id))
    return np.int32(_call_push(device.set_force, z_n, x_n, y_n, device.id))


@kernel
def _end_exchange(device: Any, context: int, cause: int) -> int:
    finish(device, context)
    device.ended = cause
    return READ_LOST
