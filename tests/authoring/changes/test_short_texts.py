"""The short text of a question follows its text until it is edited."""

from typing import Any

import pytest

from study_app.authoring.changes.short_texts import followed, short_of
from study_app.authoring.edited_study import Study, read
from tests.authoring.grown import PROTOCOLS

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


def test_other_texts_have_no_short_one() -> None:
    study = study_of('"Was"', '"Was"')
    assert followed(study, (*ITEM, "short"), "en", "Cold") == ()
    assert followed(study, ("pages", "consent", "title"), "en", "Cold") == ()


def test_a_short_text_has_no_stop_and_at_most_forty_letters() -> None:
    assert short_of("How cold was it?") == "How cold was it"
    assert short_of("  one\n two ") == "one two"
    assert len(short_of("letters " * 20)) <= 40
