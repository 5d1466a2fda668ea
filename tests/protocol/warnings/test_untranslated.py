"""Texts in another language than the study says, from texts that a person can tell apart."""

from typing import Any

import pytest

from study_app.errors import SessionError
from study_app.protocol.warnings import untranslated
from study_app.protocol.warnings.untranslated import (
    UntranslatedText,
    check_translated,
    describe_untranslated,
    listed_places,
    untranslated_on_pages,
    untranslated_texts,
)


@pytest.fixture(autouse=True)
def _known_texts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The program ships two English texts and a German one; another study of the workspace has a Dutch sentence."""
    shipped = {"Thank you very much": {"en"}, "Welcome": {"en"}, "Danke": {"de"}, "Start": {"de", "en"}}
    own = {"Roer de bal rond": {"nl"}, "Roer maar": {"nl"}}
    for name, texts in (("_shipped_texts", shipped), ("_workspace_texts", own)):
        known = {untranslated.visible_text(text): frozenset(codes) for text, codes in texts.items()}
        monkeypatch.setattr(untranslated, name, lambda *_, known=known: known)


def study(*languages: str, **pages: Any) -> dict[str, Any]:
    return {
        "study": {"name": "own", "languages": languages},
        "pages": {name: {"kind": "instructions", **texts} for name, texts in pages.items()},
    }


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        ({"en": "My own", "de": "Mein eigener"}, []),
        ({"en": "My own", "de": "Thank you very much"}, [("de", "en", True, False)]),
        ({"en": "My own", "de": "Welcome"}, [("de", "en", True, True)]),
        ({"en": "Danke", "de": "Danke sehr"}, [("en", "de", True, True)]),
        ({"en": "Start", "de": "Start"}, [("de", "en", False, True)]),
        ({"en": "My own", "de": "My own"}, [("de", "en", False, False)]),
        ({"en": "Hand", "de": "Hand"}, []),
        ({"en": "My own", "de": "New question 3"}, [("de", "en", True, False)]),
        ({"en": "New question 3", "de": "Neue Frage"}, []),
        ({"en": "My own", "de": "Roer de bal rond"}, [("de", "nl", False, False)]),
        ({"en": "My own", "de": "Roer maar"}, []),
        ({"en": "My own", "de": "Erst das.\n\nWelcome\n\nDann das."}, [("de", "en", True, False)]),
        ({"en": "7 + 8", "de": "7 + 8"}, []),
        ("Danke", [("en", "de", True, True)]),
    ],
)
def test_a_text_is_untranslated_if_it_equals_the_first_or_is_known_only_there(
    texts: Any, expected: list[tuple[Any, ...]]
) -> None:
    untranslated = untranslated_texts(study("en", "de", only={"title": texts}))
    flagged = [text for text in untranslated if isinstance(texts, dict) or text.language == "en"]
    assert flagged == [UntranslatedText(("pages", "only", "title"), *fields) for fields in expected]


MIXED = study(
    "en",
    "de",
    first={"title": {"en": "Welcome", "de": "Welcome"}, "body": {"en": "Own", "de": "Thank you very much"}},
    last={"title": {"en": "Danke", "de": "Danke sehr"}, "button": {"en": "On", "de": "On"}},
)


def test_a_warning_counts_the_texts_of_each_pair_of_languages_and_names_the_first() -> None:
    of_german = "still in English and must be translated into German"
    of_english = "pages.last.title: 1 text is still in German and must be translated into English"
    assert list(describe_untranslated(MIXED, lists_places=False)) == [
        f"pages.first.title: 2 texts are {of_german}; this is the first of them", of_english,
        "pages.last.button: 1 text is the same in English and German and may have to be translated into German",
    ]  # fmt: skip
    assert list(describe_untranslated(MIXED, lists_places=True)) == [
        f"study.languages: 2 texts are {of_german}: pages.first.title, pages.first.body",
        f"study.languages{of_english.removeprefix('pages.last.title')}: pages.last.title",
        "study.languages: 1 text is the same in English and German and may have to be translated into German: "
        "pages.last.button",
    ]
    only = study("de", first={"title": "Welcome"})
    assert list(describe_untranslated(only, lists_places=False)) == [
        "pages.first.title: 1 text is still in English, but the study's only language is German"
    ]


def test_places_are_counted_from_1_and_at_most_five_are_listed() -> None:
    texts = [UntranslatedText(("items", number, "text"), "de", "en", ships=True, is_word=False) for number in range(7)]
    listed = ", ".join(f"items.{number}.text" for number in range(1, 6))
    assert (listed_places(texts[:5]), listed_places(texts)) == (listed, f"{listed} and 2 more")


def test_a_session_does_not_begin_with_shipped_sentences_of_another_language() -> None:
    """A single word may be the same in both; a text that no participant reads does not matter."""
    with pytest.raises(SessionError) as error:
        check_translated(MIXED)
    assert str(error.value) == (
        "2 texts on German pages are still in English: pages.first.title, pages.first.body; translate the texts that "
        "the designer lists under Languages, or run a pilot session"
    )
    check_translated(study("en", "de", first={"title": {"en": "Welcome", "de": "Welcome"}}))
    check_translated(study("en", "de", first={"title": {"en": "My own", "de": "My own"}}))
    unread = study("en", "de") | {
        "questionnaires": {"q": {"items": ({"short": {"en": "Own", "de": "Thank you very much"}},)}}
    }
    unread["study"]["title"] = {"en": "Own", "de": "Thank you very much"}
    assert len(untranslated_texts(unread)) == 2
    assert untranslated_on_pages(unread) == ()
    check_translated(unread)
