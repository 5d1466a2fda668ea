"""What holds for any input at all, through the whole tick: door, estimator, liquids, safety."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from study_app.haptics.model.layout import STATUS_NON_FINITE
from study_app.haptics.model.scene import Ewma, Foaw, Line, Raw
from tests.haptics.scenes import BED, COMPILED, EVERYTHING, PLACES, POOL, THESIS, TICK_NS, Hand, examples, liquid, scene

pytestmark = pytest.mark.slow

ALL = {**THESIS, **EVERYTHING}
ESTIMATORS = {"ewma": Ewma(), "line": Line(), "foaw": Foaw(), "raw": Raw()}
LEG_TICKS = 40 if COMPILED else 8
LEAST, MOST = -(2**63), 2**63 - 1

any_bytes = st.binary(min_size=24, max_size=24).map(lambda raw: np.frombuffer(raw, np.float64))
near = st.tuples(*[st.floats(-0.06, 0.06)] * 3)
edges = st.tuples(*[st.sampled_from([0.0, -0.0, 5e-324, -1e-310, 1e-160, 0.01, 1e154, 1.7e308, np.inf, np.nan])] * 3)
any_place = st.one_of(st.none(), near, near, any_bytes, edges)
any_time = st.one_of(
    st.tuples(st.just("after"), st.sampled_from([1_000_000, 1_000_000, 1_000_000, 0, 1, -1_000_000, 40_000_000])),
    st.tuples(st.just("at"), st.integers(LEAST, MOST)),
    st.tuples(st.just("at"), st.sampled_from([LEAST, -1, 0, MOST])),
)


any_velocity = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
acts = st.one_of(
    st.tuples(st.just("turn"), any_place, any_time), st.tuples(st.just("stride"), any_velocity, st.integers(1, 40))
)


@pytest.mark.variants(3)
@pytest.mark.parametrize("name", ALL)
@settings(max_examples=examples(60), deadline=None)
@given(todo=st.lists(acts, max_size=30), estimator=st.sampled_from(list(ESTIMATORS)), faded_in=st.booleans())
@example(todo=[("stride", (5.0, 0.1, -4.0), 40)], estimator="ewma", faded_in=True)
@example(
    todo=[("stride", (0.0, 0.0, 3.0), 14), ("stride", (0.0, 5e-265, 0.0), 1)], estimator="raw", faded_in=True
)  # the square of the speed underflows
def test_any_bytes_at_any_time_give_a_finite_force_within_the_limit(name, todo, estimator, faded_in):
    hand = Hand(ALL[name].model_copy(update={"velocity": ESTIMATORS[estimator]}), faded_in=faded_in)

    def turn(place, after_ns):
        sample = hand.tick(place, after_ns=after_ns)
        assert np.isfinite(sample.device_force_n).all()
        assert np.linalg.norm(sample.device_force_n) <= 8 * (1 + 1e-12)
        assert sample.status != STATUS_NON_FINITE

    with np.errstate(all="ignore"):
        for act, what, how in todo:
            if act == "stride":
                start_m = hand.model.state[0].hand_m.copy()
                hand.time_ns = min(hand.time_ns, MOST - how * TICK_NS)
                for k in range(1, how + 1):
                    turn(start_m + 1e-3 * k * np.array(what), TICK_NS)
            elif how[0] == "at":
                hand.time_ns = how[1]
                turn(what, 0)
            else:
                turn(what, how[1] if LEAST <= hand.time_ns + how[1] <= MOST else 0)


def turned(vectors, angle):
    """Return vectors (n, 3) turned about the vertical."""
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    return np.asarray(vectors) @ turn.T


def round_scene(one):
    """Return a scene of a liquid without what has a direction of its own; a turn of 52.3° breaks the wake.

    At a threshold rounding decides: 45° and its like are no rare angles in what hypothesis draws.
    """
    effects = tuple(effect for effect in one.effects if effect not in {"current", "buoyancy"})
    wake = None if one.wake is None else one.wake.model_copy(update={"breaking_angle_deg": 52.3})
    return scene(one.model_copy(update={"effects": effects, "wake": wake, "current": None}), scale=5)


ROUND = {name: round_scene(one) for name, one in {"pool": POOL, "places": PLACES}.items()}
ROUND |= {name: round_scene(felt.liquids[0]) for name, felt in THESIS.items()}


@pytest.mark.variants(2)
@pytest.mark.parametrize("name", ROUND)
@settings(max_examples=examples(25), deadline=None)
@given(angle=st.floats(0, 2 * np.pi), seed=st.integers(0, 2**32 - 1), estimator=st.sampled_from(list(ESTIMATORS)))
def test_turning_a_hands_path_about_the_vertical_turns_all_that_is_felt(name, angle, seed, estimator):
    random = np.random.default_rng(seed)
    steps = np.repeat(random.normal(size=(5, 3)), LEG_TICKS, axis=0) + 0.2 * random.normal(size=(5 * LEG_TICKS, 3))
    places = np.cumsum(2e-4 * steps, axis=0)
    felt = ROUND[name].model_copy(update={"velocity": ESTIMATORS[estimator]})
    straight, round_ = Hand(felt), Hand(felt)
    for place, other in zip(places, turned(places, angle), strict=True):
        one, same = straight.tick(place), round_.tick(other)
        assert same.limiters == one.limiters
        for field in ("velocity_mps", "wake_mps", "force_n", "device_force_n"):
            size = max(np.linalg.norm(one[field]), 1e-3)
            assert np.abs(same[field] - turned(one[field], angle)).max() <= 1e-9 * size, field


STILL = {name: scene(liquid(wake=None, id=name)) for name in ("plain",)} | {
    name: scene(
        *(
            one.model_copy(update={"effects": tuple(e for e in one.effects if e not in {"current", "buoyancy"})})
            for one in felt.liquids
        )
    )
    for name, felt in {**THESIS, "pool": scene(POOL), "places": scene(PLACES), "bed": scene(POOL, BED)}.items()
}


@pytest.mark.parametrize("name", STILL)
@settings(max_examples=examples(30), deadline=None)
@given(
    place=st.tuples(*[st.floats(-0.2, 0.2)] * 3),
    after_ns=st.lists(st.sampled_from([1_000_000, 0, 300_000, 4_000_000]), min_size=1, max_size=60),
    estimator=st.sampled_from(list(ESTIMATORS)),
)
def test_a_hand_that_has_not_moved_feels_nothing(name, place, after_ns, estimator):
    hand = Hand(STILL[name].model_copy(update={"velocity": ESTIMATORS[estimator]}))
    for ns in after_ns:
        sample = hand.tick(place, after_ns=ns)
        for vector in (sample.velocity_mps, sample.wake_mps, sample.force_n, sample.device_force_n):
            assert not vector.any()
