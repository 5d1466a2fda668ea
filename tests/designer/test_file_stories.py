"""Stories of a study's file, by keys, clicks and steps; after each act all parts of the window must agree."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import pytest

from study_app.designer.document.additions import localised_texts
from study_app.designer.document.steps import ChangeLanguage, RetypeFile, SetText, SetValue
from study_app.errors import StoreError
from study_app.protocol.source.files import protocol_hash
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.versions.drafts import Draft, draft_of, write_draft
from study_app.store.versions.study_settings import keep_original, kept_original
from study_app.store.versions.study_versions import content_hash
from tests.designer.support.designer import DEMO
from tests.designer.support.runs import run
from tests.designer.support.story import Story
from tests.gui.transcript import widget_lines

pytestmark = pytest.mark.slow
REPETITIONS = ("blocks", "liquids", "repetitions")
VERSION, TITLE = ("study", "version"), ("pages", "welcome", "title")


def drafts(story: Story) -> None:
    """Edits are kept as a draft, which is found again until it is saved or discarded; a shipped study is read-only."""
    designer, act = story.designer, story.act
    before = designer.file.read_bytes(), designer.file.stat().st_mtime_ns
    story.ask(SetValue(VERSION, "0.7"))
    story.expect("Draft kept HH:MM", undo="Change Version", kept="edited")
    story.play("ctrl+z")
    story.expect(undo="", kept="saved")
    story.play("ctrl+y")
    story.expect("Draft kept HH:MM", undo="Change Version", kept="edited")
    act("open the open one", lambda: designer.open(str(designer.file)))
    story.expect(undo="Change Version")
    act("to the file", lambda: designer.place.show_tab("file"))
    act("type into it", lambda: designer.place.file.editor.insertPlainText("# mine\n"))
    story.expect(undo="Edit the file", kept="edited", at="File text")
    edited = designer.text
    act("open a shipped one", lambda: designer.open("demo"))
    story.expect("This study ships with the program. Make a copy to change it.", undo="", kept="saved")
    shipped = designer.text
    story.ask(SetValue(VERSION, "9"))
    story.ask(RetypeFile("format = 2\n"))
    story.play("ctrl+s")
    assert designer.text == shipped
    act("open", designer.open)
    assert designer.text == edited
    assert designer.steps == ["Change Version", "Edit the file"]
    assert (designer.file.read_bytes(), designer.file.stat().st_mtime_ns) == before
    story.ask(SetValue(VERSION, "0.8"))
    act("leave", lambda: designer.window.go("home"))
    act("come back", lambda: designer.window.go("designer"))
    story.expect(at="Study outline", kept="edited")
    story.play("ctrl+s")
    story.expect(kept="saved")
    act("copy a shipped one", lambda: designer.controller.begin_study("demo", "mine"))
    story.expect("Draft kept HH:MM", kept="not saved", undo="")
    story.has('name = "mine"', 'version = "0.1"')
    assert kept_original(designer.file.with_name("mine.toml")) == "demo"
    story.play("ctrl+s")
    story.expect(kept="saved")


def banner(story: Story) -> None:
    """The line about a draft ends by undo, by saving and by closing it, and gives the keyboard back."""
    designer = story.designer
    ends = {"undo": "ctrl+z ctrl+z", "save": "ctrl+s", "close": "", "Esc": "ctrl+1 Escape", "go": "[Discard the draft]"}
    for end, acts in ends.items():
        story.act("open another", lambda: designer.open("demo"))
        text = designer.file.read_text("utf-8")
        write_draft(designer.file, Draft(text=f"{text}# {end}\n", base=content_hash(text.encode())))
        story.act("open a draft", designer.open)
        story.expect("Draft from today HH:MM, not saved", undo="Restore the draft", kept="edited")
        story.has(f"# {end}")
        story.ask(SetText(TITLE, "en", end))
        assert designer.place.banner.isVisible()
        if end == "close":
            story.play(":pages.welcome.title")
            story.act("to the cross", designer.place.banner.close_button.setFocus)
            story.play("space")
            story.expect(at="Title")
        story.play(acts)
        assert not designer.place.banner.isVisible()
        assert (f'title = "{end}"' in designer.text) == (end in ("save", "close", "Esc"))
        story.play("ctrl+s")
        story.expect(kept="saved", at="Title" if end == "close" else "Study outline")


def never_saved(story: Story) -> None:
    """A study that was never saved is discarded once that is confirmed."""
    designer = story.designer
    begin = partial(designer.controller.begin_study, "template:compare-liquids", "mine")
    mine = designer.file.with_name("mine.toml")
    story.act("begin", begin)
    story.expect("Draft kept HH:MM", kept="not saved", undo="")
    story.act("open another", designer.open)
    story.act("open it again", lambda: designer.open(str(mine)))
    story.expect("Draft from today HH:MM, never saved", kept="not saved")
    story.play("[Discard the draft] [Cancel]")
    assert draft_of(mine) is not None
    story.play("[Discard the draft]")
    story.act("confirm", designer.place.prompt.confirm.click)
    story.act("write the draft", lambda: designer.saving.write_draft(at_once=True))
    assert designer.editing.opened is None
    assert draft_of(mine) is None
    assert not mine.exists()
    story.act("open", designer.open)
    story.act("begin again", begin)
    story.expect("Draft kept HH:MM", kept="not saved")


def others(story: Story) -> None:
    """Another program changes, locks and deletes the file meanwhile."""
    designer = story.designer
    look = partial(story.act, "look", designer.controller.enter)

    def outside(old: str, new: str) -> None:
        designer.change((old, new))
        look()

    both = "Another program has changed this file, and you have edited it here too"
    outside("A first look", "Another look")
    story.expect(undo="Use the file's content", kept="saved")
    story.ask(SetValue(VERSION, "0.7"))
    outside("Another look", "A third look")
    story.expect(both, undo="Change Version", kept="edited")
    story.play("ctrl+s")
    assert "A third look" in designer.file.read_text("utf-8"), "not overwritten while that is asked"
    story.play("[Use the file's]")
    story.expect(undo="Use the file's content", kept="saved")
    story.has('title = "A third look"', 'version = "1.1"')
    story.ask(SetValue(VERSION, "0.8"))
    outside("A third look", "A fourth look")
    story.expect(both)
    story.play("[Keep mine] ctrl+s")
    story.expect(kept="saved")
    story.has('title = "A third look"', 'version = "0.8"')
    story.ask(SetValue(VERSION, "0.9"))
    session = designer.results / "kitchen" / "data" / "sub-P001" / "ses-01"
    session.mkdir(parents=True)
    opening = lock_folder(session)
    outside("Reaching", "Reach now")
    story.expect("A session of this study is running. Make a copy, or wait until it has ended.")
    story.ask(SetValue(VERSION, "1.0"))
    story.play("ctrl+s")
    story.expect(undo="Change Version", kept="edited")
    story.has('version = "0.9"')
    opening.release()
    look()
    story.expect(both)
    story.play("[Keep mine]")
    designer.file.unlink()
    look()
    story.expect("Another program has deleted or moved this file", kept="not saved")
    story.play("[Keep mine] ctrl+s")
    story.expect(kept="saved")
    other = designer.file.with_name("other.toml")
    other.write_bytes(b"format = 2\n# \xff\n")
    story.act("open a file that is no text", lambda: designer.open(str(other)))
    story.expect("other.toml cannot be opened: line 2 is not UTF-8 text: save the file as UTF-8.")
    assert designer.editing.opened.file == designer.file


@contextmanager
def refusing(name: str, words: str) -> Iterator[None]:
    """Let a function of the program fail meanwhile."""

    def refuse(*_values: object) -> None:
        raise StoreError(words)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(f"study_app.{name}", refuse)
        yield


def failing(story: Story) -> None:
    """Failures to delete, keep, read or write are reported once, and nothing is lost."""
    designer, saving = story.designer, story.designer.saving
    write, look = (partial(story.act, "write", saving.write_draft), partial(story.act, "look", saving.check_file))
    denied, not_up_to_date = "the draft cannot be deleted: Permission denied", "The draft is not up to date: the draft"
    story.ask(SetValue(VERSION, "0.7"))
    with refusing("store.versions.drafts.delete_draft", denied):
        story.drafts_are_kept = False
        story.play("ctrl+z")
        story.expect(not_up_to_date, kept="saved")
        write()
        write()
        assert story.spoken == []
        story.ask(SetValue(VERSION, "0.8"))
        story.play("ctrl+s")
        story.expect(not_up_to_date, kept="saved")
    story.drafts_are_kept = True
    write()
    story.ask(SetValue(VERSION, "0.9"))
    with refusing("designer.document.document.keep_content", "the disk is full"):
        story.play("ctrl+s")
        story.expect("The study was not saved: the disk is full.", kept="edited", undo="Change Version")
    killed, written_now, other = (
        designer.file.with_name(f".{name}.tmp")
        for name in ("kitchen.toml.0123abcd", "kitchen.toml.4567abcd", "other.toml.0123abcd")
    )
    for half in (killed, written_now, other):
        half.write_text("format = ", encoding="utf-8", newline="\n")
    for half in (killed, other):
        os.utime(half, (0, 0))
    story.play("ctrl+s")
    story.expect(kept="saved")
    assert [half.exists() for half in (killed, written_now, other)] == [False, True, True]
    for _ in range(2):
        with refusing("designer.document.document.Document.changed_outside", "kitchen.toml cannot be read: error"):
            look()
            look()
            assert story.spoken == ["Kitchen.toml cannot be read: error"]
        look()
        story.expect()
    keep_original(designer.file.with_name("pantry.toml"), "demo")  # of a study that was deleted
    story.ask(SetValue(VERSION, "1.1"))
    with refusing("designer.document.document.save_study", "the disk is full"):
        story.act("save as another", lambda: saving.save_as_another("pantry"))
        story.expect("The study was not saved: the disk is full.", undo="Save as pantry", kept="not saved")
    assert kept_original(designer.file.with_name("pantry.toml")) == "kitchen"
    story.act("begin", lambda: designer.controller.begin_study("template:compare-liquids", "mine"))
    story.act("open another", designer.open)
    story.act("open it again", lambda: designer.open(str(designer.file.with_name("mine.toml"))))
    with refusing("store.versions.drafts.delete_draft", denied):
        story.play("[Discard the draft]")
        story.act("confirm", designer.place.prompt.confirm.click)
        story.expect("The draft was not discarded: the draft cannot be deleted: Permission denied.", kept="not saved")


def versions(story: Story) -> None:
    """A study that was run is saved under the next version or as another study; its versions are shown and restored."""
    designer, card = story.designer, story.designer.controller.changes
    prompt = lambda: designer.place.prompt  # noqa: E731

    def ran(participant: str, source: bytes = b"", **facts: Any) -> None:
        source = source or designer.file.read_bytes()
        story.act(f"run {participant} {facts}", lambda: run(designer, participant, source, **facts))
        story.act("look", designer.controller.enter)

    ran("P001", study="kitchen-pilot", pilot=True)
    story.ask(SetValue(REPETITIONS, 2))
    story.play("ctrl+s")
    story.expect(kept="saved")
    ran("P001")
    ran("P002")
    as_run = designer.text
    story.ask(SetValue(REPETITIONS, 3))
    story.ask(SetText(TITLE, "en", "Hello"))
    story.play("ctrl+s")
    story.expect(kept="edited", undo="Type Title")
    story.act("version", prompt().version.setFocus)
    story.play("ctrl+a '1.1' Return")
    story.expect(kept="edited", at="Version to save as")
    story.play("ctrl+a '1.2' Return")
    story.expect(kept="saved", undo="Set version 1.2")
    story.has('version = "1.2"', 'title = "Hello"')
    story.ask(SetValue(REPETITIONS, 4))
    story.play("ctrl+s")
    story.expect(kept="saved")
    story.act("chip", designer.place.header.version.click)
    story.expect(at="Version to compare with")
    story.act("compare", lambda: card.compare_with(card.version.itemData(1)))
    story.act("restore", card.restore.click)
    assert designer.text == as_run
    assert designer.steps[-1].startswith("Restore 1.1: 2 sessions, last 20 Nov")
    story.play("ctrl+z")
    story.has('version = "1.2"', "repetitions = 4")
    ran("P003")
    ran("P001", study="pantry", source=designer.file.read_bytes().replace(b'"1.2"', b'"0.1"'))
    story.ask(SetValue(REPETITIONS, 5))
    story.act("save as pantry", lambda: designer.saving.save_as_another("pantry"))
    story.expect(
        "The study was not saved: version 0.1 has already been run with different content (1 session): save the "
        "study as version 0.2.",
        kept="not saved",
    )
    story.play("ctrl+s")
    story.act("another", prompt().another.click)
    story.play("'kitchen' Return")
    story.expect(at="Short name for the new study", kept="not saved")
    story.play("ctrl+a 'kitchen2' Return")
    story.expect(kept="saved", undo="Save as kitchen2")
    assert designer.editing.opened.file.name == "kitchen2.toml"
    story.act("open", designer.open)
    story.play("@questionnaires.delay.items.0")
    assert not designer.place.form.head.id.isEnabled() or designer.place.form.head.id.isReadOnly()
    story.act("unlock", designer.place.form.head.unlock.click)
    story.act("confirm", prompt().confirm.click)
    story.expect(at="ID")
    story.play("'difficult' Return")
    story.expect(undo="Rename to difficult")
    story.has('id = "difficult"')
    story.play("@pages.welcome ctrl+z")
    story.expect(selected="questionnaires.delay.items.0", kept="saved")
    story.play("@questionnaires.delay.items.0")
    early = designer.file.read_bytes().replace(b'"1.2"', b'"0.9"').replace(b"delay_ms = 200", b"delay_ms = 300")
    ran("P009", early, started_at="2026-11-18T12:00:00+00:00")
    story.act("compare", lambda: card.compare_with(protocol_hash(early)))
    differences = " ".join(widget_lines(designer.place.pane))
    assert 'study.version: previously "0.9", now "1.2"' in differences
    assert "300" not in differences, "what the conditions were is sealed"


def incomplete(story: Story) -> None:
    """A study that cannot be run yet is saved, and says so until it can be."""
    story.ask(ChangeLanguage("add", "nl"))
    count = len(story.designer.study.faults)
    assert count == sum(1 for _ in localised_texts(story.designer.study)), "each text is missing in Dutch"
    story.expect("1 problem", undo="Add Dutch")
    story.play("ctrl+s")
    story.expect("Saved, but the study cannot be run yet because of 1 problem", kept="saved")
    story.play("[Show the list] @device")
    (line,) = story.designer.place.problems.lines
    assert line.row.message == f"{count} texts are missing in Dutch"
    assert "missing" not in " ".join(widget_lines(story.designer.place.form)), (
        "no field complains before it was filled in"
    )
    story.ask(ChangeLanguage("copy", "nl"))
    story.expect("No problems", "1 warning", undo="Fill in Dutch")
    story.play("ctrl+s")
    story.expect(kept="saved")


def typed_into_the_file(story: Story) -> None:
    """Text typed into the file stays when the form is rebuilt; a fault is shown at its field."""
    editor = story.designer.place.file.editor

    def go_to(line: str, end: bool) -> None:
        cursor = editor.textCursor()
        number = next(at for at, text in enumerate(story.designer.text.split("\n")) if text.startswith(line))
        cursor.setPosition(editor.document().findBlockByNumber(number).position() + (0 if end else len('order = "')))
        cursor.movePosition(cursor.MoveOperation.EndOfBlock) if end else None
        editor.setTextCursor(cursor)
        editor.setFocus()

    story.play("@study")
    story.act("to the file", lambda: story.designer.place.show_tab("file"))
    story.act("behind a header", lambda: go_to("[study]", end=True))
    story.play("Return 'subtitle = ' '\"abc\"' ' # and more'")
    story.expect("1 problem", undo="Edit the file", at="File text")
    story.has('subtitle = "abc" # and more')
    story.play("@blocks.liquids")
    story.act("into the order", lambda: go_to('order = "', end=False))
    story.play("'x'")
    story.expect("2 problems", at="File text")
    story.has('order = "xshuffled"')
    story.play("F8")
    story.expect(selected="study", at="Remove: Study, Subtitle")
    story.play("ctrl+z")
    story.expect("1 problem", selected="blocks.liquids")
    story.has('order = "shuffled"')


def unreadable(story: Story) -> None:
    """A file that was never readable is opened at the line of its fault, and nothing can be added to it."""
    story.play("[Add an element (Insert)]" if story.designer.place.outline.add.isEnabled() else "Insert")
    story.expect(undo="", at="File text", selected="study")
    story.act("correct it", lambda: story.designer.editing.make_step("Correct the file", text=DEMO))
    story.expect("No problems", undo="Correct the file", kept="edited")
    story.act("outline", story.designer.controller.show_outline)
    assert story.designer.place.outline.add.isEnabled()


@pytest.mark.parametrize(
    "tell", [drafts, banner, never_saved, others, failing, versions, incomplete, typed_into_the_file]
)
def test_each_act_of_a_story_leaves_the_window_consistent(
    tell_story: Callable[..., None], tell: Callable[[Story], None]
) -> None:
    tell_story(tell)


def test_a_file_that_was_never_readable_is_corrected(tell_story: Callable[..., None]) -> None:
    tell_story(unreadable, DEMO.replace("[study]", "[study"))
