"""The smallest study of pairs in its real windows at 1366 × 768 on one screen, by the mouse alone.

The session's own transitions say what comes next; the same widgets, laid out off screen, say where it lies.
"""

import csv
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("PySide6.QtWidgets", reason="Qt's system libraries are missing", exc_type=ImportError)

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QWidget

from study_app.gui.operator.session_panels import Strip
from study_app.gui.participant.forms.questions_page import FormWidget
from study_app.gui.participant.intervals.answer_page import ChoiceWidget, NumberWidget
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import parse
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.wording.languages import words
from study_app.session.pages import ChoicePage, DesignPage, NumberPage, QuestionnairePage
from study_app.session.transitions.events import Begin, Chosen, Submitted, TaskDone, TimeUp
from study_app.session.transitions.page_builder import page
from study_app.session.transitions.state import FINAL, Phase, SessionState
from study_app.session.transitions.table import advance, open_session
from tests.compiled import needs_servo
from tests.end_to_end.real_windows import Program, needs_display, virtual_display
from tests.end_to_end.walking import laid_out, place_in
from tests.gui.small import ManualClock
from tests.protocol.trials.level_studies import key_of

pytestmark = [pytest.mark.nightly, needs_servo, pytest.mark.xvfb, pytest.mark.timeout(300), needs_display]

SCREEN = (1366, 768)
STUDY = """\
format = 2
study.name = "smallest"
sequence = ["about_you", "thicker", "strength"]

[limits]  # nobody follows the target here, on a computer that may be busy
level_error_percent = 100
pace_error_percent = 1000
lateness_ms = 1000
worst_gap_ms = 1000
delay_error_ms = 1000
frame_gap_ms = 1000

[liquids]
damper = { drag = { law = "linear", damping_nspm = 8 } }
[tasks]
stir = { kind = "follow", cycles = 1 }
[stimuli]
damping = { vary = "damping_nspm", levels = [0.02, 0.6] }
alone = { vary = "damping_nspm", level = "value", levels = [4, 12] }
[methods]
constant_few = { kind = "constant", levels = [0.3, 0.6], repetitions = 2 }
once = { kind = "constant", levels = [4, 12], repetitions = 1 }
[designs]
pair = { kind = "2ifc", feedback = "always" }
number = { kind = "estimation" }
[blocks]
thicker = { stimulus = "damping", design = "pair", method = "constant_few" }
strength = { stimulus = "alone", design = "number", method = "once" }

[questionnaires.about_you]
intro = "Some questions about you."
items = [
  { id = "age", kind = "number", text = "How old are you?", short = "Age", from = 16, to = 99, whole = true },
  { id = "hand", kind = "choice", text = "Which hand do you write with?", short = "Hand", options = [
    { id = "left", text = "Left" }, { id = "right", text = "Right" } ] },
  { id = "rested", kind = "slider", text = "How rested?", short = "Rested", low = "Not at all", high = "Very" },
  { id = "comment", kind = "text", text = "Anything else?", short = "Comment", required = false },
]
"""
ANSWERS = {"age": 42, "hand": "right", "rested": 100}
PAIRS, NUMBERS = 4, 2
PRESSED = ("first", "second", "second", "first")
NUMBER = 12


class Walker:
    """Goes through the study by the mouse."""

    def __init__(self, display: str, folder: Path, qtbot: Any) -> None:
        self._plan = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True, strip=Strip())
        self._plan.may_close = True
        qtbot.addWidget(self._plan)
        file = folder / "smallest.toml"
        file.write_text(STUDY, encoding="utf-8")
        results = folder / "results" / "smallest"
        given = ("--participant", "P001", "--seed", "3", "--device", "mouse", "--results", str(results))
        self.orders: set[str] = set()
        self.program = Program(display, folder, "run", str(file), *given)
        self.window = ""

    def xdotool(self, *orders: str) -> str:
        self.orders |= set(orders)
        return self.program.xdotool(*orders)

    def walk(self) -> None:
        """Go from the first page to the last."""
        self.window = self.program.window("^Study$")
        self.program.wait_for_event("form_shown")
        self.xdotool("windowfocus", "--sync", self.window)
        state, at_s, answered = opened(), 0.0, 0
        while state.phase not in FINAL:
            at_s += 100.0
            if state.phase is Phase.ANSWERING:
                answered += self._answer(page(state), answered)
            state = ahead(state, at_s)
        self.program.wait_for_event("session_ended")

    def _answer(self, asked: Any, answered: int) -> int:
        """Answer the page that is shown; return how many trials that answers."""
        if isinstance(asked, QuestionnairePage):
            self.program.wait_for_event("item_shown", len(asked.items))
            self.answer_form(asked)
            self.program.wait_for_event("form_answered")
            return 0
        assert isinstance(asked, DesignPage)
        self.program.wait_for_event("item_shown", len(ANSWERS) + 1 + answered + 1)
        if isinstance(asked, ChoicePage):
            self.choose(asked, PRESSED[answered])
        else:
            assert isinstance(asked, NumberPage)
            self.enter(asked)
        self.program.wait_for_event("responses", answered + 1)
        return 1

    def shown(self, asked: Any) -> QWidget:
        self._plan.show_page(asked)
        laid_out(self._plan, SCREEN)
        return self._plan.widget

    def click(self, *places: QPoint) -> None:
        for place in places:
            at = (str(place.x()), str(place.y()))
            self.xdotool("mousemove", "--window", self.window, *at, "click", "1")

    def answer_form(self, asked: QuestionnairePage) -> None:
        form = self.shown(asked)
        assert isinstance(form, FormWidget)
        age, hand, rested, _ = (one for one in form.fields)
        keys = {key.text(): key for key in age.keys}  # type: ignore[attr-defined]
        parts = [keys["4"], keys["2"], hand.options[1]]  # type: ignore[attr-defined]
        line = rested.line  # type: ignore[attr-defined]
        end = line.mapTo(self._plan, QPoint(line.width() - 2, line.height() // 2))
        places = [place_in(self._plan, part) for part in parts]
        self.click(*places, end, place_in(self._plan, form.button))

    def choose(self, asked: ChoicePage, value: str) -> None:
        widget = self.shown(asked)
        assert isinstance(widget, ChoiceWidget)
        self.click(place_in(self._plan, widget.buttons[("first", "second").index(value)]))

    def enter(self, asked: NumberPage) -> None:
        widget = self.shown(asked)
        assert isinstance(widget, NumberWidget)
        keys = {key.text(): key for key in widget.keys}
        self.click(*(place_in(self._plan, part) for part in (keys["1"], keys["2"], widget.button)))


def opened() -> SessionState:
    """Return the same session before its first event; its levels are others, and no page shows any."""
    protocol = parse(STUDY.encode(), "smallest.toml")
    key = key_of(protocol)
    schedule = build_schedule(protocol, "P001", 3)
    state = open_session(protocol, schedule, key.codes, "en", secret=key.secret)
    return advance(state, Begin(0.0))[0]


def ahead(state: SessionState, at_s: float) -> SessionState:
    """Return the session one page further."""
    match state.phase:
        case Phase.TASK:
            return advance(state, TaskDone(at_s, "complete", {}))[0]
        case Phase.RESTING | Phase.FEEDBACK:
            return advance(state, TimeUp(at_s))[0]
        case _:
            given = {"choice_2ifc": PRESSED[0], "estimation": NUMBER, **ANSWERS}
            for item in (one for one in state.items if one in given):
                state = advance(state, Chosen(at_s, item, given[item]))[0]
            return advance(state, Submitted(at_s))[0]


@pytest.fixture
def display() -> Iterator[str]:
    with virtual_display(size=SCREEN) as number:
        yield number


def check(walker: Walker) -> None:
    """Check what is on the disk."""
    program = walker.program
    (path,) = program.folder.glob("results/*/data/sub-*/ses-01/*_description-responses_data.csv")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["item"]: row["response"] for row in rows[:3]} == {name: str(given) for name, given in ANSWERS.items()}
    answers = [row["response"] for row in rows if row["trial"] != "n/a"]
    assert answers == [*PRESSED, *[str(NUMBER)] * NUMBERS]
    assert [event["status"] for event in program.events("session_ended")] == ["completed"]
    assert [event["outcome"] for event in program.events("trial_ended")] == ["complete"] * (PAIRS + NUMBERS)
    assert len(program.events("feedback_shown")) == PAIRS
    for kind in ("paused", "broke", "force_stopped", "repeat"):
        assert not program.events(kind)
    program.process.send_signal(signal.SIGTERM)
    program.process.wait(30)
    for command, place in (("verify", path.parents[3]), ("reproduce", path.parent), ("replay", path.parent)):
        words_given = [sys.executable, "-m", "study_app", command, str(place)]
        found = subprocess.run(words_given, capture_output=True, text=True, check=False)
        assert found.returncode == 0, found.stdout + found.stderr


def test_pairs_and_numbers_are_answered_by_the_mouse_alone(display: str, tmp_path: Path, qtbot: Any) -> None:
    walker = Walker(display, tmp_path, qtbot)
    try:
        walker.walk()
        check(walker)
    finally:
        walker.program.close()
    assert not walker.orders & {"key", "keydown", "type"}
