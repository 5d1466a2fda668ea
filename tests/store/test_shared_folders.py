"""Results in folders that operating systems, git and programs that share files also write to."""

import hashlib
import os
import shutil
import subprocess
import sys
import time
from datetime import datetime
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.protocol.source.files import has_hash, protocol_hash, shipped_file
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.exclusions import exclude, exclusions, include
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study

pytestmark = pytest.mark.slow

OF_SYSTEMS = (
    "desktop.ini", "Thumbs.db", "~$x.xlsx", "x (AB's conflicted copy 2026-01-02).csv", "x (conflicted copy).csv",
    "receipt.sync-conflict-20260101-101010-ABCDEFG.json", "receipt-DESKTOP-AB12CD3.json", "journal (1).jsonl",
    "journal (Konfliktkopie von AB).jsonl", "journal_conflict-20260102-101010.jsonl", "receipt-Anna's Mac.json",
    "journal 2.jsonl", "journal.jsonl.bak", "journal.jsonl~", "journal - Kopie.jsonl", "~WRL0001.tmp",
    *["Icon\r"] * (os.name == "posix"),
    "recordings/trial-001 (1).parquet", "recordings/trial-001_frames (SFConflict ab 2026).parquet",
)  # fmt: skip
HIDDEN = (".DS_Store", "._journal.jsonl", ".dropbox.attr", ".~lock.x.csv#")


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rehearse("demo", participants=1, seed=1, results=tmp_path_factory.mktemp("shared") / "study")


@pytest.fixture
def study(rehearsed: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(rehearsed, tmp_path / "study"))


def session_of(study: Path) -> Path:
    return study / "data" / "sub-P001" / "ses-01"


def test_files_of_systems_are_noted_and_leave_the_fingerprint(study: Path) -> None:
    for name in (*OF_SYSTEMS, *HIDDEN):
        (session_of(study) / name).write_bytes(b"\0")
    verification = verify_study(study)
    assert verification.errors == ()
    assert {Path(warning.place).name for warning in verification.warnings} == {Path(name).name for name in OF_SYSTEMS}
    added = (
        "more.csv", "receipt.txt", "journal.jsonl.orig", "recordings/trial-099.parquet",
        "recordings/trial-001_attempt-2.parquet", "recordings/trial-001_extra.parquet",
    )  # fmt: skip
    for name in added:
        (session_of(study) / name).write_bytes(b"1\n")
    messages = {error.place: error.message for error in verify_study(study).errors}
    assert all(any(place.endswith(name) for place in messages) for name in added)
    assert not any("fingerprints.txt" in message for message in messages.values())


def test_copies_of_a_studys_lists_are_noted_and_their_content_is_ignored(study: Path) -> None:
    exclude(study, "P001", 1, by="AB", reason="x")
    copies = [
        study / "exclusions (AB's conflicted copy 2026-01-02).csv",
        study / "fingerprints-DESKTOP-AB12CD3.txt",
        study / "blinding" / "key.sync-conflict-20260101-101010-ABCDEFG.sealed",
        study / "blinding" / "reveals.jsonl~",
        study / "data" / "study-demo_description-participants_data (1).csv",
    ]
    for copy in copies:
        copy.write_bytes(b"other\n")
    (study / ".DS_Store").write_bytes(b"\0")
    (study / "exclusions_notes.csv").write_bytes(b"mine\n")
    verified = verify_study(study)
    assert verified.errors == ()
    assert sorted(warning.place for warning in verified.warnings) == sorted(
        copy.relative_to(study).as_posix() for copy in copies
    )
    assert all(warning.message.endswith("compare the two files") for warning in verified.warnings)
    assert [row.reason for row in exclusions(study)] == ["x"]


def test_copies_of_session_folders_are_ignored_with_a_warning(study: Path) -> None:
    shutil.copytree(session_of(study).parent, study / "data" / "sub-P001 (AB's conflicted copy 2026-01-02)")
    shutil.copytree(session_of(study), session_of(study).parent / "ses-01 (1)")
    verification = verify_study(study)
    assert verification.errors == ()
    assert [warning.message for warning in verification.warnings] == [
        "is ignored because it is not a session folder; it may be a copy of one"
    ] * 2
    assert verification.sessions == 1


def test_a_file_of_a_system_that_the_list_has_belongs_to_the_fingerprint(tmp_path: Path) -> None:
    study = tmp_path / "study"
    rehearse("demo", participants=1, seed=1, results=study)
    sums = session_of(study) / "checksums.sha256"
    (session_of(study) / "desktop.ini").write_bytes(b"[.ShellClassInfo]\n")
    sums.write_text(f"{sums.read_text('utf-8')}{'0' * 64}  desktop.ini\n", encoding="utf-8", newline="\n")
    assert any(
        error.place.endswith("desktop.ini") and "has changed" in error.message for error in verify_study(study).errors
    )


def test_line_endings_that_git_changed_are_named(study: Path) -> None:
    for path in session_of(study).glob("*.*"):
        if path.suffix != ".sha256":
            path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    messages = [error.message for error in verify_study(study).errors]
    assert any(
        "line endings have been changed to CR LF, as git does with core.autocrlf" in message for message in messages
    )
    assert not any("another line" in message for message in messages)


NOTED = {
    "exclusions.csv", "exclusions_reversed.jsonl", "fingerprints.txt", "key.sealed", "reveals.jsonl",
    "checksums.sha256", "dataset_description.json",
}  # fmt: skip
"""Files that are read with changed line endings or a byte order mark, as spreadsheets and editors write them."""


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["CR LF", "byte order mark"])
def test_each_file_that_an_editor_saved_otherwise_is_read_or_named(study: Path, mark: bytes) -> None:
    def errors_with(path: Path, content: bytes) -> list[str]:
        before = path.read_bytes()
        path.write_bytes(content)
        messages = [error.message for error in verify_study(study).errors if Path(error.place).name == path.name]
        path.write_bytes(before)
        return messages

    exclude(study, "P001", 1, by="AB", reason="x")
    include(study, "P001", 1, by="AB", reason="x")
    exclude(study, "P001", 1, by="AB", reason="x")
    unblind(study, by="AB", reason="x")
    files = [
        path for path in study.rglob("*") if path.suffix in {".csv", ".json", ".jsonl", ".txt", ".sealed", ".sha256"}
    ]
    assert {path.name for path in files} >= set(NOTED)
    for path in files:
        content = path.read_bytes()
        messages = errors_with(path, mark + content if mark else content.replace(b"\n", b"\r\n"))
        expected_message = "byte order mark" if mark else "line endings"
        if path.name in NOTED:
            assert messages == [], path
        else:
            assert messages, path
            assert all(expected_message in message for message in messages), (path, messages)


def test_a_study_has_one_hash_with_any_line_endings() -> None:
    source = shipped_file("demo").read_bytes()
    windows = source.replace(b"\n", b"\r\n")
    assert protocol_hash(windows) == protocol_hash(source) == hashlib.sha256(source).hexdigest()
    assert all(has_hash(text, hashlib.sha256(windows).hexdigest()) for text in (source, windows))
    assert not has_hash(source + b"#", protocol_hash(source))


@pytest.mark.skipif(sys.platform != "linux", reason="paths are Unicode")
def test_results_below_a_folder_that_is_not_utf_8_are_exported(study: Path, tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"donn\xe9es")
    folder.mkdir()
    there = study.rename(folder / "study")
    for words in (["verify"], ["export", "--to", str(folder / "tables")], ["report", "--to", str(folder / "report")]):
        command = [sys.executable, "-m", "study_app", words[0], there, *words[1:]]
        process = subprocess.run(command, check=False, capture_output=True)
        assert (process.returncode, process.stderr) == (0, b"")
    assert list((folder / "tables").glob("*_data.csv"))
    assert (folder / "report" / "report.html").is_file()


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="time zones are set for the process")
def test_sessions_are_listed_in_local_time(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times_of = {}
    for zone in ("America/New_York", "Asia/Kolkata"):
        monkeypatch.setenv("TZ", zone)
        time.tzset()
        times_of[zone] = CliRunner().invoke(commands, ["sessions", str(study)], catch_exceptions=False).output.split()
    monkeypatch.undo()
    time.tzset()
    assert times_of["America/New_York"][2][-6:] in {"-05:00", "-04:00"}
    assert times_of["Asia/Kolkata"][2][-6:] == "+05:30"
    began = {datetime.fromisoformat(f"{words[1]}T{words[2]}") for words in times_of.values()}
    assert len(began) == 1
