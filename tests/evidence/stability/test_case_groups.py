"""The groups of cases beside the sweep: their contents, and their disturbances of loops and samples."""

import dataclasses
import math

import numpy as np
import pytest

from study_app.evidence.stability.bench import Bench, new_trace
from study_app.evidence.stability.case_groups import groups
from study_app.evidence.stability.stability_cases import materials, parse_case, physical2_liquids
from study_app.evidence.stability.verdict import MISJUDGED_ALLOWANCE_J, judge
from study_app.haptics.model.slope_limits import delayed_force_fault, refusal_reason
from tests.haptics.scenes import COMPILED

pytestmark = [pytest.mark.nightly, pytest.mark.slow]

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")

OTHER_LIQUIDS = {"non-Newtonian liquids": materials, "liquids of physical2": physical2_liquids}


@compiled
def test_a_sample_of_closed_loops_in_other_liquids_is_stable():
    sampled = [group for group in groups(count=25) if group.name.startswith(tuple(OTHER_LIQUIDS))]
    unstable = [case for group in sampled for case in group.cases if judge(case, safe=True).reasons]
    assert not unstable


def test_forces_are_delayed_only_in_loops_in_which_a_session_may_delay_them():
    late = [case for group in groups(count=200) if group.name == "late forces" for case in group.cases]
    assert len(late) == 200
    assert {delayed_force_fault(case.rate_hz, case.mass_kg) for case in late} == {None}
    assert {refusal_reason(case.rate_hz) for case in late} == {None}
    assert {case.rate_hz for case in late} == {500, 1000}
    assert {case.mass_kg for case in late} == {0.1, 0.25, 0.6}


def test_lines_of_earlier_versions_still_describe_the_same_case():
    old = "liquid=syrup scale=20 rate_hz=500 delay=2 hand=thrown motion=stroke speed_mps=0.6 mass_kg=0.25 missed=0.02"
    case = parse_case(old)
    assert case.believed_delay == case.delay == 2
    assert (case.plant, case.lost, case.duplicated, case.burst_ms, case.slows_to) == ("handle", 0.0, 0.0, 0.0, -1)


def samples(case, ticks):
    """Return for each tick whether its sample is new, and its position."""
    bench, trace = Bench(case), new_trace(case)
    bench.begin()
    fresh, places = [], []
    for k in range(ticks):
        bench.run(trace[: k + 1], k, math.inf)
        fresh.append(bool(bench.sample[0].fresh))
        places.append(bench.sample[0].position_m.copy())
    return np.array(fresh), np.array(places)


@compiled
def test_hand_that_breaks_the_wake_at_each_reversal_is_as_restless_without_feedback():
    """The wake of light oil turns the force at each reversal of 4 Hz, with the motors off more than with them."""
    released = "liquid=light_oil hand=lets-go motion=sine speed_mps=0.75398 release_s=0.7 plant=arm"
    held = dataclasses.replace(parse_case(released), hand="middle")
    for case in (parse_case(released), held):
        verdict = judge(case, safe=True)
        assert not verdict.reasons, verdict


SHORT = "hand=lets-go motion=sine viscous_nspm=0 plant=arm delay={} believed={} liquid={} scale={} mass_kg={} "
TAR, THROWN_TAR = "speed_mps=0.1885 release_s=1.01667", "hand=thrown speed_mps=0.3 quantum_um=60 noise_um=30"


@compiled
@pytest.mark.parametrize(
    "line",
    [
        SHORT.format(1, 0, "physical_tar", 3, 0.1) + TAR,  # accounted as a loop without delay
        SHORT.format(2, 1, "light_oil", 10, 0.03) + "speed_mps=0.37699 release_s=0.85",  # a swing paid by the motion
        SHORT.format(2, 1, "dense", 10, 0.1) + "speed_mps=0.1885 release_s=0.93333",
        SHORT.format(2, 1, "dense", 10, 0.03) + "speed_mps=0.37699 release_s=0.93333",  # LIGHTER
        SHORT.format(2, 1, "light_oil", 10, 0.05)
        + "speed_mps=0.37699 release_s=1.05833 viscous_nspm=0.5 estimator=kalman",  # LIGHTER
        SHORT.format(3, 2, "physical_tar", 3, 0.05)
        + "rate_hz=500 estimator=kalman motion=reaches "
        + THROWN_TAR,  # KALMAN_SHARE
        SHORT.format(2, 1, "physical_tar", 1, 0.2) + "motion=stroke speed_mps=1 estimator=kalman",  # history_rs
    ],
)
def test_a_delay_one_tick_longer_than_believed_leaves_the_loop_stable(line):
    verdict = judge(parse_case(line), safe=True)
    assert not verdict.reasons, verdict
    assert verdict.balance_j > -MISJUDGED_ALLOWANCE_J


@compiled
@pytest.mark.parametrize(
    "line",
    [
        "liquid=physical_tar scale=3 delay=2 hand=light motion=stroke speed_mps=0.6 mass_kg=0.05 viscous_nspm=0.5 "
        "quantum_um=20 noise_um=30 jitter=0.2 missed=0.02 plant=arm",
        "liquid=syrup scale=10 rate_hz=500 delay=2 hand=firm motion=stroke speed_mps=0.6 mass_kg=0.25 viscous_nspm=0 "
        "plant=arm",
    ],
)
def test_repeated_samples_do_not_make_the_force_restless(line):
    verdict = judge(parse_case(f"{line} duplicated=0.05 estimator=kalman"), safe=True)
    assert not verdict.reasons, verdict
    assert verdict.fast_n < verdict.played_n + 0.02
