"""Cumulative mixed models: published estimates, an independent likelihood, incomplete people, and error rates."""

import math

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy import stats

from study_app.analysis.statistics.cumulative_models import cumulative_model
from study_app.errors import AnalysisError
from tests.analysis.oracle.cumulative import fitted

DELAYS = np.array([[0.0], [0.4], [0.8], [1.2], [1.6], [2.0], [2.4]])


def random_answers(
    seed: int, *, people: int = 14, effect: float = 0.0, slope_sd: float = 0.0, k: int = 7
) -> NDArray[np.float64]:
    """Return two answers of each participant at each of the first ``k`` delays; participants differ."""
    rng = np.random.default_rng(seed)
    slopes = effect + slope_sd * rng.normal(size=(people, 1))
    at = 1.2 * rng.normal(size=(people, 1)) + slopes * DELAYS[:k, 0]
    return 1.0 + (at[..., None, None] + rng.logistic(size=(people, k, 2, 1)) > np.linspace(-3, 3, 6)).sum(axis=-1)


def rows_of(values: NDArray[np.float64]) -> pd.DataFrame:
    person, place, number = np.nonzero(~np.isnan(values))
    return pd.DataFrame({"participant": person, "place": place, "response": values[person, place, number]})


RANDALL_1989 = "23344455 12132354 23325544 32323253 23433333 32322454 11222323 22233334 12323244"
"""Bitterness of wines by nine judges: cold and warm, each without and with contact, two bottles of each."""


def test_published_estimates_of_the_wine_data() -> None:
    """Estimates by Christensen in the tutorial of the R package ordinal, with ten quadrature points."""
    ratings = [int(digit) for digit in RANDALL_1989.replace(" ", "")]
    wine = cumulative_model(np.reshape(ratings, (9, 4, 2)), [[0, 0], [0, 1], [1, 0], [1, 1]])
    assert wine.log_odds_ratios == pytest.approx((3.0619, 1.8334), abs=5e-4)
    assert wine.thresholds == pytest.approx((-1.6235, 1.5128, 4.2271, 6.0862), abs=1e-3)
    assert wine.sds == pytest.approx((math.sqrt(1.2877),), abs=1e-3)
    assert wine.log_likelihood == pytest.approx(-81.53, abs=5e-3)
    errors = [(ends.high - ends.low) / 2 / stats.t.ppf(0.975, 8) for ends in wine.intervals]
    assert errors == pytest.approx([0.5951, 0.5122], abs=5e-4)
    assert (wine.n, wine.answers, wine.incomplete) == (9, 72, 0)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "over_delay"), [(471, True), (472, False)])
def test_the_model_is_the_maximum_of_an_independent_likelihood(seed: int, over_delay: bool) -> None:
    values = random_answers(seed, effect=0.7, slope_sd=0.6, k=7 if over_delay else 3)
    values[2, 1:], values[5] = np.nan, np.nan
    design = DELAYS if over_delay else np.eye(3)[:, 1:]
    model = cumulative_model(values, DELAYS if over_delay else None, "increasing" if over_delay else None)
    own = fitted(rows_of(values), design, "greater" if over_delay else None, slopes=over_delay)
    for place, value in enumerate(model.log_odds_ratios):
        assert value == pytest.approx(own[f"log_odds_ratios.{place}"], abs=2e-3)
    assert (model.statistic, model.p) == pytest.approx((own["statistic"], own["p"]), abs=5e-3)
    assert (model.n, model.dropped, model.incomplete, model.answers) == (13, 1, 1, (~np.isnan(values)).sum())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1011, 1066])
def test_the_search_does_not_stop_at_a_zero_standard_deviation_below_the_maximum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    levels = np.arange(5.0)[:, None]
    own = 4 + 0.5 * rng.normal(size=(12, 1, 1)) + 0.1 * rng.normal(size=(12, 1, 1)) * levels
    values = np.clip(np.round(own + rng.logistic(size=(12, 5, 2))), 1, 7)
    model = cumulative_model(values, levels)
    oracle = fitted(rows_of(values), levels, None, slopes=True)
    assert (model.statistic, model.p) == pytest.approx((oracle["statistic"], oracle["p"]), abs=5e-3)


def test_sides_are_those_of_the_signed_root() -> None:
    values = random_answers(81, effect=0.5, people=10)
    two, rising, falling = (cumulative_model(values, DELAYS, side) for side in (None, "increasing", "decreasing"))
    assert rising.p == pytest.approx(stats.t.sf(math.sqrt(rising.statistic or 0.0), 9))
    assert rising.p + falling.p == pytest.approx(1.0)
    assert two.p == pytest.approx(2 * rising.p)
    assert two.effect == two.log_odds_ratios[0] > 0


def test_the_order_of_two_conditions_does_not_matter() -> None:
    values = random_answers(17, effect=1.5, slope_sd=2.0, k=3)[:, [0, 2], :1]
    first, swapped = cumulative_model(values), cumulative_model(values[:, ::-1])
    assert first.p == pytest.approx(swapped.p, rel=1e-3)
    assert first.effect == pytest.approx(-swapped.log_odds_ratios[0], abs=1e-3)
    assert len(first.sds) == 1


def test_a_missing_model_has_a_note_with_the_reason() -> None:
    few, same = cumulative_model(random_answers(1, people=7), DELAYS), cumulative_model(np.full((9, 7, 1), 4.0), DELAYS)
    apart = cumulative_model(np.broadcast_to([[[2.0], [6.0]]], (12, 2, 1)))
    assert "fewer than 8 participants" in few.note
    assert "gave the same answer" in same.note
    assert "separate the answers" in apart.note
    own_answers = np.repeat(np.arange(12.0) % 4, 14).reshape(12, 7, 2)
    assert cumulative_model(own_answers, DELAYS).note == apart.note
    assert few.p is same.p is apart.p is None
    with pytest.raises(AnalysisError, match="at least 2"):
        cumulative_model(np.ones((9, 1, 1)))
    with pytest.raises(AnalysisError, match="3 conditions; specify one row for each condition"):
        cumulative_model(np.ones((9, 3, 1)), DELAYS)


@pytest.mark.nightly
@pytest.mark.parametrize("people", [8, 24])
@pytest.mark.parametrize("slope_sd", [0.0, 0.8])
def test_studies_without_an_effect_are_rarely_significant(people: int, slope_sd: float) -> None:
    ps = [
        cumulative_model(random_answers(seed, people=people, slope_sd=slope_sd), DELAYS).p
        for seed in range(9_000, 9_300)
    ]
    assert sum(p is not None and p <= 0.05 for p in ps) <= stats.binom.isf(1e-3, 300, 0.06)


@pytest.mark.nightly
def test_individual_effects_without_a_common_effect_are_rarely_significant() -> None:
    """Three conditions whose effects differ between participants (SD 1.2) but not on average."""
    ps = []
    for seed in range(500, 800):
        rng = np.random.default_rng(seed)
        at = 1.2 * (rng.normal(size=(16, 1)) + rng.normal(size=(16, 3)))
        answers = (at[..., None, None] + rng.logistic(size=(16, 3, 3, 1)) > np.linspace(-3, 3, 6)).sum(axis=-1)
        ps.append(cumulative_model(np.median(answers, axis=2)[..., None]).p)
    assert sum(p is not None and p <= 0.05 for p in ps) <= stats.binom.isf(1e-3, 300, 0.06)
