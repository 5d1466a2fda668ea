import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

import psutil
import pytest

from study_app.errors import StoreError
from study_app.store.files.folders import StudyFolder, locate_session, study_folder
from study_app.store.integrity import folder_lock
from study_app.store.integrity.folder_lock import is_open, lock_folder, markers, process_start_s, take_over_folder
from study_app.store.sessions.begin import used_ids
from tests.faults.support.racers import race
from tests.platforms import needs_fork, needs_links, needs_posix


def other(folder: Path, **changes: Any) -> Path:
    """Leave the marker of another program in ``folder``."""
    with_own = lock_folder(folder)
    holder = json.loads(with_own.marker.read_bytes()) | changes
    with_own.release()
    marker = folder / ".open-0123abcd.json"
    marker.write_text(json.dumps(holder), encoding="utf-8", newline="\n")
    return marker


def ended_process() -> int:
    with subprocess.Popen([sys.executable, "-c", ""]) as program:
        program.wait()
    return program.pid


def test_a_folder_is_open_in_one_program_until_it_lets_go(tmp_path: Path) -> None:
    for name in (".open-me.json", "open-0123abcd.json", ".open-0123abcd.json.bak"):
        (tmp_path / name).write_text("of no program", encoding="utf-8", newline="\n")
    first = lock_folder(tmp_path)
    assert is_open(tmp_path)
    at = re.escape(json.loads(first.marker.read_bytes())["at"])
    by = rf"is open in another program \(process {os.getpid()} on .*, since {at}\): wait for it, or close it there"
    with pytest.raises(StoreError, match=by):
        lock_folder(tmp_path)
    assert markers(tmp_path) == (first.marker,)
    for _ in range(2):
        first.release()
        assert not is_open(tmp_path)
    lock_folder(tmp_path).release()
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize(
    "changes",
    [{"pid": "ended"}, {"pid": os.getpid(), "began": 0.25}],
    ids=["the process has ended", "another process has its number now"],
)
def test_the_marker_of_an_ended_program_is_ignored(tmp_path: Path, changes: dict[str, Any]) -> None:
    if changes["pid"] == "ended":
        changes = {"pid": ended_process()}
    marker = other(tmp_path, **changes)
    assert not is_open(tmp_path)
    mine = lock_folder(tmp_path)
    assert markers(tmp_path) == (mine.marker,)
    assert not marker.exists()
    mine.release()


@needs_posix
def test_a_session_that_another_program_began_meanwhile_is_not_taken_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opening = take_over_folder(tmp_path)
    assert opening is not None
    assert (take_over_folder(tmp_path), is_open(tmp_path)) == (None, True)
    assert take_over_folder(tmp_path / "nowhere") is None
    opening.release()
    never_begun = iter((True, False))
    monkeypatch.setattr(folder_lock, "is_never_begun", lambda _path: next(never_begun))
    assert (take_over_folder(tmp_path), is_open(tmp_path)) == (None, False)


@pytest.mark.skipif(sys.platform == "win32", reason="a killed program of Windows is gone at once")
def test_a_killed_program_counts_as_ended_before_it_is_reaped(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as program:
        other(tmp_path, pid=program.pid, began=process_start_s(program.pid))
        assert is_open(tmp_path)
        program.kill()
        os.waitid(os.P_PID, program.pid, os.WEXITED | os.WNOWAIT)
        assert not is_open(tmp_path)


@pytest.mark.parametrize(
    "holder",
    ['{"host": "another-machine", "pid": 1, "began": 0.25}', "{torn", '{"host": HOST, "pid": null, "began": 0.25}']
    + [f'{{"host": HOST, "pid": {os.getpid()}, "began": {began}}}' for began in ('"1d2f 4711"', "null")],
    ids=["another host", "torn", "no process", "other clock", "no start"],
)
def test_a_program_that_may_live_is_not_disturbed(tmp_path: Path, holder: str) -> None:
    marker = other(tmp_path)
    marker.write_text(holder.replace("HOST", json.dumps(platform.node())), encoding="utf-8", newline="\n")
    assert is_open(tmp_path)
    with pytest.raises(StoreError, match=r"if that program is no longer running, delete .*\.open-0123abcd\.json"):
        lock_folder(tmp_path)
    assert markers(tmp_path) == (marker,)


def test_neither_a_set_clock_nor_a_hidden_process_ends_an_opening(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On Linux the wall time at which a process began is computed from the clock of now."""
    opening = lock_folder(tmp_path)
    create_time, boot_time = psutil.Process.create_time, psutil.boot_time
    monkeypatch.setattr(psutil.Process, "create_time", lambda self: create_time(self) + 3600 * psutil.LINUX)
    monkeypatch.setattr(psutil, "boot_time", lambda: boot_time() + 3600)
    assert is_open(tmp_path)
    monkeypatch.setattr(psutil.Process, "status", mock.Mock(side_effect=psutil.AccessDenied))
    assert is_open(tmp_path)
    opening.release()


@needs_links
def test_a_marker_removed_before_it_is_read_does_not_lock_the_folder(tmp_path: Path) -> None:
    (tmp_path / ".open-0123abcd.json").symlink_to(tmp_path / "removed")
    assert not is_open(tmp_path)


@pytest.mark.slow
@needs_fork
def test_concurrent_programs_never_hold_the_same_folder_lock(tmp_path: Path) -> None:
    """A stale marker lies in every folder, which all want to take away."""
    ended_pid = ended_process()
    for number in range(60):
        (tmp_path / str(number)).mkdir()
        other(tmp_path / str(number), pid=ended_pid)

    @contextmanager
    def opened(_program: int, number: int) -> Iterator[bool]:
        try:
            opening = lock_folder(tmp_path / str(number))
        except StoreError:
            yield False
        else:
            yield True
            opening.release()

    entered = [sum(answers) for answers in race(opened, 60, programs=3)]
    assert set(entered) <= {0, 1}
    assert 1 in entered


def with_sessions(path: Path, *names: str) -> StudyFolder:
    for name in names:
        (path / "data" / name).mkdir(parents=True)
        (path / "data" / name / "checksums.sha256").touch()  # something that comes after a session's beginning
    return StudyFolder(path)


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


def test_a_used_session_number_is_refused_with_three_remedies(tmp_path: Path) -> None:
    folder = with_sessions(tmp_path, "sub-P002/ses-01", "sub-P002/ses-02")
    with pytest.raises(StoreError) as refusal:
        used_ids(folder).check_unused("P002", 1)
    message = str(refusal.value)
    assert "participant P002 already has session 1" in message
    assert "use a new session number (3), resume that session, or use another ID (next free: P003)" in message
    assert "nothing was changed" in message
    used_ids(folder).check_unused("P002", 3)
    used_ids(folder).check_unused("P004", 1)


@needs_links
def test_a_sessions_folder_is_known_from_its_path(tmp_path: Path) -> None:
    study = StudyFolder(tmp_path.resolve() / "rek2024")
    session = study.session("P007", 3)
    session.path.mkdir(parents=True)
    assert locate_session(session.path) == (study, session)
    (tmp_path / "link").symlink_to(session.path)
    assert locate_session(tmp_path / "link") == (study, session)
    assert study_folder(Path("results"), "rek2024", pilot=True).path == Path("results/rek2024-pilot")


@pytest.mark.parametrize(
    "name",
    ["rek2024/data/sub-P007", "rek2024/data/P007/ses-01", "rek2024/data/sub-P-7/ses-01", "sub-P007/ses-01", "gone"],
)
def test_a_folder_without_a_session_is_refused(tmp_path: Path, name: str) -> None:
    if name != "gone":
        (tmp_path / name).mkdir(parents=True)
    with pytest.raises(StoreError, match="is not a session folder: specify one such as results/rek2024/data"):
        locate_session(tmp_path / name)
