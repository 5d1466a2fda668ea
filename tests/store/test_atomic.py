import os
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.store.files.atomic import (
    OLD_S,
    append_line,
    copy_folder,
    create_folder,
    make_folder,
    probe_free_bytes,
    read_if_there,
    remove_old_temporary_files,
    temporary_path,
    write_file,
)
from study_app.store.integrity.checksums import sha256
from study_app.store.journals.journal import Journal
from tests.platforms import files_up_to, needs_posix


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_failed_write_keeps_the_old_file_and_leaves_no_temporary_file(tmp_path: Path) -> None:
    table, lines = tmp_path / "table.csv", tmp_path / "reveals.jsonl"
    write_file(table, b"old\n")
    append_line(lines, b"1\n")
    for size, act, sentence in (
        (1000, lambda: write_file(table, b"new\n" * 100_000), r"table\.csv cannot be written \(File too large\)"),
        (1000, lambda: create_folder(tmp_path / "blinding", {"key": b"x" * 5000}), "blinding cannot be written"),
        (100, lambda: append_line(lines, b"x" * 5000 + b"\n"), r"reveals\.jsonl cannot be written"),
        (
            3,
            lambda: probe_free_bytes(tmp_path / "results"),
            r"results cannot be written \(File too large\): free disk space",
        ),
        (3, lambda: probe_free_bytes(table), r"table\.csv cannot be written \(there is a file where a folder"),
    ):
        with files_up_to(size), pytest.raises(StoreError, match=sentence):
            act()
    assert (table.read_bytes(), lines.read_bytes()) == (b"old\n", b"1\n")
    assert names_in(tmp_path) == ["reveals.jsonl", "table.csv"]


def test_a_clock_ahead_does_not_remove_temporary_files_in_use(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    new, old = temporary_path(tmp_path / "table"), temporary_path(tmp_path / "table")
    for path in (new, old):
        path.write_text("half", encoding="utf-8", newline="\n")
    os.utime(old, (time.time() - 2 * OLD_S,) * 2)
    monkeypatch.setattr(time, "time", lambda: new.stat().st_mtime + 2 * OLD_S)
    remove_old_temporary_files(tmp_path)
    assert names_in(tmp_path) == [new.name]


def test_old_temporary_files_are_removed_without_waiting_for_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[int] = []
    monkeypatch.setattr(os, "fsync", flushed.append)
    old = temporary_path(tmp_path / "table")
    old.write_text("half", encoding="utf-8", newline="\n")
    os.utime(old, (time.time() - 2 * OLD_S,) * 2)
    remove_old_temporary_files(tmp_path)
    assert (names_in(tmp_path), flushed) == ([], [])


def test_lines_are_appended_after_a_torn_one_without_losing_either(tmp_path: Path) -> None:
    path = tmp_path / "reveals.jsonl"
    append_line(path, b"1\n")
    with path.open("ab") as file:
        file.write(b"tor")
    append_line(path, b"2\n")
    append_line(path, b"3\n")
    assert path.read_bytes() == b"1\ntor\n2\n3\n"


@needs_posix
def test_a_file_is_on_the_disk_before_it_takes_its_place_and_its_place_after(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A power cut then leaves either the old file or the new one."""
    path = tmp_path / "table.csv"
    write_file(path, b"old\n")
    writes: list[tuple[bytes, int]] = []
    monkeypatch.setattr("os.fsync", lambda _: writes.append((path.read_bytes(), len(names_in(tmp_path)))))
    write_file(path, b"new\n")
    assert writes == [(b"old\n", 2), (b"new\n", 1)]


@pytest.mark.parametrize("offered", [True, False])
def test_macos_flushes_the_drive_itself_where_it_can(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, offered: bool
) -> None:
    """By a double: F_FULLFSYNC is 51 in <sys/fcntl.h>, and fails with ENOTTY where a drive lacks it."""
    fcntl = pytest.importorskip("fcntl", reason="POSIX")
    flushed: list[str] = []

    def full(_descriptor: int, command: int) -> None:
        assert command == 51
        if not offered:
            raise OSError(25, "Inappropriate ioctl for device")
        flushed.append("drive")

    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(fcntl, "F_FULLFSYNC", 51, raising=False)
    monkeypatch.setattr(fcntl, "fcntl", full)
    monkeypatch.setattr(os, "fsync", lambda _: flushed.append("system"))
    write_file(tmp_path / "table.csv", b"1\n")
    assert flushed == ["drive" if offered else "system"] * 2


@needs_posix  # other systems write the zeros
@pytest.mark.timeout(30)
@pytest.mark.parametrize("read", [read_if_there, sha256])
def test_a_huge_file_is_refused_before_memory_or_time_runs_out(read: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "exclusions.csv"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(StoreError, match="cannot be read"):
        read(path)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems flush folders or files in their own way")
def test_each_writer_flushes_the_content_first_and_then_the_entry_in_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[str] = []

    def record_flush(descriptor: int) -> None:
        name = Path(f"/proc/self/fd/{descriptor}").readlink().name
        flushed.append(re.sub(r"^\.(.*)\.[0-9a-f]{8}\.tmp$", r"\1 (temporary)", name))

    monkeypatch.setattr("os.fsync", record_flush)
    top = tmp_path / "top"
    top.mkdir()
    (tmp_path / "source" / "inner").mkdir(parents=True)
    (tmp_path / "source" / "inner" / "leaf").write_bytes(b"leaf")
    writers: tuple[tuple[Callable[[], object], list[str]], ...] = (
        (lambda: write_file(top / "file", b"1"), ["file (temporary)", "top"]),
        (lambda: write_file(top / "cache", b"1", waits=False), []),
        (lambda: append_line(top / "list", b"1\n"), ["list", "top"]),
        (lambda: append_line(top / "list", b"2\n", waits=False), []),
        (lambda: Journal.create(top / "journal").close(), ["top"]),
        (lambda: make_folder(top / "a" / "b"), ["a", "top"]),
        (lambda: make_folder(top / "c" / "d", waits=False), []),
        (lambda: create_folder(top / "claim", {"entry": b"1"}), ["entry", "claim (temporary)", "top"]),
        (lambda: create_folder(top / "probe", {"entry": b"1"}, waits=False), []),
        (lambda: copy_folder(tmp_path / "source", top / "copy"), ["leaf", "copy (temporary)", "inner", "top"]),
    )
    for write, expected in writers:
        flushed.clear()
        write()
        assert flushed == expected
    assert (top / "list").read_bytes() == b"1\n2\n"
    assert (top / "copy" / "inner" / "leaf").read_bytes() == b"leaf"
