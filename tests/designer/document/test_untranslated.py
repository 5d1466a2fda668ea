"""Texts copied from a template or another study are known to be untranslated, whatever language the study states."""

from pathlib import Path

import pytest

from study_app.designer.document.additions import (
    edits_to_add_language,
    edits_to_fill_in,
    edits_to_remove_language,
    localised_texts,
)
from study_app.designer.document.document import Answers, copy_of, template, with_answers
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Set
from study_app.designer.measures.study_facts import copied_texts, facts
from study_app.designer.templates import templates
from study_app.errors import SessionError
from study_app.protocol.source.files import shipped, shipped_file
from study_app.protocol.warnings.untranslated import SAME_WORDS, check_translated, describe_untranslated
from study_app.session.start import NewSession, check_choices
from study_app.workspace import workspace

CODES = ("nl", "de", "fr", "ar")


def words_in(text: object) -> bool:
    return any(map(str.isalpha, str(text)))


def lines_of(study: Study) -> list[str]:
    return list(describe_untranslated(study.document, lists_places=False))


def study_named(name: str) -> Study:
    return (
        template(name)
        if name in templates()
        else read_study(shipped_file(name).read_bytes(), shipped_file(name).parent)
    )


def translated(study: Study, code: str) -> Study:
    """Return the study with every text of a language replaced by a translation."""
    for number, (path, value) in enumerate(localised_texts(study)):
        place = (*path, code) if not isinstance(value, str) else path
        text = value if isinstance(value, str) else value[code]
        several = isinstance(text, tuple)
        study, _ = study.with_edits(
            Set(place, [f"Wort {number} {at}" for at in range(len(text))] if several else f"Wort {number}")
        )
    return study


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("name", [*templates(), "demo", "thickness", "delayjnd", "forcedelay"])
def test_every_english_text_of_a_study_in_another_language_needs_translation(name: str, code: str) -> None:
    english = study_named(name)
    texts = [text for _, text in localised_texts(english) if words_in(text)]
    same = sum(isinstance(text, str) and text.casefold() in SAME_WORDS.get(code, ()) for text in texts)
    study = with_answers(english, Answers(languages=(code,)))
    assert (study.faults, copied_texts(study)) == ((), {code: len(texts) - same})
    assert copied_texts(read_study(study.text.encode())) == copied_texts(study), "after saving and opening"
    assert [line for line in facts(study).warnings if "still in English" in line] == lines_of(study)
    with pytest.raises(SessionError, match="still in English"):
        check_translated(study.document)


def test_the_count_falls_with_each_text_to_zero() -> None:
    study = with_answers(template("rate-realism"), Answers("Ça fait vrai ?", ("fr",)))
    assert lines_of(study) == [
        "tasks.explore.instruction: 16 texts are still in English, but the study's only language is French; "
        "this is the first of them"
    ]
    study, _ = study.with_edits(Set(("pages", "welcome", "title", "fr"), "Bienvenue"))
    assert copied_texts(study) == {"fr": 15}
    finished = translated(study, "fr")
    assert (copied_texts(finished), lines_of(finished)) == ({}, [])
    check_translated(finished.document)
    almost, _ = finished.with_edits(Set(("pages", "thanks", "button", "fr"), "Finish"))
    sentence = (
        "study.languages: 1 text is still in English, but the study's only language is French: pages.thanks.button"
    )
    assert list(describe_untranslated(almost.document, lists_places=True)) == [sentence]
    check_translated(almost.document)  # French might have the same word
    almost, _ = almost.with_edits(Set(("pages", "thanks", "title", "fr"), "Thank you"))
    with pytest.raises(SessionError, match=r"2 texts on French pages .* pages\.thanks\.title,"):
        check_translated(almost.document)


@pytest.mark.parametrize("name", shipped())
@pytest.mark.parametrize("codes", [("en",), ("nl",), ("en", "nl")])
def test_a_shipped_study_in_its_own_languages_has_nothing_to_translate(name: str, codes: tuple[str, ...]) -> None:
    original = study_named(name)
    if set(codes) <= set(original.document["study"].get("languages", ("en",))):
        assert copied_texts(with_answers(original, Answers(languages=codes))) == {}


def test_dutch_texts_in_a_study_that_states_english_are_recognised_too() -> None:
    dutch = read_study(
        study_named("slime").text.replace('"en", "nl"', '"nl", "en"').encode(), shipped_file("slime").parent
    )
    swapped = with_answers(with_answers(dutch, Answers(languages=("nl",))), Answers(languages=("fr",)))
    assert "texts are still in Dutch, but the study's only language is French;" in lines_of(swapped)[0]


def test_texts_typed_by_hand_without_a_language_are_compared_too() -> None:
    text = template("empty").text.replace('languages = ["en"]', 'languages = ["fr"]')
    assert copied_texts(read_study(text.encode())) == {"fr": 10}
    wrapped = text.replace("You will move a ball\nthrough", "You will  move a ball through").replace(
        "Welcome", "WELCOME"
    )
    assert copied_texts(read_study(wrapped.encode())) == {"fr": 10}, "case and line breaks do not matter"


def test_one_paragraph_that_is_left_in_english_is_enough() -> None:
    study = translated(with_answers(template("empty"), Answers(languages=("de",))), "de")
    body = "Sie bewegen eine Kugel.\n\nHold Esc to switch the force off."
    study, _ = study.with_edits(Set(("pages", "welcome", "body", "de"), body))
    assert copied_texts(study) == {}, "a text of one's own is not judged"
    theirs = template("empty").document["pages"]["welcome"]["body"].split("\n\n")[1]
    study, _ = study.with_edits(Set(("pages", "welcome", "body", "de"), f"Sie bewegen eine Kugel.\n\n{theirs}"))
    assert copied_texts(study) == {"de": 1}


@pytest.mark.parametrize(("title", "copied"), [("Effort", {}), ("Force", {"fr": 1})])
def test_only_words_known_to_be_the_same_in_both_languages_may_be_equal(title: str, copied: dict[str, int]) -> None:
    study = with_answers(template("empty"), Answers(languages=("en", "fr")))
    study = translated(study.with_edits(*edits_to_fill_in(study, "fr"))[0], "fr")
    study, _ = study.with_edits(Set(("pages", "thanks", "title"), {"en": title, "fr": title}))
    assert copied_texts(study) == copied
    assert [line.split(":")[0] for line in lines_of(study)] == ["pages.thanks.title"] * len(copied)


def test_both_languages_of_a_french_and_dutch_study_are_counted() -> None:
    study = with_answers(template("empty"), Answers(languages=("fr", "nl")))
    study, _ = study.with_edits(*edits_to_fill_in(study, "nl"))
    assert (study.faults, copied_texts(study)) == ((), {"fr": 10, "nl": 10})
    with pytest.raises(SessionError, match="9 texts on French pages"):
        check_translated(study.document)


def test_a_copy_of_an_own_study_is_recognised_and_warned_of(tmp_path: Path) -> None:
    own = copy_of(translated(template("empty"), "en"), "own")
    own, _ = own.with_edits(Set(("pages", "thanks", "body"), "Many thanks for your patience."))
    workspace().protocols.mkdir(parents=True, exist_ok=True)
    (workspace().protocols / "own.toml").write_text(own.text, encoding="utf-8", newline="\n")
    french = copy_of(with_answers(own, Answers(languages=("fr",))), "notre")
    assert copied_texts(french) == {"fr": 1}, "two words may be the same in two languages"
    check_translated(french.document)
    (workspace().protocols / "own.toml").unlink()
    assert copied_texts(french) == {}


def test_an_added_language_without_edits_keeps_its_copies() -> None:
    study, _ = template("empty").with_edits(*edits_to_add_language(template("empty"), "ar"))
    study, _ = study.with_edits(*edits_to_fill_in(study, "ar"))
    study, _ = study.with_edits(*edits_to_remove_language(study, "en"))
    assert copied_texts(study) == {"ar": 10}


@pytest.mark.parametrize("pilot", [False, True])
def test_a_session_is_refused_before_anything_is_made_and_a_pilot_is_warned(tmp_path: Path, pilot: bool) -> None:
    file = tmp_path / "etude.toml"
    study = copy_of(with_answers(template("empty"), Answers(languages=("fr",))), "etude")
    file.write_text(study.text, encoding="utf-8", newline="\n")
    chosen = NewSession(
        source=str(file),
        participant="P001",
        session=1,
        seed=7,
        operator="AK",
        language="fr",
        device="scripted",
        windowed=True,
        screen=None,
        results=tmp_path / "results",
        pilot=pilot,
    )
    assert study.protocol is not None
    if pilot:
        check_choices(chosen, study.protocol)
    else:
        with pytest.raises(SessionError, match="9 texts on French pages are still in English"):
            check_choices(chosen, study.protocol)
    assert not (tmp_path / "results").exists()
