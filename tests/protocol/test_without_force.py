"""With a device that gives no force, no page of a shipped study speaks of feeling; its file and statements stay."""

import re

import pytest

from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.protocol.wording.without_force import SENTENCES, without_force

FEELING = re.compile(
    r"\b(feel\w*|felt|touch|push\w*|newtons?|voel\w*|gevoel\w*|aanvoelt|duw\w*|fühl\w*|gefühl\w*|spür\w*|sent\w*|ressent\w*)\b",
    re.IGNORECASE,
)
SHIPPED = ("rek2024", "demo", "physical_liquids")


def texts(protocol: Protocol) -> list[str]:
    """Return what pages, introductions and instructions say, in every language."""
    localised = [page.body for page in protocol.pages.values()]
    localised += [one.intro for one in protocol.questionnaires.values()]
    localised += [task.instruction for task in protocol.tasks.values() if task.instruction is not None]
    return [protocol.text(one, language) for one in localised for language in protocol.study.languages]


@pytest.mark.parametrize("name", SHIPPED)
def test_no_page_speaks_of_feeling_and_the_statements_stay(name: str) -> None:
    study = load(name)
    seen = without_force(study)
    assert [text for text in texts(study) if FEELING.search(text)]
    assert [text for text in texts(seen) if FEELING.search(text)] == []
    for key, questionnaire in study.questionnaires.items():
        assert seen.questionnaires[key].items == questionnaire.items
    assert seen.conditions == study.conditions
    assert seen.model_copy(update={key: getattr(study, key) for key in ("pages", "questionnaires", "tasks")}) == study


def test_every_sentence_is_one_of_a_shipped_study() -> None:
    said = " ".join(" ".join(text.split()) for name in SHIPPED for text in texts(load(name)))
    assert [sentence for sentence in SENTENCES if sentence not in said] == []


def test_a_study_of_ones_own_is_shown_as_it_is_written() -> None:
    study = load("demo")
    asked = {"intro": "What did you feel?"}
    questionnaires = {name: one.model_copy(update=asked) for name, one in study.questionnaires.items()}
    own = study.model_copy(update={"questionnaires": questionnaires})
    assert without_force(own).questionnaires == own.questionnaires


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_programs_own_questions_speak_of_no_feeling(language: str) -> None:
    said = words(language)
    assert [one for one in said.design_questions.values() if FEELING.search(one)] == []
