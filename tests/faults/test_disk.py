"""A full disk: it prevents a session, a running session waits, and no data are lost or doubled."""

import csv
import shutil
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.session.pages import EndPage, PausePage, TroublePage
from study_app.session.runner import RETRY_S
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.session.transitions.events import Note
from study_app.session.transitions.state import Phase
from study_app.store.exclusions import exclude
from study_app.store.journals import journal
from study_app.store.sessions.recovery import rebuild_session
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import withdraw
from tests.benchmarks.sessions import disk
from tests.faults.support.worlds import StoredWorld
from tests.platforms import files_up_to
from tests.session import small
from tests.studies import made_up

MOST_CALLS = 300
P001 = "data/sub-P001/ses-01"
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits the size of files as POSIX systems can")


def finish(world: StoredWorld) -> None:
    world.until(Phase.COMPLETE)
    assert isinstance(world.pages[-1], EndPage)


def answers(world: StoredWorld) -> list[tuple[str, str, str]]:
    with world.store.folder.table("small", "responses").open(newline="", encoding="utf-8") as file:
        return [(row["trial"], row["item"], row["response"]) for row in csv.DictReader(file)]


@pytest.mark.variants(5)
@pytest.mark.slow
@pytest.mark.parametrize("phase", [Phase.READING, Phase.TASK, Phase.ANSWERING])
@pytest.mark.parametrize("room", [0, 1, 40])
def test_a_disk_that_fills_up_is_waited_for_and_nothing_is_lost_or_doubled(
    tmp_path: Path, phase: Phase, room: int
) -> None:
    undisturbed, world = StoredWorld(tmp_path / "one"), StoredWorld(tmp_path / "two")
    for each in (undisturbed, world):
        each.start()
        each.until(phase)
    path = world.store.folder.journal
    with files_up_to(path.stat().st_size + room):
        world.runner.post(Note(world.clock(), "note", "as long as a line of the journal is wont to be"))
        assert isinstance(world.pages[-1], TroublePage)
        assert "journal" in (world.runner.stalled or "")
        assert journal.scan(path).torn_bytes == 0
        world.run(3 * RETRY_S)
        assert isinstance(world.pages[-1], TroublePage)
    world.run(RETRY_S + 0.1)
    assert world.runner.stalled is None
    assert isinstance(world.pages[-1], PausePage)
    for each in (undisturbed, world):
        finish(each)
    assert len(answers(world)) == small.RESPONSES
    assert answers(world) == answers(undisturbed)
    assert [line["n"] for line in world.lines] == list(range(1, len(world.lines) + 1))
    assert [line["event"] for line in world.lines].count("note") == 1
    assert verify_study(tmp_path / "two").errors == ()


@pytest.mark.slow
def test_a_session_whose_last_line_meets_a_full_disk_is_finished_when_there_is_room(tmp_path: Path) -> None:
    world = StoredWorld(tmp_path / "study")
    world.start()
    while not (world.state.phase is Phase.READING and world.state.page_id == "thanks"):
        world.step()
    with files_up_to(world.store.folder.journal.stat().st_size + 100):
        world.step()  # page_left, and no room for the end
        assert world.runner.stalled
    world.run(RETRY_S + 0.1)
    assert world.runner.stalled is None
    assert isinstance(world.pages[-1], EndPage)
    assert world.lines[-1]["status"] == "completed"
    assert verify_study(tmp_path / "study").is_sound


@pytest.mark.slow
def test_a_disk_that_is_full_at_the_start_refuses_the_session_and_keeps_its_id_free(tmp_path: Path) -> None:
    with files_up_to(200), pytest.raises(StoreError, match="cannot be written"):
        StoredWorld(tmp_path / "study")
    world = StoredWorld(tmp_path / "study")
    world.start()
    finish(world)
    assert verify_study(tmp_path / "study").errors == ()


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("kind", disk.CALLS)
def test_a_fault_at_any_call_of_the_disk_leaves_a_session_that_begins_and_ends_soundly(
    tmp_path: Path, kind: str
) -> None:
    for call in range(MOST_CALLS):
        used = disk.Disk(kind, call)
        disk.held(tmp_path / f"{call:03d}", "P001", used)
        assert verify_study(tmp_path / f"{call:03d}").errors == (), call
        if not used.happened:
            return
    raise AssertionError("the session never ended")


def unblind_completely(study: Path) -> None:
    if (left := unblind(study, "AK", "closed").left) != ():
        raise StoreError("\n".join(left))


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("answered") / "demo"
    study = rehearse_answers("demo", participants=2, seed=1, results=folder, features=made_up("demo"))
    exclude(study, "P002", 1, by="AK", reason="the phone rang")
    return study


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize("kind", disk.CALLS)
@pytest.mark.parametrize(
    "command",
    [
        unblind_completely,
        lambda study: withdraw(study, "P002", by="AK", reason="asked"),
        lambda study: rebuild_session(study / P001),
    ],
    ids=["unblind", "withdraw", "rebuild"],
)
def test_a_command_that_met_a_fault_at_any_call_of_the_disk_is_given_again(
    tmp_path: Path, answered: Path, kind: str, command: Callable[[Path], object]
) -> None:
    for call in range(MOST_CALLS):
        study, used = shutil.copytree(answered, tmp_path / f"{call:03d}"), disk.Disk(kind, call)
        for table in [] if command is unblind_completely else (study / P001).glob("*_data.csv"):
            table.unlink()
        with used.used():
            disk.tried(partial(command, study))
        rebuild_session(study / P001)
        assert verify_study(study).errors == (), call
        if not used.happened:
            return
    raise AssertionError("the command never ended")
