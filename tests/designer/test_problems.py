"""Problems: the list of them, and their repairs by keys alone."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent
from PySide6.QtWidgets import QApplication, QWidget

from study_app.designer.document.steps import SetValue
from study_app.designer.document.toml_edits import Set
from study_app.designer.measures.study_facts import facts

pytestmark = pytest.mark.slow


def enter(part: QWidget) -> None:
    QApplication.sendEvent(part, QEnterEvent(QPointF(5, 5), QPointF(5, 5), QPointF(5, 5)))


def leave(part: QWidget) -> None:
    QApplication.sendEvent(part, QEvent(QEvent.Type.Leave))


def test_no_line_moves_while_the_pointer_is_over_the_list(qtbot: Any, designer: Any) -> None:
    text = designer.file.read_text()
    broken = text.replace("force_limit_n = 6", "force_limit_n = 60").replace('liquid = "thick"', 'liquid = "thik"', 1)
    designer.file.write_text(broken)
    designer.open()
    designer.place.header.problems.click()
    problems = designer.place.problems
    enter(problems)
    first, second, *_ = problems.lines
    places = [line.pos() for line in problems.lines]
    assert first.row.fault.path == ("device", "force_limit_n")
    designer.editing.make("Correct it", text="# one more line\n" + designer.text.replace("= 60", "= 6"))
    designer.editing.ask(SetValue(("study", "version"), 3))
    assert [line.pos() for line in problems.lines[: len(places)]] == places
    assert (first.isEnabled(), first.mark.name) == (False, "check")
    assert second.isEnabled()
    assert second.row in designer.place.view.problems  # with its line as it is now
    leave(problems)
    qtbot.waitUntil(lambda: [line.row for line in problems.lines] == list(designer.place.view.problems))
    assert problems.lines[0].row.fault.path == ("study", "version")


def test_a_problem_keeps_its_line_mark_and_repair_while_its_number_changes(qtbot: Any, designer: Any) -> None:
    designer.change(("force_limit_n = 6", "force_limit_n = 60"))
    designer.open()
    designer.place.header.problems.click()
    problems = designer.place.problems
    (line,) = problems.lines
    qtbot.waitUntil(lambda: bool(line.repairs))
    line.go.click()
    enter(problems)
    designer.editing.ask(SetValue(("device", "force_limit_n"), 70))
    assert problems.lines == [line]
    assert line.said.whole == "Is 70, must be at most 8"
    assert line.go.accessibleName() == f"{line.row.name}: {line.said.whole}"
    assert problems.at == line.row == designer.place.view.problems[0]
    qtbot.mouseClick(line.repairs[0], Qt.MouseButton.LeftButton)
    assert designer.place.view.problems == ()
    assert not line.isEnabled()


def test_the_chip_of_warnings_opens_a_list_of_them(qtbot: Any, designer: Any) -> None:
    designer.open()
    designer.editing.make("Alike", Set(("liquids", "thick", "density_kg_m3"), 1001))
    qtbot.waitUntil(lambda: "warning" in designer.place.header.problems.words)
    warned = facts(designer.study).warnings
    assert designer.place.view.problems == ()
    designer.place.header.problems.click()
    problems = designer.place.problems
    assert [line.row.message.lower() for line in problems.lines] == [one.lower() for one in warned]
    assert problems.heading.text() == designer.place.header.problems.words
    designer.place.problems.next.click()
    assert designer.editing.selected == problems.lines[0].row.element == ("liquids", "thin")
    problems.limit.chosen.emit(True)
    designer.editing.select(("pages", "welcome"))
    assert not problems.lines
    problems.limit.chosen.emit(False)
    assert [line.row.message.lower() for line in problems.lines] == [one.lower() for one in warned]
    problems.limit.chosen.emit(True)
    assert not problems.lines
    designer.editing.undo()
    qtbot.waitUntil(lambda: not problems.isVisible())


@pytest.mark.parametrize("width", [1600, 1100])
def test_a_file_that_was_never_readable_is_opened_at_the_line_of_its_fault(designer: Any, width: int) -> None:
    text = designer.file.read_text()
    line = text[: text.index("[study]")].count("\n")
    designer.file.write_text(text.replace("[study]", "[study"))
    designer.window.resize(width, 900)
    designer.open()
    place, editor = designer.place, designer.place.file.editor
    assert (place.pane.tab, place.pane.isVisible(), editor.hasFocus()) == ("file", True, True)
    assert editor.textCursor().blockNumber() == line
    assert "Expected ']'" in place.problems.lines[0].row.message
    assert f"Line {line + 1}: Not TOML" in place.form.own.text()
    assert (place.form.rows, [row.path for row in place.outline.rows]) == ([], [("study",)])
    assert not place.outline.add.isEnabled()
    place.ask_to_add()
    assert not place.adding.isVisible()
    designer.editing.make("Correct the file", text=text)
    designer.controller.show_outline()
    assert place.form.rows
    assert len(place.outline.rows) > 10
    assert place.outline.add.isEnabled()


@pytest.fixture
def broken(qtbot: Any, designer: Any) -> Any:
    """The study with two problems, whose repairs were found."""
    text = designer.file.read_text()
    assert text.count('liquid = "thick"') == 1
    designer.file.write_text(
        text.replace('liquid = "thick"', 'liquid = "thik"').replace("force_limit_n = 6", "force_limit_n = 60")
    )
    designer.open()
    found = designer.place.problems
    qtbot.waitUntil(lambda: len(found.lines) == 2 and all(line.repairs for line in found.lines))
    designer.place.outline.tree.setFocus()
    return designer


def test_enter_passes_problems_without_a_repair_and_ends_at_a_field_of_one(broken: Any) -> None:
    text = broken.text.replace("delay_ms = 0", 'delay_ms = "a"', 1).replace("min_s = 5 ", 'min_s = "a" ')
    broken.editing.make("Break", text=text)
    first, unclear, second, last = broken.place.view.problems
    assert broken.hit("F8").problem == first
    assert broken.hit("Return").problem.fault == second.fault
    field = broken.hit("Return")
    assert broken.form_row(*last.fault.path).isAncestorOf(field)
    field = broken.hit("F8")
    assert broken.form_row(*unclear.fault.path).isAncestorOf(field), "F8 passes none"


def test_a_letter_at_a_repair_is_typed_into_its_field(qtbot: Any, designer: Any) -> None:
    """Space there would press the button, and copy the other language."""
    designer.change(('languages = ["en"]', 'languages = ["en", "nl"]'), ('title = "Liquids"', 'title.en = "Liquids"'))
    designer.open()
    button = designer.hit("F8")
    path = button.problem.fault.path
    for letters in ("E", "en titel"):  # to where the keyboard is then
        designer.type(letters)
    qtbot.waitUntil(lambda: '"Een titel"' in designer.text)
    assert designer.value(*path)["nl"] == "Een titel"
    assert designer.form_row(*path).isAncestorOf(designer.keyboard)
