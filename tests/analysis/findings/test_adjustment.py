"""The note below a table of tests says how p was adjusted."""

from types import SimpleNamespace
from typing import Any

import pytest

from study_app.analysis.findings import statement_tests


@pytest.mark.parametrize(
    ("members", "p", "p_adjusted", "note"),
    [
        (1, 0.03, 0.03, "p not adjusted"),
        (1, 0.03, 0.41, "adjusted p: that of the test over all statements, which is larger than p"),
        (1, None, None, "p not adjusted"),
        (3, 0.03, 0.09, "p adjusted (Holm) across 3 tests"),
    ],
)
def test_a_p_value_raised_by_the_test_over_all_statements_is_not_called_unadjusted(
    members: int, p: float | None, p_adjusted: float | None, note: str
) -> None:
    test: Any = SimpleNamespace(members=members, correction="Holm", p_adjusted=p_adjusted, outcome=SimpleNamespace(p=p))
    assert statement_tests._adjustment(test) == note
