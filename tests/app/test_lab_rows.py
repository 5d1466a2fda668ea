"""What a setting costs and how true it is, as the lab says it."""

import pytest

from study_app.app.lab_rows import error_rows
from study_app.evaluation.appraisal import Errors


@pytest.mark.parametrize(("lag_s", "shown"), [(-1e-9, "0.0 ms"), (0.0, "0.0 ms"), (0.0094, "9.4 ms")])
def test_a_lag_that_rounds_to_zero_has_no_sign(lag_s: float, shown: str) -> None:
    assert error_rows(Errors(None, None, lag_s, ()))[-1].value == shown
