"""The demo does the main job anywhere, is finished by a later call whatever ended it, and then changes nothing."""

import csv
import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.studies import made_up

REPORT = Path("demo-simulated-report", "report.html")
STUDY = Path("results", "demo-simulated")

SIGKILL = getattr(signal, "SIGKILL", signal.SIGTERM)  # Windows has one way to end a process


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    return tmp_path


def digests(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def rows(workspace: Path, name: str) -> list[dict[str, str]]:
    tables = sorted((workspace / STUDY).glob(f"data/sub-*/ses-*/*description-{name}_data.csv"))
    return [row for table in tables for row in csv.DictReader(table.read_text("utf-8").splitlines())]


def start(*words: str) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "study_app", "demo", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def finish(*words: str) -> str:
    with start(*words) as program:
        output = program.communicate()[0]
    assert program.returncode == 0, output
    return output


def test_the_demo_without_analysis_libraries_keeps_its_sessions_and_names_the_extra(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rehearse_answers("demo", participants=2, seed=4, results=workspace / STUDY, features=made_up("demo"))
    for name in [name for name in sys.modules if name.startswith("study_app.analysis.report")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "markupsafe", None)
    result = CliRunner().invoke(commands, ["demo", "--no-window"])
    assert result.exit_code == 0, result.output
    (line,) = [line for line in result.output.splitlines() if line.startswith("No report: ")]
    assert "pip install 'liquid-study[analysis]'" in line
    assert not (workspace / REPORT).exists()
    assert len(rows(workspace, "responses")) == 16


@pytest.mark.parametrize(
    ("variables", "reason"),
    [
        ({"QT_QPA_PLATFORM": "offscreen"}, "QT_QPA_PLATFORM=offscreen does not show windows"),
        ({}, "no display is available|sudo apt install"),
        ({"DISPLAY": ":7654"}, "':7654'|sudo apt install"),
    ],
    ids=["offscreen", "none", "not served"],
)
@pytest.mark.skipif(sys.platform != "linux", reason="a display can be missing on Linux alone")
def test_the_demo_without_a_display_explains_how_to_open_the_program(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, variables: dict[str, str], reason: str
) -> None:
    rehearse_answers("demo", participants=2, seed=4, results=workspace / STUDY, features=made_up("demo"))
    monkeypatch.setattr("study_app.cli.demo._write_report", lambda _study, _to: [])
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    result = CliRunner().invoke(commands, ["demo"])
    assert result.exit_code == 0, result.output
    last = result.output.splitlines()[-1]
    assert last.startswith("The program was not opened: ")
    assert last.endswith("open it later with: liquid-study")
    assert any(words in last for words in reason.split("|"))


@needs_servo
@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_demo_runs_valid_sessions_and_a_second_call_keeps_them(workspace: Path) -> None:
    output = finish("--no-window")
    assert f"Report with figures and tables: {workspace / REPORT}" in output
    verification = verify_study(workspace / STUDY, None)
    assert (verification.is_sound, verification.sessions) == (True, 2)
    trials = rows(workspace, "trials")
    assert [(row["participant"], row["trial"], row["valid"]) for row in trials] == [
        (person, str(trial), "true") for person in ("P001", "P002") for trial in (1, 2, 3, 4)
    ]
    assert {row["simulated"] for row in trials} == {"true"}
    assert max(float(row["force_peak_n"]) for row in trials) > 1  # force was sent
    assert len(list((workspace / REPORT).parent.glob("*.png"))) >= 4

    note = workspace / STUDY / "data" / "note.txt"
    note.write_text("mine", encoding="utf-8", newline="\n")
    (workspace / REPORT).write_text("edited", encoding="utf-8", newline="\n")
    before = digests(workspace)
    assert "P001" not in finish("--no-window")
    assert digests(workspace) == before


def is_answered(person: str) -> Callable[[Path], bool]:
    """Return whether a person answers: the journal has more than its first lines."""

    def has_answers(workspace: Path) -> bool:
        journal = workspace / STUDY / "data" / f"sub-{person}" / "ses-01" / "journal.jsonl"
        return journal.is_file() and b'"choice"' in journal.read_bytes()

    return has_answers


def is_opened(workspace: Path) -> bool:
    return (workspace / STUDY / "blinding" / "reveals.jsonl").is_file()


@needs_servo
@pytest.mark.slow
@pytest.mark.variants(1)
@pytest.mark.skipif(os.name != "posix", reason="needs signals")
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("moment", "sent"),
    [
        (is_answered("P002"), SIGKILL),
        (is_answered("P001"), SIGKILL),
        (is_answered("P001"), signal.SIGINT),
        (is_opened, SIGKILL),
    ],
    ids=["second session killed", "first session killed", "first session interrupted", "unblinding killed"],
)
def test_an_interrupted_demo_is_finished_by_the_next_call(
    workspace: Path, moment: Callable[[Path], bool], sent: signal.Signals
) -> None:
    with start("--no-window") as program:
        while program.poll() is None and not moment(workspace):
            time.sleep(0.01)
        program.send_signal(sent)
        program.communicate()
    assert program.returncode in {-sent, 130}
    finish("--no-window")
    verification = verify_study(workspace / STUDY, None)
    assert (verification.is_sound, verification.sessions) == (True, 2), verification.errors
    confirmed = [(row["participant"], row["trial"], row["item"]) for row in rows(workspace, "responses")]
    assert len(confirmed) == len(set(confirmed)) == 16
    assert (workspace / REPORT).is_file()
    before = digests(workspace)
    finish("--no-window")
    assert digests(workspace) == before
