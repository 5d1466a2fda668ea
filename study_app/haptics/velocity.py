"""From positions to the velocity the liquids act on: estimator, then speed knee."""

from __future__ import annotations

import math

from study_app.haptics.compiled import part
from study_app.haptics.layout import ESTIMATOR_EWMA, ESTIMATOR_GIVEN, KNEE_SQRT, KNEE_SQUARE, Record
from study_app.haptics.vector import clear, norm


@part
def forget(parameters: Record, state: Record) -> None:
    """Begin anew: a position alone says nothing about velocity, so it is 0. A given velocity is already there."""
    if parameters.estimator != ESTIMATOR_GIVEN:
        clear(state.estimate_mps)


@part
def estimate(parameters: Record, state: Record, interval_s: float) -> None:
    """Bring ``state.estimate_mps`` and ``state.velocity_mps`` to the newest position."""
    if parameters.estimator == ESTIMATOR_EWMA:
        _ewma(parameters, state, interval_s)
    _knee(parameters, state)


@part
def _ewma(parameters: Record, state: Record, interval_s: float) -> None:
    """Move the estimate to the newest difference u = Δp/Δt: v ← v + α(Δt)(u − v) (Rek 2024, §4.2).

    α(Δt) = 1 − (1 − α)^(Δt/1 ms) makes it the same filter at any rate.
    """
    weight = -math.expm1(parameters.log_keep_per_s * interval_s)
    for axis in range(3):
        difference_mps = (state.position_m[axis] - state.previous_m[axis]) / interval_s
        state.estimate_mps[axis] += weight * (difference_mps - state.estimate_mps[axis])


@part
def _knee(parameters: Record, state: Record) -> None:
    """Lower speeds above the threshold, keep the direction; the estimate itself stays as it is.

    ``sqrt`` has unit slope at the threshold: s' = s0 + √(1 + 2(s − s0)) − 1 with s, s0 in m/s. ``square`` is the
    literal "squaring the part above" of Rek 2024, which raises any excess over 1 m/s.
    """
    speed_mps = norm(state.estimate_mps)
    excess_mps = speed_mps - parameters.knee_threshold_mps
    share = 1.0
    if excess_mps > 0.0:
        if parameters.knee_law == KNEE_SQRT:
            share = (parameters.knee_threshold_mps + math.sqrt(1.0 + 2.0 * excess_mps) - 1.0) / speed_mps
        elif parameters.knee_law == KNEE_SQUARE:
            share = (parameters.knee_threshold_mps + excess_mps * excess_mps) / speed_mps
    for axis in range(3):
        state.velocity_mps[axis] = share * state.estimate_mps[axis]
