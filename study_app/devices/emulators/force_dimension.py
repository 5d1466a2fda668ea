"""The Force Dimension driver with emulated library functions, whose handle is that of the scripted device.

The part of the driver that runs in the servo is the real one: it calls these functions at their addresses; they are
compiled with the signatures of the maker's functions. No C compiler is needed. Opening a device through a loaded
library is not emulated.
"""

from functools import cache
from random import Random
from typing import Any, Self

import numpy as np

from study_app.devices.descriptor import OpenRequest
from study_app.devices.force_dimension.device import ForceDimensionDevice, Functions
from study_app.devices.force_dimension.exchange import BUTTONS, FILL, FUNCTIONS, PUSH, PUSH_ALL, STOP, TIMEGUARD, VECTOR
from study_app.devices.force_dimension.library import FORCE, FORCE_OFF_CAUSE
from study_app.devices.simulated import TREMOR_M, ScriptedDevice
from study_app.errors import DeviceError
from study_app.haptics.kernels import READ, READ_NEW, WRITE, c_function, call_at, record_at
from study_app.haptics.model.layout import COMMAND, MEASURED_VELOCITY, READING, new_command, new_reading, records

NO_FAULT, FAULT_ERROR, FAULT_NAN, FAULT_FORCE_OFF, FAULT_TIMEGUARD = range(5)
FAULTS = {"error": FAULT_ERROR, "nan": FAULT_NAN, "force-off": FAULT_FORCE_OFF, "time-guard": FAULT_TIMEGUARD}
_FAULT_AFTER = 1000  # readings
_VELOCITY_THRESHOLD = 2  # cause of a switched-off force: dhdc.h 3.17.5, line 202

EMULATED = np.dtype(
    [
        ("clock", np.intp),  # address of the time [ns]
        ("force_on", np.int64),
        ("fault", np.int64),
        ("fault_after", np.int64),  # number of readings before the fault begins
        ("read", np.intp),  # functions of the simulated device
        ("write", np.intp),
        ("context", np.intp),
        ("reading", READING),
        ("command", COMMAND),
    ],
    align=True,
)
_TIME = np.dtype([("ns", np.int64)])
_NUMBER = np.dtype([("value", np.float64)])
_WORD = np.dtype([("value", np.int32)])
_emulated_at, _time_at = record_at(EMULATED), record_at(_TIME)
_number_at, _word_at = record_at(_NUMBER), record_at(_WORD)
_call_read, _call_write = call_at(READ), call_at(WRITE)
_fields = EMULATED.fields
assert _fields is not None  # noqa: S101 - it is a record
_READING, _COMMAND = int(_fields["reading"][1]), int(_fields["command"][1])


class _EmulatedFunctions:
    """The emulated library functions of one device, whose handle is that of ``hand``."""

    def __init__(self, hand: ScriptedDevice) -> None:
        self.memory = records(EMULATED, 1)
        self.state = self.memory[0]
        self.id = int(self.memory.ctypes.data)
        self.state.reading = new_reading()[0]
        self.state.command = new_command()[0]
        self.state.read, self.state.write = hand.read.address, hand.write.address
        self.state.context = hand.context
        self._hand = hand

    def prepare(self, force_limit_n: float) -> dict[str, Any]:
        self.state.force_on = 1
        absent, hand_dynamics = ("wrist", "gripper", "active_wrist", "active_gripper"), self._hand.dynamics
        dynamics = {
            "delay_s": hand_dynamics.delay_s,
            "count_m": hand_dynamics.count_m,
            "mass_kg": hand_dynamics.mass_kg,
        }
        return {"sdk": None, "system": "emulated"} | dict.fromkeys(absent, False) | dynamics

    def address(self, name: str) -> int:
        return int(_functions()[name].address)

    def set_fault(self, fault: str, after: int = 0) -> None:
        """Simulate a fault that begins after ``after`` readings.

        Raises
        ------
        DeviceError
            There is no such fault.
        """
        if fault not in FAULTS:
            raise DeviceError(f"fault '{fault}' is not known; choose from: {', '.join(FAULTS)}")
        self.state.fault, self.state.fault_after = FAULTS[fault], after

    def close(self) -> bool:
        self._hand.close()
        return True


class EmulatedForceDimension(ForceDimensionDevice):
    """An emulated Force Dimension device; ``hand`` takes the orders of a simulated participant.

    Parameters
    ----------
    random : random numbers for the hand's tremor; None: fixed ones
    tremor_m : amplitude of the tremor's waves [m]
    given : further arguments of `ForceDimensionDevice`
    """

    name = "force-dimension-emulated"
    ends_force = None  # it ends with the program

    def __init__(self, random: Random | None = None, *, tremor_m: float = TREMOR_M, **given: Any) -> None:
        super().__init__(**given)
        limits: dict[str, Any] = {"workspace_m": self.workspace_m, "force_limit_n": self.force_limit_n}
        self.hand = ScriptedDevice(random, tremor_m=tremor_m, **limits)
        self.hand.measure_velocity()
        self.emulated = _EmulatedFunctions(self.hand)
        self.emulated.state.clock = self.context  # the record there begins with the time of the tick

    @classmethod
    def of(cls, request: OpenRequest) -> Self:
        return cls(request.random, **request.limits)

    def take_fault(self, fault: str) -> None:
        self.emulated.set_fault(fault, _FAULT_AFTER)

    def _connect(self) -> Functions:
        return self.emulated


@cache
def _functions() -> dict[str, Any]:
    """Compile the emulated functions; return them by the maker's names."""
    compiled = {
        "get_position": c_function(VECTOR, _get_position),
        "get_velocity": c_function(VECTOR, _get_velocity),
        "get_orientation": c_function(FILL, _not_available),
        "get_gripper": c_function(FILL, _not_available),
        "get_buttons": c_function(BUTTONS, _get_buttons),
        "get_status": c_function(FILL, _get_status),
        "set_force": c_function(PUSH, _set_force),
        "set_all_forces": c_function(PUSH_ALL, _set_all_forces),
        "stop": c_function(STOP, _stop),
    }
    return {FUNCTIONS[field]: function for field, function in compiled.items()}


def _get_position(x_at: int, y_at: int, z_at: int, device: int) -> int:
    """Write the position in the maker's axes: x toward the participant, y to the right, z up."""
    state = _emulated_at(device)
    faulty = False
    if state.fault != NO_FAULT:
        state.fault_after -= 1
        faulty = state.fault_after < 0
    if faulty and state.fault == FAULT_TIMEGUARD:
        return TIMEGUARD
    if faulty and state.fault == FAULT_ERROR:
        return -1
    if faulty and state.fault == FAULT_FORCE_OFF:
        state.force_on = 0
    state.reading.measured = 0
    status = np.int32(_call_read(state.read, state.context, _time_at(state.clock).ns, device + _READING))
    if status != READ_NEW:
        return TIMEGUARD if status > READ_NEW else -1
    position_m = state.reading.position_m
    _number_at(x_at).value = np.nan if faulty and state.fault == FAULT_NAN else position_m[2]
    _number_at(y_at).value = position_m[0]
    _number_at(z_at).value = position_m[1]
    return 0


def _get_velocity(x_at: int, y_at: int, z_at: int, device: int) -> int:
    reading = _emulated_at(device).reading
    if reading.measured & MEASURED_VELOCITY == 0:
        return -1
    _number_at(x_at).value = reading.velocity_mps[2]
    _number_at(y_at).value = reading.velocity_mps[0]
    _number_at(z_at).value = reading.velocity_mps[1]
    return 0


def _not_available(address: int, device: int) -> int:
    return -1


def _get_buttons(device: int) -> Any:
    return np.uint32(_emulated_at(device).reading.buttons)


def _get_status(status_address: int, device: int) -> int:
    state = _emulated_at(device)
    _word_at(status_address + 4 * FORCE).value = state.force_on
    _word_at(status_address + 4 * FORCE_OFF_CAUSE).value = 0 if state.force_on != 0 else _VELOCITY_THRESHOLD
    return 0


def _set_force(x_n: float, y_n: float, z_n: float, device: int) -> Any:
    state = _emulated_at(device)
    force_n = state.command.force_n
    on = 1.0 if state.force_on != 0 else 0.0
    force_n[0], force_n[1], force_n[2] = on * y_n, on * z_n, on * x_n
    return np.int32(_call_write(state.write, state.context, device + _COMMAND))


def _set_all_forces(
    x_n: float, y_n: float, z_n: float, torque_x: float, torque_y: float, torque_z: float, grip_n: float, device: int
) -> int:
    return -1


def _stop(device: int) -> Any:
    """Turn the force off; the handle is free."""
    state = _emulated_at(device)
    state.force_on = 0
    for axis in range(3):
        state.command.force_n[axis] = 0.0
    return np.int32(_call_write(state.write, state.context, device + _COMMAND))
