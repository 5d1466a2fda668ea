"""Files that another program has open, and paths that are too long, on Windows: messages name the file."""

import logging
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app import program_log
from study_app.errors import AnalysisError, DeviceError, StoreError
from study_app.store.files.atomic import copy_folder, create_folder, write_file
from study_app.store.files.output_files import write_files
from study_app.store.verification.whole_study import verify_study
from tests.store.conftest import Start, contents
from tests.windows_rules import LONGEST_PATH, Windows, windows

__all__ = ["windows"]


def test_an_output_does_not_replace_files_if_one_is_open_elsewhere(tmp_path: Path, windows: Windows) -> None:
    old = {"responses.csv": b"old\n", "trials.csv": b"old\n", "tables/mean.csv": b"old\n"}
    write_files(tmp_path, old)
    new = dict.fromkeys(old, b"new\n")
    with windows.hold(tmp_path / "trials.csv"), pytest.raises(AnalysisError) as error:
        write_files(tmp_path, new)
    assert f"{tmp_path / 'trials.csv'} cannot be replaced (Permission denied): close the program" in str(error.value)
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


def test_a_session_whose_paths_would_be_too_long_does_not_begin(start: Start, tmp_path: Path, windows: Windows) -> None:
    """The longest path, the temporary file of the responses table, has 104 characters below the results folder."""
    for room, begins in ((103, False), (104, True)):
        results = tmp_path / ("r" * (LONGEST_PATH - room - len(str(tmp_path)) - 1))
        if begins:
            start(results=results).close()
        else:
            with pytest.raises(StoreError, match=r"_data\.csv.*; 260 characters\): move the workspace to a folder"):
                start(results=results)
            assert not list(results.rglob("sub-*"))
    assert windows.refused == []


def test_two_programs_write_one_log(tmp_path: Path, windows: Windows, monkeypatch: pytest.MonkeyPatch) -> None:
    """A log that another program has open cannot be renamed: it grows, and every record is kept."""
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path))
    logger = logging.getLogger("study_app")
    monkeypatch.setattr(logger, "handlers", [])
    monkeypatch.setattr(program_log, "_MOST_BYTES", 1000)
    monkeypatch.setattr(logging, "lastResort", None)
    program_log.start_log()
    with windows.hold(program_log.log_file(), shared=True):
        for number in range(30):
            logger.info("record %s", DeviceError(f"number {number:02d}"))
    logger.info("the other program has ended")
    logger.handlers[0].close()
    assert re.findall("number ([0-9]+)", program_log.read_log()) == [f"{number:02d}" for number in range(30)]
    assert "ended" in program_log.log_file().read_text("utf-8")
    assert program_log.log_file().stat().st_size < 1000
