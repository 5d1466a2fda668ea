"""Whether applying estimates makes a closed loop unstable that is stable without.

Each case is one of the stability sweep that presents a liquid with the constant law of drag, longer in time. It runs
with the safety layer four times: with the setting as it is and with the greatest drag coefficient that may be applied,
both fixed; with estimates from a sensor in a second liquid, applied continuously; and with the drag coefficient moved
to and fro between half of its value and the greatest, as fast as application permits: faster than any estimate. The
sensor measures the second liquid's force at the handle's true motion, with 0.03 N of noise.

A loop counts as unstable by the criteria of `stability.verdict`: not finite, limit, energy, oscillation, and a force
above 40 Hz that exceeds that of the loop with either fixed setting by more than 0.05 N.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Any, Final, Literal, TypeAlias

import numpy as np

from study_app.evidence.stability.bench import FORCE_LIMIT_N, Bench, dynamics_of, fast_part, lowest_balance, new_trace
from study_app.evidence.stability.case_groups import sweep
from study_app.evidence.stability.stability_cases import Case, scene_of
from study_app.evidence.stability.verdict import (
    ALLOWANCE_J,
    FAST_HZ,
    ONCE_S,
    REASONS,
    RESTLESS_N,
    SETTLES_S,
    SWING_MPS,
    reasons_of,
    resting_swing,
)
from study_app.evidence.table import Evidence
from study_app.haptics.model.scene import Scene
from study_app.haptics.runtime.offline import ModelAlong
from study_app.haptics.runtime.pack import adjust_into
from study_app.lab.estimation.estimator import Estimate, OnlineEstimator
from study_app.lab.estimation.fits import DRAG
from study_app.lab.estimation.live_estimation import most_drag_coefficient, stepped
from study_app.lab.estimation.sources import NOISE_N, Floats, Rows, as_measured

LIQUIDS: Final = ("water", "light_oil", "honey", "dense")
MOVING_S: Final = 4.0
LASTS_S: Final = 5.0
FRAME_S: Final = 0.033
TURNS_S: Final = 0.6
FACTORS: Final = (0.3, 3.0)
"""Of the drag coefficient, in multiples of the setting's."""
_MEMORY_S: Final = 2.0

Way: TypeAlias = Literal["fixed", "most", "estimated", "to and fro"]
WAYS: Final[tuple[Way, ...]] = ("estimated", "to and fro")


@dataclass(frozen=True, slots=True)
class AppliedCase:
    """A case of the sweep and the drag coefficient of the measured liquid, in multiples of the setting's."""

    case: Case
    factor: float


@dataclass(frozen=True, slots=True)
class AppliedVerdict:
    """``reasons`` by way why a loop is unstable, and the drag coefficients applied: the last, by way, and how often.

    ``stable_before`` is whether both fixed settings are stable.
    """

    applied: AppliedCase
    stable_before: bool
    reasons: dict[str, tuple[str, ...]]
    last: dict[str, float]
    steps: dict[str, int]
    identified: bool

    @property
    def harmed(self) -> bool:
        """Whether a loop that was stable is not."""
        return self.stable_before and any(self.reasons[way] for way in WAYS)


@dataclass(slots=True, eq=False)
class _Run:
    trace: Any
    broken: bool
    last: float
    steps: int
    identified: bool


def applied_cases(count: int, seed: str = "estimation") -> tuple[AppliedCase, ...]:
    """Return so many cases, at most all of the sweep's, in an order drawn from the seed."""
    draw = Random(seed)  # noqa: S311 - of cases
    found = [case for case in sweep() if case.liquid in LIQUIDS]
    draw.shuffle(found)
    low, high = map(math.log, FACTORS)
    return tuple(AppliedCase(case, math.exp(draw.uniform(low, high))) for case in found[:count])


def judge_applied(applied: AppliedCase) -> AppliedVerdict:
    """Run a case with fixed settings and with applied estimates."""
    runs = {way: _run(applied, way) for way in ("fixed", "most", *WAYS)}
    calm = [_fast_n(runs[way].trace, applied.case) for way in ("fixed", "most")]
    fixed = [_reasons(runs[way], applied.case, calm) for way in ("fixed", "most")]
    return AppliedVerdict(
        applied,
        not any(fixed),
        {way: _reasons(runs[way], applied.case, calm) for way in WAYS},
        {way: runs[way].last for way in WAYS},
        {way: runs[way].steps for way in WAYS},
        runs["estimated"].identified,
    )


def evidence(verdicts: Sequence[AppliedVerdict]) -> Evidence:
    """Return the results as text."""
    stable = [it for it in verdicts if it.stable_before]
    identified = sum(it.identified for it in stable)
    lines = [
        f"{len(verdicts)} closed loops of the stability sweep, {LASTS_S:g} s each; "
        f"{len(stable)} stable with both fixed settings"
    ]
    for way in WAYS:
        bad = sum(bool(it.reasons[way]) for it in stable)
        steps = sum(it.steps[way] for it in stable)
        lines.append(f"  {way:<12} unstable {bad} of {len(stable)}; {steps} changes of the drag coefficient")
    lines.append(f"  the motion identified the drag coefficient in {identified} of {len(stable)}")
    lines += [f"unstable: factor={it.applied.factor:.4g} {it.applied.case} {it.reasons}" for it in stable if it.harmed]
    text = "\n".join(lines) + "\n"
    return Evidence(text, {"estimation.txt": text}, missed=any(it.harmed for it in verdicts))


def _run(applied: AppliedCase, way: Way) -> _Run:
    case = applied.case
    scene, dynamics = scene_of(case), dynamics_of(case)
    most = most_drag_coefficient(scene, dynamics, FORCE_LIMIT_N)
    bench = Bench(case, scene=_with_drag(scene, most) if way == "most" else scene)
    bench.loop.moving_s = MOVING_S
    bench.begin()
    trace = new_trace(case, LASTS_S)
    if way in {"fixed", "most"}:
        rows = bench.run(trace, 0, LASTS_S)
        return _Run(trace[:rows], bool(bench.loop.broken), 0.0, 0, identified=False)
    follower = _Follower(applied, scene, way)
    rows, until_s = 0, 0.0
    while until_s < LASTS_S and not bench.loop.broken:
        until_s += FRAME_S
        before, rows = rows, bench.run(trace, rows, min(until_s, LASTS_S))
        follower.apply(bench, trace[before:rows], dynamics, until_s)
    return _Run(trace[:rows], bool(bench.loop.broken), follower.drag, follower.steps, follower.estimate.identified)


class _Follower:
    """What measures, estimates and applies, frame by frame."""

    def __init__(self, applied: AppliedCase, scene: Scene, way: Way) -> None:
        self._way, self._scene, self._start = way, scene, scene
        self._sensor = ModelAlong(
            as_measured(_with_drag(scene, min(applied.factor * scene.body.drag_coefficient, 10.0))), given=True
        )
        self._noise = np.random.default_rng(1)
        self._estimator = OnlineEstimator(as_measured(scene), memory_s=_MEMORY_S)
        self.steps = 0

    @property
    def drag(self) -> float:
        return self._scene.body.drag_coefficient

    @property
    def estimate(self) -> Estimate:
        return self._estimator.estimate

    def apply(self, bench: Bench, part: Any, dynamics: Any, now_s: float) -> None:
        """Process the ticks of a frame, and set the values that application sets next."""
        self._estimator.take(self._measured(part))
        found = self._estimator.estimate if self._way == "estimated" else self._turning(now_s, dynamics)
        for value in stepped(self._scene, found, dynamics, FORCE_LIMIT_N, FRAME_S).values():
            self._scene = _with_drag(self._scene, value)
            adjust_into(bench.model, self._scene, dynamics=dynamics)
            self.steps += 1

    def _turning(self, now_s: float, dynamics: Any) -> Estimate:
        """Return an estimate that turns between half of the start and the most."""
        most = most_drag_coefficient(self._start, dynamics, FORCE_LIMIT_N)
        half = 0.5 * self._start.body.drag_coefficient
        target = most if math.floor(now_s / TURNS_S) % 2 == 0 else half
        return Estimate({DRAG: target}, {}, identified=True, reason="")

    def _measured(self, part: Any) -> Rows:
        scale = self._start.scale
        velocity_mps: Floats = scale * np.array(part.velocity_mps)
        position_m: Floats = scale * np.array(part.position_m) + np.asarray(self._start.origin_m)
        force_n = np.array(self._sensor.follow(part.t_s, position_m, velocity_mps).force_n)
        force_n += NOISE_N * self._noise.standard_normal(force_n.shape)
        return Rows(np.array(part.t_s), position_m, velocity_mps, force_n, np.ones(len(part), bool))


def _reasons(run: _Run, case: Case, calm_n: Sequence[Floats]) -> tuple[str, ...]:
    trace = run.trace
    if run.broken:
        return (REASONS[0],)
    balance_j, strongest_n, longest_m = lowest_balance(trace)
    permitted_j = -ALLOWANCE_J - (1 + case.delay) * strongest_n * longest_m
    restless = bool((_fast_n(trace, case) > np.max(calm_n, axis=0) + RESTLESS_N).any())
    return reasons_of(
        np.linalg.norm(trace.sent_n, axis=1).max() > FORCE_LIMIT_N * (1 + 1e-9),
        balance_j < permitted_j,
        resting_swing(trace, case, LASTS_S) > SWING_MPS,
        restless,
    )


def _fast_n(trace: Any, case: Case) -> Floats:
    """Return the force above 40 Hz while the hand moves and while it rests (2,) [N]."""
    spans_s = ((SETTLES_S, MOVING_S), (MOVING_S + SETTLES_S, LASTS_S))
    rows = [np.searchsorted(trace.t_s, span_s) for span_s in spans_s]
    return np.array([fast_part(trace.sent_n, case.rate_hz, FAST_HZ, first, last, ONCE_S) for first, last in rows])


def _with_drag(scene: Scene, drag_coefficient: float) -> Scene:
    body = scene.body.model_copy(update={"drag_coefficient": drag_coefficient})
    return scene.model_copy(update={"body": body})
