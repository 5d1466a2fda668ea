from dataclasses import replace
from statistics import mean, pstdev

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.forms.simulated_observer import OPINIONS, Rater, TrialFeatures, rate, rater
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import stream

REK = load("rek2024")
LIQUID = tuple(item.id for item in REK.questionnaires["liquid"].items)
DELAY = tuple(item.id for item in REK.questionnaires["delay"].items)

# What a rehearsed participant meets in each liquid while exploring it for half a minute.
WATER = TrialFeatures(1.38, 8.0, 0.131, 0.004, 0.051, 0.004)
HONEY = TrialFeatures(1.29, 8.0, 0.104, 0.001, 0.066, 0.004)
LIGHT_OIL = TrialFeatures(1.24, 8.0, 0.120, 0.098, 0.102, 0.004)

CALM = Rater(leaning=0.0, noise=0.0, strength=1.0, threshold_s=0.13)

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


@given(felt_anything, seeds)
def test_the_same_trial_and_draw_give_the_same_answers(felt: TrialFeatures, seed: int):
    person = rater(stream(seed, "rater").random)
    once, again = (rate(LIQUID, felt, person, stream(seed, "answers").random) for _ in range(2))
    assert once == again


def test_the_thesis_statements_are_all_known():
    assert set(LIQUID) | set(DELAY) == set(OPINIONS)


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


def test_light_oil_is_not_recognised():
    felt = answers(LIQUID, LIGHT_OIL)
    assert max(felt[item] for item in LIQUID[4:]) < 4.5
    assert felt["like_honey"] < 3


def test_nothing_felt_is_no_liquid():
    nothing = TrialFeatures(0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
    assert answers(LIQUID, nothing)["feels_liquid"] < 3 < answers(LIQUID, WATER)["feels_liquid"]


def test_how_fast_the_hand_moved_does_not_change_the_likeness():
    """Quadratic drag: half the speed, a quarter of the force."""
    slower = replace(HONEY, force_mean_n=HONEY.force_mean_n / 4, speed_rms_mps=HONEY.speed_rms_mps / 2)
    assert abs(answers(LIQUID, slower)["like_honey"] - answers(LIQUID, HONEY)["like_honey"]) < 0.1


@pytest.mark.parametrize("item", DELAY[:4])
def test_a_delay_is_noticed_more_the_longer_it_is(item: str):
    means = [answers([item], replace(WATER, delay_s=ms / 1000))[item] for ms in (10, 60, 110, 135, 160, 210, 400)]
    assert means == sorted(means)
    assert means[-1] - means[0] > 1.5


def test_a_delay_begins_to_show_above_100_ms():
    different = {
        ms: answers(["different"], replace(WATER, delay_s=ms / 1000))["different"] for ms in (10, 60, 85, 150, 210)
    }
    assert different[60] - different[10] < 0.3
    assert different[85] < 3
    assert different[150] > 4
    assert different[210] > 5


def test_comfort_drops_little_with_delay():
    prompt = answers(["comfortable"], replace(WATER, delay_s=0.01))["comfortable"]
    late = answers(["comfortable"], replace(WATER, delay_s=0.21))["comfortable"]
    assert 0.3 < prompt - late < 2


def test_an_unknown_statement_gets_an_answer_near_the_middle():
    assert rate(["favourite_colour"], WATER, CALM, lambda: 0.5) == {"favourite_colour": 4}
    assert abs(answers(["favourite_colour"], WATER)["favourite_colour"] - 4) < 0.15


def test_what_was_seen_does_not_change_what_was_felt():
    late = replace(WATER, delay_s=0.4)
    assert rate(LIQUID, late, CALM, lambda: 0.5) == rate(LIQUID, WATER, CALM, lambda: 0.5)


def test_people_differ_and_are_centred():
    people = [rater(stream(seed, "rater").random) for seed in range(500)]
    assert abs(mean(person.leaning for person in people)) < 0.06
    assert 0.3 < pstdev(person.leaning for person in people) < 0.5
    assert abs(mean(person.threshold_s for person in people) - 0.13) < 0.003
    assert min(person.threshold_s for person in people) >= 0.06


def test_answers_are_pinned():
    """A change of platform or Python would show here."""
    person = rater(stream(1, "rater/P001").random)
    assert list(rate(LIQUID, WATER, person, stream(1, "answers/P001").random).values()) == [5, 5, 5, 6, 1, 5, 3, 4, 2]
