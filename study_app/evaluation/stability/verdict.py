"""Whether a closed loop was stable: five things that must not happen, and the numbers that say so.

- *not finite*: a force or the handle's place is no number;
- *limit*: the servo sent more than it may;
- *energy*: the account at the handle (force that acts · true step, at most what the liquid can give back) fell below
  -1 mJ and the work of the steps under way, (1 + delay) · strongest force · longest step;
- *oscillation*: the handle, at rest or let go, goes on swinging above 12 Hz at more than 40 mm/s and does not tire over
  0.4 s, or does so above 40 Hz while it is being moved;
- *force*: above 40 Hz the force exceeds that of the same motion played without feedback by more than 0.05 N in the mean
  square root over a stretch of 0.4 s or more, the strongest 0.1 s of each aside.

"The same motion without feedback" is the more restless of three: the hand's own, the motors off; the handle's, without
what is faster than 40 Hz; and the latter with the encoder's last count undecided, as where a handle rests between two
counts. The last two begin from the same state of the liquid. A start, a stop and a letting-go excite every frequency:
what follows within 0.2 s is left out here; the oscillation is what must not outlive it. 0.1 s are left aside because
a wake that breaks turns the force from one turn to the next, by the model's own definition, and when a hand that swings
back makes it break hangs on micrometres: what happens once is no restlessness.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from study_app.evaluation.stability.cases import GRIPS, LETS_GO, MOTIONS, THROWN, Case, scene_of
from study_app.evaluation.stability.loop import LOOP, TRACE, begin, play, run
from study_app.evaluation.stability.measures import fast_part, lowest_balance, smooth
from study_app.haptics.layout import LIMITER_NAMES, SAMPLE, records
from study_app.haptics.limits import Bearable
from study_app.haptics.pace import new_pace
from study_app.haptics.pack import Model, pack
from study_app.haptics.plant import new_handle
from study_app.haptics.safety import new_safety

REASONS: Final = ("not finite", "limit", "energy", "oscillation", "force")

MOVING_S: Final = 1.2
LASTS_S: Final = 1.8
LETS_GO_S: Final = 0.6
SETTLES_S: Final = 0.2
LEAD_S: Final = 0.06
"""How long before a stretch is compared its playing begins, for filters to settle."""
REACH_M: Final = 0.06
TREMOR_M: Final = 20e-6
FORCE_LIMIT_N: Final = 8.0

ALLOWANCE_J: Final = 1e-3
SLOW_HZ: Final = 12.0
FAST_HZ: Final = 40.0
SWING_MPS: Final = 0.04
ONCE_S: Final = 0.1
TIRED: Final = 0.8
RESTLESS_N: Final = 0.05
SPREAD_S: Final = math.sqrt(math.log(2.0)) / (2.0 * math.pi * FAST_HZ)  # a Gaussian mean that halves 40 Hz's power


@dataclass(frozen=True, slots=True)
class Verdict:
    """What became of a case: ``reasons`` why it is unstable, none if it is not, and what was measured.

    ``acted`` is the share of turns in which each limiter acted, in the order of ``LIMITER_NAMES``.
    """

    case: Case
    safe: bool
    reasons: tuple[str, ...]
    balance_j: float
    permitted_j: float
    swing_mps: float
    fast_n: float
    played_n: float
    acted: tuple[float, ...]

    @property
    def stable(self) -> bool:
        """Whether there is no reason to call it unstable."""
        return not self.reasons


@dataclass(slots=True)
class _Bench:
    """Everything that a case runs on."""

    model: Model
    safety: Any
    sample: Any
    handle: Any
    pace: Any
    loop: Any


def judge(case: Case, *, safe: bool, limits: Bearable | None = None) -> Verdict:
    """Run a case, with the safety layer or without, and say whether it is stable.

    ``limits`` are tried in place of the table's.
    """
    bench = _bench(case, safe=safe, limits=limits)
    trace = _new_trace(case)
    begin(bench.loop, bench.handle)
    row = 0
    before = []
    for start_s, _ in _windows(case):
        row = _run(bench, trace, row, start_s - LEAD_S)
        before.append((row, _copy(bench)))
    trace = trace[: _run(bench, trace, row, LASTS_S)]
    if bench.loop.broken:
        return Verdict(case, safe, ("not finite",), math.nan, math.nan, math.nan, math.nan, math.nan, _acted(trace))
    balance_j, strongest_n, longest_m = lowest_balance(trace, case.delay)
    permitted_j = -ALLOWANCE_J - (1 + case.delay) * strongest_n * longest_m
    swing_mps = _swing(trace, case)
    fast_n, played_n = _restlessness(case, trace, before, limits)
    found = (
        False,
        safe and np.linalg.norm(trace.sent_n, axis=1).max() > FORCE_LIMIT_N * (1.0 + 1e-9),
        balance_j < permitted_j,
        swing_mps > SWING_MPS,
        fast_n - played_n > RESTLESS_N,
    )
    reasons = tuple(reason for reason, holds in zip(REASONS, found, strict=True) if holds)
    return Verdict(case, safe, reasons, balance_j, permitted_j, swing_mps, fast_n, played_n, _acted(trace))


def trace_of(case: Case) -> Any:
    """Return the trace of a case with the safety layer."""
    bench = _bench(case, safe=True, limits=None)
    begin(bench.loop, bench.handle)
    trace = _new_trace(case)
    return trace[: _run(bench, trace, 0, LASTS_S)]


def _new_trace(case: Case) -> Any:
    return records(TRACE, math.ceil((LASTS_S + 0.1) * case.rate_hz))


def _bench(case: Case, *, safe: bool, limits: Bearable | None) -> _Bench:
    """Return the case's model, handle and hand, ready to begin."""
    grip = GRIPS[case.hand]
    safety = new_safety(FORCE_LIMIT_N)
    safety[0].fade = 1.0
    handle = new_handle(
        mass_kg=case.mass_kg,
        viscous_nspm=case.viscous_nspm,
        coulomb_n=case.coulomb_n,
        hand_kg=grip.mass_kg,
        stiffness_npm=grip.stiffness_npm,
        damping_nspm=grip.damping_nspm,
        quantum_m=case.quantum_um * 1e-6,
        motor_limit_n=FORCE_LIMIT_N,
        motor_step_n=FORCE_LIMIT_N / 2048,
        delay=case.delay,
    )
    loop = records(LOOP, 1)[0]
    loop.safe = safe
    loop.motion = MOTIONS.index(case.motion)
    loop.speed_mps = case.speed_mps
    loop.way_m = REACH_M
    loop.moving_s = MOVING_S
    loop.release_s = {THROWN: 0.0, LETS_GO: LETS_GO_S}.get(case.hand, math.inf)
    loop.tremor_m = 0.0 if case.hand == THROWN else TREMOR_M
    loop.noise_m = case.noise_um * 1e-6
    model = pack(scene_of(case), delay_ticks=case.delay, limits=limits)
    pace = new_pace(1.0 / case.rate_hz, jitter_s=case.jitter / case.rate_hz, missed=case.missed)
    return _Bench(model, safety, records(SAMPLE, 1), handle, pace, loop)


def _copy(bench: _Bench) -> _Bench:
    """Return a bench of its own, in the same state."""
    model = Model(*(field.copy() for field in bench.model))
    handle, pace, loop = (record.copy() for record in (bench.handle, bench.pace, bench.loop))
    return _Bench(model, bench.safety.copy(), bench.sample.copy(), handle, pace, loop)


def _run(bench: _Bench, trace: Any, first: int, until_s: float) -> int:
    """Take turns from row ``first`` on until a time; return the row after the last."""
    bench.loop.until_s = until_s
    return int(run(bench.model, bench.safety[0], bench.sample[0], bench.handle, bench.pace, bench.loop, trace, first))


def _windows(case: Case) -> Iterator[tuple[float, float]]:
    """Yield the stretches of time [s] over which the force's fast part is compared."""
    if case.hand == THROWN:
        yield SETTLES_S, 1.0
        yield 1.0, LASTS_S
    elif case.hand == LETS_GO:
        yield SETTLES_S, LETS_GO_S
        yield LETS_GO_S + SETTLES_S, LASTS_S
    else:
        yield SETTLES_S, MOVING_S
        yield MOVING_S + SETTLES_S, LASTS_S


def _swing(trace: Any, case: Case) -> float:
    """Return the least swing [m/s] over the last 0.4 s if it does not tire, or over a second of the motion before."""

    def swings(corner_hz: float, times_s: Any) -> float:
        rows = np.searchsorted(trace.t_s, times_s)
        found = [
            fast_part(trace.velocity_mps, case.rate_hz, corner_hz, first, last)
            for first, last in itertools.pairwise(rows)
        ]
        return min(found) if found[-1] > TIRED * found[0] else 0.0

    return max(
        swings(SLOW_HZ, np.linspace(LASTS_S - 0.4, LASTS_S, 5)),
        swings(FAST_HZ, np.linspace(SETTLES_S, SETTLES_S + 1.0, 6)),
    )


def _restlessness(
    case: Case, trace: Any, before: list[tuple[int, _Bench]], limits: Bearable | None
) -> tuple[float, float]:
    """Return the force's fast part, and that of the same motion without feedback, where they differ most."""
    calm_m = np.zeros((len(trace), 3))
    smooth(trace, SPREAD_S, calm_m)
    undecided_m = case.quantum_um * 1e-6 * (np.random.default_rng(1).random(calm_m.shape) - 0.5)
    passive = _passive(case, bool(before[0][1].loop.safe), limits)
    found = []
    for window_s, (first, bench) in zip(_windows(case), before, strict=True):
        begins, ends = np.searchsorted(trace.t_s, window_s)
        played = [passive] if passive is not None else []
        for places_m in (calm_m, calm_m + undecided_m):
            again, answer = _copy(bench), trace.copy()
            answer.sent_n[:first] = 0.0
            play(
                again.model,
                again.safety[0],
                again.sample[0],
                again.handle,
                again.pace,
                again.loop,
                answer[first:ends],
                places_m[first:ends],
            )
            played.append(answer)
        fast_n, *others_n = (
            fast_part(one.sent_n, case.rate_hz, FAST_HZ, begins, min(ends, len(one)), ONCE_S)
            for one in (trace, *played)
        )
        found.append((fast_n, max(others_n)))
    return max(found, key=lambda pair: pair[0] - pair[1])


def _passive(case: Case, safe: bool, limits: Bearable | None) -> Any | None:
    """Return the trace of a hand that keeps hold of the handle while the motors are off."""
    if case.hand in {THROWN, LETS_GO}:
        return None
    off = _bench(case, safe=safe, limits=limits)
    off.handle.motor_limit_n = 0.0
    begin(off.loop, off.handle)
    trace = _new_trace(case)
    return trace[: _run(off, trace, 0, LASTS_S)]


def _acted(trace: Any) -> tuple[float, ...]:
    """Return the share of turns in which each limiter acted."""
    return tuple(float(np.mean((trace.limiters >> k) & 1)) for k in range(len(LIMITER_NAMES)))
