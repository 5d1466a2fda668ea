"""Properties that every velocity estimator of the registry has."""

import numpy as np
import pytest

from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import is_built_alike, pack, pack_into
from study_app.lab.parameters import with_parameter
from study_app.protocol.checks.force_limits import passed_share
from tests.haptics.scenes import COMPILED, Hand, vectors
from tests.haptics.single_effects import EMPTY, ESTIMATOR_NAMES

MEASURED = Dynamics(delay_s=1e-3, count_m=38e-6, mass_kg=0.1)
each = pytest.mark.parametrize("name", ESTIMATOR_NAMES)


def scene(name):
    """Return a scene without a force, in which the lab chose this estimator."""
    return with_parameter(EMPTY, "velocity.kind", name)


def estimated_velocities(name, place_m, interval_s=1e-3):
    """Return the velocities (n, 3) that an estimator finds in places (n, 3)."""
    estimator_scene = scene(name).model_copy(update={"rate_hz": 1 / interval_s})
    return vectors(simulate(estimator_scene, Motion(np.arange(len(place_m)) * interval_s, place_m)), "velocity")


@each
@pytest.mark.parametrize("interval_s", [0.5e-3, 1e-3, 4e-3])
def test_rest_and_the_first_sample_have_no_velocity_and_an_even_motion_is_found(name, interval_s):
    assert not estimated_velocities(name, np.full((30, 3), 0.02), interval_s).any()
    v = estimated_velocities(name, np.outer(np.arange(400) * interval_s, [0.3, -0.1, 0.2]), interval_s)
    assert not v[0].any()
    assert v[-1] == pytest.approx([0.3, -0.1, 0.2], rel=1e-3)


@each
def test_no_direction_is_preferred(name):
    random = np.random.default_rng(5)
    place_m = np.cumsum(random.normal(0, 1e-6, (200, 3)).cumsum(axis=0), axis=0)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    straight = estimated_velocities(name, place_m)
    assert estimated_velocities(name, place_m @ turn.T) == pytest.approx(straight @ turn.T, abs=1e-9)
    assert np.abs(straight).max() > 1e-3


@each
def test_positions_before_a_loss_of_the_body_are_forgotten(name):
    hand = Hand(scene(name), dynamics=MEASURED)
    hand.sweep(0.2, 50)
    for _ in range(5):
        hand.tick((np.nan, 0, 0))
    assert not hand.tick((0.03, 0, 0)).velocity_mps.any()
    assert not hand.tick((0.03, 0, 0)).velocity_mps.any()


@each
def test_a_model_made_with_a_capacity_takes_it(name):
    model = pack(scene("raw"), capacity=0)
    pack_into(model, scene(name))
    hand, fresh = Hand(scene(name)), Hand(scene(name))
    hand.model = model
    assert [it.tobytes() for it in hand.sweep(0.1, 30)] == [it.tobytes() for it in fresh.sweep(0.1, 30)]
    assert is_built_alike(scene(name), scene("ewma")) == (name == "ewma")


@pytest.mark.skipif(not COMPILED, reason="thousands of ticks")
@each
@pytest.mark.parametrize("hz", [1.0, 5.0])
def test_the_stated_gain_at_a_frequency_is_that_of_the_estimator(name, hz):
    t_s, w = np.arange(3000) / 1000, 2 * np.pi * hz
    x_m = 0.02 * np.sin(w * t_s)
    v = estimated_velocities(name, np.column_stack([x_m, 0 * x_m, 0 * x_m]))[1000:, 0]
    true = 0.02 * w * np.cos(w * t_s)[1000:]
    assert passed_share(scene(name).velocity, 1000, hz) == pytest.approx((v @ true) / (true @ true), abs=0.04)
