import faulthandler
import subprocess
import sys
from pathlib import Path

import pytest

from study_app.app.failures import CrashTrace

CRASH = """
import faulthandler, sys
from pathlib import Path
from study_app.app.failures import CrashTrace
trace = CrashTrace(Path(sys.argv[1]))
def crash_here(liquid):
    faulthandler._sigsegv()
crash_here("honey")
"""


@pytest.mark.slow
def test_a_crash_records_functions_without_values(tmp_path: Path) -> None:
    path = tmp_path / "crash.txt"
    ended = subprocess.run([sys.executable, "-c", CRASH, str(path)], capture_output=True, check=False)
    assert ended.returncode != 0
    text = path.read_text("utf-8")
    assert "Segmentation fault" in text
    assert "in crash_here" in text
    assert "honey" not in text
    CrashTrace(path).close()  # a session that goes on keeps it
    assert path.read_text("utf-8") == text


def test_without_a_crash_no_file_is_left(tmp_path: Path) -> None:
    before = faulthandler.is_enabled()
    trace = CrashTrace(tmp_path / "crash.txt")
    assert faulthandler.is_enabled()
    assert (tmp_path / "crash.txt").exists()
    trace.close()
    trace.close()
    assert list(tmp_path.iterdir()) == []
    assert faulthandler.is_enabled() == before


@pytest.mark.parametrize("before", [True, False])
def test_a_file_that_cannot_be_opened_changes_nothing(tmp_path: Path, before: bool) -> None:
    at_first = faulthandler.is_enabled()
    (faulthandler.enable if before else faulthandler.disable)()
    trace = CrashTrace(tmp_path / "missing" / "crash.txt")
    assert faulthandler.is_enabled() == before
    trace.close()
    assert faulthandler.is_enabled() == before
    (faulthandler.enable if at_first else faulthandler.disable)()
