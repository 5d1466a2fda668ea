"""The real program in a real window on a virtual display, driven by real keys and clicks, into the CSV.

Where a click must go is read off the same widgets laid out off screen at the same size: they carry their own fonts.
"""

import csv
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QApplication, QWidget

from study_app.app.main_controller import MainController
from study_app.gui.key_presses import CLICK_MS
from study_app.gui.operator.session_panels import Strip
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.preflight.window import FULL as PREFLIGHT
from study_app.protocol.load import parse
from study_app.protocol.source.files import source_bytes
from study_app.protocol.wording.languages import words
from study_app.store.sessions.recovery import check_resumable
from tests.compiled import needs_servo
from tests.end_to_end.real_windows import Program, needs_display, new_session, virtual_display, wait_for
from tests.gui.small import ManualClock, questionnaire

GIVEN = [7, 1, 4, 6, 2, 3, 5, 7, 1]
BY_CLICK = {1, 4, 8}

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.xvfb, pytest.mark.timeout(300), needs_display]


@pytest.fixture
def display() -> Iterator[str]:
    """A virtual X display that nobody else uses."""
    with virtual_display() as number:
        yield number


def test_a_session_by_keys_and_clicks_from_the_home_window_into_the_csv(display, tmp_path, monkeypatch, qtbot) -> None:
    monkeypatch.chdir(tmp_path)
    quick = source_bytes("rek2024").decode().replace("min_s = 30", "min_s = 1").replace("min_s = 10", "min_s = 1")
    (tmp_path / "protocols").mkdir()
    (tmp_path / "protocols" / "rek2024.toml").write_text(quick, encoding="utf-8", newline="\n")
    program = Program(display, tmp_path)
    try:
        begin_session(program, qtbot)
        study_window = explore_to_the_questionnaire(program)
        answer_nine_items(program, study_window, qtbot)
        program.wait_for_event("responses")
        wait_for(lambda: responses(tmp_path), "rows in the table of responses")  # written after the journal
        rows = responses(tmp_path)
        program.process.send_signal(signal.SIGTERM)
        program.process.wait(30)
    finally:
        program.close()
    assert [int(row["response"]) for row in rows] == GIVEN
    assert {row["code"] for row in rows} < {"L1", "L2", "L3"}
    assert {row["simulated"] for row in rows} == {"false"}
    assert responses(tmp_path) == rows
    assert program.events("session_ended") == []
    (folder,) = tmp_path.glob("results/rek2024/data/sub-P042/ses-01")
    study = source_bytes(str(tmp_path / "protocols" / "rek2024.toml"))
    check_resumable(folder, parse(study, "rek2024"), study)


def place_in(window: QWidget, part: QWidget) -> QPoint:
    assert part.isVisible()
    return part.mapTo(window, part.rect().center())


def begin_session(program: Program, qtbot) -> None:
    """Click "New session" of the first study and fill in the dialog by keys."""
    home = program.window("^Liquid Study$")
    plan = MainController(Path("results")).window
    qtbot.addWidget(plan)
    plan.resize(*program.size(home))
    plan.show()
    qtbot.waitUntil(lambda: new_session(plan) is not None)
    QApplication.processEvents()
    dialog = program.click_until(home, place_in(plan, new_session(plan)), "^New session$")
    program.key(dialog, "ctrl+a")
    program.xdotool("type", "P042")
    program.key(dialog, "Return")
    program.key(program.window_of("^Liquid Study$", PREFLIGHT), "Return")
    program.wait_for_event("page_shown")


def explore_to_the_questionnaire(program: Program) -> str:
    """Agree, read on, practise, and explore the first liquid with the mouse; return the participant's window."""
    study_window = program.window("^Study$")
    program.key(study_window, "Return")
    for trial in (1, 2):
        while len(program.events("trial_started")) < trial:
            pages = len(program.events("page_shown"))
            program.key(study_window, "space")
            wait_for(
                lambda pages=pages: len(program.events("page_shown")) > pages or program.events("trial_started"),
                "the next page",
            )
        while len(program.events("trial_ended")) < trial:
            program.xdotool("mousemove_relative", "--", "40", "-15")
            program.xdotool("mousemove_relative", "--", "-40", "15")
            program.key(study_window, "space")
    program.wait_for_event("item_shown", 9)
    return study_window


def answer_nine_items(program: Program, felt: str, qtbot) -> None:
    """Answer with digits, and some with clicks; then confirm with Enter."""
    plan = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True, strip=Strip())
    qtbot.addWidget(plan)
    plan.resize(*program.size(felt))
    plan.show_page(questionnaire())
    plan.show()
    qtbot.waitExposed(plan)
    QApplication.processEvents()
    page = plan.widget
    threading.Event().wait(2 * CLICK_MS / 1000)  # the page that has just appeared ignores clicks
    for number, value in enumerate(GIVEN):
        if number in BY_CLICK:
            program.click(felt, place_in(plan, page.fields[number].options[value - 1]))
            program.wait_for_event("choice", number + 1)
            program.key(felt, "Tab")
        else:
            program.key(felt, str(value))
            program.wait_for_event("choice", number + 1)
    assert not program.events("responses")
    program.key(felt, "Return")
    plan.may_close = True
    plan.close()


def responses(folder: Path) -> list[dict[str, str]]:
    (table,) = folder.glob("results/rek2024/data/sub-P042/ses-01/*_description-responses_data.csv")
    with table.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
