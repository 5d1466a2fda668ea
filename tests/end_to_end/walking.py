"""A walk through the thesis' whole study in its real windows: what comes next, where it lies, and what is on the disk.

The session's own transitions, which know no window, say what comes next; the same widgets, laid out off screen at the
same size, say where it lies.
"""

import csv
import re
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.operator.operator_view import OperatorView, Session, stages, view_session
from study_app.gui.operator.servo_health import ServoHealth
from study_app.gui.theme.theme import LIGHT
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.source.files import source_bytes
from study_app.protocol.trials.tasks import Explore
from study_app.protocol.without_force import without_force
from study_app.session.pages import Page, QuestionnairePage, TaskPage, TextPage
from study_app.session.transitions.events import (
    Begin,
    Chosen,
    Continue,
    ItemShown,
    LanguageChosen,
    ShowPage,
    Submitted,
    TaskDone,
)
from study_app.session.transitions.state import FINAL
from study_app.session.transitions.table import advance, initial_state
from study_app.store.session_progress.progress import Progress
from tests.end_to_end.real_windows import Program, wait_for
from tests.journal_lines import event_of

SHORTER = {
    "min_s = 10 ": "min_s = 0.5 ",
    "min_s = 30": "min_s = 0.5",
    "dwell_s = 0.5": "dwell_s = 0.1",
    "count = 12": "count = 2",
    "duration_s = 30": "duration_s = 1",
}
ANSWERS, TRIALS = 62, 12
CORRECTED = {2: 5}  # statement: first answer, of every page
MOST_STOPS = 80  # of the keyboard in a window
LEAVING_S, LEAVES = 0.8, 20  # a tank is left again, if it was not, after so long, and so often


def _shorter() -> str:
    """Return the thesis' study with tasks of one second."""
    text = source_bytes("rek2024").decode()
    for long, short in SHORTER.items():
        text, replacements = re.subn(f"^{long}", short, text, flags=re.MULTILINE)
        assert replacements, long
    return text


SHORT = _shorter()  # now: in the folder of a walk, the study's name means the short one


class Visitor(Program):
    """The program begun without a word, in a folder with the short study."""

    def __init__(self, display: str, folder: Path) -> None:
        (folder / "protocols").mkdir()
        (folder / "protocols" / "rek2024.toml").write_text(SHORT, encoding="utf-8", newline="\n")
        self.display = display
        self.orders: set[str] = set()
        super().__init__(display, folder)

    def xdotool(self, *arguments: str) -> str:
        """Run xdotool with these arguments and record them."""
        self.orders |= set(arguments)
        return super().xdotool(*arguments)

    def picture(self) -> NDArray[np.uint8]:
        """Return the picture on the display: rows, columns and the four bytes of a pixel."""
        raw = (self.folder / "Xvfb_screen0").read_bytes()
        head = np.frombuffer(raw, ">u4", 25)
        width, height, colours = int(head[4]), int(head[5]), int(head[19])
        pixels = np.frombuffer(raw, np.uint8, offset=int(head[0]) + 12 * colours, count=4 * width * height)
        return pixels.reshape(height, width, 4)

    def table(self, name: str) -> list[dict[str, str]]:
        (path,) = self.folder.glob(f"results/*/data/sub-*/ses-01/*_description-{name}_data.csv")
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))

    def verified(self) -> subprocess.CompletedProcess[str]:
        """Return the verification of the results that the program wrote."""
        (study,) = self.folder.glob("results/*")
        words = [sys.executable, "-m", "study_app", "verify", str(study)]
        return subprocess.run(words, capture_output=True, text=True, check=False)


class Pages:
    """The pages of the session that the program holds, in their order, and the values to answer them with."""

    def __init__(self, started: dict[str, Any]) -> None:
        protocol = parse(SHORT.encode(), "rek2024")
        self.schedule = build_schedule(protocol, started["participant"], started["seed"])
        key = draw_key(protocol, stream(1, "key").random)  # codes are all that pages show
        shown_protocol = without_force(protocol) if started["device"] == "mouse" else protocol
        self._state = initial_state(shown_protocol, self.schedule, key, started["language"])
        self.protocol: Protocol = protocol
        self.page: Page | None = None
        self.take(Begin(0.0))

    @property
    def over(self) -> bool:
        return self._state.phase in FINAL

    def take(self, event: Any) -> None:
        self._state, commands = advance(self._state, event)
        self.page = next((command.page for command in commands if isinstance(command, ShowPage)), self.page)

    def answer(self, page: QuestionnairePage) -> dict[tuple[int, str], int]:
        """Answer the page here as well; return the values by trial and statement."""
        answers = {(page.trial, item.id): (3 * page.trial + 2 * item.number) % 7 + 1 for item in page.items}
        for (_, item), value in answers.items():
            self.take(ItemShown(0.0, item))
            self.take(Chosen(0.0, item, value))
        self.take(Submitted(0.0))
        return answers

    def ended_view(self) -> OperatorView:
        """Return the operator's last view."""
        ended = Progress()
        ended.process_line(event_of("session_started", t_s=0.0))
        ended.process_line(event_of("session_ended", t_s=1.0, status="completed"))
        session = Session(
            protocol=self.protocol,
            schedule=self.schedule,
            stages=stages(self.protocol, self.schedule),
            who="",
            expected_s=1200.0,
            answers_of=ANSWERS,
            lateness_limit_s=0.002,
            device_name="",
            device_icon="mouse",
            device_rows=(("Priority", "normal"),),
        )
        return view_session(session, ended, ServoHealth(1000.0).vitals(), now_s=1.0, force_on=False)


class Person:
    """A person who uses the program by keys only; the pointer keeps its initial position."""

    def __init__(self, program: Visitor) -> None:
        self.program = program
        self.window = ""

    def take_keyboard(self, window: str) -> None:
        """Give a newly opened window the keyboard focus, like a window manager."""
        self.window = window
        self.program.xdotool("windowfocus", "--sync", window)

    def press(self, *keys: str) -> None:
        assert self.program.xdotool("getwindowfocus") == self.window
        self.program.xdotool("key", *keys)

    def walk_to(self, window: QWidget, part: QWidget, key: str) -> None:
        """Press a key until the focus ring surrounds a part, found by its position in an off-screen window."""
        shell = self.program.xdotool("getwindowgeometry", "--shell", self.window).splitlines()
        left, top = (int(line.partition("=")[2]) for line in shell if line.startswith(("X=", "Y=")))
        at = part.mapTo(window, QPoint(part.width() // 2, 1))
        ring = np.array(QColor(LIGHT.accent).getRgb()[2::-1], np.uint8)  # type: ignore[index]
        for _ in range(MOST_STOPS):
            if happens(lambda: np.array_equal(self.program.picture()[top + at.y(), left + at.x(), :3], ring), 0.2):
                return
            self.press(key)
        raise AssertionError(f"the keyboard does not get to {part.accessibleName()}")

    def choose_language(self, page: TextPage, language: str) -> None:
        forward = page.languages.index(language) > page.languages.index(page.language)
        self.press("Tab", "Right" if forward else "Left")

    def read(self, page: TextPage) -> None:
        self.press("Return" if page.kind == "consent" else "space")

    def leave_tank(self) -> None:
        self.press("space")

    def reach(self, _page: TaskPage, _ended: Callable[[], bool]) -> None:
        """Look on: the scripted hand reaches."""

    def fill_in(self, page: QuestionnairePage, values: list[int]) -> None:
        """Answer by digits, by arrows and space from either side, and once after going back."""
        keys: list[str] = []
        for item, value in zip(page.items, values, strict=True):
            if item.number in CORRECTED:
                first = CORRECTED[item.number] if CORRECTED[item.number] != value else value % 7 + 1
                keys += [str(first), "shift+Tab", str(value)]
            elif item.number % 3 == 0:
                keys += ["Down", "Up", *["Right"] * value, "space"]
            elif item.number % 3 == 1:
                keys += ["Tab", "BackSpace", *["Left"] * (8 - value), "space"]
            else:
                keys.append(str(value))
        self.press(*keys, "Return")

    def walk(self, pages: Pages) -> dict[tuple[int, str], int]:
        """Walk from the first page to the last; return the answers."""
        all_answers: dict[tuple[int, str], int] = {}
        read = pages_done = filled = 0
        while not pages.over:
            page = pages.page
            if isinstance(page, TextPage):
                read += 1
                self.program.wait_for_event("page_shown", read)
                self.read(self._in_another_language_and_back(page, pages))
                self.program.wait_for_event("page_left", read)
                pages.take(Continue(1e3))
            elif isinstance(page, TaskPage):
                pages_done += 1
                self.program.wait_for_event("trial_started", pages_done)
                self._do(page, partial(self._have_ended, pages_done))
                pages.take(TaskDone(0.0, "complete", {}))
            else:
                assert isinstance(page, QuestionnairePage)
                self.program.wait_for_event("item_shown", len(all_answers) + len(page.items))
                answers = pages.answer(page)
                self.fill_in(page, list(answers.values()))
                all_answers |= answers
                filled += 1
                self.program.wait_for_event("responses", filled)
        self.program.wait_for_event("session_ended")
        return all_answers

    def _in_another_language_and_back(self, page: TextPage, pages: Pages) -> TextPage:
        """If languages can be chosen, show the page in another language; return the page."""
        for language_number, language in enumerate((*page.languages[1:], *page.languages[:1]), start=1):
            self.choose_language(page, language)
            self.program.wait_for_event("language_chosen", language_number)
            pages.take(LanguageChosen(0.0, language))
            assert isinstance(pages.page, TextPage)
            page = pages.page
        return page

    def _have_ended(self, trials: int) -> bool:
        return len(self.program.events("trial_ended")) >= trials

    def _do(self, page: TaskPage, ended: Callable[[], bool]) -> None:
        """Do a task; leave an exploration, repeatedly if its minimum time has not elapsed."""
        if not isinstance(page.task, Explore):
            self.reach(page, ended)
        for _ in range(LEAVES if isinstance(page.task, Explore) else 0):
            self.leave_tank()
            if happens(ended, LEAVING_S):
                return
        wait_for(ended, "the end of the trial", LEAVING_S if isinstance(page.task, Explore) else 90.0)


def happens(found: Callable[[], object], seconds: float) -> bool:
    """Return whether a condition becomes true within a time limit."""
    try:
        wait_for(found, "", seconds)
    except AssertionError:
        return False
    return True


def laid_out(window: QWidget, size: tuple[int, int]) -> None:
    """Show a window off screen with the size of another window."""
    window.resize(*size)
    window.show()
    window.activateWindow()
    for _ in range(3):
        QApplication.processEvents()
    assert window.isVisible()


def place_in(window: QWidget, part: QWidget) -> QPoint:
    """Return where the middle of a part lies."""
    assert part.isVisible()
    return part.mapTo(window, part.rect().center())


def tabs_to(window: QWidget, part: QWidget) -> int:
    """Return how many presses of Tab move the keyboard focus to ``part``."""
    for count in range(MOST_STOPS):
        if part.hasFocus():
            return count
        QTest.keyClick(window.focusWidget() or window, Qt.Key.Key_Tab)
    raise AssertionError(f"the keyboard does not get to {part.accessibleName() or part}")
