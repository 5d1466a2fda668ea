"""The real program in a real window on a virtual display, driven by real keys and clicks, into the CSV.

Where a click must go is read off the same widgets laid out off screen at the same size: they carry their own fonts.
"""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytest.importorskip("PySide6.QtWidgets", reason="Qt's system libraries are missing", exc_type=ImportError)

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QApplication, QWidget

from study_app.app.visit import Visit
from study_app.gui.home.cards import StudyCard
from study_app.gui.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant import ParticipantWindow
from study_app.protocol.files import source_bytes
from study_app.protocol.words import words
from tests.compiled import needs_servo
from tests.gui.small import ManualClock, questionnaire

NEEDED = ("Xvfb", "xdotool")
MISSING = [tool for tool in NEEDED if shutil.which(tool) is None]
GIVEN = [7, 1, 4, 6, 2, 3, 5, 7, 1]
BY_CLICK = {1, 4, 8}

pytestmark = [
    needs_servo,
    pytest.mark.xvfb,
    pytest.mark.timeout(300),
    pytest.mark.skipif(bool(MISSING), reason=f"not installed here: {', '.join(MISSING)}"),
]


@pytest.fixture
def display() -> Iterator[str]:
    """A virtual X display that nobody else uses."""
    read_end, write_end = os.pipe()
    words_of_xvfb = ["Xvfb", "-displayfd", str(write_end), "-screen", "0", "1920x1080x24", "-nolisten", "tcp"]
    server = subprocess.Popen(
        words_of_xvfb, pass_fds=(write_end,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(write_end)
    with os.fdopen(read_end) as numbers:
        number = numbers.readline().strip()
    yield f":{number}"
    server.terminate()
    server.wait(10)


def wait_for(found: Callable[[], object], what: str, seconds: float = 60.0) -> None:
    """Look again and again until ``found()``: another process offers no signal to wait for."""
    deadline, pause = time.monotonic() + seconds, threading.Event()
    while not found():
        assert time.monotonic() < deadline, f"waited {seconds:g} s in vain for {what}"
        pause.wait(0.05)


class Program:
    """The program as a person meets it: windows, keys, a mouse, and files that appear."""

    def __init__(self, display: str, folder: Path) -> None:
        self.folder = folder
        self.environment = os.environ | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "study_app"], cwd=folder, env=self.environment, stderr=subprocess.PIPE, text=True
        )

    def close(self) -> None:
        self.process.kill()
        self.process.communicate()

    def xdotool(self, *arguments: str) -> str:
        finished = subprocess.run(
            ["xdotool", *arguments], env=self.environment, capture_output=True, text=True, check=False
        )
        return finished.stdout.strip()

    def window(self, title: str) -> str:
        def number() -> str:
            assert self.process.poll() is None, self.process.stderr.read()  # type: ignore[union-attr]
            return self.xdotool("search", "--onlyvisible", "--name", title)

        wait_for(number, f"the window {title!r}")
        return number().splitlines()[-1]

    def size(self, window: str) -> tuple[int, int]:
        geometry = dict(
            line.split("=") for line in self.xdotool("getwindowgeometry", "--shell", window).splitlines() if "=" in line
        )
        return int(geometry["WIDTH"]), int(geometry["HEIGHT"])

    def click(self, window: str, place: QPoint) -> None:
        self.xdotool("mousemove", "--window", window, str(place.x()), str(place.y()), "click", "1")

    def key(self, window: str, *keys: str) -> None:
        self.xdotool("windowfocus", "--sync", window, "key", "--clearmodifiers", *keys)

    def events(self, kind: str) -> list[dict[str, object]]:
        found = list(self.folder.glob("results/rek2024/data/sub-P042/ses-01/journal.jsonl"))
        whole = found[0].read_bytes().rpartition(b"\n")[0].splitlines() if found else []
        return [event for event in map(json.loads, whole) if event["event"] == kind]

    def wait_for_event(self, kind: str, count: int = 1) -> None:
        wait_for(lambda: len(self.events(kind)) >= count, f"{count} × {kind!r} in the journal", 90.0)


def place_in(window: QWidget, widget: QWidget) -> QPoint:
    return widget.mapTo(window, widget.rect().center())


def test_a_session_by_keys_and_clicks_from_the_home_window_into_the_csv(display, tmp_path, monkeypatch, qtbot) -> None:
    monkeypatch.chdir(tmp_path)
    quick = source_bytes("rek2024").decode().replace("min_s = 30", "min_s = 1").replace("min_s = 10", "min_s = 1")
    (tmp_path / "protocols").mkdir()
    (tmp_path / "protocols" / "rek2024.toml").write_text(quick, encoding="utf-8")
    program = Program(display, tmp_path)
    try:
        begin_session(program, qtbot)
        felt = explore_to_the_questionnaire(program)
        answer_nine_items(program, felt, qtbot)
        program.wait_for_event("responses")
        rows = responses(tmp_path)
        program.process.send_signal(signal.SIGTERM)
        program.process.wait(30)
    finally:
        program.close()
    assert [int(row["response"]) for row in rows] == GIVEN
    assert {row["code"] for row in rows} < {"L1", "L2", "L3"}
    assert {row["simulated"] for row in rows} == {"false"}
    assert responses(tmp_path) == rows
    assert program.events("session_ended")[0]["status"] == "aborted"


def begin_session(program: Program, qtbot) -> None:
    """Click "New session" of the first study and fill in the dialog by keys."""
    home = program.window("^Liquid Study$")
    plan = Visit(Path("results")).window
    qtbot.addWidget(plan)
    plan.resize(*program.size(home))
    plan.show()
    qtbot.waitExposed(plan)
    QApplication.processEvents()
    card = next(card for card in plan.findChildren(StudyCard) if card.facts.protocol.study.name == "rek2024")
    program.click(home, place_in(plan, card.new))
    dialog = program.window("^New session$")
    program.key(dialog, "ctrl+a")
    program.xdotool("type", "P042")
    program.key(dialog, "Return")
    program.wait_for_event("page_shown")


def explore_to_the_questionnaire(program: Program) -> str:
    """Agree, read on, practise, and explore the first liquid with the mouse; return the participant's window."""
    felt = program.window("^Study$")
    program.key(felt, "Return")
    for trial in (1, 2):
        while len(program.events("trial_started")) < trial:
            pages = len(program.events("page_shown"))
            program.key(felt, "space")
            wait_for(
                lambda pages=pages: len(program.events("page_shown")) > pages or program.events("trial_started"),
                "the next page",
            )
        while len(program.events("trial_ended")) < trial:
            program.xdotool("mousemove_relative", "--", "40", "-15")
            program.xdotool("mousemove_relative", "--", "-40", "15")
            program.key(felt, "space")
    program.wait_for_event("item_shown", 9)
    return felt


def answer_nine_items(program: Program, felt: str, qtbot) -> None:
    """Answer with digits, and some with clicks; then confirm with Enter."""
    plan = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
    qtbot.addWidget(plan)
    plan.resize(*program.size(felt))
    plan.show_page(questionnaire())
    plan.show()
    qtbot.waitExposed(plan)
    page = plan.widget
    assert isinstance(page, QuestionnaireWidget)
    for number, value in enumerate(GIVEN):
        if number in BY_CLICK:
            program.click(felt, place_in(plan, page.rows[number].cells[value - 1]))
            program.wait_for_event("choice", number + 1)
            program.key(felt, "Tab")
        else:
            program.key(felt, str(value))
            program.wait_for_event("choice", number + 1)
    assert not program.events("responses")
    program.key(felt, "Return")


def responses(folder: Path) -> list[dict[str, str]]:
    (table,) = folder.glob("results/rek2024/data/sub-P042/ses-01/*_description-responses_data.csv")
    with table.open(encoding="utf-8", newline="") as opened:
        return list(csv.DictReader(opened))
