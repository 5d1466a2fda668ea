""" "Play from here" in its window: by F5, to the end and stopped, with data kept or deleted, without leftovers."""

import json
import re
import tempfile
import threading
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton

from study_app.app.failures import BUG
from study_app.app.session import playing
from study_app.app.session.bridge import SessionBridge
from study_app.designer.document.document import template
from study_app.designer.header import playing_notice
from study_app.designer.participant.playable import StepPosition
from study_app.errors import DeviceLost, StoreError
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.sessions.session_facts import sessions
from study_app.gui.widgets.controls import CompactStop
from study_app.session.pages import ChoicePage, FeedbackPage, PausePage, QuestionnairePage, TaskPage, TextPage
from study_app.session.transitions.page_builder import preview
from study_app.store.verification.whole_study import verify_study
from tests.app.lab.worlds import PATIENCE
from tests.app.people import window
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]

UNLIMITED = ("lateness_ms", "worst_gap_ms", "frame_gap_ms", "delay_error_ms")
"""A busy computer repeats no trial with these limits."""
SESSION_MS = 120_000


class Player(QObject):
    """A player who answers every page by keys, with a scripted hand; ``pages`` are the shown ones."""

    def __init__(self) -> None:
        super().__init__()
        self.pages: list[Any] = []
        self.operated = False
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.look)
        self._timer.start(20)

    def look(self) -> None:
        participant = window(ParticipantWindow)
        self.operated = self.operated or window(OperatorWindow) is not None
        if participant is None or participant.page is None or participant.page in self.pages[-1:]:
            return
        page = participant.page
        self.pages.append(page)
        if isinstance(page, TextPage | PausePage):
            QTest.keyClick(participant.widget, Qt.Key.Key_Return)
        elif isinstance(page, ChoicePage):
            QTest.keyClick(participant.focusWidget(), Qt.Key.Key_Left)
        elif isinstance(page, QuestionnairePage):
            for number in range(len(page.items)):
                QTest.keyClick(participant.focusWidget(), Qt.Key(Qt.Key.Key_1 + number))
            QTest.keyClick(participant.focusWidget(), Qt.Key.Key_Return)


@pytest.fixture
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of the temporary folders of pilots."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def likert(designer: Any) -> Any:
    """Return the designer with the workspace's study, whose tasks last a second."""
    text = designer.file.read_text("utf-8")
    for key, value in (
        ("min_s", "0.3"),
        ("count", "1"),
        ("dwell_s", "0.05"),
        *((limit, "1000") for limit in UNLIMITED),
    ):
        text = re.sub(rf"^{key} = [\d.]+", f"{key} = {value}", text, flags=re.MULTILINE)
    designer.file.write_text(text, encoding="utf-8", newline="\n")
    designer.open()
    return designer


def press_f5(qtbot: Any, designer: Any) -> None:
    designer.window.activateWindow()
    qtbot.waitUntil(designer.window.isActiveWindow)
    with qtbot.waitSignal(designer.place.header.play.asked):
        designer.key("F5")


def lines_of(study: Path) -> list[dict[str, Any]]:
    journal = study / "data" / "sub-P001" / "ses-01" / "journal.jsonl"
    return [json.loads(line) for line in journal.read_text("utf-8").splitlines()]


def play_to_the_end(qtbot: Any, designer: Any) -> Player:
    player, pilots = Player(), designer.playing
    press_f5(qtbot, designer)
    assert pilots.is_under_way, (designer.messages, designer.place.header.strip.notice)
    controls = designer.place.header.play
    assert not controls.play.isEnabled()
    assert not controls.device.isEnabled()
    qtbot.waitUntil(lambda: not pilots.is_under_way, timeout=SESSION_MS)
    assert controls.play.isEnabled()
    assert controls.device.isEnabled()
    assert not designer.messages
    return player


def keep_pilot(qtbot: Any, designer: Any) -> Path:
    qtbot.mouseClick(designer.place.header.strip.buttons["keep"], Qt.MouseButton.LeftButton)
    (study,) = designer.results.iterdir()
    assert verify_study(study).is_sound, verify_study(study)
    return Path(study)


@pytest.mark.nightly
def test_a_likert_study_is_played_from_its_third_trial(qtbot: Any, likert: Any, folders: Path) -> None:
    threads = {thread.name for thread in threading.enumerate()}
    likert.editing.select(("blocks", "delays"))
    player = play_to_the_end(qtbot, likert)
    assert [page.trial for page in player.pages if isinstance(page, TaskPage)] == [3, 4]
    assert not player.operated
    assert "completed" in likert.place.header.strip.sentence.text()
    assert list(folders.iterdir())
    study = keep_pilot(qtbot, likert)
    qtbot.waitUntil(lambda: likert.place.header.version.chip_text == "Piloted")
    qtbot.mouseClick(likert.place.header.version, Qt.MouseButton.LeftButton)
    changes = likert.controller.changes
    assert changes.version.currentText().startswith("1.0: 1 pilot, last today")
    assert changes.note.text() == "The study is identical to this version."
    lines = lines_of(study)
    (session,) = sessions(likert.results, {})
    played = datetime.fromisoformat(next(line["at"] for line in lines if line["event"] == "session_resumed"))
    assert abs((session.started - played).total_seconds()) < 1
    assert (played - datetime.fromisoformat(lines[0]["at"])).total_seconds() > 20  # of the steps that were skipped
    (known,) = likert.controller.runs.known
    assert datetime.fromisoformat(known.last) == session.started
    assert lines[0]["pilot"] is True
    assert lines[0]["simulated"] is True
    resumed = next(at for at, line in enumerate(lines) if line["event"] == "session_resumed")
    notes = [line["text"] for line in lines[:resumed] if line["event"] == "note"]
    assert notes == ["A simulated participant completed steps 1 to 4 without force."]
    assert [line["trial"] for line in lines[:resumed] if line["event"] == "responses"] == [1, 2]
    assert [line["trial"] for line in lines[resumed:] if line["event"] == "responses"] == [3, 4]
    assert lines[-1]["status"] == "completed"
    assert not list(folders.iterdir())
    assert not likert.playing.is_under_way
    qtbot.waitUntil(lambda: {thread.name for thread in threading.enumerate()} <= threads | {"background"})


def test_holding_escape_ends_at_zero_force_and_the_data_are_deleted(qtbot: Any, likert: Any, folders: Path) -> None:
    pilots = likert.playing
    likert.editing.select(("blocks", "liquids"))
    press_f5(qtbot, likert)
    qtbot.waitUntil(lambda: window(ParticipantWindow) is not None, timeout=SESSION_MS)
    participant = window(ParticipantWindow)
    qtbot.waitUntil(lambda: isinstance(participant.page, TaskPage))
    servo = pilots.pilot.session.rig.servo
    QTest.keyPress(participant, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: not pilots.is_under_way, timeout=10_000)
    assert window(ParticipantWindow) is None
    assert not any(servo.telemetry.latest()["device_force_n"])
    assert not any(thread.name.startswith("servo") for thread in threading.enumerate())
    (study,) = folders.glob("*/results/*")
    last = lines_of(study)[-1]
    assert (last["event"], last["status"]) == ("session_ended", "aborted")
    qtbot.mouseClick(likert.place.header.strip.buttons["delete"], Qt.MouseButton.LeftButton)
    assert not list(folders.iterdir())
    assert not likert.results.exists()
    assert not likert.place.header.strip.isVisible()


def stop_button_of(participant: ParticipantWindow) -> CompactStop:
    """Return the stop button above the pages; check that it is the only button."""
    (stop,) = (button for button in participant.strip.findChildren(QAbstractButton) if button.isVisible())
    assert isinstance(stop, CompactStop)
    assert stop.accessibleName() == "Stop playing. Holding Esc does the same."
    return stop


def test_stop_above_the_page_closing_the_window_a_failure_and_leaving_the_place_stop(
    qtbot: Any, likert: Any, folders: Path, caplog: pytest.LogCaptureFixture
) -> None:
    pilots = likert.playing
    for leave in (
        lambda: qtbot.mousePress(stop_button_of(window(ParticipantWindow)), Qt.MouseButton.LeftButton),
        lambda: window(ParticipantWindow).close(),
        lambda: pilots.pilot.session.bridge.fail(DeviceLost("the device is gone")),
        lambda: likert.window.go("home"),
    ):
        likert.window.go("designer")
        press_f5(qtbot, likert)
        qtbot.waitUntil(lambda: window(ParticipantWindow) is not None, timeout=SESSION_MS)
        leave()
        qtbot.waitUntil(lambda: not pilots.is_under_way, timeout=10_000)
        assert window(ParticipantWindow) is None
    ((title, sentence),) = likert.messages
    assert title == "Playback was stopped"
    assert "the device is gone" in sentence
    caplog.clear()
    likert.window.go("designer")
    press_f5(qtbot, likert)
    pilots.end(PATIENCE)  # while it is prepared
    assert not pilots.is_under_way
    assert not list(folders.iterdir())


def test_a_pilot_that_is_stopped_before_its_window_is_shown_has_not_begun(
    qtbot: Any, likert: Any, folders: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    strip, start, stopped = likert.place.header.strip, SessionBridge.start, []

    def stop() -> None:
        stopped.append((window(ParticipantWindow), likert.playing.is_under_way))
        qtbot.mouseClick(strip.buttons["stop"], Qt.MouseButton.LeftButton)

    def start_and_stop(bridge: SessionBridge) -> None:
        start(bridge)
        QTimer.singleShot(0, stop)

    monkeypatch.setattr(SessionBridge, "start", start_and_stop)
    player = play_to_the_end(qtbot, likert)
    assert stopped == [(None, True)]
    assert not player.pages
    assert strip.notice is None
    assert not list(folders.iterdir())


def test_the_stop_button_of_the_notice_ends_the_preparation_or_the_session(
    qtbot: Any, designer: Any, folders: Path
) -> None:
    designer.open()
    pilots, header, stops = designer.playing, designer.place.header, list[str]()
    pilots.play()
    assert len(list(folders.iterdir())) == 1
    assert not header.play.play.isEnabled()
    qtbot.mouseClick(header.strip.buttons["stop"], Qt.MouseButton.LeftButton)
    assert (pilots.pilot, header.strip.notice) == (None, None)
    qtbot.waitUntil(header.play.play.isEnabled)
    assert not list(folders.iterdir())
    data = folders / "pilot"
    data.mkdir()
    session = SimpleNamespace(stop=lambda: stops.append("session"))
    pilots.pilot = playing._Pilot(SimpleNamespace(words="Thin"), "scripted", data, session=session)
    header.strip.show_notice(playing_notice("Thin", "Mouse"))
    qtbot.mouseClick(header.strip.buttons["stop"], Qt.MouseButton.LeftButton)
    assert (stops, data.exists(), header.strip.isVisible()) == (["session"], True, True)
    pilots.pilot.session = None  # as after a bug in the preparation
    qtbot.mouseClick(header.strip.buttons["stop"], Qt.MouseButton.LeftButton)
    assert (stops, data.exists(), header.strip.isVisible()) == (["session"], False, False)


def test_another_study_discards_the_data_of_a_pilot_that_has_ended(designer: Any, folders: Path) -> None:
    designer.open()
    header, data = designer.place.header, folders / "pilot"
    data.mkdir()
    designer.playing.pilot = playing._Pilot(
        SimpleNamespace(words="Thin"), "scripted", data, choices=SimpleNamespace(results=data)
    )
    header.strip.show_notice(playing_notice("Thin", "Mouse"))
    designer.playing.stop()
    assert data.exists(), "it has ended already"
    designer.open("rek2024")
    assert (designer.playing.pilot, header.strip.notice, data.exists()) == (None, None, False)


def test_another_device_needs_confirmation_and_a_later_fault_is_named(
    qtbot: Any, likert: Any, folders: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    header, choices = likert.place.header, []
    monkeypatch.setattr(playing.PlayedSession, "open", lambda session: choices.append(session.chosen))
    mouse = next(action for action in header.play.menu.actions() if action.text().startswith("Mouse"))
    mouse.trigger()
    press_f5(qtbot, likert)
    assert "using the device Mouse? This device does not produce force" in header.strip.sentence.text()
    qtbot.keyClick(header.strip.buttons["close"], Qt.Key.Key_Escape)
    assert not header.strip.isVisible()
    press_f5(qtbot, likert)
    likert.open("rek2024")
    assert not header.strip.isVisible(), "what was asked of one study is not asked of another"
    likert.open()
    press_f5(qtbot, likert)
    qtbot.keyClick(header.strip.buttons["play"], Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: bool(choices))
    assert (choices[0].device, choices[0].pilot, choices[0].windowed) == ("mouse", True, True)
    likert.playing.pilot.session.over.emit()
    likert.editing.select(("pages", "thanks"))
    likert.place.pane.show_tab("file")
    field = likert.place.file.editor
    field.setPlainText(field.toPlainText().replace("[pages.thanks]\n", "[pages.thanks]\nnonsense = 3\n", 1))
    press_f5(qtbot, likert)
    assert "cannot be played" in header.strip.sentence.text()
    assert any("Page " in line and "pages.thanks" not in line for line in header.strip.notice.listed), (
        header.strip.notice
    )
    qtbot.mouseClick(header.strip.buttons["problems"], Qt.MouseButton.LeftButton)
    assert likert.place.problems.isVisible()
    assert len(choices) == 1
    assert not list(folders.iterdir())


@pytest.mark.nightly
def test_an_adaptive_study_is_played_from_its_tenth_trial(qtbot: Any, designer: Any, folders: Path) -> None:
    text = template("viscosity-jnd").text
    limits = "".join(f"{limit} = 1000\n" for limit in UNLIMITED)
    for old, new in (
        ("trials = 80", "trials = 12"),
        ("cycles = 3", "cycles = 1"),
        ("repetitions = 16", "repetitions = 8"),
        ("break_every = 44", "break_every = 6"),
        ("[analysis]", f"[limits]\n{limits}\n[analysis]"),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    designer.file.write_text(text.replace('name = "viscosity"', 'name = "kitchen"'), encoding="utf-8", newline="\n")
    designer.open()
    protocol = designer.study.protocol
    assert protocol is not None
    designer.playing.where = lambda: StepPosition("viscosity", trial=10, language="en", seed=5)
    player = play_to_the_end(qtbot, designer)
    trials = {trial.number: trial for trial in preview(protocol, 5).schedule.trials}
    played = [page.trial for page in player.pages if isinstance(page, TaskPage)]
    assert (trials[played[0]].block, trials[played[0]].index) == ("viscosity", 10)
    assert played[-1] == max(trials)
    assert not any(isinstance(page, FeedbackPage) for page in player.pages)
    assert keep_pilot(qtbot, designer).name == "kitchen-pilot-1"
    assert not list(folders.iterdir())


@pytest.mark.parametrize(
    ("facts", "said", "outcome"),
    [
        ({"error": DeviceLost("the device is gone")}, ("Playback was stopped", "the device is gone."), None),
        (
            {"code": BUG, "has_begun": True, "status": "broken"},
            ("A bug in the program stopped the pilot", "The terminal shows the details."),
            "failed",
        ),
        ({"has_begun": True, "status": "completed"}, None, "completed"),
        ({"has_begun": True, "status": "incomplete"}, None, "completed, but some trials were not delivered"),
        ({"has_begun": True, "status": "aborted"}, None, "stopped"),
        ({"has_begun": True, "status": "withdrawn"}, None, "no consent"),
        ({"has_begun": True, "status": None}, None, "stopped"),
    ],
)
def test_the_end_of_a_pilot_is_reported(
    designer: Any, folders: Path, facts: dict[str, Any], said: tuple[str, str] | None, outcome: str | None
) -> None:
    designer.open()
    ended = {"error": None, "code": 0, "is_opening": False, "has_begun": False, "status": None} | facts
    data = folders / "pilot"
    data.mkdir()
    designer.playing.pilot = playing._Pilot(
        SimpleNamespace(words="Thin"), "scripted", data, None, SimpleNamespace(**ended)
    )
    designer.playing._finish_pilot()
    assert designer.messages == [said] * (said is not None)
    notice = designer.place.header.strip.notice
    words = f"Played from Thin: {outcome}. The recorded data will be deleted unless you save them."
    assert (notice and notice.text, data.exists()) == ((words, True) if outcome else (None, False))


def test_a_pilot_that_fails_to_start_or_save_states_the_reason(
    qtbot: Any, designer: Any, folders: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(error: Exception) -> Any:
        def fail(*_given: Any, **_named: Any) -> None:
            raise error

        return fail

    designer.open()
    pilots, messages = designer.playing, designer.messages
    with monkeypatch.context() as patch:
        patch.setattr(tempfile, "mkdtemp", refuse(OSError(28, "No space left on device")))
        pilots.play()
    assert messages == [
        ("The study cannot be played", "A temporary folder cannot be created: No space left on device.")
    ]
    assert (pilots.is_under_way, pilots.pilot) == (False, None)
    with monkeypatch.context() as patch:
        patch.setattr(playing, "write_file", refuse(StoreError("the disk is full")))
        pilots.play()
        qtbot.waitUntil(lambda: not pilots.is_under_way)
    assert messages[1:] == [("The study cannot be played", "the disk is full.")]
    assert (list(folders.iterdir()), designer.place.header.strip.notice) == ([], None)
    study = SimpleNamespace(study=SimpleNamespace(name="kitchen"))
    (folders / "pilot" / "results").mkdir(parents=True)
    (folders / "pilot" / "results" / "data.txt").write_text("8", encoding="utf-8", newline="\n")
    what, choices = SimpleNamespace(words="Thin", protocol=study, source=b""), SimpleNamespace()
    choices.results = folders / "pilot" / "results"
    pilots.pilot = playing._Pilot(what, "scripted", folders / "pilot", choices)
    with monkeypatch.context() as patch:
        patch.setattr(playing, "copy_folder", refuse(StoreError("the disk is full")))
        designer.place.header.strip.asked.emit("keep")
    assert messages[2:] == [("The pilot was not saved", "the disk is full.")]
    assert (folders / "pilot" / "results").exists()
    with qtbot.waitSignal(pilots.kept) as kept_in:
        designer.place.header.strip.asked.emit("keep")
    assert kept_in.args == [designer.results / "kitchen-pilot-1"]
    assert (kept_in.args[0] / "data.txt").read_text("utf-8") == "8"
    assert (list(folders.iterdir()), pilots.pilot) == ([], None)
    assert "kitchen-pilot-1" in designer.place.header.strip.notice.text
