from collections import Counter

import pytest

from study_app.protocol.trials.design import Design
from study_app.protocol.trials.designs.rating_of_interval import Rated
from study_app.protocol.trials.kinds import DESIGN_KINDS, default_design
from tests.protocol.trials.level_studies import key_of, run, study


def design(kind: str) -> Design:
    return Rated(scale="agreement") if kind == "rating" else default_design(kind)


@pytest.mark.parametrize(
    ("kind", "intervals", "arrangements", "guess_rate"),
    [
        ("2ifc", 2, 2, 1 / 2),
        ("3ifc", 3, 3, 1 / 3),
        ("4ifc", 4, 4, 1 / 4),
        ("abx", 3, 4, 1 / 2),
        ("oddity", 3, 6, 1 / 3),
        ("samedifferent", 2, 4, None),
        ("yesno", 1, 2, None),
        ("rating", 1, 1, None),
        ("estimation", 1, 1, None),
    ],
)
def test_intervals_arrangements_and_guess_rate(kind: str, intervals: int, arrangements: int, guess_rate: float | None):
    built = design(kind)
    assert built.intervals == intervals
    assert len(built.arrangements) == len(set(built.arrangements)) == arrangements
    assert {len(one) for one in built.arrangements} == {intervals}
    assert built.guess_rate == guess_rate


@pytest.mark.parametrize("kind", [kind for kind in DESIGN_KINDS if design(kind).has_correct_answer])
def test_every_arrangement_has_a_correct_answer_and_each_is_correct_equally_often(kind: str):
    built = design(kind)
    correct = [built.correct(number) for number in range(len(built.arrangements))]
    assert set(correct) == set(built.answers)
    assert len(set(Counter(correct).values())) == 1


@pytest.mark.parametrize(
    ("kind", "arrangement", "correct"),
    [
        ("2ifc", (True, False), "first"),
        ("2ifc", (False, True), "second"),
        ("4ifc", (False, False, False, True), "fourth"),
        ("abx", (False, True, False), "like_first"),
        ("abx", (True, False, False), "like_second"),
        ("oddity", (True, True, False), "third"),
        ("oddity", (True, False, False), "first"),
        ("samedifferent", (True, True), "same"),
        ("samedifferent", (False, True), "different"),
        ("yesno", (True,), "yes"),
        ("yesno", (False,), "no"),
    ],
)
def test_the_correct_answer(kind: str, arrangement: tuple[bool, ...], correct: str):
    built = design(kind)
    assert built.correct(built.arrangements.index(arrangement)) == correct


class Sharp:
    """Notices every difference; the strongest is asked for."""

    smallest = False

    def distinct(self, difference: float, about: float) -> bool:
        return difference != 0


@pytest.mark.parametrize("kind", [kind for kind in DESIGN_KINDS if design(kind).reply == "choice"])
def test_simulated_observer_without_noise_answers_correctly(kind: str):
    built = design(kind)
    for number, arrangement in enumerate(built.arrangements):
        taken = [2.0 if comparison else 1.0 for comparison in arrangement]
        assert built.simulated(taken, 1.5, Sharp()) == built.correct(number)


def test_yes_counts_as_success_whatever_was_presented():
    built = design("yesno")
    assert [built.success(0, "yes"), built.success(1, "yes"), built.success(0, "no")] == [True, True, False]


@pytest.mark.parametrize("kind", ["2ifc", "3ifc", "4ifc", "abx", "oddity", "samedifferent"])
@pytest.mark.parametrize("seed", range(3))
def test_arrangements_are_counterbalanced_in_every_run_of_a_track(kind: str, seed: int):
    protocol = study(('design = "2ifc"', f'design = "{kind}"'), ("standards = [1, 2]", "standards = [2]"))
    presented = [due.arrangement for due in run(protocol, key_of(protocol), seed=seed)]
    run_length = 2 * len(design(kind).arrangements)
    assert len(presented) == 24
    for first in range(0, len(presented) - run_length + 1, run_length):
        assert set(Counter(presented[first : first + run_length]).values()) == {2}


@pytest.mark.parametrize(
    ("when", "practice", "main"), [("never", False, False), ("practice", True, False), ("always", True, True)]
)
def test_feedback_is_shown_when_the_study_says(when: str, practice: bool, main: bool):
    built = design("2ifc").model_copy(update={"feedback": when})
    assert (built.shows_feedback(True), built.shows_feedback(False)) == (practice, main)


def test_feedback_defaults_to_practice_and_to_never_where_no_answer_is_correct():
    assert (design("2ifc").shows_feedback(True), design("2ifc").shows_feedback(False)) == (True, False)
    assert not design("estimation").shows_feedback(True)
