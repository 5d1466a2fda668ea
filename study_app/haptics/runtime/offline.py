"""The force along a motion, computed by the servo's tick without device and clock."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StudyError
from study_app.haptics.kernels.compiled import kernel
from study_app.haptics.kernels.estimators import take_force
from study_app.haptics.kernels.safety import guard, new_safety
from study_app.haptics.kernels.sample_validation import clamp, place
from study_app.haptics.kernels.tick import step_model, write_sample
from study_app.haptics.model.device_dynamics import MOST_DELAY, Dynamics
from study_app.haptics.model.estimators import DEVICE, GIVEN
from study_app.haptics.model.layout import SAMPLE, Record, records
from study_app.haptics.model.motion import Floats, Motion, read
from study_app.haptics.model.scene import Given, Scene
from study_app.haptics.model.slope_limits import handle_limits
from study_app.haptics.runtime.pack import pack

Table: TypeAlias = "np.recarray[Any, Any]"

_VECTORS = {
    "position_m": ("x_m", "y_m", "z_m"),
    "velocity_mps": ("vx_mps", "vy_mps", "vz_mps"),
    "wake_mps": ("wake_x_mps", "wake_y_mps", "wake_z_mps"),
    "force_n": ("fx_n", "fy_n", "fz_n"),
    "device_force_n": ("device_fx_n", "device_fy_n", "device_fz_n"),
}
COLUMNS = ("t_s", *(name for names in _VECTORS.values() for name in names), "limiters")


def simulate(scene: Scene, path: Motion | str | os.PathLike[str]) -> Table:
    """Return the forces on a body along a motion (or a CSV file with one): a recarray of n rows, named `COLUMNS`.

    Every row is a new accepted sample and one tick. Δt is the time since the row before, clamped as in the servo; the
    first row takes the scene's nominal period. Velocities given with the motion are used unfiltered, only the knee is
    applied. ``vx_mps …`` is the velocity after filter and knee, ``wake_x_mps …`` the wake in this tick's drag, ``fx_n
    …`` the sum of the effects, ``device_fx_n …`` the force that a loop of 1 ms with one tick of delay would send after
    the start fade; ``limiters`` the ``LIMITER_*`` bits that acted on it. Places and velocities are in the scene frame;
    a force is the same vector at the hand.

    Raises
    ------
    StudyError
        The motion cannot be read, or the scene requires a given velocity and there is none.

    Examples
    --------
    >>> import numpy as np
    >>> from study_app.protocol.load import load_scene
    >>> t_s = np.arange(1000) / 1000
    >>> position_m = np.column_stack([0.05 * np.sin(2 * np.pi * t_s), 0 * t_s, 0 * t_s])
    >>> table = simulate(load_scene("rek2024", "honey"), Motion(t_s, position_m))
    >>> print(f"{np.abs(table.device_fx_n).max():.2f} N")
    0.12 N
    """
    motion = path if isinstance(path, Motion) else read(Path(path))
    return _table(motion.t_s, samples_along(scene, motion))


def samples_along(scene: Scene, motion: Motion, dynamics: Dynamics | None = None, *, smooths: bool = False) -> Any:
    """Return the results of `simulate` as the servo's samples: (n,) recarray of ``layout.SAMPLE``.

    ``dynamics`` are those of a device: limits, slew and delay are then those of its loop at the scene's rate. By
    default the loop is that of `simulate`. A velocity that the device measures is the difference of the positions.
    With ``smooths``, dw/dt is smoothed as for the scene's estimator, although velocities are given.

    Raises
    ------
    StudyError
        The scene wants a given velocity and there is none.
    """
    along = ModelAlong(scene, dynamics, given=motion.velocity_mps is not None, smooths=smooths)
    return along.follow(motion.t_s, motion.position_m, motion.velocity_mps)


def law_along(scene: Scene, t_s: Floats, position_m: Floats, velocity_mps: Floats) -> NDArray[np.float64]:
    """Return the force of a scene's effects (n, 3) [N], before any limit, on a known motion of the hand.

    ``position_m`` and ``velocity_mps`` (n, 3) are the hand's, at times (n,) [s].
    """
    place_m = scene.origin_m + scene.scale * position_m
    force_n: NDArray[np.float64] = samples_along(scene, Motion(t_s, place_m, scene.scale * velocity_mps)).force_n
    return force_n


class ModelAlong:
    """A scene's model along a motion given in pieces; see `samples_along`.

    Parameters
    ----------
    scene : Scene
        The scene in which the body moves.
    dynamics : Dynamics, optional
        Of a device; by default the loop is that of `simulate`.
    given : bool
        Whether each piece brings velocities.
    smooths : bool
        Whether dw/dt is smoothed as for the scene's estimator, although velocities are given.

    Raises
    ------
    StudyError
        The scene wants a given velocity and there is none.
    """

    def __init__(
        self, scene: Scene, dynamics: Dynamics | None = None, *, given: bool = False, smooths: bool = False
    ) -> None:
        estimator = scene.velocity
        if given and not smooths:
            scene = scene.model_copy(update={"velocity": Given()})
        elif isinstance(scene.velocity, Given) and not given:
            raise StudyError("the scene takes the velocity as given, but the motion has no vx_mps, vy_mps, vz_mps")
        if dynamics is None:
            self._model = pack(scene, limits=handle_limits(1e-3, 1, estimator), dynamics=Dynamics(delay_s=1e-3))
            self._safety = new_safety()
        else:
            self._model = pack(scene, dynamics=dynamics)
            self._safety = new_safety(delay_ticks=min(dynamics.delay_ticks(scene.rate_hz), MOST_DELAY))
        if given:
            self._model.parameters[0].estimator = GIVEN
        self._safety[0].fade, self._safety[0].fade_s = 1.0, 0.0
        self._before_s = math.nan

    def follow(self, t_s: Floats, position_m: Floats, velocity_mps: Floats | None = None) -> Any:
        """Return the samples (n,) of the next piece: times (n,) [s], places and velocities (n, 3) of the scene."""
        samples = records(SAMPLE, len(t_s))
        if len(samples) == 0:
            return samples
        samples.position_m = position_m
        samples.velocity_mps = 0.0 if velocity_mps is None else velocity_mps
        _run(self._model, self._safety[0], samples, t_s, self._before_s)
        self._before_s = float(t_s[-1])
        return samples


@kernel
def _run(model: Any, safety: Record, samples: Any, t_s: Any, before_s: float) -> None:
    """Process the samples in order, positions in the scene frame; set their other fields.

    ``before_s`` is the time of the sample before them, NaN if there is none.
    """
    parameters, state = model.parameters[0], model.state[0]
    for k in range(len(samples)):
        sample = samples[k]
        earlier_s = t_s[k - 1] if k > 0 else before_s
        interval_s = parameters.period_s if math.isnan(earlier_s) else clamp(t_s[k] - earlier_s)
        place(state, sample.position_m[0], sample.position_m[1], sample.position_m[2])
        if parameters.estimator == GIVEN:
            for axis in range(3):
                state.estimate_mps[axis] = sample.velocity_mps[axis]
        elif parameters.estimator == DEVICE:
            for axis in range(3):
                state.estimate_mps[axis] = (state.position_m[axis] - state.previous_m[axis]) / interval_s
        safety.tick_s = interval_s
        take_force(state, safety)
        step_model(model, interval_s, safety.delay_ticks)
        write_sample(state, sample)
        guard(model, safety, sample, interval_s)


def _table(t_s: Any, samples: Any) -> Table:
    """Return the samples with one column for every component."""
    table = np.recarray(len(samples), [(name, np.int64 if name == "limiters" else np.float64) for name in COLUMNS])
    table["t_s"] = t_s
    table["limiters"] = samples.limiters
    for field, names in _VECTORS.items():
        for axis, name in enumerate(names):
            table[name] = samples[field][:, axis]
    return table
