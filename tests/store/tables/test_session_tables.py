import csv
import io
import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.errors import StoreError
from study_app.store.files.columns import TRIALS
from study_app.store.files.csv_files import (
    MISSING,
    Column,
    csv_bytes,
    guard_formula,
    has_same_cells,
    header,
    read_table,
    table_problems,
)
from study_app.store.files.folders import SessionFolder
from study_app.store.tables.session_tables import _MEASURED, SessionRows, latest_attempts
from study_app.store.tables.study_files import row_of
from tests.store.tables.test_transcripts import Lines

NUMBER = (Column("first", "number", "One."),)
TEXT = (Column("first", "text", "One."), Column("second", "text", "Two."))


@pytest.mark.slow
@given(texts=st.lists(st.tuples(st.text(st.characters(codec="utf-8")), st.text(st.characters(codec="utf-8")))))
def test_any_text_survives_the_csv_module(texts: list[tuple[str, str]]) -> None:
    content = csv_bytes(TEXT, [{"first": first, "second": second} for first, second in texts])
    read_back = list(csv.reader(io.StringIO(content.decode("utf-8"), newline="")))
    assert read_back == [
        ["first", "second"],
        *([guard_formula(first), guard_formula(second)] for first, second in texts),
    ]
    rows_kept = [
        {name: None if text == MISSING else text for name, text in zip(header(TEXT), row, strict=True)} for row in texts
    ]
    assert read_table(content, TEXT) == rows_kept


@pytest.mark.parametrize(
    ("value", "cell"),
    [(None, "n/a"), (math.nan, "n/a"), (-math.inf, "n/a"), (True, "true"), (False, "false"), (7, "7")],
)
def test_unknown_and_non_text_values_have_one_spelling(value: Any, cell: str) -> None:
    assert csv_bytes(TEXT[:1], [{"first": value}]) == f"first\n{cell}\n".encode()


def test_numbers_are_written_again_as_they_were_read() -> None:
    content = b"first\n7\n-12\n0.5\n123456789012345678901\n"
    assert csv_bytes(NUMBER, read_table(content, NUMBER)) == content.replace(
        b"123456789012345678901", b"1.2345678901234568e+20"
    )


def test_rows_that_are_shorter_than_the_head_are_a_problem() -> None:
    assert list(table_problems(b"first,second\n1\n2\n", TEXT)) == ["row 2 has 1 cells, not 2"]


def test_every_column_of_trials_reads_back_as_written(summary: dict[str, Any]) -> None:
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


def test_the_row_of_an_answer_contains_the_choice_and_its_times() -> None:
    script, times = Lines(), {"onset_s": 1.0, "first_s": 2.0, "last_s": 4.0, "changes": 3}
    script.started(1)
    script.ended(1)
    answers: dict[str, Any] = {"scale": 5, "unsure": None, "words": "thick", "several": ["a", "b"], "part": 0.5}
    items = [{"item": item, "number": n, "value": value, **times} for n, (item, value) in enumerate(answers.items(), 1)]
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


def test_a_table_written_before_texts_were_guarded_matches_the_journal() -> None:
    now = csv_bytes(TEXT, [{"first": "=1+2", "second": 'a, "b"'}, {"first": "'", "second": "+"}])
    early = now.replace(b"'=", b"=").replace(b"'+", b"+")
    assert early != now
    assert has_same_cells(early, now)
    assert has_same_cells(csv_bytes(TEXT[:1], [{"first": "=1+2"}, {"first": "'"}]), now)
    assert not has_same_cells(early.replace(b"=1+2", b"=1+3"), now)
    assert not has_same_cells(now, csv_bytes(TEXT[:1], [{"first": "=1+2"}, {"first": "'"}]))


_COMBINED = {column.name: column.of_trial for column in TRIALS if column.name in _MEASURED}


def test_a_trial_of_intervals_has_the_sum_mean_or_largest_value_of_its_own_intervals() -> None:
    """Two trials of two intervals and a trial that is presented again: all measured values differ."""
    script, values = Lines(intervals=True), iter(range(1, 9999))
    measured: dict[tuple[int, int], list[dict[str, float]]] = {}
    for trial, attempt, arrangement in ((1, 1, "SC"), (2, 1, "CS"), (2, 2, "CS")):
        which = {"trial": trial, "attempt": attempt}
        place = {"block": "b", "phase": "main", "part": 1, "index": trial, "of": 2, "code": f"L{trial}"}
        script.line(
            "trial_started", t_s=100.0 * trial + 30 * attempt, **which, **place, arrangement=arrangement,
            level=0.5 * trial + attempt, standard=float(trial), catch=None,
        )  # fmt: skip
        for interval in (1, 2):
            at_s = 100.0 * trial + 30 * attempt + 7 * interval
            script.line("interval_started", t_s=at_s, **which, interval=interval)
            measured.setdefault((trial, attempt), []).append({name: next(values) + 0.25 for name in _COMBINED})
            script.line(
                "interval_ended", t_s=at_s + interval, **which, interval=interval, outcome="complete",
                invalid=["level_error_percent"] if (trial, interval) == (2, 2) else None,
                **measured[trial, attempt][-1],
            )  # fmt: skip
        script.line("trial_ended", t_s=at_s + 5, **which, outcome="complete")
    rows = SessionRows(script._lines)
    for trial_row, (which, of_intervals) in zip(rows.trials, measured.items(), strict=True):
        assert (trial_row["trial"], trial_row["attempt"], trial_row["intervals"]) == (*which, 2)
        for name in _COMBINED:
            pair = [row[name] for row in of_intervals]
            expected = {"sum": sum(pair), "mean": sum(pair) / 2, "max": max(pair)}[_COMBINED[name]]
            assert trial_row[name] == pytest.approx(expected), name
    columns = ("trial", "attempt", "interval", "interval_started_s", "gap_s", "presented", "standard", "level")
    assert [tuple(row[name] for name in columns) for row in rows.intervals] == [
        (1, 1, 1, 137.0, None, "standard", 1.0, 1.5),
        (1, 1, 2, 144.0, 6.0, "comparison", 1.0, 1.5),
        (2, 1, 1, 237.0, None, "comparison", 2.0, 2.0),
        (2, 1, 2, 244.0, 6.0, "standard", 2.0, 2.0),
        (2, 2, 1, 267.0, None, "comparison", 2.0, 3.0),
        (2, 2, 2, 274.0, 6.0, "standard", 2.0, 3.0),
    ]
    reasons = [row["invalid_reasons"] for row in rows.intervals]
    assert reasons == [None, None, None, "level_error_percent", None, "level_error_percent"]
    assert [row["ended_s"] for row in rows.intervals] == [138.0, 146.0, 238.0, 246.0, 268.0, 276.0]
    assert [row["attempt"] for row in latest_attempts(rows.trials)] == [1, 2]


def test_notes_of_a_reconnected_device_are_beside_the_trials_before_and_after() -> None:
    script = Lines()
    script.started(1)
    script.line("broke", what="the cable")
    script.line("device_reconnected")
    script.started(1, 2)
    script.ended(1, 2)
    script.line("repeat", trial=1, reason="noise")
    script.line("device_reconnected")
    script.started(2)
    script.note("mark", "laughed")
    script.note("note", "coughed")
    rows = SessionRows(script._lines).trials
    failed = "the device failed and was reconnected (the cable)"
    assert [row["notes"] for row in rows] == [
        failed, f"presented again: {failed}\nrepeated: noise\n{failed}", "laughed\ncoughed",
    ]  # fmt: skip
    assert [row["marked"] for row in rows] == [False, False, True]


def test_a_damaged_session_keeps_its_row_from_its_receipt_or_its_first_line(tmp_path: Path) -> None:
    session = SessionFolder(tmp_path / "ses-03", "P007", 3)
    session.path.mkdir()
    at = "2026-03-02T09:30:00+01:00"
    fields = {"key_hash": "a" * 64, "study": "stirring", "simulated": True, "pilot": False, "language": "nl"}
    session.receipt.write_text(json.dumps(fields | {"started_at": at, "device": {"name": "falcon"}}), "utf-8")
    session.journal.write_bytes(b"damaged\n")
    (row,) = row_of(session, None)
    assert {name: value for name, value in row.items() if value is not None} == {
        "study": "stirring", "simulated": True, "pilot": False, "language": "nl", "device": "falcon",
        "participant": "P007", "session": 3, "session_started_at": at, "status": "damaged",
    }  # fmt: skip
