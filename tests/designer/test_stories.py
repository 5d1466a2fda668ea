"""Stories in the designer's window by keys, clicks and steps, compared with reviewed texts of what each act changes."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import groupby
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QDropEvent, QEnterEvent, QGuiApplication, QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QLabel

from study_app.designer.document.additions import texts_of
from study_app.designer.document.steps import (
    AddElement,
    AddInstrument,
    AddNamed,
    ChangeLanguage,
    RenameElement,
    RetypeFile,
    SetText,
    SetValue,
)
from study_app.designer.document.study import read_study
from study_app.errors import StoreError
from study_app.gui.widgets.cards import Chip
from study_app.protocol.source.files import protocol_hash
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.versions.drafts import Draft, draft_of, write_draft
from study_app.store.versions.study_settings import keep_original, kept_original
from study_app.store.versions.study_versions import content_hash
from tests.designer.support.designer import DEMO
from tests.designer.support.runs import run
from tests.designer.support.story import Story
from tests.gui.transcript import told

pytestmark = pytest.mark.slow
REPETITIONS = ("blocks", "liquids", "repetitions")
VERSION, TITLE = ("study", "version"), ("pages", "welcome", "title")
ITEMS = ("questionnaires", "liquid", "items")
LISTED = ("blocks", "liquids", "conditions")
NONE, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


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
    story.act("confirm", designer.place.prompt.go_on.click)
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
    story.has('title = "A third look"', 'version = "1.0"')
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
    outside("Now reach", "Reach now")
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
    """What cannot be deleted, kept, read or written is said once, and nothing is lost."""
    designer, saving = story.designer, story.designer.saving
    write, look = (partial(story.act, "write", saving.write_draft), partial(story.act, "look", saving.look_again))
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
        story.act("confirm", designer.place.prompt.go_on.click)
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
    story.play("ctrl+a '1.0' Return")
    story.expect(kept="edited", at="Version to save as")
    story.play("ctrl+a '1.1' Return")
    story.expect(kept="saved", undo="Set version 1.1")
    story.has('version = "1.1"', 'title = "Hello"')
    story.ask(SetValue(REPETITIONS, 4))
    story.play("ctrl+s")
    story.expect(kept="saved")
    story.act("chip", designer.place.header.version.click)
    story.expect(at="Version to compare with")
    story.act("compare", lambda: card.compare_with(card.version.itemData(1)))
    story.act("restore", card.restore.click)
    assert designer.text == as_run
    assert designer.steps[-1].startswith("Restore 1.0: 2 sessions, last 20 Nov")
    story.play("ctrl+z")
    story.has('version = "1.1"', "repetitions = 4")
    ran("P003")
    ran("P001", study="pantry", source=designer.file.read_bytes().replace(b'"1.1"', b'"0.1"'))
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
    story.act("confirm", prompt().go_on.click)
    story.expect(at="ID")
    story.play("'difficult' Return")
    story.expect(undo="Rename to difficult")
    story.has('id = "difficult"')
    story.play("@pages.welcome ctrl+z")
    story.expect(selected="questionnaires.delay.items.0", kept="saved")
    story.play("@questionnaires.delay.items.0")
    early = designer.file.read_bytes().replace(b'"1.1"', b'"0.9"').replace(b"delay_ms = 200", b"delay_ms = 300")
    ran("P009", early, started_at="2026-11-18T12:00:00+00:00")
    story.act("compare", lambda: card.compare_with(protocol_hash(early)))
    differences = " ".join(told(designer.place.pane))
    assert 'study.version: previously "0.9", now "1.1"' in differences
    assert "300" not in differences, "what the conditions were is sealed"


def incomplete(story: Story) -> None:
    """A study that cannot be run yet is saved, and says so until it can be."""
    story.ask(ChangeLanguage("add", "nl"))
    count = len(story.designer.study.faults)
    assert count == sum(1 for _ in texts_of(story.designer.study)), "each text is missing in Dutch"
    story.expect("1 problem", undo="Add Dutch")
    story.play("ctrl+s")
    story.expect("Saved, but the study cannot be run yet because of 1 problem", kept="saved")
    story.play("[Show the list] @device")
    (line,) = story.designer.place.problems.lines
    assert line.row.message == f"{count} texts are missing in Dutch"
    assert "missing" not in " ".join(told(story.designer.place.form)), "no field complains before it was filled in"
    story.ask(ChangeLanguage("copy", "nl"))
    story.expect("No problems", "1 warning", undo="Fill in Dutch")
    story.play("ctrl+s")
    story.expect(kept="saved")


def names(story: Story) -> None:
    """Ids are renamed, refused, and follow the text of a new element until it is used or renamed."""
    designer, form = story.designer, story.designer.place.form

    def first_text() -> None:
        story.act("to the first empty text", lambda: form.focus_first_text(filled=False))

    story.select("liquids", "thin")
    story.ask(RenameElement(("liquids", "thin"), "thick"))
    story.expect(undo="", selected="liquids.thin")
    assert "thick" in form.head.refusal.text()
    story.play("@pages.thanks F2 'goodbye' Return")
    story.expect("1 place updated", selected="pages.goodbye", at="ID", undo="Rename to goodbye, 1 place updated")
    story.has('sequence = ["welcome", "liquids", "reaching", "delays", "goodbye"]', "[pages.goodbye]")
    story.ask(AddElement(("blocks",)))
    story.expect(selected="blocks.block", undo="Add block", at="ID")
    story.press("Add Title")
    first_text()
    story.play("'Sec' 'ond' ' part'")
    story.has("[blocks.block]", 'title = "Second part"')
    story.play("Tab")
    story.expect(selected="blocks.second_part", undo="Rename to second_part")
    story.ask(SetText(("blocks", "second_part", "title"), "en", "Third part"))
    story.act("to another one", lambda: designer.place.outline.chosen.emit(("blocks", "liquids")))
    story.has("[blocks.second_part]", 'title = "Third part"')
    story.ask(AddElement(("blocks",)))
    story.has('sequence = ["welcome", "liquids", "block", "reaching", "delays", "goodbye", "second_part"]')
    story.press("Add Title")
    first_text()
    story.play("'Last'")
    story.act("to its title", lambda: designer.place.outline.chosen.emit((*designer.editing.selected, "title")))
    story.expect(selected="blocks.last.title", undo="Rename to last")
    designer.editing.recorded = lambda _element: frozenset({"cold", "question_2"})
    story.ask(AddElement(ITEMS))
    story.act("to another one", lambda: designer.place.outline.chosen.emit(("study",)))
    story.select(*ITEMS, 2)
    first_text()
    story.play("'Cold?' Tab")
    assert designer.value(*ITEMS, 2) == {"id": "cold_2", "text": "Cold?", "short": "Cold"}, "cold was recorded"
    story.ask(AddElement(ITEMS))
    story.ask(RenameElement(designer.editing.selected, "warm"))
    first_text()
    story.play("'Hot?' Tab @blocks.liquids")
    assert designer.value(*ITEMS, 3, "id") == "warm", "it was renamed"
    story.ask(AddNamed(("blocks", "liquids", "questionnaire"), "questionnaires"))
    story.expect(selected="questionnaires.questionnaire")
    story.ask(SetValue((*designer.editing.selected, "title"), "Afterwards"))
    story.select("study")
    story.has("[questionnaires.afterwards]", 'questionnaire = "afterwards"')
    assert designer.undo_all() == story.designer.file.read_text("utf-8")


def one_instead(story: Story) -> None:
    """One key is given in place of another and back; undo brings its value back."""
    row = story.designer.form_row
    story.select("tasks", "reach")
    for key, at, other in (("count", 1, "duration_s"), ("duration_s", 0, "count")):
        story.act(f"in place of {key}", lambda key=key, at=at: row("tasks", "reach", key).keys.buttons[at].click())
        task = story.designer.value("tasks", "reach")
        assert (key in task, task[other]) == (False, 1)
    story.expect(undo="Specify Number of targets")
    story.play("ctrl+z ctrl+z @blocks.liquids")
    story.expect(kept="saved")
    story.has("count = 6")
    story.act("a stimulus", row(*LISTED).keys.buttons[1].click)
    story.expect(undo="")


def questions(story: Story) -> None:
    """Insert and Enter add a question below the one whose text is typed; a question is one paragraph."""
    designer = story.designer
    story.play("@questionnaires.liquid.items.0 :questionnaires.liquid.items.0.text ctrl+a 'How was it?' Insert Return")
    story.expect(selected="questionnaires.liquid.items.1", undo="Add question", at="Text")
    assert [item["id"] for item in designer.value(*ITEMS)] == ["feels_liquid", "question", "like_honey"]
    assert designer.value(*ITEMS, 0, "text") == "How was it?"
    QGuiApplication.clipboard().setText("Would you say\nthat this liquid\nis one?")
    pasted = "Would you say that this liquid is one?"
    story.play(":questionnaires.liquid.items.1.text ctrl+a ctrl+v Return")
    assert (designer.value(*ITEMS, 1, "text"), designer.value(*ITEMS, 1, "short")) == (pasted, pasted[:-1])
    story.play("ctrl+a ctrl+x")
    assert designer.form_row(*ITEMS, 1, "text").row.unfinished
    story.play("Escape")
    story.expect(at="Text")
    assert designer.value(*ITEMS, 1, "text") == pasted
    assert designer.undo_all() == designer.file.read_text("utf-8")


def fields(story: Story) -> None:
    """What is refused stays with its reason until Esc; the next element shows nothing of the one before."""
    designer = story.designer
    field, form = designer.field, lambda: " ".join(told(designer.place.form))
    story.play("@blocks.liquids :blocks.liquids.repetitions ctrl+a '2x' Tab")
    assert field(*REPETITIONS).line.text() == "2x"
    assert "“2x” is not a number" in form()
    story.expect(undo="", at="Order")
    story.play("shift+Tab Escape")
    assert (field(*REPETITIONS).line.text(), "“2x” is not a number" in form()) == ("1", False)
    story.play("@liquids.thin :liquids.thin.density_kg_m3 ctrl+a '12x' Return")
    assert "“12x” is not a number" in form()
    story.play("@liquids.thick")
    assert "12x" not in form()
    assert field("liquids", "thick", "density_kg_m3").line.property("state") == ""
    story.play(":liquids.thick.density_kg_m3 Escape @liquids.thin")
    assert "12x" not in form()
    story.expect(undo="", kept="saved")
    story.play("@blocks.liquids :blocks.liquids.title Home ctrl+Delete")
    story.expect("1 problem", undo="Type Title")
    story.play("End ' now'")
    assert designer.value("blocks", "liquids", "title") == " now"
    story.play("ctrl+Delete")
    story.expect(undo="Remove Title", at="Add Title")
    story.play("ctrl+z")
    story.expect(undo="Type Title", at="Title")
    story.play("@tasks.explore")
    story.ask(SetValue(("tasks", "explore", "kind"), "reach"))
    story.expect("5 problems")
    story.play(":tasks.explore.dwell_s ctrl+z")
    story.expect("No problems", at="Explore")
    story.play("@conditions.thin :conditions.thin.view 'f' 'ront'")
    story.expect("1 problem", undo="Change View")
    assert designer.value("conditions", "thin", "view") == "front"
    story.play("Escape")
    assert designer.value("conditions", "thin", "view") == ""
    delay = ("conditions", "thin", "force_delay_ms")
    for typed, leave, then in (("7", "Tab", "Force jitter"), ("8", "shift+Tab", "Hidden")):
        story.play(f":{'.'.join(delay)} '{typed}' {leave}")
        assert designer.value(*delay) == int(typed)
        story.expect(undo="Change Force delay", at=then)
        story.play("ctrl+z")
        assert designer.value(*delay) is None
    story.select("blocks", "liquids")
    for path in [row.row.path for row in designer.place.form.rows if row.row.is_removable]:
        value, text = designer.value(*path), designer.text
        story.play(f":{'.'.join(path)} ctrl+Delete")
        assert designer.value(*path) != value
        story.play("ctrl+z")
        assert designer.text == text


def adaptive(story: Story) -> None:
    """Fields of a study of levels have the names of the field of study; a refused list of numbers says so."""
    story.act("begin", lambda: story.designer.controller.begin_study("template:viscosity-jnd", "thicker"))
    levels = story.designer.value("methods", "easy", "levels")
    story.play("@methods.easy :methods.easy.levels ctrl+a '0.5 x' Return")
    assert "“x” is not a number. The study still contains 0.5; press Esc to restore it." in " ".join(
        told(story.designer.place.form)
    )
    story.play("Escape")
    assert story.designer.value("methods", "easy", "levels") == levels
    story.select("stimuli", "damping")
    phases = {0: ("tasks.stir", "Cycles"), 1: ("designs.pair", "Pause"), 3: ("designs.pair", "Question"),
              4: ("designs.pair", "Feedback duration"), 5: ("designs.pair", "Between trials")}  # fmt: skip
    for phase, (element, at) in phases.items():
        story.select("blocks", "training")
        story.act(f"phase {phase}", story.designer.field("blocks", "training", "design").extra.phases[phase].click)
        story.expect(selected=element, at=at)
    named = {
        "liquids.damper.drag.damping_nspm": "Viscosity (damping)",
        "stimuli.damping.vary": "Varied quantity",
        "blocks.viscosity.catch.wrong_most": "Maximum incorrect catch trials",
    }
    for path, at in named.items():
        story.play(f"@{'.'.join(path.split('.')[:2])} :{path}")
        story.expect(at=at)


def header(story: Story) -> None:
    """A disabled button of the header gives the keyboard back; keys in the list of studies open no other one."""
    designer, box = story.designer, story.designer.place.header.study
    story.play("@blocks.liquids :blocks.liquids.repetitions ctrl+a '3'")
    buttons = designer.place.header
    for button, kept in ((buttons.undo, "saved"), (buttons.redo, "edited"), (buttons.save, "saved")):
        name, at = button.accessibleName(), button.mapToGlobal(QPoint(9, 9))
        story.act(f"click {name}", lambda at=at: designer.hand.click(at))
        story.expect(kept=kept, at="Repetitions")
        story.act(f"click {name}, disabled", lambda at=at: designer.hand.click(at))
        story.expect(kept=kept, at="Repetitions")
    designer.file.with_name("zeta.toml").write_text(
        DEMO.replace('"demo"', '"zeta"').replace("A first look", "Zebra"), encoding="utf-8", newline="\n"
    )
    story.act("look", designer.controller.enter)
    story.act("to the list", box.setFocus)
    story.play("Escape ctrl+Home")
    altgr = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier
    story.act("AltGr+Z", lambda: QApplication.sendEvent(box, QKeyEvent(QEvent.Type.KeyPress, Qt.Key.Key_Z, altgr, "z")))
    assert not box.view().isVisible()
    for key in ("Home", "End", "PageDown", "Up", "Return", "Space", "F4", "Z"):
        story.play(key)
        assert box.view().isVisible(), key
        if key != "Z":
            story.act("close it", box.hidePopup)
        story.expect(selected="blocks.liquids")
    story.act("Enter in the list", lambda: QTest.keyClick(box.view(), Qt.Key.Key_Return))
    assert designer.editing.opened.file.name == "zeta.toml"


def keys_without_a_field(story: Story) -> None:
    """Letters and space do nothing where no field has the keyboard."""
    designer, place = story.designer, story.designer.place
    story.play("@blocks.liquids")
    story.act("measures", lambda: place.show_tab("measures"))
    row = designer.form_row("blocks", "liquids", "title").words
    for name, part in (("row", row), ("outline", place.outline), ("measures", place.measures)):
        story.play(":blocks.liquids.title")
        story.act(f"click {name}", lambda part=part: designer.click_on(part, at=QPoint(3, 3)))
        story.play("'no plan s d n o v x 1 2'")
        story.expect(undo="", selected="blocks.liquids", kept="saved")


def typed_into_the_file(story: Story) -> None:
    """What is typed into the file stays there where the form is made anew; a fault reaches its field."""
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


def repairs(story: Story) -> None:
    """F8 leads to a field, Tab to its repair; a letter there goes to the field; no repair moves below the pointer."""
    designer, problems = story.designer, story.designer.place.problems

    def pointer(kind: QEvent) -> None:
        QApplication.sendEvent(problems, kind)

    text = story.text.replace('liquid = "thick"', 'liquid = "thik"', 1).replace(
        "force_limit_n = 6", "force_limit_n = 60"
    )
    story.ask(RetypeFile(text.replace("delay_ms = 0", 'delay_ms = "a"', 1).replace("min_s = 5 ", 'min_s = "a" ')))
    story.expect("4 problems")
    story.play("ctrl+1 ctrl+4")
    story.act("pointer over it", lambda: pointer(QEnterEvent(QPointF(5, 5), QPointF(5, 5), QPointF(5, 5))))
    shown = [line.row.fault for line in problems.lines]
    story.act("repair", lambda: designer.click_on(next(line for line in problems.lines if line.repairs).repairs[0]))
    story.expect("3 problems", undo="Use 8", selected="device", at="Force limit")
    assert designer.value("device", "force_limit_n") == 8
    assert [line.row.fault for line in problems.lines] == shown, "no line moves below the pointer"
    story.ask(SetValue(VERSION, 3))
    assert [line.row.fault for line in problems.lines] == [row.fault for row in designer.place.view.problems]
    story.act("pointer away", lambda: pointer(QEvent(QEvent.Type.Leave)))
    assert [line.row.fault for line in problems.lines] == [row.fault for row in designer.place.view.problems]
    story.play("ctrl+z ctrl+z ctrl+1 F8")
    story.expect("3 problems", "4 problems", selected="conditions.thin", at="Visual delay")
    story.play("Return F8")
    story.expect(selected="conditions.thick", at="Liquid")
    story.play("ctrl+1 ctrl+2")
    story.expect(at="Liquid")
    story.play("Tab")
    story.expect(at='Use "thick": Condition Thick, Liquid')
    story.play("Return")
    story.expect("3 problems", undo='Use "thick"', at="Liquid")
    story.play("F8")
    story.expect(selected="tasks.explore", at="Minimum duration")
    text = DEMO.replace('languages = ["en"]', 'languages = ["en", "nl"]').replace(
        'title = "Liquids"', 'title.en = "Liquids"'
    )
    story.ask(RetypeFile(text))
    story.play("ctrl+1 F8")
    story.expect("26 problems", at="Instruction, Dutch")
    story.play("Tab")
    story.expect(at="Use this text in every language: Task Reach, Instruction")
    story.play("'E' 'en titel'")
    story.expect("25 problems", at="Instruction, Dutch")
    assert designer.value("tasks", "reach", "instruction", "nl") == "Een titel"


def warnings(story: Story) -> None:
    """The chip of warnings opens a list of them, of the study or of the selected element alone."""
    problems = story.designer.place.problems
    story.ask(SetValue(("liquids", "thick", "density_kg_m3"), 1001))
    story.expect("1 warning")
    story.act("chip", story.designer.place.header.problems.click)
    (warning,) = problems.rows
    assert (warning.warning, warning.element) == (True, ("liquids", "thin"))
    story.act("next", problems.next.click)
    story.expect(selected="liquids.thin")
    story.act("of this element", lambda: problems.limit.chosen.emit(True))
    assert [line.row for line in problems.lines if line.isVisible()] == [warning]
    story.play("@pages.welcome")
    assert [line.row for line in problems.lines if line.isVisible()] == []
    story.act("of the study", lambda: problems.limit.chosen.emit(False))
    assert [line.row for line in problems.lines if line.isVisible()] == [warning]
    story.play("ctrl+z")
    story.expect("No problems", kept="saved")


def tab_key(story: Story) -> None:
    """Tab goes through header, outline, form, views, problems, a question and the banner, as they are seen."""
    designer = story.designer
    for how in ("add", "copy"):
        story.ask(ChangeLanguage(how, "nl"))
    story.ask(SetValue(("device", "force_limit_n"), 60))
    story.play("ctrl+s @blocks.liquids ctrl+4")
    story.act("ask to delete", lambda: designer.controller.ask_to_delete(("liquids", "thick")))
    place = designer.place
    parts = {"header": place.header, "banner": place.banner, "outline": place.outline, "question": place.prompt}
    parts |= {"path": designer.area("Element path"), "form": place.form, "views": place.pane}
    parts["problems"] = place.problems

    def areas(tabs: int) -> list[str]:
        """Return the parts that Tab goes through, each as often as it is entered."""
        story.play("ctrl+5")
        entered = []
        for _ in range(tabs):
            entered.append(next((name for name, part in parts.items() if part.isAncestorOf(designer.keyboard)), "else"))
            designer.hit("Tab")
        return [name for name, _ in groupby(entered)]

    assert areas(76) == ["header", "banner", "outline", "question", "form", "views", "problems"]
    story.act("answer", place.prompt.cancel.click)
    story.act("smaller", lambda: designer.window.resize(1366, 800))
    assert areas(30) == ["header", "banner", "path", "form"]


def entries(story: Story) -> None:
    """Entries of a list are selected, moved, copied, opened and removed, by the mouse and by keys."""
    designer = story.designer
    field = partial(designer.field, *LISTED)

    def click(at: int) -> None:
        story.act(f"click entry {at}", lambda: designer.click_on(field().rows[at], at=QPoint(30, 12)))

    extra = "".join(f'\n[conditions.{name}]\nliquid = "thin"\ndelay_ms = {at}\n' for at, name in enumerate("cd", 1))
    text = story.text.replace('conditions = ["thin", "thick"]', 'conditions = ["thin", "thick", "c", "d"]')
    story.ask(RetypeFile(text + extra))
    story.select(*LISTED[:2])
    click(1)
    for keys, said, order in (
        ("alt+Up", "Thick, now 1 of 4", "thick thin c d"),
        ("alt+Up", "", "thick thin c d"),
        ("alt+Down", "Thick, now 2 of 4", "thin thick c d"),
        ("alt+Down", "Thick, now 3 of 4", "thin c thick d"),
        ("alt+Down", "Thick, now 4 of 4", "thin c d thick"),
        ("ctrl+d", "", "thin c d thick"),
        ("Delete", "No problems", "thin c d"),
        ("ctrl+z", "1 problem", "thin c d thick"),
    ):
        story.play(keys)
        assert designer.value(*LISTED) == tuple(order.split()) == tuple(designer.value(*LISTED))
        story.expect(*filter(None, [said]), at="Conditions")
    story.play("@blocks.liquids")
    field().list.setCurrentRow(0)
    at = QPointF(field().rows[1].geometry().bottomLeft())
    drop = QDropEvent(at, Qt.DropAction.MoveAction, QMimeData(), LEFT, NONE)
    story.act("drop the first below the second", lambda: field().list.dropEvent(drop))
    story.expect("Thin, now 2 of 4", undo="Move Thin")
    assert list(designer.value(*LISTED)) == ["c", "thin", "d", "thick"]
    story.act("to the second", field().rows[1].setFocus)
    story.expect(at="Conditions, Thin, 2 of 4")
    story.play("alt+Down alt+Up")
    story.expect("Thin, now 3 of 4", "Thin, now 2 of 4")
    story.play("Return")
    story.expect(selected="conditions.thin")
    story.play("@blocks.liquids")
    story.act("to the second", field().rows[1].setFocus)
    story.act("double click", lambda: QTest.mouseDClick(field().rows[1], LEFT))
    story.expect(selected="blocks.liquids", at="Conditions, Thin, 2 of 4")


def menu(story: Story) -> None:
    """The menu of the outline does what keys do; an element that is used is deleted with what names it."""
    story.play("@conditions.late")
    story.act("outline", story.designer.controller.show_outline)
    story.press_row("conditions", "late")
    story.play("ctrl+d")
    story.expect(selected="conditions.late_2", undo="Duplicate Late")
    assert story.designer.value("conditions", "late_2") == story.designer.value("conditions", "late")
    story.play("ctrl+z Delete")
    assert "Block Delays: Conditions, 2" in {part.text() for part in story.designer.place.prompt.findChildren(QLabel)}
    story.act("all", story.designer.place.prompt.all.click)
    story.expect("1 warning", undo="Delete Late")
    story.has('conditions = ["prompt"]')
    story.lacks("[conditions.late]")
    story.play("ctrl+z")
    story.expect(selected="conditions.late", kept="saved")
    story.play("@pages.welcome")
    actions = {action.text(): action for action in story.designer.place.outline.tree.actions()}
    story.act("menu: Move down", actions["Move down"].trigger)
    story.select("liquids", "thick")
    story.expect("A first look, now 2 of 5", undo="Move A first look down")
    story.act("menu: Delete", actions["Delete"].trigger)
    assert story.designer.place.prompt.isVisible(), "it is used"
    story.act("menu: Rename", actions["Rename"].trigger)
    story.expect(at="ID", selected="liquids.thick", undo="Move A first look down")


def asked_when(story: Story) -> None:
    """A standard questionnaire that no step asks is asked when the menu says."""
    head = story.designer.place.form.head
    story.ask(AddInstrument("nasa-tlx"))
    story.act("outline", story.designer.controller.show_outline)
    story.act("click", lambda: story.designer.click_on(head.ask))
    head.asks.hide()
    for words, line in (
        ("Before the first block", 'sequence = ["welcome", "nasa_tlx", "liquids", "reaching", "delays", "thanks"]'),
        ("After each trial of Delays", 'questionnaire = "nasa_tlx"'),
        (
            "After each block",
            'sequence = ["welcome", "liquids", "nasa_tlx", "reaching", "delays", "nasa_tlx", "thanks"]',
        ),
        ("At the end", 'sequence = ["welcome", "liquids", "reaching", "delays", "nasa_tlx", "thanks"]'),
    ):
        action = next(one for one in head.asks.actions() if one.text().startswith(words))
        story.act(action.text(), action.trigger)
        story.has(line)
        story.play("ctrl+z")
        story.lacks(line)
        story.play("@questionnaires.nasa_tlx")
    story.press_row("sequence")
    steps, before = story.designer.field("sequence").names, story.designer.text
    for key in ("Down", "Up", "d"):
        story.play(f":sequence {key}")
        assert steps.view().isVisible(), key
        story.act("close it", steps.hidePopup)
    assert story.designer.text == before, "keys only open the list"
    story.choose(steps, "Block Delays")
    story.expect(undo="Add to Session order", at="Add to Session order")
    story.has('sequence = ["welcome", "liquids", "reaching", "delays", "thanks", "delays"]')
    story.play("@pages.welcome")
    story.expect("1 problem")
    story.press_row("sequence")
    story.act("counterbalance", story.designer.field("study", "block_order").segments.buttons[1].click)
    story.expect(undo="Change Block order")
    story.has('block_order = "balanced"')


def new_study(story: Story) -> None:
    """A study begins with the answers, as a copy, or under a name that is free; Tab and arrows go through the page."""
    designer, page = story.designer, story.designer.place.new_page
    ask, questions = designer.controller.show_new_page, page.card.questions
    story.act("ask", ask)
    story.act("adaptive", next(one for one in page.buttons if one.choice.source == "template:viscosity-jnd").click)
    assert [chip.word for chip in page.card.details.findChildren(Chip)] == ["recovered"]
    languages = [f"Language {name}" for name in ("English", "Dutch", "German", "French", "Arabic")]
    for at in ("Short name of the new study", *languages, "Standards", "Trials per standard"):
        story.play("Tab")
        story.expect(at=at)
    story.act("title", questions.title.setFocus)
    story.play("'Which liquid is thicker?' Tab 'thicker'")
    story.act("standards", lambda: next(iter(questions.own.values())).setText("4, 8"))
    for code in ("en", "nl", "en"):
        story.act(f"language {code}", questions.languages[code].click)
    story.act("make", page.make.click)
    story.expect("Draft kept HH:MM", kept="not saved", undo="")
    study = designer.value("study")
    assert (study["name"], study["title"]) == ("thicker", {"en": "Which liquid is thicker?"})
    assert designer.value("stimuli", "damping", "standards") == (4, 8)
    for name in ("rek2024", "kitchen", "My study"):
        story.act("ask", ask)
        story.act(f"name {name}", partial(page.name.setText, name))
        story.act("make", page.make.click)
        assert page.refusal.isVisible()
        free = page.refusal.text().split('"')[-2]
        story.act("free", partial(page.name.setText, free))
        story.act("make", page.make.click)
        assert designer.value("study", "name") == free != name
        story.expect("Draft kept HH:MM", kept="not saved")
    story.act("copy", lambda: ask("kitchen"))
    story.play("Return")
    story.expect(kept="not saved", at="Study outline")
    assert designer.value("blocks") == read_study(story.text.encode(), designer.file.parent).document["blocks"]
    story.play("ctrl+s")
    story.expect(kept="saved")
    story.act("copy again", lambda: ask("kitchen"))
    story.play("'Cold tea'")
    assert page.name.placeholderText().startswith("cold")
    story.act("of the demo", lambda: ask("demo"))
    reached_by_tab = [one.focusPolicy() == Qt.FocusPolicy.StrongFocus for one in page.buttons]
    assert reached_by_tab == [one.isChecked() for one in page.buttons]
    story.act("to the chosen card", next(one for one in page.buttons if one.isChecked()).setFocus)
    story.expect(at="Copy of A first look")
    story.play("Up Up Up")
    story.expect(at="Template Compare liquids")
    story.act("of a file", page.file.click)
    story.act("make", page.make.click)
    story.expect(kept="not saved")
    story.has('title = "A first look"')


def hypotheses(story: Story) -> None:
    """A hypothesis is a sentence with choices; a bound that is not a number is refused."""
    designer, contrasts = story.designer, ("analysis", "contrasts")
    line = lambda: designer.field(*contrasts).lines[0]  # noqa: E731
    story.ask(RetypeFile(DEMO.replace("[limits]", "[analysis]\nparticipants = 11\n\n[limits]")))
    for words in ("counterbalance", "block order"):
        story.play(f"ctrl+f '{words}' Return")
        story.expect(selected="sequence", at="Fixed")
    story.act("balanced", designer.field("study", "block_order").segments.buttons[1].click)
    story.has('block_order = "balanced"')

    def stated(measure: str, conditions: str, **more: object) -> None:
        blocks = ("liquids",) if conditions == "thin thick" else ("delays",)
        hypothesis = {"measure": measure, "blocks": blocks, "conditions": tuple(conditions.split())}
        assert designer.value(*contrasts) == (hypothesis | more,)

    def offered(*compared: str) -> None:
        """Check which second items are offered for the first one."""
        assert [line().second.itemText(at) for at in range(line().second.count())] == [*compared]

    story.press("Add a hypothesis")
    stated("feels_liquid", "thin thick")
    story.press("Add a hypothesis")
    first, second = designer.value(*contrasts)
    assert (second["measure"], second["conditions"]) != (first["measure"], first["conditions"])
    story.play("ctrl+z")
    story.choose(line().relation, "is higher than")
    stated("feels_liquid", "thin thick", expected="higher")
    offered("Thick in Liquids")
    story.choose(line().first, "Late in Delays")
    stated("harder", "late prompt", expected="higher")
    offered("Prompt in Delays")
    story.choose(line().measure, "Comfortable")
    stated("comfortable", "late prompt", expected="higher")
    story.choose(line().relation, "is equal to")
    stated("comfortable", "late prompt", bound=0.5)
    for typed in ("0.25", "x", "2,500"):
        story.act(f"bound {typed}", lambda typed=typed: designer.fill(line().bound, typed))
        stated("comfortable", "late prompt", bound=0.25)
    story.choose(line().relation, "is different from")
    stated("comfortable", "late prompt")
    story.play("@blocks.delays")
    story.act("away", line().away.click)
    story.expect(undo="Remove Hypotheses")
    assert not designer.value(*contrasts)
    thin = 'measure = "like_honey", blocks = ["liquids"], conditions = ["thin", "thick"], expected = "higher"'
    written = DEMO.replace("[limits]", f"[analysis]\ncontrasts = [{{ {thin} }}]\n\n[limits]")
    fewer = written.replace('["thin", "thick"]\n', '["thin"]\n').replace('["prompt", "late"]', '["prompt"]')
    for text, box, words in (
        (fewer, "relation", "is lower than"),
        (written.replace('id = "harder"', 'id = "like_honey"'), "first", "Late"),
    ):
        story.ask(RetypeFile(text))
        story.play("@sequence")
        story.choose(getattr(line(), box), words)
        is_lower = box == "relation"
        stated("like_honey", "thin thick" if is_lower else "late prompt", expected="lower" if is_lower else "higher")
    own = 'sequence = ["welcome", "liquids", "reaching", "delays", "thanks"]\n'
    groups = f"[groups.a]\n{own}[groups.b]\n{own}[limits]"
    story.ask(RetypeFile(DEMO.replace(own, "", 1).replace("[limits]", groups)))
    story.play("ctrl+f 'order of blocks' Return")
    story.expect(selected="blocks.liquids")
    story.press("Add a hypothesis")
    story.choose(line().first, "Interaction: A, Prompt in Delays − Late in Delays")
    pair = {"blocks": ("delays",), "groups": ("a", "b"), "conditions": ("prompt", "late")}
    offered("Interaction: B, Prompt in Delays − Late in Delays")
    assert designer.value(*contrasts) == ({"measure": "harder", **pair},)
    story.choose(line().relation, "is higher than")
    assert designer.value(*contrasts) == ({"measure": "harder", "expected": "higher", **pair},)
    assert [line().first.currentText(), line().second.currentText()] == [
        f"Interaction: {group}, Prompt in Delays − Late in Delays" for group in ("A", "B")
    ]
    story.ask(RetypeFile(designer.text.replace('title = "Delays"', 'title = "Liquids"')))
    story.play("@questionnaires.liquid")
    times = [entry.text().partition("\t")[0] for entry in designer.place.form.head.asks.actions()]
    assert times.count("After Liquids (liquids)") == times.count("After Liquids (delays)") == 1
    story.play("ctrl+f 'order of blocks' Return")
    every = [line().first.itemText(at) for at in range(line().first.count())]
    assert "Interaction: A, Prompt in Liquids (delays) − Late in Liquids (delays)" in every
    assert len(set(every)) == len(every)
    for before, after in (
        ('conditions = ["thin", "thick"]', ""),
        ('phase = "main" ', "phase = {} "),
        ('sequence = ["w', 'sequence = 5 # ["w'),
    ):
        story.ask(RetypeFile(DEMO.replace(before, after, 1)))
        story.play("@blocks.liquids @blocks.delays")
        assert designer.study.faults
    for written in ("3", "[3]", "[{ blocks = 4, measure = 5, expected = 6, bound = 'x' }]"):
        story.ask(RetypeFile(DEMO.replace("[limits]", f"[analysis]\ncontrasts = {written}\n\n[limits]")))
        story.play("@sequence")
        assert designer.study.faults


def two_conditions(story: Story) -> None:
    """The steps of docs/two-conditions.md make a study without problems."""
    designer, head = story.designer, story.designer.place.form.head
    story.act("begin", lambda: designer.controller.begin_study("template:viscosity-jnd", "thicker"))
    story.play("@blocks.viscosity @conditions.damper")
    story.act("no ball", designer.form_row("conditions", "damper", "ball").remove.click)
    story.act("series", lambda: designer.click_on(head.series))
    card = designer.place.prompt
    story.choose(card.number, "Visual delay")
    for typed in ("5000", "x", "60"):
        story.act(f"values {typed}", lambda typed=typed: card.values.setText(typed))
        assert card.make.isEnabled() == (typed == "60")
    story.act("make", card.make.click)
    story.expect("Damper 60", selected="conditions.damper_60", undo="Make 1 condition of Damper")
    story.play("@stimuli.damping")
    story.act("copy", head.copy.click)
    story.choose(designer.field("stimuli", "damping_2", "condition").list, "damper_60")
    story.play("@blocks.viscosity")
    story.act("copy", head.copy.click)
    story.choose(designer.field("blocks", "viscosity_2", "stimulus").list, "damping_2")
    story.play(":blocks.viscosity_2.title ctrl+a 'Viscosity, late' Return @sequence")
    story.act("balanced", designer.field("study", "block_order").segments.buttons[1].click)
    story.press("Add a hypothesis")
    story.play("Insert 'nasa' Return")
    story.act("ask", next(one for one in head.asks.actions() if one.text().startswith("After each block")).trigger)
    assert designer.study.faults == ()
    assert designer.study.protocol.study.block_order == "balanced"
    story.play("@sequence")
    line = designer.field("analysis", "contrasts").lines[0]
    story.choose(line.measure, next(words for _, words in line.measures if words.startswith("Raw score (")))
    (hypothesis,) = designer.study.protocol.analysis.contrasts
    assert (hypothesis.form, hypothesis.measure, hypothesis.expected) == ("nasa_tlx", "raw", None)


BROKEN = DEMO.replace("[study]", "[study")
STORIES: tuple[tuple[Callable[[Story], None], str], ...] = (
    *((tell, DEMO) for tell in (drafts, banner, never_saved, others, failing, versions, incomplete, names)),
    *((tell, DEMO) for tell in (one_instead, questions, adaptive, header, keys_without_a_field, typed_into_the_file)),
    *((tell, DEMO) for tell in (repairs, warnings, tab_key, entries, menu, new_study, two_conditions)),
    *((tell, DEMO) for tell in (fields, asked_when, hypotheses)),
    (unreadable, BROKEN),
)


@pytest.mark.parametrize(("tell", "text"), STORIES, ids=[tell.__name__ for tell, _ in STORIES])
def test_each_act_changes_what_it_should(
    story: Callable[[str], Story], tell: Callable[[Story], None], text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = story(text.replace('name = "demo"', 'name = "kitchen"'))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(told.designer.file), ""))
    tell(told)
    told.undo_and_redo()
