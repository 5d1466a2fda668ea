"""Calibration of one Falcon with a weight or a scale: motor units per newton metre, and its arms' offset.

The Falcon holds its grip at a position against a load, and the motor units are recorded. This is done at several
positions, with and without a load, which separates the load from the grip's own weight. With a weight, the grip comes
to rest at each position once from above and once from below, so that friction cancels. `fit` computes the motor units
per newton metre from these measurements.

The two published gains differ by half, so a force in newtons is known only for a calibrated device. Without a
calibration the gain that gives the weaker forces is used, and the receipt states it. A calibration is stored under the
device's serial number in the user's settings, not with results.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path
from typing import Any, Final

import numpy as np

from study_app.devices.falcon import mechanics
from study_app.devices.falcon.constants import ERROR_NO_DEVICE
from study_app.devices.falcon.failures import usb_failure
from study_app.errors import DeviceError
from study_app.haptics.kernels import READ_LOST, READ_NEW
from study_app.haptics.model.layout import new_command, new_reading
from study_app.user_folder import FOLDER_VARIABLE, user_folder

UNCALIBRATED_UNITS_PER_NM: Final = 6616.0
"""Martin & Hillier 2009, quoted from another source; libnifalcon's 10 000 would give forces half as strong again."""

_MIN_POSES: Final = 5
MOST_RESIDUAL_N: Final = 0.5
"""Greatest residual of consistent weights."""
_GAINS: Final = (1000.0, 100_000.0)  # range of plausible gains
_MAX_OFFSET_RAD: Final = math.radians(15)  # greatest plausible offset of the arms
_MAX_ITERATIONS: Final = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """The result of `fit`; ``measured`` is the date, ``residual_n`` the root mean square of the residual force."""

    geometry: str
    units_per_nm: float
    arm_offset_rad: float = 0.0
    own_weight_n: float = 0.0
    residual_n: float = 0.0
    poses: int = 0
    measured: str = ""

    def describe(self) -> dict[str, Any]:
        return {
            "units_per_nm": self.units_per_nm,
            "arm_offset_deg": math.degrees(self.arm_offset_rad),
            "residual_n": self.residual_n,
            "poses": self.poses,
            "measured": self.measured,
        }


def fit(
    geometry: mechanics.Geometry, poses: Any, forces_n: Any, units: Any, *, measured: date | None = None
) -> Calibration:
    """Fit gain, arm offset and weight of the grip to the measured motor units by least squares.

    The grip is at rest when motors, its own weight and the external force balance: ``-J(theta + offset)^T units / gain
    + (0, -own weight, 0) + force = 0``.

    Parameters
    ----------
    poses : (n, 3) array, encoder counts
    forces_n : (n, 3) array [N], the external force on the grip: (0, -weight, 0) for a suspended weight
    units : (n, 3) array, motor units that balanced it

    Raises
    ------
    DeviceError
        There are fewer than five poses, all forces are equal, or the result is impossible for a Falcon.
    """
    counts, external_n, motor_units = (np.asarray(values, np.float64) for values in (poses, forces_n, units))
    if (
        counts.shape != external_n.shape
        or counts.shape != motor_units.shape
        or counts.ndim != 2
        or counts.shape[1:] != (3,)
    ):
        raise DeviceError(
            "a calibration needs three encoder counts, three force components and three motor values for each pose"
        )
    if len(counts) < _MIN_POSES:
        raise DeviceError(
            f"a calibration needs at least {_MIN_POSES} poses, not {len(counts)}: measure at more positions"
        )
    if np.ptp(external_n, axis=0).max() < 0.5:
        raise DeviceError(
            "a calibration needs two weights at least 0.5 N apart (one may be zero): measure with another "
            "weight as well"
        )
    offset_rad = 0.0
    for _ in range(_MAX_ITERATIONS):
        delta_rad = 1e-5
        residual_n = _solve(geometry, offset_rad, counts, external_n, motor_units)[1]
        slope = (_solve(geometry, offset_rad + delta_rad, counts, external_n, motor_units)[1] - residual_n) / delta_rad
        step = float(slope @ residual_n) / float(slope @ slope)
        offset_rad = min(max(offset_rad - step, -_MAX_OFFSET_RAD), _MAX_OFFSET_RAD)
        if abs(step) < 1e-9:
            break
    (inverse_gain, own_n), residual_n = _solve(geometry, offset_rad, counts, external_n, motor_units)
    gain = 1.0 / inverse_gain if inverse_gain else math.inf
    if not _GAINS[0] <= gain <= _GAINS[1] or abs(offset_rad) >= _MAX_OFFSET_RAD:
        raise DeviceError(
            f"these weights imply {gain:.0f} motor units per newton metre and an arm offset of "
            f"{math.degrees(offset_rad):.1f} degrees; only {_GAINS[0]:.0f} to {_GAINS[1]:.0f} units and less than 15 "
            "degrees are plausible: check the weights, and make sure that nothing is touching the grip"
        )
    rms_residual_n = math.sqrt(float(residual_n @ residual_n) / len(counts))
    day = (measured or date.today()).isoformat()
    return Calibration(
        geometry=geometry.name,
        units_per_nm=gain,
        arm_offset_rad=offset_rad,
        own_weight_n=float(own_n),
        residual_n=rms_residual_n,
        poses=len(counts),
        measured=day,
    )


def residual_forces(calibration: Calibration, poses: Any, forces_n: Any, units: Any) -> Any:
    """Return the residual forces (n, 3) [N] of ``calibration``; arguments as for `fit`."""
    counts, external_n, motor_units = (np.asarray(values, np.float64) for values in (poses, forces_n, units))
    return _solve(
        mechanics.geometry_named(calibration.geometry), calibration.arm_offset_rad, counts, external_n, motor_units
    )[1].reshape(-1, 3)


def _solve(
    geometry: mechanics.Geometry, offset_rad: float, counts: Any, external_n: Any, motor_units: Any
) -> tuple[Any, Any]:
    """Return the best (1 / gain, own weight) for an offset, and the residual forces as a flat array [N]."""
    mechanism = mechanics.new_mechanism(geometry, 1.0, offset_rad)
    theta, position_m, rates = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    motor_forces = np.zeros((len(counts), 3))
    for row, count in enumerate(counts):
        mechanics.angles(mechanism, count, theta)
        position_m[:] = mechanics.START_M
        if mechanics.forward(mechanism, theta, position_m) != mechanics.REACHED:
            raise DeviceError(
                f"pose {row + 1}: the encoder counts {count.astype(int).tolist()} are impossible with the geometry "
                f"{geometry.name!r}"
            )
        mechanics.jacobian(mechanism, theta, position_m, rates)
        motor_forces[row] = -rates.T @ motor_units[row]
    down = np.tile([0.0, -1.0, 0.0], len(counts))
    design = np.column_stack([motor_forces.ravel(), down])
    solution = np.linalg.lstsq(design, -external_n.ravel(), rcond=None)[0]
    return solution, design @ solution + external_n.ravel()


def calibration_file(serial: str) -> Path:
    """Return the path of the calibration of the Falcon with this serial number, which may not exist."""
    name = "".join(letter if letter.isalnum() and letter.isascii() else "-" for letter in serial)
    return user_folder() / f"falcon-{name or 'unnamed'}.json"


def save_calibration(serial: str, calibration: Calibration) -> Path:
    """Store the calibration of the Falcon with this serial number; return its path.

    Raises
    ------
    DeviceError
        The calibration cannot be written.
    """
    file = calibration_file(serial)
    new_file = file.with_suffix(".new")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        new_file.write_text(json.dumps(asdict(calibration), indent=2) + "\n", encoding="utf-8", newline="\n")
        new_file.replace(file)
    except OSError as error:
        raise DeviceError(
            f"the calibration cannot be saved in {file.parent}: {error.strerror}; set {FOLDER_VARIABLE} to a writable "
            "folder"
        ) from error
    return file


def load_calibration(serial: str) -> Calibration | None:
    """Return the calibration of the Falcon with this serial number, or None."""
    file = calibration_file(serial)
    try:
        calibration = Calibration(**json.loads(file.read_text(encoding="utf-8")))
        mechanics.geometry_named(calibration.geometry)
        plausible = (
            _GAINS[0] <= calibration.units_per_nm <= _GAINS[1] and abs(calibration.arm_offset_rad) <= _MAX_OFFSET_RAD
        )
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError, RecursionError) as error:
        raise _unusable_file(file) from error
    if not plausible:
        raise _unusable_file(file)
    return calibration


def _unusable_file(file: Path) -> DeviceError:
    return DeviceError(f"the Falcon's calibration in {file} cannot be used: delete the file or calibrate again")


PLACES_M: Final = (
    (0.0, 0.0, 0.0),
    (0.025, 0.012, -0.015),
    (-0.025, 0.012, 0.015),
    (0.020, -0.012, 0.018),
    (-0.020, -0.012, -0.018),
)
GRAVITY_MPS2: Final = 9.80665
LEAST_N, MOST_N = 1.0, 6.0
"""Range of loads that the grip can hold in addition to its own weight, and that can be measured."""

_STIFFNESS_NPM = 600.0
_DAMPING_NSPM = 8.0
_SMOOTHING_S = 0.005
_SPEED_MPS = 0.05
_APPROACH_M = 0.005
_TICK_S = 0.001
_STILL_MPS = 0.002
_STILL_TICKS = 300
_MAX_SETTLING_S = 6.0
_MAX_BLIND_TICKS = 20
_AVERAGED_TICKS = 300

Ask = Callable[[str, str], Callable[[], str | None]]
"""Asks the operator: takes the kind of request ("let-go", "hang", "pull", "reading" or "take-off") and its text, and
returns a function that returns None until the operator has answered, then the answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Notes:
    """The measurements, one row per rest: encoder counts, force on the grip [N] and motor units, each (n, 3)."""

    counts: Any
    forces_n: Any
    units: Any


class Grip:
    """The grip of an open Falcon, held at a position by a simulated spring; one tick takes a millisecond.

    Parameters
    ----------
    device : an open and homed Falcon
    virtual : whether time is counted in ticks instead of read from the clock
    """

    def __init__(self, device: Any, *, virtual: bool = False) -> None:
        self._device = device
        self._virtual = virtual
        self._now_ns = 0 if virtual else time.perf_counter_ns()
        self._reading, self._command = new_reading(), new_command()
        self._read_m = self._reading["position_m"][0]
        self._asked_n, self._sent_n = self._command["force_n"][0], self._command["sent_n"][0]
        self._addresses = int(self._reading.ctypes.data), int(self._command.ctypes.data)
        self._place_m = np.zeros(3)
        self._velocity_mps = np.zeros(3)
        self._target_m: Any = None
        self._blind = 0
        for _ in range(_MAX_BLIND_TICKS):
            self.tick()
        self._target_m = self._place_m.copy()

    @property
    def place_m(self) -> Any:
        """The grip's position (3,) [m, hand frame]."""
        return self._place_m.copy()

    def tick(self) -> None:
        """Read the position and push toward the target; after 20 ticks without a new position, send no force."""
        if self._virtual:
            self._now_ns += round(1e9 * _TICK_S)
            elapsed_s = _TICK_S
        else:
            time.sleep(_TICK_S)
            before_ns, self._now_ns = self._now_ns, time.perf_counter_ns()
            elapsed_s = (self._now_ns - before_ns) * 1e-9
        device = self._device
        reading, command = self._addresses
        answer = device.read.ctypes(device.context, self._now_ns, reading)
        if answer == READ_LOST:
            device.check()
            raise usb_failure(ERROR_NO_DEVICE, "weighing")
        if answer == READ_NEW:
            self._blind = 0
            self._update_motion(self._read_m, elapsed_s)
        else:
            self._blind += 1
        self._asked_n[:] = self._sent_n[:] = self._force_n()
        device.write.ctypes(device.context, command)

    def _update_motion(self, position_m: Any, elapsed_s: float) -> None:
        moved_mps = (position_m - self._place_m) / elapsed_s
        self._velocity_mps += (moved_mps - self._velocity_mps) * elapsed_s / (_SMOOTHING_S + elapsed_s)
        self._place_m[:] = position_m

    def _force_n(self) -> Any:
        if self._target_m is None or self._blind > _MAX_BLIND_TICKS:
            return np.zeros(3)
        force_n = _STIFFNESS_NPM * (self._target_m - self._place_m) - _DAMPING_NSPM * self._velocity_mps
        size = float(np.linalg.norm(force_n))
        return force_n * min(1.0, self._device.force_limit_n / size) if size else force_n

    def wait(self, answered: Callable[[], str | None]) -> str:
        """Hold the grip in place until the operator answers; return the answer."""
        while (answer := answered()) is None:
            self.tick()
        return answer

    def move_to(self, place_m: Any) -> None:
        """Move the grip slowly to a position and wait until it rests there, possibly displaced by its load."""
        path_m = np.asarray(place_m) - self._target_m
        ticks = max(int(np.linalg.norm(path_m) / (_SPEED_MPS * _TICK_S)), 1)
        start_m = self._target_m.copy()
        for k in range(ticks):
            self._target_m = start_m + path_m * ((k + 1) / ticks)
            self.tick()
        still_ticks = 0
        for _ in range(round(_MAX_SETTLING_S / _TICK_S)):
            self.tick()
            still_ticks = still_ticks + 1 if np.linalg.norm(self._velocity_mps) < _STILL_MPS else 0
            if still_ticks >= _STILL_TICKS:
                return
        raise DeviceError(
            "the grip has not come to rest: make sure that nothing is touching it, hang the weight on a short "
            "string, and start again"
        )

    def weigh(self) -> tuple[Any, Any]:
        """Return the mean encoder counts and motor units (each (3,)) over some tenths of a second."""
        counts, units = np.zeros(3), np.zeros(3)
        for _ in range(_AVERAGED_TICKS):
            self.tick()
            encoder_counts, motor_units = self._device.held
            counts += encoder_counts
            units += motor_units
        return counts / _AVERAGED_TICKS, units / _AVERAGED_TICKS


def measure_with_weight(grip: Grip, weight_n: float, ask: Ask) -> Notes:
    """Measure without load at all positions, then with a weight of ``weight_n`` newtons; return the measurements."""
    if not LEAST_N <= weight_n <= MOST_N:
        raise DeviceError(
            f"a weight of {1000 * weight_n / GRAVITY_MPS2:.0f} g exerts {weight_n:.2f} N: use a weight that exerts "
            f"{LEAST_N:g} to {MOST_N:g} N (110 to 600 g)"
        )
    notes: list[tuple[Any, float, Any]] = []
    grip.wait(ask("let-go", "Let go of the grip; it will hold itself in place and move slowly. Keep clear of it."))
    notes += _measure_round(grip, 0.0)
    grip.wait(
        ask(
            "hang",
            f"Hang the {1000 * weight_n / GRAVITY_MPS2:.0f} g weight on the grip, and wait until it hangs still.",
        )
    )
    notes += _measure_round(grip, weight_n)
    grip.wait(ask("take-off", "Remove the weight and hold the grip: the motors will now be turned off."))
    return _as_notes(notes)


def _measure_round(grip: Grip, load_n: float) -> list[tuple[Any, float, Any]]:
    notes = []
    for position in PLACES_M:
        for side in (1.0, -1.0):
            grip.move_to(np.add(position, (0.0, side * _APPROACH_M, 0.0)))
            grip.move_to(position)
            counts, units = grip.weigh()
            notes.append((counts, load_n, units))
    return notes


def measure_with_scale(grip: Grip, ask: Ask) -> Notes:
    """Measure at each position without load and then with an operator's pull on a scale; return the measurements."""
    notes: list[tuple[Any, float, Any]] = []
    grip.wait(ask("let-go", "Let go of the grip; it will hold itself in place and move slowly. Keep clear of it."))
    for number, position in enumerate(PLACES_M, start=1):
        grip.move_to(position)
        counts, units = grip.weigh()
        notes.append((counts, 0.0, units))
        request = (
            f"Position {number} of {len(PLACES_M)}: pull straight down with the scale until it shows 200 to 500 g, and "
            "keep it there"
        )
        grip.wait(ask("pull", request))
        counts, units = grip.weigh()
        notes.append((counts, _read_scale(grip, ask), units))
        grip.wait(ask("let-go", "Remove the scale and let go of the grip."))
    grip.wait(ask("take-off", "Hold the grip: the motors will now be turned off."))
    return _as_notes(notes)


def _read_scale(grip: Grip, ask: Ask) -> float:
    """Return the scale's reading [N], asking until it is a valid weight."""
    question = "What did the scale show, in grams?"
    while True:
        reading = grip.wait(ask("reading", question))
        try:
            load_n = float(reading.replace(",", ".")) / 1000 * GRAVITY_MPS2
        except ValueError:
            load_n = -1.0
        if 0.0 < load_n <= MOST_N:
            return load_n
        question = f"'{reading}' is not a weight between 0 and 600 g. What did the scale show?"


def _as_notes(notes: list[tuple[Any, float, Any]]) -> Notes:
    counts, loads_n, units = zip(*notes, strict=True)
    forces_n = np.zeros((len(notes), 3))
    forces_n[:, 1] = -np.array(loads_n)
    return Notes(counts=np.array(counts), forces_n=forces_n, units=np.array(units))
