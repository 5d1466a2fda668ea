"""The tab Participant: which page and texts it shows, and how keys, mouse and edits reach it."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QCursor, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.designer.document.steps import ChangeLanguage, DuplicateElement, SetText, SetValue
from study_app.designer.document.study import read_study
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.participant.playable import SIZES
from study_app.gui.key_presses import ignores_clicks
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.wording.languages import words
from study_app.session.pages import TaskPage, TextPage
from tests.gui.keyboard import Keyboard, handle_in_focus

pytestmark = pytest.mark.slow

ITEM = ("questionnaires", "liquid", "items", 1)


@pytest.fixture
def live(designer: Any) -> Any:
    """Return the live page of the open study, with the question "Like honey" selected."""
    designer.open("kitchen", *ITEM)
    QApplication.processEvents()
    return designer.controller.preview.page


def answers(live: Any) -> dict[str, Any]:
    """Return the answers on the page."""
    return {field.view.id: field.value for field in live.page_window.widget.fields if field.is_answered}


def place_of(live: Any, part: Any) -> QPoint:
    """Return the centre of a widget of the page in view coordinates."""
    middle = part.mapTo(live.page_window, part.rect().center())
    return live.mapFromScene(QPointF(middle))


def test_escape_leaves_the_page_of_the_first_step(designer: Any, live: Any) -> None:
    designer.go_to("pages", "welcome")
    preview = designer.controller.preview
    preview.enter_page()
    QApplication.processEvents()
    assert (designer.keyboard, preview.before.isEnabled()) == (live, False)
    assert designer.hit("Escape") is preview.after


def test_a_trial_is_stepped_to_and_played(designer: Any) -> None:
    designer.controller.begin_study("template:viscosity-jnd", "thicker")
    designer.go_to("blocks", "viscosity")
    preview = designer.controller.preview
    words = preview.step.text()
    assert words.startswith("Viscosity, trial 1 of ")
    for _ in range(9):
        designer.click_on(preview.after)
    assert preview.position[:2] == ("viscosity", 10)
    assert preview.step.text() == words.replace("trial 1 ", "trial 10 ")
    for page, title, has_before, has_after in (
        ("welcome", "Welcome", False, True),
        ("thanks", "Thank you", True, False),
    ):
        designer.go_to("pages", page)
        header = preview.step.text(), preview.before.isEnabled(), preview.after.isEnabled()
        assert header == (title, has_before, has_after)


def test_keys_answer_the_page_and_go_on_and_esc_leaves_it(qtbot: Any, designer: Any, live: Any) -> None:
    designer.place.outline.tree.setFocus()
    QTest.keyClick(designer.keyboard, Qt.Key.Key_Return, Qt.KeyboardModifier.ControlModifier)
    assert live.hasFocus()
    before = designer.text
    first = live.page_window.widget.fields[0].view.id
    QTest.keyClick(live, Qt.Key.Key_Up)
    QTest.keyClick(live, Qt.Key.Key_6)
    assert answers(live) == {first: 6}
    QTest.keyClick(live, Qt.Key.Key_Escape)
    assert not live.hasFocus()
    QTest.keyClick(designer.keyboard, Qt.Key.Key_Return, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClick(live, Qt.Key.Key_3)
    QTest.keyClick(live, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: designer.controller.preview.view.step == "Liquids, trial 2 of 2")
    assert isinstance(live.page_window.page, TaskPage)
    assert designer.text == before
    assert not designer.results.exists()


def test_the_space_bar_presses_a_button_of_the_page(designer: Any, live: Any) -> None:
    preview = designer.controller.preview
    designer.go_to("pages", "welcome")
    live.setFocus()
    before = preview.view.step
    QTest.keyClick(live, Qt.Key.Key_Space)
    QApplication.processEvents()
    assert preview.view.step != before


def test_the_mouse_answers_the_scaled_page(designer: Any, live: Any, qtbot: Any) -> None:
    assert live.scale_now < 0.6
    qtbot.waitUntil(lambda: not ignores_clicks(live.page_window.widget))
    field = live.page_window.widget.fields[1]
    cell = field.points[4] if hasattr(field, "points") else field.cells[4]
    QTest.mouseClick(live.viewport(), Qt.MouseButton.LeftButton, pos=place_of(live, cell))
    assert answers(live) == {field.view.id: 5}
    button = live.page_window.widget.button
    QTest.mouseClick(live.viewport(), Qt.MouseButton.LeftButton, pos=place_of(live, button))
    assert live.page_window.widget.message


def test_a_held_digit_answers_one_statement_of_the_preview(designer: Any, live: Any, qtbot: Any) -> None:
    live.setFocus()
    handle_in_focus(designer.window, qtbot)
    Keyboard().hold(Qt.Key.Key_4, repeats=10, text="4")
    assert list(answers(live).values()) == [4]


def test_an_edit_repaints_the_page_and_keeps_answers_and_focus_where_they_were(designer: Any, live: Any) -> None:
    live.setFocus()
    QTest.keyClick(live, Qt.Key.Key_2)
    line = designer.place.form
    line.setFocus()
    typing = designer.keyboard
    designer.editing.handle_request(SetText((*ITEM, "text"), "en", "This is like honey."))
    field = next(field for field in live.page_window.widget.fields if field.view.id == "like_honey")
    assert field.statement.text == "This is like honey."
    assert answers(live) == {"like_honey": 2}
    assert designer.keyboard is typing


@pytest.mark.variants(6)
@pytest.mark.parametrize(
    "broken",
    [
        Set(("device", "force_limit_n"), 60),
        Set(("liquids", "thin", "density_kg_m3"), -5),
        Set(("liquids", "thin"), "water"),
        Set(("blocks", "liquids", "conditions"), "thin"),
        Set(("scales", "agreement"), 7),
        Unset(("liquids", "thin")),
        Unset(("blocks", "liquids", "task")),
        Set(("tasks", "explore", "max_s"), "long"),
        Set(("format",), 9),
    ],
)
@pytest.mark.parametrize("state", ["sound", "faulty, saved before"])
def test_no_fault_blanks_the_page(designer: Any, broken: Any, state: str) -> None:
    designer.open("kitchen", "pages", "welcome")
    designer.editing.make_step("Another version", Set(("study", "version"), "2"))
    designer.saving.save()
    if state == "sound":
        designer.editing.make_step("Break it", broken)
    else:
        designer.file.write_text(
            read_study(designer.file.read_bytes()).with_edits(broken)[0].text, encoding="utf-8", newline="\n"
        )
        designer.open("demo")
        designer.open("kitchen", "pages", "welcome")
    assert designer.study.faults
    view = designer.controller.preview.view
    assert getattr(view.page, "title", "") == "A first look"
    assert "last valid" in view.note


def test_nothing_moves_while_the_page_is_hidden(qtbot: Any, designer: Any, live: Any) -> None:
    frames: list[None] = []
    live.frame_due.connect(lambda: frames.append(None))
    designer.go_to("liquids", "thick")
    qtbot.waitUntil(lambda: len(frames) > 2)
    places = {tuple(live.page_window.tank.view.position_m)}
    qtbot.waitUntil(lambda: tuple(live.page_window.tank.view.position_m) not in places)
    designer.place.pane.show_tab("file")
    QApplication.processEvents()
    frames.clear()
    qtbot.wait(120)
    assert not frames
    assert not live.page_window.isVisible()
    designer.go_to("pages", "thanks")
    designer.place.pane.show_tab("participant")
    assert isinstance(live.page_window.page, TextPage)


def test_frames_are_due_while_a_tank_is_visible_and_again_when_it_is_shown_again(designer: Any, live: Any) -> None:
    runs = []
    for path, tab in (
        (("liquids", "thick"), "participant"),
        (("liquids", "thick"), "file"),
        (("liquids", "thick"), "participant"),
        (("pages", "thanks"), "participant"),
    ):
        designer.place.pane.show_tab(tab)
        designer.go_to(*path)
        QApplication.processEvents()
        runs.append(live._frames.isActive())
    assert runs == [True, False, True, False]
    designer.go_to("liquids", "thick")
    designer.place.pane.show_tab("file")
    designer.controller.preview.offer_screens(SIZES[1:])  # as if the participant's screen had been changed in Settings
    assert not live._frames.isActive()


@pytest.mark.variants(4)
@pytest.mark.parametrize("screen", [0, 1])
@pytest.mark.parametrize("path", [ITEM, ("pages", "welcome"), ("questionnaires", "delay"), ("liquids", "thick")])
def test_at_100_percent_the_page_equals_that_of_a_session_pixel_by_pixel(
    qtbot: Any, designer: Any, live: Any, path: Any, screen: int
) -> None:
    tab = designer.controller.preview
    designer.go_to(*(("blocks", "liquids") if path == ITEM else path))
    tab.screens.setCurrentIndex(screen)
    tab.screens.activated.emit(screen)
    tab.zoom.chosen.emit(False)
    live._frames.stop()
    size = live.page_size
    live.setFixedSize(size)
    QApplication.processEvents()
    QCursor.setPos(0, 0)  # where an earlier test left it, it may be over an answer of the session's page
    session = ParticipantWindow(words("en"), clock=lambda: 0.0, windowed=True, photodiode=False)
    session.resize(size)
    session.show()
    session.show_page(tab.view.page)
    session.activateWindow()
    qtbot.waitUntil(session.isActiveWindow)
    if session.tank is not None:
        view = designer.controller.preview._ball.view(1.0)
        session.show_view(view)
        live.show_tank(view)
    QApplication.processEvents()
    page_pixels, session_pixels = (pixels_of(part) for part in (live.viewport(), session))
    session.may_close = True
    session.close()
    session.deleteLater()
    assert page_pixels.shape == session_pixels.shape == (size.height(), size.width(), 3)
    assert session_pixels.std() > 5
    assert (page_pixels != session_pixels).sum() == 0


def pixels_of(part: Any) -> Any:
    """Return the pixels of a widget."""
    grabbed = part.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
    rows = np.frombuffer(grabbed.constBits(), np.uint8).reshape(grabbed.height(), grabbed.bytesPerLine() // 4, 4)
    return rows[:, : grabbed.width(), :3].astype(int)


SCRIPT = """
import sys
from pathlib import Path
from PySide6.QtWidgets import QApplication
from study_app.designer.controller import DesignerController
from study_app.gui.application import application_here
from study_app.gui.home.main_window import MainWindow
from study_app.gui.widgets.main_view import Place

application = application_here()


def show():
    designer = DesignerController(Path(sys.argv[1]))
    window = MainWindow({"home": Place, "designer": lambda: designer.place})
    window.show()
    window.go("designer")
    designer.open("demo")
    QApplication.processEvents()
    assert designer.preview.page.page_window.isVisible()
    return designer, window


"""


@pytest.mark.parametrize("ends", ["shown = show()", "show()"], ids=["shown at the end", "freed while shown"])
def test_a_program_that_ends_with_a_page_open_ends_without_an_error(tmp_path: Path, ends: str) -> None:
    here = {**os.environ, "LIQUID_STUDY_WORKSPACE": str(tmp_path), "QT_QPA_PLATFORM": "offscreen"}
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT + ends, str(tmp_path)], env=here, capture_output=True, check=False
    )
    assert ended.returncode == 0, ended.stderr.decode()
    assert b"Error" not in ended.stderr


COPY = (*ITEM[:-1], 2)


@pytest.fixture
def tab(designer: Any) -> Any:
    designer.open("kitchen", *ITEM)
    return designer.controller.preview


def statements(tab: Any) -> list[tuple[str, str]]:
    """Return id and text of each question of the page as they are read."""
    return [(item.id, item.text.strip("\u034f")) for item in tab.view.page.items]


def test_a_copied_question_has_the_text_of_its_original_and_the_others_keep_theirs(designer: Any, tab: Any) -> None:
    before = statements(tab)
    designer.editing.handle_request(DuplicateElement(ITEM))
    designer.go_to(*COPY)
    copied = dict(before)["like_honey"]
    assert sorted(statements(tab)) == sorted([*before, ("like_honey_2", copied)])
    assert tab.view.note == ""  # an unfinished entry
    designer.go_to(*ITEM)
    designer.go_to(*COPY)
    assert tab.view.note.endswith("(reads the same as an earlier item), so the text is shown as written.")
    designer.editing.handle_request(SetText((*COPY, "text"), "en", "Another statement"))
    assert dict(statements(tab))["like_honey_2"] == "Another statement"


def test_a_note_on_a_problem_distinguishes_elements_of_the_same_title(designer: Any, tab: Any) -> None:
    for key, value in (("title", "Liquids"), ("repetitions", -1)):
        designer.editing.handle_request(SetValue(("blocks", "delays", key), value))
    assert "There is 1 problem elsewhere (Block delays), so the last valid values" in tab.view.note
    designer.go_to("blocks", "delays")
    assert tab.view.note.startswith("Block delays has a problem (")
    designer.editing.handle_request(SetValue(("blocks", "delays", "title"), "Late"))
    assert tab.view.note.startswith("Block Late has a problem (")
    designer.editing.handle_request(SetValue(("device", "force_limit_n"), 60))
    designer.go_to(*ITEM)
    assert "There are 2 problems elsewhere (the first: " in tab.view.note


def test_the_note_counts_the_missing_texts_of_a_language_once_as_the_header_does(designer: Any, tab: Any) -> None:
    designer.editing.handle_request(ChangeLanguage("add", "nl"))
    designer.editing.handle_request(ChangeLanguage("copy", "nl"))
    designer.editing.handle_request(SetText(("pages", "welcome", "title"), "nl", ""))
    designer.editing.handle_request(SetText(("pages", "thanks", "title"), "nl", " "))
    assert [fault.message for fault in designer.study.faults] == ["is missing in Dutch"] * 2
    tab.show_language("nl")
    assert len(designer.place.problems.problems) == 1
    assert "There is 1 problem elsewhere (Page " in tab.view.note
    designer.editing.handle_request(SetValue(("device", "force_limit_n"), 60))
    assert "There are 2 problems elsewhere (the first: " in tab.view.note
    designer.editing.handle_request(SetText(("pages", "thanks", "title"), "nl", "Dank u"))
    assert designer.value("pages", "thanks", "title") == {"en": "The end", "nl": "Dank u"}


def test_the_page_has_the_language_of_the_text_that_is_edited(designer: Any, tab: Any, qtbot: Any) -> None:
    designer.editing.handle_request(ChangeLanguage("add", "fr"))
    designer.editing.handle_request(ChangeLanguage("copy", "fr"))
    for language, text in (("fr", "Cela coule"), ("en", "It flows")):
        line = designer.field(*ITEM, "text").lines[language]
        designer.fill(line, text)
        qtbot.waitUntil(lambda: text in dict(statements(tab)).values(), timeout=5000)  # noqa: B023 - called at once
        assert tab.view.language == language


def test_each_trial_keeps_the_answers_that_were_given_in_it(designer: Any, live: Any) -> None:
    preview, steps = designer.controller.preview, []
    for answer in (2, 6):
        assert answers(live) == {}
        live.page_window.widget.fields[0].give_answer(answer)
        designer.click_on(preview.after)
    for _ in range(2):
        designer.click_on(preview.before)
        steps.append((preview.step.text(), *answers(live).values()))
    assert steps == [("Liquids, trial 2 of 2", 6), ("Liquids, trial 1 of 2", 2)]


def test_an_answer_that_was_emptied_does_not_come_back_when_the_page_is_repainted(designer: Any, live: Any) -> None:
    field = live.page_window.widget.fields[0]
    field.give_answer(3)
    field.retract_answer()
    designer.editing.handle_request(SetText((*ITEM, "text"), "en", "Was it like honey?"))
    assert answers(live) == {}


def test_the_page_has_the_size_of_the_chosen_screen(designer: Any, live: Any) -> None:
    preview = designer.controller.preview
    names = [preview.screens.itemText(at) for at in range(preview.screens.count())]
    assert len(set(names)) == len(names) >= 2
    for at in (*range(len(names)), 0):
        preview.screens.setCurrentIndex(at)
        preview.screens.activated.emit(at)
        width, height = (int(number) for number in re.findall(r"(\d+) × (\d+)", names[at])[-1])
        assert (live.page_size.width(), live.page_size.height()) == (width, height)
        QApplication.processEvents()
        assert live.maximumHeight() == math.ceil(live.width() * height / width), (
            "the page is whole, and no room is left"
        )
