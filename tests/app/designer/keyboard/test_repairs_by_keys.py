"""Problems by keys alone: F8 goes to the repair of a problem, Enter makes it and goes to the next repair."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.authoring.repairs import repairs
from study_app.gui.designer.repair_button import RepairButton
from study_app.viewmodels.designer.requests import ChangeLanguage

pytestmark = pytest.mark.slow

KEY = Qt.Key


def press(qtbot: Any, key: KEY) -> Any:
    """Press a key in the part with the keyboard, and return the part that has it then."""
    qtbot.keyClick(QApplication.focusWidget(), key)
    QApplication.processEvents()
    return QApplication.focusWidget()


@pytest.fixture
def broken(qtbot: Any, designer: Any) -> Any:
    """The study with two problems, whose repairs were found."""
    text = designer.file.read_text()
    assert text.count('liquid = "thick"') == 1
    designer.file.write_text(
        text.replace('liquid = "thick"', 'liquid = "thik"').replace("force_limit_n = 6", "force_limit_n = 60")
    )
    designer.controller.open("kitchen")
    found = designer.place.problems
    qtbot.waitUntil(lambda: len(found.lines) == 2 and all(line.repairs for line in found.lines))
    designer.place.outline.tree.setFocus()
    return designer


@pytest.mark.parametrize(("width", "side"), [(1600, "form"), (1024, "pane")])
def test_enter_alone_makes_every_repair(
    qtbot: Any, broken: Any, monkeypatch: pytest.MonkeyPatch, width: int, side: str
) -> None:
    monkeypatch.setattr("study_app.app.designer.repair_search.REST_MS", 1_000_000)  # a user does not wait for repairs
    broken.window.resize(width, 768)
    broken.place.parts.show_side(side)
    first, second = broken.place.view.problems
    for problem, key in ((first, KEY.Key_F8), (second, KEY.Key_Return)):
        repair = press(qtbot, key)
        assert isinstance(repair, RepairButton)
        assert repair.problem.fault.path == problem.fault.path
        assert broken.editing.selected == problem.element
        assert broken.row(*problem.fault.path).isAncestorOf(repair)
        assert repair.visibleRegion().boundingRect() == repair.rect()
    field = press(qtbot, KEY.Key_Return)
    assert broken.place.view.problems == ()
    assert broken.row(*second.fault.path).isAncestorOf(field), "nothing is left: the field that was repaired"


def test_enter_passes_problems_without_a_repair_and_ends_at_a_field_of_one(qtbot: Any, broken: Any) -> None:
    text = broken.text.replace("delay_ms = 0", 'delay_ms = "a"', 1).replace("min_s = 5 ", 'min_s = "a" ')
    broken.editing.type_text("Break", text)
    first, unclear, second, last = broken.place.view.problems
    assert press(qtbot, KEY.Key_F8).problem == first
    assert press(qtbot, KEY.Key_Return).problem.fault == second.fault
    field = press(qtbot, KEY.Key_Return)
    assert broken.row(*last.fault.path).isAncestorOf(field)
    field = press(qtbot, KEY.Key_F8)
    assert broken.row(*unclear.fault.path).isAncestorOf(field), "F8 passes none"


def test_tab_goes_on_from_a_repair_to_the_rest_of_the_form(qtbot: Any, broken: Any) -> None:
    problem = next(one for one in broken.place.view.problems if one.fault.path[-1] == "liquid")
    broken.select(problem.element)
    row = broken.row(*problem.fault.path)
    qtbot.waitUntil(lambda: bool(row.repairs))
    row.field.list.setFocus()
    assert press(qtbot, KEY.Key_Tab) is row.repairs[0]
    assert row.isAncestorOf(press(qtbot, KEY.Key_Backtab))
    row.repairs[0].setFocus()
    assert broken.place.form.isAncestorOf(press(qtbot, KEY.Key_Tab))


def test_tab_goes_on_from_a_repair_that_a_choice_of_words_led_to(qtbot: Any, broken: Any) -> None:
    """Tab comes to the repair from the first word, and then to the other words: the first one is passed already."""
    broken.editing.type_text("Break", broken.text.replace('kind = "explore"', 'kind = "explor"', 1))
    problem = next(one for one in broken.place.view.problems if one.fault.path[-1] == "kind")
    broken.place.problems.open(problem)
    row = broken.row(*problem.fault.path)
    qtbot.waitUntil(lambda: bool(row.repairs))
    row.repairs[0].setFocus()
    passed = []
    while row.isAncestorOf(QApplication.focusWidget()):
        assert QApplication.focusWidget() not in passed, "the keyboard does not leave the row"
        passed.append(QApplication.focusWidget())
        press(qtbot, KEY.Key_Tab)
    assert broken.place.form.isAncestorOf(QApplication.focusWidget())


def test_the_name_of_a_repair_tells_it_from_that_of_another_element(qtbot: Any, broken: Any) -> None:
    text = broken.text.replace('kind = "explore"', 'kind = "explor"', 1)
    broken.editing.type_text("Break", text.replace('task = "explore"', 'task = "explor"', 1))
    spoken = set()
    for problem in (one for one in broken.place.view.problems if '"explor"' in one.message):
        broken.select(problem.element)
        row = broken.row(*problem.fault.path)
        qtbot.waitUntil(lambda row=row: bool(row.repairs))
        assert row.repairs[0].text() == 'Use "explore"'
        spoken.add(row.repairs[0].accessibleName())
    assert spoken == {'Use "explore": Task Explore, Kind', 'Use "explore": Block Liquids, Task'}


def test_tab_goes_from_a_line_of_the_list_to_its_repair(qtbot: Any, broken: Any) -> None:
    broken.place.header.problems.click()
    for line in broken.place.problems.lines:
        line.go.setFocus()
        assert press(qtbot, KEY.Key_Tab) is line.repairs[0]


def test_a_repair_by_the_mouse_shows_what_was_repaired(qtbot: Any, broken: Any) -> None:
    first, _second = broken.place.view.problems
    broken.place.header.problems.click()
    qtbot.mouseClick(broken.place.problems.lines[0].repairs[0], Qt.MouseButton.LeftButton)
    assert len(broken.place.view.problems) == 1
    assert broken.editing.selected == first.element
    assert broken.row(*first.fault.path).isAncestorOf(QApplication.focusWidget())


def test_f8_goes_on_where_a_problem_was_solved(qtbot: Any, broken: Any) -> None:
    text = broken.text.replace("[blocks.liquids]\n", "[blocks.liquids]\nnonsense = 1\n")
    broken.editing.type_text("Break", text)
    _first, second, third = broken.place.view.problems
    for _ in range(2):
        press(qtbot, KEY.Key_F8)
    assert broken.place.problems.at == second
    wrong, right = (
        ("thik", "thick") if second.fault.path[-1] == "liquid" else ("force_limit_n = 60", "force_limit_n = 6")
    )
    broken.editing.type_text("Correct", text.replace(wrong, right, 1))
    press(qtbot, KEY.Key_F8)
    assert broken.place.problems.at.fault == third.fault


def test_a_repair_that_is_pressed_right_after_an_edit_is_made(qtbot: Any, broken: Any) -> None:
    """Repairs are looked for anew once the keyboard rests; what is offered meanwhile is still made."""
    first, second = broken.place.view.problems
    (button,) = (one for one in broken.place.problems.repairs_of(second)[:1])
    words = button.text()
    broken.editing.type_text("Add a comment", broken.text + "# a comment\n")
    broken.place.problems.repair_asked.emit(second, words)
    assert [problem.fault.path for problem in broken.place.view.problems] == [first.fault.path]


def test_repairs_that_are_found_later_leave_the_keyboard_at_the_repairs(
    qtbot: Any, designer: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study_app.app.designer.repair_search.REST_MS", 1_000_000)  # only what the test finds
    designer.controller.open("kitchen")
    for language in ("nl", "ar"):
        designer.editing.ask(ChangeLanguage("add", language))
    path = ("pages", "welcome", "title")
    designer.select(path[:2])
    title, study = designer.row(*path), designer.editing.opened.study
    found = {
        row: tuple(repair.words for repair in repairs(study, row.fault))
        for row in designer.place.view.problems
        if row.fault.path == path
    }
    dutch, arabic = found
    designer.place.show_repairs(arabic, found[arabic])
    title.repairs[0].setFocus(Qt.FocusReason.TabFocusReason)
    designer.place.show_repairs(dutch, found[dutch])
    words = ["Copy English to Dutch", "Copy English to Arabic"]
    assert sorted(button.text() for button in title.repairs) == sorted(words)
    repair = QApplication.focusWidget()
    assert repair in title.repairs
    assert repair.text() == words[1]
    designer.place.show_repairs(arabic, ())
    repair = QApplication.focusWidget()
    assert repair in title.repairs
    assert repair.text() == words[0]
    designer.place.show_repairs(dutch, ())
    assert not title.repairs
    assert title.field.isAncestorOf(QApplication.focusWidget())
    designer.place.show_repairs(dutch, found[dutch])
    title.repairs[0].click()
    document = designer.editing.opened.study.document["pages"]["welcome"]["title"]
    assert document == {"en": document["en"], "nl": document["en"]}
