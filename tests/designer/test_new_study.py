"""The page of a new study in the window: templates, their questions, and copies."""

from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QLineEdit

from study_app.designer.document.steps import SetValue
from study_app.designer.place.controller import DesignerController
from study_app.workspace import workspace

pytestmark = pytest.mark.slow


def button(page: Any, source: str) -> Any:
    return next(one for one in page.buttons if one.choice.source == source)


def own(page: Any, words: str) -> QLineEdit:
    return next(field for question, field in page.card.questions.own.items() if question.words == words)


def test_a_study_begins_with_the_answers_and_nothing_is_on_disk(qtbot: Any, designer: Any) -> None:
    designer.controller.ask_for_new()
    page = designer.place.new_page
    qtbot.mouseClick(button(page, "template:viscosity-jnd"), Qt.MouseButton.LeftButton)
    assert page.name.hasFocus() or page.name.isVisible()
    qtbot.keyClicks(page.card.questions.title, "Which liquid is thicker?")
    qtbot.keyClicks(page.name, "thicker")
    standards = own(page, "Standards")
    standards.setText("4, 8")
    chosen, first_texts = page.card.questions.languages, page.card.questions.first_texts
    chosen["en"].click()
    assert not first_texts.isVisible()
    chosen["nl"].click()
    assert first_texts.isVisible()
    assert first_texts.text() == "The texts begin in English: translate them."
    chosen["en"].click()
    assert not first_texts.isVisible()
    qtbot.keyClick(standards, Qt.Key.Key_Return)
    document = designer.study.document
    assert document["study"]["name"] == "thicker"
    assert document["study"]["title"] == {"en": "Which liquid is thicker?"}
    assert document["study"]["languages"] == ("en", "nl")
    assert document["stimuli"]["damping"]["standards"] == (4, 8)
    assert not (designer.file.parent / "thicker.toml").exists()
    designer.controller.ask_for_new("template:viscosity-jnd")
    questions = page.card.questions
    assert (questions.title.text(), questions.name.text(), questions.languages["nl"].isChecked()) == ("", "", False)


@pytest.mark.parametrize(("name", "free"), [("rek2024", "rek2024v2"), ("kitchen", "kitchen2"), ("My study", "mystudy")])
def test_a_short_name_that_is_refused_can_be_replaced_by_one_that_is_free(
    qtbot: Any, designer: Any, name: str, free: str
) -> None:
    designer.controller.ask_for_new()
    page = designer.place.new_page
    page.name.setText(name)
    page.make.click()
    assert page.refusal.text().endswith(f'; "{free}" is free.')
    assert (page.refusal.use.text(), page.refusal.use.accessibleName()) == (f"Make {free}", f"Make {free}")
    qtbot.keyClick(page.refusal.use, Qt.Key.Key_Return)
    assert designer.editing.opened.file.stem == free


def test_a_study_begins_as_a_copy_of_a_file(designer: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    designer.controller.ask_for_new()
    page = designer.place.new_page
    folders: list[str] = []

    def choose(_parent: Any, _title: str, folder: str, _files: str) -> tuple[str, str]:
        folders.append(folder)
        return str(designer.file), ""

    monkeypatch.setattr(QFileDialog, "getOpenFileName", choose)
    page.file.click()
    assert folders == [str(workspace().protocols)]
    chosen = next(one for one in page.buttons if one.isChecked())
    assert chosen.choice.source == str(designer.file)
    assert chosen.choice.note == "kitchen.toml"
    page.name.setText("mine")
    page.make.click()
    document = designer.study.document
    assert (document["study"]["name"], document["study"]["version"]) == ("mine", "0.1")
    assert designer.text.count("#") == designer.file.read_text().count("#")


def test_a_copy_has_a_short_name_that_is_free_where_none_is_typed(qtbot: Any, designer: Any) -> None:
    for name in ("kitchencopy", "kitchencopy2", "kitchencopy3"):
        designer.controller.ask_for_new("kitchen")
        page = designer.place.new_page
        assert page.name.placeholderText() == name
        designer.key("Return")
        assert designer.editing.opened.name == name
        if name == "kitchencopy":
            designer.saving.save()
    designer.controller.ask_for_new(str(designer.file.with_name("kitchencopy.toml")))
    assert page.name.placeholderText() == "kitchencopy4"
    qtbot.keyClicks(page.card.questions.title, "Cold tea")
    assert page.name.placeholderText() == "coldtea"


def test_tab_goes_to_the_chosen_card_and_arrows_to_others_which_are_scrolled_to(qtbot: Any, designer: Any) -> None:
    designer.window.resize(1366, 768)
    designer.controller.ask_for_new("demo")
    page = designer.place.new_page
    demo = button(page, "demo")
    qtbot.waitUntil(lambda: not demo.visibleRegion().isEmpty())
    page.file.setFocus()
    page.area.verticalScrollBar().setValue(0)
    qtbot.keyClick(page.file, Qt.Key.Key_Tab)
    assert demo.hasFocus()
    assert demo.visibleRegion().boundingRect() == demo.rect()
    seen = {demo}
    for _ in range(3):
        designer.key("Up")
        focused = designer.keyboard
        assert focused.isChecked()
        assert focused.visibleRegion().boundingRect() == focused.rect()
        seen.add(focused)
    assert len(seen) > 2


def test_tab_goes_through_the_questions_to_the_button_that_makes_the_study(qtbot: Any, designer: Any) -> None:
    for template in ("viscosity-jnd", "compare-liquids"):
        designer.controller.ask_for_new(f"template:{template}")
        page, questions = designer.place.new_page, designer.place.new_page.card.questions
        qtbot.waitUntil(lambda questions=questions: all(field.isVisible() for field in questions.own.values()))
        expected = [questions.title, questions.name, *questions.languages.values(), *questions.own.values(), page.make]
        assert questions.title.hasFocus()
        for part in expected:
            assert designer.keyboard is part
            qtbot.keyClick(part, Qt.Key.Key_Tab)
        page.make.setFocus()
        for part in reversed(expected[:-1]):
            designer.key("Backtab")
            assert designer.keyboard is part


def test_a_draft_can_be_continued_where_no_study_is_open(designer: Any) -> None:
    designer.open("kitchen", "device")
    designer.editing.ask(SetValue(("device", "force_limit_n"), 3.0))
    designer.saving.leave()
    text = designer.text
    another = DesignerController(designer.results)
    another.enter()
    (button,) = another.place.nothing.drafts
    assert "kitchen" in button.text()
    button.click()
    assert another.editing.opened.study.text == text
    assert another.editing.selected == ("device",)
    another.place.deleteLater()
