"""Up–down staircases: steps, reversals, and the percentage to which a rule converges."""

import numpy as np
import pytest
from scipy.special import ndtr

from study_app.psychophysics.updown import RATIOS, Staircase, converges_to


def staircase(down_after=2, step_up=0.2, ratio=0.5, low=-1.0, high=1.0, begin=1.0):
    return Staircase(down_after, step_up, ratio, low, high, begin)


def climb(one, successes):
    answers = []
    for success in successes:
        answers.append((one.next(answers), success))
    return answers


def test_the_level_falls_after_successes_in_a_row_and_rises_after_each_failure():
    one = staircase()
    answers = climb(one, [True, True, True, True, True, False, True, True])
    assert [level for level, _ in answers] == pytest.approx([1.0, 1.0, 0.9, 0.9, 0.8, 0.8, 1.0, 1.0])
    assert one.next(answers) == pytest.approx(0.9)


def test_levels_stay_within_the_domain():
    one = staircase(down_after=1, step_up=1.5, ratio=1.0)
    assert [level for level, _ in climb(one, [False, True, True, True])] == [1.0, 1.0, -0.5, -1.0]


def test_the_next_level_starts_from_the_level_that_was_presented():
    assert staircase().next([(0.37, False)]) == pytest.approx(0.57)


def test_reversals_are_the_levels_at_which_the_direction_changed():
    one = staircase(down_after=1, step_up=0.2, ratio=1.0)
    answers = climb(one, [True, True, False, False, True, False])
    assert [level for level, _ in answers] == pytest.approx([1.0, 0.8, 0.6, 0.8, 1.0, 0.8])
    assert one.reversals(answers) == pytest.approx([0.6, 1.0, 0.8])


def test_a_reversal_counts_across_successes_that_are_too_few_for_a_step():
    one = staircase(down_after=2, begin=0.0)
    answers = climb(one, [True, True, True, False, True, True])  # down, nothing, up, nothing, down
    assert one.reversals(answers) == pytest.approx([answers[3][0], answers[5][0]])


def test_the_mean_leaves_out_the_first_two_reversals_and_those_at_an_end_of_the_domain():
    one = staircase(down_after=1, step_up=0.2, ratio=1.0)
    answers = climb(one, [True, False] * 3)  # reversals 0.8, 1.0, 0.8, 1.0, 0.8: those at 1.0 lie at the end
    assert one.reversals(answers) == pytest.approx([0.8, 1.0, 0.8, 1.0, 0.8])
    assert one.mean_of_reversals(answers, 8) == pytest.approx(0.8)
    assert one.mean_of_reversals(answers[:-2], 8) is None


def test_percentages_are_those_of_garcia_perez():
    found = [100 * converges_to(n, ratio) for n, ratio in RATIOS.items()]
    assert found == pytest.approx([77.85, 80.35, 83.15, 85.84], abs=0.005)
    assert 100 * converges_to(2, 1.0) == pytest.approx(70.7, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("down_after", "ratio", "reached"),
    [
        (1, RATIOS[1], (78.1, 78.3, 78.7, 79.5)),
        (2, RATIOS[2], (80.4, 80.5, 80.7, 81.3)),
        (3, RATIOS[3], (83.2, 83.2, 83.3, 83.6)),
        (4, RATIOS[4], (85.8, 85.9, 86.0, 86.2)),
        (2, 1.0, (69.6, 68.5, 66.0, 61.0)),
        (3, 1.0, (79.0, 78.5, 77.7, 75.0)),
    ],
)
def test_percent_correct_at_the_mean_of_reversals_in_the_long_run(down_after, ratio, reached):
    """By the step up in standard deviations of the observer: equal steps depend on it, weighted ones hardly."""
    draw = np.random.default_rng(down_after)
    for step_up, percent in zip((0.25, 0.5, 1.0, 2.0), reached, strict=True):
        one = staircase(down_after, step_up, ratio, low=-50.0, high=50.0, begin=0.5)
        u, run, before, reversals = 0.5, 0, 0, []
        for chance in draw.random(40_000):  # the rule itself, since `next` looks at all answers each time
            success = chance < 0.5 + 0.5 * ndtr(u)
            run = run + 1 if success else 0
            move = 1 if not success else -1 if run == down_after else 0
            run = 0 if move else run
            if move * before < 0:
                reversals.append(u)
            before = move or before
            u += one.step_up * move * (ratio if move < 0 else 1.0)
        assert 100 * (0.5 + 0.5 * ndtr(np.mean(reversals[2:]))) == pytest.approx(percent, abs=0.75)
