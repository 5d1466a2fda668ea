"""The program's own words on the participant's pages, one file for each language: everything that no protocol writes.

Templates in braces are filled with ``str.format``; where grammar depends on a number there is a method.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, Final

from study_app.errors import StudyError
from study_app.number_text import exact_text, readings_of
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.problems import Fault, did_you_mean

RIGHT_TO_LEFT = frozenset({"ar", "dv", "fa", "he", "ks", "ps", "sd", "ug", "ur", "yi"})


class Words:
    """One language's words: an attribute for each key of its file, a text, or a template with the slots in its braces.

    ``small_numbers`` are the numbers from one as they begin a sentence; ``interval_coming`` is said in the rest before
    the first interval, the second …; questions are by the kind of design, answers by their id.
    """

    small_numbers: tuple[str, ...]
    interval_coming: tuple[str, ...]
    design_questions: Mapping[str, str]
    design_answers: Mapping[str, str]

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> str: ...

    def __init__(self, table: Mapping[str, Any]) -> None:
        vars(self).update({key: tuple(value) if isinstance(value, list) else value for key, value in table.items()})

    @property
    def right_to_left(self) -> bool:
        """Whether the language is written from right to left."""
        return self.language in RIGHT_TO_LEFT

    def joined(self, entries: Sequence[str]) -> str:
        """Return "2", "2 and 5", "2, 5 and 8"."""
        if not entries:
            return ""
        joined = entries[0]
        for number, entry in enumerate(entries[1:], 2):
            template = self.list_end if number == len(entries) else self.list_comma
            joined = template.format(first=joined, last=entry)
        return joined

    def unclear_number(self, text: str) -> str:
        """Return the sentence that asks again for an ambiguous number; "" if it is not."""
        numbers = readings_of(text, self.decimal_sign)
        if len(numbers) < 2:
            return ""
        reading, other = (exact_text(number).replace(".", self.decimal_sign) for number in numbers)
        return self.number_unclear.format(text=text.strip(), one=reading, other=other)

    def missing(self, numbers: Sequence[int]) -> str:
        """Return the sentence that lists the unanswered statements by number, at least one."""
        return self._missing(numbers, self.one_missing, self.many_missing)

    def questions_missing(self, numbers: Sequence[int]) -> str:
        """Return the sentence that lists the unanswered questions of a form by number."""
        return self._missing(numbers, self.one_question_missing, self.many_questions_missing)

    def _missing(self, numbers: Sequence[int], singular: str, many: str) -> str:
        listed = self.joined([str(number) for number in numbers])
        count = len(numbers)
        if count == 1:
            return singular.format(list=listed)
        named = self.small_numbers[count - 1] if count <= len(self.small_numbers) else str(count)
        return many.format(n=named, list=listed)


_FOLDER: Final = File(__file__).parent
LANGUAGES: Final = {
    code: Words(tomllib.loads((_FOLDER / f"{code}.toml").read_text(encoding="utf-8")))
    for code in ("en", "nl", "de", "fr", "ar")
}


def languages_of(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the languages that a study's document states; English if it states none."""
    return tuple(str(code) for _, code in entries(document, "study.languages.*")) or ("en",)


def language_name(code: str) -> str:
    """Return the English name of a language, or its code if the program has no texts in it."""
    return LANGUAGES[code].english_name if code in LANGUAGES else code


def missing_text(path: Path, language: str) -> Fault:
    """Return the fault about a text missing in one of the study's languages."""
    hint = f"add {language}: every text must exist in every language of the study"
    return Fault(path, f"is missing in {language_name(language)}", hint, missing_language=language)


def words(language: str) -> Words:
    """Return the texts of a language (StudyError if there are none)."""
    if language not in LANGUAGES:
        raise StudyError(
            f'the program does not have texts for participants\' pages in "{language}" '
            f"({did_you_mean(language, LANGUAGES)})"
        )
    return LANGUAGES[language]
