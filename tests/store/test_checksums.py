import hashlib
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.store.checksums import files, read_checksums, sha256, write_checksums
from study_app.store.folders import SessionFolder


@pytest.fixture
def session(tmp_path: Path) -> SessionFolder:
    (tmp_path / "recordings").mkdir()
    for name in (
        "journal.jsonl",
        "recordings/trial-001.parquet",
        ".open-0123abcd.json",
        "recordings/.x.0123abcd.tmp",
        "crash.txt",
    ):
        (tmp_path / name).write_text(name)
    return SessionFolder(tmp_path, "P007", 1)


def test_every_file_is_listed_but_hidden_ones_the_list_and_a_crashs_trace(session: SessionFolder) -> None:
    write_checksums(session, {})
    write_checksums(session, {})
    assert files(session) == ("journal.jsonl", "recordings/trial-001.parquet")
    assert read_checksums(session) == {name: hashlib.sha256(name.encode()).hexdigest() for name in files(session)}


def test_what_is_known_is_not_computed_again(session: SessionFolder) -> None:
    write_checksums(session, {"recordings/trial-001.parquet": "ab" * 32})
    assert read_checksums(session)["recordings/trial-001.parquet"] == "ab" * 32


@pytest.mark.parametrize("content", [b"no checksum\n", b"\xff\n", b"ab  journal.jsonl\n"])
def test_what_is_no_list_is_named(session: SessionFolder, content: bytes) -> None:
    session.checksums.write_bytes(content)
    with pytest.raises(StoreError, match=r"checksums\.sha256 (is not a list|has a line that is not a checksum)"):
        read_checksums(session)


def test_a_missing_file_is_named(session: SessionFolder) -> None:
    with pytest.raises(StoreError, match=r"none cannot be read \(No such file"):
        sha256(session.path / "none")
    with pytest.raises(StoreError, match=r"checksums\.sha256 cannot be read \(No such file"):
        read_checksums(session)
