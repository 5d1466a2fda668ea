import csv
import io
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.errors import StoreError
from study_app.store.columns import TRIALS
from study_app.store.csv_files import MISSING, Column, csv_bytes, guard_formula, has_same_cells, header, read_table
from study_app.store.tables.session_tables import SessionRows
from tests.store.tables.test_transcripts import Lines

TEXT = (Column("first", "text", "One."), Column("second", "text", "Two."))


@pytest.mark.slow
@given(texts=st.lists(st.tuples(st.text(st.characters(codec="utf-8")), st.text(st.characters(codec="utf-8")))))
def test_any_text_comes_back_through_the_csv_module(texts: list[tuple[str, str]]) -> None:
    content = csv_bytes(TEXT, [{"first": first, "second": second} for first, second in texts])
    read_back = list(csv.reader(io.StringIO(content.decode("utf-8"), newline="")))
    assert read_back == [
        ["first", "second"],
        *([guard_formula(first), guard_formula(second)] for first, second in texts),
    ]
    kept = [
        {name: None if text == MISSING else text for name, text in zip(header(TEXT), row, strict=True)} for row in texts
    ]
    assert read_table(content, TEXT) == kept


@pytest.mark.parametrize(
    ("value", "cell"),
    [(None, "n/a"), (math.nan, "n/a"), (-math.inf, "n/a"), (True, "true"), (False, "false"), (7, "7")],
)
def test_what_is_not_known_or_not_a_text_has_one_spelling(value: Any, cell: str) -> None:
    assert csv_bytes(TEXT[:1], [{"first": value}]) == f"first\n{cell}\n".encode()


def test_every_column_of_trials_reads_back_as_what_was_written(summary: dict[str, Any]) -> None:
    script = Lines()
    script.started(1)
    script.ended(1, **summary)
    script.note("mark", "-1 and more")
    rows = SessionRows(script._lines).trials
    content = csv_bytes(TRIALS, rows)
    assert b",'-1 and more," in content
    assert read_table(content, TRIALS) == read_table(content, TRIALS[::-1]) == rows
    assert read_table(content, TRIALS[2:4]) == [
        {column.name: row[column.name] for column in TRIALS[2:4]} for row in rows
    ]


def test_the_row_of_an_answer_says_what_was_chosen_and_when() -> None:
    script, times = Lines(), {"onset_s": 1.0, "first_s": 2.0, "last_s": 4.0, "changes": 3}
    script.started(1)
    script.ended(1)
    given: dict[str, Any] = {"scale": 5, "unsure": None, "words": "thick", "several": ["a", "b"], "part": 0.5}
    items = [{"item": item, "number": n, "value": value, **times} for n, (item, value) in enumerate(given.items(), 1)]
    script.line("responses", trial=1, attempt=1, items=[*items, {"item": "left", "number": 6, "value": None}])
    columns = ("item", "response", "value", "cannot_judge", "onset_s", "first_choice_s", "last_change_s", "changes")
    rows = SessionRows(script._lines).responses
    assert [tuple(row[name] for name in columns) for row in rows] == [
        ("scale", "5", 5, False, 1.0, 2.0, 4.0, 3),
        ("unsure", None, None, True, 1.0, 2.0, 4.0, 3),
        ("words", "thick", None, False, 1.0, 2.0, 4.0, 3),
        ("several", "a b", None, False, 1.0, 2.0, 4.0, 3),
        ("part", "0.5", 0.5, False, 1.0, 2.0, 4.0, 3),
        ("left", None, None, False, None, None, None, None),
    ]
    assert [row["number"] for row in rows] == [1, 2, 3, 4, 5, 6]


def test_a_line_of_a_trial_that_never_started_is_named() -> None:
    script = Lines()
    script.started(1)
    script.ended(4)
    with pytest.raises(StoreError, match=r"^line 3 of the journal refers to trial 4, which never started"):
        SessionRows(script._lines)


def test_a_table_that_was_written_before_texts_were_guarded_is_what_the_journal_gives() -> None:
    now = csv_bytes(TEXT, [{"first": "=1+2", "second": 'a, "b"'}, {"first": "'", "second": "+"}])
    early = now.replace(b"'=", b"=").replace(b"'+", b"+")
    assert early != now
    assert has_same_cells(early, now)
    assert has_same_cells(csv_bytes(TEXT[:1], [{"first": "=1+2"}, {"first": "'"}]), now)
    assert not has_same_cells(early.replace(b"=1+2", b"=1+3"), now)
    assert not has_same_cells(now, csv_bytes(TEXT[:1], [{"first": "=1+2"}, {"first": "'"}]))
