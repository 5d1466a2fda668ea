import numpy as np
import pytest

from study_app.analysis.statistics.agreement import kappa
from study_app.analysis.statistics.friedman import friedman
from study_app.errors import AnalysisError

# R package irr, "anxiety": three raters, twenty people.
ANXIETY = ["33345523522615221243", "36462424332333221334", "21443216111233113322"]


def test_published_agreement_of_three_raters() -> None:
    result = friedman([[int(digit) for digit in row] for row in ANXIETY])
    assert result.effect == pytest.approx(0.5396568760, abs=1e-10)
    assert (result.statistic, result.df) == (pytest.approx(30.7604419, abs=1e-7), 19)
    assert result.p_chi2 == pytest.approx(0.0428835, abs=1e-7)


def test_raters_who_agree_or_contradict_each_other() -> None:
    assert friedman([[1, 2, 3, 4]] * 3).effect == pytest.approx(1.0)
    assert friedman([[1, 2, 3], [3, 2, 1]]).effect == pytest.approx(0.0)


def test_published_kappa() -> None:
    result = kappa([[20, 5], [10, 15]])
    assert (result.kappa, result.n) == (pytest.approx(0.4), 50)
    assert (result.agreement, result.expected) == pytest.approx((0.7, 0.5))


def test_kappa_of_nothing_and_of_one_name_is_none() -> None:
    assert kappa(np.zeros((3, 3))).note == "nothing was named"
    one = kappa([[4, 0], [0, 0]])
    assert one.kappa is None
    assert one.note.startswith("no variation")
    perfect = kappa([[4, 0], [0, 3]])
    assert (perfect.kappa, perfect.interval) == (pytest.approx(1.0), None)


@pytest.mark.parametrize("table", [[[1, 2, 3], [1, 2, 3]], [[1, -2], [1, 1]], [[1, np.nan], [1, 1]]])
def test_what_is_no_table_of_counts_is_refused(table: list[list[float]]) -> None:
    with pytest.raises(AnalysisError, match="square table of counts"):
        kappa(table)
