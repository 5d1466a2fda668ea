"""Closed windows end in zero force, with all data stored and a last journal line that states the end."""

import signal
from pathlib import Path
from typing import Any

import pytest

from study_app import app
from study_app.app.session import live_session
from study_app.devices.rig import Rig
from study_app.errors import StudyError
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.session import start
from study_app.session.pages import PausePage, TaskPage
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal, journal_events
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.faults.support import short
from tests.faults.support.watched_program import Person
from tests.journal_lines import raw

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("qapp")]


@pytest.fixture(autouse=True)
def machines(monkeypatch: pytest.MonkeyPatch) -> list[Rig]:
    """Return the machines that are opened; the pre-flight takes a tenth of a second."""
    monkeypatch.setattr(start, "MEASURED_S", 0.1)
    rigs: list[Rig] = []
    open_rig = live_session.open_rig
    monkeypatch.setattr(live_session, "open_rig", lambda *a, **k: rigs.append(open_rig(*a, **k)) or rigs[-1])
    return rigs


def hold(folder: Path, watch: Any) -> tuple[int | str, list[dict[str, Any]]]:
    """Run a session; return the exit code or the error, and its journal."""
    results = folder / "results"
    person = Person(watch)
    try:
        code: int | str = app.run(
            str(short.write(folder)), participant="P001", device="scripted", windowed=True, seed=3, results=results
        )
    except StudyError as error:
        code = str(error)
    person.leave()
    (session,) = StudyFolder(results).sessions()
    assert verify_study(results).errors == ()
    return code, raw(journal.read(session.journal))


def in_tank(participant: ParticipantWindow) -> bool:
    return isinstance(participant.page, TaskPage)


@pytest.mark.nightly
def test_the_participants_window_that_is_closed_is_a_pause(tmp_path: Path, machines: list[Rig]) -> None:
    events: list[str] = []

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if not events and in_tank(participant):
            participant.windowHandle().close()  # as Alt+F4 and the cross in its frame do
            events.append("closed")
            return True
        if events == ["closed"] and isinstance(participant.page, PausePage):
            events.append(journal_events.Paused())
            operator.ask("resume")
            return True
        return False

    code, lines = hold(tmp_path, watch)
    assert (code, events) == (0, ["closed", "paused"])
    assert lines[-1]["status"] == "completed"


def test_the_operators_window_that_is_closed_twice_leaves_the_session_unfinished(
    tmp_path: Path, machines: list[Rig]
) -> None:
    forces: list[bool] = []

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if in_tank(participant) or forces:
            operator.windowHandle().close()
            forces.append(machines[0].servo.force_is_on)
            return True
        return False

    _, lines = hold(tmp_path, watch)
    assert not any(forces)
    assert "session_ended" not in [line["event"] for line in lines]


def test_a_request_to_terminate_in_a_trial_interrupts_it_and_can_be_resumed(
    tmp_path: Path, machines: list[Rig]
) -> None:
    def watch(participant: ParticipantWindow, _operator: OperatorWindow) -> bool:
        if in_tank(participant):
            signal.raise_signal(signal.SIGTERM)
            return True
        return False

    code, lines = hold(tmp_path, watch)
    assert code == 128 + signal.SIGTERM
    ended, paused, _ = lines[-3:]
    assert [line["event"] for line in lines[-3:]] == ["trial_ended", "paused", "recorded"]
    assert (ended["outcome"], paused["by"]) == ("interrupted", "program")
    assert lines[-1]["event"] != "session_ended"
    assert not machines[0].servo.force_is_on


def test_a_device_that_vanishes_is_a_calm_page_a_reason_and_a_broken_session(
    tmp_path: Path, machines: list[Rig]
) -> None:
    texts: list[tuple[str, str]] = []

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if in_tank(participant) and not texts:
            machines[0].device.unplug()  # type: ignore[attr-defined]
            return True
        page = participant.page
        if type(page).__name__ == "TroublePage" and not texts:
            texts.append((page.paragraph, operator.banner.what.text()))
            operator.ask("end", "aborted", "cable")
            return True
        return False

    said, lines = hold(tmp_path, watch)
    assert "stopped responding" in str(said)
    calm, reason = texts[0]
    assert "stopped responding" in reason
    assert "device" not in calm
    assert lines[-1]["status"] == "broken"
