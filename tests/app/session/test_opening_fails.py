"""A session that cannot be opened: zero force first, everything that was open is closed, or no device opens at all."""

import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QTimer
from PySide6.QtWidgets import QApplication

from study_app.app.failures import BUG
from study_app.app.session import live_session
from study_app.app.session.live_session import LiveSession
from study_app.errors import SessionError, StoreError
from study_app.gui.display.screens import Frames
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.theme.theme import LIGHT
from study_app.protocol.load import load
from study_app.session.start import Ready
from study_app.store.blinded.blinding import open_or_draw_key
from tests.compiled import needs_servo
from tests.session import small

CHOSEN = replace(small.CHOSEN, device="scripted")


class Part:
    """An open part that records its closing; one that ``fails`` cannot be closed."""

    def __init__(self, name: str, closed: list[str], *, fails: bool = False) -> None:
        self._name, self._closed, self._fails = name, closed, fails
        self.servo = SimpleNamespace(now_ns=lambda: 0)

    def close(self) -> None:
        self._closed.append(self._name)
        if self._fails:
            raise RuntimeError("a driver's bug")

    stop = close


def refuse(*_: Any, **__: Any) -> Any:
    raise SessionError("the device sends nothing")


@pytest.mark.parametrize("fails", ["rig", "videos", "outlets", ""])
def test_the_force_is_zero_first_and_a_part_that_fails_leaves_no_other_open(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    closed: list[str] = []
    parts = {name: Part(name, closed, fails=name == fails) for name in ("rig", "videos", "outlets")}
    for name, value in {
        "load_windows": lambda: None,
        "check_choices": lambda *_: None,
        "study_settings": lambda *_: None,
        "open_rig": lambda *_, **__: parts["rig"],
        "open_outlets": lambda *_: parts["outlets"],
        "unopened_videos": lambda *_: parts["videos"],
        "measure_rig": refuse,
    }.items():
        monkeypatch.setattr(live_session, name, value)
    session = LiveSession(CHOSEN, LIGHT)
    with qtbot.waitSignal(session.over):
        session.open()
    assert closed == ["rig", "videos", "outlets"]
    assert str(session.error) == "the device sends nothing"


class Stepped(LiveSession):
    """A session whose windows open in three steps, which it records."""

    def __init__(self) -> None:
        super().__init__(CHOSEN, LIGHT)
        self.taken: list[object] = []

    def open_windows(self, ready: object) -> Iterator[None]:
        if isinstance(ready, Exception):
            raise ready
        for step in range(3):
            self.taken.append(step)
            yield

    def hear(self, ready: object) -> None:
        """Receive the parts that the thread prepared, or its exception."""
        self._open_windows(ready)


READY: Any = Ready(SimpleNamespace(), SimpleNamespace())


def test_other_events_are_handled_while_windows_open_which_are_opened_once(qtbot: Any) -> None:
    session = Stepped()
    QTimer.singleShot(0, lambda: session.taken.append("another event"))
    session.hear(READY)
    session.hear(READY)  # Start was pressed twice
    qtbot.waitUntil(lambda: 2 in session.taken)
    qtbot.wait(20)
    assert session.taken == [0, "another event", 1, 2]


def windows() -> list[str]:
    session_windows = [
        widget for widget in QApplication.topLevelWidgets() if isinstance(widget, OperatorWindow | ParticipantWindow)
    ]
    return sorted(type(window).__name__ for window in session_windows)


@pytest.mark.slow
@needs_servo
@pytest.mark.usefixtures("quick_preflight")
@pytest.mark.parametrize(("part", "step"), [(ParticipantWindow, "open_on"), (Frames, "start")])
def test_no_window_stays_where_opening_or_starting_fails(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, part: type, step: str
) -> None:
    def fail(*_: Any) -> None:
        raise RuntimeError("a bug")

    monkeypatch.setattr(part, step, fail)
    monkeypatch.setattr(live_session, "preflight_checks", lambda *_: ())  # a busy computer would not pass them
    hook = sys.excepthook
    session = LiveSession(replace(CHOSEN, results=tmp_path / "results"), LIGHT)
    with qtbot.waitSignal(session.over, timeout=60_000):
        session.open()
    assert session.code == BUG
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert (windows(), sys.excepthook) == ([], hook)
    assert "servo" not in {thread.name for thread in threading.enumerate()}
    (unfinished,) = (tmp_path / "results").rglob("journal.jsonl")
    assert '"session_ended"' not in unfinished.read_text("utf-8")


def test_changed_conditions_are_refused_before_a_device_opens(qtbot, tmp_path, monkeypatch):
    study = load("demo")
    unused = next(iter(study.liquids.values())).model_copy(update={"id": "unused"})
    open_or_draw_key(tmp_path, study.model_copy(update={"liquids": {**study.liquids, "unused": unused}}))
    devices = []
    monkeypatch.setattr(live_session, "open_rig", lambda name, *_, **__: devices.append(name))
    live = LiveSession(replace(small.CHOSEN, results=tmp_path), LIGHT)
    with qtbot.waitSignal(live.over):
        live.open()
    live.wait()
    assert isinstance(live.error, StoreError)
    assert "sealed for conditions that differ" in str(live.error)
    assert devices == []
