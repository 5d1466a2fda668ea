"""The sweep's tests over many studies at once, against the report's one by one."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import ttest_1samp

from study_app.analysis.planning import simulated_studies
from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.rank_tests import friedman, global_permutation, signed_rank_test
from study_app.analysis.statistics.trend_tests import trend

pytestmark = pytest.mark.slow

CLOSE = 5 * np.sqrt(0.25 / simulated_studies.PLANNED_DRAWS)
"""Five standard errors of a drawn p, at most."""


def rising_answers(seed: int, shape: tuple[int, ...], rise: float = 0.0) -> np.ndarray:
    """Answers (studies, participants, settings, items) that rise with the setting."""
    rng = np.random.default_rng(seed)
    points = 4 + rng.normal(size=shape) * 1.5 + rise * np.arange(shape[-2])[:, None]
    return np.clip(np.round(points), 1, 7)


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.mark.parametrize(("n", "k"), [(5, 3), (9, 3), (6, 4)])
def test_friedman_is_the_reports(n: int, k: int) -> None:
    answers = rising_answers(2, (20, n, k, 2), rise=0.5)
    ps, of_all = simulated_studies.friedman(simulated_studies.ranks(answers), rng())
    expected = [[friedman(study[:, :, item]).p for item in range(2)] for study in answers]
    assert np.abs(ps - np.array(expected)).max() < CLOSE
    together = [global_permutation(study.transpose(2, 0, 1)).p for study in answers]
    assert np.abs(of_all - np.array(together)).max() < 2 * CLOSE  # that one is drawn, too


def test_a_p_that_no_draw_reaches_is_near_the_reports() -> None:
    answers = rising_answers(2, (12, 12, 3, 2), rise=1.0)
    p_values, _ = simulated_studies.friedman(simulated_studies.ranks(answers), rng())
    exact = np.array([[friedman(study[:, :, item]).p for item in range(2)] for study in answers])
    rare = exact < 1e-4
    assert rare.any()
    assert np.abs(np.log10(p_values[rare] / exact[rare])).max() < 0.7


@pytest.mark.parametrize("n", [5, 14])
def test_the_trend_is_the_reports(n: int) -> None:
    answers = rising_answers(3, (20, n, 7, 2), rise=0.15)
    ps = simulated_studies.trend(simulated_studies.ranks(answers), np.array([False, True]), rng())
    expected = [
        [trend(study[:, :, item], direction, seed=None).p for item, direction in enumerate(("increasing", None))]
        for study in answers
    ]
    assert np.abs(ps - np.array(expected)).max() < CLOSE


def delays(*delays_ms: float) -> SimpleNamespace:
    return SimpleNamespace(settings=[SimpleNamespace(delay_ms=delay_ms) for delay_ms in delays_ms])


def test_slopes_are_those_over_all_settings_also_if_two_have_the_same_delay() -> None:
    delays_ms = (0.0, 0.0, 80.0, 130.0)
    answers = rising_answers(6, (3, 15, 4, 1), rise=0.3)
    ps = simulated_studies.slopes(answers, delays(*delays_ms), np.array([False]))[:, 0]
    expected = [
        ttest_1samp(np.polyfit(delays_ms, study[:, :, 0].T, 1)[0], 0, alternative="greater").pvalue for study in answers
    ]
    assert ps == pytest.approx(expected, rel=1e-9)


def test_signed_ranks_are_the_reports() -> None:
    answers = rising_answers(4, (20, 9, 2, 3), rise=0.6)
    ps = simulated_studies.signed(answers, rng())
    expected = [
        [signed_rank_test(study[:, 0, item], study[:, 1, item]).p or 1.0 for item in range(3)] for study in answers
    ]
    assert np.abs(ps - np.array(expected)).max() < CLOSE


def test_identical_answers_are_never_significant() -> None:
    same = np.full((2, 14, 3, 2), 4.0)
    ps, of_all = simulated_studies.friedman(simulated_studies.ranks(same), rng())
    assert (ps == 1).all()
    assert (of_all == 1).all()
    assert (simulated_studies.trend(simulated_studies.ranks(same), np.array([False, True]), rng()) == 1).all()
    block = delays(0.0, 50.0, 100.0)
    for untested in (same, rising_answers(1, (2, 9, 3, 2), rise=1.0)):
        assert (simulated_studies.slopes(untested, block, np.array([False, True])) == 1).all()
    assert (simulated_studies.signed(same[:, :, :2], rng()) == 1).all()
    equal = same[:, :, 0] - same[:, :, 1]
    assert simulated_studies._are_equivalent(equal, 1.2, 0.05).all()
    assert not simulated_studies._are_equivalent(equal[:, :13], 1.2, 0.05).any()


@pytest.mark.variants(1)
@pytest.mark.slow
@pytest.mark.parametrize(("n", "bound"), [(14, 1.5), (16, 1.5), (20, 1.5)])
def test_equivalence_is_the_reports(n: int, bound: float) -> None:
    answers = rising_answers(5, (200, n, 2, 2), rise=0.4)
    differences = answers[:, :, 1] - answers[:, :, 0]
    verdicts = simulated_studies._are_equivalent(differences, bound, 0.05).ravel()
    by_t = 0
    for sample, is_equivalent in zip(differences.transpose(0, 2, 1).reshape(-1, n), verdicts, strict=True):
        whole = tost(sample, bound)
        by_t += whole.p is not None and whole.p <= 0.05
        assert is_equivalent == (whole.verdict == "equivalent")
    assert 0 < verdicts.sum() < len(verdicts)
    assert verdicts.sum() < by_t or n == 20  # with few people t alone shows it more often than the report does
