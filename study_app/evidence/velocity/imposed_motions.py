"""Errors, noise and cost of velocity estimators on imposed motions, as an encoder of 38 µm counts them at 1 kHz.

The error is that of a force as the square of the velocity, v·|v|: RMS of the error over RMS of the force. Sample times
jitter by 40 µs, known to the filter, and no force moves the handle: the filter has to find out that it is held.
"""

import math
import statistics
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from study_app.evidence.cost import Bench
from study_app.evidence.stability.trace_measures import fast_part
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Knee, Raw, Scene, Velocity
from study_app.haptics.runtime.offline import simulate

COUNT_M: Final = 38e-6
RATE_HZ: Final = 1000.0
JITTER_S: Final = 40e-6
SETTLED: Final = 500
"""Samples before errors count."""
PLACES: Final = 4
"""Motions are repeated from as many positions between two counts."""
NOISE_HZ: Final = 20.0
TREMOR_M: Final = 20e-6
TREMOR_HZ: Final = 9.0
NOISE_MPS: Final = (0.0, 0.005, 0.02, 0.05)
BATCHES: Final = 200


class Stroke(NamedTuple):
    """A sine of ±``amplitude_m``, or a minimum-jerk reach of twice that in ``reach_s``."""

    amplitude_m: float
    frequency_hz: float = 0.0
    reach_s: float = 0.0

    def __str__(self) -> str:
        if self.reach_s:
            return f"reach of {2e3 * self.amplitude_m:g} mm in {self.reach_s:g} s"
        return f"{self.frequency_hz:g} Hz ±{1e3 * self.amplitude_m:g} mm"

    def places_m(self, t_s: Floats) -> Floats:
        """Return the positions (n,) [m] at times (n,) [s]."""
        if not self.reach_s:
            swing_m: Floats = self.amplitude_m * np.sin(2 * math.pi * self.frequency_hz * t_s)
            return swing_m
        rounds, s = np.divmod(t_s, 2 * self.reach_s)
        share = np.minimum(s / self.reach_s, 1.0)  # a rest after each reach
        way = share**3 * (10 + share * (6 * share - 15))
        places_m: Floats = self.amplitude_m * np.where(rounds % 2 == 0, 2 * way - 1, 1 - 2 * way)
        return places_m

    def speeds_mps(self, t_s: Floats) -> Floats:
        """Return the velocities (n,) [m/s] at times (n,) [s]."""
        step_s = 1e-6
        return (self.places_m(t_s + step_s) - self.places_m(t_s - step_s)) / (2 * step_s)


SMOOTH: Final = (
    Stroke(0.03, 1.0),
    Stroke(0.03, 2.0),
    Stroke(0.03, 3.0),
    Stroke(0.03, reach_s=0.5),
    Stroke(0.03, reach_s=0.3),
)
FASTEST: Final = (Stroke(0.03, 5.0), Stroke(0.01, 5.0), Stroke(0.03, reach_s=0.2))
SHOWN: Final = (Stroke(0.01, 8.0),)
"""Faster than strokes of participants: shown, without a goal."""


def errors(velocity: Velocity) -> Mapping[Stroke, float]:
    """Return the error of v·|v| [%] in each stroke."""
    return {stroke: _error(velocity, stroke) for stroke in (*SMOOTH, *FASTEST, *SHOWN)}


def _error(velocity: Velocity, stroke: Stroke) -> float:
    wrong = right = 0.0
    for k in range(PLACES):
        random = np.random.default_rng(k)
        t_s = np.arange(4000) / RATE_HZ
        t_s = t_s + random.uniform(-0.5, 0.5, len(t_s)) * math.sqrt(12) * JITTER_S
        true_mps = stroke.speeds_mps(t_s)[SETTLED:]
        found_mps = estimated(velocity, t_s, stroke.places_m(t_s) + k / PLACES * COUNT_M)[SETTLED:]
        wrong += float(np.sum((found_mps * abs(found_mps) - true_mps * abs(true_mps)) ** 2))
        right += float(np.sum(true_mps**4))
    return 100 * math.sqrt(wrong / right)


def noise_mmps(velocity: Velocity) -> Mapping[float, float]:
    """Return the velocity above 20 Hz [mm/s, RMS of an axis] at constant speeds [m/s], at rest with tremor."""
    found = {}
    t_s = np.arange(5000) / RATE_HZ
    for speed_mps in NOISE_MPS:
        tremor_m = TREMOR_M * np.sin(2 * math.pi * TREMOR_HZ * t_s) * (speed_mps == 0)
        squares = []
        for seed in range(6):
            place_m = np.random.default_rng(seed).uniform(0, COUNT_M)
            v_mps = estimated(velocity, t_s, place_m + speed_mps * t_s + tremor_m)
            axes_mps = np.column_stack([v_mps, 0 * v_mps, 0 * v_mps])
            squares.append(fast_part(axes_mps, RATE_HZ, NOISE_HZ, 1000, len(t_s)) ** 2)
        found[speed_mps] = 1e3 * math.sqrt(statistics.mean(squares))
    return found


def estimated(velocity: Velocity, t_s: Floats, x_m: Floats) -> Floats:
    """Return the velocities (n,) [m/s] that an estimator finds in positions (n,) [m] along one axis."""
    seen_m = np.floor(x_m / COUNT_M + 0.5) * COUNT_M
    motion = Motion(t_s, np.column_stack([seen_m, 0 * seen_m, 0 * seen_m]))
    found: Floats = np.array(simulate(Scene(scale=1, velocity=velocity, knee=Knee(law="none")), motion).vx_mps)
    return found


def cost_ns(velocity: Velocity) -> float:
    """Return the computation time of a tick [ns] less that with the raw difference; medians of batches."""
    dynamics = Dynamics(delay_s=1 / RATE_HZ)
    benches = [Bench(Scene(velocity=it), dynamics) for it in (velocity, Raw())]
    for _ in range(BATCHES):
        for bench in benches:
            bench.batch()
    own_ns, least_ns = (statistics.median(bench.costs_ns) for bench in benches)
    return own_ns - least_ns
