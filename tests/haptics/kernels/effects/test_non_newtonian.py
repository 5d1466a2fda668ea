"""Non-Newtonian drag: limits of the parameters, elasticity at rest, energy, and closed loops."""

import numpy as np
import pytest

from study_app.evidence.reference_model import non_newtonian_n
from study_app.haptics.model.layout import LIMITER_SLOPE
from study_app.haptics.model.slope_limits import steady_force
from study_app.haptics.runtime.offline import simulate
from tests.haptics.materials import PRESETS, creep_mps, tank
from tests.haptics.scenes import COMPILED, UNBENT, Hand, moving, scene, vectors

pytestmark = pytest.mark.slow

compiled = pytest.mark.skipif(not COMPILED, reason="thousands of ticks are for compiled code")


def force(tank_scene, velocity_mps, interval_s=1e-3):
    """Return the force (n, 3) along velocities (n, 3)."""
    tank_scene = tank_scene.model_copy(update={"knee": UNBENT, "rate_hz": 1 / float(np.median(interval_s))})
    return vectors(simulate(tank_scene, moving(velocity_mps, interval_s)), "force")


def random_motion(seed, ticks=2000):
    """Return velocities (n, 3) that begin at rest, up to about 0.5 m/s, with stops."""
    random = np.random.default_rng(seed)
    t_s = np.arange(ticks) / 1000
    waves = sum(
        random.normal(size=3) * np.sin(2 * np.pi * hertz * t_s + random.uniform(0, 6.3))[:, None]
        for hertz in random.uniform(0.3, 6, 5)
    )
    swell = np.clip(np.sin(2 * np.pi * t_s / 0.8), 0, None)[:, None]
    return 0.15 * random.uniform(0.05, 1) * waves * swell


@pytest.mark.parametrize("name", PRESETS)
def test_it_equals_its_law_by_the_letter(name):
    tank_scene = tank(name, scale=3.0)
    velocity = random_motion(3, ticks=1500 if COMPILED else 300)
    expected = non_newtonian_n(tank_scene, velocity, np.full(len(velocity), 1e-3), slack_m=2 * 38e-6 * tank_scene.scale)
    assert abs(force(tank_scene, velocity) - expected).max() <= 0.01 * abs(expected).max()


@compiled
@pytest.mark.parametrize("name", PRESETS)
def test_no_motion_gains_energy(name):
    """Net work on the hand since rest, over the work that the hand has done."""
    for seed in range(12):
        velocity = random_motion(seed)
        mean = (velocity + np.concatenate([np.zeros((1, 3)), velocity[:-1]])) / 2
        power_w = (force(tank(name, scale=3.0), velocity) * mean).sum(axis=1)
        assert np.cumsum(power_w).max() * 1e-3 <= 1e-3 * abs(power_w).sum() * 1e-3


@compiled
@pytest.mark.parametrize("name", ["ketchup", "toothpaste"])
def test_under_half_of_the_yield_force_the_hand_creeps_below_1_mm_per_s(name):
    assert creep_mps(name, 0.5) <= 0.3e-3
    assert creep_mps(name, 0.5, noise=0.01) <= 1e-3
    assert creep_mps(name, 1.5) >= 5e-3


@compiled
def test_the_force_of_thickening_grows_no_steeper_than_the_slope_limit():
    tank_scene = tank("cornstarch", scale=3.0, velocity=scene().velocity).model_copy(update={"force_limit_n": 20.0})
    sent_n, requested_n = [], []
    for hand_mps in (0.07, 0.08, 0.09):
        last = Hand(tank_scene).sweep(hand_mps, 300)[-1]
        sent_n.append(-last.device_force_n[0])
        requested_n.append(-last.force_n[0])
        assert last.limiters & LIMITER_SLOPE
    assert np.diff(requested_n).min() / 0.01 > 60
    assert np.diff(sent_n).max() / 0.01 <= 53 * 1.3  # the inertial factor grows with the speed, too
    assert sent_n[1] == pytest.approx(steady_sent(tank_scene, 0.08), rel=1e-3)


def steady_sent(tank_scene, hand_mps):
    return steady_force(tank_scene, hand_mps).force_n


@compiled
@pytest.mark.parametrize("name", [name for name in PRESETS if name != "cornstarch"])
def test_the_force_sent_is_the_predicted_one(name):
    tank_scene = tank(name, scale=3.0)
    for hand_mps in (0.02, 0.1):
        last = Hand(tank_scene).sweep(hand_mps, 12_000)[-1]
        assert -last.device_force_n[0] == pytest.approx(steady_sent(tank_scene, hand_mps), rel=5e-3)
