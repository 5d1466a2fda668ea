"""Studies that a user makes from the empty one, and what follows: saving, and playing as a pilot that is kept."""

import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.designer.document.study import Study, read_study
from study_app.gui.participant.window import ParticipantWindow
from study_app.session.pages import EndPage, FeedbackPage, Page, TaskPage
from tests.designer.support.inputs import wait_until
from tests.designer.support.users import User

PLAYED_S = 400.0
"""A pilot of some trials is over by then, even where the force model is compiled first [s]."""


def begin(user: User, template: str, title: str) -> None:
    """Begin a study from a template, at the home window."""
    user.press("New study…*")
    user.press(f"Template {template}")
    user.write("Title", title, accept=False)
    user.shortcut("Return", "Make study")
    wait_until(lambda: user.sees("ID") or user.sees("Outline"), "the designer")


def make_likert(user: User) -> None:
    """Make a study of two liquids with a questionnaire of two statements after each."""
    begin(user, "Empty study", "Two liquids")
    user.add("Liquid")
    user.write("ID", "honey")
    user.write("Density", "1400")
    user.choose("Effects, kind", "Chosen")
    user.press("Add Viscosity")
    user.write("Viscosity", "5")
    user.add("Condition")
    user.write("ID", "honey")
    user.choose("Liquid", "honey")
    user.add("Questionnaire")
    user.write("Introduction", "About the liquid you just felt:")
    user.press("Open question 1, Question 1")
    user.write("Text", "This feels like a liquid.")
    user.write("Short label", "Liquid")
    user.select("Questionnaire")
    user.press("Add to Items")
    user.write("Text", "This is thick.")
    user.write("Short label", "Thick")
    user.select("Scale")
    user.write("Point 1, English", "Not at all")
    user.write("Point 7, English", "Very much")
    shorten(user)
    user.select("Liquids", "Session, in order")
    user.choose("Add to Conditions", "Honey")
    user.press("Add Questionnaire")


def make_two_interval(user: User) -> None:
    """Make a study of delays by two-interval forced choice, with two levels."""
    begin(user, "Empty study", "Which was late")
    user.add("Stimulus")
    user.write("Varied quantity", "delay_ms")
    user.write("Levels", "50 200")
    user.add("Trial design")
    user.choose("Kind", "2IFC")
    user.press("Add Item")
    user.write("Item", "later")
    user.press("Add Question")
    user.write("Question", "Which one was late?")
    user.add("Method")
    user.choose("Kind", "Constant")
    user.choose("Levels, kind", "Numbers")
    user.write("Levels", "50 200")
    user.write("Repetitions", "2")
    shorten(user)
    user.select("Liquids", "Session, in order")
    user.choose("Choose one of the two keys", "Stimulus")
    user.press("Add Trial design")
    user.press("Add Method")


def shorten(user: User) -> None:
    """Let the task take one to two seconds."""
    user.select("Explore")
    user.write("Minimum duration", "1")
    user.write("Maximum duration", "2")


def save(user: User, file: Path) -> None:
    """Save the study."""
    user.shortcut("ctrl+s", "Save")
    wait_until(file.exists, f"{file.name}")


def play(user: User) -> None:
    """Play the study from its first page to its end, and keep the pilot."""
    user.select("Welcome", "Session, in order")
    wait_until(lambda: not user.sees("Previous step"), "the first page")
    user.shortcut("F5", "Play from here")
    answered: Page | None = None
    ends = time.perf_counter() + PLAYED_S
    while not user.sees("Keep as pilot"):
        assert time.perf_counter() < ends, f"the pilot is not over, last page: {answered}"
        QTest.qWait(50)
        window = participant()
        page = None if window is None else window.page
        if window is None or page is None or isinstance(page, TaskPage | FeedbackPage | EndPage):
            answered = None
        elif page is not answered:
            answered = page
            user.answer(window)
    user.hand.bring_forward(user.window)
    user.press("Keep as pilot")
    wait_until(lambda: not user.sees("Keep as pilot"), "the kept pilot")


def participant() -> ParticipantWindow | None:
    """Return the participant's window, not the page in the designer."""
    hidden = Qt.WidgetAttribute.WA_DontShowOnScreen
    for window in QApplication.topLevelWidgets():
        if isinstance(window, ParticipantWindow) and window.isVisible() and not window.testAttribute(hidden):
            return window
    return None


STUDIES = {"twoliquids": make_likert, "whichwaslate": make_two_interval}
"""What makes each study, by its short name."""


def check_likert(study: Study) -> None:
    """Check the study of two liquids."""
    document = study.document
    assert document["blocks"]["liquids"]["conditions"] == ("water", "honey")
    assert document["conditions"]["honey"]["liquid"] == "honey"
    assert document["liquids"]["honey"] == {"density_kg_m3": 1400, "viscosity_pa_s": 5, "effects": ("drag",)}
    questionnaire = document["questionnaires"][document["blocks"]["liquids"]["questionnaire"]]
    assert [item["text"] for item in questionnaire["items"]] == ["This feels like a liquid.", "This is thick."]
    labels = document["scales"][questionnaire["scale"]]["labels"]["en"]
    assert (labels[0], labels[6], len(labels)) == ("Not at all", "Very much", 7)


def check_two_interval(study: Study) -> None:
    """Check the study of delays."""
    document = study.document
    block = document["blocks"]["liquids"]
    assert "conditions" not in block
    stimulus, design, method = (
        document[section][block[key]]
        for section, key in (("stimuli", "stimulus"), ("designs", "design"), ("methods", "method"))
    )
    assert stimulus == {"vary": "delay_ms", "levels": (50, 200)}
    assert design == {"kind": "2ifc", "item": "later", "question": "Which one was late?"}
    assert method == {"kind": "constant", "levels": (50, 200), "repetitions": 2}


CHECKS: dict[str, Callable[[Study], None]] = {"twoliquids": check_likert, "whichwaslate": check_two_interval}


def check_file(file: Path, study: str) -> None:
    """Check that the file contains the intended study."""
    read = read_study(file.read_bytes(), file.parent)
    assert read.faults == ()
    assert read.document["tasks"]["explore"]["max_s"] == 2
    CHECKS[study](read)
