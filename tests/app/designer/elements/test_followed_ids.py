"""The id of a new element, while its text is typed."""

from dataclasses import replace
from typing import Any

import pytest
from PySide6.QtWidgets import QApplication

from study_app.app.designer.edit_steps import Steps
from study_app.authoring.edited_study import read
from study_app.authoring.undo_stack import History
from study_app.authoring.writer.refused import Refused
from study_app.protocol.source.document import Path, value_at
from study_app.viewmodels.designer.requests import AddElement, AddNamed, RenameElement, Request, SetText
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
    ids, shorts = [], []
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
        shorts.append(value_at(typist.history.study.document, (*typist.history.selected, "short")))
    assert ids == [
        "h", "how_thick", "how_thick_was_it", "how_thick_was_it", "this_liquid", "feels_liquid_2",
        "a_longer_sentence_about",
    ]  # fmt: skip
    assert shorts[:3] == ["H", "How thick", "How thick was it"]
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
    return designer.field(*designer.editing.selected, "title").lines["en"]


@pytest.mark.slow
def test_the_keyboard_stays_in_the_title_whose_block_gets_another_id(qtbot: Any, designer: Any) -> None:
    designer.open()
    designer.editing.ask(AddElement(("blocks",)))
    before = designer.text
    name = designer.editing.selected[1]
    designer.place.form.focus_first_text(filled=False)
    for letters in ("Sec", "ond", " part"):
        qtbot.keyClicks(designer.keyboard, letters)
        designer.place.flush()
        QApplication.processEvents()
        assert designer.keyboard is title(designer)
    assert designer.editing.selected == ("blocks", "second_part")
    assert designer.place.form.head.id.text() == "second_part"
    assert title(designer).text() == "Second part"
    designer.editing.undo()
    assert designer.text == before
    assert designer.editing.selected == ("blocks", name)
    designer.place.form.focus_first_text(filled=True)
    qtbot.keyClicks(designer.keyboard, "Last")
    designer.place.outline.chosen.emit(("blocks", name))  # what is typed is handed on before
    assert designer.editing.selected == ("blocks", "last")
