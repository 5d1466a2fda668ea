"""What follows an edit: moved and pasted entries, copies in a language, short texts."""

from typing import Any

import pytest

from study_app.designer.document.changes import filled_in, followed, moved, texts_of, with_language
from study_app.designer.document.fragments import copied, pasted
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.designer.measures.study_facts import copied_texts, facts, missing_texts
from study_app.protocol.groups import sequences_in
from study_app.protocol.source.document import entries
from tests.designer.document.grown import PROTOCOLS, texts
from tests.designer.document.random_edits import at, owners

TEXTS = texts()
PASTED = 8
"""So many elements of each text are copied, evenly spread."""


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_entries_come_together_to_their_place_in_their_order(name: str) -> None:
    study = Study(TEXTS[name])
    lists = [*sequences_in(study.document), *entries(study.document, "questionnaires.*.items")]
    for place, listed in lists:
        count = len(listed)
        for chosen, to in (([0], count), ([count - 1], 0), (list(range(0, count, 2)), count // 2)):
            edits, paths = moved(study, [(*place, index) for index in chosen], to)
            after, _ = study.edited(*edits)
            rest = [entry for index, entry in enumerate(listed) if index not in chosen]
            first = to - sum(index < to for index in chosen)
            wanted = [*rest[:first], *(listed[index] for index in chosen), *rest[first:]]
            assert list(at(after.document, place)) == wanted
            assert [at(after.document, path) for path in paths] == [listed[index] for index in chosen]


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_a_pasted_copy_has_the_values_and_comments_of_its_original(name: str) -> None:
    study = Study(TEXTS[name])
    before = owners(study.text)
    found = [path for path, value in entries(study.document, "*.*") if isinstance(value, dict)]
    found += [path for path, _ in entries(study.document, "questionnaires.*.items.*")]
    for path in found[:: max(1, len(found) // PASTED)]:
        try:
            made, (copy,) = pasted(study, path, copied(study, [path]))
        except Refused:
            assert path[0] in {"study", "scene", "device", "analysis", "limits"}
            continue
        after = Study(made, before=study.document)
        old, new = at(study.document, path), at(after.document, copy)
        assert {**old, "id": 0} == {**new, "id": 0}
        if f"[{path[0]}.{path[1]}]" in study.text or len(path) > 2:
            comments = owners(made)
            for (place, comment), count in before.items():
                if place[: len(path)] == path:
                    assert comments[(*copy, *place[len(path) :]), comment] >= count, (path, comment)
        lines = set(study.text.splitlines())
        assert lines <= set(made.splitlines())


def test_keys_before_a_header_do_not_end_up_in_another_table() -> None:
    study = Study(TEXTS["demo"])
    made, _ = pasted(study, ("liquids", "thick"), "liquids.honey.density_kg_m3 = 1_420\n")
    assert Study(made).document["liquids"]["honey"] == {"density_kg_m3": 1420}


@pytest.mark.parametrize("text", ["study.name = 'x'", "liquids.x = 5", "# a comment", "liquids = 4", "other.x.y = 1"])
def test_what_is_no_element_of_a_study_is_refused(text: str) -> None:
    with pytest.raises(Refused):
        pasted(Study(TEXTS["demo"]), ("liquids", "thick"), text)


TITLE = ("pages", "welcome", "title")
DEMO = read((PROTOCOLS / "demo.toml").read_bytes(), PROTOCOLS)


@pytest.fixture(scope="module")
def translated() -> Study:
    """The demo with two languages that are copies of the first one, as one step."""
    study = DEMO
    for code in ("nl", "de"):
        study, _ = study.edited(*with_language(study, code))
    for code in ("nl", "de"):
        study, _ = study.edited(*filled_in(study, code))
    return study


def words(study: Study) -> list[str]:
    return [one for one in facts(study).warnings if "to translate" in one]


def test_copies_in_two_languages_are_counted_until_each_is_edited(translated: Study) -> None:
    count = sum(any(map(str.isalpha, str(text["en"]))) for _, text in texts_of(translated))
    assert copied_texts(translated) == {"nl": count, "de": count}
    assert translated.faults == ()
    assert words(translated) == [
        f"study.languages: {count} texts to translate to {name}, as in English so far" for name in ("Dutch", "German")
    ]
    edited, _ = translated.edited(Set((*TITLE, "nl"), "Een eerste blik"))
    assert copied_texts(edited) == {"nl": count - 1, "de": count}
    assert (copied_texts(DEMO), words(DEMO)) == ({}, [])


def test_a_missing_text_is_not_one_to_translate(translated: Study) -> None:
    lacking, _ = translated.edited(Unset((*TITLE, "nl")))
    counts = copied_texts(translated)
    assert missing_texts(lacking) == {"nl": 1}
    assert copied_texts(lacking) == counts | {"nl": counts["nl"] - 1}
    assert [fault.missing_language for fault in lacking.faults] == ["nl"]


def test_a_text_without_letters_is_the_same_in_every_language(translated: Study) -> None:
    counts = copied_texts(translated)
    plain, _ = translated.edited(*(Set((*TITLE, code), "7") for code in ("en", "nl")))
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
