import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import psutil
import pytest

from study_app.errors import StoreError
from study_app.store.sessions.folder_lock import is_open, markers, open_alone, process_began


def other(folder: Path, **changes: Any) -> Path:
    """Leave the marker of another program in ``folder``."""
    with_own = open_alone(folder)
    holder = json.loads(with_own.marker.read_bytes()) | changes
    with_own.release()
    marker = folder / ".open-0123abcd.json"
    marker.write_text(json.dumps(holder))
    return marker


def ended_process() -> int:
    with subprocess.Popen([sys.executable, "-c", ""]) as program:
        program.wait()
    return program.pid


def test_a_folder_is_open_in_one_program_until_it_lets_go(tmp_path: Path) -> None:
    first = open_alone(tmp_path)
    assert is_open(tmp_path)
    with pytest.raises(
        StoreError, match=rf"is open in another program \(process {os.getpid()} on .*: wait for it, or end it there"
    ):
        open_alone(tmp_path)
    assert markers(tmp_path) == (first.marker,)
    first.release()
    assert not is_open(tmp_path)
    open_alone(tmp_path).release()
    assert list(tmp_path.iterdir()) == []


def test_letting_go_twice_is_no_harm(tmp_path: Path) -> None:
    first = open_alone(tmp_path)
    first.release()
    first.release()


@pytest.mark.parametrize(
    "changes",
    [{"pid": "ended"}, {"pid": os.getpid(), "began": 0.25}],
    ids=["the process has ended", "another process has its number now"],
)
def test_the_marker_of_a_program_that_is_gone_is_passed_over(tmp_path: Path, changes: dict[str, Any]) -> None:
    if changes["pid"] == "ended":
        changes = {"pid": ended_process()}
    marker = other(tmp_path, **changes)
    assert not is_open(tmp_path)
    mine = open_alone(tmp_path)
    assert markers(tmp_path) == (mine.marker,)
    assert not marker.exists()
    mine.release()


def test_a_killed_program_that_nobody_has_waited_for_is_gone(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as program:
        other(tmp_path, pid=program.pid, began=process_began(program.pid))
        assert is_open(tmp_path)
        program.kill()
        os.waitid(os.P_PID, program.pid, os.WEXITED | os.WNOWAIT)
        assert not is_open(tmp_path)


@pytest.mark.parametrize(
    "changes",
    [{"host": "another-machine"}, {"pid": None}, {"began": "1d2f 4711"}, {"began": None}],
    ids=["of another machine", "without a process", "as earlier versions wrote it", "without a time"],
)
def test_a_program_that_may_live_is_not_disturbed(tmp_path: Path, changes: dict[str, Any]) -> None:
    marker = other(tmp_path, **changes)
    with pytest.raises(StoreError, match=r"if that program is gone, delete .*\.open-0123abcd\.json"):
        open_alone(tmp_path)
    assert markers(tmp_path) == (marker,)


def test_a_marker_that_makes_no_sense_is_taken_for_a_living_program(tmp_path: Path) -> None:
    (tmp_path / ".open-0123abcd.json").write_text("{torn")
    assert is_open(tmp_path)
    with pytest.raises(StoreError, match="is open in another program"):
        open_alone(tmp_path)


def test_other_files_are_no_markers(tmp_path: Path) -> None:
    for name in (".open-me.json", "open-0123abcd.json", ".open-0123abcd.json.bak"):
        (tmp_path / name).write_text("{}")
    open_alone(tmp_path).release()
    assert len(list(tmp_path.iterdir())) == 3


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"\.open-.*\.json cannot be written \(No such file or directory\)"):
        open_alone(tmp_path / "gone")


def test_a_process_of_which_nothing_may_be_known_is_taken_for_a_living_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def denied(_process: psutil.Process) -> str:
        raise psutil.AccessDenied

    other(tmp_path)
    monkeypatch.setattr(psutil.Process, "status", denied)
    assert is_open(tmp_path)


def test_setting_the_clock_ends_no_opening(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On Linux the wall time at which a process began is computed from the clock of now."""
    opening = open_alone(tmp_path)
    create_time, boot_time = psutil.Process.create_time, psutil.boot_time
    monkeypatch.setattr(psutil.Process, "create_time", lambda self: create_time(self) + 3600 * psutil.LINUX)
    monkeypatch.setattr(psutil, "boot_time", lambda: boot_time() + 3600)
    assert is_open(tmp_path)
    opening.release()


RACER = """
import sys
from pathlib import Path
from study_app.errors import StoreError
from study_app.store.sessions.folder_lock import open_alone
print("ready", flush=True)
held = None
for line in sys.stdin:
    if held:
        held.release()
        held = None
    try:
        held = open_alone(Path(line.strip()))
    except StoreError:
        print("refused", flush=True)
    else:
        print("open", flush=True)
"""


@pytest.mark.slow
def test_of_programs_that_come_at_once_never_two_get_in(tmp_path: Path) -> None:
    """A stale marker lies in every folder, which both want to take away."""
    gone = ended_process()
    racers = [
        subprocess.Popen([sys.executable, "-c", RACER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(3)
    ]
    won = 0
    try:
        assert [racer.stdout.readline() for racer in racers if racer.stdout] == ["ready\n"] * 3
        for number in range(100):
            folder = tmp_path / f"ses-{number}"
            folder.mkdir()
            other(folder, pid=gone)
            for racer in racers:
                assert racer.stdin
                racer.stdin.write(f"{folder}\n")
                racer.stdin.flush()
            answers = [racer.stdout.readline() for racer in racers if racer.stdout]
            assert answers.count("open\n") <= 1
            won += answers.count("open\n")
    finally:
        for racer in racers:
            racer.communicate()
    assert won > 0
