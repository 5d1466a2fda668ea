"""The designer's controller: opening, drafts, saving, versions, and what another program does to the file."""

import os
from typing import Any

import pytest

from study_app.designer.document.steps import RetypeFile, SetText, SetValue
from study_app.protocol.source.files import shipped, shipped_file
from study_app.store.drafts import draft_of

pytestmark = pytest.mark.slow


def test_opening_and_looking_at_every_form_changes_neither_file_nor_its_time(designer: Any) -> None:
    before = (designer.file.read_bytes(), designer.file.stat().st_mtime_ns)
    designer.open()
    for row in designer.place.outline.rows:
        if row.path:
            designer.editing.select(row.path)
    designer.window.go("home")
    assert (designer.file.read_bytes(), designer.file.stat().st_mtime_ns) == before
    assert draft_of(designer.file) is None


def test_an_edit_changes_its_bytes_alone_is_undone_redone_and_saved(designer: Any) -> None:
    before = designer.file.read_text()
    designer.open()
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
    designer.open()
    page = designer.editing.opened.selected
    for text in ("H", "He", "Hel", "Hello"):
        designer.editing.ask(SetText((*page, "title"), "en", text))
    assert "Hello" in designer.text
    designer.editing.undo()
    assert designer.text == before


def test_opening_the_open_study_again_keeps_its_steps(designer: Any) -> None:
    before = designer.file.read_text()
    designer.open()
    designer.editing.ask(SetValue(("study", "version"), "0.7"))
    designer.open(str(designer.file))
    assert designer.saving.banner is None
    designer.editing.undo()
    assert designer.text == before


def test_what_is_being_typed_stays_in_its_study_when_another_is_opened(designer: Any) -> None:
    designer.open()
    designer.place.show_tab("file")
    designer.place.file.editor.insertPlainText("# mine\n")
    designer.open("rek2024")
    assert "# mine" not in designer.text
    draft = draft_of(designer.file)
    assert draft is not None
    assert "# mine" in draft.text


def test_a_draft_is_kept_on_leaving_and_found_again_until_it_is_discarded(designer: Any) -> None:
    before = designer.file.read_text()
    designer.open()
    designer.editing.ask(SetValue(("study", "version"), "0.7"))
    designer.window.go("home")
    draft = draft_of(designer.file)
    assert draft is not None
    assert 'version = "0.7"' in draft.text
    assert designer.file.read_text() == before

    again = type(designer.controller)(designer.results)
    again.open("kitchen")
    assert again.editing.opened.study.text == draft.text
    assert again.place.banner.words.text().startswith("Draft of today")
    again.saving.answer_banner("discard")
    assert again.editing.opened.study.text == before
    assert draft_of(designer.file) is None
    again.place.deleteLater()


def test_a_file_changed_outside_is_taken_in_or_asked_about_and_never_overwritten(designer: Any) -> None:
    before = designer.file.read_text()
    designer.open()
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


@pytest.mark.variants(4)
@pytest.mark.parametrize("name", shipped())
def test_a_shipped_study_is_read_only_and_can_be_copied(designer: Any, name: str) -> None:
    before = shipped_file(name).read_bytes()
    designer.open(name)
    assert "ships with the program" in designer.place.banner.words.text()
    text = designer.text
    designer.editing.ask(SetValue(("study", "version"), "9"))
    designer.editing.ask(RetypeFile("format = 1\n"))
    designer.saving.save()
    assert designer.text == text
    assert shipped_file(name).read_bytes() == before
    designer.controller.begin(name, "mine")
    assert not designer.editing.opened.file.exists()
    assert designer.study.faults == ()
    designer.saving.save()
    assert designer.editing.opened.file.read_text() == designer.text


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="everybody may write here")
def test_a_file_that_may_not_be_written_is_read_only(designer: Any) -> None:
    designer.file.chmod(0o444)
    designer.open()
    assert "may not write" in designer.place.banner.words.text()


def test_a_file_that_is_not_utf_8_is_refused_with_a_message(designer: Any) -> None:
    designer.file.write_bytes(b"format = 1\n# \xff\n")
    designer.open()
    assert designer.messages == [("kitchen.toml cannot be opened", "line 2 is not UTF-8 text: save the file as UTF-8.")]
