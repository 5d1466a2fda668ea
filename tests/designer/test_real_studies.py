"""Studies made from the empty one in a real window: by keys alone and by mouse alone; then saved, rehearsed and run."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.compiled import needs_servo
from tests.designer.support.made_studies import STUDIES, check_file
from tests.designer.support.program import environment
from tests.designer.support.users import USERS
from tests.end_to_end.real_windows import needs_display, virtual_display

ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 900.0


def command(folder: Path, *words: str) -> str:
    """Run a command of the program; return what it prints."""
    ran = subprocess.run(
        [sys.executable, "-m", "study_app", *words],
        cwd=ROOT, env=environment(folder), capture_output=True, text=True, check=False, timeout=LIMIT_S,
    )  # fmt: skip
    assert ran.returncode == 0, (words, ran.stdout, ran.stderr)
    return ran.stdout


@pytest.mark.nightly
@pytest.mark.xvfb
@needs_servo
@needs_display
@pytest.mark.timeout(4 * LIMIT_S)
@pytest.mark.parametrize("user", USERS)
@pytest.mark.parametrize("study", STUDIES)
def test_a_study_is_made_from_the_empty_one_and_run(tmp_path: Path, user: str, study: str) -> None:
    (tmp_path / "protocols").mkdir()
    (tmp_path / "results").mkdir()
    with virtual_display(size=(1366, 768)) as display:
        ran = subprocess.run(
            [sys.executable, "-m", "tests.designer.support.program", user, study, str(tmp_path)],
            cwd=ROOT, env=environment(tmp_path) | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb"},
            capture_output=True, text=True, check=False, timeout=LIMIT_S,
        )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert int(ran.stdout) < 600, "actions"
    file = tmp_path / "protocols" / f"{study}.toml"
    check_file(file, study)
    command(tmp_path, "check", str(file))
    command(tmp_path, "rehearse", str(file))
    for folder in (f"{study}-pilot-1", f"{study}-rehearsal-1"):
        command(tmp_path, "verify", str(tmp_path / "results" / folder))
    (journal,) = (tmp_path / "results" / f"{study}-pilot-1").glob("data/sub-*/ses-01/journal.jsonl")
    events = [json.loads(line) for line in journal.read_bytes().splitlines()]
    assert any(event["event"] == "choice" for event in events)  # a busy machine leaves out trials that it disturbed
    assert events[-1]["event"] == "session_ended"
    assert events[-1]["status"] == "completed"
