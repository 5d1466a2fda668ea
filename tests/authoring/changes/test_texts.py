"""Texts that follow others: copies in a language until they are edited, short texts of questions."""

from typing import Any

import pytest

from study_app.authoring.changes.languages import filled_in, texts_of, with_language
from study_app.authoring.changes.short_texts import followed, short_of
from study_app.authoring.edited_study import Study, read
from study_app.authoring.measures.participant_texts import copied_texts, missing_texts
from study_app.authoring.study_facts import facts
from study_app.authoring.undo_stack import History
from study_app.authoring.writer.edits import Set, Unset
from tests.authoring.grown import PROTOCOLS

TITLE = ("pages", "welcome", "title")
DEMO = read((PROTOCOLS / "demo.toml").read_bytes(), PROTOCOLS)


@pytest.fixture(scope="module")
def copied() -> History:
    """The demo with two languages that are copies of the first one, as one step."""
    study = DEMO
    for code in ("nl", "de"):
        study, _ = study.edited(*with_language(study, code))
    history = History(study)
    for code in ("nl", "de"):
        history = history.edited("Fill in", *filled_in(history.study, code), joins=True)
    return history


def words(study: Study) -> list[str]:
    return [one for one in facts(study).warnings if "to translate" in one]


def test_copies_in_two_languages_are_counted_until_each_is_edited_and_again_after_undo(copied: History) -> None:
    count = sum(any(map(str.isalpha, str(text["en"]))) for _, text in texts_of(copied.study))
    assert copied_texts(copied.study) == {"nl": count, "de": count}
    assert copied.study.faults == ()
    assert words(copied.study) == [
        f"study.languages: {count} texts to translate to {name}, as in English so far" for name in ("Dutch", "German")
    ]
    edited = copied.edited("Type", Set((*TITLE, "nl"), "Een eerste blik"))
    assert copied_texts(edited.study) == {"nl": count - 1, "de": count}
    assert copied_texts(edited.undo().study) == {"nl": count, "de": count}
    assert copied_texts(edited.undo().undo().study) == {}
    assert words(edited.undo().undo().study) == []


def test_a_missing_text_is_not_one_to_translate(copied: History) -> None:
    lacking, _ = copied.study.edited(Unset((*TITLE, "nl")))
    counts = copied_texts(copied.study)
    assert missing_texts(lacking) == {"nl": 1}
    assert copied_texts(lacking) == counts | {"nl": counts["nl"] - 1}
    assert [fault.missing_language for fault in lacking.faults] == ["nl"]


def test_a_text_without_letters_is_the_same_in_every_language(copied: History) -> None:
    counts = copied_texts(copied.study)
    plain, _ = copied.study.edited(*(Set((*TITLE, code), "7") for code in ("en", "nl")))
    assert copied_texts(plain) == counts | {"nl": counts["nl"] - 1, "de": counts["de"] - 1}


ITEM = ("questionnaires", "liquid", "items", 0)


def study_of(text: str, short: str) -> Study:
    source = (PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8")
    start = source.index("[[questionnaires.liquid.items]]")
    end = source.index("[[questionnaires.liquid.items]]", start + 1)
    table = f'[[questionnaires.liquid.items]]\nid = "feels_liquid"\ntext = {text}\nshort = {short}\n\n'
    return read((source[:start] + table + source[end:]).encode(), PROTOCOLS)


@pytest.mark.parametrize(
    ("text", "short", "found"),
    [
        ('"New question"', '"New question"', {("short",): "Was it cold"}),
        ('{ en = "Was", nl = "Was" }', '{ en = "Was", nl = "Kou" }', {("short", "en"): "Was it cold"}),
        ('{ en = "Was", nl = "Was" }', '{ en = "Cold", nl = "Was" }', {}),
        ('{ nl = "Was" }', '{ nl = "Was" }', {}),
        ('"Was it cold?"', '"Cold"', {}),
        ('{ en = "Was" }', '"Was"', {}),
    ],
)
def test_a_short_text_that_says_what_the_text_says_follows_it(text: str, short: str, found: dict[Any, str]) -> None:
    edits = followed(study_of(text, short), (*ITEM, "text"), "en", "Was it cold?")
    assert {edit.path[len(ITEM) :]: edit.value for edit in edits} == found  # type: ignore[union-attr]


def test_a_short_text_has_no_stop_and_at_most_forty_letters() -> None:
    assert short_of("How cold was it?") == "How cold was it"
    assert short_of("  one\n two ") == "one two"
    assert len(short_of("letters " * 20)) <= 40
