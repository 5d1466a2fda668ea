"""The force along a motion, computed by the servo's tick without device and clock.

Recomputes ticks from their telemetry, and the places of the wake that they left.

A sample contains all inputs of a tick: when and where the device was read, whether that was new, and whether the force
was stopped. So the same tick outside the servo, with a separate model and safety record, yields the same force to the
last bit, or that of another liquid on the same motion.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from study_app.errors import StudyError
from study_app.haptics.kernels.compiled import kernel, part
from study_app.haptics.kernels.effects.wake import REST_MPS
from study_app.haptics.kernels.estimators import take_force
from study_app.haptics.kernels.passivity import log_acted, log_delivery, log_saturation
from study_app.haptics.kernels.safety import begin_scene, guard, new_safety
from study_app.haptics.kernels.sample_validation import clamp, place
from study_app.haptics.kernels.tick import compute_tick, step_model, write_sample
from study_app.haptics.kernels.vector import copy, distance, square
from study_app.haptics.model.device_dynamics import MOST_DELAY, UNKNOWN, Dynamics
from study_app.haptics.model.effects import local_wake, wake
from study_app.haptics.model.estimators import DEVICE, GIVEN
from study_app.haptics.model.layout import LIMITER_SATURATED, LIMITER_STOP, SAMPLE, STATUS_DEVICE_LOST, Record, records
from study_app.haptics.model.motion import Floats, Motion, read_motion
from study_app.haptics.model.scene import Given, Scene
from study_app.haptics.model.slope_limits import DampingLimits, handle_limits
from study_app.haptics.runtime.pack import Model, pack

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
    first row takes the scene's nominal period. Velocities given with the motion are only compressed, not
    filtered. ``vx_mps …`` is the velocity after filter and compression, ``wake_x_mps …`` the wake in this tick's drag,
    ``fx_n …`` the sum of the effects, ``device_fx_n …`` the force that a loop of 1 ms with one tick of delay would send
    after the start fade; ``limiters`` the ``LIMITER_*`` bits that acted on it. Places and velocities are in the scene
    frame; a force is the same vector at the hand.

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
    motion = path if isinstance(path, Motion) else read_motion(Path(path))
    return _table(motion.t_s, samples_along(scene, motion))


def samples_along(scene: Scene, motion: Motion, dynamics: Dynamics | None = None, *, smooths: bool = False) -> Any:
    """Return the results of `simulate` as the servo's samples: (n,) recarray of ``layout.SAMPLE``.

    ``dynamics`` are those of a device: limits, slew and delay are then those of its loop at the scene's rate. By
    default the loop is that of `simulate`. A velocity that the device measures is the difference of the positions.
    With ``smooths``, dw/dt is smoothed as for the scene's estimator, although velocities are given.

    Raises
    ------
    StudyError
        The scene requires a given velocity and there is none.
    """
    along = ModelAlong(scene, dynamics, given=motion.velocity_mps is not None, smooths=smooths)
    return along.follow(motion.t_s, motion.position_m, motion.velocity_mps)


def law_along(scene: Scene, t_s: Floats, position_m: Floats, velocity_mps: Floats) -> NDArray[np.float64]:
    """Return the force of a scene's effects (n, 3) [N], before any limit, on a known motion of the hand.

    ``position_m`` and ``velocity_mps`` (n, 3) are the hand's, at times (n,) [s].
    """
    place_m = scene.origin_m + scene.scale * position_m
    force_n: NDArray[np.float64] = samples_along(
        scene, Motion(t_s, place_m, velocity_mps=scene.scale * velocity_mps)
    ).force_n
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
        The scene requires a given velocity and there is none.
    """

    def __init__(
        self, scene: Scene, dynamics: Dynamics | None = None, *, given: bool = False, smooths: bool = False
    ) -> None:
        estimator = scene.velocity
        if given and not smooths:
            scene = scene.model_copy(update={"velocity": Given()})
        elif isinstance(scene.velocity, Given) and not given:
            raise StudyError(
                'the scene uses velocity "given", but the motion does not contain vx_mps, vy_mps and vz_mps'
            )
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
        take_force(parameters, state, safety)
        step_model(model, interval_s, safety.delay_ticks)
        write_sample(state, sample)
        guard(model, safety, sample, interval_s)


_RESULT = np.dtype([(name, np.float64, (3,)) for name in ("velocity_mps", "position_m", "force_n")], align=True)
"""Velocity and place of the body in the scene, and the force of the effects."""


class BatchedTicks:
    """The servo's ticks on given readings, including sample validation and safety layer, in batches to be timed.

    Readings are times ``t_ns`` (n,) and places ``hand_m`` (n, 3); the first one follows the last one after a period.
    ``velocity_mps`` (n, 3) are velocities in the scene, for a scene in which they are given; ``limits`` replace those
    of the table. Ticks fill the rows of ``results``, (n,) of `_RESULT`, unless there are none.
    """

    def __init__(
        self,
        scene: Scene,
        t_ns: NDArray[np.int64],
        hand_m: Floats,
        velocity_mps: Floats | None = None,
        *,
        limits: DampingLimits | None = None,
        dynamics: Dynamics = UNKNOWN,
    ) -> None:
        self._model: Model = pack(scene, limits=limits, dynamics=dynamics)
        self._safety = new_safety(delay_ticks=dynamics.delay_ticks(scene.rate_hz))
        self._sample = records(SAMPLE, 1)
        self._readings = t_ns, hand_m, np.zeros_like(hand_m) if velocity_mps is None else velocity_mps
        self.results = records(_RESULT, len(t_ns))

    def run(self, start: int, stop: int) -> None:
        """Run the ticks from ``start`` to ``stop``."""
        _run_batch(self._model, self._safety[0], self._sample[0], self._readings, self.results, start, stop)


@kernel
def _run_batch(model: Any, safety: Record, sample: Record, readings: Any, results: Any, start: int, stop: int) -> None:
    t_ns, hand_m, velocity_mps = readings
    parameters, state = model.parameters[0], model.state[0]
    lap_ns = t_ns[-1] - t_ns[0] + round(1e9 * parameters.period_s)
    row, shift_ns = start % len(t_ns), start // len(t_ns) * lap_ns
    for _ in range(start, stop):
        sample.time_ns = t_ns[row] + shift_ns
        sample.fresh = 1
        copy(hand_m[row], sample.position_m)
        if parameters.estimator == GIVEN:
            copy(velocity_mps[row], state.estimate_mps)
        compute_tick(model, safety, sample)
        if results.shape[0] > 0:
            copy(sample.velocity_mps, results[row].velocity_mps)
            copy(state.position_m, results[row].position_m)
            copy(sample.force_n, results[row].force_n)
        row += 1
        if row == len(t_ns):  # a division would take a third of a tick
            row = 0
            shift_ns += lap_ns


def _table(t_s: Any, samples: Any) -> Table:
    """Return the samples with one column for every component."""
    table = np.recarray(len(samples), [(name, np.int64 if name == "limiters" else np.float64) for name in COLUMNS])
    table["t_s"] = t_s
    table["limiters"] = samples.limiters
    for field, names in _VECTORS.items():
        for axis, name in enumerate(names):
            table[name] = samples[field][:, axis]
    return table


_PLACE = np.dtype(
    [
        ("hand_m", np.float64, (3,)),  # place of the hand, hand frame
        ("segment", np.int64),  # number of the wake's segment
        ("moving", np.int64),  # 0 for a zero element
    ],
    align=True,
)

_TRAIL = np.dtype(
    [
        ("left", np.int64),  # elements stored since the wake was empty; number q is in row q % (rows of the ring)
        ("held", np.int64),  # elements still in the wake
        ("segments", np.int64),  # segments that contain one of them
        ("time_s", np.float64),  # of a local wake, after the last tick
    ],
    align=True,
)


def new_wake_places(elements: int) -> tuple[Any, Any]:
    """Return an empty trail, (1,) ``_TRAIL``, and the ring of its places, (elements,) ``_PLACE``."""
    return records(_TRAIL, 1), records(_PLACE, elements)


@part
def was_lost_at_read(sample: Record) -> bool:
    """Return whether the device was lost in this tick; then no model tick ran, and the device set the force."""
    return bool(
        sample.status == STATUS_DEVICE_LOST
        and sample.fresh == 0
        and sample.limiters == 0
        and square(sample.force_n) == 0.0
        and square(sample.velocity_mps) == 0.0
    )


@part
def take_sample(model: Any, safety: Record, sample: Record, delivered: bool) -> None:
    """Recompute the tick of a sample from its recorded inputs: stop, delay, saturation, the device's force.

    If that force was not ``delivered`` for this model's command, only the velocity estimator receives it, since it
    moved the hand.
    """
    sent_x, sent_y, sent_z = sample.device_force_n[0], sample.device_force_n[1], sample.device_force_n[2]
    as_asked = sent_x == sample.command_n[0] and sent_y == sample.command_n[1] and sent_z == sample.command_n[2]
    saturated = sample.limiters & LIMITER_SATURATED
    safety.stop = 1 if sample.limiters & LIMITER_STOP else 0
    safety.delay_ticks = sample.delay_ticks
    compute_tick(model, safety, sample)
    if not delivered:
        log_acted(safety.passivity, (sent_x, sent_y, sent_z))
    elif not as_asked:
        log_delivery(safety, sample, (sent_x, sent_y, sent_z))
    if delivered and saturated:
        log_saturation(safety, sample)


@kernel
def recompute_sample(model: Any, safety: Record, samples: Any, trail: Record, places: Any, delivered: bool) -> None:
    """Recompute each of ``samples`` like the servo, and write the results into them.

    ``trail`` and ``places`` follow the wake of the model's first liquid. ``delivered`` says that the forces in
    ``samples`` result from this model's commands: if the device sent another one, it is logged.
    """
    for k in range(samples.shape[0]):
        sample = samples[k]
        if was_lost_at_read(sample):
            continue
        take_sample(model, safety, sample, delivered)
        _note(model, trail, places)


@kernel
def recompute_scenes(
    rest: Any, earlier: Any, model: Any, serial_before: int, serial: int, safety: Record, samples: Any, first: int
) -> None:
    """Recompute each of ``samples`` from ``first`` onwards with the model of its scene, and write the forces into them.

    ``model`` is that of the scene ``serial``, ``earlier`` that of ``serial_before``, ``rest`` that of all others.
    """
    for i in range(first, samples.shape[0]):
        sample = samples[i]
        if i > 0 and sample.scene != samples[i - 1].scene:
            begin_scene(safety)
        if was_lost_at_read(sample):
            continue
        if sample.scene == serial and serial != 0:
            take_sample(model, safety, sample, True)
        elif sample.scene == serial_before and serial_before != 0:
            take_sample(earlier, safety, sample, True)
        else:
            take_sample(rest, safety, sample, True)


@part
def _note(model: Any, trail: Record, places: Any) -> None:
    """Store the hand's position if this tick added an element to the wake."""
    if model.parameters[0].liquids == 0:
        return
    liquid, local, state = model.liquids[0], model.liquid_states[0], model.state[0]
    if local.ticks == 0:  # outside the liquid, whose state is then reset
        trail.left = trail.held = trail.segments = 0
        trail.time_s = 0.0
    elif liquid.effects & wake.BIT:
        tail, tracks = liquid.wake, local.wake
        if tracks.stored > 0 and tracks.stored != trail.left:
            place = places[(tracks.stored - 1) % places.shape[0]]
            copy(state.hand_m, place.hand_m)
            place.segment = tracks.last_segment
            place.moving = model.rows.elements[tail.row + (tracks.stored - 1) % tail.length].moving
        trail.left = tracks.stored
        trail.held = tracks.held
        trail.segments = tracks.last_segment - tracks.first_segment + 1 if tracks.speed_mps > 0.0 else 0
    elif liquid.effects & local_wake.BIT:
        tracks = local.local_wake
        if tracks.held == 0:
            trail.left = 0
        elif tracks.time_s != trail.time_s:
            place = places[trail.left % places.shape[0]]
            copy(state.hand_m, place.hand_m)
            place.segment = 0
            place.moving = 1 if distance(state.velocity_mps, state.drift_mps) >= REST_MPS else 0
            trail.left += 1
        trail.time_s = tracks.time_s
        trail.held = tracks.held
        trail.segments = tracks.cells
