import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.analysis.statistics import skillings_mack as missing
from study_app.analysis.statistics.friedman import friedman
from study_app.analysis.statistics.skillings_mack import skillings_mack
from study_app.errors import AnalysisError

NA = float("nan")

# Skillings & Mack (1981), table 1 (R package Skillings.Mack).
ASSEMBLY = np.array(
    [
        [3.2, 4.1, 3.8, 4.2],
        [3.1, 3.9, 3.4, 4.0],
        [4.3, 3.5, 4.6, 4.8],
        [3.5, 3.6, 3.9, 4.0],
        [3.6, 4.2, 3.7, 3.9],
        [4.5, 4.7, 3.7, NA],
        [NA, 4.2, 3.4, NA],
        [4.3, 4.6, 4.4, 4.9],
        [3.5, NA, 3.7, 3.9],
    ]
)


def test_published_assembly_times() -> None:
    result = skillings_mack(ASSEMBLY)
    assert result.statistic == pytest.approx(15.49305, abs=1e-5)
    assert (result.df, result.n, result.dropped, result.missing) == (3, 9, 0, 4)
    assert result.p_chi2 == pytest.approx(0.0014403, abs=1e-7)
    assert result.adjusted_sums == pytest.approx((-14.1256, 4.2812, -4.2812, 14.1256), abs=5e-5)
    assert result.p is not None
    assert result.p < 0.0015


@pytest.mark.slow
@given(st.integers(3, 5), st.integers(2, 8), st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_without_missing_answers_and_ties_it_is_friedmans(k: int, n: int, seed: int) -> None:
    values = np.random.default_rng(seed).random((n, k))
    result, whole = skillings_mack(values, draws=99), friedman(values, draws=99)
    assert (result.statistic, result.effect) == pytest.approx((whole.statistic, whole.effect))
    assert (result.df, result.p_chi2) == (whole.df, pytest.approx(whole.p_chi2))


def test_the_drawn_p_takes_ties_as_they_are() -> None:
    rows = [[2, 5, 6], [3, 3, 6], [1, 4, 4], [4, 5, 7], [2, 2, 5]]
    assert skillings_mack(rows).p == pytest.approx(48 / 7776, abs=0.003)


def test_nothing_to_compare_is_said_and_never_nan() -> None:
    flat = skillings_mack(np.full((4, 3), 4.0))
    assert (flat.statistic, flat.p, flat.p_chi2, flat.effect) == (None, None, None, None)
    assert flat.note.startswith("no variation")
    empty = skillings_mack([[1, NA, NA]])
    assert (empty.n, empty.note) == (0, "no participant answered under two settings")
    with pytest.raises(AnalysisError, match="at least 3"):
        skillings_mack(ASSEMBLY[:, :2])


@pytest.mark.slow
def test_many_people_are_approximated_with_their_ties(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    values = rng.integers(3, 6, (250, 4)).astype(float)  # three levels: many ties
    whole, ours = friedman(values), skillings_mack(values)
    assert "chi-square approximation, corrected for ties" in ours.method
    assert ours.smallest_p is None
    assert ours.p == pytest.approx(whole.p_chi2)  # without gaps it is Friedman's, ties and all
    assert ours.p_chi2 is not None
    assert whole.p_chi2 is not None
    assert ours.p_chi2 > whole.p_chi2  # the published one takes no ties into account
    values[rng.random(values.shape) < 0.1] = NA
    drawn = skillings_mack(values[:150])
    monkeypatch.setattr(missing, "DRAWN_UP_TO", 100)
    near = skillings_mack(values[:150])
    assert "Monte Carlo" in drawn.method
    assert "approximation" in near.method
    assert near.p == pytest.approx(drawn.p, abs=0.02)
