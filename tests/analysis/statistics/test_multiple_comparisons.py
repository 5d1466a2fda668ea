import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import false_discovery_control

from study_app.analysis.statistics.multiple_comparisons import false_discovery, holm
from study_app.errors import AnalysisError


@pytest.mark.parametrize(
    ("ps", "adjusted"),
    [
        ([0.01, 0.02, 0.03, 0.04, 0.05], [0.05, 0.08, 0.09, 0.09, 0.09]),
        ([0.0004, 0.0095, 0.01, 0.0278, 0.0459, 0.0344], [0.0024, 0.0475, 0.0475, 0.0834, 0.0834, 0.0834]),
    ],
)
def test_published_adjustments(ps: list[float], adjusted: list[float]) -> None:
    assert holm(ps) == pytest.approx(adjusted)


@pytest.mark.slow
@given(st.lists(st.floats(0, 1), min_size=1, max_size=12), st.randoms(use_true_random=False))
def test_holm_keeps_order_and_lies_between_p_and_bonferroni(ps, random) -> None:  # type: ignore[no-untyped-def]
    adjusted = holm(ps)
    assert all(p <= a <= min(1.0, p * len(ps)) + 1e-12 for p, a in zip(ps, adjusted, strict=True) if a is not None)
    order = random.sample(range(len(ps)), len(ps))
    assert holm([ps[place] for place in order]) == pytest.approx([adjusted[place] for place in order])
    assert [adjusted[place] for place in np.argsort(ps, kind="stable")] == sorted(a for a in adjusted if a is not None)


def test_a_test_without_p_stays_without_and_still_counts() -> None:
    assert holm([0.02, None, 0.5]) == (pytest.approx(0.06), None, 1.0)
    assert false_discovery([0.02, None, 0.5]) == (pytest.approx(0.06), None, pytest.approx(0.75))
    assert holm([]) == ()
    assert false_discovery([None]) == (None,)


def test_false_discoveries_are_scipys() -> None:
    ps = [0.01, 0.04, 0.03, 0.5]
    assert false_discovery(ps) == pytest.approx(false_discovery_control(ps))


@pytest.mark.parametrize("p", [-0.1, 1.1, float("nan")])
def test_what_is_no_p_is_refused(p: float) -> None:
    with pytest.raises(AnalysisError, match="cannot be adjusted"):
        holm([p, 0.5])
    with pytest.raises(AnalysisError, match="cannot be adjusted"):
        false_discovery([p])
