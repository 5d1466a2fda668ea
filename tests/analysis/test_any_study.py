"""Whatever a study is like, its evaluation and its texts end without an exception, and hold no NaN."""

import pytest

from tests.analysis.random_studies import check

pytestmark = pytest.mark.slow

STUDIES = 12
"""tests/benchmarks/analysis/random_studies.py checks 2,000."""


@pytest.mark.variants(6)
@pytest.mark.parametrize("number", range(STUDIES))
def test_no_exception_leaves_the_evaluation_of_any_study(number: int) -> None:
    check(number)
