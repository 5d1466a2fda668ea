"""The list of problems: repairs that are pressed one after another, and the counts of problems and warnings."""

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QEnterEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.designer.document.document import Answers
from study_app.designer.document.steps import AddInstrument, RetypeFile
from study_app.designer.document.toml_edits import Set, Unset
from tests.designer.support.designer import DEMO

pytestmark = pytest.mark.slow


def four_problems(designer: Any, qtbot: Any) -> Any:
    """Return the list of problems of a study without four keys, with the pointer over it."""
    text = "\n".join(line for line in DEMO.split("\n") if not line.startswith(("density_kg_m3", "min_s", "dwell_s")))
    designer.open()
    designer.editing.handle_request(RetypeFile(text))
    problems = designer.place.problems
    qtbot.waitUntil(lambda: len(problems.problems) == 4)
    problems.show()
    at = QPointF(5, 5)
    QApplication.sendEvent(problems, QEnterEvent(at, at, at))
    return problems


def test_repairs_are_pressed_one_after_another_while_the_pointer_stays(designer: Any, qtbot: Any) -> None:
    problems = four_problems(designer, qtbot)
    lines = tuple(problems.lines)
    qtbot.waitUntil(lambda: all(line.repairs for line in lines))
    for number, line in enumerate(lines, start=1):
        assert line.isEnabled()
        before = line.row
        designer.click_on(line.repairs[0])
        qtbot.waitUntil(lambda number=number: len(problems.problems) == len(lines) - number)
        assert before.identity not in {row.identity for row in problems.problems}
        assert tuple(problems.lines) == lines
        assert [line.isEnabled() for line in lines] == [False] * number + [True] * (len(lines) - number)
        assert [line.row for line in lines[number:]] == list(problems.problems)
    assert designer.study.faults == ()


def test_a_problem_solved_in_the_form_leaves_the_list_under_the_pointer(designer: Any, qtbot: Any) -> None:
    problems = four_problems(designer, qtbot)
    qtbot.waitUntil(lambda: all(line.repairs for line in problems.lines))
    designer.click_on(problems.lines[0].repairs[0])
    assert [line.isEnabled() for line in problems.lines] == [False, True, True, True]
    designer.click_on(problems.lines[0])
    assert [line.row for line in problems.lines] == list(problems.problems), "after a click"
    solved = problems.lines[1].row
    designer.click_on(problems.lines[1].go)
    QTest.keyClicks(designer.keyboard, "0.7")
    designer.keyboard.flush()
    assert solved.identity not in {line.row.identity for line in problems.lines}
    assert [line.row for line in problems.lines] == list(problems.problems)
    assert len(problems.lines) == 2
    assert all(line.isEnabled() for line in problems.lines)


def test_a_problem_that_is_repaired_by_key_leaves_the_list_at_once(designer: Any, qtbot: Any) -> None:
    problems = four_problems(designer, qtbot)
    qtbot.waitUntil(lambda: all(line.repairs for line in problems.lines))
    QApplication.sendEvent(problems, QEvent(QEvent.Type.Leave))
    button = problems.lines[1].repairs[0]
    button.setFocus()
    qtbot.keyClick(button, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(problems.problems) == 3)
    assert [line.row for line in problems.lines] == list(problems.problems)
    assert all(line.isEnabled() for line in problems.lines)


def test_header_and_list_count_problems_and_warnings_after_each_step(designer: Any, qtbot: Any) -> None:
    designer.open()
    header, heading = designer.place.header.problems, designer.place.problems.heading
    sound = header.chip_text
    designer.editing.make_step("Fix the order", Set(("blocks", "liquids", "order"), "fixed"))
    qtbot.waitUntil(lambda: header.chip_text == "1 warning")
    assert heading.text() == "1 warning"
    for key in (("tasks", "reach", "dwell_s"), ("liquids", "thin", "density_kg_m3")):
        designer.editing.make_step("Remove a key", Unset(key))
    qtbot.waitUntil(lambda: len(designer.place.problems.problems) == 2)
    assert heading.text().startswith("2 problems"), heading.text()
    problems = designer.place.problems
    problems.open_problem(problems.problems[1])
    marks = [line.row == problems.problems[1] for line in problems.lines]
    assert [line.here for line in problems.lines] == marks
    for here_only in (True, False):
        problems.limit.buttons[here_only].click()
    assert [line.here for line in problems.lines] == marks, "also in lines that are made anew"
    (line,) = [line.row.line for line in problems.lines if line.here]
    designer.editing.handle_request(RetypeFile(f"# a new line\n# and another\n{designer.study.text}"))
    qtbot.waitUntil(lambda: [line + 2] == [shown_line.row.line for shown_line in problems.lines if shown_line.here])
    for _ in range(4):
        designer.editing.undo()
    qtbot.waitUntil(lambda: header.chip_text == sound)
    assert heading.text() == "No problems"


def test_a_repeated_text_is_a_problem_only_in_its_language(designer: Any) -> None:
    first, copy = ("questionnaires", "liquid", "items", 0), ("questionnaires", "liquid", "items", 1)
    designer.open()
    original = designer.value(*first)
    texts = {"en": original["text"], "nl": "Een tekst"}
    edits = [Set(("study", "languages"), ["en", "nl"]), Set((*first, "text"), texts), Set((*copy, "text"), texts)]
    designer.editing.make_step("Change", *edits)
    designer.go_to(*copy)
    row = designer.form_row(*copy, "text")
    assert [line.property("state") for line in row.field.lines.values()] == ["refused", "refused"]
    designer.editing.make_step("Change", Set((*copy, "text", "en"), "Another text"))
    assert row.row.faults == (
        "Reads the same as an earlier item in Dutch (participants could not tell them apart: change one)",
    )
    assert {code: line.property("state") for code, line in row.field.lines.items()} == {"en": "", "nl": "refused"}
    designer.editing.make_step("Change", Set((*copy, "text", "nl"), "Een andere tekst"))
    assert row.row.faults == ()


def test_the_next_problem_is_the_next_one_in_the_form_whatever_the_order_in_the_file(designer: Any) -> None:
    designer.open()
    block = ("blocks", "liquids")
    designer.editing.make_step("Break", Set((*block, "part"), 99), Set((*block, "repetitions"), 0))
    assert designer.text.index("part = 99") < designer.text.index("repetitions = 0")
    fields = []
    for _ in range(2):
        designer.hit("F8")
        fields.append(designer.place.form.row_path_of(designer.keyboard)[-1])
    assert fields == ["repetitions", "part"]


def test_missing_texts_are_one_problem_that_lists_them_and_enter_leads_to_the_next(designer: Any) -> None:
    designer.controller.begin_study("template:two-liquids-abx", "mine", Answers(languages=("en", "fr")))
    designer.editing.handle_request(AddInstrument("nasa-tlx"))
    assert "does not include the French texts" in designer.place.form.foot.help_label.text()
    missing = [fault.path for fault in designer.study.faults]
    designer.hit("F8")
    (problem,) = designer.place.problems.problems
    assert problem.message == f"{len(missing)} texts are missing in French, and 3 copied texts must be translated"
    listed = [row.row.path for row in designer.place.form.rows]
    assert set(missing) <= set(listed)
    texts = designer.form_row("questionnaires", "nasa_tlx", "items", 0, "text").field.lines
    assert texts["en"].typed_text().startswith("How much mental")
    texts["fr"].setFocus()
    for number in range(3):
        QTest.keyClicks(designer.keyboard, f"Texte {number}")
        designer.hit("Return")
    items = designer.value("questionnaires", "nasa_tlx", "items")
    written = [items[0][key].get("fr") for key in ("text", "short", "low", "high")]
    assert written == ["Texte 0", "Texte 1", "Texte 2", None]
    assert designer.keyboard is designer.form_row("questionnaires", "nasa_tlx", "items", 0, "high").field.lines["fr"]
    assert [row.row.path for row in designer.place.form.rows] == listed, "they can still be corrected"
