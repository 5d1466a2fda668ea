"""The names of a session's own files, those of operating systems, and the list of a study's versions."""

import json
from pathlib import Path

import pytest

from study_app.store.integrity.checksums import is_system_file
from study_app.store.versions.study_versions import Kept, keep_version, kept_versions


@pytest.mark.parametrize(
    ("name", "is_system"),
    [
        ("journal.jsonl", False),
        ("recordings/trial-012_attempt-2_interval-3_frames.parquet", False),
        ("notes.txt", False),
        ("recordings/photo.jpg", False),
        (".DS_Store", True),
        (".git/config", True),
        ("recordings/Thumbs.db", True),
        ("desktop.ini", True),
        ("~$notes.docx", True),
        ("@eaDir/receipt.json@SynoEAStream", True),
        ("a/b/journal.jsonl", False),
        (".cache/b/journal.jsonl", True),
        ("journal (1).jsonl", True),
        ("receipt-HOST.json", True),
        ("recordings/trial-012 (2).parquet", True),
        ("notes (1).txt", False),
    ],
)
def test_files_of_the_operating_system_and_of_sharing_programs_are_known_by_their_names(
    name: str, *, is_system: bool
) -> None:
    assert is_system_file(Path(name)) is is_system


def test_lines_of_the_list_of_versions_that_are_not_versions_are_skipped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_DATA", str(tmp_path / "data"))
    file = tmp_path / "honey.toml"
    keep_version(file, b"a = 1", "draft")
    (version_list,) = tmp_path.rglob("versions/*.jsonl")
    rows = [
        {"hash": "1f", "origin": "stolen", "at": "2026-03-01T10:00:00+01:00"},
        ["2e"],
        {"hash": "3d", "origin": "saved", "at": "2026-03-02T11:30:00+01:00", "by": "QX"},
        {"hash": "4c", "origin": "found"},
    ]
    version_list.write_bytes(b"\n".join([*(json.dumps(row).encode() for row in rows), b"{"]) + b"\n")
    assert kept_versions(file) == (
        Kept(hash="3d", origin="saved", at="2026-03-02T11:30:00+01:00", by="QX"),
        Kept(hash="4c", origin="found", at="", by=""),
    )
