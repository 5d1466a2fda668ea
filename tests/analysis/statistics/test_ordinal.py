import numpy as np
import pytest
from scipy.stats import chi2

from study_app.analysis.statistics.mixed_model import Answers, fit, log_likelihood, ordinal
from study_app.errors import AnalysisError

pytestmark = pytest.mark.slow

# Bitterness of wine (Randall 1989; R, ordinal): nine judges; bottles 1-4 cold, 5-8 warm; 3, 4, 7, 8 with contact.
JUDGES = "23344455 12132354 23325544 32323253 23433333 32322454 11222323 22233334 12323244"
WINE = np.array([[int(digit) for digit in judge] for judge in JUDGES.split()])
BOTTLES = np.array([[0, 0], [0, 0], [0, 1], [0, 1], [1, 0], [1, 0], [1, 1], [1, 1]])
WITHIN = Answers(WINE.ravel() - 1, np.tile(BOTTLES, (9, 1)).astype(float), np.arange(0, 72, 8))

LAPLACE = np.array([-1.623667, 1.513365, 4.228527, 6.088773, 3.062997, 1.834885, 1.131133])


def made_up(n: int, seed: int = 0, effect: float = 2.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    latent = rng.logistic(size=(n, 3)) + rng.normal(size=(n, 1)) + effect * np.array([0, 0.5, 1])
    return np.digitize(latent, [-2, -1, 0, 1, 2, 3]) + 1.0


def test_published_model_without_judges() -> None:
    result = ordinal(WINE, BOTTLES, intercepts=False)
    temperature, contact = result.coefficients
    assert (temperature.estimate, contact.estimate) == pytest.approx((2.5031, 1.5278), abs=5e-5)
    assert (temperature.error, contact.error) == pytest.approx((0.5287, 0.4766), abs=5e-5)
    assert result.thresholds == pytest.approx((-1.3444, 1.2508, 3.4669, 5.0064), abs=5e-5)
    assert result.threshold_errors == pytest.approx((0.5171, 0.4379, 0.5978, 0.7309), abs=5e-5)
    assert result.log_likelihood == pytest.approx(-86.491923, abs=1e-6)
    assert result.aic == pytest.approx(184.98, abs=0.005)
    assert temperature.interval is not None
    assert (temperature.interval.low, temperature.interval.high) == pytest.approx((1.4669, 3.5393), abs=5e-5)


def test_published_likelihood_ratio_of_contact() -> None:
    both = ordinal(WINE, BOTTLES, intercepts=False)
    cold = ordinal(WINE, BOTTLES[:, :1], intercepts=False)
    assert both.log_likelihood is not None
    assert cold.log_likelihood is not None
    assert 2 * (both.log_likelihood - cold.log_likelihood) == pytest.approx(11.043, abs=5e-4)
    assert chi2.sf(2 * (both.log_likelihood - cold.log_likelihood), 1) == pytest.approx(0.00089, abs=5e-6)
    # The test of the function: both columns against none, by the two ratios one after the other.
    assert both.statistic == pytest.approx(11.043 + (cold.statistic or 0.0), abs=5e-4)
    assert both.df == 2


def test_published_quadrature_with_judges() -> None:
    model = fit(WITHIN, nodes=10)
    assert model.effects == pytest.approx([3.06190, 1.83343], abs=2e-5)
    assert model.thresholds == pytest.approx([-1.62349, 1.51279, 4.22705, 6.08615], abs=2e-5)
    assert model.sd**2 == pytest.approx(1.28774, abs=5e-5)
    assert model.log_likelihood == pytest.approx(-81.53247, abs=2e-5)
    assert model.errors is not None
    published = [0.68339, 0.60444, 0.80898, 0.97194, 0.59508, 0.51217]
    assert model.errors[:6] == pytest.approx(published, abs=2e-5)
    # R's own errors beside its Laplace estimates.
    assert model.errors[:6] == pytest.approx([0.682, 0.604, 0.809, 0.972, 0.595, 0.513], abs=0.002)


def test_published_laplace_estimates_are_the_maximum_of_one_node() -> None:
    best, _ = log_likelihood(LAPLACE, WITHIN, nodes=1)
    assert best == pytest.approx(-81.56541, abs=5e-6)
    assert (-2 * best + 2 * 7, -2 * best + 7 * np.log(72)) == pytest.approx((177, 193), abs=0.5)  # AIC, BIC
    assert LAPLACE[-1] ** 2 == pytest.approx(1.279461, abs=2e-6)
    for place in range(len(LAPLACE)):
        for step in (-0.01, 0.01):
            moved = LAPLACE + step * (np.arange(len(LAPLACE)) == place)
            assert log_likelihood(moved, WITHIN, nodes=1)[0] < best


def test_the_gradient_is_that_of_the_likelihood() -> None:
    at = np.array([-1.6, 1.5, 4.2, 6.0, 3.0, 1.8, 1.1])
    for answers, values in ((WITHIN, at), (Answers(WITHIN.level, WITHIN.design, None), at[:-1])):
        steps = 1e-5 * np.eye(len(values))
        slopes = [
            (log_likelihood(values + step, answers, 20)[0] - log_likelihood(values - step, answers, 20)[0]) / 2e-5
            for step in steps
        ]
        assert log_likelihood(values, answers, 20)[1] == pytest.approx(slopes, abs=1e-5)


def test_the_quadrature_is_the_integral() -> None:
    u = np.linspace(-9, 9, 3001)
    eta = (WITHIN.design @ LAPLACE[4:6])[:, None] + LAPLACE[6] * u
    ends = np.concatenate([[-np.inf], LAPLACE[:4], [np.inf]])
    up, low = ends[WITHIN.level + 1][:, None] - eta, ends[WITHIN.level][:, None] - eta
    chances = 1 / (1 + np.exp(-up)) - 1 / (1 + np.exp(-low))
    each = chances.reshape(9, 8, -1).prod(axis=1) * np.exp(-(u**2) / 2) / np.sqrt(2 * np.pi)
    slow = np.log(each.sum(axis=1) * (u[1] - u[0])).sum()
    assert log_likelihood(LAPLACE, WITHIN, 10)[0] == pytest.approx(slow, abs=1e-4)
    assert log_likelihood(LAPLACE, WITHIN, 30)[0] == pytest.approx(slow, abs=1e-8)


def test_one_column_has_an_effect_and_an_interval() -> None:
    values = made_up(20, seed=3)
    result = ordinal(values, [[0], [0.5], [1]])
    assert result.effect == result.coefficients[0].estimate
    assert result.interval == result.coefficients[0].interval
    assert result.df == 1
    half = ordinal(values, [[0], [1], [2]])
    assert half.effect == pytest.approx((result.effect or 0.0) / 2, rel=1e-4)
    assert half.p == pytest.approx(result.p, rel=1e-4)
    assert len(ordinal(values).coefficients) == 2
    assert "one coefficient for each setting" in ordinal(values).no_interval


def test_the_order_of_people_changes_nothing_and_missing_answers_are_left_out() -> None:
    values = made_up(15, seed=4)
    values[3, 1] = values[5, 0] = np.nan
    values[9] = np.nan
    result = ordinal(values)
    assert (result.n, result.dropped, result.answers, result.missing) == (14, 1, 40, 2)
    assert ordinal(values[::-1]).statistic == pytest.approx(result.statistic, abs=1e-6)


def test_few_people_have_no_mixed_model() -> None:
    result = ordinal(made_up(9))
    assert (result.p, result.effect, result.coefficients, result.n) == (None, None, (), 9)
    assert "below 10 participants" in result.note


@pytest.mark.parametrize(
    ("values", "note"),
    [
        (np.full((12, 3), 4), "no variation"),
        (np.full((12, 3), np.nan), "no participant answered"),
        (np.tile([1, 4, 7], (12, 1)), "separate the answers"),
        (np.tile([1, 4, np.nan], (12, 1)), "not answered by anybody"),
    ],
)
def test_answers_without_an_estimate_are_told(values: np.ndarray, note: str) -> None:
    result = ordinal(values)
    assert (result.p, result.statistic, result.effect) == (None, None, None)
    assert note in result.note


@pytest.mark.parametrize("columns", [[[0], [1]], [[1], [1], [1]], [[0, 0], [1, 2], [2, 4]], [[0], [1], [np.nan]]])
def test_columns_that_do_not_distinguish_settings_are_refused(columns: list[list[float]]) -> None:
    with pytest.raises(AnalysisError, match="do not distinguish 3 settings"):
        ordinal(made_up(12), columns)


def test_single_answers_of_several_presentations_are_those_of_as_many_columns() -> None:
    """The wine's two bottles of each kind are presentations of one setting."""
    rng = np.random.default_rng(4)
    values = np.vstack([WINE, rng.integers(1, 6, (3, 8))]).astype(float)
    flat = ordinal(values, BOTTLES)
    paired = ordinal(values.reshape(12, 4, 2), BOTTLES[::2])
    assert paired.p == pytest.approx(flat.p)
    assert [one.estimate for one in paired.coefficients] == pytest.approx([one.estimate for one in flat.coefficients])
    assert (paired.answers, paired.missing) == (96, 0)
    assert all(float(level).is_integer() for level in paired.levels)


def test_sessions_are_a_factor_that_takes_their_difference_from_the_settings() -> None:
    """Everybody answers higher in the second session, in which the last setting came more often."""
    rng = np.random.default_rng(6)
    sessions = np.ones((16, 2, 4))
    sessions[:, 0, 3], sessions[:, 1, 1:] = 2, 2
    latent = 3 + rng.normal(0, 0.5, (16, 1, 1)) + rng.normal(0, 0.7, sessions.shape) + 1.5 * (sessions - 1)
    values = np.clip(np.rint(latent), 1, 7)
    pooled, separate = ordinal(values), ordinal(values, sessions=sessions)
    assert pooled.p is not None
    assert separate.p is not None
    assert pooled.p < 0.01 < separate.p
    assert len(separate.coefficients) == 1
    assert "sessions as a factor" in separate.method
    # Each setting in a session of its own: their effects cannot be separated.
    own = np.ones(values.shape) + np.arange(2)[:, None]
    assert ordinal(values, sessions=own).p == pytest.approx(pooled.p)
