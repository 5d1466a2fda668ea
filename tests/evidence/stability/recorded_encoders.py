"""Recordings of real encoders, processed by velocity estimators, sample validation and safety layer.

A motor turns the spindle of a surgical tool at 1 kHz; one encoder counts the spindle, one the motor. A count of the
spindle stands for one of a Falcon, so that 30° are 26 mm of the hand. Source and licence: ``encoders.md``.
"""

import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from study_app.evidence.stability.bench import fast_part
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.estimators import Ewma, Kalman, Raw
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Knee, Scene, Velocity
from study_app.haptics.runtime.offline import new_wake_places, recompute_sample, samples_along
from study_app.haptics.runtime.pack import pack

EXCERPT: Final = Path(__file__).with_name("encoders.npz")
COUNTS_M: Final = {"spindle": 38e-6, "motor": 38e-6 * 8192 / (4196 * 35)}
"""One count of each encoder [m], in the order of the columns of a recording."""
FORCE_LIMIT_N: Final = 8.0
ESTIMATORS: Final[tuple[Velocity, ...]] = (Kalman(), Ewma(), Raw())
SMOOTHED: Final = 41
"""Samples of the acausal smoother, a cubic that is fitted around each sample: it passes 33 Hz."""
SETTLED: Final = 500
"""Samples at both ends of a recording that do not count."""
DELAY_S: Final = 1e-3
_NOISE_HZ: Final = 20.0


def excerpt() -> dict[str, NDArray[np.int32]]:
    """Return parts of 3 s of eight recordings: counts of spindle and motor, (n, 2), by recording."""
    with np.load(EXCERPT) as file:
        return {name: file[name] for name in file.files}


def recordings(folder: Path) -> Iterator[tuple[str, NDArray[np.int32]]]:
    """Yield name and counts of spindle and motor, (n, 2), of each recording below a folder of the data set."""
    for path in sorted(folder.rglob("*.TXT")):
        rows = [line for line in path.read_text("latin-1").splitlines() if not line.startswith("%")]
        counts = np.loadtxt(io.StringIO("\n".join(rows)), delimiter=",", usecols=(1, 8))
        yield f"{path.parent.name}/{path.stem}", counts.astype(np.int32)


def positions_m(counts: NDArray[np.int32], encoder: str) -> Floats:
    """Return the positions (n,) [m] that an encoder counted; the motor turns opposite to the spindle."""
    sign = 1 if encoder == "spindle" else -1
    places_m: Floats = sign * COUNTS_M[encoder] * counts[:, list(COUNTS_M).index(encoder)]
    return places_m


def accuracy(x_m: Floats, count_m: float, true_mps: Floats) -> NDArray[np.float64]:
    """Return error of v·|v| [%, RMS over RMS] and noise above 20 Hz [mm/s, RMS] of each of `ESTIMATORS`, (n, 2).

    ``x_m`` (n,) are positions of an encoder, ``true_mps`` the velocities without `SETTLED` samples at each end.
    """
    right, motion, rows = true_mps * np.abs(true_mps), _motion(x_m), []
    for velocity in ESTIMATORS:
        scene = Scene(scale=1, velocity=velocity, knee=Knee(law="none"))
        samples = samples_along(scene, motion, Dynamics(delay_s=DELAY_S, count_m=count_m, mass_kg=0.2))
        v_mps = samples.velocity_mps[SETTLED:-SETTLED, 0]
        error = 100 * math.sqrt(np.sum((v_mps * np.abs(v_mps) - right) ** 2) / np.sum(right**2))
        wrong_mps = np.zeros((len(v_mps), 3))
        wrong_mps[:, 0] = v_mps - true_mps
        rows.append((error, 1e3 * fast_part(wrong_mps, 1000, _NOISE_HZ, SETTLED, len(v_mps))))
    return np.array(rows)


def smoothed_mps(x_m: Floats, samples: int = SMOOTHED) -> Floats:
    """Return velocities [m/s] of positions (n,) [m] by the acausal smoother, without `SETTLED` samples at each end."""
    smooth_mps: Floats = savgol_filter(x_m, samples, 3, deriv=1, delta=1e-3)[SETTLED:-SETTLED]
    return smooth_mps


def servo_samples(scene: Scene, x_m: Floats, count_m: float) -> Any:
    """Return the samples (n,) of a servo on a device whose encoder counts positions (n,) [m] along x."""
    dynamics = Dynamics(delay_s=DELAY_S, count_m=count_m, mass_kg=0.2)
    safety = new_safety(FORCE_LIMIT_N, dynamics.delay_ticks(scene.rate_hz))
    samples, motion = records(SAMPLE, len(x_m)), _motion(x_m)
    samples.time_ns = np.round(1e9 * motion.t_s)
    samples.position_m = motion.position_m
    samples.fresh = 1
    samples.delay_ticks = safety[0].delay_ticks
    trail, places = new_wake_places(1000)
    recompute_sample(pack(scene, dynamics=dynamics), safety[0], samples, trail[0], places, True)
    return samples


def _motion(x_m: Floats) -> Motion:
    return Motion(np.arange(len(x_m)) * 1e-3, np.column_stack([x_m, 0 * x_m, 0 * x_m]))
