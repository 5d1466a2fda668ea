"""What was decided before the first session, read from receipts, and what it makes primary."""

from typing import Any

import pytest

from study_app.analysis.tables import planned_analysis
from study_app.analysis.tables.study_tables import load_study
from study_app.errors import AnalysisError
from tests.analysis.conftest import Results, twelve

TABLE: dict[str, Any] = {
    "alpha": 0.01,
    "equivalence_bound": 0.5,
    "primary": ["a"],
    "names": [],
    "rising": ["a"],
    "falling": ["b"],
    "noticed": None,
}


def test_a_table_binds_and_its_absence_or_change_does_not() -> None:
    one = planned_analysis.read([TABLE, TABLE])
    assert (one.binding, one.alpha, one.equivalence_bound) == (True, 0.01, 0.5)
    assert [one.is_primary(item) for item in "ab"] == [True, False]
    assert [one.direction(item) for item in "abc"] == ["increasing", "decreasing", None]
    assert planned_analysis.read([{**TABLE, "primary": []}]).is_primary("b")
    for tables in ([None], [None, TABLE], [TABLE, None], [TABLE, {**TABLE, "alpha": 0.05}]):
        assert not planned_analysis.read(tables).binding
        assert not planned_analysis.read(tables).is_primary("a")


def test_a_receipt_that_does_not_say_it_is_refused() -> None:
    with pytest.raises(AnalysisError, match="a receipt does not say what was decided"):
        planned_analysis.read([{"alpha": 0.05}])


@pytest.mark.slow
def test_the_key_holds_which_statement_is_right_for_which_liquid(rek: Results) -> None:
    twelve(rek, people=1)
    study = load_study(rek.folder)
    assert study.decided.names == ("like_honey", "like_water", "like_slime", "like_oil", "like_tar")
    assert {setting.label for block in study.blocks for setting in block.settings} == {None}
    rek.open()
    (liquids, delays) = load_study(rek.folder).blocks
    assert [setting.label for setting in liquids.settings] == ["like_water", "like_honey", "like_oil"]
    assert {setting.label for setting in delays.settings} == {None}
