"""New entries: their problems are hints until the entry is left, and a deletion explains how to undo it."""

from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.designer.document.elements import outline
from study_app.designer.document.steps import (
    AddElement,
    AddEntry,
    AddKey,
    AddNamed,
    ChangeLanguage,
    DuplicateElement,
    RemoveKey,
    SetText,
    SetValue,
    SwitchKey,
)
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.outline import addable_elements
from study_app.designer.problems import problem_rows
from study_app.designer.window import focus_stops

pytestmark = pytest.mark.slow
BLOCK, FORM = ("blocks", "liquids"), ("questionnaires", "after")
QUESTION = (*FORM, "items", 0)
COPY = (*FORM, "items", 1)


def begin(designer: Any, template: str = "two-liquids-abx") -> None:
    """Begin a study without problems."""
    designer.controller.begin_study(f"template:{template}", "mine")
    assert designer.study.faults == ()


def problem_count(designer: Any) -> int:
    """Return the number of problems; check that list, chip, outline and form agree on it."""
    QApplication.processEvents()
    designer.controller.show_outline()
    count = len(designer.place.problems.problems)
    assert designer.place.header.problems.chip_text.startswith(f"{count} problem") is (count > 0)
    assert any(row.faults for row in designer.place.outline.rows) is (count > 0)
    if not count:
        assert not [part for part in designer.place.form.findChildren(QWidget)
                    if part.isVisible() and part.property("state") == "refused"]  # fmt: skip
        assert not [row for row in designer.place.form.rows if row.row.faults and not row.row.unfinished]
        assert designer.place.view.file.faulty == ()
    return count


def every_problem(designer: Any) -> int:
    return len(problem_rows(designer.study.with_unfinished(())))


@pytest.mark.parametrize(
    ("template", "incomplete"),
    [
        ("two-liquids-abx", {"Duplicate Easy", "Duplicate Thick", "Add stimulus"}),
        ("rate-realism", {"Add gear oil", "Duplicate Gear oil"}),
        ("questionnaire-only", {"Add panas"}),
    ],
)
def test_the_problems_of_an_entry_are_shown_when_it_is_left(designer: Any, template: str, incomplete: set[str]) -> None:
    """Nothing that *Add* and *Duplicate* offer adds a problem before it is left."""
    begin(designer, template)
    elements = [row.path for part in ("session", "parts") for row in getattr(outline(designer.study), part)]
    elements = [path for path in dict.fromkeys(elements) if len(path) > 1]
    requests = {entry.asks: ("study",) for entry in addable_elements(designer.study, ("study",))}
    for path in elements:
        requests |= {entry.asks: path for entry in addable_elements(designer.study, path) if entry.asks not in requests}
    had = set()
    for request, selected in [*requests.items(), *((DuplicateElement(path), path) for path in elements)]:
        designer.go_to(*selected)
        designer.place.parts.focus_form()
        designer.editing.handle_request(request)
        assert problem_count(designer) == 0, request
        if every_problem(designer):
            had.add(designer.steps[-1])
        designer.place.parts.show_tab("file")
        assert problem_count(designer) == every_problem(designer), request
        designer.undo_all()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert incomplete <= had, had


def duplicate_question(designer: Any) -> None:
    begin(designer)
    designer.go_to(*QUESTION)
    designer.editing.handle_request(DuplicateElement(QUESTION))
    assert designer.editing.selected == COPY
    assert problem_count(designer) == 0


LEAVING: dict[str, Callable[[Any], object]] = {
    "another element": lambda designer: designer.go_to("pages", "welcome"),
    "the list of problems": lambda designer: designer.click_on(designer.place.header.problems),
    "the next problem": lambda designer: designer.hit("F8"),
    "Save": lambda designer: designer.hit("ctrl+s"),
    "Play": lambda designer: designer.playing.play(),
    "another study": lambda designer: (designer.open(), designer.open(str(designer.file.with_name("mine.toml")))),
}


@pytest.mark.parametrize("way", LEAVING)
def test_each_way_to_leave_a_copy_shows_that_it_reads_the_same(designer: Any, way: str) -> None:
    duplicate_question(designer)
    row = designer.form_row(*COPY, "text")
    said, role = row.fault_line.sentence.text(), row.fault_line.sentence.property("role")
    assert (said.startswith("Reads the same as an earlier item"), role) == (True, "text2")
    LEAVING[way](designer)
    assert problem_count(designer) == 2, "the text and its short label"
    designer.go_to(*COPY)
    row = designer.form_row(*COPY, "text")
    assert (row.fault_line.sentence.text(), row.fault_line.sentence.property("role")) == (said, "bad")
    (line,) = row.field.lines.values()
    assert line.property("state") == "refused"


def test_save_states_the_problems_of_an_unfinished_entry(designer: Any) -> None:
    duplicate_question(designer)
    designer.hit("ctrl+s")
    assert designer.saving.banner.text == "Saved, but the study cannot be run yet because of 2 problems"


def test_a_copy_that_is_reworded_before_it_is_left_never_has_a_problem(designer: Any, qtbot: Any) -> None:
    duplicate_question(designer)
    (line,) = designer.field(*COPY, "text").lines.values()
    designer.fill(line, "I knew which one was X.", "Tab")
    assert designer.value(*COPY, "short") == "I knew which one was X"
    qtbot.waitUntil(lambda: designer.value(*COPY, "id") == "i_knew_which_one_was_x")
    assert every_problem(designer) == 0
    designer.place.parts.show_tab("file")
    assert problem_count(designer) == 0


def test_a_block_without_conditions_is_unfinished_until_it_is_left(designer: Any) -> None:
    begin(designer)
    designer.go_to(*BLOCK)
    for expected in ("The block has one condition", "Specify either conditions or stimulus"):
        designer.editing.handle_request(RemoveKey((*BLOCK, "conditions", 0)))
        assert problem_count(designer) == 0
        assert designer.form_row(*BLOCK, "conditions").fault_line.sentence.text().startswith(expected)
    designer.editing.handle_request(AddEntry((*BLOCK, "conditions"), "thin"))
    designer.editing.handle_request(AddNamed((*BLOCK, "conditions"), "conditions"))
    assert designer.editing.selected == ("conditions", "condition")
    assert problem_count(designer) == 0
    designer.editing.go_back()
    designer.editing.handle_request(RemoveKey((*BLOCK, "conditions", 1)))
    assert problem_count(designer) == 0, "the block waited for its new condition"
    designer.go_to("pages", "welcome")
    assert problem_count(designer) == every_problem(designer) == 1


@pytest.mark.parametrize(
    ("template", "block", "change"),
    [
        ("two-liquids-abx", "liquids", SetValue((*BLOCK, "design"), "2ifc")),
        ("delay-detection", "delay", SwitchKey(("blocks", "delay", "stimulus"), "conditions")),
    ],
)
def test_a_block_that_is_given_another_kind_is_unfinished(
    designer: Any, template: str, block: str, change: Any
) -> None:
    begin(designer, template)
    if block == "liquids":
        plain = Unset((*BLOCK, "design")), Unset((*BLOCK, "standard"))
        designer.editing.make_step("Make a plain block", Set((*BLOCK, "conditions"), ["thin"]), *plain)
    designer.go_to("blocks", block)
    assert problem_count(designer) == 0
    designer.editing.handle_request(change)
    assert problem_count(designer) == 0
    designer.go_to("pages", "welcome")
    assert problem_count(designer) == 1
    (problem,) = designer.place.problems.problems
    assert problem.message == "The block has one condition, but its design compares at least two"


def test_a_problem_that_an_element_had_before_stays_shown(designer: Any) -> None:
    begin(designer)
    designer.editing.make_step("Change", Set((*BLOCK, "repetitions"), 0))
    designer.go_to(*BLOCK)
    assert problem_count(designer) == 1
    designer.editing.handle_request(RemoveKey((*BLOCK, "conditions", 0)))
    assert problem_count(designer) == 1
    designer.go_to("pages", "welcome")
    assert problem_count(designer) == every_problem(designer)


def test_a_field_that_is_added_is_unfinished_until_another_one_has_the_keyboard(designer: Any) -> None:
    begin(designer)
    designer.go_to("liquids", "thin")
    designer.editing.handle_request(AddKey(("liquids", "thin", "region")))
    designer.editing.handle_request(SetValue(("liquids", "thin", "region", "min_mm"), [90, 0, 0]))
    assert every_problem(designer) == 1
    assert problem_count(designer) == 0
    designer.field("liquids", "thin", "density_kg_m3").take_keyboard()
    assert problem_count(designer) == 1


DELETED = {
    "a field": (("pages", "welcome", "button"), "Button", "ctrl+Delete", "Button"),
    "a number": ((*BLOCK, "repetitions"), "Repetitions", "ctrl+Delete", "Repetitions"),
    "a condition": ((*BLOCK, "conditions"), "Conditions", "Delete", "condition 1"),
    "a point": (("scales", "agreement", "labels"), "Point 2, English", "ctrl+Delete", "point 2"),
    "a hypothesis": (("analysis", "contrasts"), "Hypothesis 1, than what", "ctrl+Delete", "hypothesis 1"),
}
"""For each kind: its row, its field, its keys, and what the deletion is called."""


@pytest.mark.parametrize("kind", DELETED)
def test_a_deletion_by_keys_explains_undo_and_tab_skips_its_button(designer: Any, kind: str) -> None:
    path, field, keys, name = DELETED[kind]
    designer.window.resize(1366, 700)
    begin(designer)
    if kind == "a hypothesis":
        designer.editing.handle_request(DuplicateElement(BLOCK))
        for _ in range(2):
            designer.field(*path).add.click()
    else:
        designer.go_to(*path[:2])
    before = designer.text
    row = designer.form_row(*path)
    stops = {part.accessibleName(): part for part in focus_stops(row)}
    assert not [stop for stop in stops if stop.startswith("Remove ")]
    stops[field].setFocus(Qt.FocusReason.TabFocusReason)
    designer.place.problems.show()  # the form is low then
    designer.hit(keys)
    assert designer.text != before
    form = designer.place.form
    assert form.foot.isVisible()
    assert form.foot.help_label.text() == f"Deleted {name}. Ctrl+Z restores it."
    assert path in (form.row_path_of(designer.keyboard), *(at for at, part in form.adds.items() if part.hasFocus()))
    designer.hit("ctrl+z")
    assert designer.text == before


def test_an_emptied_list_gives_the_keyboard_to_its_add_button(designer: Any) -> None:
    begin(designer)
    designer.go_to(*BLOCK)
    conditions = designer.field(*BLOCK, "conditions")
    conditions.list.setFocus()
    for left in (1, 0):
        designer.hit("Delete")
        assert len(designer.value(*BLOCK, "conditions")) == left
    assert designer.keyboard is conditions.add
    assert conditions.list not in focus_stops(designer.place.form)
    before = designer.text
    for key in (Qt.Key.Key_Space, Qt.Key.Key_S, Qt.Key.Key_Down, Qt.Key.Key_Home, Qt.Key.Key_Return):
        QTest.keyClick(conditions.list, key)  # an event that was on its way
    assert designer.text == before


def test_undo_of_a_step_elsewhere_leaves_the_entry(designer: Any) -> None:
    begin(designer)
    designer.go_to(*QUESTION)
    designer.editing.handle_request(DuplicateElement(QUESTION))
    designer.editing.undo()
    designer.editing.redo()
    assert designer.study.unfinished == ()
    assert problem_count(designer) == 2


def test_enter_does_not_confirm_a_deletion_that_also_deletes_other_elements(designer: Any) -> None:
    """A block that names only the deleted liquid would be deleted with it."""
    begin(designer)
    before, liquid = designer.study.text, next(iter(designer.study.document["liquids"]))
    designer.controller.ask_to_delete(("liquids", liquid))
    QApplication.processEvents()
    focused = designer.window.focusWidget()
    assert designer.place.prompt.all.isVisible()
    assert focused is designer.place.prompt.cancel
    QTest.keyClick(focused, Qt.Key.Key_Return)
    assert designer.study.text == before


def test_labels_of_another_language_raise_no_problem_while_they_are_typed(designer: Any) -> None:
    begin(designer)
    labels = ("scales", "agreement", "labels")
    designer.editing.handle_request(ChangeLanguage("add", "nl"))
    designer.go_to(*labels[:2])
    for at, first in enumerate(("Oneens", "Beetje")):
        field = designer.field(*labels).lines[at][1]
        field.setFocus()
        QTest.keyClicks(field, first)
        field.flush()
        QApplication.processEvents()
        assert not [row for row in designer.place.problems.problems if row.fault.path[:3] == labels]
        hint = designer.form_row(*labels).fault_line.sentence
        assert (hint.text().partition(" (")[0], hint.property("role")) == (
            f"Lacks {6 - at} of 7 labels in Dutch",
            "text2",
        )
    designer.go_to("pages", "welcome")
    assert [row.message for row in designer.place.problems.problems if row.fault.path[:3] == labels] == [
        "Lacks 5 of 7 labels in Dutch"
    ]


def test_a_second_hypothesis_begins_with_a_statement_without_one(designer: Any) -> None:
    begin(designer)
    designer.editing.handle_request(DuplicateElement(BLOCK))
    sequence = [*designer.value("sequence")]
    sequence.insert(sequence.index("liquids") + 1, "after")
    designer.editing.make_step("Ask after each block", Set(("sequence",), sequence))
    contrasts, form = ("analysis", "contrasts"), {"form": "after", "blocks": ["liquids", "liquids_2"]}
    first, *others = [item["id"] for item in designer.value(*FORM, "items")]
    designer.editing.make_step("State", Set(contrasts, [{"measure": first, **form}]))
    for other in others:
        designer.field(*contrasts).add.click()
        assert designer.value(*contrasts)[-1] == {"measure": other, "form": "after", "blocks": ("liquids", "liquids_2")}


def test_the_id_that_a_title_gives_an_entry_is_selected_and_stays_unfinished(designer: Any) -> None:
    designer.open()
    designer.editing.handle_request(AddElement(("pages",)))
    added = designer.editing.selected
    designer.editing.handle_request(SetText((*added, "title"), "en", "A short rest"))
    designer.editing.suggest_id()
    assert designer.value("pages", "a_short_rest", "title") == "A short rest"
    assert added[1] not in designer.value("pages")
    assert designer.editing.selected == ("pages", "a_short_rest")
    assert [entry.path for entry in designer.study.unfinished] == [("pages", "a_short_rest")]
    designer.editing.handle_request(SetText(("pages", "a_short_rest", "title"), "en", "A long rest"))
    designer.editing.suggest_id()
    assert designer.editing.selected == ("pages", "a_short_rest"), "the ID follows the text only once"


def test_an_addition_ends_earlier_ones_that_do_not_contain_it(designer: Any) -> None:
    designer.open()

    def unfinished() -> list[Any]:
        return [entry.path for entry in designer.study.unfinished]

    for request, entries in (
        (AddElement(("pages",)), [("pages", "page")]),
        (AddElement(("tasks",)), [("tasks", "task")]),
        (AddNamed(("conditions", "thin", "liquid"), "liquids"), [("conditions", "thin"), ("liquids", "liquid")]),
        (SetValue(("liquids", "liquid", "density_kg_m3"), 1100), [("conditions", "thin"), ("liquids", "liquid")]),
        (AddKey(("conditions", "thin", "delay_ms")), [("conditions", "thin", "delay_ms"), ("conditions", "thin")]),
    ):
        designer.editing.handle_request(request)
        assert sorted(unfinished()) == sorted(entries), request
    designer.editing.select(("scene",))
    designer.editing.leave_entries(("scene",))
    assert unfinished() == []
