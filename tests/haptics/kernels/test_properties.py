"""Properties of the whole tick for arbitrary input: sample validation, estimator, liquids, safety."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from study_app.haptics.model.estimators import Ewma, Kalman, Raw
from study_app.haptics.model.layout import LIMITER_ENERGY, STATUS_NON_FINITE
from study_app.haptics.model.slope_limits import SLEW_N
from tests.haptics.scenes import EVERYTHING, THESIS, TICK_NS, Hand, examples

pytestmark = pytest.mark.slow

ALL = {**THESIS, **EVERYTHING}
ESTIMATORS = {"ewma": Ewma(), "kalman": Kalman(), "raw": Raw()}
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
def test_any_bytes_at_any_time_give_a_finite_force_within_the_limit_that_never_jumps(name, todo, estimator, faded_in):
    hand = Hand(ALL[name].model_copy(update={"velocity": ESTIMATORS[estimator]}), faded_in=faded_in)

    before_n = np.zeros(3)

    def turn(place, after_ns):
        nonlocal before_n
        sample = hand.tick(place, after_ns=after_ns)
        stepped_n = np.linalg.norm(sample.device_force_n - before_n)
        let_go = sample.limiters & LIMITER_ENERGY or not sample.device_force_n.any()
        assert stepped_n <= SLEW_N + 1e-9 or let_go
        before_n = np.array(sample.device_force_n)
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
