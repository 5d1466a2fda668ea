"""Accuracy of the velocity estimators: on imposed motions, in closed loops with a hand, and their acceptance limits.

Imposed motions are measured by an encoder with counts of 38 µm at 1 kHz. The error is that of a force proportional to
the squared velocity, v·|v|: RMS of the error over RMS of the force. Sample times jitter by 40 µs, which the filter
knows. No force moves the handle, so the filter has to detect that it is held.

In closed loops a hand holds the handle, and the force of the effects is compared with the law's force for the handle's
true motion and velocity. The comparison excludes the force that the safety layer withholds, and buoyancy and weight,
which do not depend on velocity. The error is the RMS of the difference over the RMS of the law's force.

The least error of a causal linear estimator is that of a Wiener filter that knows the spectrum of the motion, the count
and the delay. The motion is noise around strokes of 1.6 Hz with the power of ±20 mm: X ~ 1/(ω₀² − ω² + 2iζω₀ω)²,
ζ = 0.85. [choice] Counts are white noise with the variance count²/12. The law is a linear approximation of the scene's:
damping, added mass and history.
"""

import math
import statistics
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.linalg import solve_toeplitz

from study_app.evidence.cost import TickTimer
from study_app.evidence.reference_solutions import along_x, without_buoyancy
from study_app.evidence.stability.bench import DIRECTION, Bench, fast_part, law_along, sine_path
from study_app.evidence.stability.damping_limits import boundary_nspm
from study_app.evidence.stability.stability_cases import Case, scenes
from study_app.evidence.table import Evidence
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.effects import Drag
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Ewma, Kalman, Knee, Liquid, Raw, Scene, Velocity
from study_app.haptics.model.slope_limits import slope_limit
from study_app.haptics.runtime.offline import simulate

COUNT_M: Final = 38e-6
_RATE_HZ: Final = 1000.0
_JITTER_S: Final = 40e-6
_SETTLED: Final = 500
"""Samples before errors count."""
_PLACES: Final = 4
"""Number of initial positions between two counts from which each motion is repeated."""
_NOISE_HZ: Final = 20.0
_TREMOR_M: Final = 20e-6
_TREMOR_HZ: Final = 9.0
_NOISE_MPS: Final = (0.0, 0.005, 0.02, 0.05)
_BATCHES: Final = 200


class Stroke(NamedTuple):
    """A sine of ±``amplitude_m``, or a minimum-jerk reach of twice the amplitude in ``reach_s``."""

    amplitude_m: float
    frequency_hz: float = 0.0
    reach_s: float = 0.0

    def __str__(self) -> str:
        if self.reach_s:
            return f"reach of {2e3 * self.amplitude_m:g} mm in {self.reach_s:g} s"
        return f"{self.frequency_hz:g} Hz ±{1e3 * self.amplitude_m:g} mm"

    def places_m(self, t_s: Floats) -> Floats:
        if not self.reach_s:
            position_m: Floats = self.amplitude_m * np.sin(2 * math.pi * self.frequency_hz * t_s)
            return position_m
        rounds, s = np.divmod(t_s, 2 * self.reach_s)
        progress = np.minimum(s / self.reach_s, 1.0)  # a rest after each reach
        fraction = progress**3 * (10 + progress * (6 * progress - 15))
        places_m: Floats = self.amplitude_m * np.where(rounds % 2 == 0, 2 * fraction - 1, 1 - 2 * fraction)
        return places_m

    def speeds_mps(self, t_s: Floats) -> Floats:
        step_s = 1e-6
        return (self.places_m(t_s + step_s) - self.places_m(t_s - step_s)) / (2 * step_s)


_SMOOTH: Final = (
    Stroke(0.03, 1.0),
    Stroke(0.03, 2.0),
    Stroke(0.03, 3.0),
    Stroke(0.03, reach_s=0.5),
    Stroke(0.03, reach_s=0.3),
)
_FASTEST: Final = (Stroke(0.03, 5.0), Stroke(0.01, 5.0), Stroke(0.03, reach_s=0.2))
_SHOWN: Final = (Stroke(0.01, 8.0),)
"""Strokes faster than those of participants, which are reported without a goal."""


def errors(velocity: Velocity) -> Mapping[Stroke, float]:
    """Return the error of v·|v| [%] in each stroke."""
    return {stroke: _stroke_error(velocity, stroke) for stroke in (*_SMOOTH, *_FASTEST, *_SHOWN)}


def _stroke_error(velocity: Velocity, stroke: Stroke) -> float:
    error_sum = force_sum = 0.0
    for k in range(_PLACES):
        random = np.random.default_rng(k)
        t_s = np.arange(4000) / _RATE_HZ
        t_s = t_s + random.uniform(-0.5, 0.5, len(t_s)) * math.sqrt(12) * _JITTER_S
        true_mps = stroke.speeds_mps(t_s)[_SETTLED:]
        estimated_mps = _estimate_velocities(velocity, t_s, stroke.places_m(t_s) + k / _PLACES * COUNT_M)[_SETTLED:]
        error_sum += float(np.sum((estimated_mps * abs(estimated_mps) - true_mps * abs(true_mps)) ** 2))
        force_sum += float(np.sum(true_mps**4))
    return 100 * math.sqrt(error_sum / force_sum)


def noise_mmps(velocity: Velocity) -> Mapping[float, float]:
    """Return the velocity noise above 20 Hz [mm/s, RMS per axis] at constant speeds [m/s]; at rest with tremor."""
    noise = {}
    t_s = np.arange(5000) / _RATE_HZ
    for speed_mps in _NOISE_MPS:
        tremor_m = _TREMOR_M * np.sin(2 * math.pi * _TREMOR_HZ * t_s) * (speed_mps == 0)
        squares = []
        for seed in range(6):
            place_m = np.random.default_rng(seed).uniform(0, COUNT_M)
            v_mps = _estimate_velocities(velocity, t_s, place_m + speed_mps * t_s + tremor_m)
            axes_mps = np.column_stack([v_mps, 0 * v_mps, 0 * v_mps])
            squares.append(fast_part(axes_mps, _RATE_HZ, _NOISE_HZ, 1000, len(t_s)) ** 2)
        noise[speed_mps] = 1e3 * math.sqrt(statistics.mean(squares))
    return noise


def _estimate_velocities(velocity: Velocity, t_s: Floats, x_m: Floats) -> Floats:
    """Return the velocities (n,) [m/s] estimated from positions (n,) [m] along one axis."""
    counted_m = np.floor(x_m / COUNT_M + 0.5) * COUNT_M
    motion = Motion(t_s, np.column_stack([counted_m, 0 * counted_m, 0 * counted_m]))
    velocity_mps: Floats = np.array(simulate(Scene(scale=1, velocity=velocity, knee=Knee(law="none")), motion).vx_mps)
    return velocity_mps


def _cost_ns(velocity: Velocity) -> float:
    """Return the computation time per tick [ns] in excess of the raw difference; medians of batches."""
    dynamics = Dynamics(delay_s=1 / _RATE_HZ)
    benches = [TickTimer(Scene(velocity=estimator), dynamics) for estimator in (velocity, Raw())]
    for _ in range(_BATCHES):
        for bench in benches:
            bench.run_batch()
    own_ns, least_ns = (statistics.median(bench.costs_ns) for bench in benches)
    return own_ns - least_ns


_HANDS: Final = ("light", "middle", "firm")
_DELAY: Final = 1
_DURATION_S: Final = 4.0
_SETTLED_S: Final = 1.5

_STROKES: Final = tuple(Stroke(0.02, hz) for hz in (1.0, 2.0, 3.0))
_QUICK: Final = Stroke(0.01, 5.0)
DAMPING_NSPM: Final = 20.0
WHOLE: Final = Stroke(0.02, 1.6)
_WHOLE_SCALE: Final = 3.0
_WHOLE_LIQUIDS: Final = ("water", "glycerin", "honey", "gear_oil")


def plain_forces() -> tuple[Scene, ...]:
    """Return a damper of 20 N·s/m and a drag of 85 N·s²/m² at the hand: the thesis' water without its wake."""
    damper = Liquid(id="damper", density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=DAMPING_NSPM))
    quadratic = Liquid(id="quadratic", density_kg_m3=1000, effects=("drag",))
    return Scene(scale=1, liquids=(damper,), knee=Knee(law="none")), Scene(scale=10, liquids=(quadratic,))


def _whole_forces() -> tuple[Scene, ...]:
    """Return the liquids of physical2 with their selected effects but without buoyancy."""
    return tuple(
        without_buoyancy(scenes()[f"physical2_{name}"].model_copy(update={"scale": _WHOLE_SCALE}))
        for name in _WHOLE_LIQUIDS
    )


def _plain_errors(velocity: Velocity, strokes: Iterable[Stroke] = _STROKES) -> tuple[float, ...]:
    """Return the error [%] of each plain force for each grip and stroke."""
    return tuple(
        held_error(scene, velocity, hand, stroke) for scene in plain_forces() for hand in _HANDS for stroke in strokes
    )


def held_error(scene: Scene, velocity: Velocity, hand: str, stroke: Stroke) -> float:
    """Return the error of a scene's force [%] in a loop with one tick of delay."""
    scene = scene.model_copy(update={"velocity": velocity})
    bench = Bench(Case(delay=_DELAY, hand=hand), scene=scene)
    bench.handle.motor_step_n = 0.0
    trace = bench.follow(sine_path(stroke.amplitude_m, 2 * math.pi * stroke.frequency_hz, _DURATION_S, _RATE_HZ))
    law_n, counted = law_along(scene, trace), trace.t_s >= _SETTLED_S
    error_n, law_counted_n = (trace.asked_n - law_n)[counted], law_n[counted]
    return 100 * math.sqrt(float(np.sum(error_n**2) / np.sum(law_counted_n**2)))


_DAMPING_RATIO: Final = 0.85
_ROWS: Final = 2**15
"""Rows of a period of the motion."""
_TAPS: Final = 400
"""Positions that the filter uses."""


def wiener_bound(scene: Scene, count_m: float, delay_s: float) -> float:
    """Return the least relative RMS error of the force ``delay_s`` after a sample [s].

    ``count_m`` is one encoder count at the hand [m].
    """
    turns, power_m2 = _spectrum(scene.rate_hz)
    response = turns * _linear_law(scene, turns, np.sqrt(power_m2))
    variance_n2 = float(np.sum(np.abs(response) ** 2 * power_m2))
    covariance_m2 = _signal(power_m2)[:_TAPS]
    covariance_m2[0] += count_m**2 / 12
    covariance_nm = _signal(response * np.exp(turns * delay_s) * power_m2)[:_TAPS]
    explained_n2 = float(solve_toeplitz(covariance_m2, covariance_nm) @ covariance_nm)
    return math.sqrt(max(1 - explained_n2 / variance_n2, 0.0))


_FADE_IN_S: Final = 1.0


def random_path(stroke_hz: float, rate_hz: float, seed: int = 1) -> Floats:
    """Return positions (2^15, 3) [m] of noise about strokes of a frequency; the motion fades in from rest at 0."""
    turns, power_m2 = _spectrum(rate_hz, stroke_hz)
    phase = np.random.default_rng(seed).uniform(0, 2 * math.pi, len(turns))
    proportion = np.minimum(np.arange(_ROWS) / rate_hz / _FADE_IN_S, 1.0)
    x_m = _signal(np.sqrt(2 * power_m2) * np.exp(1j * phase)) * proportion**2 * (3 - 2 * proportion)
    path_m: Floats = np.outer(x_m, DIRECTION)
    return path_m


def _spectrum(rate_hz: float, stroke_hz: float = WHOLE.frequency_hz) -> tuple[Any, Floats]:
    """Return iω [1/s] and the motion's power [m²] at each frequency above 0."""
    frequency_hz = np.fft.rfftfreq(_ROWS, 1 / rate_hz)[1:-1]
    ratio = frequency_hz / stroke_hz
    power_m2 = 1 / ((1 - ratio**2) ** 2 + (2 * _DAMPING_RATIO * ratio) ** 2) ** 2
    return 2j * math.pi * frequency_hz, WHOLE.amplitude_m**2 / 2 * power_m2 / power_m2.sum()


def _signal(values: Any) -> Floats:
    """Return the real signal (`_ROWS`,) with the given amplitude and phase at each frequency above 0."""
    signal: Floats = np.fft.irfft(np.concatenate([[0], values, [0]]), _ROWS) * _ROWS / 2
    return signal


def _linear_law(scene: Scene, turns: Any, size_m: Floats) -> Any:
    """Return the transfer function from velocity to force [N·s/m] of the linear law closest to the scene's.

    It has damping, added mass and history, fitted to one realisation of the motion, in the second of two periods.
    """
    phase = np.random.default_rng(1).uniform(0, 2 * math.pi, len(turns))
    x_m = np.sqrt(2) * size_m * np.exp(1j * phase)
    v_mps = turns * x_m
    places_m, speeds_mps = (scene.scale * np.tile(_signal(amplitudes), 2) for amplitudes in (x_m, v_mps))
    law_n = simulate(scene, along_x(np.arange(2 * _ROWS) / scene.rate_hz, places_m, speeds_mps)).fx_n[_ROWS:]
    parts = np.stack([np.ones_like(turns), turns, np.sqrt(turns)])
    regressors = np.column_stack([_signal(amplitudes * v_mps) for amplitudes in parts])
    return np.linalg.lstsq(regressors, law_n - law_n.mean(), rcond=None)[0] @ parts


_ESTIMATORS: Final[tuple[Velocity, ...]] = (Kalman(), Ewma())
"""The judged estimator, followed by its references."""
_PERIOD_S: Final = 1e-3
_MASSES_KG: Final = (0.05, 0.1, 0.2, 0.25, 0.5)
_LOOPS: Final = ((1, 1), (2, 1), (0, 1), (2, 2))
"""Delay of the device and delay believed [ticks]."""
_SMOOTH_PERCENT: Final = 2.5
_FASTEST_PERCENT: Final = 5.0
_HELD_PERCENT: Final = 3.0
_REST_NOISE: Final = 1.3
_LEAST_LIMIT_NSPM: Final = 53.0
_LEAST_LATE_NSPM: Final = 40.0
_MOST_COST_NS: Final = 100.0
_WHOLE_PERCENT: Final = {"water": 20.0, "glycerin": 14.0, "honey": 18.0, "gear_oil": 15.0}

_Progress = Callable[[str], None]


class Row(NamedTuple):
    """One quantity by estimator; the limit applies to the first, as a lower limit if ``least``.

    ``bound`` is the least value of a linear estimator (`wiener_bound`), None if it is not computed.
    """

    name: str
    values: tuple[float, ...]
    goal: float | None = None
    least: bool = False
    bound: float | None = None

    @property
    def met(self) -> bool:
        """Whether the first estimator meets the limit, if there is one."""
        if self.goal is None:
            return True
        return self.values[0] >= self.goal if self.least else self.values[0] <= self.goal


def measure_velocities(progress: _Progress) -> tuple[Row, ...]:
    """Measure all rows; ``progress`` is called with the name of each part before it is measured."""
    rows: list[Row] = []
    for name, part in PARTS.items():
        progress(name)
        rows += part()
    return tuple(rows)


def velocity_evidence(rows: Sequence[Row]) -> Evidence:
    """Return the rows as a table."""
    text = "\n".join(_lines(rows)) + "\n"
    return Evidence(text, {"velocity.txt": text}, missed=not all(row.met for row in rows))


def _lines(rows: Sequence[Row]) -> Iterator[str]:
    width = max(len(row.name) for row in rows)
    names = "".join(f"{estimator.kind:>9}" for estimator in _ESTIMATORS)
    yield f"{'1 kHz, encoder count 38 µm':{width}} {names}   goal of {_ESTIMATORS[0].kind}"
    for row in rows:
        values = "".join(f"{value:9.4g}" if value >= 100 else f"{value:9.2f}" for value in row.values)
        goal = "" if row.goal is None else f"   {'≥' if row.least else '≤'} {row.goal:.3g}: "
        verdict = "" if row.goal is None else "met" if row.met else "not met"
        bound = "" if row.bound is None else f"   best linear estimator from positions: {row.bound:.3g}"
        yield f"{row.name:{width}} {values}{goal}{verdict}{bound}"


def _for_each_estimator(measure: Callable[[Velocity], Any]) -> tuple[Any, ...]:
    return tuple(measure(velocity) for velocity in _ESTIMATORS)


def _imposed_motion_rows() -> Iterator[Row]:
    by_estimator: tuple[Mapping[Stroke, float], ...] = _for_each_estimator(errors)
    for stroke in (*_SMOOTH, *_FASTEST, *_SHOWN):
        goal = _SMOOTH_PERCENT if stroke in _SMOOTH else _FASTEST_PERCENT if stroke in _FASTEST else None
        yield Row(
            f"error of v·|v|, {stroke} [%]", tuple(errors_by_stroke[stroke] for errors_by_stroke in by_estimator), goal
        )


def _noise_rows() -> Iterator[Row]:
    noise: tuple[Mapping[float, float], ...] = _for_each_estimator(noise_mmps)
    for speed_mps in _NOISE_MPS:
        values = tuple(noise_by_speed[speed_mps] for noise_by_speed in noise)
        condition = f"at {1e3 * speed_mps:g} mm/s" if speed_mps else "at rest"
        yield Row(f"noise above 20 Hz {condition} [mm/s]", values, values[1] * (1.0 if speed_mps else _REST_NOISE))


def _boundary_rows() -> Iterator[Row]:
    limits = _for_each_estimator(lambda velocity: slope_limit(_PERIOD_S, 1, velocity))
    yield Row("slope limit, 1 tick of delay [N·s/m]", limits, _LEAST_LIMIT_NSPM, least=True)
    for delay, believed in _LOOPS:
        for mass_kg in _MASSES_KG:
            values = tuple(
                boundary_nspm(estimator, _PERIOD_S, delay, believed=believed, mass_kg=mass_kg)
                for estimator in _ESTIMATORS
            )
            goal = values[1] if (delay, believed) == (1, 1) else None
            if (delay, believed, mass_kg) == (2, 2, 0.1):
                goal = _LEAST_LATE_NSPM
            believed_text = "" if believed == delay else f", estimated as {believed}"
            yield Row(f"stable damping, {mass_kg:g} kg, delay {delay}{believed_text} [N·s/m]", values, goal, least=True)


def _held_handle_rows() -> Iterator[Row]:
    errors = _for_each_estimator(_plain_errors)
    yield Row("held, 1–3 Hz ±20 mm, mean error [%]", tuple(map(statistics.mean, errors)), _HELD_PERCENT)
    yield Row("held, 1–3 Hz ±20 mm, largest error [%]", tuple(map(max, errors)))
    fast_errors = _for_each_estimator(lambda velocity: statistics.mean(_plain_errors(velocity, (_QUICK,))))
    yield Row(f"held, {_QUICK}, mean error [%]", fast_errors)


def _whole_force_rows() -> Iterator[Row]:
    for name, scene in zip(_WHOLE_LIQUIDS, _whole_forces(), strict=True):
        bound = 100 * wiener_bound(scene, COUNT_M, _DELAY * _PERIOD_S)
        for hand in _HANDS:
            values = tuple(held_error(scene, estimator, hand, WHOLE) for estimator in _ESTIMATORS)
            goal = _WHOLE_PERCENT[name] if hand == "middle" else None
            yield Row(f"whole force, {WHOLE}, scale 3, {name}, {hand} [%]", values, goal, bound=bound)


def _cost_rows() -> Iterator[Row]:
    yield Row("extra time compared with a plain difference [ns per tick]", _for_each_estimator(_cost_ns), _MOST_COST_NS)


PARTS: Final[Mapping[str, Callable[[], Iterator[Row]]]] = {
    "errors in imposed motions": _imposed_motion_rows,
    "noise": _noise_rows,
    "stable damping": _boundary_rows,
    "closed loops": _held_handle_rows,
    "whole forces": _whole_force_rows,
    "cost": _cost_rows,
}
