from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.store.atomic import append_line, create_folder, probe, sweep, temporaries, temporary_path, write_file
from tests.store.conftest import FullDisk


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_write_that_fails_in_the_middle_leaves_the_old_file_and_nothing_beside(
    tmp_path: Path, files_up_to: FullDisk
) -> None:
    path = tmp_path / "table.csv"
    write_file(path, b"old\n")
    with files_up_to(1000), pytest.raises(StoreError, match=r"table\.csv cannot be written \(File too large\)"):
        write_file(path, b"new\n" * 100_000)
    assert path.read_bytes() == b"old\n"
    assert names_in(tmp_path) == ["table.csv"]


def test_a_folder_that_cannot_be_filled_is_not_created(tmp_path: Path, files_up_to: FullDisk) -> None:
    with files_up_to(1000), pytest.raises(StoreError, match="blinding cannot be written"):
        create_folder(tmp_path / "blinding", {"key": b"x" * 5000})
    assert names_in(tmp_path) == []


def test_lines_are_appended_after_a_torn_one_without_losing_either(tmp_path: Path) -> None:
    path = tmp_path / "reveals.jsonl"
    append_line(path, b"1\n")
    with path.open("ab") as file:
        file.write(b"tor")
    append_line(path, b"2\n")
    append_line(path, b"3\n")
    assert path.read_bytes() == b"1\ntor\n2\n3\n"


def test_a_line_that_does_not_fit_is_taken_back(tmp_path: Path, files_up_to: FullDisk) -> None:
    path = tmp_path / "reveals.jsonl"
    append_line(path, b"1\n")
    with files_up_to(100), pytest.raises(StoreError, match=r"reveals\.jsonl cannot be written"):
        append_line(path, b"x" * 5000 + b"\n")
    assert path.read_bytes() == b"1\n"


def test_what_is_half_written_is_known_by_its_name_and_swept(tmp_path: Path) -> None:
    half = [temporary_path(tmp_path / name) for name in ("table.csv", "trial-001.parquet", "folder")]
    kept = [
        "table.csv",
        ".table.csv.tmp",
        "notes.0123abcd.tmp",
        ".open-0123abcd.json",
        "..open-01234567.json.0123abcd.tmp",
    ]
    for path in half[:2]:
        path.write_text("half")
    half[2].mkdir()
    (half[2] / "inside").write_text("half")
    for name in kept:
        (tmp_path / name).write_text("kept")
    (tmp_path / "below").mkdir()
    below = temporary_path(tmp_path / "below" / "table.csv")
    below.write_text("kept")
    assert temporaries(tmp_path) == tuple(sorted(half))
    assert sweep(tmp_path) == tuple(sorted(half))
    assert names_in(tmp_path) == sorted([*kept, "below"])
    assert below.exists()
    assert sweep(tmp_path) == sweep(tmp_path / "none") == ()


def test_where_one_cannot_write_is_told_before_anything_is_begun(tmp_path: Path, files_up_to: FullDisk) -> None:
    with (
        files_up_to(3),
        pytest.raises(StoreError, match=r"results cannot be written \(File too large\): free disk space"),
    ):
        probe(tmp_path / "results")
    assert names_in(tmp_path) == []
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match=r"file cannot be written \(a file is where a folder is needed\)"):
        probe(tmp_path / "file")


def test_a_file_is_on_the_disk_before_it_takes_its_place_and_its_place_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that a power cut leaves the old file or the new one."""
    path = tmp_path / "table.csv"
    write_file(path, b"old\n")
    seen: list[tuple[bytes, int]] = []
    monkeypatch.setattr("os.fsync", lambda _: seen.append((path.read_bytes(), len(names_in(tmp_path)))))
    write_file(path, b"new\n")
    assert seen == [(b"old\n", 2), (b"new\n", 1)]
