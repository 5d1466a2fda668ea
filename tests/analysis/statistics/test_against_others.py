"""Our numbers beside those of pingouin, statsmodels, scikit-posthocs and psignifit, on the same answers."""

import warnings

import numpy as np
import pandas as pd
import pytest

from study_app.analysis.statistics.agreement import kappa
from study_app.analysis.statistics.equivalence.tost import tost
from study_app.analysis.statistics.friedman import friedman
from study_app.analysis.statistics.multiple_comparisons import false_discovery, holm
from study_app.analysis.statistics.ordinal import ordinal
from study_app.analysis.statistics.paired import paired
from study_app.analysis.statistics.psychometrics.threshold import threshold
from study_app.analysis.statistics.trend import page

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
    pair = paired(values[:, 2], values[:, 0])
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
    theirs, ours = vendor("statsmodels.stats.inter_rater").cohens_kappa(table), kappa(table)
    assert ours.interval is not None
    assert (theirs.kappa, theirs.kappa_low, theirs.kappa_upp) == pytest.approx(
        (ours.kappa, ours.interval.low, ours.interval.high)
    )
    values = answers(14, 3, seed=2)
    p, (t_lower, p_lower, _), (t_upper, p_upper, _) = vendor("statsmodels.stats.weightstats").ttost_paired(
        values[:, 1], values[:, 0], -1.0, 1.0
    )
    equal = tost(values[:, 1] - values[:, 0], 1.0)
    found = (equal.p, equal.t_lower, equal.p_lower, equal.t_upper, equal.p_upper)
    assert found == pytest.approx((p, t_lower, p_lower, t_upper, p_upper))


@pytest.mark.filterwarnings("ignore")
def test_statsmodels_models() -> None:
    ordered = vendor("statsmodels.miscmodels.ordinal_model")
    values = answers(30, 3, seed=5)
    design = np.tile(np.eye(3)[:, 1:], (30, 1))
    theirs = ordered.OrderedModel(values.ravel(), design, distr="logit").fit(method="bfgs", disp=False, gtol=1e-8)
    ours = ordinal(values, intercepts=False)
    assert ours.log_likelihood == pytest.approx(theirs.llf, abs=1e-7)
    assert [one.estimate for one in ours.coefficients] == pytest.approx(theirs.params[:2], abs=1e-5)
    assert [one.error for one in ours.coefficients] == pytest.approx(theirs.bse[:2], rel=1e-4)
    api = vendor("statsmodels.api")
    delays, yes = np.array([0.0, 50, 100, 150, 200, 300]), np.array([1, 2, 5, 9, 15, 19])
    binomial = api.GLM(np.c_[yes, 20 - yes], np.c_[np.ones(6), delays], family=api.families.Binomial()).fit()
    fitted = threshold(delays, yes, np.full(6, 20), guess=0.0, lapse=0.0)
    assert fitted.effect == pytest.approx(-binomial.params[0] / binomial.params[1], rel=1e-5)
    assert fitted.statistic == pytest.approx(binomial.deviance, rel=1e-6)


def test_scipy_page_is_our_untied_p() -> None:
    from scipy.stats import page_trend_test

    values = answers(8, 5, seed=6)
    theirs, ours = page_trend_test(values, method="exact"), page(values)
    assert (ours.statistic, ours.p_untied) == pytest.approx((theirs.statistic, theirs.pvalue))
    assert ours.p is not None
    assert ours.p < theirs.pvalue  # ties as they are, not the larger p of ranks that all differ
