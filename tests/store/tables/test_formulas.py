import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.store.tables.formulas import guarded, unguarded


@given(st.text(alphabet="'=+-@\t\r a1＝", max_size=6) | st.text())
@pytest.mark.slow
def test_every_text_reads_back_unchanged(text: str) -> None:
    assert unguarded(guarded(text)) == text


@pytest.mark.parametrize("text", ['=HYPERLINK("http://x")', "+1", "-2", "@SUM(1)", "\t=1", "\r=1", "＝1", "'=1"])
def test_a_formula_has_an_apostrophe_before_it(text: str) -> None:
    assert guarded(text) == "'" + text


@pytest.mark.parametrize("text", ["", "tired", "a = b", "'quoted'", "3-4", "n/a"])
def test_other_texts_stay(text: str) -> None:
    assert guarded(text) == unguarded(text) == text
