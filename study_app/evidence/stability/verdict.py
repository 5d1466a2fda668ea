"""Whether a closed loop was stable, noisy or unstable: six things that must not happen, and their numbers.

- *not finite*: a force or the handle's position is not finite;
- *limit*: the servo sent more than it may;
- *energy*: the passivity at the handle (force that acts · true step, at most what the liquid can give back) fell below
  -1 mJ and the work of the steps under way, (1 + delay) · strongest force · longest step; or below -10 mJ, if that is
  lower, where the loop is mistaken about the device's delay;
- *oscillation*: the handle, at rest or let go, oscillates above 12 Hz at more than 40 mm/s without decaying over 0.4 s,
  or does so above 40 Hz while it is being moved;
- *sustained force*: above 40 Hz the force exceeds that of the same motion played without feedback by more than 0.05 N
  RMS in each of four successive intervals of 0.1 s, and by at least 0.8 times as much in the last as in the first; and
  it stays above 0.05 N RMS, without decaying by the same factor, once the encoder becomes exact, which distinguishes an
  oscillation from amplified noise;
- *noise*: it does so over an interval of 0.4 s or more, excluding the strongest 0.1 s of each, and is not sustained.

A case with any reason but noise is **unstable**; one with noise alone is **noisy**: its force buzzes for a moment, but
neither supplies energy nor persists.

Where a study delays the force, the controller works at its limits: the energy may be lower by the work of the strongest
force over an encoder count and the noise, the oscillation may reach 100 mm/s, and the force may exceed that of the
motion without feedback by a fifth.

"The same motion without feedback" is the one of three with the strongest force above 40 Hz: the hand's own motion with
the motors off, for as long as it holds the handle; the handle's motion without its part above 40 Hz; and the latter
with an error of up to half an encoder count, as of a handle that rests between two counts. The last two begin from the
same state of the liquid, and samples are lost and repeated in the same ticks. A start, a stop and a release excite
every frequency, so the first 0.2 s after them are excluded: an oscillation lasts longer. The strongest 0.1 s are
excluded because a wake that breaks changes the force from one tick to the next, as the model defines it, and a few
micrometres decide whether it breaks when a hand reverses. A hand that shakes a handle makes the wake break at every
reversal, with the motors off, too; so the first of the three also applies to a hand that lets go later.
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
_NOISE: Final = "noise"
REASONS: Final = ("not finite", "limit", "energy", "oscillation", "sustained force", _NOISE)
"""All but the last make a case unstable."""

_SETTLES_S: Final = 0.2
_LEAD_S: Final = 0.06
"""How long before a stretch is compared its playing begins, for filters to settle."""

ALLOWANCE_J: Final = 1e-3
MISJUDGED_ALLOWANCE_J: Final = 10e-3
"""The same where the device's delay is another than the loop believes, or changes."""
_SLOW_HZ: Final = 12.0
_FAST_HZ: Final = 40.0
SWING_MPS: Final = 0.04
_LATE_SWING_MPS: Final = 0.1
"""The same of a force that a study delays: 1 mJ, which the controller tolerates, moves 0.2 kg at this speed."""
_LATE_SHARE: Final = 0.2
"""Permitted excess of such a force, as a share of the one without feedback: jitter and loss make steps of its size."""
_INTERVAL_S: Final = 0.1
_SUSTAINED: Final = 4
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
        return NOISY if self.reasons == (_NOISE,) else UNSTABLE


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
    before = []
    for start_s, _ in windows(case):
        row = bench.run(trace, row, start_s - _LEAD_S)
        before.append((row, bench.copy()))
    trace = trace[: bench.run(trace, row, lasts_s(case))]
    if bench.loop.broken:
        return not_finite(case, trace, safe=safe)
    balance_j, strongest_n, longest_m = lowest_balance(trace)
    linked = bool(case.force_delay_ms or case.force_jitter_ms or case.force_loss)
    permitted_j = -ALLOWANCE_J - (1 + max(case.delay, case.slows_to)) * strongest_n * longest_m
    if linked:
        permitted_j -= strongest_n * (case.quantum_um + case.noise_um) * 1e-6
    if case.misjudged:
        permitted_j = min(permitted_j, -MISJUDGED_ALLOWANCE_J)
    swing_mps = swing(trace, case)
    fast_force = _fast_force_excess(case, trace, before, limits, late_share=_LATE_SHARE if linked else 0.0)
    if fast_force.sustained:
        lasts = any(_outlasts_noise(case, trace, *each) for each in zip(windows(case), before, strict=True))
        fast_force = fast_force._replace(sustained=lasts)
    reasons = reasons_of(
        limit=safe and np.linalg.norm(trace.sent_n, axis=1).max() > FORCE_LIMIT_N * (1.0 + 1e-9),
        energy=balance_j < permitted_j,
        oscillation=swing_mps > (_LATE_SWING_MPS if linked else SWING_MPS),
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
        yield _SETTLES_S, 1.0
        yield 1.0, lasts_s(case)
    elif case.hand == LETS_GO:
        yield _SETTLES_S, case.release_s
        yield case.release_s + _SETTLES_S, lasts_s(case)
    else:
        yield _SETTLES_S, MOVING_S
        yield MOVING_S + _SETTLES_S, lasts_s(case)


def swing(trace: Any, case: Case) -> float:
    """Return the least sustained oscillation [m/s] over the last 0.4 s, or over a second of the motion before."""
    moving = _swing_between(trace, case, _FAST_HZ, np.linspace(_SETTLES_S, _SETTLES_S + 1.0, 6))
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
    case: Case, trace: Any, before: list[tuple[int, Bench]], limits: DampingLimits | None, *, late_share: float
) -> FastForce:
    """Compare the force's fast part with that of the same motion without feedback, where they differ most."""
    calm = low_pass_trace(trace)
    passive = _passive(case, bool(before[0][1].loop.safe), limits)
    compared = []
    for window_s, (first, bench) in zip(windows(case), before, strict=True):
        begins, ends = np.searchsorted(trace.t_s, window_s)
        played = [passive] if passive is not None and len(passive) >= ends else []
        for places_m in (calm.position_m, with_count_error(calm.position_m, case.quantum_um)):
            again, answer = bench.copy(), calm.copy()
            answer.sent_n[:first] = 0.0
            again.play(answer[first:ends], places_m[first:ends])
            played.append(answer)
        controls_n = [answer.sent_n[:ends] for answer in played]
        compared.append(compare_fast(trace.sent_n[:ends], controls_n, case.rate_hz, begins, late_share=late_share))
    return worst_of(compared)


def _outlasts_noise(case: Case, trace: Any, window_s: tuple[float, float], begun: tuple[int, Bench]) -> bool:
    """Return whether the force keeps its fast part when the encoder becomes exact halfway through a window."""
    again, bench = trace.copy(), begun[1].copy()
    middle = bench.run(again, begun[0], 0.5 * sum(window_s))
    bench.handle.quantum_m = bench.loop.noise_m = bench.loop.outliers = 0.0
    ends = bench.run(again, middle, window_s[1])
    interval = round(_INTERVAL_S * case.rate_hz)
    rows = range(middle + interval, ends + 1, interval)
    parts_n = [fast_part(again.sent_n, case.rate_hz, _FAST_HZ, *each) for each in itertools.pairwise(rows)]
    return not parts_n or (min(parts_n) > _PERMITTED_EXCESS_N and parts_n[-1] >= _DECAY * parts_n[0])


def low_pass_trace(trace: Any) -> Any:
    """Return a copy of a trace whose motion and sent forces contain no frequencies above 40 Hz."""
    calm = trace.copy()
    smooth(trace, _SPREAD_S, calm.position_m, calm.sent_n)
    calm.velocity_mps[:] = np.gradient(calm.position_m, trace.t_s, axis=0)
    return calm


def with_count_error(position_m: Any, count_um: float) -> Any:
    """Return positions (rows, 3) [m] with an error of up to half an encoder count, as between two counts."""
    return position_m + count_um * 1e-6 * (np.random.default_rng(1).random(position_m.shape) - 0.5)


def compare_fast(
    force_n: Any, controls_n: Sequence[Any], rate_hz: float, first: int, *, late_share: float = 0.0
) -> FastForce:
    """Compare the fast part of a force (rows, 3) [N] with the greatest of its controls, from row ``first`` onwards.

    The permitted excess is 0.05 N, or ``late_share`` of the control if that is more. Controls may have fewer rows.
    """

    def measure(begins: int, ends: int, aside_s: float = 0.0) -> tuple[float, float]:
        fast_n, *calm_n = (
            fast_part(each, rate_hz, _FAST_HZ, begins, min(ends, len(each)), aside_s) for each in (force_n, *controls_n)
        )
        return fast_n, max(calm_n)

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
    beyond = excesses_n > permitted_n
    last = len(beyond) - _SUSTAINED + 1
    return any(
        beyond[k : k + _SUSTAINED].all() and excesses_n[k + _SUSTAINED - 1] >= _DECAY * excesses_n[k]
        for k in range(last)
    )


def worst_of(compared: Sequence[FastForce]) -> FastForce:
    """Return the greatest excess; it is sustained if any is."""
    worst = max(compared, key=lambda each: each.fast_n - each.control_n)
    return worst._replace(sustained=any(each.sustained for each in compared))


def _passive(case: Case, safe: bool, limits: DampingLimits | None) -> Any | None:
    """Return the trace of a hand that holds the handle with the motors off, for as long as it holds it."""
    if case.hand == THROWN:
        return None
    off = Bench(case, safe=safe, limits=limits)
    off.handle.motor_limit_n = off.loop.arm.motor_limit_n = 0.0
    off.begin()
    trace = new_trace(case)
    return trace[: off.run(trace, 0, min(lasts_s(case), off.loop.release_s))]


def acted(trace: Any) -> tuple[float, ...]:
    """Return the fraction of ticks in which each limiter acted."""
    return tuple(float(np.mean((trace.limiters >> k) & 1)) for k in range(len(LIMITER_NAMES)))
