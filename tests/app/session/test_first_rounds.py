"""Actions of operator or participant while a session's windows are still being shown."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import shiboken6
from PySide6.QtCore import QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.app.session import live_session
from study_app.app.session.bridge import SessionBridge
from study_app.app.session.live_session import LiveSession
from study_app.gui.theme.theme import LIGHT
from study_app.session.transitions.state import Phase
from tests.app.session.test_opening_fails import CHOSEN
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.usefixtures("quick_preflight")]


class Disturbed(LiveSession):
    """A session in which something is done as soon as one of its windows is visible."""

    def __init__(self, results: Path, window: str, act: Callable[[SessionBridge], object]) -> None:
        super().__init__(replace(CHOSEN, results=results), LIGHT)
        self.window, self.act, self.acted = window, act, False

    def _run_next_step(self) -> None:
        super()._run_next_step()
        if self.bridge is not None and not self.acted and getattr(self.bridge, self.window).isVisible():
            self.acted = True
            self.act(self.bridge)


def stop(bridge: SessionBridge) -> None:
    QTest.mouseClick(bridge.operator.stop.stop, Qt.MouseButton.LeftButton)


@pytest.mark.parametrize(
    ("window", "act", "events"),
    [
        ("operator", stop, ["force_stopped", "paused"]),
        ("operator", lambda bridge: bridge.operator.close(), ["force_stopped", "paused"]),
        ("participant", lambda bridge: bridge.participant.close(), ["paused"]),
    ],
    ids=["stop force", "close the cockpit", "close the participant's window"],
)
def test_it_pauses_a_session_that_can_be_resumed(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, window: str, act: Any, events: list[str]
) -> None:
    monkeypatch.setattr(live_session, "preflight_checks", lambda *_: ())  # a busy computer would not pass them
    session = Disturbed(tmp_path / "results", window, act)
    session.open()
    qtbot.waitUntil(lambda: session.bridge is not None and session.bridge.participant.isVisible(), timeout=60_000)
    bridge = session.bridge
    assert bridge is not None
    servo = bridge.parts.servo
    qtbot.waitUntil(lambda: bridge.runner.state.phase is Phase.PAUSED)
    assert servo.force_is_on is ("force_stopped" not in events)
    bridge.operator.buttons.pause.click()
    assert (bridge.runner.state.phase, servo.force_is_on) == (Phase.READING, True)
    assert bridge.participant.isVisible()
    session.end_by_signal(15)
    (journal,) = (tmp_path / "results").rglob("journal.jsonl")
    recorded = [json.loads(line)["event"] for line in journal.read_text("utf-8").splitlines()]
    assert recorded[: 3 + len(events)] == ["session_started", "preflight", "page_shown", *events]
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


class ScreensDeleted(LiveSession):
    """A session in which PySide deletes its objects of the screens with a window, between any two steps."""

    def _run_next_step(self) -> None:
        super()._run_next_step()
        other_widget = QWidget()
        other_widget.screen()
        shiboken6.delete(other_widget)


def test_windows_deleted_while_a_session_opens_take_no_screen_from_it(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(live_session, "preflight_checks", lambda *_: ())
    session = ScreensDeleted(replace(CHOSEN, results=tmp_path / "results"), LIGHT)
    session.open()
    qtbot.waitUntil(
        lambda: (session.bridge is not None and session.bridge.participant.isVisible()) or session.code != 0,
        timeout=60_000,
    )
    assert (session.code, session.error) == (0, None)
    session.end_by_signal(15)
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


class ScreenRemoved(LiveSession):
    """A session whose windows were made for two screens, of which one is left before they are shown."""

    def _run_next_step(self) -> None:
        if self.bridge is not None:
            self.bridge.strip = None
        super()._run_next_step()


def test_a_page_without_a_force_stop_does_not_cover_that_of_the_operator(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(live_session, "preflight_checks", lambda *_: ())
    session = ScreenRemoved(replace(CHOSEN, results=tmp_path / "results"), LIGHT)
    with qtbot.waitSignal(session.over, timeout=60_000):
        session.open()
    assert str(session.error) == "a screen was disconnected while the session was opening; start the session again"
    assert session.bridge is not None
    assert not session.bridge.parts.servo.force_is_on
    assert not (shiboken6.isValid(session.bridge.participant) and session.bridge.participant.isVisible())
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
