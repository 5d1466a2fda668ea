"""Psychometric functions: threshold and width mean the same in every family."""

import math

import numpy as np
import pytest

from study_app.psychophysics.families import KAPPA, level_at, position, rise, success

FAMILIES = ("weibull", "normal", "logistic")


@pytest.mark.parametrize("family", FAMILIES)
def test_threshold_is_the_middle_and_the_width_reaches_from_5_to_95_percent(family):
    assert rise(family, -0.7, -0.7, 1.3) == pytest.approx(0.5, abs=1e-12)
    low, high = (-0.7 + 1.3 * position(family, share) for share in (0.05, 0.95))
    assert high - low == pytest.approx(1.3, abs=1e-12)
    assert rise(family, [low, high], -0.7, 1.3) == pytest.approx([0.05, 0.95], abs=1e-12)


@pytest.mark.parametrize("family", FAMILIES)
def test_success_goes_from_guessing_to_lapsing_and_stays_finite(family):
    found = success(family, [-1e6, 1e6], 0.0, 0.5, 0.25, 0.04)
    assert found == pytest.approx([0.25, 0.96], abs=1e-12)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_level_at_a_percentage_is_where_the_function_has_it(family):
    u = level_at(family, 75.0, -0.5, 1.4, 0.5, 0.02)
    assert success(family, u, -0.5, 1.4, 0.5, 0.02) == pytest.approx(0.75, abs=1e-12)
    assert math.isnan(level_at(family, 99.0, -0.5, 1.4, 0.5, 0.02))
    assert math.isnan(level_at(family, 50.0, -0.5, 1.4, 0.5, 0.02))


def test_a_linear_observer_is_a_weibull_of_a_known_width():
    """A difference of ln(1 + w) with normal noise: the Weibull function has the same threshold within 2.4 %."""
    from scipy.optimize import curve_fit
    from scipy.special import ndtr

    w75 = 0.2
    u = np.linspace(math.log10(0.02), math.log10(0.6), 31)
    spread = math.log1p(w75) / 0.6744897501960817
    shown = ndtr(np.log1p(10.0**u) / spread)
    (threshold, width), _ = curve_fit(
        lambda at, middle, wide: success("weibull", at, middle, wide, 0.5, 0.0), u, shown, (-0.7, 1.4)
    )
    assert 10.0**threshold == pytest.approx(w75, rel=0.024)
    assert 1.4 <= width <= 1.7


@pytest.mark.parametrize("family", FAMILIES)
def test_forward_and_inverse_agree_to_rounding_and_are_those_of_scipy(family):
    from scipy import stats

    shares = np.linspace(0.001, 0.999, 201)
    x = np.array([position(family, float(share)) for share in shares])
    assert rise(family, -0.7 + 1.3 * x, -0.7, 1.3) == pytest.approx(shares, abs=1e-12)
    theirs = {
        "weibull": stats.weibull_min.cdf(10 ** (KAPPA * x), 1, scale=1 / math.log(2)),
        "normal": stats.norm.cdf(2 * stats.norm.ppf(0.95) * x),
        "logistic": stats.logistic.cdf(2 * math.log(19) * x),
    }
    assert theirs[family] == pytest.approx(shares, abs=1e-12)
