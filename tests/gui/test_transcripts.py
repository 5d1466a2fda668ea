"""Every window, compared with a reviewed text: its spoken texts in each state, and the effect of each control."""

import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.home import dialogs
from study_app.gui.sessions import session_page
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.main_view import Place
from tests.gui.results.states import NOW, READ, RECORD, read
from tests.gui.states import STATES
from tests.gui.transcript import compare, states, steps
from tests.gui.walk import settle
from tests.gui.windows import WINDOWS, two_screens

SEED = 1234
SLOW = ("operator, single-blind", "lab", "settings", "home", "results", "diagnosis", "help", "new session")
"""Windows with many states, which the quick circle leaves out."""
CLOCKS = ("results.cards", "home.view", "home.cards", "sessions.sessions_table")


class FixedTime(datetime):
    """A clock that stands still."""

    @classmethod
    def now(cls, tz: Any = None) -> datetime:  # type: ignore[override]
        return NOW if tz is None else NOW.astimezone(tz)


@pytest.fixture(autouse=True)
def alike_every_time(qapp: QApplication, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    two_screens(monkeypatch)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(dialogs, "draw_seed", lambda: SEED)
    READ.update(record=RECORD)
    monkeypatch.setattr(session_page, "read_record", lambda _folder: read("record"))
    for module in CLOCKS:
        monkeypatch.setattr(f"study_app.gui.{module}.datetime", FixedTime)
    flashes_ms = qapp.cursorFlashTime()
    qapp.setCursorFlashTime(0)
    yield
    qapp.setCursorFlashTime(flashes_ms)


def works(window: QWidget) -> bool:
    """Return whether a job is running or a figure is not drawn yet."""
    parts = (part for part in window.findChildren(QWidget) if part.isVisible())
    return any(job.busy for job in window.findChildren(Background)) or not all(
        getattr(part, "is_settled", True) for part in parts
    )


def at_rest(window: QWidget) -> None:
    settle(window)
    until_s = time.perf_counter() + 10
    while works(window.window()) and time.perf_counter() < until_s:
        QTest.qWait(1)
    settle(window)


def open_window(qtbot: Any, name: str) -> Any:
    make, sizes = WINDOWS[name]
    window = make(qtbot, Path())
    settle(window, sizes[-1])
    return window


@pytest.mark.parametrize("name", [name for name in WINDOWS if name not in STATES])
def test_spoken_texts_of_each_window(qtbot: Any, name: str, pytestconfig: pytest.Config) -> None:
    window = open_window(qtbot, name)
    compare(f"{name}, shown", list(states(window, {}, lambda: at_rest(window))), pytestconfig)
    window.window().close()
    window.window().hide()


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in STATES])
def test_spoken_texts_of_each_state(qtbot: Any, name: str, pytestconfig: pytest.Config) -> None:
    make, actions = STATES[name]
    window = make(qtbot)
    at_rest(window)
    compare(f"{name}, states", list(states(window, actions, lambda: at_rest(window))), pytestconfig)
    window.window().close()
    window.window().hide()


@pytest.mark.nightly
@pytest.mark.parametrize("name", dict.fromkeys((*WINDOWS, *STATES)))
def test_effects_of_each_control(qtbot: Any, name: str, pytestconfig: pytest.Config) -> None:
    window = open_window(qtbot, name) if name in WINDOWS else STATES[name][0](qtbot)
    at_rest(window)
    place = next((candidate for candidate in window.findChildren(Place) if candidate.isVisible()), window)
    compare(f"{name}, used", list(steps(place, lambda: at_rest(window))), pytestconfig)
    window.window().close()
    window.window().hide()
