"""Which texts the tab Participant shows of a study with faults, and in which language."""

from typing import Any

import pytest

from study_app.authoring.kept_settings import kept_language
from study_app.viewmodels.designer.requests import ChangeLanguage, DuplicateElement, SetText

pytestmark = pytest.mark.slow

ITEM = ("questionnaires", "liquid", "items", 1)
COPY = (*ITEM[:-1], 2)


@pytest.fixture
def tab(designer: Any) -> Any:
    designer.controller.open("kitchen")
    designer.select(ITEM)
    return designer.controller.preview.tab


def statements(tab: Any) -> list[tuple[str, str]]:
    """Return id and text of each question of the page as they are read."""
    return [(item.id, item.text.strip("\u200b")) for item in tab.view.page.items]


def test_a_copied_question_has_the_text_of_its_original_and_the_others_keep_theirs(designer: Any, tab: Any) -> None:
    before = statements(tab)
    designer.editing.ask(DuplicateElement(ITEM))
    designer.select(COPY)
    copied = dict(before)["like_honey"]
    assert sorted(statements(tab)) == sorted([*before, ("like_honey_2", copied)])
    assert tab.view.note.endswith("(reads as an earlier item does): the text as it is written is shown.")
    designer.editing.ask(SetText((*COPY, "text"), "en", "Another statement"))
    assert dict(statements(tab))["like_honey_2"] == "Another statement"


def test_a_missing_text_is_said_in_the_language_that_lacks_it(designer: Any, tab: Any) -> None:
    designer.editing.ask(ChangeLanguage("add", "nl"))
    assert tab.view.language == "en"
    assert not tab.view.note
    designer.controller.preview.show_language("nl")
    assert tab.view.note == "Like honey has no Dutch text; the text of another language is shown."
    designer.select(("device",))
    assert tab.view.note.endswith(" texts missing in Dutch: shown in another language.")
    designer.editing.ask(SetText((*ITEM, "text"), "en", ""))
    designer.controller.preview.show_language("en")
    assert "Dutch" not in tab.view.note


def test_the_language_is_kept_for_the_study(designer: Any, tab: Any) -> None:
    designer.editing.ask(ChangeLanguage("add", "nl"))
    file = designer.editing.opened.file
    designer.controller.preview.show_language("nl")
    designer.controller.open("demo")
    designer.select(("pages", "welcome"))
    assert tab.view.language == "en"
    designer.controller.open("kitchen")
    designer.select(ITEM)
    assert (tab.view.language, kept_language(file)) == ("nl", "nl")
