"""Files that another program has open, on Windows: nothing is half-written, and messages name the file."""

from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.errors import AnalysisError
from study_app.store.atomic import copy_folder, create_folder, write_file
from study_app.store.output_files import write_files
from study_app.store.verification.verify_study import verify_study
from tests.store.conftest import Start
from tests.windows_rules import Windows, windows

__all__ = ["windows"]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_an_output_over_a_file_that_is_open_elsewhere_replaces_no_file(tmp_path: Path, windows: Windows) -> None:
    old = {"responses.csv": b"old\n", "trials.csv": b"old\n", "tables/mean.csv": b"old\n"}
    write_files(tmp_path, old)
    new = dict.fromkeys(old, b"new\n")
    with windows.hold(tmp_path / "trials.csv"), pytest.raises(AnalysisError) as refused:
        write_files(tmp_path, new)
    assert f"{tmp_path / 'trials.csv'} cannot be replaced (Permission denied): close the program" in str(refused.value)
    assert contents(tmp_path) == old
    write_files(tmp_path, new)
    assert contents(tmp_path) == new


def make_folder(tmp_path: Path) -> Path:
    assert create_folder(tmp_path / "made", {"key": b"1"})
    return tmp_path / "made"


def make_copy(tmp_path: Path) -> Path:
    write_file(tmp_path / "key", b"1")
    (tmp_path / "from").mkdir()
    (tmp_path / "key").rename(tmp_path / "from" / "key")
    copy_folder(tmp_path / "from", tmp_path / "copy")
    return tmp_path / "copy"


@pytest.mark.parametrize(("make", "name"), [(make_folder, "made"), (make_copy, "copy")])
def test_a_folder_that_a_scanner_reads_is_renamed_when_it_has_finished(
    tmp_path: Path, windows: Windows, make: Callable[[Path], Path], name: str
) -> None:
    with windows.hold(tmp_path / name / "key", calls=2):
        assert contents(make(tmp_path)) == {"key": b"1"}
    assert len(windows.refused) == 2


def test_sessions_begin_and_end_while_the_participants_table_is_open_elsewhere(
    start: Start, windows: Windows, caplog: pytest.LogCaptureFixture
) -> None:
    with start("P001") as first:
        first.finish("completed")
    study, table = first.place.study_folder, first.place.study_folder.participants("brackish")
    before = table.read_bytes()
    with windows.hold(table):
        with start("P002") as second:
            second.finish("completed")
        assert table.read_bytes() == before
        assert f"{table} cannot be written (Permission denied)" in caplog.text
    caplog.clear()
    with start("P003") as third:
        third.finish("completed")
    assert [b"P002" in before, b"P002" in table.read_bytes()] == [False, True]
    assert verify_study(study.path).errors == ()
