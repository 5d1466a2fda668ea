"""Stories in the designer's window by keys, clicks and steps, compared with reviewed texts of what each act changes."""

import os
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QDropEvent, QEnterEvent, QGuiApplication, QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog

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
from study_app.errors import StoreError
from study_app.protocol.source.files import protocol_hash
from study_app.store.drafts import Draft, write_draft
from study_app.store.folder_lock import lock_folder
from study_app.store.study_settings import keep_original, kept_original
from study_app.store.study_versions import content_hash
from tests.designer.support.designer import DEMO
from tests.designer.support.record import Record
from tests.designer.support.runs import run

pytestmark = pytest.mark.slow
REPETITIONS = ("blocks", "liquids", "repetitions")
VERSION, TITLE = ("study", "version"), ("pages", "welcome", "title")
ITEMS = ("questionnaires", "liquid", "items")
LISTED = ("blocks", "liquids", "conditions")
FORMAT_2 = DEMO.replace("format = 1", "format = 2", 1)
NONE, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


def drafts(record: Record) -> None:
    """Edits are kept as a draft, which is found again until it is saved or discarded; a shipped study is read-only."""
    designer, act = record.designer, record.note
    before = designer.file.read_bytes(), designer.file.stat().st_mtime_ns
    record.ask(SetValue(VERSION, "0.7"))
    record.play("ctrl+z ctrl+y")
    act("open the open one", lambda: designer.open(str(designer.file)))
    act("to the file", lambda: designer.place.show_tab("file"))
    act("type into it", lambda: designer.place.file.editor.insertPlainText("# mine\n"))
    act("open a shipped one", lambda: designer.open("demo"))
    record.ask(SetValue(VERSION, "9"))
    record.ask(RetypeFile("format = 1\n"))
    record.play("ctrl+s")
    act("open", designer.open)
    assert (designer.file.read_bytes(), designer.file.stat().st_mtime_ns) == before
    record.ask(SetValue(VERSION, "0.8"))
    act("leave", lambda: designer.window.go("home"))
    act("come back", lambda: designer.window.go("designer"))
    record.play("ctrl+s")
    act("copy a shipped one", lambda: designer.controller.begin_study("demo", "mine"))
    record.play("ctrl+s")


def banner(record: Record) -> None:
    """The line about a draft ends by undo, by saving and by closing it, and gives the keyboard back."""
    designer = record.designer
    ends = {"undo": "ctrl+z ctrl+z", "save": "ctrl+s", "close": "", "Esc": "ctrl+1 Escape", "go": "[Discard the draft]"}
    for end, acts in ends.items():
        record.note("open another", lambda: designer.open("demo"))
        text = designer.file.read_text()
        write_draft(designer.file, Draft(text=f"{text}# {end}\n", base=content_hash(text.encode())))
        record.note("open a draft", designer.open)
        record.ask(SetText(TITLE, "en", end))
        if end == "close":
            record.play(":pages.welcome.title")
            record.note("to the cross", designer.place.banner.close_button.setFocus)
            record.play("space")
        record.play(f"{acts} ctrl+s")


def never_saved(record: Record) -> None:
    """A study that was never saved is discarded once that is confirmed."""
    designer = record.designer
    begin = partial(designer.controller.begin_study, "template:compare-liquids", "mine")
    record.note("begin", begin)
    record.note("open another", designer.open)
    record.note("open it again", lambda: designer.open(str(designer.file.with_name("mine.toml"))))
    record.play("[Discard the draft] [Cancel] [Discard the draft]")
    record.note("confirm", designer.place.prompt.go_on.click)
    record.note("write the draft", lambda: designer.saving.write_draft(at_once=True))
    record.note("open", designer.open)
    record.note("begin again", begin)


def others(record: Record) -> None:
    """Another program changes, locks and deletes the file meanwhile."""
    designer = record.designer
    look = partial(record.note, "look", designer.controller.enter)

    def outside(old: str, new: str) -> None:
        designer.change((old, new))
        look()

    outside("A first look", "Another look")
    record.ask(SetValue(VERSION, "0.7"))
    outside("Another look", "A third look")
    record.play("ctrl+s [Take the file's]")
    record.ask(SetValue(VERSION, "0.8"))
    outside("A third look", "A fourth look")
    record.play("[Keep mine] ctrl+s")
    record.ask(SetValue(VERSION, "0.9"))
    session = designer.results / "kitchen" / "data" / "sub-P001" / "ses-01"
    session.mkdir(parents=True)
    opening = lock_folder(session)
    outside("Now reach", "Reach now")
    record.ask(SetValue(VERSION, "1.0"))
    record.play("ctrl+s")
    opening.release()
    look()
    record.play("[Keep mine]")
    designer.file.unlink()
    look()
    record.play("[Keep mine] ctrl+s")
    other = designer.file.with_name("other.toml")
    other.write_bytes(b"format = 1\n# \xff\n")
    record.note("open a file that is no text", lambda: designer.open(str(other)))


def refusing(name: str, words: str) -> pytest.MonkeyPatch:
    """Let a function of the program fail until that is undone."""

    def refuse(*_values: object) -> None:
        raise StoreError(words)

    patch = pytest.MonkeyPatch()
    patch.setattr(f"study_app.{name}", refuse)
    return patch


def failing(record: Record) -> None:
    """What cannot be deleted, kept, read or written is said once, and nothing is lost."""
    designer, saving = record.designer, record.designer.saving
    write, look = (
        partial(record.note, "write the draft", saving.write_draft),
        partial(record.note, "look", saving.look_again),
    )
    record.ask(SetValue(VERSION, "0.7"))
    stuck = refusing("store.drafts.discard", "the draft cannot be deleted: Permission denied")
    record.play("ctrl+z")
    write()
    write()
    record.ask(SetValue(VERSION, "0.8"))
    record.play("ctrl+s")
    stuck.undo()
    write()
    record.ask(SetValue(VERSION, "0.9"))
    full = refusing("designer.document.document.keep_content", "the disk is full")
    record.play("ctrl+s")
    full.undo()
    killed, written_now, other = (
        designer.file.with_name(f".{name}.tmp")
        for name in ("kitchen.toml.0123abcd", "kitchen.toml.4567abcd", "other.toml.0123abcd")
    )
    for half in (killed, written_now, other):
        half.write_text("format = ")
    for half in (killed, other):
        os.utime(half, (0, 0))
    record.play("ctrl+s")
    assert not killed.exists()
    assert written_now.exists()
    assert other.exists()
    for _ in range(2):
        unreadable = refusing(
            "designer.document.document.Document.changed_outside", "kitchen.toml cannot be read: error"
        )
        look()
        look()
        unreadable.undo()
        look()
    keep_original(designer.file.with_name("pantry.toml"), "demo")  # of a study that was deleted
    record.ask(SetValue(VERSION, "1.1"))
    full = refusing("designer.document.document.save", "the disk is full")
    record.note("save as another", lambda: saving.save_as_another("pantry"))
    full.undo()
    assert kept_original(designer.file.with_name("pantry.toml")) == "kitchen"
    record.note("begin", lambda: designer.controller.begin_study("template:compare-liquids", "mine"))
    record.note("open another", designer.open)
    record.note("open it again", lambda: designer.open(str(designer.file.with_name("mine.toml"))))
    stuck = refusing("store.drafts.discard", "the draft cannot be deleted: Permission denied")
    record.play("[Discard the draft]")
    record.note("confirm", designer.place.prompt.go_on.click)
    stuck.undo()


def versions(record: Record) -> None:
    """A study that was run is saved under the next version or as another study; its versions are shown and restored."""
    designer, card = record.designer, record.designer.controller.changes
    prompt = lambda: designer.place.prompt  # noqa: E731

    def ran(participant: str, source: bytes = b"", **facts: Any) -> None:
        source = source or designer.file.read_bytes()
        record.note(f"run {participant} {facts}", lambda: run(designer, participant, source, **facts))
        record.note("look", designer.controller.enter)

    ran("P001", study="kitchen-pilot", pilot=True)
    record.ask(SetValue(REPETITIONS, 2))
    record.play("ctrl+s")
    ran("P001")
    ran("P002")
    record.ask(SetValue(REPETITIONS, 3))
    record.ask(SetText(TITLE, "en", "Hello"))
    record.play("ctrl+s")
    record.note("version", prompt().version.setFocus)
    record.play("ctrl+a '1.0' Return ctrl+a '1.1' Return")
    record.ask(SetValue(REPETITIONS, 4))
    record.play("ctrl+s")
    record.note("chip", designer.place.header.version.click)
    record.note("compare", lambda: card.compare_with(card.version.itemData(1)))
    record.note("restore", card.restore.click)
    record.play("ctrl+z")
    ran("P003")
    ran("P001", study="pantry", source=designer.file.read_bytes().replace(b'"1.1"', b'"0.1"'))
    record.ask(SetValue(REPETITIONS, 5))
    record.note("save as pantry", lambda: designer.saving.save_as_another("pantry"))
    record.play("ctrl+s")
    record.note("another", prompt().another.click)
    record.play("'kitchen' Return")
    record.play("ctrl+a 'kitchen2' Return")
    record.note("open", designer.open)
    record.play("@questionnaires.delay.items.0")
    record.note("unlock", designer.place.form.head.unlock.click)
    record.note("confirm", prompt().go_on.click)
    record.play("'difficult' Return @pages.welcome ctrl+z @questionnaires.delay.items.0")
    early = designer.file.read_bytes().replace(b'"1.1"', b'"0.9"').replace(b"delay_ms = 200", b"delay_ms = 300")
    ran("P009", early, started_at="2026-11-18T12:00:00+00:00")
    record.note("compare", lambda: card.compare_with(protocol_hash(early)))


def incomplete(record: Record) -> None:
    """A study that cannot be run yet is saved, and says so until it can be."""
    record.ask(ChangeLanguage("add", "nl"))
    record.play("ctrl+s [Show the list] @device")
    record.ask(ChangeLanguage("copy", "nl"))
    record.play("ctrl+s")


def names(record: Record) -> None:
    """Ids are renamed, refused, and follow the text of a new element until it is used or renamed."""
    designer, form = record.designer, record.designer.place.form

    def first_text() -> None:
        record.note("to the first empty text", lambda: form.focus_first_text(filled=False))

    record.select("liquids", "thin")
    record.ask(RenameElement(("liquids", "thin"), "thick"))
    record.play("@pages.thanks F2 'goodbye' Return")
    record.ask(AddElement(("blocks",)))
    first_text()
    record.play("'Sec' 'ond' ' part' Tab")
    record.ask(SetText(("blocks", "second_part", "title"), "en", "Third part"))
    record.note("to another one", lambda: designer.place.outline.chosen.emit(("blocks", "liquids")))
    record.ask(AddElement(("blocks",)))
    first_text()
    record.play("'Last'")
    record.note("to its title", lambda: designer.place.outline.chosen.emit((*designer.editing.selected, "title")))
    designer.editing.recorded = lambda _element: frozenset({"cold", "question_2"})
    record.ask(AddElement(ITEMS))
    record.note("to another one", lambda: designer.place.outline.chosen.emit(("study",)))
    record.select(*ITEMS, 2)
    first_text()
    record.play("'Cold?' Tab")
    record.ask(AddElement(ITEMS))
    record.ask(RenameElement(designer.editing.selected, "warm"))
    first_text()
    record.play("'Hot?' Tab @blocks.liquids")
    record.ask(AddNamed(("blocks", "liquids", "questionnaire"), "questionnaires"))
    record.ask(SetValue((*designer.editing.selected, "title"), "Afterwards"))
    record.select("study")
    assert designer.undo_all() == record.designer.file.read_text()


def one_instead(record: Record) -> None:
    """One key is given in place of another and back; undo brings its value back."""
    row = record.designer.form_row
    record.select("tasks", "reach")
    for key, at in (("count", 1), ("duration_s", 0)):
        record.note(f"in place of {key}", lambda key=key, at=at: row("tasks", "reach", key).keys.buttons[at].click())
    record.play("ctrl+z ctrl+z @blocks.liquids")
    record.note("a stimulus", row(*LISTED).keys.buttons[1].click)


def questions(record: Record) -> None:
    """Insert and Enter add a question below the one whose text is typed; a question is one paragraph."""
    designer = record.designer
    record.play("@questionnaires.liquid.items.0 :questionnaires.liquid.items.0.text ctrl+a 'How was it?' Insert Return")
    QGuiApplication.clipboard().setText("Would you say\nthat this liquid\nis one?")
    record.play(":questionnaires.liquid.items.1.text ctrl+a ctrl+v Return ctrl+a ctrl+x Escape")
    assert designer.undo_all() == designer.file.read_text()


def fields(record: Record) -> None:
    """What is refused stays with its reason until Esc; the next element shows nothing of the one before."""
    record.play("@blocks.liquids :blocks.liquids.repetitions ctrl+a '2x' Tab shift+Tab Escape")
    record.play("@liquids.thin :liquids.thin.density_kg_m3 ctrl+a '12x' Return @liquids.thick")
    record.play(":liquids.thick.density_kg_m3 Escape @liquids.thin")
    record.play("@blocks.liquids :blocks.liquids.title Home ctrl+Delete End ' now' ctrl+Delete ctrl+z")
    record.play("@tasks.explore")
    record.ask(SetValue(("tasks", "explore", "kind"), "reach"))
    record.play(":tasks.explore.dwell_s ctrl+z")
    record.play("@conditions.thin :conditions.thin.view 'f' 'ront' Escape")
    record.play(":conditions.thin.force_delay_ms '7' Tab ctrl+z :conditions.thin.force_delay_ms '8' shift+Tab ctrl+z")
    record.select("blocks", "liquids")
    for one in [row.row.path for row in record.designer.place.form.rows if row.row.is_removable]:
        record.play(f":{'.'.join(one)} ctrl+Delete ctrl+z")


def adaptive(record: Record) -> None:
    """Fields of a study of levels have the names of the field of study; a refused list of numbers says so."""
    record.note("begin", lambda: record.designer.controller.begin_study("template:viscosity-jnd", "thicker"))
    record.play("@methods.easy :methods.easy.levels ctrl+a '0.5 x' Return Escape")
    record.select("stimuli", "damping")
    for phase in (0, 1, 3, 4, 5):
        record.select("blocks", "training")
        record.note(f"phase {phase}", record.designer.field("blocks", "training", "design").extra.phases[phase].click)
    for path in ("liquids.damper.drag.damping_nspm", "stimuli.damping.vary", "blocks.viscosity.catch.wrong_most"):
        record.play(f"@{'.'.join(path.split('.')[:2])} :{path}")


def header(record: Record) -> None:
    """A disabled button of the header gives the keyboard back; keys in the list of studies open no other one."""
    designer, box = record.designer, record.designer.place.header.study
    record.play("@blocks.liquids :blocks.liquids.repetitions ctrl+a '3'")
    for button in (designer.place.header.undo, designer.place.header.redo, designer.place.header.save):
        name, at = button.accessibleName(), button.mapToGlobal(QPoint(9, 9))
        record.note(f"click {name}", lambda at=at: designer.hand.click(at))
        record.note(f"click {name}, disabled", lambda at=at: designer.hand.click(at))
    designer.file.with_name("zeta.toml").write_text(DEMO.replace('"demo"', '"zeta"').replace("A first look", "Zebra"))
    record.note("look", designer.controller.enter)
    record.note("to the list", box.setFocus)
    record.play("Escape ctrl+Home")
    altgr = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier
    record.note(
        "AltGr+Z", lambda: QApplication.sendEvent(box, QKeyEvent(QEvent.Type.KeyPress, Qt.Key.Key_Z, altgr, "z"))
    )
    for key in ("Home", "End", "PageDown", "Up", "Return", "Space", "F4", "Z"):
        record.play(key)
        record.note("close it" if key != "Z" else "stay", box.hidePopup if key != "Z" else lambda: None)
    record.note("Enter in the list", lambda: QTest.keyClick(box.view(), Qt.Key.Key_Return))


def keys_without_a_field(record: Record) -> None:
    """Letters and space do nothing where no field has the keyboard."""
    designer, place = record.designer, record.designer.place
    record.play("@blocks.liquids")
    record.note("measures", lambda: place.show_tab("measures"))
    row = designer.form_row("blocks", "liquids", "title").words
    for name, part in (("row", row), ("outline", place.outline), ("measures", place.measures)):
        record.play(":blocks.liquids.title")
        record.note(f"click {name}", lambda part=part: designer.click_on(part, at=QPoint(3, 3)))
        record.play("'no plan s d n o v x 1 2'")


def typed_into_the_file(record: Record) -> None:
    """What is typed into the file stays there where the form is made anew; a fault reaches its field."""
    editor = record.designer.place.file.editor

    def go_to(line: str, end: bool) -> None:
        cursor = editor.textCursor()
        number = next(at for at, text in enumerate(record.designer.text.split("\n")) if text.startswith(line))
        cursor.setPosition(editor.document().findBlockByNumber(number).position() + (0 if end else len('order = "')))
        cursor.movePosition(cursor.MoveOperation.EndOfBlock) if end else None
        editor.setTextCursor(cursor)
        editor.setFocus()

    record.play("@study")
    record.note("to the file", lambda: record.designer.place.show_tab("file"))
    record.note("behind a header", lambda: go_to("[study]", end=True))
    record.play("Return 'credits = ' '\"abc\"' ' # and more' @blocks.liquids")
    record.note("into the order", lambda: go_to('order = "', end=False))
    record.play("'x' F8 ctrl+z")


def unreadable(record: Record) -> None:
    """A file that was never readable is opened at the line of its fault, and nothing can be added to it."""
    record.play("[Add an element (Insert)]" if record.designer.place.outline.add.isEnabled() else "Insert")
    record.note("correct it", lambda: record.designer.editing.make_step("Correct the file", text=DEMO))
    record.note("outline", record.designer.controller.show_outline)


def repairs(record: Record) -> None:
    """F8 leads to a repair; a letter there is typed into the field; no line moves below the pointer."""
    designer, problems = record.designer, record.designer.place.problems

    def pointer(kind: QEvent) -> None:
        QApplication.sendEvent(problems, kind)

    text = record.text.replace('liquid = "thick"', 'liquid = "thik"', 1).replace(
        "force_limit_n = 6", "force_limit_n = 60"
    )
    record.ask(RetypeFile(text.replace("delay_ms = 0", 'delay_ms = "a"', 1).replace("min_s = 5 ", 'min_s = "a" ')))
    record.play("ctrl+1 ctrl+4")
    record.note("pointer over it", lambda: pointer(QEnterEvent(QPointF(5, 5), QPointF(5, 5), QPointF(5, 5))))
    record.note("repair", lambda: designer.click_on(next(line for line in problems.lines if line.repairs).repairs[0]))
    record.ask(SetValue(VERSION, 3))
    record.note("pointer away", lambda: pointer(QEvent(QEvent.Type.Leave)))
    record.play("ctrl+z ctrl+z ctrl+1 F8 Return F8 Return F8")
    text = DEMO.replace('languages = ["en"]', 'languages = ["en", "nl"]').replace(
        'title = "Liquids"', 'title.en = "Liquids"'
    )
    record.ask(RetypeFile(text))
    record.play("ctrl+1 F8 'E' 'en titel'")


def warnings(record: Record) -> None:
    """The chip of warnings opens a list of them, of the study or of the selected element alone."""
    problems = record.designer.place.problems
    record.ask(SetValue(("liquids", "thick", "density_kg_m3"), 1001))
    record.note("chip", record.designer.place.header.problems.click)
    record.note("next", problems.next.click)
    record.note("of this element", lambda: problems.limit.chosen.emit(True))
    record.play("@pages.welcome")
    record.note("of the study", lambda: problems.limit.chosen.emit(False))
    record.play("ctrl+z")


def tab_key(record: Record) -> None:
    """Tab goes through header, outline, form, views, problems, a question and the banner, as they are seen."""
    designer = record.designer
    for how in ("add", "copy"):
        record.ask(ChangeLanguage(how, "nl"))
    record.ask(SetValue(("device", "force_limit_n"), 60))
    record.play("ctrl+s @blocks.liquids ctrl+4")
    record.note("ask to delete", lambda: designer.controller.ask_to_delete(("liquids", "thick")))
    record.play(f"ctrl+5 {'Tab ' * 75}")
    record.note("answer", designer.place.prompt.cancel.click)
    record.note("smaller", lambda: designer.window.resize(1366, 800))
    record.play(f"ctrl+5 {'Tab ' * 30}")


def entries(record: Record) -> None:
    """Entries of a list are selected, moved, copied, opened and removed, by the mouse and by keys."""
    designer = record.designer
    field = partial(designer.field, *LISTED)

    def click(at: int) -> None:
        record.note(f"click entry {at}", lambda: designer.click_on(field().rows[at], at=QPoint(30, 12)))

    extra = "".join(f'\n[conditions.{name}]\nliquid = "thin"\ndelay_ms = {at}\n' for at, name in enumerate("cd", 1))
    text = record.text.replace('conditions = ["thin", "thick"]', 'conditions = ["thin", "thick", "c", "d"]')
    record.ask(RetypeFile(text + extra))
    record.select(*LISTED[:2])
    click(1)
    record.play("alt+Up alt+Up alt+Down alt+Down alt+Down ctrl+d Delete ctrl+z @blocks.liquids")
    field().list.setCurrentRow(0)
    at = QPointF(field().rows[1].geometry().bottomLeft())
    drop = QDropEvent(at, Qt.DropAction.MoveAction, QMimeData(), LEFT, NONE)
    record.note("drop the first below the second", lambda: field().list.dropEvent(drop))
    record.note("to the second", field().rows[1].setFocus)
    record.play("alt+Down alt+Up Return @blocks.liquids")
    record.note("to the second", field().rows[1].setFocus)
    record.note("double click", lambda: QTest.mouseDClick(field().rows[1], LEFT))


def menu(record: Record) -> None:
    """The menu of the outline does what keys do; an element that is used is deleted with what names it."""
    record.play("@conditions.late")
    record.note("outline", record.designer.controller.show_outline)
    record.press_row("conditions", "late")
    record.play("ctrl+d ctrl+z Delete")
    record.note("all", record.designer.place.prompt.all.click)
    record.play("ctrl+z @pages.welcome")
    actions = {action.text(): action for action in record.designer.place.outline.tree.actions()}
    record.note("menu: Move down", actions["Move down"].trigger)
    record.select("liquids", "thick")
    for words in ("Delete", "Rename"):
        record.note(f"menu: {words}", actions[words].trigger)


def asked_when(record: Record) -> None:
    """A standard questionnaire that no step asks is asked when the menu says."""
    head = record.designer.place.form.head
    record.ask(AddInstrument("nasa-tlx"))
    record.note("outline", record.designer.controller.show_outline)
    record.note("click", lambda: record.designer.click_on(head.ask))
    head.asks.hide()
    for words in ("Before the first block", "After each trial of Delays", "After each block", "At the end"):
        action = next(one for one in head.asks.actions() if one.text().startswith(words))
        record.note(action.text(), action.trigger)
        record.play("ctrl+z @questionnaires.nasa_tlx")
    record.press_row("sequence")
    steps = record.designer.field("sequence").names
    record.choose(steps, "delay")
    record.note("counterbalance", record.designer.field("study", "block_order").segments.buttons[1].click)


def new_study(record: Record) -> None:
    """A study begins with the answers, as a copy, or under a name that is free; Tab and arrows go through the page."""
    designer, page = record.designer, record.designer.place.new_page
    ask, questions = designer.controller.show_new_page, page.card.questions
    record.note("ask", ask)
    record.note("adaptive", next(one for one in page.buttons if one.choice.source == "template:viscosity-jnd").click)
    record.play(f"{'Tab ' * 9}")
    record.note("title", questions.title.setFocus)
    record.play("'Which liquid is thicker?' Tab 'thicker'")
    record.note("standards", lambda: next(iter(questions.own.values())).setText("4, 8"))
    for code in ("en", "nl", "en"):
        record.note(f"language {code}", questions.languages[code].click)
    record.note("make", page.make.click)
    for name in ("rek2024", "kitchen", "My study"):
        record.note("ask", ask)
        record.note(f"name {name}", partial(page.name.setText, name))
        record.note("make", page.make.click)
        record.note("free", lambda: page.name.setText(page.refusal.text().split('"')[-2]))
        record.note("make", page.make.click)
    record.note("copy", lambda: ask("kitchen"))
    record.play("Return ctrl+s")
    record.note("copy again", lambda: ask("kitchen"))
    record.play("'Cold tea'")
    record.note("of the demo", lambda: ask("demo"))
    record.note("to the chosen card", next(one for one in page.buttons if one.isChecked()).setFocus)
    record.play("Up Up Up")
    record.note("of a file", page.file.click)
    record.note("make", page.make.click)


def hypotheses(record: Record) -> None:
    """A hypothesis is a sentence with choices; a bound that is not a number is refused."""
    designer, contrasts = record.designer, ("analysis", "contrasts")
    line = lambda: designer.field(*contrasts).lines[0]  # noqa: E731
    record.ask(RetypeFile(FORMAT_2.replace("[limits]", "[analysis]\nparticipants = 11\n\n[limits]")))
    record.play("ctrl+f 'counterbalance' Return ctrl+f 'block order' Return")
    record.note("balanced", designer.field("study", "block_order").segments.buttons[1].click)
    record.press("Add a hypothesis")
    record.choose(line().first, "Late in Delays")
    record.choose(line().measure, "Comfortable")
    record.choose(line().relation, "is equal to")
    for typed in ("0.25", "x", "2,500"):
        record.note(f"bound {typed}", lambda typed=typed: designer.fill(line().bound, typed))
    record.choose(line().relation, "is different from")
    record.play("@blocks.delays")
    record.note("away", line().away.click)
    thin = 'measure = "like_honey", blocks = ["liquids"], conditions = ["thin", "thick"], expected = "higher"'
    stated = FORMAT_2.replace("[limits]", f"[analysis]\ncontrasts = [{{ {thin} }}]\n\n[limits]")
    fewer = stated.replace('["thin", "thick"]\n', '["thin"]\n').replace('["prompt", "late"]', '["prompt"]')
    for text, box, words in (
        (fewer, "relation", "is lower than"),
        (stated.replace('id = "harder"', 'id = "like_honey"'), "first", "Late"),
    ):
        record.ask(RetypeFile(text))
        record.play("@sequence")
        record.choose(getattr(line(), box), words)
    own = 'sequence = ["welcome", "liquids", "reaching", "delays", "thanks"]\n'
    groups = f"[groups.a]\n{own}[groups.b]\n{own}[limits]"
    record.ask(RetypeFile(FORMAT_2.replace(own, "", 1).replace("[limits]", groups)))
    record.play("ctrl+f 'order of blocks' Return")
    for before, after in (
        ('conditions = ["thin", "thick"]', ""),
        ('phase = "main" ', "phase = {} "),
        ('sequence = ["w', 'sequence = 5 # ["w'),
    ):
        record.ask(RetypeFile(FORMAT_2.replace(before, after, 1)))
        record.play("@blocks.liquids @blocks.delays")
    for written in ("3", "[3]", "[{ blocks = 4, measure = 5, expected = 6, bound = 'x' }]"):
        record.ask(RetypeFile(FORMAT_2.replace("[limits]", f"[analysis]\ncontrasts = {written}\n\n[limits]")))
        record.play("@sequence")


def two_conditions(record: Record) -> None:
    """The steps of docs/two-conditions.md make a study without problems."""
    designer, head = record.designer, record.designer.place.form.head
    record.note("begin", lambda: designer.controller.begin_study("template:viscosity-jnd", "thicker"))
    record.play("@blocks.viscosity @conditions.damper")
    record.note("no ball", designer.form_row("conditions", "damper", "ball").remove.click)
    record.note("series", lambda: designer.click_on(head.series))
    card = designer.place.prompt
    record.choose(card.number, "Visual delay")
    for typed in ("5000", "x", "60"):
        record.note(f"values {typed}", lambda typed=typed: card.values.setText(typed))
    record.note("make", card.make.click)
    record.play("@stimuli.damping")
    record.note("copy", head.copy.click)
    record.choose(designer.field("stimuli", "damping_2", "condition").list, "damper_60")
    record.play("@blocks.viscosity")
    record.note("copy", head.copy.click)
    record.choose(designer.field("blocks", "viscosity_2", "stimulus").list, "damping_2")
    record.play(":blocks.viscosity_2.title ctrl+a 'Viscosity, late' Return @sequence")
    record.note("balanced", designer.field("study", "block_order").segments.buttons[1].click)
    record.press("Add a hypothesis")
    record.choose(designer.field("analysis", "contrasts").lines[0].relation, "is different from")
    record.play("Insert 'nasa' Return")
    record.note("ask", next(one for one in head.asks.actions() if one.text().startswith("After each block")).trigger)
    assert designer.study.faults == ()
    assert designer.study.protocol.study.block_order == "balanced"


BROKEN = DEMO.replace("[study]", "[study")
STORIES: tuple[tuple[Callable[[Record], None], str, str], ...] = (
    (drafts, DEMO, "place.header"),
    (banner, DEMO, "place.banner"),
    (never_saved, DEMO, "place"),
    (others, DEMO, "place.banner"),
    (failing, DEMO, "place.banner"),
    (versions, DEMO, "place"),
    (incomplete, DEMO, "place.banner"),
    (names, DEMO, "place.form.head"),
    (one_instead, DEMO, "place.form"),
    (questions, DEMO, "place.form"),
    (fields, FORMAT_2, "place.form"),
    (adaptive, DEMO, "place.form"),
    (header, DEMO, "place.header"),
    (keys_without_a_field, DEMO, "place.header"),
    (typed_into_the_file, DEMO, "place.form"),
    (unreadable, BROKEN, "place"),
    (repairs, DEMO, "place.problems"),
    (warnings, DEMO, "place.problems"),
    (tab_key, DEMO, "place.banner"),
    (entries, DEMO, "place.banner"),
    (menu, DEMO, "place.form.head"),
    (asked_when, FORMAT_2, "place.form"),
    (new_study, DEMO, "place.new_page"),
    (hypotheses, DEMO, "place.form"),
    (two_conditions, DEMO, "place.form"),
)


@pytest.mark.parametrize(("story", "text", "part"), STORIES, ids=[story.__name__ for story, *_ in STORIES])
def test_each_act_changes_what_it_should(
    record: Any,
    story: Callable[[Record], None],
    text: str,
    part: str,
    pytestconfig: pytest.Config,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = record(text.replace('name = "demo"', 'name = "kitchen"'), part)
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(made.designer.file), ""))
    story(made)
    made.compare(f"story, {story.__name__}", pytestconfig)
