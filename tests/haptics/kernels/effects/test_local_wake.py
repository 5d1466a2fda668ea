import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.evidence.reference_model import local_wakes
from study_app.haptics.model.effects.current import Uniform
from study_app.haptics.model.effects.local_wake import CELLS, LocalWake
from study_app.haptics.model.force_rules import VERSIONS
from study_app.haptics.model.motion import programmed_motion
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, UNBENT, Hand, examples, liquid, moving, scene, vectors

STEP_S = 1e-3


def tank(*others, current=None, **wake):
    """Return a scene of water with this local wake, by default of 100 elements that do not fade or spread."""
    plain = {"length": 100, "scaling": 100, "decay": 1.0, "spreading_m2ps": 0.0}
    effects = ("drag", "local_wake", *others)
    return scene(liquid(effects=effects, local_wake=LocalWake(**{**plain, **wake}), current=current), knee=UNBENT)


def legs(*pieces):
    """Return a motion of (velocity, seconds) pieces, and the row after each."""
    velocities = [np.tile(np.asarray(velocity, float), (round(seconds / STEP_S), 1)) for velocity, seconds in pieces]
    return moving(np.concatenate(velocities)), np.cumsum([len(piece) for piece in velocities])


def literal(scene, motion):
    """Return the wake by its definition, element by element."""
    wake = scene.liquids[0].local_wake
    interval_s = np.diff(motion.t_s, prepend=motion.t_s[0] - 1 / scene.rate_hz)
    h_mps = motion.velocity_mps * np.array([1.0, 1.0 if wake.axes == "xyz" else 0.0, 1.0])
    numbers = (wake.length, wake.scaling, wake.exponent, wake.decay, wake.reach_m or 0.068, wake.spreading_m2ps)
    return local_wakes(h_mps, motion.position_m, interval_s, *numbers)


PATHS = {"circle": {}, "stop": {}, "zigzag": {}, "reach": {"distance_m": 0.2}, "reverse": {}}


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="seconds of motion are for compiled code")
@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize(("length", "worst"), [(300, 0.01), pytest.param(1700, 0.06, marks=pytest.mark.nightly)])
def test_cells_stand_for_their_elements(name, length, worst):
    scene = tank(length=length, scaling=length, decay=0.999975, spreading_m2ps=1e-3)
    motion = programmed_motion(name, **PATHS[name])
    exact = literal(scene, motion)
    error = np.linalg.norm(vectors(simulate(scene, motion), "wake") - exact, axis=1)
    assert error.max() <= worst * np.linalg.norm(exact, axis=1).max()


def test_within_one_cell_the_first_ticks_are_the_definition():
    scene = tank(decay=0.99, exponent=0.5)
    motion = moving(np.tile([0.5, 0.0, 0.1], (6, 1)))
    assert vectors(simulate(scene, motion), "wake") == pytest.approx(literal(scene, motion), rel=1e-3)


def test_merged_cells_approximate_their_elements():
    """Every moving tick follows a tick at rest, so each has its own cell; the first 36 cells are merged."""
    scene = tank(length=100, scaling=100, decay=0.995, exponent=0.5, spreading_m2ps=0.02, reach_m=0.02, axes="xyz")
    ticks = np.arange(CELLS + 36)
    speeds = np.stack([0.5 + 0.3 * np.cos(ticks), 0.4 * np.cos(ticks / 9), 0.5 * np.sin(ticks / 9)], axis=1)
    motion = moving(speeds * (ticks % 2 == 0)[:, None])
    exact = literal(scene, motion)
    wake = vectors(simulate(scene, motion), "wake")
    assert wake[:CELLS] == pytest.approx(exact[:CELLS], rel=1e-12)
    assert wake[CELLS:] == pytest.approx(exact[CELLS:], rel=0.02, abs=1e-3)
    assert wake[-1] == pytest.approx([0.116540706, -0.034358285, -0.036422561], rel=1e-6)  # as recorded


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_faded_elements_count_less_in_the_response_too(exponent):
    scene = tank(decay=0.95, exponent=exponent)
    motion, (moved, _, again) = legs(((1.0, 0, 0), 0.02), ((0.0, 0, 0), 0.03), ((0.2, 0, 0), 0.02))
    exact = literal(scene, motion)
    assert vectors(simulate(scene, motion), "wake")[moved:again] == pytest.approx(
        exact[moved:again], rel=0.01, abs=1e-12
    )


@pytest.mark.slow
@settings(max_examples=examples(30), deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1), current=st.tuples(*[st.floats(-2, 2)] * 3), exponent=st.sampled_from([0.5, 1, 2])
)
def test_a_current_carries_it_along(seed, current, exponent):
    random = np.random.default_rng(seed)
    velocity = np.repeat(random.uniform(-2, 2, (8, 3)), 15, axis=0)
    pond = moving(velocity)
    river = moving(velocity + np.array(current))
    flowing = tank("current", current=Uniform(velocity_mps=current), exponent=exponent)
    still = vectors(simulate(tank(exponent=exponent), pond), "wake")
    assert vectors(simulate(flowing, river), "wake") == pytest.approx(still, abs=1e-9)


@pytest.mark.nightly
@pytest.mark.slow
@settings(max_examples=examples(40), deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    length=st.sampled_from([1, 2, 7, 50, 400]),
    exponent=st.sampled_from([0.25, 1.0, 3.0]),
    decay=st.sampled_from([1.0, 0.999975, 0.8]),
    reach=st.sampled_from([None, 1e-3, 10.0]),
)
def test_whatever_the_motion_it_never_outruns_the_body_and_loses_no_element(seed, length, exponent, decay, reach):
    random = np.random.default_rng(seed)
    scene = tank(length=length, scaling=length, exponent=exponent, decay=decay, reach_m=reach, axes="xyz")
    hand = Hand(scene, rules=VERSIONS[2])  # no hand turns so suddenly
    place, fastest = np.zeros(3), 0.0
    for turn in range(1, 600 if COMPILED else 60):
        if turn % 40 == 0:
            speed, heading = random.choice([0.0, 1e-4, 0.01, 2.0]), random.normal(size=3)
        elif turn == 1:
            speed, heading = 0.5, random.normal(size=3)
        place = place + speed * STEP_S * heading / np.linalg.norm(heading)
        sample = hand.tick(place)
        fastest = max(fastest, float(np.linalg.norm(sample.velocity_mps)))
        assert np.linalg.norm(sample.wake_mps) <= fastest * (1 + 1e-12)
        tracks = hand.model.liquid_states[0].local_wake
        rows = (tracks.first + np.arange(tracks.cells)) % CELLS
        assert tracks.held == min(turn, length)
        assert hand.model.rows.cells["count"][rows].sum() == tracks.held
