"""The random-effects mean of estimates that are known with variances of their own, against statsmodels."""

import numpy as np
import pytest

from study_app.analysis.statistics.random_effects import group_mean

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("spread", [0.0, 0.02, 0.1])
def test_mean_variance_and_interval_are_those_of_statsmodels(spread):
    meta = pytest.importorskip("statsmodels.stats.meta_analysis")
    draw = np.random.default_rng(5)
    variances = draw.uniform(0.01, 0.2, 9)
    estimates = 1.3 + draw.normal(0, np.sqrt(variances + spread))
    found = group_mean(estimates, variances)
    theirs = meta.combine_effects(estimates, variances, method_re="iterated", use_t=True)
    assert found.between == pytest.approx(max(theirs.tau2, 0.0), abs=1e-6)
    assert found.mean == pytest.approx(theirs.mean_effect_re, abs=1e-6)
    low, high = theirs.conf_int()[3]  # random effects, Hartung–Knapp
    assert (found.low, found.high) == pytest.approx((low, high), abs=1e-5)


def test_few_estimates_have_a_mean_and_no_interval():
    one, two = group_mean([0.3], [0.1]), group_mean([0.2, 0.6], [0.1, 0.1])
    assert (one.n, one.mean, one.low) == (1, pytest.approx(0.3), None)
    assert (two.n, two.mean, two.high) == (2, pytest.approx(0.4), None)
    with pytest.raises(ValueError, match="needs an estimate"):
        group_mean([], [])


@pytest.mark.parametrize("people", [3, 5, 10, 20])
def test_intervals_cover_the_mean(people):
    draw, covered = np.random.default_rng(people), 0
    for _ in range(1000):
        variances = draw.uniform(0.02, 0.1, people)
        found = group_mean(draw.normal(0, np.sqrt(variances + 0.05)), variances)
        assert found.low is not None
        assert found.high is not None
        covered += found.low <= 0 <= found.high
    assert covered / 1000 == pytest.approx(0.95, abs=0.025)
