"""What goes wrong while drafts and files are written, and what another program does meanwhile."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel

from study_app.designer.document.steps import ChangeLanguage, SetText, SetValue
from study_app.errors import StoreError
from study_app.protocol.source.files import protocol_hash
from study_app.store.drafts import Draft, draft_of, keep
from study_app.store.sessions.folder_lock import open_alone
from study_app.store.study_versions import content_hash, kept_content

pytestmark = pytest.mark.slow

VERSION = ("study", "version")
TITLE = ("pages", "welcome", "title")


@pytest.fixture
def drafted(designer: Any) -> Any:
    """The designer with an edited study whose draft is written."""
    designer.open()
    designer.editing.ask(SetValue(VERSION, "0.7"))
    designer.saving.write_draft(at_once=True)
    assert draft_of(designer.file) is not None
    return designer


@pytest.fixture
def stuck(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """Drafts that cannot be deleted; undo it and they can."""

    def refuse(file: Path) -> None:
        raise StoreError(f"the draft of {file} cannot be deleted: Permission denied")

    monkeypatch.setattr("study_app.store.drafts.discard", refuse)
    return monkeypatch


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What the banner has a screen reader say."""
    found: list[str] = []
    monkeypatch.setattr("study_app.designer.place.header.say", lambda by, words: found.append(words))
    return found


def test_a_draft_that_cannot_be_deleted_is_said_once_and_stops_no_step(drafted: Any, stuck: pytest.MonkeyPatch) -> None:
    drafted.editing.undo()
    assert drafted.text == drafted.file.read_text()
    drafted.saving.write_draft()
    drafted.saving.write_draft()
    assert [title for title, _ in drafted.messages] == ["The draft is not up to date"]
    assert "cannot be deleted: Permission denied" in drafted.messages[0][1]
    stuck.undo()
    drafted.saving.write_draft()
    assert draft_of(drafted.file) is None


def test_a_file_is_saved_though_its_draft_cannot_be_deleted_and_half_a_file_is_left(
    drafted: Any, stuck: pytest.MonkeyPatch, qtbot: Any
) -> None:
    halves = [drafted.file.with_name(f".{name}.0123abcd.tmp") for name in (drafted.file.name, "other.toml")]
    for half in halves:
        half.write_text("format = ")
    with qtbot.waitSignal(drafted.saving.saved, timeout=1000):
        drafted.saving.save()
    assert drafted.file.read_text() == drafted.text
    assert "The study was not saved" not in dict(drafted.messages)
    assert [half.exists() for half in halves] == [False, True]


def test_nothing_is_written_where_the_content_cannot_be_kept(drafted: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_content: bytes) -> None:
        raise StoreError("the disk is full")

    before = drafted.file.read_bytes()
    with monkeypatch.context() as broken:
        broken.setattr("study_app.designer.document.document.keep_content", full)
        drafted.saving.save()
    assert ("The study was not saved", "the disk is full.") in drafted.messages
    assert drafted.file.read_bytes() == before
    drafted.saving.save()
    assert drafted.file.read_text() == drafted.text
    assert kept_content(protocol_hash(drafted.file.read_bytes())) is not None


def test_edits_of_a_read_only_study_whose_file_changed_are_asked_about_once_it_can_be_edited(drafted: Any) -> None:
    session = drafted.results / "kitchen" / "data" / "sub-P001" / "ses-01"
    session.mkdir(parents=True)
    opening = open_alone(session)
    drafted.file.write_text(drafted.file.read_text() + "# outside\n")
    drafted.controller.enter()
    assert "session of this study is under way" in drafted.place.banner.words.text()
    assert [action for action, _ in drafted.place.view.banner.actions] == ["copy"]
    assert 'version = "0.7"' in drafted.text
    opening.release()
    drafted.controller.enter()
    assert [action for action, _ in drafted.place.view.banner.actions] == ["keep", "take", "compare"]


def test_a_draft_goes_where_the_files_content_is_taken(drafted: Any) -> None:
    drafted.change(("A first look", "Another look"))
    drafted.saving.look_again()
    drafted.saving.answer_banner("take")
    assert drafted.text == drafted.file.read_text()
    assert draft_of(drafted.file) is None


def test_a_deleted_file_is_written_anew_where_mine_is_kept(drafted: Any) -> None:
    drafted.file.unlink()
    drafted.controller.enter()
    assert drafted.place.banner.words.text() == "Another program deleted or moved this file"
    next(iter(drafted.place.banner.buttons.values())).click()
    assert not drafted.place.banner.isVisible()
    drafted.saving.save()
    assert drafted.file.read_text() == drafted.text


def test_a_file_that_cannot_be_read_is_said_at_once_until_it_can_be(
    designer: Any, said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def unreadable(_opened: object) -> bool:
        raise StoreError("kitchen.toml cannot be read: Input/output error")

    designer.open()
    for _ in range(2):
        with monkeypatch.context() as broken:
            broken.setattr("study_app.designer.document.document.Document.changed_outside", unreadable)
            designer.saving.look_again()
            designer.saving.look_again()
            assert designer.place.banner.words.text() == "Kitchen.toml cannot be read: Input/output error"
        designer.saving.look_again()
        assert not designer.place.banner.isVisible()
    assert said == ["Kitchen.toml cannot be read: Input/output error"] * 2


def test_saving_says_that_the_study_cannot_be_run_until_it_is_edited(drafted: Any, said: list[str]) -> None:
    drafted.editing.ask(ChangeLanguage("add", "nl"))
    count = len(drafted.study.faults)
    assert count > 10
    drafted.saving.save()
    words = f"Saved. It cannot be run yet: {count} problems"
    assert drafted.place.banner.words.text() == words
    assert drafted.place.banner.isVisible()
    assert said == [words]
    next(iter(drafted.place.banner.buttons.values())).click()
    assert drafted.place.problems.isVisible()
    drafted.editing.select(("device",))
    assert drafted.place.banner.isVisible()
    drafted.editing.ask(ChangeLanguage("copy", "nl"))
    assert not drafted.place.banner.isVisible()
    drafted.saving.save()
    assert not drafted.place.banner.isVisible()
    assert drafted.file.read_text() == drafted.text


def test_the_line_about_a_draft_ends_by_undo_by_saving_and_by_closing_it(designer: Any, qtbot: Any) -> None:
    banner, text = designer.place.banner, designer.file.read_text()
    for end in ("undo", "save", "button", "escape"):
        designer.open("demo")
        assert not banner.close_button.isVisible(), "a read-only study stays one"
        keep(designer.file, Draft(f"{text}# {end}\n", content_hash(designer.file.read_bytes())))
        designer.open()
        assert designer.place.banner.words.text().startswith("Draft of today")
        designer.editing.ask(SetText(TITLE, "en", end))
        assert banner.isVisible()
        if end == "undo":
            designer.editing.undo()
            assert banner.isVisible(), "the draft still differs from the file"
            designer.editing.undo()
        elif end == "save":
            designer.saving.save()
        elif end == "button":
            qtbot.mouseClick(banner.close_button, Qt.MouseButton.LeftButton)
            designer.saving.look_again()
        else:
            designer.place.parts.focus_outline()
            qtbot.keyClick(designer.window.focusWidget(), Qt.Key.Key_Escape)
        assert not banner.isVisible()
        assert designer.editing.opened.edited == (end in {"button", "escape"})
        designer.saving.save()


@pytest.mark.parametrize("button", ["close", "discard"])
def test_a_line_that_is_answered_by_a_key_gives_the_keyboard_back(designer: Any, qtbot: Any, button: str) -> None:
    keep(designer.file, Draft(f"{designer.file.read_text()}# more\n", content_hash(designer.file.read_bytes())))
    designer.open("kitchen", *TITLE[:2])
    banner, field = designer.place.banner, next(iter(designer.field(*TITLE).lines.values()))
    field.setFocus()
    pressed = banner.close_button if button == "close" else next(iter(banner.buttons.values()))
    pressed.setFocus(Qt.FocusReason.TabFocusReason)
    qtbot.keyClick(pressed, Qt.Key.Key_Space)
    assert not banner.isVisible()
    assert field.hasFocus()


@pytest.fixture
def never_saved(designer: Any) -> Any:
    """The designer with a study that was never saved, opened by its draft."""
    designer.controller.begin("template:compare-liquids", "mine")
    designer.open()
    designer.open(str(designer.file.with_name("mine.toml")))
    return designer


def test_a_study_that_was_never_saved_is_discarded_once_that_is_confirmed(never_saved: Any) -> None:
    place, file = never_saved.place, never_saved.file.with_name("mine.toml")
    assert place.banner.words.text().endswith(", never saved")
    next(iter(place.banner.buttons.values())).click()
    assert "cannot be undone" in " ".join(one.text() for one in place.prompt.findChildren(QLabel))
    assert place.prompt.cancel.hasFocus()
    place.prompt.cancel.click()
    assert draft_of(file) is not None
    next(iter(place.banner.buttons.values())).click()
    place.prompt.go_on.click()
    assert draft_of(file) is None
    assert never_saved.editing.opened is None
    assert place.nothing.isVisible()
    assert place.nothing.new.hasFocus()
    assert (place.prompt, place.banner.isVisible(), place.parts.isVisible()) == (None, False, False)
    assert file.name not in [one.file for one in place.header.state.studies]
    never_saved.saving.write_draft(at_once=True)
    assert draft_of(file) is None
    never_saved.open()
    assert place.parts.isVisible()
    never_saved.controller.begin("template:compare-liquids", "mine")
    assert never_saved.editing.opened.done == []


def test_a_study_stays_open_where_its_draft_cannot_be_deleted(never_saved: Any, stuck: pytest.MonkeyPatch) -> None:
    next(iter(never_saved.place.banner.buttons.values())).click()
    never_saved.place.prompt.go_on.click()
    assert [title for title, _ in never_saved.messages] == ["The draft was not discarded"]
    assert never_saved.editing.opened.name == "mine"
    stuck.undo()
