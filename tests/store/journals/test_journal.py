"""The journal: whole lines, read again as they were written, damage found."""

import hashlib
import json
import re
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.errors import StoreError
from study_app.store.clock import SessionClock
from study_app.store.journals.journal import plain, read, scan
from study_app.store.journals.journal_events import problem, unknown_events
from study_app.store.journals.journal_writer import Journal
from tests.store.conftest import Start
from tests.store.journals.awkward_text import AWKWARD


def three_answers(path: Path) -> Path:
    with Journal.create(path) as journal:
        journal.append("began", participant="P007")
        for trial in (1, 2, 3):
            journal.append("counted", trial=trial, item="calm", value=trial, text='naïve 🌊, "q"\n')
    return path


def test_a_line_explains_itself_and_is_returned_as_it_will_be_read(tmp_path: Path, clock: SessionClock) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal.create(path, clock) as journal:
        written = [
            journal.append("shown", page="consent"),
            journal.append("counted", t_s=12.3456789, item="calm", value=None),
        ]
    assert read(path) == written
    assert written[1] == {
        "n": 2,
        "event": "counted",
        "t_s": 12.345679,
        "at": "2026-03-01T10:00:12.345+01:00",
        "item": "calm",
        "value": None,
        "previous": hashlib.sha256(path.read_bytes().splitlines(keepends=True)[0]).hexdigest(),
    }


def test_a_line_is_on_the_disk_when_append_returns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file was flushed, whole, before the caller goes on."""
    path = tmp_path / "journal.jsonl"
    flushed: list[bytes] = []
    with Journal.create(path) as journal:
        monkeypatch.setattr(
            "study_app.store.journals.journal_writer.os.fsync", lambda _: flushed.append(path.read_bytes())
        )
        for count in (1, 2, 3):
            journal.append("counted", value=count)
            assert len(flushed) == count
            assert flushed[-1] == path.read_bytes()
    assert flushed[-1].count(b"\n") == 3


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


@pytest.mark.parametrize("tail", [b"\0" * 4096, b'{"n":5,"event"', b"\xff\xfe\0\0", b'{"n":5}', b"7"])
def test_what_a_power_cut_leaves_at_the_end_is_left_out_and_counted(tmp_path: Path, tail: bytes) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    with path.open("ab") as file:
        file.write(tail)
    contents = scan(path)
    assert len(contents.lines) == 4
    assert contents.torn_bytes == len(tail)
    assert contents.damage is None


@pytest.mark.parametrize("broken", [(1,), (3,), (2, 3), (1, 2, 3)])
@pytest.mark.parametrize("tail", [b"", b'{"n":5,"ev'])
def test_a_broken_line_with_its_newline_is_damage_wherever_it_is(
    tmp_path: Path, broken: tuple[int, ...], tail: bytes
) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    lines = path.read_bytes().split(b"\n")
    for index in broken:
        lines[index] = b"#" + lines[index][1:]
    path.write_bytes(b"\n".join(lines) + tail)
    with pytest.raises(StoreError, match=rf"journal\.jsonl, line {broken[0] + 1}: damaged; restore it from a copy"):
        read(path)
    contents = scan(path)
    assert (len(contents.lines), contents.torn_bytes) == (broken[0], 0)


@pytest.mark.parametrize("order", [(0, 1, 3), (0, 1, 1, 2), (1, 2, 3)])
def test_a_missing_or_doubled_line_is_damage(tmp_path: Path, order: tuple[int, ...]) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[index] for index in order))
    with pytest.raises(StoreError, match="lines are missing or duplicated"):
        read(path)


def test_a_journal_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"journal\.jsonl cannot be read \(No such file or directory\)"):
        read(tmp_path / "journal.jsonl")


def test_an_existing_journal_is_never_written_over(tmp_path: Path) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    before = path.read_bytes()
    with pytest.raises(StoreError, match="exists already"):
        Journal.create(path)
    assert path.read_bytes() == before


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="cannot be written"):
        Journal.create(tmp_path / "gone" / "journal.jsonl")


@pytest.mark.parametrize(
    ("told", "sentence"),
    [
        ({"t_s": -0.001}, "(note) has t_s -0.001"),
        ({"t_s": 1e10}, "(note) has t_s 1e+10"),
        ({"kind": 3}, "(note) holds kind 3, expected: text"),
    ],
)
def test_what_a_reader_would_call_damage_is_not_written(tmp_path: Path, told: dict[str, Any], sentence: str) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal.create(path) as journal:
        with pytest.raises(StoreError, match=re.escape(f"line 1 {sentence}")):
            journal.append("note", **({"kind": "note", "text": "x"} | told))
        journal.append("note", kind="note", text="kept")
    assert [line["text"] for line in read(path)] == ["kept"]


def test_a_field_cannot_take_the_place_of_a_lines_number_or_time(tmp_path: Path) -> None:
    with Journal.create(tmp_path / "journal.jsonl") as journal:
        for own in ("n", "at", "previous"):
            with pytest.raises(ValueError, match="are the journal's own"):
                journal.append("said", **{own: 1})
    assert read(tmp_path / "journal.jsonl") == []


def test_setting_the_wall_clock_back_moves_no_time(tmp_path: Path) -> None:
    """The wall clock is read once; a session's times come from the monotonic clock."""
    now = [1_000]
    origin = datetime(2026, 10, 25, 1, 59, 59, tzinfo=timezone(timedelta(hours=2)))
    clock = SessionClock(lambda: now[0], origin)
    with Journal.create(tmp_path / "journal.jsonl", clock) as journal:
        now[0] += 2_500_000_000
        line = journal.append("shown", page="consent")
    assert line["t_s"] == 2.5
    assert line["at"] == "2026-10-25T02:00:01.500+02:00"


def test_a_clock_that_goes_on_shows_more_than_nothing_and_now() -> None:
    now = [7_000]
    clock = SessionClock(lambda: now[0], shown_s=3600.0)
    now[0] += 2_500_000_000
    assert clock.seconds() == 3602.5
    assert abs(datetime.fromisoformat(clock.at(3600.0)) - datetime.now().astimezone()) < timedelta(minutes=1)


def test_a_journal_that_changed_while_it_was_opened_is_refused(tmp_path: Path) -> None:
    path = three_answers(tmp_path / "journal.jsonl")
    contents = scan(path)
    with path.open("ab") as file:
        file.write(b'{"n":5}\n')
    before = path.read_bytes()
    with pytest.raises(StoreError, match="has changed while it was opened: close the other program"):
        Journal.reopen(path, contents, SessionClock())
    assert path.read_bytes() == before


@pytest.mark.parametrize("other", [None, b"", b"another"])
def test_a_journal_that_is_no_longer_under_its_name_takes_no_line_until_it_is_back(
    tmp_path: Path, other: bytes | None
) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal.create(path) as journal:
        journal.append("counted", value=1)
        path.rename(tmp_path / "away.jsonl")
        if other is not None:
            path.write_bytes(other)
        for waits in (True, False):
            with pytest.raises(StoreError, match=r"journal\.jsonl was moved, deleted or replaced .*: put it back"):
                journal.append("counted", value=2, waits=waits)
        (tmp_path / "away.jsonl").replace(path)
        journal.append("counted", value=2)
    assert [line["value"] for line in read(path)] == [1, 2]


def test_numbers_become_plain_and_those_that_are_none_null() -> None:
    mixed = {"a": np.int64(3), "b": np.float32(0.5), "c": float("nan"), "d": (np.inf, np.array([1.0, np.nan])), 5: True}
    assert plain(mixed) == {"a": 3, "b": 0.5, "c": None, "d": [None, [1.0, None]], "5": True}
    assert type(plain(np.bool_(True))) is bool


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
        journal.append("said", text=AWKWARD, said=value)
        journal.append("said", text="")
    assert [(line["text"], line.get("said")) for line in read(path)] == [(AWKWARD, value), ("", None)]
    assert path.read_bytes().count(b"\n") == 2


def test_half_a_surrogate_pair_is_kept_as_an_escape(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with Journal.create(path) as journal:
        journal.append("said", text="half \ud83c here")
    assert json.loads(path.read_text(encoding="utf-8"))["text"] == "half \ud83c here"


OF_ALL = {"n": 1, "t_s": 0.0, "at": "2026-03-01T10:00:00.000+01:00"}


def line(event: str, **fields: Any) -> dict[str, Any]:
    return {**OF_ALL, "event": event, **fields}


def test_whatever_the_store_writes_is_in_the_dictionary(finished: Start) -> None:
    store = finished(recordings=True)
    assert list(unknown_events(store.lines)) == []
    assert [problem(each) for each in store.lines if problem(each)] == []


@pytest.mark.parametrize(
    ("held", "sentence"),
    [
        (line("note", kind="note"), "(note) lacks text"),
        ({"n": 4, "event": "resumed"}, "(resumed) lacks t_s, at, by"),
        (line("weather") | {"at": "noon"}, "(weather) holds at 'noon', expected: time"),
        (line("weather") | {"at": "2026-03-01T10:00:00.000"}, "(weather) holds at '2026-03-01T10:00:00.000', expected"),
        (line("weather") | {"t_s": True}, "(weather) holds t_s True, expected: number"),
        (line("weather") | {"t_s": 1e300}, "(weather) has t_s 1e+300"),
        (line("weather") | {"t_s": -1.0}, "(weather) has t_s -1"),
        (line("weather", trial=[]), "(weather) holds trial [], expected: integer"),
        ({"n": 4, "event": ["note"]}, "names no event"),
        (line("page_shown", page=["consent"]), "(page_shown) holds page ['consent'], expected: text"),
        (line("choice", trial="1", item="calm", value=3), "holds trial '1', expected: integer"),
        (line("choice", trial=1, item="calm", value="x" * 999), "…, expected: integer"),
        (line("responses", trial=1, attempt=1, items=[{"item": "calm"}]), "expected: list of answers"),
        (line("trial_ended", trial=1, attempt=1, outcome="complete", force_peak_n="3"), "holds force_peak_n '3'"),
        (line("preflight", checks=[3]), "holds checks [3], expected: list of objects"),
    ],
)
def test_what_is_wrong_with_a_line_is_named(held: dict[str, Any], sentence: str) -> None:
    said = problem(held)
    assert said is not None
    assert sentence in said
    assert len(said) < 300


def test_an_event_of_another_version_is_told_once_and_lacks_nothing() -> None:
    lines = [line("weather", wind="x"), line("note", kind="note", text=""), line("weather")]
    assert list(unknown_events(lines)) == ["weather"]
    assert [problem(each) for each in lines] == [None] * 3
