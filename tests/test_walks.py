"""The whole study of the thesis in its real windows on a virtual display: by keyboard alone, and by the mouse alone.

Where a click must go is read off the same pages laid out off screen at the same size. The tasks last a second.
"""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("PySide6.QtWidgets", reason="Qt's system libraries are missing", exc_type=ImportError)

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.pages.questionnaire import QuestionnaireWidget
from study_app.gui.pages.text import TextWidget
from study_app.gui.participant import ParticipantWindow
from study_app.protocol.files import source_bytes
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.schedule import build_schedule, draw_key, stream
from study_app.protocol.words import words
from study_app.session.commands import ShowPage
from study_app.session.events import Begin, Chosen, Continue, ItemShown, Submitted, TaskDone
from study_app.session.machine import advance, open_session
from study_app.session.pages import Page, QuestionnairePage, TaskPage, TextPage
from study_app.session.state import FINAL, SessionState
from tests.compiled import needs_servo
from tests.gui.small import ManualClock
from tests.real_windows import Program, needs_display, virtual_display

SEED = 7
SHORTER = {
    "min_s = 10 ": "min_s = 0.5 ",
    "max_s = 60 ": "max_s = 1 ",
    "min_s = 30": "min_s = 0.5",
    "max_s = 120": "max_s = 1",
    "[[-30, 0, 0], [30, 0, 0]]": "[[0, 0, 0], [20, 0, 0]]",
    "dwell_s = 0.5": "dwell_s = 0.1",
    "count = 12": "count = 1",
    "duration_s = 30": "duration_s = 1",
}

pytestmark = [needs_servo, pytest.mark.xvfb, pytest.mark.timeout(300), needs_display]


def shorter() -> str:
    """Return the study with tasks of a second, whose first target is where the ball is."""
    text = source_bytes("rek2024").decode()
    for long, short in SHORTER.items():
        assert long in text
        text = text.replace(long, short)
    return text


class Session(Program):
    """A session begun from the command line, and what its journal says."""

    def __init__(self, display: str, folder: Path, device: str) -> None:
        self.folder = folder
        self.environment = os.environ | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb"}
        (folder / "protocols").mkdir()
        (folder / "protocols" / "rek2024.toml").write_text(shorter(), encoding="utf-8")
        command = ["run", "rek2024", "--participant", "P042", "--seed", str(SEED), "--windowed", "--device", device]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "study_app", *command, "--no-recordings"],
            cwd=folder,
            env=self.environment,
            stderr=subprocess.PIPE,
            text=True,
        )

    def events(self, kind: str) -> list[dict[str, object]]:
        found = list(self.folder.glob("results/*/data/sub-P042/ses-01/journal.jsonl"))
        whole = found[0].read_bytes().rpartition(b"\n")[0].splitlines() if found else []
        return [event for event in map(json.loads, whole) if event["event"] == kind]

    def end(self) -> None:
        """End the program as a system that shuts down does, and see that it ends well."""
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(30) == 128 + signal.SIGTERM

    @property
    def responses(self) -> list[dict[str, str]]:
        (table,) = self.folder.glob("results/*/data/sub-P042/ses-01/*_description-responses_data.csv")
        with table.open(encoding="utf-8", newline="") as opened:
            return list(csv.DictReader(opened))


class Pages:
    """The pages of the session in their order, as the machine gives them, and the values to answer."""

    def __init__(self, protocol: Protocol) -> None:
        key = draw_key(protocol, stream(1, "key").random)
        self._state = open_session(protocol, build_schedule(protocol, "P042", SEED), key, "en")
        self.page: Page | None = None
        self.take(Begin(0.0))

    @property
    def state(self) -> SessionState:
        return self._state

    def take(self, event: Any) -> None:
        self._state, commands = advance(self._state, event)
        self.page = next((command.page for command in commands if isinstance(command, ShowPage)), self.page)

    def answer(self, page: QuestionnairePage) -> list[int]:
        """Answer the page here as well; return the values."""
        values = [(page.trial + item.number) % 7 + 1 for item in page.items]
        for item, value in zip(page.items, values, strict=True):
            self.take(ItemShown(0.0, item.id))
            self.take(Chosen(0.0, item.id, value))
        self.take(Submitted(0.0))
        return values


@pytest.fixture
def display() -> Iterator[str]:
    with virtual_display() as number:
        yield number


def walk(session: Session, person: Any) -> list[int]:
    """Go through the study as ``person`` does; return what was answered."""
    pages = Pages(parse(shorter().encode(), "rek2024"))
    read = done = filled = 0
    given: list[int] = []
    while pages.state.phase not in FINAL:
        match pages.page:
            case TextPage() as page:
                session.wait_for_event("page_shown", read + 1)
                person.read(page)
                read += 1
                session.wait_for_event("page_left", read)
                pages.take(Continue(1000.0))
            case TaskPage():
                done += 1
                session.wait_for_event("trial_ended", done)
                pages.take(TaskDone(0.0, "complete", {}))
            case QuestionnairePage() as page:
                session.wait_for_event("item_shown", len(given) + len(page.items))
                values = pages.answer(page)
                person.fill_in(page, values)
                filled += 1
                given += values
                session.wait_for_event("responses", filled)
    session.wait_for_event("session_ended")
    return given


class ByKeyboard:
    """Uses keys alone."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._window = session.window("^Study$")

    def read(self, page: TextPage) -> None:
        if page.languages and not self._session.events("language_chosen"):
            self._session.key(self._window, "Tab", "Right")
            self._session.wait_for_event("language_chosen")
            self._window = self._session.window("^Onderzoek$")
            self._session.key(self._window, "Tab", "Left")
            self._session.wait_for_event("language_chosen", 2)
            self._window = self._session.window("^Study$")
        self._session.key(self._window, "Return" if page.kind == "consent" else "space")

    def fill_in(self, _page: QuestionnairePage, values: list[int]) -> None:
        self._session.key(self._window, *(str(value) for value in values), "Return")


class ByMouse:
    """Uses the mouse alone."""

    def __init__(self, session: Session, qtbot: Any) -> None:
        self._session = session
        self._window = session.window("^Study$")
        self._plan = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
        qtbot.addWidget(self._plan)
        self._plan.resize(*session.size(self._window))
        self._plan.show()
        qtbot.waitExposed(self._plan)

    def close(self) -> None:
        self._plan.may_close = True
        self._plan.close()

    def _shown(self, page: Page) -> QWidget:
        self._plan.show_page(page)
        QApplication.processEvents()
        return self._plan.widget

    def _click(self, *parts: QWidget) -> None:
        orders: list[str] = []
        for part in parts:
            place: QPoint = part.mapTo(self._plan, part.rect().center())
            orders += ["mousemove", "--window", self._window, str(place.x()), str(place.y()), "click", "1"]
        self._session.xdotool(*orders)

    def read(self, page: TextPage) -> None:
        widget = self._shown(page)
        assert isinstance(widget, TextWidget)
        assert widget.button is not None
        self._click(widget.button)

    def fill_in(self, page: QuestionnairePage, values: list[int]) -> None:
        widget = self._shown(page)
        assert isinstance(widget, QuestionnaireWidget)
        self._click(*(row.cells[value - 1] for row, value in zip(widget.rows, values, strict=True)), widget.button)


def check(session: Session, given: list[int]) -> None:
    assert [int(row["response"]) for row in session.responses] == given
    assert len(given) == 62
    assert session.events("session_ended")[0]["status"] == "completed"
    assert not session.events("paused")
    assert not session.events("broke")


def test_the_whole_study_by_keyboard_alone(display: str, tmp_path: Path) -> None:
    session = Session(display, tmp_path, "scripted")
    try:
        given = walk(session, ByKeyboard(session))
        check(session, given)
        assert [event["language"] for event in session.events("language_chosen")] == ["nl", "en"]
        session.end()
    finally:
        session.close()


def test_the_whole_study_by_the_mouse_alone(display: str, tmp_path: Path, qtbot: Any) -> None:
    session = Session(display, tmp_path, "mouse")
    try:
        person = ByMouse(session, qtbot)
        given = walk(session, person)
        person.close()
        check(session, given)
        session.end()
    finally:
        session.close()
