import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import psutil
import pytest

from study_app.errors import StoreError
from study_app.store.folders import StudyFolder, locate, study_folder
from study_app.store.sessions.folder_lock import is_open, markers, open_alone, process_began
from study_app.store.sessions.participant_ids import check_participant, check_unused, used_ids


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


def with_sessions(path: Path, *names: str) -> StudyFolder:
    for name in names:
        (path / "data" / name).mkdir(parents=True)
        (path / "data" / name / "checksums.sha256").touch()  # something that comes after a session's beginning
    return StudyFolder(path)


def test_pilot_sessions_have_a_folder_of_their_own() -> None:
    assert study_folder(Path("results"), "rek2024", pilot=True).path == Path("results/rek2024-pilot")


@pytest.mark.parametrize("good", ["P007", "7", "anna", "X" * 32, "Tester", "pilot2"])
def test_letters_and_digits_are_permitted(good: str) -> None:
    check_participant(good)


@pytest.mark.parametrize("bad", ["P-07", "", "P 07", "P_07", "../P07", "Pé", "P07\n", "٣", "X" * 33, "P/7"])
def test_anything_else_is_refused_with_the_id_and_what_is_permitted(bad: str) -> None:
    with pytest.raises(StoreError) as refusal:
        check_participant(bad)
    assert repr(bad) in str(refusal.value)
    assert "only letters A-Z, a-z and digits 0-9 are permitted, at most 32, no dash" in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("reserved", ["test", "pilot", "Test", "PILOT"])
def test_the_ids_of_trial_runs_are_refused_but_in_a_pilot(reserved: str) -> None:
    with pytest.raises(StoreError, match=rf"'{reserved}' is reserved for pilot sessions"):
        check_participant(reserved)
    check_participant(reserved, pilot=True)


def test_sessions_are_found_in_order_and_strangers_passed_over(tmp_path: Path) -> None:
    folder = with_sessions(tmp_path, "sub-P010/ses-01", "sub-P002/ses-02", "sub-P002/ses-01", "sub-P003/old", "notes")
    assert [(session.participant, session.number) for session in folder.sessions()] == [
        ("P002", 1),
        ("P002", 2),
        ("P010", 1),
    ]
    assert folder.ids() == ("P002", "P010")
    assert folder.sessions()[1].path == folder.session("P002", 2).path


def test_the_next_free_id_is_suggested(tmp_path: Path) -> None:
    assert used_ids(StudyFolder(tmp_path / "none")).suggested() == "P001"
    folder = with_sessions(tmp_path, "sub-P010/ses-01", "sub-anna/ses-01", "sub-p011/ses-01")
    assert used_ids(folder).suggested() == "P012"


def test_a_used_session_is_refused_with_three_ways_to_go_on(tmp_path: Path) -> None:
    folder = with_sessions(tmp_path, "sub-P002/ses-01", "sub-P002/ses-02")
    with pytest.raises(StoreError) as refusal:
        check_unused(folder, "P002", 1)
    message = str(refusal.value)
    assert "participant P002 already has session 1" in message
    assert "use a new session number (3), resume that session, or use another id (next free: P003)" in message
    assert "nothing was changed" in message
    check_unused(folder, "P002", 3)
    check_unused(folder, "P004", 1)


def test_an_id_that_differs_in_capitals_alone_is_refused(tmp_path: Path) -> None:
    """Some file systems cannot tell them apart, and neither can people."""
    folder = with_sessions(tmp_path, "sub-P002/ses-01")
    with pytest.raises(StoreError, match="'p002' differs from the used 'P002' only in capitalisation"):
        check_unused(folder, "p002", 2)


@pytest.mark.parametrize("number", [0, -1, 100])
def test_session_numbers_have_two_digits(tmp_path: Path, number: int) -> None:
    with pytest.raises(StoreError, match=f"session number {number} cannot be used: it must be from 1 to 99"):
        check_unused(StudyFolder(tmp_path), "P001", number)


def test_a_sessions_folder_is_known_from_its_path(tmp_path: Path) -> None:
    study = StudyFolder(tmp_path.resolve() / "rek2024")
    session = study.session("P007", 3)
    session.path.mkdir(parents=True)
    assert locate(session.path) == (study, session)
    (tmp_path / "link").symlink_to(session.path)
    assert locate(tmp_path / "link") == (study, session)


@pytest.mark.parametrize(
    "name",
    ["rek2024/data/sub-P007", "rek2024/data/P007/ses-01", "rek2024/data/sub-P-7/ses-01", "sub-P007/ses-01", "gone"],
)
def test_other_folders_are_no_sessions(tmp_path: Path, name: str) -> None:
    if name != "gone":
        (tmp_path / name).mkdir(parents=True)
    with pytest.raises(StoreError, match="is not a session folder: name one such as results/rek2024/data"):
        locate(tmp_path / name)
