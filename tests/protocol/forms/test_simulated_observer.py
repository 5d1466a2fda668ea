from dataclasses import replace
from statistics import mean

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.load import load
from study_app.protocol.orders.schedule import stream
from study_app.protocol.simulated import TrialFeatures, rate, rater

REK = load("rek2024")
LIQUID = tuple(item.id for item in REK.questionnaires["liquid"].items)
DELAY = tuple(item.id for item in REK.questionnaires["delay"].items)

# What a rehearsed participant meets in each liquid while exploring it for half a minute.
WATER = TrialFeatures(1.38, 8.0, 0.131, 0.004, 0.051, 0.004)
HONEY = TrialFeatures(1.29, 8.0, 0.104, 0.001, 0.066, 0.004)


felt_anything = st.builds(
    TrialFeatures,
    *(st.floats(0, 8) for _ in range(2)),
    st.floats(0, 1),
    st.floats(0, 1),
    st.floats(0, 1),
    st.floats(0, 1),
)
seeds = st.integers(0, 2**32)


def answers(items, felt: TrialFeatures, people: int = 200) -> dict[str, float]:
    """Return the mean answers of many raters."""
    given_ = [
        rate(items, felt, rater(stream(seed, "rater").random), stream(seed, "a").random) for seed in range(people)
    ]
    return {item: mean(answer[item] for answer in given_) for item in items}


@given(felt_anything, seeds)
def test_answers_are_points_of_the_scale(felt: TrialFeatures, seed: int):
    draw = stream(seed, "rater").random
    answered = rate((*LIQUID, *DELAY, "something_else"), felt, rater(draw), draw)
    assert list(answered) == [*LIQUID, *DELAY, "something_else"]
    assert set(answered.values()) <= {1, 2, 3, 4, 5, 6, 7}


def test_water_is_recognised():
    felt = answers(LIQUID, WATER)
    assert felt["like_water"] > 4.5
    assert max(LIQUID[4:], key=felt.__getitem__) == "like_water"


def test_honey_is_recognised_and_tar_is_near():
    felt = answers(LIQUID, HONEY)
    likest = sorted(LIQUID[4:], key=felt.__getitem__)
    assert likest[-1] == "like_honey"
    assert "like_tar" in likest[-3:]
    assert felt["like_water"] < 3


@pytest.mark.parametrize("item", DELAY[:4])
def test_a_delay_is_noticed_more_the_longer_it_is(item: str):
    means = [answers([item], replace(WATER, delay_s=ms / 1000))[item] for ms in (10, 60, 110, 135, 160, 210, 400)]
    assert means == sorted(means)
    assert means[-1] - means[0] > 1.5


def test_answers_are_pinned():
    """A change of platform or Python would show here."""
    person = rater(stream(1, "rater/P001").random)
    assert list(rate(LIQUID, WATER, person, stream(1, "answers/P001").random).values()) == [5, 5, 5, 6, 1, 5, 3, 4, 2]
