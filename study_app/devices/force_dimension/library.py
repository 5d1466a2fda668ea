"""The maker's installed library: how it is found and loaded, and the calls that open and close a device.

Signatures follow ``dhdc.h`` and ``drdc.h`` of the Force Dimension SDK 3.17.5 (public in CHAI3D 3.3.0,
``externals/DHD/include``); this program contains nothing of the maker's. Importing this module loads
no compiler.
"""

import ctypes
import math
import os
import sys
import time
from collections.abc import Sequence
from ctypes import POINTER, c_bool, c_byte, c_char_p, c_double, c_int, c_ubyte, c_uint, c_ushort, c_void_p
from pathlib import Path
from typing import Any, Final, Self

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.devices.doctor import DeviceFailure, read_failures

VARIABLE: Final = "LIQUID_STUDY_DHD_LIBRARY"
OPTION: Final = "dhd-library"

FAILURES: Final = read_failures(Path(__file__).with_name("failures.toml"))
CAUSES: Final = {
    1: "force button",
    2: "velocity threshold",
    3: "watchdog",
    4: "software",
    5: "USB disconnected",
    6: "dead-man switch",
}
"""Texts of the status FORCE_OFF_CAUSE: dhdc.h 3.17.5, lines 199 to 206."""


_OUT: Final = POINTER(c_double)
_SIGNATURES: Final[dict[str, tuple[Any, tuple[Any, ...]]]] = {
    "dhdErrorGetLastStr": (c_char_p, ()),  # dhdc.h 74
    "dhdGetDeviceCount": (c_int, ()),  # 218
    "dhdGetSerialNumber": (c_int, (POINTER(c_ushort), c_byte)),  # 222
    "dhdOpen": (c_int, ()),  # 223
    "dhdOpenSerial": (c_int, (c_int,)),  # 225
    "dhdClose": (c_int, (c_byte,)),  # 227
    "dhdStop": (c_int, (c_byte,)),  # 229
    "dhdGetComMode": (c_int, (c_byte,)),  # 230
    "dhdEnableForce": (c_int, (c_ubyte, c_byte)),  # 231
    "dhdGetSystemType": (c_int, (c_byte,)),  # 233
    "dhdGetSystemName": (c_char_p, (c_byte,)),  # 235
    "dhdGetSDKVersion": (None, (POINTER(c_int),) * 4),  # 238
    "dhdGetStatus": (c_int, (POINTER(c_int), c_byte)),  # 241
    "dhdGetEffectorMass": (c_int, (_OUT, c_byte)),  # 244
    "dhdGetButtonMask": (c_uint, (c_byte,)),  # 247
    "dhdHasWrist": (c_bool, (c_byte,)),  # 251
    "dhdHasActiveWrist": (c_bool, (c_byte,)),  # 252
    "dhdHasGripper": (c_bool, (c_byte,)),  # 253
    "dhdHasActiveGripper": (c_bool, (c_byte,)),  # 254
    "dhdSetGravityCompensation": (c_int, (c_int, c_byte)),  # 259
    "dhdGetPosition": (c_int, (_OUT, _OUT, _OUT, c_byte)),  # 264
    "dhdSetForce": (c_int, (c_double, c_double, c_double, c_byte)),  # 266
    "dhdGetOrientationFrame": (c_int, (_OUT, c_byte)),  # 274: double matrix[3][3]
    "dhdGetGripperGap": (c_int, (_OUT, c_byte)),  # 277
    "dhdSetForceAndTorqueAndGripperForce": (c_int, (*(c_double,) * 7, c_byte)),  # 282
    "dhdGetLinearVelocity": (c_int, (_OUT, _OUT, _OUT, c_byte)),  # 285
    "dhdGetMaxForce": (c_double, (c_byte,)),  # 306
    "dhdEnableExpertMode": (c_int, ()),  # 315
    "dhdDisableExpertMode": (c_int, ()),  # 316
    "dhdSetTimeGuard": (c_int, (c_int, c_byte)),  # 319
    "dhdGetVelocityThreshold": (c_int, (POINTER(c_uint), c_byte)),  # 321
    "dhdDeltaEncoderToPosition": (c_int, (c_int, c_int, c_int, _OUT, _OUT, _OUT, c_byte)),  # 331
    "dhdDeltaPositionToEncoder": (c_int, (c_double, c_double, c_double, *(POINTER(c_int),) * 3, c_byte)),  # 332
    "dhdDeltaEncodersToJointAngles": (c_int, (c_int, c_int, c_int, _OUT, _OUT, _OUT, c_byte)),  # 355
    "dhdGetJointAngles": (c_int, (_OUT, c_byte)),  # 366: double j[DHD_MAX_DOF]
    "dhdJointAnglesToInertiaMatrix": (c_int, (_OUT, _OUT, c_byte)),  # 369: double inertia[6][6]
    "dhdSetWatchdog": (c_int, (c_ubyte, c_byte)),  # 373
    "dhdGetWatchdog": (c_int, (POINTER(c_ubyte), c_byte)),  # 374
    "drdIsInitialized": (c_bool, (c_byte,)),  # drdc.h 41
}
_MAX_JOINTS: Final = 8  # DHD_MAX_DOF, dhdc.h 128
_SYNC_MODE: Final = 0  # DHD_COM_MODE_SYNC, dhdc.h 194
_ROUND_TRIPS: Final = 50
_COUNT_STEP: Final = 10
"""Number of counts of each encoder over which the handle's motion is computed."""
_COUNT_RANGE_M: Final = (1e-7, 1e-3)
_MASS_RANGE_KG: Final = (0.01, 5.0)
"""Ranges of plausible values; values outside count as unknown."""
STATUS_WORDS: Final = 32
"""Room for more than the DHD_MAX_STATUS (17) words of 3.17.5 (dhdc.h 164)."""
RESET, FORCE, FORCE_OFF_CAUSE = 3, 5, 14  # dhdc.h 170, 172, 181
_DEFAULT_TIME_GUARD: Final = -1
LONGEST_WATCHDOG: Final = 255
_WATCHDOG_S: Final = 125e-6
"""Unit of the watchdog: documentation of forcedimension_core 1.0.0, expert.setWatchdog; CHAI3D 3.3.0 sets 255, too."""
_ENABLE_TIMEOUT_S: Final = 0.5
_CAN: Final = "force up to the device's own limit, through the manufacturer's library; not yet tested on hardware"


class Library:
    """The maker's library, loaded.

    Parameters
    ----------
    path : path of the library; None: that of the environment variable, else the usual names
    """

    id = -1  # of the open device

    def __init__(self, path: str | Path | None = None) -> None:
        self._functions = _load_library(path)
        missing = [name for name in _SIGNATURES if not hasattr(self._functions, name)]
        if missing:
            raise FAILURES.failure("old-library", ", ".join(missing))
        for name, (result_type, argument_types) in _SIGNATURES.items():
            function = getattr(self._functions, name)
            function.restype, function.argtypes = result_type, argument_types

    @property
    def version(self) -> str:
        numbers = [c_int() for _ in range(4)]
        self._functions.dhdGetSDKVersion(*numbers)
        return ".".join(str(number.value) for number in numbers)

    @property
    def devices(self) -> int:
        return int(self._functions.dhdGetDeviceCount())

    def address(self, name: str) -> int:
        return int(ctypes.cast(getattr(self._functions, name), c_void_p).value or 0)

    def open(self, serial: str) -> Self:
        """Open the device with this serial number; "": the first one.

        Raises
        ------
        DeviceFailure
            No device can be opened.
        """
        device_id = self._functions.dhdOpenSerial(int(serial)) if serial else self._functions.dhdOpen()
        if device_id < 0:
            raise FAILURES.failure("no-device", self._last_error())
        self.id = int(device_id)
        return self

    def prepare(self, force_limit_n: float) -> dict[str, Any]:
        """Check an open device, keep its safety functions on, and enable its force; return the fields for the receipt.

        Raises
        ------
        DeviceFailure
            The device is not calibrated, not safe, or its force cannot be enabled.
        """
        call, device = self._functions, self.id
        if not call.drdIsInitialized(device) or self._read_status()[RESET]:
            raise FAILURES.failure("uncalibrated")
        max_n = float(call.dhdGetMaxForce(device))
        if 0.0 <= max_n < force_limit_n:
            raise FAILURES.failure("max-force", f"{max_n:g} N instead of {force_limit_n:g} N")
        safety = self._enable_safety()
        call.dhdSetGravityCompensation(1, device)
        self._enable_force()
        serial, mass = c_ushort(), c_double()
        has_serial = call.dhdGetSerialNumber(serial, device) >= 0
        has_mass = call.dhdGetEffectorMass(mass, device) >= 0 and math.isfinite(mass.value)
        return {
            "sdk": self.version,
            "system": (call.dhdGetSystemName(device) or b"").decode(errors="replace"),
            "system_type": int(call.dhdGetSystemType(device)),
            "serial": str(serial.value) if has_serial else None,
            "wrist": bool(call.dhdHasWrist(device)),
            "gripper": bool(call.dhdHasGripper(device)),
            "active_wrist": bool(call.dhdHasActiveWrist(device)),
            "active_gripper": bool(call.dhdHasActiveGripper(device)),
            "gravity_compensation": True,
            "effector_mass_kg": mass.value if has_mass else None,
            "max_force_n": max_n if max_n >= 0.0 else None,
            **safety,
            **self._measure_dynamics(),
        }

    def close(self) -> bool:
        """End the force and close the device; return whether it accepted the end."""
        answers = self._functions.dhdSetForce(0.0, 0.0, 0.0, self.id), self._functions.dhdStop(self.id)
        self._functions.dhdClose(self.id)
        return any(answer >= 0 for answer in answers)

    def _enable_safety(self) -> dict[str, Any]:
        """Enable the safety functions and return their state; a watchdog is set to its longest time, 32 ms."""
        call, device, threshold, watchdog = self._functions, self.id, c_uint(), c_ubyte()
        call.dhdEnableExpertMode()
        try:
            if call.dhdSetTimeGuard(_DEFAULT_TIME_GUARD, device) < 0:
                raise FAILURES.failure("safety", f"time guard: {self._last_error()}")
            if call.dhdGetVelocityThreshold(threshold, device) < 0 or threshold.value == 0:
                raise FAILURES.failure("safety", f"the velocity threshold is {threshold.value}")
            has_watchdog = (
                call.dhdSetWatchdog(LONGEST_WATCHDOG, device) >= 0 and call.dhdGetWatchdog(watchdog, device) >= 0
            )
        finally:
            call.dhdDisableExpertMode()
        return {
            "time_guard": "default",
            "velocity_threshold": threshold.value,
            "watchdog_s": watchdog.value * _WATCHDOG_S if has_watchdog and watchdog.value else None,
        }

    def _measure_dynamics(self) -> dict[str, Any]:
        """Return delay [s], encoder count [m] and least mass [kg] at the handle; None for those that are unknown."""
        mode = int(self._functions.dhdGetComMode(self.id))
        round_trip_s = self._round_trip_s()
        self._functions.dhdEnableExpertMode()
        try:
            count_m, mass_kg = self._centre_dynamics()
        finally:
            self._functions.dhdDisableExpertMode()
        # In modes other than SYNC, the next exchange begins during the last one, so a position may be that much older.
        delay_s = round_trip_s if round_trip_s is None or mode == _SYNC_MODE else 2 * round_trip_s
        return {"com_mode": mode, "delay_s": delay_s, "count_m": count_m, "mass_kg": mass_kg}

    def _round_trip_s(self) -> float | None:
        """Return the 90th percentile of the time from a zero force to a new position [s]."""
        call, device, times_s = self._functions, self.id, []
        position = [c_double() for _ in range(3)]
        for _ in range(_ROUND_TRIPS):
            time.sleep(0.001)  # sooner, the time guard would answer from memory
            began_s = time.perf_counter()
            call.dhdSetForce(0.0, 0.0, 0.0, device)
            status = call.dhdGetPosition(*position, device)
            if status < 0:
                raise FAILURES.failure("error", f"dhdGetPosition: {self._last_error()}")
            if status == 0:
                times_s.append(time.perf_counter() - began_s)
        return sorted(times_s)[int(0.9 * len(times_s))] if times_s else None

    def _centre_dynamics(self) -> tuple[float | None, float | None]:
        """Return the longest motion within an encoder count [m] and the least mass [kg] at the centre of the workspace.

        Both are computed with the maker's kinematics and inertia matrix for this model and its calibration, which are
        not documented. A value is None if the library cannot compute it or if it is implausible.
        """
        import numpy as np  # noqa: PLC0415 - the guard, which loads this module, needs no arrays

        call, device, encoders = self._functions, self.id, [c_int() for _ in range(3)]
        if call.dhdDeltaPositionToEncoder(0.0, 0.0, 0.0, *encoders, device) < 0:
            return None, None
        counts = [encoder.value for encoder in encoders]
        positions = []
        for axis in range(-1, 3):
            position = [c_double() for _ in range(3)]
            shifted = (count + _COUNT_STEP * (axis == i) for i, count in enumerate(counts))
            if call.dhdDeltaEncoderToPosition(*shifted, *position, device) < 0:
                return None, None
            positions.append([coordinate.value for coordinate in position])
        rates_m = (np.array(positions[1:]) - positions[0]).T / _COUNT_STEP
        max_motion_m = float(np.linalg.norm(rates_m, 2)) if np.isfinite(rates_m).all() else math.nan
        joints, inertia = (c_double * _MAX_JOINTS)(), (c_double * 36)()
        arms = [c_double() for _ in range(3)]
        if call.dhdGetJointAngles(joints, device) < 0 or call.dhdDeltaEncodersToJointAngles(*counts, *arms, device) < 0:
            return _value_within(max_motion_m, _COUNT_RANGE_M), None
        joints[:3] = [arm.value for arm in arms]
        if call.dhdJointAnglesToInertiaMatrix(joints, inertia, device) < 0:
            return _value_within(max_motion_m, _COUNT_RANGE_M), None
        matrix = np.array(inertia).reshape(6, 6)
        min_mass_kg = math.nan
        if np.isfinite(matrix).all():
            linear, coupling, rotational = matrix[:3, :3], matrix[:3, 3:], matrix[3:, 3:]
            min_mass_kg = float(np.linalg.eigvalsh(linear - coupling @ np.linalg.pinv(rotational) @ coupling.T).min())
        return _value_within(max_motion_m, _COUNT_RANGE_M), _value_within(min_mass_kg, _MASS_RANGE_KG)

    def _enable_force(self) -> None:
        """Enable the force at zero and wait until the device confirms it."""
        call, device = self._functions, self.id
        if call.dhdEnableForce(1, device) < 0:
            raise FAILURES.failure("force-off", self._last_error())
        deadline_s = time.perf_counter() + _ENABLE_TIMEOUT_S
        while True:
            call.dhdSetForce(0.0, 0.0, 0.0, device)
            status = self._read_status()
            if status[FORCE]:
                return
            if time.perf_counter() > deadline_s:
                raise FAILURES.failure("force-off", CAUSES.get(status[FORCE_OFF_CAUSE], ""))
            time.sleep(0.01)

    def _read_status(self) -> list[int]:
        status = (c_int * STATUS_WORDS)()
        if self._functions.dhdGetStatus(status, self.id) < 0:
            raise FAILURES.failure("error", f"dhdGetStatus: {self._last_error()}")
        return list(status)

    def _last_error(self) -> str:
        return (self._functions.dhdErrorGetLastStr() or b"").decode(errors="replace")


def end_force(path: str, serial: str) -> None:
    """Open the device with this serial number ("": the first one) and end its force; called by the guard."""
    if not Library(path or None).open(serial).close():
        raise FAILURES.failure("error")


def probe() -> Backend:
    """Return the state of the library and the number of connected devices, without opening one."""
    try:
        library = Library()
    except DeviceFailure as failure:
        return Backend("force-dimension", "libdrd", state=NOT_AVAILABLE, can=_CAN, why=FAILURES.sentence(failure.mode))
    by, count = f"libdrd {library.version}", library.devices
    if count < 1:
        return Backend("force-dimension", by, state=NONE, can=_CAN, why=FAILURES.sentence("no-device"))
    return Backend("force-dimension", by, state=f"connected: {count}", can=_CAN)


def _value_within(value: float, limits: tuple[float, float]) -> float | None:
    return value if limits[0] <= value <= limits[1] else None


def _load_library(path: str | Path | None) -> ctypes.CDLL:
    chosen = path or os.environ.get(VARIABLE)
    reason = ""
    for candidate in (str(chosen),) if chosen else _usual_names():
        try:
            return ctypes.CDLL(candidate)
        except OSError as error:
            reason = " ".join(str(error).split())
    raise FAILURES.failure("no-library", reason)


def _usual_names() -> Sequence[str]:
    """Return the names under which the library is installed; like CHAI3D 3.3.0, drd64.dll is tried, too."""
    if sys.platform == "win32":
        return ("drd64.dll",)
    name = "libdrd.dylib" if sys.platform == "darwin" else "libdrd.so"
    folders = (Path.home() / ".local" / "lib", Path("/usr/local/lib"))
    versions = "libdrd*.dylib" if sys.platform == "darwin" else "libdrd.so*"
    return (name, *(file for folder in folders for file in sorted(map(str, folder.glob(versions)), reverse=True)))
