from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.load import load
from study_app.protocol.orders.schedule import stream
from study_app.protocol.simulated import TrialFeatures, rate, rater

REK = load("rek2024")
LIQUID = tuple(item.id for item in REK.questionnaires["liquid"].items)
DELAY = tuple(item.id for item in REK.questionnaires["delay"].items)

# What a rehearsed participant meets in each liquid while exploring it for half a minute.
WATER = TrialFeatures(
    force_mean_n=1.38, force_peak_n=8.0, speed_rms_mps=0.131, push_share=0.004, roughness_n=0.051, delay_s=0.004
)


felt_anything = st.builds(
    TrialFeatures,
    *(st.floats(0, 8) for _ in range(2)),
    st.floats(0, 1),
    st.floats(0, 1),
    st.floats(0, 1),
    st.floats(0, 1),
)
seeds = st.integers(0, 2**32)


@given(felt_anything, seeds)
def test_answers_are_points_of_the_scale(felt: TrialFeatures, seed: int):
    draw = stream(seed, "rater").random
    answered = rate((*LIQUID, *DELAY, "something_else"), felt, rater(draw), draw)
    assert list(answered) == [*LIQUID, *DELAY, "something_else"]
    assert set(answered.values()) <= {1, 2, 3, 4, 5, 6, 7}


def test_answers_are_pinned():
    """A change of platform or Python would show here."""
    person = rater(stream(1, "rater/P001").random)
    assert list(rate(LIQUID, WATER, person, stream(1, "answers/P001").random).values()) == [5, 5, 5, 6, 1, 5, 3, 4, 2]
