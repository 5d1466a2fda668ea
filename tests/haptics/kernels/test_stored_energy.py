"""Energy returned by liquids with "kalman", whose added mass and history are smoothed longer than its lag."""

import numpy as np
import pytest

from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.estimators import Ewma, Kalman
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import handle_limits
from study_app.haptics.runtime.pack import pack
from tests.haptics.scenes import COMPILED, Hand, liquid

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")

MEASURED = Dynamics(delay_s=1e-3, count_m=38e-6, mass_kg=0.1)
RHO_V = 1400 * 4 / 3 * np.pi * 0.034**3
STOKES_LAYER_KG = 3 * np.pi * 0.034**2 * np.sqrt(2 * 10.0 * 1400 / (2 * np.pi * 50))  # at 50 Hz


def inert_scene(velocity=None, effects=("added_mass", "history"), **fields):
    """Return a scene of a viscous liquid with these effects alone."""
    medium = liquid(1400, viscosity_pa_s=10.0, effects=effects, **fields)
    return Scene(scale=3, liquids=(medium,), velocity=velocity or Kalman())


@pytest.mark.parametrize(
    ("velocity", "dynamics", "added_s", "history_s"),
    [
        (Ewma(), MEASURED, 0.025, 0.01),
        (Kalman(), MEASURED, 0.015, 0.015),
        (Kalman(), Dynamics(), 0.025, 0.01),  # no delay measured: it is EWMA
    ],
    ids=["ewma", "kalman", "delay unknown"],
)
def test_accelerations_are_smoothed_as_suits_the_estimator(velocity, dynamics, added_s, history_s):
    packed = pack(inert_scene(velocity), dynamics=dynamics).liquids[0]
    assert 1 / packed.added_mass.filter_per_s == pytest.approx(added_s)
    assert 1 / packed.history.filter_per_s == pytest.approx(history_s)


@pytest.mark.parametrize(
    ("effect", "inertia_kg"), [("added_mass", 0.5 * RHO_V), ("history", STOKES_LAYER_KG)], ids=["added mass", "history"]
)
def test_inertia_holds_the_energy_of_the_velocity_as_smoothed(effect, inertia_kg):
    """A stopping hand gets back at most ½ m (|2 v₁ - v₂|² + |v₁ - v₂|²), with v smoothed once and twice."""
    hand = Hand(
        inert_scene(effects=(effect,)), dynamics=MEASURED._replace(mass_kg=0.09)
    )  # too light for the known force
    share, rate = hand.model.liquids[0].inertia_share[1], hand.model.liquids[0].smoothing_rate[1]
    speeds = np.concatenate([np.full(300, 0.3), np.linspace(0.3, 0.0, 30)])
    once_mps = twice_mps = 0.0
    reserves_j, expected_j = [], []
    for place_m in np.cumsum(speeds) * 1e-3:
        v = hand.tick((place_m, 0.0, 0.0)).velocity_mps[0]
        once_mps += (1 - np.exp(-rate / 30)) * (v - once_mps)
        twice_mps += (1 - np.exp(-rate / 30)) * (once_mps - twice_mps)
        reserves_j.append(hand.safety[0].passivity.reserve_j)
        square = (2 * once_mps - twice_mps) ** 2 + (once_mps - twice_mps) ** 2
        expected_j.append(0.5 * share * inertia_kg * square / 3)
    assert v < 0.2 * once_mps
    assert reserves_j[-1] == pytest.approx(expected_j[-1], rel=0.1)  # by half a tick in 30 ms
    assert (np.array(expected_j)[60:] <= 1.02 * np.array(reserves_j)[60:]).all()


def test_no_more_energy_is_stored_than_the_hand_put_in():
    """In random motion, the work on the added mass is at least the energy that it may return, at times nearly all."""
    hand = Hand(inert_scene(effects=("added_mass",)), dynamics=MEASURED)
    place_m = (
        0.02
        * np.random.default_rng(2).normal(size=(6, 2))
        @ np.array([[np.sin(2 * np.pi * hz * np.arange(1500) / 1000 + hz) for hz in (0.7, 4.0)]]).reshape(2, -1)
    )
    work_j, left_j, stored_j = 0.0, [], []
    for x, y, z in (place_m[:3] - place_m[:3, :1]).T:
        sample = hand.tick((x, y, z))
        work_j -= sample.force_n @ sample.velocity_mps * 1e-3
        stored_j.append(hand.model.state[0].returnable_j)
        left_j.append(work_j - stored_j[-1])
    assert min(left_j) > -0.03 * max(stored_j)
    assert max(stored_j[1000:]) > 0.5 * max(stored_j) > 0


@pytest.mark.parametrize("velocity", [Ewma(), Kalman()], ids=["ewma", "kalman"])
def test_the_force_has_no_cliff_where_inertia_exceeds_its_limit(velocity):
    """The sent share of damping changes little between neighbouring scales."""
    sent_nspm, before = [], None
    for scale in np.geomspace(0.1, 40, 600):
        scene = inert_scene(velocity).model_copy(update={"scale": float(scale)})
        packed = pack(scene, dynamics=MEASURED).liquids[0]
        rates = packed.smoothing_rate
        mass_nspm = packed.added_mass.mass_kg * packed.added_mass.filter_per_s * rates
        history_nspm = 0.7 * packed.history.factor_kg_rs * np.sqrt(packed.history.filter_per_s * rates)
        sent_nspm.append(scale * packed.inertia_share * (mass_nspm + history_nspm))
        delivered = packed.inertia_share, rates
        assert before is None or np.abs(np.subtract(delivered, before)).max() < 0.05
        before = delivered
    limits = [handle_limits(1e-3, delay, velocity) for delay in range(5)]
    most_nspm = np.array([limit.inertia_nspm for limit in limits])
    assert (np.max(sent_nspm, axis=0) <= most_nspm * (1 + 1e-9)).all()
    assert (np.max(sent_nspm, axis=0) > 0.95 * most_nspm).all()
    assert sent_nspm[-1] == pytest.approx([0.15 * limit.drag_nspm for limit in limits], rel=1e-4)
