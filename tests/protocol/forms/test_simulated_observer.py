"""Simulated people: what changes their opinions, how they are drawn, and how they answer trials of intervals."""

import math
from itertools import chain, repeat
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.protocol.load import load, parse
from study_app.protocol.orders.schedule import build_schedule, stream
from study_app.protocol.participants.raters import SimulatedParticipants
from study_app.protocol.simulated import (
    OPINIONS,
    Comparison,
    Course,
    Observer,
    Rater,
    TrialFeatures,
    as_requested,
    courses_of,
    judgements,
    rate,
    rater,
    simulate_ratings,
    simulate_study,
)
from study_app.protocol.trials.designs import Rated, default_design
from study_app.protocol.trials.stimuli import Stimulated
from study_app.psychophysics.people import Person
from tests.protocol.edited_studies import text_of
from tests.protocol.trials.level_studies import study

felt_anything = st.builds(
    TrialFeatures,
    **{name: st.floats(0, 8) for name in ("force_mean_n", "force_peak_n")},
    **{name: st.floats(0, 1) for name in ("speed_rms_mps", "push_share", "roughness_n", "delay_s")},
)


@given(felt_anything, st.integers(0, 2**32))
def test_answers_are_points_of_the_scale(felt: TrialFeatures, seed: int) -> None:
    draw = stream(seed, "rater").random
    answered = rate((*OPINIONS, "something_else"), felt, rater(draw), draw)
    assert list(answered) == [*OPINIONS, "something_else"]
    assert set(answered.values()) <= {1, 2, 3, 4, 5, 6, 7}


EVEN = Rater(leaning=0, noise=0, strength=1, threshold_s=0.13)
QUALITIES = {"force": 0.5, "resistance": 50.0, "push": 0.05, "peak": 5.0, "rough": 0.1, "delay": 0.14}


def opinions(person: Rater = EVEN, **qualities: float) -> dict[str, float]:
    """Return the opinions on all items about a trial with some changed qualities."""
    features = QUALITIES | qualities
    trial = TrialFeatures(
        force_mean_n=features["force"],
        force_peak_n=features["force"] * features["peak"],
        speed_rms_mps=math.sqrt(features["force"] / features["resistance"]),
        push_share=features["push"],
        roughness_n=features["rough"],
        delay_s=features["delay"],
    )
    return judgements(OPINIONS, trial, person, lambda: 0.5)


RAISED = {
    "force": "feels_liquid immersive strength expected",
    "resistance": "like_honey like_slime like_tar",
    "delay": "different harder detracts unusable",
}
LOWERED = {
    "resistance": "like_oil",
    "push": "like_honey like_water like_tar",
    "peak": "strength expected",
    "rough": "feels_liquid immersive strength expected",
    "delay": "comfortable",
}


@pytest.mark.parametrize("quality", QUALITIES)
def test_each_quality_raises_and_lowers_opinions_on_its_own_statements(quality: str) -> None:
    usual, more = opinions(), opinions(**{quality: 1.4 * QUALITIES[quality]})
    changes = {item: more[item] - usual[item] for item in OPINIONS if item != "like_water" or quality != "resistance"}
    assert {item for item, change in changes.items() if change > 1e-9} == {*RAISED.get(quality, "").split()}
    assert {item for item, change in changes.items() if change < -1e-9} == {*LOWERED.get(quality, "").split()}


def test_water_resists_without_being_thick() -> None:
    thin, water, thick = (opinions(resistance=resistance)["like_water"] for resistance in (5, 50, 500))
    assert thin + 1 < water > thick + 1


@pytest.mark.parametrize(
    ("item", "quality", "middle", "width"),
    [
        ("immersive", "force", 0.15, 0.1),
        ("like_slime", "resistance", 98, 14),
        ("like_honey", "push", 0.08, 0.04),
        ("strength", "peak", 8, 2),
        ("immersive", "rough", 0.15, 0.05),
        ("different", "delay", 0.13, 0.015),
        ("harder", "delay", 0.16, 0.03),
        ("unusable", "delay", 0.21, 0.04),
    ],
)
def test_an_impression_is_half_at_its_middle_and_rises_within_its_width(
    item: str, quality: str, middle: float, width: float
) -> None:
    """The sigmoid x / √(1 + x²) is symmetric, and at 2 widths √(8/5) times as far from a half as at 1 width."""
    others = {"resistance": 98.0} if item == "like_honey" else {}
    below, half, above, far = (
        opinions(**others | {quality: middle + number * width})[item] for number in (-1, 0, 1, 2)
    )
    assert half - below == pytest.approx(above - half)
    assert (far - half) / (above - half) == pytest.approx(math.sqrt(8 / 5))


def test_a_strong_observer_feels_forces_as_if_they_were_larger() -> None:
    doubled = opinions(force=2 * QUALITIES["force"], resistance=2 * QUALITIES["resistance"], peak=2.5)
    strong = opinions(Rater(leaning=0, noise=0, strength=2, threshold_s=0.13), peak=2.5)
    assert strong == pytest.approx(doubled)
    assert opinions(Rater(leaning=1.25, noise=0, strength=1, threshold_s=0.13)) == pytest.approx(
        {item: opinion + 1.25 for item, opinion in opinions().items()}
    )


@pytest.mark.parametrize(
    ("number", "leaning", "noise", "strength", "threshold_s"),
    [
        (0.5, 0, 1, 1, 0.13),
        (0.75, 3, 0.725 / 0.65, 1.3, 0.175),
        (0.25, -3, 0.575 / 0.65, 0.7, 0.085),
        (0.0, -6, 0.5 / 0.65, 0.5, 0.06),
    ],
)
def test_people_are_drawn_around_the_stated_spreads(
    number: float, leaning: float, noise: float, strength: float, threshold_s: float
) -> None:
    """Twelve numbers x have the sum 12 x − 6 in place of a normal number: 3 for 0.75."""
    person = rater(lambda: number, SimulatedParticipants(noise_sd=1.3, bias_sd=0.7))
    assert (person.leaning, person.noise) == pytest.approx((0.7 * leaning, 1.3 * noise))
    assert (person.strength, person.threshold_s) == pytest.approx((strength, threshold_s))


def test_answers_are_rounded_opinions_with_noise_within_the_scale() -> None:
    trial = TrialFeatures(force_mean_n=0, force_peak_n=0, speed_rms_mps=1, push_share=0, roughness_n=0, delay_s=0)
    for leaning, number, answer in (
        (0, 0.5, 4),
        (0.49, 0.5, 4),
        (0.5, 0.5, 5),
        (0, 0.75, 5),
        (9, 0.5, 7),
        (-9, 0.5, 1),
    ):
        person = Rater(leaning=leaning, noise=0.3, strength=1, threshold_s=0.13)
        assert rate(["unknown"], trial, person, repeat(number).__next__) == {"unknown": answer}, (leaning, number)


def test_opinions_of_many_participants_are_those_of_drawn_trials_with_their_noise() -> None:
    early, late, thick = (
        TrialFeatures(
            force_mean_n=force_n, force_peak_n=2, speed_rms_mps=0.1, push_share=0, roughness_n=0, delay_s=delay_s
        )
        for force_n, delay_s in ((0.2, 0.01), (0.2, 0.4), (2.0, 0.01))
    )
    person = Rater(leaning=1, noise=0.8, strength=1, threshold_s=0.13)
    ratings, noise = simulate_ratings(
        ["different", "like_slime"], [[early, late], [thick]], 600, person, np.random.default_rng(5)
    )
    assert ratings.shape == noise.shape == (600, 2, 2)
    expected = [judgements(["different", "like_slime"], trial, EVEN, lambda: 0.5) for trial in (early, late, thick)]
    assert np.mean(ratings[:, 0, 0] == expected[0]["different"]) == pytest.approx(0.5, abs=0.08)
    assert {*ratings[:, 0, 0]} == {expected[0]["different"], expected[1]["different"]}
    assert {*ratings[:, 1, 1]} == {expected[2]["like_slime"]}
    assert noise.mean(axis=(0, 1, 2)) == pytest.approx(0, abs=0.06)
    assert noise.std() == pytest.approx(0.8, abs=0.05)


def test_an_observer_is_right_in_75_percent_at_the_stated_thresholds() -> None:
    """The difference of two intervals is noisy in both: √2 of a delay's noise; a resistance's is proportional."""
    observer, cdf = Observer(weber_fraction=0.3, delay_jnd_s=0.04), NormalDist().cdf
    assert cdf(0.3 / (observer.resistance_noise * math.hypot(1, 1.3))) == pytest.approx(0.75, abs=1e-4)
    assert cdf(0.04 / (observer.delay_noise_s * math.sqrt(2))) == pytest.approx(0.75, abs=1e-4)


FELT = TrialFeatures(
    force_mean_n=3,
    force_peak_n=5,
    speed_rms_mps=0.25,
    push_share=0.3,
    roughness_n=0.7,
    delay_s=0.11,
    force_delay_s=0.06,
)


@pytest.mark.parametrize(
    ("vary", "sensed", "noisy", "notices"),
    [
        ("delay_ms", 0.11, 0.11 + 3 * 0.04 / (0.6745 * math.sqrt(2)), (0.041, 0.039)),
        ("force_delay_ms", 0.06, 0.06 + 3 * 0.04 / (0.6745 * math.sqrt(2)), (0.041, 0.039)),
        ("force_jitter_ms", 0.7, 0.7 * (1 + 3 * 0.3 / (0.6745 * math.hypot(1, 1.3))), (0.211, 0.209)),
        ("viscosity_pa_s", 12, 12 * (1 + 3 * 0.3 / (0.6745 * math.hypot(1, 1.3))), (3.61, 3.59)),
    ],
)
@pytest.mark.parametrize("direction", ["up", "down"])
def test_the_varied_number_determines_the_comparison(
    vary: str, sensed: float, noisy: float, notices: tuple[float, float], direction: str
) -> None:
    stimulus = f'"{vary}"\nlevel = "difference"\ndirection = "{direction}"'
    protocol = study(('"viscosity_pa_s"', stimulus), ("standards = [1, 2]", "standards = [5]"))
    observer = Observer(weber_fraction=0.3, delay_jnd_s=0.04)
    comparison = Comparison.of(protocol, protocol.blocks["viscosity"], observer)
    assert (comparison.smallest, comparison.observer) == (direction == "down", observer)
    assert comparison.sensed(FELT) == pytest.approx(sensed)
    assert comparison.noisy(comparison.sensed(FELT), lambda: 0.75) == pytest.approx(noisy)
    assert [comparison.distinct(-difference, sensed) for difference in notices] == [True, False]


def comparing(*, delays: bool = False, smallest: bool = False, **keys: Any) -> Comparison:
    person = Person(lapse=keys.pop("lapse", 0.0))
    return Comparison(delays, smallest, Observer(person=person, **keys))


def test_ratings_and_estimates_follow_from_the_last_interval_and_those_before() -> None:
    protocol, rated, even = study(), Rated(scale="agreement"), lambda: 0.5
    nine = parse(text_of("session").encode(), "x").scales["judged"]
    assert nine.points == 7
    protocol = protocol.model_copy(update={"scales": {"agreement": nine}})
    for sensed, before, answer in (
        ([5.0], [2.0, 5.0], 6),
        ([3.0], [5.0, 4.0], 3),
        ([40.0], [1.0], 7),
        ([0.0], [9.0], 1),
    ):
        assert comparing().answer(protocol, rated, sensed, before, even) == answer
    estimation = default_design("estimation")
    assert comparing().answer(protocol, estimation, [8.0], [2.0, 3.0], even) == pytest.approx(20)
    assert comparing().answer(protocol, estimation, [8.0], [], even) == pytest.approx(10)
    scaled = comparing(estimates=(0.7, 0.2))
    assert scaled.answer(protocol, estimation, [8.0], [2.0], even) == pytest.approx(10 * 4**0.7)
    assert scaled.answer(protocol, estimation, [8.0], [2.0], lambda: 0.75) == pytest.approx(
        10 * 4**0.7 * math.exp(3 * 0.2)
    )


@pytest.mark.parametrize(("smallest", "chosen"), [(False, "third"), (True, "second")])
def test_choices_are_the_strongest_or_the_weakest_interval_unless_attention_lapses(smallest: bool, chosen: str) -> None:
    design, protocol = default_design("4ifc"), study()
    sensed = [5.0, 3.0, 9.0, 4.0]
    assert comparing(smallest=smallest).answer(protocol, design, sensed, [], lambda: 0.5) == chosen
    numbers = chain([0.5] * 48, [0.01, 0.3])
    lapsed = comparing(smallest=smallest, lapse=0.02).choose(design, sensed, 5.0, lambda: next(numbers))
    assert lapsed == "second"


@pytest.mark.parametrize("delays", [False, True])
@pytest.mark.parametrize("smallest", [False, True])
def test_equal_intervals_are_decided_by_preference_or_the_last_answer(*, delays: bool, smallest: bool) -> None:
    design = default_design("3ifc")
    for person, choice in ((Person(criterion=3, lapse=0), "first"), (Person(repeats=3, lapse=0), "second")):
        comparison = Comparison(delays, smallest, Observer(person=person))
        assert comparison.choose(design, [0.2] * 3, 0.2, lambda: 0.5, Course(last="second")) == choice


def test_each_simulated_trial_states_its_own_values() -> None:
    protocol = study(("task =", "catch = { share = 0.2 }\ntask ="))
    sharp = Observer(weber_fraction=1e-4, person=Person(lapse=0))
    trials = list(simulate_study(protocol, {"A7": sharp, "B8": sharp}, 3))
    numbers = [trial.number for trial in build_schedule(protocol, "A7", 3).trials]
    assert [(trial.participant, trial.trial) for trial in trials] == [
        (person, number) for person in ("A7", "B8") for number in numbers
    ]
    assert {trial.block for trial in trials} == {"viscosity"}
    assert {trial.arrangement for trial in trials} == {"SC", "CS"}
    assert {trial.standard for trial in trials} == {1.0, 2.0}
    assert sorted({trial.code for trial in trials}) == ["V1", "V2"]
    assert len({(trial.code, trial.track) for trial in trials}) == 2
    for trial in trials:
        assert trial.track == f"{trial.standard:g}/1"
        assert trial.answer == ("first" if trial.arrangement == "CS" else "second")
        assert trial.success is True
        assert trial.level == 0.8 if trial.catch else trial.level in {0.2, 0.4, 0.8}
    assert sum(trial.catch for trial in trials) == 2 * 2 * 4
    assert as_requested(Stimulated("oil", "delay_ms", 250.0)) == 0.25
    assert as_requested(Stimulated("oil", "viscosity_pa_s", 2.5)) == 2.5


def test_an_observer_answers_any_number_of_trials_of_each_block() -> None:
    schedule = build_schedule(load("rek2024"), "P001", 1)
    shares: dict[str, list[float]] = {}
    for trial in schedule.trials:
        shares.setdefault(trial.block, []).append(courses_of(schedule)[trial.number])
    assert shares["liquids"] == [0, 0.5, 1]
    assert shares["delays"] == pytest.approx([number / 6 for number in range(7)])
    assert {0.5} == {share for values in shares.values() if len(values) == 1 for share in values}
