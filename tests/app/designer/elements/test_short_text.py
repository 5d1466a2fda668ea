"""The short text of a new question, while its text is typed in the form."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.app.designer.edit_steps import Steps
from study_app.authoring.changes.short_texts import short_of
from study_app.authoring.edited_study import Study, read
from study_app.authoring.undo_stack import History
from study_app.authoring.writer.edits import Set
from study_app.protocol.source.document import value_at
from study_app.viewmodels.designer.requests import AddElement, ChangeLanguage, SetText
from tests.authoring.grown import PROTOCOLS

pytestmark = pytest.mark.slow

ITEMS = ("questionnaires", "liquid", "items")


def write(qtbot: Any, designer: Any, field: str, words: str) -> None:
    line = designer.row(*designer.editing.selected, field).field.lines["en"]
    line.setFocus(Qt.FocusReason.TabFocusReason)
    line.selectAll()
    qtbot.keyClicks(line, words)
    designer.place.flush()
    QApplication.processEvents()


def short(designer: Any) -> Any:
    return designer.row(*designer.editing.selected, "short").row.row.value


def test_copies_in_another_language_follow_a_text_and_its_short_one_until_they_are_edited() -> None:
    source = (PROTOCOLS / "demo.toml").read_text(encoding="utf-8")
    study, question = read(source.encode(), PROTOCOLS), (*ITEMS, 0)

    def typed(study: Study, code: str, words: str) -> tuple[Study, Any]:
        now, _ = study.edited(*Steps().step(study, SetText((*question, "text"), code, words)).edits)
        return now, [value_at(now.document, (*question, key)) for key in ("text", "short")]

    for code in ("nl", "de"):
        for how in ("add", "copy"):
            study, _ = study.edited(*Steps().step(study, ChangeLanguage(how, code)).edits)
    text = value_at(study.document, (*question, "text"))["en"]
    study, _ = study.edited(*(Set((*question, "short", code), short_of(text)) for code in ("en", "nl", "de")))
    study, _ = typed(study, "de", "War es kalt?")
    _, found = typed(study, "en", "Was it cold?")
    assert found == [
        {"en": "Was it cold?", "nl": "Was it cold?", "de": "War es kalt?"},
        {"en": "Was it cold", "nl": "Was it cold", "de": "War es kalt"},
    ]


@pytest.mark.parametrize(
    ("first", "typed", "other", "found"),
    [
        ("", ("War", "Warm", "Warmth"), "War", "War"),
        ("Warmth", ("Warmt", "Warm", "War"), "Warm", "Warm"),
        ("Warm", ("War", "", "New words"), "Warm", "New words"),
    ],
)
def test_which_languages_follow_is_decided_where_typing_begins(
    first: str, typed: tuple[str, ...], other: str, found: str
) -> None:
    text = (*ITEMS, 0, "text")
    study = read((PROTOCOLS / "demo.toml").read_bytes(), PROTOCOLS)
    steps = Steps()
    study, _ = study.edited(*steps.step(study, ChangeLanguage("add", "nl")).edits)
    begun = History(study).edited("Begin", Set(text, {"en": first, "nl": other}))
    for _ in range(2):  # and again after an undo in between
        history = begun
        for words in typed:
            history = history.edited("Type", *steps.step(history.study, SetText(text, "en", words)).edits)
        assert value_at(history.study.document, text) == {"en": typed[-1], "nl": found}
    back = history.undo()
    back = back.edited("Type", *steps.step(back.study, SetText(text, "en", "Hot")).edits)
    assert value_at(back.study.document, text)["nl"] == ("Hot" if found == typed[-1] else other)
    steps.step(back.study, SetText(text, "nl", "Heet"))
    copies = back.edited("Copy", Set(text, {"en": "Hot", "nl": "Hot"})).study
    edits = steps.step(copies, SetText(text, "en", "Hotter")).edits
    assert value_at(copies.edited(*edits)[0].document, text)["nl"] == "Hotter"


def test_the_short_text_follows_the_text_until_it_is_edited(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(AddElement(ITEMS))
    before = designer.text
    assert short(designer) == "New question"
    write(qtbot, designer, "text", "Was it cold?")
    assert short(designer) == "Was it cold"
    assert designer.editing.opened.study.faults == ()
    write(qtbot, designer, "text", "Was it warm?")
    assert short(designer) == "Was it warm"
    designer.editing.undo()
    assert designer.text == before
    designer.editing.redo()
    write(qtbot, designer, "short", "Warm")
    write(qtbot, designer, "text", "Was it warm or cold?")
    assert short(designer) == "Warm"


def test_it_follows_in_the_language_that_is_typed(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(ChangeLanguage("add", "nl"))
    designer.editing.ask(AddElement(ITEMS))
    write(qtbot, designer, "text", "Was it cold?")
    assert short(designer) == {"en": "Was it cold", "nl": "New question"}
