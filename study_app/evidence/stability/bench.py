"""The closed loop in which a case runs (model, safety layer, handle and hand), and measures of its trace."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from study_app.evidence.stability.stability_cases import (
    DEVICE,
    FILTERS,
    GRIPS,
    LETS_GO,
    MOTIONS,
    SECOND,
    THROWN,
    Case,
    scene_of,
)
from study_app.haptics.kernels import kernel
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.force_rules import CURRENT, ForceRules
from study_app.haptics.model.motion import Floats, Motion
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import DampingLimits
from study_app.haptics.runtime.closed_loop import ARMS, ClosedLoop, empty_trace
from study_app.haptics.runtime.offline import simulate

MOVING_S: Final = 1.2
_DURATION_S: Final = 1.8
_RELEASED_S: Final = 1.2
"""Time for which a released handle is observed [s]."""
_TREMOR_M: Final = 20e-6
FORCE_LIMIT_N: Final = 8.0
DIRECTION: Final = np.array([0.8, 0.0, 0.6])
"""Direction of straight motions."""


class Bench(ClosedLoop):
    """The closed loop of a case, with the safety layer (``safe``) or without.

    ``limits`` replace those of the table, ``scene`` and ``dynamics`` those of the case.
    """

    def __init__(
        self,
        case: Case,
        *,
        safe: bool = True,
        limits: DampingLimits | None = None,
        scene: Scene | None = None,
        dynamics: Dynamics | None = None,
        rules: ForceRules = CURRENT,
    ) -> None:
        grip = GRIPS[case.hand]
        super().__init__(
            scene or scene_of(case),
            dynamics or _dynamics_of(case),
            delay_ticks=case.believed_delay,
            handle={
                "mass_kg": case.mass_kg,
                "viscous_nspm": case.viscous_nspm,
                "coulomb_n": case.coulomb_n,
                "motor_limit_n": FORCE_LIMIT_N,
                "motor_step_n": FORCE_LIMIT_N / 2048,
                "delay": case.delay,
                "hand_kg": grip.mass_kg,
                "stiffness_npm": grip.stiffness_npm,
                "damping_nspm": grip.damping_nspm,
                "quantum_m": case.quantum_um * 1e-6,
            },
            arm=ARMS.get(case.hand, ARMS["middle"]) if case.plant == SECOND else None,
            jitter=case.jitter,
            missed=case.missed,
            limits=limits,
            rules=rules,
        )
        loop = self.loop
        loop.safe = safe
        loop.motion = MOTIONS.index(case.motion)
        loop.speed_mps = case.speed_mps
        loop.way_m = case.way_mm * 1e-3
        loop.moving_s = max(MOVING_S, case.release_s) if case.hand == LETS_GO else MOVING_S
        loop.release_s = {THROWN: 0.0, LETS_GO: case.release_s}.get(case.hand, math.inf)
        loop.tremor_m = 0.0 if case.hand == THROWN else _TREMOR_M
        loop.noise_m = case.noise_um * 1e-6
        loop.lost, loop.duplicated, loop.burst_s = case.lost, case.duplicated, case.burst_ms * 1e-3
        loop.jump_m, loop.outliers, loop.outlier_m = case.jump_mm * 1e-3, case.outliers, case.outlier_mm * 1e-3
        loop.delay, loop.slows_to, loop.swaps = case.delay, case.slows_to, case.swaps
        loop.mass_kg, loop.other_kg = case.mass_kg, case.other_kg
        if case.estimator == DEVICE:
            loop.velocity.filter = 1 + FILTERS.index(case.velocity_filter)
            loop.velocity.lag = case.velocity_lag
            loop.velocity.noise_mps = case.velocity_noise_mmps * 1e-3
            loop.velocity.count_mps = case.velocity_count_mmps * 1e-3


def lasts_s(case: Case) -> float:
    """Return the duration of a case [s]."""
    return max(_DURATION_S, case.release_s + _RELEASED_S) if case.hand == LETS_GO else _DURATION_S


def new_trace(case: Case, seconds: float | None = None) -> Any:
    """Return an empty trace with room for a case, or for the given number of seconds."""
    return empty_trace(math.ceil(((seconds or lasts_s(case)) + 0.1) * case.rate_hz))


def _dynamics_of(case: Case) -> Dynamics:
    """Return the dynamics that the device reports: the believed minimum mass and delay, and the velocity lag."""
    reported_kg = case.believed_kg or (min(case.mass_kg, case.other_kg) if case.other_kg else case.mass_kg)
    lag_s = case.velocity_lag / case.rate_hz if case.estimator == DEVICE else None
    return Dynamics(
        delay_s=case.believed_delay / case.rate_hz,
        count_m=case.quantum_um * 1e-6,
        mass_kg=reported_kg,
        velocity_lag_s=lag_s,
    )


def sine_path(amplitude_m: float, rate_per_s: float, seconds: float, rate_hz: float) -> Floats:
    """Return positions (ticks, 3) [m] along a straight sine of angular frequency ``rate_per_s``."""
    t_s = np.arange(round(seconds * rate_hz)) / rate_hz
    path_m: Floats = np.outer(amplitude_m * np.sin(rate_per_s * t_s), DIRECTION)
    return path_m


def law_along(scene: Scene, trace: Any) -> Floats:
    """Return the scene's force (ticks, 3) [N] for the handle's true motion, with exact velocities."""
    law = simulate(
        scene, Motion(trace.t_s, scene.scale * trace.position_m, velocity_mps=scene.scale * trace.velocity_mps)
    )
    return np.column_stack([law.fx_n, law.fy_n, law.fz_n])


@kernel
def lowest_balance(trace: Any) -> tuple[float, float, float]:
    """Return the lowest energy balance of hand and liquid [J], the greatest force [N] and the longest step [m].

    In each tick the hand does the work -f·Δp on the liquid, with the force that acts on the handle, without buoyancy
    and weight, and its true step in the frame of the current. The balance begins at 0 and is limited to the energy that
    the liquid could return.
    """
    balance_j = lowest_j = strongest_n = longest_m = 0.0
    for k in range(1, trace.shape[0]):
        work_j = squares_n2 = squares_m2 = 0.0
        before = trace[k - 1]
        for axis in range(3):
            sent = k - 1 - before.delay
            lift_n = trace[sent].lift_n[axis] if sent >= 0 else 0.0
            force_n = before.acting_n[axis] - lift_n
            step_m = trace[k].position_m[axis] - before.position_m[axis]
            step_m -= trace[k].drift_mps[axis] * (trace[k].t_s - before.t_s)
            work_j -= force_n * step_m
            squares_n2 += force_n * force_n
            squares_m2 += step_m * step_m
        balance_j = min(balance_j + work_j, trace[k].reserve_j)
        lowest_j = min(lowest_j, balance_j)
        strongest_n = max(strongest_n, math.sqrt(squares_n2))
        longest_m = max(longest_m, math.sqrt(squares_m2))
    return lowest_j, strongest_n, longest_m


@kernel
def given_out_j(trace: Any) -> float:
    """Return the maximum net energy that the acting force has given to the handle [J]."""
    energy_j = most_j = 0.0
    for k in range(1, trace.shape[0]):
        for axis in range(3):
            energy_j += trace[k - 1].acting_n[axis] * (trace[k].position_m[axis] - trace[k - 1].position_m[axis])
        most_j = max(most_j, energy_j)
    return most_j


@kernel
def smooth(trace: Any, spread_s: float, out_m: Any, out_n: Any) -> None:
    """Write Gaussian-smoothed motion and force over time into ``out_m`` and ``out_n`` (rows, 3)."""
    rows = trace.shape[0]
    first = 0
    for k in range(rows):
        while trace[k].t_s - trace[first].t_s > 3.5 * spread_s:
            first += 1
        total = 0.0
        out_m[k] = 0.0
        out_n[k] = 0.0
        j = first
        while j < rows and trace[j].t_s - trace[k].t_s <= 3.5 * spread_s:
            distance = (trace[j].t_s - trace[k].t_s) / spread_s
            weight = math.exp(-0.5 * distance * distance)
            total += weight
            for axis in range(3):
                out_m[k, axis] += weight * trace[j].position_m[axis]
                out_n[k, axis] += weight * trace[j].sent_n[axis]
            j += 1
        for axis in range(3):
            out_m[k, axis] /= total
            out_n[k, axis] /= total


def fast_part(vectors: Any, rate_hz: float, corner_hz: float, first: int, last: int, aside_s: float = 0.0) -> float:
    """Return the RMS of vectors (rows, 3) above a frequency, over the rows from ``first`` to ``last``.

    The strongest ``aside_s`` seconds are excluded.
    """
    squares = np.zeros(max(last - first, 1))
    _fast_squares(vectors, rate_hz, corner_hz, first, squares)
    excluded = min(int(aside_s * rate_hz), len(squares) - 1)
    sums = np.concatenate([[0.0], np.cumsum(squares)])
    strongest = (sums[excluded:] - sums[: len(sums) - excluded]).max()
    return math.sqrt(max(sums[-1] - strongest, 0.0) / (len(squares) - excluded))


@kernel
def _fast_squares(vectors: Any, rate_hz: float, corner_hz: float, first: int, out: Any) -> None:
    """Add the squares of the high-pass filtered vectors to ``out``, from row ``first`` onwards.

    The filter is a second-order Butterworth by the bilinear transform, started at rest some rows earlier.
    """
    w = math.tan(math.pi * corner_hz / rate_hz)
    gain = 1.0 / (1.0 + math.sqrt(2.0) * w + w * w)
    a1, a2 = 2.0 * (w * w - 1.0) * gain, (1.0 - math.sqrt(2.0) * w + w * w) * gain
    begin = max(0, first - int(0.05 * rate_hz))
    for axis in range(3):
        x1 = x2 = vectors[begin, axis]
        y1 = y2 = 0.0
        for k in range(begin, first + out.shape[0]):
            x = vectors[k, axis]
            y = gain * (x - 2.0 * x1 + x2) - a1 * y1 - a2 * y2
            x2, x1, y2, y1 = x1, x, y1, y
            if k >= first:
                out[k - first] += y * y
