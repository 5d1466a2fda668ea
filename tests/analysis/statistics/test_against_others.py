"""Our numbers beside those of pingouin, statsmodels, scikit-posthocs and psignifit, on the same answers."""

import math
import warnings

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, ttest_rel
from scipy.stats import f as variance_ratio
from scipy.stats import t as student

from study_app.analysis.statistics.equivalence import tost
from study_app.analysis.statistics.outcome import false_discovery, holm
from study_app.analysis.statistics.rank_tests import friedman, signed_rank_test
from study_app.analysis.statistics.recognition_tests import kappa
from study_app.analysis.statistics.slope_tests import slope_test
from study_app.analysis.statistics.thresholds import group_mean
from study_app.analysis.statistics.trend_tests import trend

pytestmark = pytest.mark.slow


def answers(n: int, k: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.clip(rng.integers(1, 6, (n, k)) + np.arange(k) // 2, 1, 7).astype(float)


def vendor(name: str):  # type: ignore[no-untyped-def]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(name, reason=f"{name} is in the test extra")


@pytest.mark.filterwarnings("ignore")
def test_pingouin() -> None:
    pingouin = vendor("pingouin")
    values = answers(12, 3)
    ours = friedman(values)
    for method, p in (("chisq", ours.p_chi2), ("f", ours.p_f)):
        theirs = pingouin.friedman(pd.DataFrame(values), method=method).iloc[0]
        assert (theirs["W"], theirs["p_unc"]) == pytest.approx((ours.effect, p))
    pair = signed_rank_test(values[:, 2], values[:, 0])
    assert pingouin.wilcoxon(values[:, 2], values[:, 0])["RBC"].iloc[0] == pytest.approx(pair.effect)
    equal = tost(values[:, 1] - values[:, 0], 1.0)
    assert pingouin.tost(values[:, 1], values[:, 0], bound=1.0, paired=True)["pval"].iloc[0] == pytest.approx(equal.p)


@pytest.mark.filterwarnings("ignore")
def test_statsmodels() -> None:
    multiple = vendor("statsmodels.stats.multitest")
    ps = [0.001, 0.04, 0.03, 0.2, 0.011]
    assert holm(ps) == pytest.approx(multiple.multipletests(ps, method="holm")[1])
    assert false_discovery(ps) == pytest.approx(multiple.multipletests(ps, method="fdr_bh")[1])
    table = [[12, 3, 1], [2, 9, 4], [0, 5, 11]]
    assert vendor("statsmodels.stats.inter_rater").cohens_kappa(table).kappa == pytest.approx(float(kappa(table)))
    values = answers(14, 3, seed=2)
    p, (t_lower, p_lower, _), (t_upper, p_upper, _) = vendor("statsmodels.stats.weightstats").ttost_paired(
        values[:, 1], values[:, 0], -1.0, 1.0
    )
    equal = tost(values[:, 1] - values[:, 0], 1.0)
    numbers = (equal.p, equal.t_lower, equal.p_lower, equal.t_upper, equal.p_upper)
    assert numbers == pytest.approx((p, t_lower, p_lower, t_upper, p_upper))


@pytest.mark.filterwarnings("ignore")
def test_statsmodels_models() -> None:
    models = vendor("statsmodels.regression.mixed_linear_model")
    draw, delays = np.random.default_rng(5), np.linspace(0.0, 2.0, 7)
    values = 4 + draw.normal(0, 1, (30, 1)) + draw.normal(0.3, 0.8, (30, 1)) * delays + draw.normal(0, 0.6, (30, 7))
    design = np.tile(np.column_stack([np.ones(7), delays]), (30, 1))
    theirs = models.MixedLM(values.ravel(), design, np.repeat(np.arange(30), 7), exog_re=design).fit(reml=True)
    ours = slope_test(values, delays[:, None])
    assert ours.effect == pytest.approx(theirs.params[1], abs=1e-5)
    assert ours.statistic == pytest.approx(theirs.tvalues[1], rel=1e-3)
    assert ours.p == pytest.approx(2 * student.sf(abs(theirs.tvalues[1]), 29), rel=1e-2)  # theirs is normal: too small


def test_two_settings_are_students_and_several_hotellings() -> None:
    values = answers(12, 3, seed=9).astype(float)
    both = slope_test(values[:, :2])
    assert (both.statistic, both.p) == pytest.approx(tuple(ttest_rel(values[:, 1], values[:, 0])))
    away = values[:, 1:] - values[:, :1]
    t2 = 12 * away.mean(axis=0) @ np.linalg.inv(np.cov(away.T)) @ away.mean(axis=0)
    assert slope_test(values).p == pytest.approx(variance_ratio.sf(t2 * 10 / (2 * 11), 2, 10))
    assert slope_test(values[:, ::-1]).p == pytest.approx(slope_test(values).p)  # whichever setting is the first


def test_individual_slopes_without_a_common_slope_are_not_a_trend() -> None:
    """A model with only random intercepts finds a trend in half of such studies."""
    draw, delays = np.random.default_rng(3), np.arange(7.0)
    own = draw.normal(size=(2000, 12, 1)) * delays + draw.normal(size=(2000, 12, 7))
    are_shown = [(result.p or 1.0) <= 0.05 for result in (slope_test(study, delays[:, None]) for study in own)]
    assert sum(are_shown) <= binom.ppf(0.999, 2000, 0.05)


def test_the_trend_is_scipys() -> None:
    from scipy.stats import page_trend_test, permutation_test, spearmanr

    values = answers(8, 5, seed=6)
    theirs, ours = page_trend_test(values, method="exact"), trend(values)
    assert ours.statistic == pytest.approx(theirs.statistic)
    assert ours.p_page is not None
    assert ours.p_page < theirs.pvalue  # ties as they are, not the larger p of ranks that all differ
    untied = np.argsort(np.random.default_rng(1).random((8, 5)), axis=1)
    assert trend(untied).p_page == pytest.approx(page_trend_test(untied, method="exact").pvalue)
    slopes = untied @ np.arange(5.0) - 10 * 2
    flips = permutation_test((slopes,), np.sum, permutation_type="samples", alternative="greater", n_resamples=np.inf)
    assert trend(untied).p == pytest.approx(flips.pvalue)
    assert trend(untied).effect == pytest.approx(np.mean([spearmanr(row, range(5)).statistic for row in untied]))


@pytest.mark.parametrize("spread", [0.0, 0.02, 0.1])
def test_mean_variance_and_interval_are_those_of_statsmodels(spread):
    meta = pytest.importorskip("statsmodels.stats.meta_analysis")
    draw = np.random.default_rng(5)
    variances = draw.uniform(0.01, 0.2, 9)
    estimates = 1.3 + draw.normal(0, np.sqrt(variances + spread))
    mean = group_mean(estimates, variances)
    weights = np.sqrt(variances * np.median(variances))
    theirs = meta.combine_effects(estimates, weights, method_re="iterated", use_t=True)
    assert mean.between == pytest.approx(max(theirs.tau2, 0.0), abs=1e-6)
    assert mean.mean == pytest.approx(theirs.mean_effect_re, abs=1e-6)
    low, high = theirs.conf_int()[3]  # random effects, Hartung–Knapp
    assert (mean.low, mean.high) == pytest.approx((low, high), abs=1e-5)


@pytest.mark.parametrize(("people", "shared"), [(3, 0.0), (5, 0.0), (5, 0.02), (10, 0.0), (20, 0.0), (20, 0.02)])
def test_intervals_cover_the_mean(people, shared):
    draw, covered = np.random.default_rng(people), 0
    for _ in range(1000):
        variances = draw.uniform(0.02, 0.1, people)
        common = draw.normal(0, np.sqrt(shared))
        half = 1.959964 * math.sqrt(shared)
        mean = group_mean(draw.normal(common, np.sqrt(variances + 0.05)), variances, (half, half))
        assert mean.low is not None
        assert mean.high is not None
        covered += mean.low <= 0 <= mean.high
    assert covered / 1000 == pytest.approx(0.95, abs=0.025)


def test_estimates_that_seem_precise_because_they_are_too_high_move_the_mean_little():
    """As those of wide functions; weights of 1/variance give 0.071, and intervals that hold in 86 %."""
    draw, means = np.random.default_rng(3), []
    for _ in range(600):
        errors = draw.normal(0.0, 0.25, 10)
        means.append(group_mean(errors, 0.25**2 * np.exp(-0.4 * errors / 0.25)))
    assert 0.0 < np.mean([mean.mean for mean in means]) < 0.05
    assert np.mean([(mean.low or 0.0) <= 0.0 <= (mean.high or 0.0) for mean in means]) > 0.92
