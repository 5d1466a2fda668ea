"""Stories of form and outline, by keys, clicks and steps; after each act all parts of the window must agree."""

from collections.abc import Callable
from functools import partial
from itertools import groupby

import pytest
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QDropEvent, QEnterEvent, QGuiApplication, QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

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
from tests.designer.support.designer import DEMO
from tests.designer.support.story import Story
from tests.gui.transcript import widget_lines

pytestmark = pytest.mark.slow
REPETITIONS = ("blocks", "liquids", "repetitions")
VERSION = ("study", "version")
ITEMS = ("questionnaires", "liquid", "items")
LISTED = ("blocks", "liquids", "conditions")
NONE, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


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
    field, form = designer.field, lambda: " ".join(widget_lines(designer.place.form))
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
        widget_lines(story.designer.place.form)
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
    row = designer.form_row("blocks", "liquids", "title").label
    for name, part in (("row", row), ("outline", place.outline), ("measures", place.measures)):
        story.play(":blocks.liquids.title")
        story.act(f"click {name}", lambda part=part: designer.click_on(part, at=QPoint(3, 3)))
        story.play("'no plan s d n o v x 1 2'")
        story.expect(undo="", selected="blocks.liquids", kept="saved")


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
    faults_before = [line.row.fault for line in problems.lines]
    story.act("repair", lambda: designer.click_on(next(line for line in problems.lines if line.repairs).repairs[0]))
    story.expect("3 problems", undo="Use 8", selected="device", at="Force limit")
    assert designer.value("device", "force_limit_n") == 8
    assert [line.row.fault for line in problems.lines] == faults_before, "no line moves below the pointer"
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
        action = next(entry for entry in head.asks.actions() if entry.text().startswith(words))
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


STORIES = (
    names, one_instead, questions, fields, adaptive, header, keys_without_a_field, repairs, warnings, tab_key, entries,
    menu, asked_when,
)  # fmt: skip


@pytest.mark.parametrize("tell", STORIES)
def test_each_act_of_a_story_leaves_the_window_consistent(
    tell_story: Callable[..., None], tell: Callable[[Story], None]
) -> None:
    tell_story(tell)
