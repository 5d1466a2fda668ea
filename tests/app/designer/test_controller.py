"""The designer's controller: opening, drafts, saving, versions, and what another program does to the file."""

from __future__ import annotations

import json
import os
from typing import Any

import pytest
from PySide6.QtCore import Qt

from study_app.authoring.drafts import draft_of
from study_app.protocol.source.files import shipped, shipped_file
from study_app.viewmodels.designer.addable import addable
from study_app.viewmodels.designer.form.form_rows import position_of
from study_app.viewmodels.designer.requests import (
    AddElement,
    AddKey,
    DeleteElement,
    DuplicateElement,
    MoveElement,
    RemoveKey,
    RenameElement,
    RetypeFile,
    SetText,
    SetValue,
    SwitchKind,
)

pytestmark = pytest.mark.slow

MOMENT = "2026-11-21T12:00:00+00:00"


def test_opening_and_looking_at_every_form_changes_neither_file_nor_its_time(designer: Any) -> None:
    before = (designer.file.read_bytes(), designer.file.stat().st_mtime_ns)
    designer.controller.open("kitchen")
    for row in designer.place.outline.rows:
        if row.path:
            designer.editing.select(row.path)
    designer.window.go("home")
    assert (designer.file.read_bytes(), designer.file.stat().st_mtime_ns) == before
    assert draft_of(designer.file) is None


def test_an_edit_changes_its_bytes_alone_is_undone_redone_and_saved(designer: Any) -> None:
    before = designer.file.read_text()
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("study", "version"), "0.7"))
    assert "Change Version" in designer.place.header.undo.accessibleName()
    changed = [line for line in designer.text.splitlines() if line not in before.splitlines()]
    assert len(changed) == 1
    assert changed[0].startswith('version = "0.7"')
    designer.editing.undo()
    assert designer.text == before
    designer.editing.redo()
    assert designer.file.read_text() == before
    designer.saving.save()
    assert designer.file.read_text() == designer.text != before
    assert draft_of(designer.file) is None
    assert not designer.place.header.save.isEnabled()


def test_typing_in_one_field_is_one_step(designer: Any) -> None:
    before = designer.file.read_text()
    designer.controller.open("kitchen")
    page = designer.editing.opened.history.selected
    for text in ("H", "He", "Hel", "Hello"):
        designer.editing.ask(SetText((*page, "title"), "en", text))
    assert "Hello" in designer.text
    designer.editing.undo()
    assert designer.text == before


def test_an_edit_without_effect_joins_no_later_edit_to_the_step_before(designer: Any) -> None:
    designer.controller.open("kitchen")
    title = (*designer.editing.opened.history.selected, "title")
    designer.editing.ask(RenameElement(("liquids", "thin"), "thinner"))
    renamed = designer.text
    designer.editing.select(title[:-1])
    designer.editing.ask(SetText(title, "en", designer.editing.opened.study.document["pages"][title[1]]["title"]))
    assert designer.text == renamed
    designer.editing.ask(SetText(title, "en", "Hello"))
    designer.editing.undo()
    assert designer.text == renamed


def test_opening_the_open_study_again_keeps_its_steps(designer: Any) -> None:
    before = designer.file.read_text()
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("study", "version"), "0.7"))
    designer.controller.open(str(designer.file))
    assert designer.saving.banner is None
    designer.editing.undo()
    assert designer.text == before


@pytest.mark.parametrize("name", ["kitchen**", "/kitchen"])
def test_a_study_whose_name_is_refused_by_check_is_saved(designer: Any, name: str) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("study", "name"), name))
    designer.saving.save()
    assert designer.file.read_text() == designer.text
    assert name in designer.text


def test_the_text_of_the_file_follows_as_soon_as_it_is_seen(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("blocks", "delays"))
    designer.editing.ask(SetValue(("study", "name"), "larder"))
    editor = designer.place.file.editor
    assert "larder" not in editor.toPlainText()
    designer.place.show_tab("file")
    assert editor.toPlainText() == designer.text
    line = designer.text.split("\n").index("[blocks.delays]")
    assert editor.textCursor().blockNumber() <= line <= editor.textCursor().blockNumber() + 3
    designer.editing.ask(SetValue(("study", "name"), "pantry"))
    assert editor.toPlainText() == designer.text


def test_what_is_being_typed_stays_in_its_study_when_another_is_opened(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.place.show_tab("file")
    designer.place.file.editor.insertPlainText("# mine\n")
    designer.controller.open("rek2024")
    assert "# mine" not in designer.text
    draft = draft_of(designer.file)
    assert draft is not None
    assert "# mine" in draft.text


def test_a_draft_is_kept_on_leaving_and_found_again_until_it_is_discarded(designer: Any) -> None:
    before = designer.file.read_text()
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("study", "version"), "0.7"))
    designer.window.go("home")
    draft = draft_of(designer.file)
    assert draft is not None
    assert 'version = "0.7"' in draft.text
    assert designer.file.read_text() == before

    again = type(designer.controller)(designer.results)
    again.open("kitchen")
    assert again.editing.opened.study.text == draft.text
    assert again.place.banner_words.text().startswith("Draft of today")
    again.saving.answer_banner("discard")
    assert again.editing.opened.study.text == before
    assert draft_of(designer.file) is None
    again.place.deleteLater()


def test_a_file_changed_outside_is_taken_in_or_asked_about_and_never_overwritten(designer: Any) -> None:
    before = designer.file.read_text()
    designer.controller.open("kitchen")
    designer.file.write_text(before + "# outside\n")
    designer.controller.enter()
    assert designer.text.endswith("# outside\n")

    designer.editing.ask(SetValue(("study", "version"), "0.7"))
    designer.file.write_text(before + "# outside again\n")
    designer.saving.save()
    assert designer.file.read_text() == before + "# outside again\n"
    assert [words for _, words in designer.place.view.banner.actions] == ["Keep mine", "Take the file's", "Compare"]
    designer.saving.answer_banner("keep")
    designer.saving.save()
    assert designer.file.read_text() == designer.text
    assert 'version = "0.7"' in designer.text


def test_a_version_that_was_run_is_saved_under_another_number(designer: Any) -> None:
    designer.controller.open("kitchen")
    version = designer.editing.opened.study.document["study"]["version"]
    session = designer.results / "kitchen" / "data" / "sub-P001" / "ses-01"
    session.mkdir(parents=True)
    protocol = {"study": {"version": version}}
    receipt = {"key_hash": "0" * 64, "protocol_hash": "of another content", "protocol": protocol, "started_at": MOMENT}
    (session / "receipt.json").write_text(json.dumps(receipt))
    before = designer.file.read_text()
    designer.editing.ask(SetValue(("blocks", "liquids", "repetitions"), 3))
    designer.saving.save()
    assert designer.file.read_text() == before
    assert designer.place.prompt is not None
    designer.place.prompt.save.click()
    assert designer.place.prompt is None
    saved = designer.editing.opened.study.document["study"]["version"]
    assert saved != version
    assert designer.file.read_text() == designer.text


@pytest.mark.variants(4)
@pytest.mark.parametrize("name", shipped())
def test_a_shipped_study_is_read_only_and_can_be_copied(designer: Any, name: str) -> None:
    before = shipped_file(name).read_bytes()
    designer.controller.open(name)
    assert "ships with the program" in designer.place.banner_words.text()
    text = designer.text
    designer.editing.ask(SetValue(("study", "version"), "9"))
    designer.editing.ask(RetypeFile("format = 1\n"))
    designer.saving.save()
    assert designer.text == text
    assert shipped_file(name).read_bytes() == before
    designer.controller.begin(name, "mine")
    assert not designer.editing.opened.file.exists()
    assert designer.editing.opened.study.faults == ()
    designer.saving.save()
    assert designer.editing.opened.file.read_text() == designer.text


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="everybody may write here")
def test_a_file_that_may_not_be_written_is_read_only(designer: Any) -> None:
    designer.file.chmod(0o444)
    designer.controller.open("kitchen")
    assert "may not write" in designer.place.banner_words.text()


def test_a_new_study_that_was_never_saved_is_found_again(designer: Any) -> None:
    designer.controller.begin("template:compare-liquids", "mine")
    file = designer.file.parent / "mine.toml"
    assert not file.exists()
    assert draft_of(file) is not None
    again = type(designer.controller)(designer.results)
    again.enter()
    assert "mine.toml" in [choice.file for choice in again.place.header.state.studies]
    again.open(str(file))
    assert again.editing.opened.study.document["study"]["name"] == "mine"
    again.saving.save()
    assert file.exists()
    again.place.deleteLater()


@pytest.mark.parametrize("name", ["", "My study", "rek2024", "kitchen"])
def test_a_name_that_cannot_be_is_refused_in_place(designer: Any, name: str) -> None:
    designer.controller.ask_for_new()
    designer.place.new_page.name.setText(name)
    designer.place.new_page.make.click()
    assert designer.place.new_page.refusal.text()
    assert designer.editing.opened is None


def test_a_file_that_is_not_utf_8_is_refused_with_a_message(designer: Any) -> None:
    designer.file.write_bytes(b"format = 1\n# \xff\n")
    designer.controller.open("kitchen")
    assert designer.messages == [("This study cannot be opened", "line 2 is not UTF-8 text: save the file as UTF-8.")]


def test_elements_are_added_copied_moved_renamed_and_deleted(designer: Any) -> None:
    controller = designer.controller
    controller.open("kitchen")
    first = designer.text

    controller.editing.ask(AddElement(("liquids",)))
    assert controller.editing.opened.history.selected == ("liquids", "liquid")
    controller.editing.ask(RenameElement(("liquids", "liquid"), "syrup2"))
    assert designer.place.view.form.id == "syrup2"

    controller.editing.ask(DuplicateElement(("blocks", "liquids")))
    assert controller.editing.opened.history.selected == ("blocks", "liquids_2")
    assert controller.editing.opened.study.faults == ()
    steps = controller.editing.opened.study.document["sequence"]
    assert steps.index("liquids_2") == steps.index("liquids") + 1
    controller.editing.ask(MoveElement(("blocks", "liquids_2"), -1))
    moved = controller.editing.opened.study.document["sequence"]
    assert moved.index("liquids_2") == moved.index("liquids") - 1

    controller.ask_to_delete(("tasks", "explore"))
    assert designer.place.prompt is not None
    designer.place.prompt.all.click()
    assert "explore" not in controller.editing.opened.study.document["tasks"]

    while controller.editing.opened.history.done:
        controller.editing.undo()
    assert designer.text == first


@pytest.mark.parametrize("path", [("questionnaires", "liquid", "items", 0), ("pages", "thanks"), ("pages", "welcome")])
def test_a_copy_comes_right_after_its_original(designer: Any, path: tuple[str | int, ...]) -> None:
    text = designer.file.read_text()
    designer.file.write_text(text.replace('\nintro = "', '\nintro.en = "'))
    designer.controller.open("kitchen")
    at = position_of(designer.editing.opened.study.document, path)
    designer.editing.select(path)
    designer.place.form.head.copy.click()
    study = designer.editing.opened.study
    assert {fault.message for fault in study.faults} <= {"reads as an earlier item does"}
    assert at is not None
    assert position_of(study.document, designer.editing.opened.history.selected) == (at[0] + 1, at[1] + 1)


def test_what_can_be_added_is_filtered_by_typing_and_comes_after_the_selected_element(
    designer: Any, qtbot: Any
) -> None:
    designer.controller.open("kitchen")
    of_format_1 = addable(designer.editing.opened.study, ("questionnaires", "liquid", "items", 0))
    assert len([one for one in of_format_1 if one.words.startswith("Question")]) == 2
    designer.controller.begin("template:questionnaire-only", "asked")
    form = next(iter(designer.editing.opened.study.document["questionnaires"]))
    items = ("questionnaires", form, "items")
    designer.editing.select((*items, 0))
    designer.place.ask_to_add()
    assert designer.place.adding.list.item(0).data(Qt.ItemDataRole.UserRole).asks.section == items
    adding = designer.place.adding
    adding.words.setText("questi slid")
    assert adding.list.count() == 1
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    assert designer.place.view.form.path == (*items, 1)
    assert designer.editing.opened.study.document["questionnaires"][form]["items"][1]["kind"] == "slider"
    assert designer.editing.opened.study.faults == ()


def test_a_question_can_be_added_wherever_there_is_a_questionnaire(designer: Any, qtbot: Any) -> None:
    designer.controller.begin("template:compare-liquids", "asked")
    adding = designer.place.adding

    def offered(selected: tuple[str, ...], words: str = "question") -> list[str]:
        designer.editing.select(selected)
        designer.place.ask_to_add()
        adding.words.setText(words)
        every = [adding.list.item(at).data(Qt.ItemDataRole.UserRole) for at in range(adding.list.count())]
        return [one.words for one in every if isinstance(one.asks, AddElement)]

    assert offered(("pages", "welcome")) == ["Question", "Questionnaire"]
    for words in ("design", "2ifc"):
        assert offered(("pages", "welcome"), words) == ["Trial design"]
    designer.editing.ask(AddElement(("questionnaires",)))
    questions = [words for words in offered(("pages", "welcome")) if words.startswith("Question of")]
    assert questions == ["Question of Liquid", "Question of Questionnaire"]
    assert "Question of Liquid" in offered(("blocks", "liquids"))
    assert "Question of Questionnaire" not in offered(("blocks", "liquids"))
    before = len(designer.editing.opened.study.document["questionnaires"]["liquid"]["items"])
    adding.list.setCurrentRow(offered(("blocks", "liquids")).index("Question of Liquid"))
    qtbot.keyClick(adding.words, Qt.Key.Key_Return)
    assert designer.place.view.form.path == ("questionnaires", "liquid", "items", before)


def test_an_id_that_is_refused_can_be_replaced_by_one_that_is_free(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("liquids", "thin"))
    designer.editing.ask(RenameElement(("liquids", "thin"), "thick"))
    head = designer.place.form.head
    assert head.refusal.text() == 'The name "thick" is taken: "thick_2" is free.'
    head.refusal.use.setFocus()
    qtbot.keyClick(head.refusal.use, Qt.Key.Key_Return)
    assert (head.id.text(), designer.editing.selected) == ("thick_2", ("liquids", "thick_2"))
    assert head.id.hasFocus()
    assert not head.refusal.isVisible()


def test_a_kind_is_switched_and_back_without_losing_values(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("tasks", "explore"))
    before = designer.editing.opened.study.document["tasks"]["explore"]
    designer.editing.ask(SwitchKind(("tasks", "explore"), "reach"))
    assert designer.editing.opened.study.document["tasks"]["explore"]["kind"] == "reach"
    designer.editing.ask(SwitchKind(("tasks", "explore"), "explore"))
    assert designer.editing.opened.study.document["tasks"]["explore"] == before


def test_one_key_is_given_in_place_of_another_and_back_without_losing_its_value(designer: Any) -> None:
    designer.controller.open("kitchen")
    task = ("tasks", "reach")
    designer.editing.select(task)
    before = designer.text
    row = designer.row(*task, "count")
    assert row.remove is None
    assert not [one for one in designer.place.form.rows if one.row.row.path[-1] == "duration_s"]
    row.keys.buttons[1].click()
    study = designer.editing.opened.study
    assert study.faults == ()
    assert "count" not in study.document["tasks"]["reach"]
    designer.row(*task, "duration_s").keys.buttons[0].click()
    assert designer.editing.opened.study.document["tasks"]["reach"]["count"] == 6
    designer.editing.undo()
    designer.editing.undo()
    assert designer.text == before
    designer.editing.select(("blocks", "liquids"))
    designer.row("blocks", "liquids", "conditions").keys.buttons[1].click()
    assert "nothing that Stimulus can name" in designer.row("blocks", "liquids", "conditions").wrong.sentence.text()


def test_an_optional_key_is_written_and_removed(designer: Any) -> None:
    designer.controller.open("kitchen")
    before = designer.text
    designer.editing.ask(AddKey(("blocks", "liquids", "break_every")))
    assert "break_every" in designer.editing.opened.study.document["blocks"]["liquids"]
    designer.editing.ask(RemoveKey(("blocks", "liquids", "break_every")))
    assert designer.text == before


def test_every_optional_key_of_a_liquid_can_be_added_and_undone(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.select(("liquids", "thick"))
    before = designer.text
    absent = [row.path for section in designer.place.view.form.sections for row in section.absent]
    assert len(absent) > 5
    for path in absent:
        designer.editing.ask(AddKey(path))
        assert path[-1] in designer.editing.opened.study.document["liquids"]["thick"], path
        designer.editing.undo()
        assert designer.text == before


def test_a_broken_file_is_repaired_by_a_button(designer: Any, qtbot: Any) -> None:
    text = designer.file.read_text()
    designer.file.write_text(text.replace('liquid = "thick"', 'liquid = "thik"', 1))
    designer.controller.open("kitchen")
    assert designer.place.header.problems.words == "1 problem"
    designer.place.header.problems.click()
    qtbot.waitUntil(lambda: bool(designer.place.problems.lines[0].repairs))
    designer.place.problems.lines[0].repairs[0].click()
    assert designer.text == text
    assert designer.place.header.problems.words != "1 problem"


def test_deleting_with_gaps_leaves_faults_and_undo_takes_them_back(designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(DeleteElement(("liquids", "thick")))
    assert designer.editing.opened.study.faults
    designer.editing.undo()
    assert not designer.editing.opened.study.faults
