"""Estimates are applied within the slope limit, slowly, and only where the motion identifies them."""

import math

import pytest

from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.slope_limits import slope_limit, steady
from study_app.lab.estimation.estimator import Estimate
from study_app.lab.estimation.live_estimation import MOST_PER_S, applicable, most_drag_coefficient, set_values, stepped
from tests.lab.benches import bench
from tests.lab.estimation.measured import WATER

DEVICE = Dynamics(delay_s=1e-3)


def found(identified: bool = True, **values: float) -> Estimate:
    intervals = {name: (0.9 * it, 1.1 * it) for name, it in values.items()}
    return Estimate(values, intervals, identified, "" if identified else "this motion does not identify it")


def test_what_is_not_identified_changes_nothing() -> None:
    vague = found(identified=False, drag_coefficient=0.42)
    assert applicable(WATER, vague, DEVICE, 8.0) == {}
    assert stepped(WATER, vague, DEVICE, 8.0, 1.0) == {}


def test_no_estimate_makes_the_slope_limit_act() -> None:
    most = most_drag_coefficient(WATER, DEVICE, 8.0)
    assert applicable(WATER, found(drag_coefficient=9.9), DEVICE, 8.0) == {"drag_coefficient": most}
    body = WATER.body.model_copy(update={"drag_coefficient": most})
    scene = WATER.model_copy(update={"body": body})
    steady_at = [steady(scene, speed / 1000) for speed in range(1, 400)]
    assert {it.limit for it in steady_at} == {None, "norm"}
    beyond = scene.model_copy(update={"body": body.model_copy(update={"drag_coefficient": 1.1 * most})})
    assert "slope" in {steady(beyond, speed / 1000).limit for speed in range(1, 400)}


def test_a_setting_beyond_the_limit_may_only_weaken() -> None:
    body = WATER.body.model_copy(update={"drag_coefficient": 8.0})
    scene = WATER.model_copy(update={"body": body})
    assert slope_limit(1e-3, 1) ** 2 / 100 < 8 * 0.5 * 1000 * math.pi / 4 * 0.068**2 * 8.0
    assert applicable(scene, found(drag_coefficient=9.0), DEVICE, 8.0) == {"drag_coefficient": 8.0}
    assert applicable(scene, found(drag_coefficient=0.5), DEVICE, 8.0) == {"drag_coefficient": 0.5}


def test_continuous_application_is_slow_and_ends() -> None:
    scene, steps = WATER, 0
    while values := stepped(scene, found(drag_coefficient=0.42), DEVICE, 8.0, 0.033):
        before = scene.body.drag_coefficient
        now = values["drag_coefficient"]
        assert abs(math.log(now / before)) <= MOST_PER_S * 0.033 + 1e-12
        scene = scene.model_copy(update={"body": scene.body.model_copy(update={"drag_coefficient": now})})
        steps += 1
    assert scene.body.drag_coefficient == pytest.approx(0.42, rel=0.003)
    assert steps == pytest.approx(math.log(0.47 / 0.42) / MOST_PER_S / 0.033, abs=1)


def test_continuous_application_keeps_the_length_and_the_wake_no_faster_than_the_body() -> None:
    values = stepped(WATER, found(drag_coefficient=0.47, length=900.0, scaling=1000.0), DEVICE, 8.0, 1.0)
    assert values == {}
    values = stepped(WATER, found(drag_coefficient=0.47, length=900.0, scaling=2000.0), DEVICE, 8.0, 1.0)
    assert values == {"scaling": 2000.0}


def test_a_click_sets_all_values_in_one_step_for_undo() -> None:
    before = bench("water")
    for values in (
        {"drag_coefficient": 0.42, "length": 1200.0, "scaling": 1500.0},
        {"drag_coefficient": 0.42, "length": 1900.0, "scaling": 2500.0},
    ):
        after = set_values(before, values)
        wake = after.in_hand.scene.liquids[0].wake
        assert wake is not None
        assert (after.in_hand.scene.body.drag_coefficient, wake.length, wake.scaling) == tuple(values.values())
        assert after.undo().in_hand == before.in_hand
        assert after.undo().past == ()
