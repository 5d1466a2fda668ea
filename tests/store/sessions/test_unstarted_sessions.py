"""Programs that are killed between claiming a session and its first line: the session can be begun all the same."""

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import pytest

from study_app import app
from study_app.errors import StoreError
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.folder_lock import is_abandoned, is_never_begun, lock_folder, markers
from study_app.store.journals import journal, journal_events
from study_app.store.sessions import begin, open_session
from study_app.store.sessions.begin import used_ids
from study_app.store.sessions.recovery import reopen_store
from study_app.store.verification.whole_study import verify_study
from tests.faults.support.killer import die, forked
from tests.platforms import needs_fork
from tests.store.conftest import SOURCE, Start

pytestmark = [pytest.mark.slow, needs_fork]


KILLED_BEFORE = {
    "the receipt": (begin.receipt, "write"),
    "the journal": (begin.Journal, "create"),
    "the first line": (open_session.SessionStore, "append"),
}


def half_a_line(file: Any, content: bytes) -> None:
    file.write(content[: len(content) // 2])
    die()


def killed(start: Start, participant: str, place: Any, name: str, instead: Callable[..., None] = die) -> None:
    """Begin a session in a program that dies where it calls ``place.name``."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(place, name, instead)
        assert forked(lambda: start(participant)) == -signal.SIGKILL


@pytest.fixture
def study(tmp_path: Path, start: Start) -> StudyFolder:
    """A study in which P003 was."""
    with start("P003") as store:
        store.finish("completed")
    return StudyFolder(tmp_path / "study")


@pytest.fixture(params=[*KILLED_BEFORE, "the end of the first line", "anything was in the folder"])
def unstarted_study(request: pytest.FixtureRequest, study: StudyFolder, start: Start) -> StudyFolder:
    """The study after a program that claimed P004 was killed before the named step."""
    if request.param in KILLED_BEFORE:
        killed(start, "P004", *KILLED_BEFORE[request.param])
    elif request.param == "the end of the first line":
        killed(start, "P004", journal, "write_all", half_a_line)
    else:
        study.session("P004", 1).path.mkdir(parents=True)
    assert study.session("P004", 1).path.is_dir()
    return study


def test_an_unstarted_session_cannot_be_resumed_but_begun_again(
    unstarted_study: StudyFolder, start: Start, protocol: Any
) -> None:
    place = unstarted_study.session("P004", 1)
    for go_on in (
        lambda: reopen_store(place.path, protocol, SOURCE, operator="", device={}, screens={}),
        lambda: app.resume(place.path),
    ):
        with pytest.raises(StoreError, match=r"it cannot be resumed: run a new session with participant P004"):
            go_on()
    with lock_folder(place.path):
        before = sorted(place.path.iterdir())
        with pytest.raises(StoreError, match="P004 already has session 1"):
            start("P004")
        assert sorted(place.path.iterdir()) == before
    assert used_ids(unstarted_study).suggested() == "P004"
    used_ids(unstarted_study).check_unused("P004", 1)
    with start("P004") as store:
        store.append(journal_events.PageShown(page="consent"))
        assert used_ids(unstarted_study).suggested() == "P005"
        store.finish("completed")
    with pytest.raises(StoreError, match="P004 already has session 1"):
        start("P004")
    verification = verify_study(unstarted_study.path)
    assert (verification.errors, verification.warnings) == ((), ())
    assert (place.path / "journal.jsonl").read_text("utf-8").startswith('{"n":1,"event":"session_started"')


def test_a_failure_after_taking_over_leaves_no_folder(
    unstarted_study: StudyFolder, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(begin.receipt, "write", mock.Mock(side_effect=StoreError("no space")))
    with pytest.raises(StoreError, match="no space"):
        start("P004")
    assert not unstarted_study.session("P004", 1).path.parent.exists()


def test_files_of_a_program_killed_during_its_claim_are_removed_by_the_next_claim(
    study: StudyFolder, start: Start
) -> None:
    place = study.session("P004", 1).path.parent
    killed(start, "P004", Path, "rename")  # what makes the folder the session's
    (half,) = place.iterdir()
    assert half.name.startswith(".ses-01.")
    assert markers(half)
    start("P003", session=2).close()
    assert half.is_dir(), "another participant's"
    assert used_ids(study).suggested() == "P004"
    start("P004").finish("completed")
    assert [path.name for path in place.iterdir()] == ["ses-01"]
    assert verify_study(study.path).errors == ()


def test_a_claim_whose_program_lives_or_is_not_known_stays(study: StudyFolder, start: Start) -> None:
    place = study.session("P004", 1).path.parent
    claimed, unmarked, old = (place / f".ses-02.{number:08x}.tmp" for number in range(3))
    for half in (claimed, unmarked, old):
        half.mkdir(parents=True)
    lock_folder(claimed)
    os.utime(old, (0, 0))
    os.utime(claimed, (0, 0))
    start("P004").close()
    assert {path.name for path in place.iterdir()} == {claimed.name, unmarked.name, "ses-01"}


def test_a_session_that_began_is_never_taken_over(study: StudyFolder, start: Start) -> None:
    start("P005").close()
    folder = study.session("P005", 1)
    whole = folder.journal.read_bytes()
    folder.journal.write_bytes(b"#" + whole + whole)
    assert not is_never_begun(folder.path)
    for missing in (folder.receipt, folder.journal):
        missing.unlink()
        assert not is_abandoned(folder.path), "its tables are there"
        with pytest.raises(StoreError, match="P005 already has session 1"):
            start("P005")
