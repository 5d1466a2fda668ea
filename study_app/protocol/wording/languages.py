"""The interface's own words on the participant's pages, by language."""

from __future__ import annotations

from study_app.errors import StudyError
from study_app.protocol.source.problems import did_you_mean
from study_app.protocol.wording.arabic import ARABIC
from study_app.protocol.wording.dutch import DUTCH
from study_app.protocol.wording.english import ENGLISH
from study_app.protocol.wording.french import FRENCH
from study_app.protocol.wording.german import GERMAN
from study_app.protocol.wording.words import Words

__all__ = ["LANGUAGES", "Words", "language_name", "words"]

LANGUAGES = {words.language: words for words in (ENGLISH, DUTCH, GERMAN, FRENCH, ARABIC)}


def language_name(code: str) -> str:
    """Return the English name of a language, its code where the program has no words in it."""
    return LANGUAGES[code].english_name if code in LANGUAGES else code


def words(language: str) -> Words:
    """Return the words of a language.

    Raises
    ------
    StudyError
        There are none in this language.
    """
    if language not in LANGUAGES:
        raise StudyError(f'no words for the participant\'s pages in "{language}" ({did_you_mean(language, LANGUAGES)})')
    return LANGUAGES[language]
