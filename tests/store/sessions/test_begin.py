"""A session begins: what is on disk before its first trial, and what refuses it."""

import hashlib
import os
import platform
from pathlib import Path
from typing import Any

import pytest

from study_app import __version__
from study_app.errors import StoreError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.store import receipt
from study_app.store.files.atomic import sync_folder
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import SessionStarted
from study_app.store.sessions.begin import UsedIds, used_ids
from tests.platforms import files_up_to
from tests.protocol.edited_studies import text_of
from tests.store.conftest import Start, study_tables
from tests.store.sessions.conftest import every_byte

TABLES = study_tables()
OTHER = Protocol.model_validate(TABLES | {"study": TABLES["study"] | {"name": "other"}})
SOURCE_HASH = hashlib.sha256(b"[study]\nname = 'brackish'\n").hexdigest()


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_everything_is_there_before_the_first_trial(tmp_path: Path, start: Start) -> None:
    store = start()
    files = {name for name, content in every_byte(tmp_path / "study").items() if content is not None}
    (marker,) = {name for name in files if "/.open-" in name}
    assert marker.startswith("data/sub-P007/ses-01/.open-")
    assert files - {marker} == {
        ".psychds-ignore",
        "dataset_description.json",
        "blinding/key.sealed",
        "data/study-brackish_description-participants_data.csv",
        "data/sub-P007/ses-01/journal.jsonl",
        "data/sub-P007/ses-01/receipt.json",
        "data/sub-P007/ses-01/subject-P007_session-01_task-brackish_description-responses_data.csv",
        "data/sub-P007/ses-01/subject-P007_session-01_task-brackish_description-trials_data.csv",
    }
    assert not store.folder.recordings.exists()
    store.close()


@pytest.mark.parametrize("design", [None, "2ifc"])
def test_one_block_of_intervals_among_others_gives_the_session_their_table(start: Start, design: str | None) -> None:
    pairs = 'title = "Pairs"\ntask = "feel"\nconditions = ["feel_quagmire", "feel_mildew"]\n'
    pairs += f'design = "{design}"\nstandard = "feel_quagmire"\n' if design else 'code_prefix = "P"\n'
    text = text_of("brackish").replace('"liquids", "delays"]', '"liquids", "delays", "pairs"]', 1)
    with start(protocol=parse(f"{text}\n[blocks.pairs]\n{pairs}".encode(), "brackish.toml")) as store:
        start_line = store.lines[0]
        assert isinstance(start_line, SessionStarted)
        assert (start_line.intervals, store.folder.table("brackish", "intervals").exists()) == (
            (True, True) if design else (None, False)
        )


def test_the_entry_of_every_folder_that_is_created_is_flushed(
    tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[Path] = []

    def sync(path: Path) -> None:
        flushed.append(path)
        sync_folder(path)

    for module in ("files.atomic", "sessions.begin"):
        monkeypatch.setattr(f"study_app.store.{module}.sync_folder", sync)
    results = tmp_path / "results" / "study"
    start(results=results).close()
    created = [results.parent, results, results / "data", results / "data/sub-P007", results / "data/sub-P007/ses-01"]
    assert [folder for folder in created if folder.parent not in flushed] == []
    flushed.clear()
    start("P008", results=results).close()
    assert tmp_path not in flushed
    assert results.parent not in flushed


def test_the_receipt_contains_the_facts_that_reproduce_the_session(start: Start) -> None:
    store = start()
    before = receipt.read(store.folder.receipt)
    assert before["status"] == "unfinished"
    assert (before["seed"], before["participant"], before["session"]) == (11, "P007", 1)
    assert (before["key_hash"], before["protocol_hash"]) == (store.key.hash, SOURCE_HASH)
    assert before["clock"] == {"origin_ns": 5_000_000_000, "origin_at": "2026-03-01T10:00:00.000+01:00"}
    assert before["device"] == {"name": "scripted", "rate_hz": 1000}
    assert before["screens"]["participant"]["refresh_hz"] == 60.0
    assert "SHA-256 of (seed, name)" in before["generator"]
    assert [before["versions"][name] for name in ("liquid-study", "python")] == [__version__, platform.python_version()]
    store.finish("withdrawn", "tired, went home")
    after = receipt.read(store.folder.receipt)
    ended = journal.read(store.folder.journal)[-1]
    assert {key for key in after if after[key] != before[key]} == {"status", "reason", "ended_at"}
    assert (after["status"], after["reason"], after["ended_at"]) == ("withdrawn", "tired, went home", ended.at)
    assert (ended.event, ended.status, ended.reason) == ("session_ended", "withdrawn", "tired, went home")


def test_every_value_of_a_start_is_in_the_receipt_and_most_are_in_the_first_line(
    start: Start, protocol: Protocol
) -> None:
    both = {
        "participant": "P009", "session": 2, "seed": 23, "operator": "CD", "language": "nb", "simulated": True,
        "pilot": True, "recordings": True,
    }  # fmt: skip
    only_receipt = {
        "device": {"name": "falcon", "serial": "F7"}, "screens": {"operator": "left"}, "motors_masked": {"by": "fan"},
        "outlets": {"LSL": "1.16"}, "video": {"camera": "C3"},
    }  # fmt: skip
    with start(**both, **only_receipt) as store:
        start_receipt, first = receipt.read(store.folder.receipt), store.lines[0]
        assert isinstance(first, SessionStarted)
        assert store.folder.path.parts[-2:] == ("sub-P009", "ses-02")
        assert store.key.drawn == "seed"
        assert store.recorder is not None
        assert store.recorder._facts == {
            "study": "brackish", "participant": "P009", "session": 2, "simulated": True, "pilot": True,
            "version": __version__, "origin_ns": store.clock.origin_ns,
        }  # fmt: skip
        assert (store.recorder._folder, store.recorder._secret, store.recorder._waits) == (
            store.folder.recordings, store.key.nonce, True,
        )  # fmt: skip
    both |= {"study": "brackish", "key_hash": store.key.hash, "protocol_hash": SOURCE_HASH, "version": __version__}
    assert {name: start_receipt[name] for name in both} == {name: getattr(first, name) for name in both} == both
    assert {name: start_receipt[name] for name in only_receipt} == only_receipt
    assert (start_receipt["format"], start_receipt["status"], start_receipt["reason"], start_receipt["ended_at"],
            start_receipt["resumed"]) == (
        2, "unfinished", "", None, [],
    )  # fmt: skip
    assert (start_receipt["started_at"], first.at, first.t_s, first.n) == (
        start_receipt["clock"]["origin_at"],
        start_receipt["started_at"],
        0.0,
        1,
    )
    assert (first.format, first.device, first.measures_sealed) == (2, "falcon", True)
    assert (first.own_codes, first.intervals, first.entry, first.group, first.place_in_group) == (None,) * 5
    assert first.limits == protocol.limits.model_dump(mode="json")
    assert first.receipt_hash == receipt.digest(start_receipt)


@pytest.mark.parametrize(
    ("again", "sentence"),
    [
        ({}, "participant P007 already has session 1"),
        ({"participant": "p007"}, "differs from the existing 'P007' only in capitalisation"),
        ({"participant": "P-007"}, "letters A-Z, a-z and digits 0-9"),
        ({"participant": "test"}, "is reserved for pilot sessions"),
        ({"participant": "P008", "session": 0}, "session number 0 cannot be used: it must be from 1 to 99"),
        ({"participant": "P008", "session": 100}, "session number 100 cannot be used: it must be from 1 to 99"),
        ({"participant": "P008", "simulated": True}, "must not be mixed"),
        ({"participant": "P008", "protocol": OTHER}, "contains the study 'brackish', not 'other'"),
    ],
)
def test_a_refusal_leaves_the_results_unchanged(
    tmp_path: Path, finished: Start, again: dict[str, Any], sentence: str
) -> None:
    finished()
    before = every_byte(tmp_path / "study")
    with pytest.raises(StoreError) as refusal:
        finished(**again)
    assert sentence in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert every_byte(tmp_path / "study") == before


def test_an_unwritable_results_folder_is_one_line(tmp_path: Path, start: Start) -> None:
    (tmp_path / "file").write_text("no folder", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError) as refusal:
        start(results=tmp_path / "file" / "study")
    assert f"{Path('file', 'study')} cannot be written (there is a file where a folder is needed)" in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert names_in(tmp_path) == ["file"]


def test_a_disk_that_fills_at_the_start_leaves_no_session_folder(tmp_path: Path, start: Start) -> None:
    start("P001").finish("completed")
    before = every_byte(tmp_path / "study")
    with files_up_to(1000), pytest.raises(StoreError, match=r"receipt\.json cannot be written \(File too large\)"):
        start("P002")
    assert every_byte(tmp_path / "study") == before


def test_halves_of_a_killed_program_go_when_the_next_session_begins(start: Start) -> None:
    with start("P007") as store:
        study = store.place.study_folder
    halves = [folder / ".table.csv.0123abcd.tmp" for folder in (study.path, study.data)]
    for half in halves:
        half.touch()
        os.utime(half, (0, 0))
    start("P008").close()
    assert not any(half.exists() for half in halves)


CHANGED = {
    "a missing value": ("NA", "nan", "None", "NULL", "null", "na"),
    "true or false": ("TRUE", "false", "T", "F"),
    "a number": ("1E5", "007", "00", "12e3", "inf", "Infinity", "0x1F", "0x1p3", "5E", "2i", "1234567890123456"),
    "a date or a time": (
        *("MAR1", "1MAR", "dec10", "SEPT2", "May2024", "12JAN24", "12pm"),
        *("Mrt1", "3juin", "Juil2024", "1oktober", "Januari5"),
    ),
}


@pytest.mark.parametrize(
    ("read_as", "participant"), [(what, participant_id) for what, ids in CHANGED.items() for participant_id in ids]
)
def test_an_id_that_other_programs_change_is_refused(tmp_path: Path, read_as: str, participant: str) -> None:
    with pytest.raises(StoreError) as error:
        used_ids(StudyFolder(tmp_path)).check_unused(participant, 1)
    assert f"participant ID '{participant}' cannot be used" in str(error.value)
    assert f"read it as {read_as}; use another ID, such as P001" in str(error.value)


KEPT = ("P1", "P007", "7", "101", "S01", "Anna", "NA1", "E5", "1A", "March", "TRUE1", "X0", "Marta1", "3D", "0xG")


@pytest.mark.parametrize("participant", KEPT)
def test_an_id_that_other_programs_keep_is_not(tmp_path: Path, participant: str) -> None:
    used_ids(StudyFolder(tmp_path)).check_unused(participant, 1)


def test_a_participant_who_has_such_an_id_already_has_further_sessions(tmp_path: Path) -> None:
    UsedIds(tmp_path, frozenset({("007", 1)}), ("007",)).check_unused("007", 99)


def test_a_used_number_is_refused_with_the_next_free_number_and_id(tmp_path: Path) -> None:
    used_numbers = frozenset({("P002", 3), ("P002", 1), ("p011", 7), ("X40", 2), ("P1x", 5)})
    used = UsedIds(tmp_path, used_numbers, ("P002", "P050", "p011"), withdrawn=("P012",))
    assert (used.numbers("P002"), used.numbers("P050"), used.suggested()) == ((1, 3), (), "P013")
    used.check_unused("P002", 2)
    with pytest.raises(StoreError) as error:
        used.check_unused("P002", 1)
    assert str(error.value) == (
        f"participant P002 already has session 1 in {tmp_path}: use a new session number (4), resume that session, or "
        "use another ID (next free: P013); nothing was changed"
    )
    with pytest.raises(StoreError, match=r"^participant P012 withdrew, .*use another ID \(next free: P013\)$"):
        used.check_unused("P012", 2)
    with pytest.raises(StoreError, match=r"^participant ID 'P011' differs from the existing 'p011' only in capital"):
        used.check_unused("P011", 8)
    used.check_rehearsal(["P001", "P003"])
    for participants, ids in ((["P001", "P002", "P003"], "IDs P001 to P003"), (["P012"], "ID P012")):
        with pytest.raises(StoreError, match=rf"the rehearsal uses the {ids}: specify a new folder with --results, or"):
            used.check_rehearsal(participants)
