"""The whole study of the thesis as one comes to it: from home to home and out, by keys alone and by the mouse alone."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from study_app.app.main_controller import MainController
from study_app.gui.home.dialogs import NewSessionDialog
from study_app.gui.home.main_window import FULL as HOME
from study_app.gui.home.view import HomePlace
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.preflight.window import FULL as PREFLIGHT
from study_app.gui.widgets.controls import ActionButton
from study_app.user_folder import settings_file
from tests.compiled import needs_servo
from tests.end_to_end.real_windows import needs_display, virtual_display, wait_for
from tests.end_to_end.walking import ANSWERS, CORRECTED, TRIALS, Pages, Person, Visitor, laid_out, tabs_to

DARK_MEAN = 90.0  # of the colours of a dark display, 0 to 255

pytestmark = [pytest.mark.slow, needs_servo, pytest.mark.xvfb, pytest.mark.timeout(300), needs_display]


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Visitor]:
    monkeypatch.chdir(tmp_path)
    with virtual_display("-fbdir", str(tmp_path)) as display:
        visitor = Visitor(display, tmp_path)
        yield visitor
        visitor.close()


@pytest.fixture
def off_screen_copy(program: Visitor, qtbot: Any) -> MainController:
    """An off-screen copy of the program, from which tests look up the positions of widgets."""
    home_window(program)
    controller = MainController()
    qtbot.addWidget(controller.window)
    laid_out(controller.window, (HOME.width(), HOME.height()))
    qtbot.waitUntil(lambda: bool(new_session(controller)))
    laid_out(controller.window, (HOME.width(), HOME.height()))
    return controller


def home_window(program: Visitor) -> str:
    return program.window_of("^Liquid Study$", HOME)


def preflight_window(program: Visitor) -> str:
    return program.window_of("^Liquid Study$", PREFLIGHT)


def new_session(off_screen_copy: MainController) -> list[ActionButton]:
    """Return the button of the thesis' study; none before its card is shown."""
    buttons = off_screen_copy.window.findChildren(ActionButton)
    return [
        button for button in buttons if button.accessibleName().startswith("New session of Feeling simulated liquids")
    ]


def dialog_of(off_screen_copy: MainController) -> NewSessionDialog:
    place = off_screen_copy.window.place("home")
    assert isinstance(place, HomePlace)
    new_session(off_screen_copy)[0].click()
    dialog = place.dialog
    assert isinstance(dialog, NewSessionDialog)
    laid_out(dialog, (dialog.width(), dialog.height()))
    return dialog


def operator_plan(pages: Pages, size: tuple[int, int], qtbot: Any) -> OperatorWindow:
    """Return the operator's window at the end of the session."""
    window = OperatorWindow("rek2024", lateness_limit_s=0.002, reach_m=0.05, pointer=True)
    qtbot.addWidget(window)
    window.header.page.show()  # as where both windows share a screen
    window.show_view(pages.ended_view())
    laid_out(window, size)
    return window


def has_changed(program: Visitor, before: Any) -> bool:
    """Return whether much of the display has changed."""
    return bool(np.mean(np.any(program.picture() != before, axis=2)) > 0.05)


def check(program: Visitor, given: dict[tuple[int, str], int], *, simulated: str) -> None:
    """Check the files of a finished session."""
    rows = program.table("responses")
    assert {(int(row["trial"]), row["item"]): int(row["response"]) for row in rows} == given
    assert len(rows) == len(given) == ANSWERS
    assert [row["changes"] for row in rows] == [str(int(int(row["number"]) in CORRECTED)) for row in rows]
    assert {row["simulated"] for row in rows} == {simulated}
    trials = program.table("trials")
    assert [row["outcome"] for row in trials] == ["complete"] * TRIALS
    assert {row["attempt"] for row in trials} == {"1"}
    assert [event["status"] for event in program.events("session_ended")] == ["completed"]
    for kind in ("paused", "broke", "force_stopped", "repeat"):
        assert not program.events(kind)
    verification = program.verified()
    assert verification.returncode == 0, verification.stdout + verification.stderr


def check_left(program: Visitor) -> None:
    """Check that the program ended normally, without a window or an error message."""
    assert program.process.wait(30) == 0
    assert not program.windows(".")
    assert program.process.stderr is not None
    assert program.process.stderr.read() == ""
    assert json.loads(settings_file().read_text(encoding="utf-8"))["theme"] == "dark"


@pytest.mark.nightly
def test_a_whole_study_by_keyboard_from_home_to_home(
    program: Visitor, off_screen_copy: MainController, qtbot: Any
) -> None:
    person = Person(program)
    pointer = program.xdotool("getmouselocation").split(" window:")[0]  # windows come and go under it
    home, main = home_window(program), off_screen_copy.window
    person.take_keyboard(home)
    person.press(*["Tab"] * tabs_to(main, new_session(off_screen_copy)[0]), "Return")
    person.take_keyboard(program.window("^New session$"))
    dialog = dialog_of(off_screen_copy)
    device = dialog.editors["device"].control
    to_device = tabs_to(dialog, device)
    down = device.findData("scripted") - device.currentIndex()
    person.press(*["Tab"] * to_device, *["Down"] * down, *["Tab"] * tabs_to(dialog, dialog.begin), "Return")
    dialog.reject()
    person.take_keyboard(preflight_window(program))
    person.press("Tab", "shift+Tab", "Return")
    person.take_keyboard(program.window("^Study$"))
    program.wait_for_event("session_started")
    pages = Pages(program.events("session_started")[0])
    answers = person.walk(pages)
    person.take_keyboard(program.window("operator$"))
    cockpit = operator_plan(pages, program.size(person.window), qtbot)
    person.press(*["Tab"] * tabs_to(cockpit, cockpit.buttons.close_session), "Return")
    person.take_keyboard(home_window(program))
    assert program.windows(".") == [person.window]
    check(program, answers, simulated="true")
    see_results_and_dark_theme_by_keys(program, person, off_screen_copy)
    assert program.xdotool("getmouselocation").split(" window:")[0] == pointer
    assert not program.orders & {"click", "mousedown", "mousemove", "mousemove_relative"}
    person.press("ctrl+q")
    check_left(program)


def see_results_and_dark_theme_by_keys(program: Visitor, person: Person, off_screen_copy: MainController) -> None:
    main, rail = off_screen_copy.window, off_screen_copy.window.rail
    laid_out(main, (HOME.width(), HOME.height()))
    home = program.picture()
    person.walk_to(main, rail.buttons["results"], "shift+Tab")
    person.press("Return")
    wait_for(lambda: has_changed(program, home), "results")
    person.walk_to(main, rail.buttons["home"], "shift+Tab")
    person.press("space")
    wait_for(lambda: not has_changed(program, home), "home")
    person.walk_to(main, rail.switch, "Tab")
    person.press("Return")
    wait_for(lambda: float(program.picture()[..., :3].mean()) < DARK_MEAN, "the dark theme")
