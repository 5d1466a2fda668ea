"""What a case runs on: model, safety layer, handle and hand, ready to begin, and copies of them in mid-motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

from study_app.evidence.stability.arm_plant import ARMS, new_arm
from study_app.evidence.stability.closed_loop import LOOP, TRACE, begin, run
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
from study_app.haptics.kernels.plant import new_handle
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.kernels.tick_schedule import new_schedule
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.layout import SAMPLE, records
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import DampingLimits
from study_app.haptics.runtime.pack import Model, pack

MOVING_S: Final = 1.2
LASTS_S: Final = 1.8
FREE_S: Final = 1.2
"""How long a handle that was let go is watched."""
TREMOR_M: Final = 20e-6
FORCE_LIMIT_N: Final = 8.0


@dataclass(slots=True)
class Bench:
    """The records of one closed loop."""

    model: Model
    safety: Any
    sample: Any
    handle: Any
    pace: Any
    loop: Any

    def copy(self) -> Bench:
        """Return a bench of its own, in the same state."""
        rows = type(self.model.rows)(*(array.copy() for array in self.model.rows))
        model = Model._make([*(array.copy() for array in self.model[:-1]), rows])
        handle, pace, loop = (record.copy() for record in (self.handle, self.pace, self.loop))
        return Bench(model, self.safety.copy(), self.sample.copy(), handle, pace, loop)

    def run(self, trace: Any, first: int, until_s: float) -> int:
        """Run ticks into ``trace`` from row ``first`` on until a time [s]; return the row after the last."""
        self.loop.until_s = until_s
        return int(run(self.model, self.safety[0], self.sample[0], self.handle, self.pace, self.loop, trace, first))


def lasts_s(case: Case) -> float:
    """Return how long a case lasts [s]."""
    return max(LASTS_S, case.release_s + FREE_S) if case.hand == LETS_GO else LASTS_S


def new_trace(case: Case) -> Any:
    """Return an empty trace that has room for a case."""
    return records(TRACE, math.ceil((lasts_s(case) + 0.1) * case.rate_hz))


def trace_of(case: Case) -> Any:
    """Return the trace of a case with the safety layer."""
    bench = new_bench(case, safe=True)
    begin(bench.loop, bench.handle)
    trace = new_trace(case)
    return trace[: bench.run(trace, 0, lasts_s(case))]


def new_bench(case: Case, *, safe: bool, limits: DampingLimits | None = None, scene: Scene | None = None) -> Bench:
    """Return the records of a case; ``limits`` are tried in place of the table's, ``scene`` in place of the case's."""
    safety = new_safety(FORCE_LIMIT_N, case.believed_delay)
    safety[0].fade, safety[0].fade_s = 1.0, 0.0
    loop = records(LOOP, 1)[0]
    loop.safe = safe
    loop.motion = MOTIONS.index(case.motion)
    loop.speed_mps = case.speed_mps
    loop.way_m = case.way_mm * 1e-3
    loop.moving_s = max(MOVING_S, case.release_s) if case.hand == LETS_GO else MOVING_S
    loop.release_s = {THROWN: 0.0, LETS_GO: case.release_s}.get(case.hand, math.inf)
    loop.tremor_m = 0.0 if case.hand == THROWN else TREMOR_M
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
    if case.plant == SECOND:
        loop.arm = new_arm(ARMS[case.hand], handle_kg=case.mass_kg, **_device(case))
    grip = GRIPS[case.hand]
    handle = new_handle(
        mass_kg=case.mass_kg,
        hand_kg=grip.mass_kg,
        stiffness_npm=grip.stiffness_npm,
        damping_nspm=grip.damping_nspm,
        quantum_m=case.quantum_um * 1e-6,
        **_device(case),
    )
    model = pack(scene or scene_of(case), limits=limits, dynamics=dynamics_of(case))
    pace = new_schedule(1.0 / case.rate_hz, jitter_s=case.jitter / case.rate_hz, missed=case.missed)
    return Bench(model, safety, records(SAMPLE, 1), handle, pace, loop)


def dynamics_of(case: Case) -> Dynamics:
    """Return what the device states: its least mass and its delay, as they are believed, and its velocity's lag."""
    least_kg = case.believed_kg or (min(case.mass_kg, case.other_kg) if case.other_kg else case.mass_kg)
    lag_s = case.velocity_lag / case.rate_hz if case.estimator == DEVICE else None
    return Dynamics(case.believed_delay / case.rate_hz, case.quantum_um * 1e-6, least_kg, lag_s)


def _device(case: Case) -> dict[str, Any]:
    """Return what both plants have in common: friction and motors of the device."""
    return {
        "viscous_nspm": case.viscous_nspm,
        "coulomb_n": case.coulomb_n,
        "motor_limit_n": FORCE_LIMIT_N,
        "motor_step_n": FORCE_LIMIT_N / 2048,
        "delay": case.delay,
    }
