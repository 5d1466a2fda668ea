"""The posterior over a grid: priors, counts, quantiles."""

import itertools
import math

import numpy as np
import pytest

from study_app.psychophysics.families import CLIP, success
from study_app.psychophysics.grid import FREE_GUESSES, Grid, evenly, geometric, quantile

LEVELS = evenly(-1.5, 0.0, 6)


def grid(**changed):
    parts = {
        "family": "weibull",
        "thresholds": evenly(-1.5, 0.0, 11),
        "widths": geometric(0.5, 4.0, 5),
        "width_prior": (1.4, 1.5),
        "lapses": (0.0, 0.02, 0.04),
        "lapse_prior": (0.4, 0.4, 0.2),
        "guesses": (0.5,),
    }
    return Grid(**(parts | changed))


def test_the_prior_is_flat_in_the_threshold_log_normal_in_the_width_and_listed_for_the_lapse_rate():
    one = grid()
    assert one.prior.sum() == pytest.approx(1.0)
    assert one.prior.sum(axis=(1, 2, 3)) == pytest.approx(1 / 11)
    assert one.prior.sum(axis=(0, 1, 3)) == pytest.approx([0.4, 0.4, 0.2])
    widths = one.prior.sum(axis=(0, 2, 3))
    z = np.log(np.array(one.widths) / 1.4) / math.log(1.5)
    assert widths / widths.max() == pytest.approx(np.exp(-(z**2) / 2) / np.exp(-(z**2) / 2).max())
    assert grid(width_prior=None).prior.sum(axis=(0, 2, 3)) == pytest.approx(1 / 5)


@pytest.mark.parametrize("guesses", [(0.5,), None, FREE_GUESSES])
def test_the_posterior_is_the_product_of_prior_and_likelihood_of_each_cell(guesses):
    one = grid(guesses=guesses)
    successes, failures = [1, 0, 3, 4, 9, 10], [3, 2, 2, 1, 1, 0]
    by_hand = np.empty(one.shape)
    for t, w, lapse, g in itertools.product(*map(range, one.shape)):
        rates = (one.lapses[lapse], one.lapses[lapse]) if guesses is None else (guesses[g], one.lapses[lapse])
        likelihood = 1.0
        for level, yes, no in zip(LEVELS, successes, failures, strict=True):
            p = success("weibull", level, one.thresholds[t], one.widths[w], *rates).clip(CLIP, 1 - CLIP)
            likelihood *= p**yes * (1 - p) ** no
        by_hand[t, w, lapse, g] = likelihood * one.prior[t, w, lapse, g]
    assert one.posterior(LEVELS, successes, failures) == pytest.approx(by_hand / by_hand.sum(), rel=1e-9)


def test_many_answers_find_the_planted_function():
    one = grid(thresholds=evenly(-1.5, 0.0, 61), widths=geometric(0.5, 4.0, 9))
    levels = evenly(-1.5, 0.0, 15)
    p = success("weibull", levels, -0.7, one.widths[4], 0.5, 0.02)
    weights = one.posterior(levels, 1e4 * p, 1e4 * (1 - p))
    marginal = weights.sum(axis=(1, 2, 3))
    assert quantile(one.thresholds, marginal, 0.5) == pytest.approx(-0.7, abs=0.01)
    assert weights.sum(axis=(0, 2, 3)).argmax() == 4
    assert weights.sum(axis=(0, 1, 3)).argmax() == 1


def test_one_answer_excludes_no_cell():
    certain = grid(guesses=(0.0,), lapses=(0.0,), lapse_prior=(1.0,), widths=(0.01, 0.02))
    weights = certain.posterior((-5.0, 5.0), (1, 0), (0, 1))
    assert np.isfinite(weights).all()
    assert weights.sum() == pytest.approx(1.0)


def test_quantiles_are_interpolated_between_the_edges_of_the_cells():
    centres, weights = (0.0, 1.0, 2.0, 3.0), (0.1, 0.4, 0.4, 0.1)
    assert quantile(centres, weights, 0.5) == pytest.approx(1.5)
    assert quantile(centres, weights, 0.3) == pytest.approx(1.0)
    assert quantile(centres, weights, 0.0) == pytest.approx(-0.5)
    assert quantile(centres, weights, 1.0) == pytest.approx(3.5)
