"""Motion and force from telemetry: the force that a device sent, or that a sensor in another liquid would measure.

Samples hold the velocity after the knee, so the liquids here have none.
"""

from typing import Any, Final

import numpy as np

from study_app.haptics.model.gate import resolve
from study_app.haptics.model.layout import LIMITER_ESTIMATOR, LIMITER_FADE, LIMITER_GLITCH, STATUS_OK
from study_app.haptics.model.scene import Knee, Scene
from study_app.haptics.runtime.offline import ModelAlong
from study_app.lab.estimation.rows import Floats, Rows, no_rows

NOISE_N: Final = 0.03
"""Standard deviation of the simulated sensor along each axis."""
_SEED: Final = 1


def as_measured(scene: Scene) -> Scene:
    """Return the scene for velocities of telemetry."""
    return resolve(scene).model_copy(update={"knee": Knee(law="none")})


class DeviceForce:
    """The force that the device sent; usable where no limiter changed it.

    ``began`` tells after `take` that the servo began a new scene, so that the last wake is lost.
    """

    def __init__(self) -> None:
        self._serial: int | None = None
        self.began = False

    def take(self, samples: Any, scene: Scene) -> Rows:
        """Return rows of the servo's next samples (recarray of ``SAMPLE``) in a scene."""
        samples = _accepted(samples)
        self.began = False
        if len(samples) == 0:
            return no_rows()
        changes = np.flatnonzero(
            np.diff(samples.scene, prepend=samples.scene[0] if self._serial is None else self._serial)
        )
        self._serial = int(samples.scene[-1])
        for first in changes[::-1]:
            if samples.limiters[first] & LIMITER_FADE:
                self.began, samples = True, samples[first:]
                break
        usable = (samples.limiters & ~LIMITER_ESTIMATOR == 0) & (samples.status == STATUS_OK)
        return _rows(samples, scene, np.array(samples.device_force_n, np.float64), usable)


class OtherLiquidForce:
    """The force of another liquid on the same motion, with sensor noise: known values for trials of the estimation.

    Parameters
    ----------
    scene : Scene
        Of that liquid.
    noise_n : float
        Standard deviation along each axis [N].
    """

    def __init__(self, scene: Scene, noise_n: float = NOISE_N) -> None:
        self._model = ModelAlong(as_measured(scene), given=True)
        self._scene, self._noise_n = scene, noise_n
        self._noise = np.random.default_rng(_SEED)

    def take(self, samples: Any) -> Rows:
        """Return rows of the servo's next samples (recarray of ``SAMPLE``)."""
        samples = _accepted(samples)
        if len(samples) == 0:
            return no_rows()
        rows = _rows(samples, self._scene, np.zeros((len(samples), 3)), np.ones(len(samples), bool))
        force_n = self._model.follow(rows.t_s, rows.position_m, rows.velocity_mps).force_n
        rows.force_n[:] = force_n + self._noise_n * self._noise.standard_normal(force_n.shape)
        return rows


def _accepted(samples: Any) -> Any:
    """Return the samples in which the model moved."""
    return samples[(samples.fresh != 0) & (samples.limiters & LIMITER_GLITCH == 0) & (samples.status == STATUS_OK)]


def _rows(samples: Any, scene: Scene, force_n: Floats, usable: Any) -> Rows:
    return Rows(
        samples.time_ns * 1e-9,
        np.array(samples.position_m) * scene.scale + np.asarray(scene.origin_m),
        np.array(samples.velocity_mps, np.float64),
        force_n,
        np.asarray(usable, bool),
    )
