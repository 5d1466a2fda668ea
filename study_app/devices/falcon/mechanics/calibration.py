"""Calibration of one Falcon with a weight or a scale: motor units per newton metre, and its arms' offset.

Two published gains differ by half, so a force in newtons is known only for a calibrated device. Without calibration the
gain with the weaker forces is used, and the receipt states it. A calibration is kept by the device's serial number
among the user's settings, not with results.
"""

import json
import math
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path
from typing import Any, Final

import numpy as np

from study_app.devices.falcon.mechanics.geometry import Geometry, geometry_named
from study_app.devices.falcon.mechanics.kinematics import REACHED, START_M, angles, forward, jacobian, new_mechanism
from study_app.errors import DeviceError
from study_app.user_folder import FOLDER_VARIABLE, user_folder

UNCALIBRATED_UNITS_PER_NM: Final = 6616.0
"""Martin & Hillier 2009, quoted from another source; with libnifalcon's 10 000 forces would be half as strong again."""

LEAST_POSES: Final = 5
MOST_RESIDUAL_N: Final = 0.5
"""Greatest residual of consistent weights."""
_GAINS: Final = (1000.0, 100_000.0)  # no Falcon's is outside
_OFFSETS_RAD: Final = math.radians(15)  # nor its arms' offset
_STEPS: Final = 20


@dataclass(frozen=True, slots=True)
class Calibration:
    """The result of `fit`; ``measured`` is the day, ``residual_n`` the root mean square of the residual."""

    geometry: str
    units_per_nm: float
    arm_offset_rad: float = 0.0
    own_weight_n: float = 0.0
    residual_n: float = 0.0
    poses: int = 0
    measured: str = ""

    def describe(self) -> dict[str, Any]:
        """Return what the receipt says of it."""
        return {
            "units_per_nm": self.units_per_nm,
            "arm_offset_deg": math.degrees(self.arm_offset_rad),
            "residual_n": self.residual_n,
            "poses": self.poses,
            "measured": self.measured,
        }


def fit(geometry: Geometry, poses: Any, forces_n: Any, units: Any, *, measured: date | None = None) -> Calibration:
    """Return the gain, offset and weight of the grip that explain best what the motors held, by least squares.

    The grip stands still when motors, its own weight and what pulls at it balance:
    ``-J(theta + offset)^T units / gain + (0, -own weight, 0) + force = 0``.

    Parameters
    ----------
    poses : (n, 3) array, encoder counts
    forces_n : (n, 3) array [N], what pulled at the grip: (0, -weight, 0) of a hung weight
    units : (n, 3) array, motor units that held it

    Raises
    ------
    DeviceError
        There are fewer than five poses, the forces are all alike, or the result is impossible for a Falcon.
    """
    counts, pulled_n, held = (np.asarray(given, np.float64) for given in (poses, forces_n, units))
    if counts.shape != pulled_n.shape or counts.shape != held.shape or counts.ndim != 2 or counts.shape[1:] != (3,):
        raise DeviceError("a calibration needs three numbers a pose: counts, force and motor units")
    if len(counts) < LEAST_POSES:
        raise DeviceError(f"a calibration needs {LEAST_POSES} poses or more, not {len(counts)}: measure at more places")
    if np.ptp(pulled_n, axis=0).max() < 0.5:
        raise DeviceError(
            "a calibration needs two weights half a newton apart (one may be none): hang another one, too"
        )
    offset_rad = 0.0
    for _ in range(_STEPS):
        small = 1e-5
        left = _solve(geometry, offset_rad, counts, pulled_n, held)[1]
        slope = (_solve(geometry, offset_rad + small, counts, pulled_n, held)[1] - left) / small
        step = float(slope @ left) / float(slope @ slope)
        offset_rad = min(max(offset_rad - step, -_OFFSETS_RAD), _OFFSETS_RAD)
        if abs(step) < 1e-9:
            break
    (share, own_n), left = _solve(geometry, offset_rad, counts, pulled_n, held)
    gain = 1.0 / share if share else math.inf
    if not _GAINS[0] <= gain <= _GAINS[1] or abs(offset_rad) >= _OFFSETS_RAD:
        raise DeviceError(
            f"these weights would mean {gain:.0f} motor units a newton metre and arms {math.degrees(offset_rad):.1f} "
            f"degrees off; {_GAINS[0]:.0f} to {_GAINS[1]:.0f} and less than 15 degrees are possible: check the "
            "weights, and that nothing touches the grip"
        )
    residual_n = math.sqrt(float(left @ left) / len(counts))
    day = (measured or date.today()).isoformat()
    return Calibration(geometry.name, gain, offset_rad, float(own_n), residual_n, len(counts), day)


def left_over(found: Calibration, poses: Any, forces_n: Any, units: Any) -> Any:
    """Return the residual forces (n, 3) [N] of ``found``; arguments as for `fit`."""
    counts, pulled_n, held = (np.asarray(given, np.float64) for given in (poses, forces_n, units))
    return _solve(geometry_named(found.geometry), found.arm_offset_rad, counts, pulled_n, held)[1].reshape(-1, 3)


def _solve(geometry: Geometry, offset_rad: float, counts: Any, pulled_n: Any, held: Any) -> tuple[Any, Any]:
    """Return the best (1 / gain, own weight) for an offset, and what is left of the forces, flat [N]."""
    mechanism = new_mechanism(geometry, 1.0, offset_rad)
    theta, place_m, rates = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    pushed = np.zeros((len(counts), 3))
    for row, count in enumerate(counts):
        angles(mechanism, count, theta)
        place_m[:] = START_M
        if forward(mechanism, theta, place_m) != REACHED:
            raise DeviceError(f"pose {row + 1}: encoders {count.astype(int).tolist()} are no pose of {geometry.name!r}")
        jacobian(mechanism, theta, place_m, rates)
        pushed[row] = -rates.T @ held[row]
    down = np.tile([0.0, -1.0, 0.0], len(counts))
    design = np.column_stack([pushed.ravel(), down])
    best = np.linalg.lstsq(design, -pulled_n.ravel(), rcond=None)[0]
    return best, design @ best + pulled_n.ravel()


def calibration_file(serial: str) -> Path:
    """Return the path of the calibration of the Falcon with this serial number, which may not exist."""
    name = "".join(letter if letter.isalnum() and letter.isascii() else "-" for letter in serial)
    return user_folder() / f"falcon-{name or 'unnamed'}.json"


def save(serial: str, calibration: Calibration) -> Path:
    """Store the calibration of the Falcon with this serial number; return its path.

    Raises
    ------
    DeviceError
        It cannot be written.
    """
    file = calibration_file(serial)
    fresh = file.with_suffix(".new")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        fresh.write_text(json.dumps(asdict(calibration), indent=2) + "\n", encoding="utf-8")
        fresh.replace(file)
    except OSError as error:
        raise DeviceError(
            f"the calibration cannot be kept in {file.parent}: {error.strerror}; set {FOLDER_VARIABLE} to a folder "
            "that can be written"
        ) from error
    return file


def load(serial: str) -> Calibration | None:
    """Return the calibration of the Falcon with this serial number; None where it has none."""
    file = calibration_file(serial)
    try:
        found = Calibration(**json.loads(file.read_text(encoding="utf-8")))
        geometry_named(found.geometry)
        whole = _GAINS[0] <= found.units_per_nm <= _GAINS[1] and abs(found.arm_offset_rad) <= _OFFSETS_RAD
    except FileNotFoundError:
        return None
    except (OSError, ValueError, TypeError, RecursionError) as error:
        raise _unusable(file) from error
    if not whole:
        raise _unusable(file)
    return found


def _unusable(file: Path) -> DeviceError:
    return DeviceError(f"the Falcon's calibration in {file} cannot be used: delete the file, or calibrate again")
