"""The verdict on a closed loop (stable, noisy or unstable) from six criteria.

- *not finite*: a force or the handle's position is not finite;
- *limit*: the servo sent a force above its limit;
- *energy*: the energy balance at the handle (acting force · true step, at most the energy that the liquid can return)
  fell below -1 mJ minus the work of the pending steps, (1 + delay) · strongest force · longest step; or below -10 mJ,
  if that is lower and the loop misjudges the device's delay;
- *oscillation*: the handle, at rest or released, oscillates above 12 Hz at more than 40 mm/s without decaying over
  0.4 s, or does so above 40 Hz while it is being moved;
- *sustained force*: above 40 Hz the force exceeds that of the same motion played without feedback by more than 0.05 N
  RMS in each of four successive intervals of 0.1 s, and by at least 0.8 times as much in the last as in the first; and
  it stays above 0.05 N RMS, without decaying by the same factor, once the encoder becomes exact, which distinguishes an
  oscillation from amplified noise;
- *noise*: it does so over an interval of 0.4 s or more, excluding the strongest 0.1 s of each, and is not sustained.

A case with any reason but noise is **unstable**; one with noise alone is **noisy**: its force buzzes for a moment, but
neither supplies energy nor persists.

If a study delays the force, the controller works at its limits. The energy may then be lower by the work of the
strongest force over an encoder count and the noise, the oscillation may reach 100 mm/s, and the force may exceed that
of the motion without feedback by a fifth.

"The same motion without feedback" is the one of three motions with the strongest force above 40 Hz: the hand's own
motion with the motors off, for as long as it holds the handle; the handle's motion without its part above 40 Hz; and
the latter with an error of up to half an encoder count, as of a handle that rests between two counts. The last two
begin from the same state of the liquid, and samples are lost and repeated in the same ticks. A start, a stop and a
release excite all frequencies, so the first 0.2 s after them are excluded; an oscillation lasts longer. The strongest
0.1 s are excluded because a breaking wake changes the force from one tick to the next, as the model defines, and a few
micrometres decide whether it breaks when a hand reverses. A hand that shakes a handle makes the wake break at every
reversal even with the motors off, so the first of the three motions also applies to a hand that lets go later.
"""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from study_app.evidence.stability.bench import (
    FORCE_LIMIT_N,
    MOVING_S,
    Bench,
    fast_part,
    lasts_s,
    lowest_balance,
    new_trace,
    smooth,
)
from study_app.evidence.stability.stability_cases import LETS_GO, THROWN, Case
from study_app.haptics.model.layout import LIMITER_NAMES
from study_app.haptics.model.slope_limits import DampingLimits

STABLE: Final = "stable"
NOISY: Final = "noisy"
UNSTABLE: Final = "unstable"
_NOISE_REASON: Final = "noise"
REASONS: Final = ("not finite", "limit", "energy", "oscillation", "sustained force", _NOISE_REASON)
"""Reasons for a verdict; all but the last make a case unstable."""

_SETTLING_S: Final = 0.2
_LEAD_S: Final = 0.06
"""Time before a compared window at which its replay begins, so that filters settle [s]."""

ALLOWANCE_J: Final = 1e-3
MISJUDGED_ALLOWANCE_J: Final = 10e-3
"""Allowance if the device's delay differs from the believed one, or changes [J]."""
_SLOW_HZ: Final = 12.0
_FAST_HZ: Final = 40.0
SWING_MPS: Final = 0.04
_LINKED_SWING_MPS: Final = 0.1
"""Permitted oscillation if a study delays the force [m/s]: the tolerated 1 mJ moves 0.2 kg at this speed."""
_LINKED_SHARE: Final = 0.2
"""Permitted excess of a delayed force relative to the one without feedback, since jitter and loss cause such steps."""
_INTERVAL_S: Final = 0.1
_SUSTAINED_INTERVALS: Final = 4
"""Number of successive intervals of `_INTERVAL_S` in which a sustained force exceeds its limit."""
_DECAY: Final = 0.8
_PERMITTED_EXCESS_N: Final = 0.05
_SPREAD_S: Final = math.sqrt(math.log(2.0)) / (2.0 * math.pi * _FAST_HZ)  # a Gaussian mean that halves 40 Hz's power


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The verdict on a case: ``reasons`` why it is unstable or noisy, empty if it is stable, and what was measured.

    ``acted`` is the fraction of ticks in which each limiter acted, in the order of ``LIMITER_NAMES``.
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
    def grade(self) -> str:
        if not self.reasons:
            return STABLE
        return NOISY if self.reasons == (_NOISE_REASON,) else UNSTABLE


class FastForce(NamedTuple):
    """The force above 40 Hz [N RMS], that of the control, and whether the excess is beyond its limit and sustained."""

    fast_n: float
    control_n: float
    excessive: bool
    sustained: bool


def not_finite(case: Case, trace: Any, *, safe: bool) -> Verdict:
    """Return the verdict on a loop whose values became infinite or NaN."""
    return Verdict(
        case=case,
        safe=safe,
        reasons=REASONS[:1],
        balance_j=math.nan,
        permitted_j=math.nan,
        swing_mps=math.nan,
        fast_n=math.nan,
        played_n=math.nan,
        acted=acted(trace),
    )


def reasons_of(*, limit: bool, energy: bool, oscillation: bool, fast_force: FastForce) -> tuple[str, ...]:
    """Return the names of the reasons that apply to a finite trace."""
    noise = fast_force.excessive and not fast_force.sustained
    applies = (False, limit, energy, oscillation, fast_force.sustained, noise)
    return tuple(itertools.compress(REASONS, applies))


def judge(case: Case, *, safe: bool, limits: DampingLimits | None = None) -> Verdict:
    """Run a case with or without the safety layer, and return the verdict on its stability.

    ``limits`` replace those of the table.
    """
    bench = Bench(case, safe=safe, limits=limits)
    trace = new_trace(case)
    bench.begin()
    row = 0
    windows_begun = []
    for start_s, _ in windows(case):
        row = bench.run(trace, row, start_s - _LEAD_S)
        windows_begun.append((row, bench.copy()))
    trace = trace[: bench.run(trace, row, lasts_s(case))]
    if bench.loop.broken:
        return not_finite(case, trace, safe=safe)
    balance_j, strongest_n, longest_m = lowest_balance(trace)
    has_link = bool(case.force_delay_ms or case.force_jitter_ms or case.force_loss)
    permitted_j = -ALLOWANCE_J - (1 + max(case.delay, case.slows_to)) * strongest_n * longest_m
    if has_link:
        permitted_j -= strongest_n * (case.quantum_um + case.noise_um) * 1e-6
    if case.misjudged:
        permitted_j = min(permitted_j, -MISJUDGED_ALLOWANCE_J)
    swing_mps = swing(trace, case)
    fast_force = _fast_force_excess(case, trace, windows_begun, limits, late_share=_LINKED_SHARE if has_link else 0.0)
    if fast_force.sustained:
        persists = any(
            _persists_with_exact_encoder(case, trace, *window)
            for window in zip(windows(case), windows_begun, strict=True)
        )
        fast_force = fast_force._replace(sustained=persists)
    reasons = reasons_of(
        limit=safe and np.linalg.norm(trace.sent_n, axis=1).max() > FORCE_LIMIT_N * (1.0 + 1e-9),
        energy=balance_j < permitted_j,
        oscillation=swing_mps > (_LINKED_SWING_MPS if has_link else SWING_MPS),
        fast_force=fast_force,
    )
    return Verdict(
        case=case,
        safe=safe,
        reasons=reasons,
        balance_j=balance_j,
        permitted_j=permitted_j,
        swing_mps=swing_mps,
        fast_n=fast_force.fast_n,
        played_n=fast_force.control_n,
        acted=acted(trace),
    )


def windows(case: Case) -> Iterator[tuple[float, float]]:
    """Yield the time intervals [s] over which the force's fast part is compared."""
    if case.hand == THROWN:
        yield _SETTLING_S, 1.0
        yield 1.0, lasts_s(case)
    elif case.hand == LETS_GO:
        yield _SETTLING_S, case.release_s
        yield case.release_s + _SETTLING_S, lasts_s(case)
    else:
        yield _SETTLING_S, MOVING_S
        yield MOVING_S + _SETTLING_S, lasts_s(case)


def swing(trace: Any, case: Case) -> float:
    """Return the least sustained oscillation [m/s] over the last 0.4 s, or over a second of the motion before."""
    moving = _swing_between(trace, case, _FAST_HZ, np.linspace(_SETTLING_S, _SETTLING_S + 1.0, 6))
    return max(_resting_swing(trace, case, lasts_s(case)), moving)


def _resting_swing(trace: Any, case: Case, end_s: float) -> float:
    """Return the least oscillation [m/s] over the 0.4 s before a time [s]; 0 if it decays."""
    return _swing_between(trace, case, _SLOW_HZ, np.linspace(end_s - 0.4, end_s, 5))


def _swing_between(trace: Any, case: Case, corner_hz: float, times_s: Any) -> float:
    """Return the least oscillation above a frequency [m/s] between successive times [s]; 0 if it decays."""
    rows = np.searchsorted(trace.t_s, times_s)
    swings = [
        fast_part(trace.velocity_mps, case.rate_hz, corner_hz, first, last) for first, last in itertools.pairwise(rows)
    ]
    return min(swings) if swings[-1] > _DECAY * swings[0] else 0.0


def _fast_force_excess(
    case: Case, trace: Any, begun: list[tuple[int, Bench]], limits: DampingLimits | None, *, late_share: float
) -> FastForce:
    """Compare the force's fast part with that of the same motion without feedback, where they differ most."""
    smoothed = low_pass_trace(trace)
    passive = _passive_trace(case, bool(begun[0][1].loop.safe), limits)
    comparisons = []
    for window_s, (first, bench) in zip(windows(case), begun, strict=True):
        begins, ends = np.searchsorted(trace.t_s, window_s)
        played = [passive] if passive is not None and len(passive) >= ends else []
        for places_m in (smoothed.position_m, with_count_error(smoothed.position_m, case.quantum_um)):
            replayed, played_trace = bench.copy(), smoothed.copy()
            played_trace.sent_n[:first] = 0.0
            replayed.play(played_trace[first:ends], places_m[first:ends])
            played.append(played_trace)
        controls_n = [played_trace.sent_n[:ends] for played_trace in played]
        comparisons.append(compare_fast(trace.sent_n[:ends], controls_n, case.rate_hz, begins, late_share=late_share))
    return worst_of(comparisons)


def _persists_with_exact_encoder(
    case: Case, trace: Any, window_s: tuple[float, float], begun: tuple[int, Bench]
) -> bool:
    """Return whether the force keeps its fast part when the encoder becomes exact halfway through a window."""
    rerun, bench = trace.copy(), begun[1].copy()
    middle = bench.run(rerun, begun[0], 0.5 * sum(window_s))
    bench.handle.quantum_m = bench.loop.noise_m = bench.loop.outliers = 0.0
    ends = bench.run(rerun, middle, window_s[1])
    interval = round(_INTERVAL_S * case.rate_hz)
    rows = range(middle + interval, ends + 1, interval)
    parts_n = [fast_part(rerun.sent_n, case.rate_hz, _FAST_HZ, *each) for each in itertools.pairwise(rows)]
    return not parts_n or (min(parts_n) > _PERMITTED_EXCESS_N and parts_n[-1] >= _DECAY * parts_n[0])


def low_pass_trace(trace: Any) -> Any:
    """Return a copy of a trace whose motion and sent forces contain no frequencies above 40 Hz."""
    smoothed = trace.copy()
    smooth(trace, _SPREAD_S, smoothed.position_m, smoothed.sent_n)
    smoothed.velocity_mps[:] = np.gradient(smoothed.position_m, trace.t_s, axis=0)
    return smoothed


def with_count_error(position_m: Any, count_um: float) -> Any:
    """Return positions (rows, 3) [m] with an error of up to half an encoder count, as between two counts."""
    return position_m + count_um * 1e-6 * (np.random.default_rng(1).random(position_m.shape) - 0.5)


def compare_fast(
    force_n: Any, controls_n: Sequence[Any], rate_hz: float, first: int, *, late_share: float = 0.0
) -> FastForce:
    """Compare the fast part of a force (rows, 3) [N] with the greatest of its controls, from row ``first`` onwards.

    The permitted excess is 0.05 N, or ``late_share`` of the control if that is more. Controls may have fewer rows.
    """

    def measure(begins: int, ends: int, excluded_s: float = 0.0) -> tuple[float, float]:
        fast_n, *controls_fast_n = (
            fast_part(vectors, rate_hz, _FAST_HZ, begins, min(ends, len(vectors)), excluded_s)
            for vectors in (force_n, *controls_n)
        )
        return fast_n, max(controls_fast_n)

    fast_n, control_n = measure(first, len(force_n), _INTERVAL_S)
    rows = range(first, len(force_n) + 1, round(_INTERVAL_S * rate_hz))
    pairs_n = np.array([measure(*interval) for interval in itertools.pairwise(rows)]).reshape(-1, 2)
    permitted_n = np.maximum(_PERMITTED_EXCESS_N, late_share * pairs_n[:, 1])
    return FastForce(
        fast_n=fast_n,
        control_n=control_n,
        excessive=fast_n - control_n > max(_PERMITTED_EXCESS_N, late_share * control_n),
        sustained=_is_sustained(pairs_n[:, 0] - pairs_n[:, 1], permitted_n),
    )


def _is_sustained(excesses_n: Any, permitted_n: Any) -> bool:
    """Return whether the excess is beyond what is permitted in four successive intervals, and does not decay."""
    is_beyond = excesses_n > permitted_n
    last = len(is_beyond) - _SUSTAINED_INTERVALS + 1
    return any(
        is_beyond[k : k + _SUSTAINED_INTERVALS].all()
        and excesses_n[k + _SUSTAINED_INTERVALS - 1] >= _DECAY * excesses_n[k]
        for k in range(last)
    )


def worst_of(compared: Sequence[FastForce]) -> FastForce:
    """Return the greatest excess; it is sustained if any is."""
    worst = max(compared, key=lambda comparison: comparison.fast_n - comparison.control_n)
    return worst._replace(sustained=any(comparison.sustained for comparison in compared))


def _passive_trace(case: Case, safe: bool, limits: DampingLimits | None) -> Any | None:
    """Return the trace of a hand that holds the handle with the motors off, for as long as it holds it."""
    if case.hand == THROWN:
        return None
    bench = Bench(case, safe=safe, limits=limits)
    bench.handle.motor_limit_n = bench.loop.arm.motor_limit_n = 0.0
    bench.begin()
    trace = new_trace(case)
    return trace[: bench.run(trace, 0, min(lasts_s(case), bench.loop.release_s))]


def acted(trace: Any) -> tuple[float, ...]:
    """Return the fraction of ticks in which each limiter acted."""
    return tuple(float(np.mean((trace.limiters >> k) & 1)) for k in range(len(LIMITER_NAMES)))
