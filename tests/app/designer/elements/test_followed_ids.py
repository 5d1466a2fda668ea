"""The id of a new element, while its text is typed."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path as File
from typing import Any

import pytest
from PySide6.QtCore import QObject
from PySide6.QtWidgets import QApplication

from study_app.app.designer.edit_steps import Steps
from study_app.app.designer.editing import Editing
from study_app.app.designer.open_study import OpenStudy
from study_app.authoring.edited_study import read
from study_app.authoring.undo_stack import History
from study_app.authoring.writer.refused import Refused
from study_app.protocol.source.document import Path, value_at
from study_app.viewmodels.designer.requests import (
    AddElement,
    AddKey,
    AddNamed,
    Paste,
    RenameElement,
    Request,
    RetypeFile,
    SetText,
)
from tests.authoring.grown import PROTOCOLS

ITEMS = ("questionnaires", "liquid", "items")
QUESTION = (*ITEMS, 0)


class Typist:
    """Adds elements to the demo and types their texts; ``recorded`` are ids with answers."""

    def __init__(self, *, recorded: frozenset[str] = frozenset(), name: str = "demo") -> None:
        self.history = History(read((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS), QUESTION)
        self.steps = Steps(lambda _element: recorded)

    def ask(self, asked: Request) -> Path:
        step = self.steps.step(self.history.study, asked, self.history.selected)
        self.history = self.history.edited(step.words, *step.edits, select=step.select)
        return self.history.selected

    def write(self, text: str, key: str = "text", language: str = "en") -> None:
        self.ask(SetText((*self.history.selected, key), language, text))

    @property
    def id(self) -> str:
        table: Any = self.history.study.document
        for step in self.history.selected:
            table = table[step]
        return str(table.get("id", self.history.selected[-1]))


def test_the_id_of_a_new_question_follows_its_text_until_it_is_edited() -> None:
    typist = Typist()
    typist.ask(AddElement(ITEMS))
    before = typist.history
    ids = []
    for text in (
        "H",
        "How thick",
        "How thick was it?",
        "",
        "This liquid",
        "Feels liquid",
        "A longer sentence about it",
    ):
        typist.write(text)
        ids.append(typist.id)
    assert ids == [
        "h", "how_thick", "how_thick_was_it", "how_thick_was_it", "this_liquid", "feels_liquid_2",
        "a_longer_sentence_about",
    ]  # fmt: skip
    assert typist.history.study.faults == ()
    for _ in ids:
        typist.history = typist.history.undo()
    assert typist.history.study.text == before.study.text
    typist.write("Cold?")
    assert typist.id == "cold"
    typist.ask(RenameElement(typist.history.selected, "warm"))
    typist.write("Hot?")
    assert typist.id == "warm"


def test_only_new_elements_follow_and_only_their_first_language() -> None:
    typist = Typist(name="rek2024")
    typist.write("Is it cold?")
    assert typist.id == "feels_liquid"
    typist.ask(AddElement(ITEMS))
    typist.write("Koud?", language="nl")
    assert typist.id == "question"
    typist.write("Cold?")
    assert typist.id == "cold"
    typist.write("Cold", "short")
    assert typist.id == "cold"


def test_references_follow_a_new_block_and_page() -> None:
    for section in ("blocks", "pages"):
        typist = Typist()
        name = typist.ask(AddElement((section,)))[1]
        assert name in typist.history.study.document["sequence"]
        typist.write("Second part!", "title")
        assert typist.history.selected == (section, "second_part")
        assert "second_part" in typist.history.study.document["sequence"]
        assert name not in typist.history.study.document["sequence"]
        typist.write("Third", "title")
        assert typist.id == "third"


def test_an_element_that_a_reference_adds_follows_and_its_questions_go_on_following() -> None:
    typist = Typist()
    typist.ask(AddNamed(("blocks", "liquids", "questionnaire"), "questionnaires"))
    form = typist.history.selected
    typist.ask(AddElement((*form, "items")))
    question = typist.history.selected
    typist.ask(SetText((*form, "title"), "en", "Afterwards"))
    assert typist.history.selected == ("questionnaires", "afterwards", *question[2:])
    typist.history = replace(typist.history, selected=QUESTION)
    typist.ask(SetText(("questionnaires", "afterwards", "title"), "en", "After"))
    assert typist.history.selected == QUESTION
    typist.ask(SetText(("questionnaires", "after", "title"), "en", "Afterwards"))
    assert typist.history.study.document["blocks"]["liquids"]["questionnaire"] == "afterwards"
    typist.ask(SetText(("questionnaires", "afterwards", *question[2:], "text"), "en", "Tired?"))
    items = typist.history.study.document["questionnaires"]["afterwards"]["items"]
    assert items[-1]["id"] == "tired"


def test_questions_go_on_following_after_their_form_is_renamed_by_hand() -> None:
    typist = Typist()
    typist.ask(AddNamed(("blocks", "liquids", "questionnaire"), "questionnaires"))
    form = typist.history.selected
    question = typist.ask(AddElement((*form, "items")))
    typist.ask(RenameElement(form, "exit"))
    typist.ask(SetText(("questionnaires", "exit", *question[2:], "text"), "en", "Tired?"))
    assert typist.history.study.document["questionnaires"]["exit"]["items"][-1]["id"] == "tired"
    typist.ask(SetText(("questionnaires", "exit", "title"), "en", "Afterwards"))
    assert "exit" in typist.history.study.document["questionnaires"]


def test_an_id_that_a_new_question_left_is_that_of_another_one_from_then_on() -> None:
    typist = Typist()
    typist.ask(AddElement(ITEMS))
    for text in ("Hot", "Hot now"):
        typist.write(text)
    typist.history = replace(typist.history, selected=QUESTION)
    old = f'id = "{typist.id}"'
    typist.history = typist.history.typed("File", typist.history.study.text.replace(old, 'id = "hot"', 1))
    assert typist.id == "hot"
    typist.write("Is it hot?")
    assert typist.id == "hot"
    typist.history = replace(typist.history, selected=(*ITEMS, 1))
    typist.ask(AddElement(ITEMS))
    typist.write("Cold")
    typist.history = replace(typist.history, selected=(*ITEMS, 1))
    typist.write("Wet")
    assert typist.id == "wet"  # also after another one began as it did


@pytest.fixture
def editing(tmp_path: File, monkeypatch: pytest.MonkeyPatch) -> Iterator[Editing]:
    """The demo with a new question, whose text was typed in two steps."""
    monkeypatch.setattr("study_app.app.designer.editing.JOIN_S", 0.0)
    parent = QObject()
    made = Editing(tmp_path, parent)
    made.open(OpenStudy(tmp_path / "demo.toml", Typist().history))
    made.ask(AddElement(ITEMS))
    for text in ("Hot", "Hot now"):
        made.ask(SetText((*made.selected, "text"), "en", text))
    yield made
    parent.deleteLater()


def test_an_id_that_undo_brings_back_follows_again(editing: Editing) -> None:
    editing.undo()
    opened = editing.opened
    assert opened is not None
    assert value_at(opened.study.document, (*editing.selected, "id")) == "hot"
    editing.ask(SetText((*editing.selected, "text"), "en", "Cold"))
    assert value_at(opened.study.document, (*editing.selected, "id")) == "cold"


@pytest.mark.parametrize("how", ["file", "words", "paste"])
def test_an_id_that_a_text_brings_in_stays(how: str, editing: Editing) -> None:
    opened = editing.opened
    assert opened is not None
    for _ in range(3):
        editing.undo()
    question = '[[questionnaires.liquid.items]]\nid = "question"\nkind = "statement"\ntext = "Old"\n'
    if how == "paste":
        editing.ask(Paste(QUESTION, question))
    elif how == "file":
        editing.ask(RetypeFile(f"{opened.study.text}\n{question}"))
    else:
        editing.type_text("Restore", f"{opened.study.text}\n{question}")
    items = value_at(opened.study.document, ITEMS)
    at = next(at for at, item in enumerate(items) if item["id"] == "question")
    editing.ask(SetText((*ITEMS, at, "text"), "en", "Not as old"))
    assert value_at(opened.study.document, (*ITEMS, at, "id")) == "question"


def test_an_id_with_answers_stays_and_is_given_to_no_other_question() -> None:
    typist = Typist(recorded=frozenset({"cold"}))
    typist.ask(AddElement(ITEMS))
    typist.write("Cold?")
    assert typist.id == "cold_2"
    locked = Typist(recorded=frozenset({"question"}))
    locked.ask(AddElement(ITEMS))
    locked.write("Cold?")
    assert locked.id == "question"
    for one, name, free in ((typist, "Cold!", "cold_2"), (locked, "Question!", "question")):
        with pytest.raises(Refused) as refused:
            one.ask(RenameElement(one.history.selected, name))
        assert refused.value.free == free


def title(designer: Any) -> Any:
    return designer.row(*designer.editing.selected, "title").field.lines["en"]


@pytest.mark.slow
def test_the_keyboard_stays_in_the_title_whose_block_gets_another_id(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(AddElement(("blocks",)))
    before = designer.text
    name = designer.editing.selected[1]
    designer.place.form.focus_first_text(filled=False)
    for letters in ("Sec", "ond", " part"):
        qtbot.keyClicks(QApplication.focusWidget(), letters)
        designer.place.flush()
        QApplication.processEvents()
        assert QApplication.focusWidget() is title(designer)
    assert designer.editing.selected == ("blocks", "second_part")
    assert designer.place.form.head.id.text() == "second_part"
    assert title(designer).text() == "Second part"
    designer.editing.undo()
    assert designer.text == before
    assert designer.editing.selected == ("blocks", name)
    designer.place.form.focus_first_text(filled=True)
    qtbot.keyClicks(QApplication.focusWidget(), "Last")
    designer.place.outline.chosen.emit(("blocks", name))  # what is typed is handed on before
    assert designer.editing.selected == ("blocks", "last")


@pytest.mark.slow
def test_a_question_is_added_after_the_title_that_is_being_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(AddElement(("questionnaires",)))
    form = designer.editing.selected
    designer.editing.ask(AddKey((*form, "title")))
    line = title(designer)
    line.setFocus()
    line.selectAll()
    qtbot.keyClicks(line, "Afterwards")
    designer.row(*form, "items").field.add.click()
    after = ("questionnaires", "afterwards")
    assert designer.editing.selected[:3] == (*after, "items")
    assert QApplication.focusWidget() is designer.row(*designer.editing.selected, "text").field.lines["en"]
    designer.editing.undo()
    assert designer.editing.selected == after
    assert title(designer).text() == "Afterwards"
