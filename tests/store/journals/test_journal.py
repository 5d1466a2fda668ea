"""The journal: whole lines, read again as they were written, damage found."""

import hashlib
import json
import re
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft7Validator

from study_app.errors import StoreError
from study_app.store.journals import journal_events
from study_app.store.journals.journal import Journal, SessionClock, count_events, read, scan
from study_app.store.journals.journal_events import journal_schema, line_problem, unknown_events
from tests.journal_lines import event_of, raw
from tests.platforms import needs_links, needs_posix
from tests.store.conftest import AWKWARD, Start


def three_answers(path: Path) -> Path:
    with Journal.create(path) as journal:
        journal.append(event_of("began", participant="P007"))
        for trial in (1, 2, 3):
            journal.append(event_of("counted", trial=trial, item="calm", value=trial, text='naïve 🌊, "q"\n'))
    return path


def test_a_line_explains_itself_and_is_returned_as_it_will_be_read(tmp_path: Path, clock: SessionClock) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal.create(path, clock) as journal:
        events = [
            journal.append(event_of("shown", page="consent")),
            journal.append(event_of("counted", item="calm", value=None), t_s=12.3456789),
        ]
    assert read(path) == events
    assert events[1].line() == {
        "n": 2,
        "event": "counted",
        "t_s": 12.345679,
        "at": "2026-03-01T10:00:12.345+01:00",
        "item": "calm",
        "value": None,
        "previous": hashlib.sha256(path.read_bytes().splitlines(keepends=True)[0]).hexdigest(),
    }


@pytest.mark.slow
def test_cut_at_any_byte_it_reads_to_the_last_whole_line(tmp_path: Path) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    content, lines = path.read_bytes(), read(path)
    ends = [end + 1 for end, byte in enumerate(content) if byte == ord("\n")]
    assert len(ends) == 4
    cut = tmp_path / "cut.jsonl"
    for size in range(len(content) + 1):
        cut.write_bytes(content[:size])
        whole = sum(end <= size for end in ends)
        contents = scan(cut)
        assert read(cut) == contents.lines == lines[:whole]
        assert contents.whole_bytes == ([0, *ends])[whole]
        assert contents.torn_bytes == size - contents.whole_bytes
        assert contents.damage is None


def test_broken_missing_and_doubled_lines_are_damage_but_an_incomplete_last_line_is_not(tmp_path: Path) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    assert count_events(path, "counted", "began", "count") == (3, 1, 0)
    assert count_events(tmp_path / "none", "counted", "began") == (0, 0)
    for tail in (b"\0" * 4096, b'{"n":5,"event"', b"\xff\xfe\0\0", b'{"n":5}', b"7"):
        path.write_bytes(whole + tail)
        contents = scan(path)
        assert (len(contents.lines), contents.torn_bytes, contents.damage) == (4, len(tail), None)
    for broken in ((1,), (3,), (2, 3), (1, 2, 3)):
        damaged = b"".join(b"#" + line[1:] if number in broken else line for number, line in enumerate(lines))
        for tail in (b"", b'{"n":5,"ev'):
            path.write_bytes(damaged + tail)
            with pytest.raises(StoreError, match=rf"journal\.jsonl, line {broken[0] + 1} is damaged: restore"):
                read(path)
            assert (len(scan(path).lines), scan(path).torn_bytes) == (broken[0], 0)
    for order in ((0, 1, 3), (0, 1, 1, 2), (1, 2, 3)):
        path.write_bytes(b"".join(lines[index] for index in order))
        with pytest.raises(StoreError, match="lines are missing or duplicated"):
            read(path)


def test_a_journal_whose_chain_was_removed_is_damaged(start: Start) -> None:
    with start() as store:
        path = store.folder.journal
    path.write_bytes(re.sub(rb',\s*"previous":\s*"[0-9a-f]{64}"', b"", path.read_bytes()))
    with pytest.raises(StoreError, match=r"line 1 does not contain the key .*previous"):
        read(path)


NAN = float("nan")


@pytest.mark.parametrize(
    ("kind", "valid", "invalid"),
    [
        ("_Flag", [True, False], [0, "true", None]),
        ("_Integer", [0, -3], [True, 1.0, "1", 2 * 10**30]),
        ("Number", [1, 0.5], [NAN, float("inf"), True, "1"]),
        ("Time", ["2026-03-02T09:30:00+01:00"], ["2026-03-02T09:30:00", "noon", 7, "0001-01-01T00:00:00+00:00"]),
        ("Texts", [[], ["a"]], ["a", [1], {"a": 1}, None]),
        ("_NumberList", [[], [1, 0.5]], [1, ["1"], [NAN]]),
        ("Numbers", [{}, {"a": 1.5}], [[], {"a": "1"}, {"a": NAN}]),
        ("_Checks", [[], [{}]], [{}, [1]]),
        ("_AnyAnswer", ["a", 1, ["a"]], [None, [1], {}, NAN]),
    ],
)
def test_each_kind_of_value_is_distinguished_from_others(kind: str, valid: list[Any], invalid: list[Any]) -> None:
    holds = get_args(getattr(journal_events, kind))[1].holds
    assert [[holds(value) for value in values] for values in (valid, invalid)] == [
        [True] * len(valid), [False] * len(invalid),
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["n", "t_s", "at", "kind", "text"])
def test_a_field_that_every_line_has_is_never_null(name: str) -> None:
    line = {"n": 1, "event": "note", "t_s": 0.0, "at": "2026-03-01T10:00:12.345+01:00", "kind": "note", "text": "x"}
    assert line_problem(line) is None
    assert f"(note) has {name} " in str(line_problem(line | {name: None}))


def test_a_journal_changed_by_another_program_is_neither_overwritten_nor_continued(tmp_path: Path) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    contents = scan(path)
    with path.open("ab") as file:
        file.write(b'{"n":5}\n')
    before = path.read_bytes()
    with pytest.raises(StoreError, match="already exists"):
        Journal.create(path)
    with pytest.raises(StoreError, match="changed while it was being opened: close the program"):
        Journal.reopen(path, contents, SessionClock())
    assert path.read_bytes() == before
    with pytest.raises(StoreError, match="cannot be written"):
        Journal.create(tmp_path / "gone" / "journal.jsonl")
    with pytest.raises(StoreError, match=r"none\.jsonl cannot be read \("):
        read(tmp_path / "none.jsonl")


def test_an_answer_keeps_when_it_was_first_shown_and_chosen_and_counts_its_changes() -> None:
    shown_answer = journal_events.Answer().shown(2.0)
    assert shown_answer.shown(3.0) == shown_answer == journal_events.Answer(onset_s=2.0)
    first = shown_answer.chosen(4.0, 3)
    assert first == journal_events.Answer(onset_s=2.0, first_s=4.0, last_s=4.0, changes=0, value=3)
    assert first.chosen(5.0, 3) == first, "the same choice again changes nothing"
    changed = first.chosen(6.0, 5).chosen(7.0, None)
    assert changed == journal_events.Answer(onset_s=2.0, first_s=4.0, last_s=7.0, changes=2, value=None)
    assert changed.chosen(8.0, None) == changed
    assert changed.removed() == shown_answer
    assert [answer.given for answer in (shown_answer, first, changed, changed.removed())] == [False, True, True, False]


def test_a_closed_journal_refuses_lines_and_names_the_lost_one(tmp_path: Path) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    journal = Journal.reopen(path, scan(path), SessionClock())
    assert not journal.is_closed
    fifth = journal.append(event_of("counted", value=5))
    journal.close()
    assert journal.is_closed
    assert (fifth.n, read(path)[-1]) == (5, fifth)
    with pytest.raises(StoreError) as error:
        journal.append(event_of("counted", value=6))
    assert str(error.value) == (
        f"{path} is closed: 'counted' occurred after the end of the session and was not recorded"
    )
    assert len(read(path)) == 5


def test_events_that_a_reader_would_reject_are_not_written(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal.create(path) as journal:
        for fields, sentence in (
            ({"t_s": -0.001}, "(note) has an invalid t_s, -0.001"),
            ({"t_s": 1e10}, "(note) has an invalid t_s, 1e+10"),
            ({"kind": 3}, "(note) has kind 3; expected: text"),
        ):
            note = journal_events.Note(kind=fields.get("kind", "note"), text="x")
            with pytest.raises(StoreError, match=re.escape(f"line 1 {sentence}")):
                journal.append(note, t_s=fields.get("t_s"))
        mixed = {"a": np.int64(3), "b": np.float32(0.5), "c": float("nan"), "d": (np.inf, np.array([1.0, np.nan]))}
        journal.append(journal_events.Note(kind="note", text="half \ud83c here", others={"mixed": mixed}))
    (line,) = read(path)
    assert line.others["mixed"] == {"a": 3, "b": 0.5, "c": None, "d": [None, [1.0, None]]}
    assert json.loads(path.read_text(encoding="utf-8"))["text"] == line.text == "half \ud83c here"


def test_times_come_from_the_monotonic_clock() -> None:
    """The wall clock is read once, so that setting it back does not change times."""
    now = [7_000]
    began = SessionClock(lambda: now[0], datetime(2026, 10, 25, 1, 59, 59, tzinfo=timezone(timedelta(hours=2))))
    resumed = SessionClock(lambda: now[0], shown_s=3600.0)
    now[0] += 2_500_000_000
    assert (began.seconds(), began.at(2.5)) == (2.5, "2026-10-25T02:00:01.500+02:00")
    assert resumed.seconds() == 3602.5
    assert abs(datetime.fromisoformat(resumed.at(3600.0)) - datetime.now().astimezone()) < timedelta(minutes=1)


@needs_posix
def test_a_renamed_journal_refuses_lines_until_it_is_moved_back(tmp_path: Path) -> None:
    path, away = tmp_path / "journal.jsonl", tmp_path / "away.jsonl"
    with Journal.create(path) as journal:
        journal.append(event_of("counted", value=1))
        path.rename(away)
        for other in (None, b"", b"another"):
            if other is not None:
                path.write_bytes(other)
            for waits in (True, False):
                with pytest.raises(StoreError, match=r"journal\.jsonl was moved, deleted or replaced .*: restore it"):
                    journal.append(event_of("counted", value=2), waits=waits)
        away.replace(path)
        journal.append(event_of("counted", value=2))
    assert [line.others["value"] for line in read(path)] == [1, 2]


@needs_links
def test_a_journal_in_a_folder_replaced_by_a_link_refuses_lines(tmp_path: Path) -> None:
    folder, away = tmp_path / "ses-01", tmp_path / "away"
    folder.mkdir()
    with Journal.create(folder / "journal.jsonl") as journal:
        folder.rename(away)
        folder.symlink_to(away)
        with pytest.raises(StoreError, match=r"journal\.jsonl was moved, deleted or replaced .*: restore it"):
            journal.append(event_of("counted", value=1))
        folder.unlink()
        away.rename(folder)
        journal.append(event_of("counted", value=1))


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@pytest.mark.slow
@given(value=json_values)
def test_any_value_comes_back(tmp_path_factory: pytest.TempPathFactory, value: Any) -> None:
    path = tmp_path_factory.mktemp("journal") / "journal.jsonl"
    with Journal.create(path) as journal:
        journal.append(event_of("said", text=AWKWARD, said=value))
        journal.append(event_of("said", text=""))
    assert [(line.others["text"], line.others.get("said")) for line in read(path)] == [(AWKWARD, value), ("", None)]
    assert path.read_bytes().count(b"\n") == 2


OF_ALL = {"n": 1, "t_s": 0.0, "at": "2026-03-01T10:00:00.000+01:00"}


def line(event: str, **fields: Any) -> dict[str, Any]:
    return {**OF_ALL, "event": event, **fields}


@pytest.mark.slow
def test_every_stored_line_follows_the_schema() -> None:
    schema = Draft7Validator(journal_schema())
    root = Path(__file__).resolve().parents[3]
    paths = [
        *(root / "tests" / "store" / "releases").rglob("journal.jsonl"),
        *(root / "results").rglob("journal.jsonl"),
    ]
    lines = [line for path in paths for line in path.read_text(encoding="utf-8").splitlines()]
    assert len(lines) > 3000
    for line in lines:
        schema.validate(json.loads(line))


def test_unknown_events_are_listed_once_and_written_events_are_known(finished: Start) -> None:
    lines = [line("weather", wind="x"), line("note", kind="note", text=""), line("weather")]
    assert list(unknown_events(list(map(journal_events.read_event, lines)))) == ["weather"]
    written_lines = finished(recordings=True).lines
    assert list(unknown_events(written_lines)) == []
    assert {line_problem(written_line) for written_line in (*lines, *raw(written_lines))} == {None}
