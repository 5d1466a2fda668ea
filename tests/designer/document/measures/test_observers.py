"""Planted observers: what they show is what was planted, with the error that ``check`` expects."""

import math
from dataclasses import replace

import numpy as np
import pytest

from study_app.analysis.planning.threshold_studies import Case, study_batch
from study_app.designer.document.study import read
from study_app.designer.document.toml_edits import Set
from study_app.designer.measures import simulation
from study_app.designer.measures.simulation import focus_of, measurable, observe
from study_app.designer.new_study.new_study import template
from study_app.protocol.checks.expected_precision import ThresholdPlan, expected, threshold_plan
from study_app.protocol.source.files import shipped_file
from study_app.protocol.trials.presented_levels import LevelLimits, clipping

CLIPPED = Set(("stimuli", "damping", "standards"), [32]), Set(("stimuli", "damping", "levels"), [0.02, 2.0])
FULL = 53 / 32 - 1
"""The highest level of these that is presented in full: the slope limit of the loop is 53 N·s/m."""


def plan_of(trials: int = 40, *changes: Set) -> ThresholdPlan:
    protocol = template("viscosity-jnd").edited(*changes)[0].formed
    assert protocol is not None
    plan = threshold_plan(protocol, protocol.blocks["viscosity"])
    assert plan is not None
    return plan.with_trials(trials)


@pytest.mark.slow
def test_planted_observers_are_found_as_precisely_as_check_expects() -> None:
    plan = plan_of()
    found = observe(plan, 0.2, 0.02)
    assert found is not None
    low, middle, high = (found.course[-1][1][at] for at in (0, 2, 4))
    assert low < 0.2 < high
    assert middle == pytest.approx(0.2, rel=0.1)
    assert found.course[-1][0] == plan.trials == found.trials
    known = expected(plan)
    assert known is not None
    assert 0.6 < found.error / (2.303 * known.spread) < 1.0  # whose observers differ in width, too
    spreads = [quantiles[4] / quantiles[0] for _, quantiles in found.course]
    assert spreads[-1] < 0.6 * max(spreads)
    assert sum(share for _, share in found.asked) == pytest.approx(1.0)
    assert [one.trial for one in found.one] == list(range(1, plan.trials + 1))
    assert {one.track for one in found.one} == {1, 2}
    grid = {round(level, 9) for level in plan.stimulus.grid}
    assert {round(one.level, 9) for one in found.one} <= grid
    assert found.at_threshold == pytest.approx(0.5 + 0.48 / 2, abs=1e-6)  # half the way from guessing to lapsing
    assert found.found[0][30] > found.planted[30] > found.found[4][30]  # a lower threshold is a higher function


def test_observers_show_the_same_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation, "OBSERVERS", 200)
    found = observe(plan_of(4), 0.2, 0.02)
    assert found is not None
    assert (found.observers, found.trials) == (200, 4)
    assert (found.error, found.at_threshold) == pytest.approx((0.791341, 0.74), abs=1e-6)
    assert np.array(found.asked) == pytest.approx(
        np.array([[0.137425, 0.3425], [0.153923, 0.5], [0.303897, 0.1575]]), abs=1e-6
    )
    assert [trials for trials, _ in found.course] == [2, 4]
    assert found.course[1][1] == pytest.approx((0.039823, 0.039823, 0.170916, 0.330816, 0.442758), abs=1e-6)
    assert [(one.trial, one.track, one.success) for one in found.one] == [
        (1, 1, True), (2, 2, True), (3, 1, False), (4, 2, True),
    ]  # fmt: skip
    assert [one.level for one in found.one] == pytest.approx([0.153923, 0.153923, 0.137425, 0.137425], abs=1e-6)
    assert (found.levels[30], found.planted[30]) == pytest.approx((0.109545, 0.632946), abs=1e-6)
    high_to_low = [function[30] for function in found.found]
    assert high_to_low == pytest.approx([0.939999, 0.656772, 0.641236, 0.575650, 0.553845], abs=1e-6)


@pytest.mark.parametrize(
    ("changes", "asked", "presented"),
    [
        (CLIPPED, [0.02, 0.6, 0.7, 2.0], [0.02, 0.6, FULL, FULL]),
        ((*CLIPPED[:1], Set(("stimuli", "damping", "levels"), [0.02, 0.6])), [0.6], [0.6]),
        ((Set(("stimuli", "damping", "standards"), [60]),), [0.1, 0.6], [0.0, 0.0]),
        (
            (Set(("stimuli", "damping", "standards"), [60]), Set(("stimuli", "damping", "direction"), "down")),
            [0.05, 0.5],
            [0.0, (53 - 30) / 53],
        ),
    ],
)
def test_levels_are_presented_as_the_limits_leave_them(
    changes: tuple[Set, ...], asked: list[float], presented: list[float]
) -> None:
    plan = plan_of(40, *changes)
    found = 10.0 ** plan.presented(np.log10(asked))
    assert found.tolist() == pytest.approx(presented, rel=1e-6)


def test_no_clipped_level_is_a_threshold_that_can_be_measured() -> None:
    free = {"kind": "explore", "min_s": 2, "max_s": 4, "instruction": "Feel."}
    unpaced = CLIPPED[1], Set(("tasks", "stir"), free), Set(("stimuli", "damping", "standards"), [12])
    for changes, most in ((CLIPPED, FULL), (unpaced, 8 / 0.3 / 12 - 1)):
        protocol = template("viscosity-jnd").edited(*changes)[0].formed
        assert protocol is not None
        focus = focus_of(protocol, ("blocks", "viscosity"))
        assert focus.plan is not None
        clips = clipping(protocol, protocol.blocks["viscosity"])
        assert clips is not None
        assert clips.highest(focus.plan.stimulus) == pytest.approx(most, rel=1e-4)
        assert (focus.plan.clipping is None) == (changes is unpaced)  # fast motions are repeated, not answered
    limits = LevelLimits(None, 40.0, 0.1)
    known = clipping(protocol, protocol.blocks["viscosity"], limits)
    assert known is not None
    assert known.limit == 40.0  # limits that are known are not looked for again
    down = Set(("stimuli", "damping", "standards"), [60]), Set(("stimuli", "damping", "direction"), "down")
    assert not plan_of(4, *down).measures(np.array(-1.0))  # the standard itself is clipped
    found = measurable(plan_of(4, *CLIPPED), 0.02, 0.02, most=0.03)
    assert found is not None
    assert [one.threshold for one in found.planted] == pytest.approx([0.02], rel=0.01)


def test_no_level_of_a_late_force_is_clipped_though_a_limit_clips_the_force() -> None:
    protocol = read(shipped_file("forcedelay").read_bytes()).edited(Set(("device", "force_limit_n"), 0.1))[0].formed
    assert protocol is not None
    assert clipping(protocol, protocol.blocks["delay"]) is None


@pytest.mark.slow
def test_clipped_levels_make_the_error_larger() -> None:
    clipped, full = plan_of(24, *CLIPPED), plan_of(24, *CLIPPED)
    found = [observe(one, 0.6, 0.02) for one in (clipped, replace(full, clipping=None))]
    assert found[0] is not None
    assert found[1] is not None
    assert found[0].error > 1.2 * found[1].error
    assert max(found[0].planted) < found[0].at_threshold + 0.05 < max(found[1].planted)


@pytest.mark.slow
@pytest.mark.parametrize("standard", [52, 60])
def test_a_threshold_whose_levels_are_clipped_has_no_error_and_no_precision(standard: float) -> None:
    plan = plan_of(24, Set(("stimuli", "damping", "standards"), [standard]))
    observed, known = observe(plan, 0.19, 0.02), expected(plan)
    assert observed is not None
    assert known is not None
    assert math.isinf(observed.error)
    assert not known.measured
    assert (known.participants_for(0.15), known.trials_for(0.15, 12)) == (None, None)
    found = study_batch(Case("viscosity", plan, (1,)), (12,))
    assert found.within(0, 100.0) == 0.0
    assert math.isinf(found.spread)
    full = study_batch(Case("viscosity", replace(plan, clipping=None), (1,)), (12,))
    assert full.within(0, 100.0) == 1.0


@pytest.mark.slow
def test_each_standard_is_simulated_as_limits_clip_it() -> None:
    plan = plan_of(24, Set(("stimuli", "damping", "standards"), [8, 32]), CLIPPED[1])
    asked = np.log10([0.02, 0.6, 2.0])
    high, low = (10.0 ** one.presented(asked) for one in plan.each_standard())
    assert high.tolist() == pytest.approx([0.02, 0.6, FULL], rel=1e-6)
    assert low.tolist() == pytest.approx([0.02, 0.6, 2.0])
    assert plan.clipping is not None
    all_as_the_highest = replace(plan, clipping=replace(plan.clipping, others=()))
    own, same = expected(plan), expected(all_as_the_highest)
    assert own is not None
    assert same is not None
    assert own.spread < 0.95 * same.spread
    studies = (study_batch(Case("viscosity", one, (1,)), (20,)) for one in (plan, all_as_the_highest))
    own_errors, same_errors = (np.concatenate(one.errors) for one in studies)
    assert own_errors[:, 1].std() < 0.9 * same_errors[:, 1].std()


@pytest.mark.slow
def test_more_lapses_lower_the_function_and_raise_the_error() -> None:
    plan = plan_of(24)
    few, many = observe(plan, 0.2, 0.0), observe(plan, 0.2, 0.15)
    assert few is not None
    assert many is not None
    assert few.planted[-1] > many.planted[-1] + 0.1
    assert many.error > few.error


@pytest.mark.nightly
@pytest.mark.slow
def test_thresholds_beyond_the_levels_are_not_measurable_and_none_below_the_error_of_a_trial() -> None:
    found = measurable(plan_of(60), 0.02, least=0.1)
    assert found is not None
    assert found.ends is not None
    assert min(one.threshold for one in found.planted) >= 0.1 == pytest.approx(found.ends[0], rel=0.5)
    assert all(one.coverage > 0.9 for one in found.planted)


def test_a_simulation_is_given_up_when_asked() -> None:
    asked = 0

    def check() -> None:
        nonlocal asked
        asked += 1
        if asked > 3:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        observe(plan_of(4), 0.2, 0.02, check)
    with pytest.raises(InterruptedError):
        measurable(plan_of(4), 0.02, 0.0, check)
    assert asked == 5
