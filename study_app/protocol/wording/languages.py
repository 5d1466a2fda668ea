"""The program's own texts on the participant's pages, which are not part of a protocol, one file for each language.

Texts with braces are templates for ``str.format``; for texts that depend on a number there is a method. Languages of a
lab are complete files in the workspace's folder ``languages``, read when the program starts.
"""

from __future__ import annotations

import re
import string
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path as File
from typing import TYPE_CHECKING, Any, Final

from study_app.errors import StudyError
from study_app.number_text import exact_text, readings_of
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.files import without_byte_order_mark
from study_app.protocol.source.problems import Fault
from study_app.workspace import workspace

RIGHT_TO_LEFT = frozenset({"ar", "dv", "fa", "he", "ks", "ps", "sd", "ug", "ur", "yi"})


class Words:
    """The texts of one language: an attribute for each key of its file, a text or a template with slots in braces.

    ``small_numbers`` are the numbers from one at the start of a sentence; ``interval_coming`` has the texts in the
    pause before the first interval, the second, and so on. The
    keys of questions are kinds of designs, those of answers are IDs.
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
        """Return a list for a sentence: "2", "2 and 5", "2, 5 and 8"."""
        if not entries:
            return ""
        joined = entries[0]
        for number, entry in enumerate(entries[1:], 2):
            template = self.list_end if number == len(entries) else self.list_comma
            joined = template.format(first=joined, last=entry)
        return joined

    def unclear_number(self, text: str) -> str:
        """Return the sentence that asks for clarification of an ambiguous number; "" if it is unambiguous."""
        numbers = readings_of(text, self.decimal_sign)
        if len(numbers) < 2:
            return ""
        reading, other = (exact_text(number).replace(".", self.decimal_sign) for number in numbers)
        return self.number_unclear.format(text=text.strip(), one=reading, other=other)

    def missing(self, numbers: Sequence[int]) -> str:
        """Return the sentence that lists the numbers of unanswered statements, at least one."""
        return self._missing(numbers, self.one_missing, self.many_missing)

    def questions_missing(self, numbers: Sequence[int]) -> str:
        """Return the sentence that lists the numbers of unanswered questions of a form."""
        return self._missing(numbers, self.one_question_missing, self.many_questions_missing)

    def _missing(self, numbers: Sequence[int], singular: str, many: str) -> str:
        listed = self.joined([str(number) for number in numbers])
        count = len(numbers)
        if count == 1:
            return singular.format(list=listed)
        count_text = self.small_numbers[count - 1] if count <= len(self.small_numbers) else str(count)
        return many.format(n=count_text, list=listed)


_FOLDER: Final = File(__file__).parent
_ENGLISH: Final = tomllib.loads((_FOLDER / "en.toml").read_text(encoding="utf-8"))


def read_language(file: File) -> Words:
    """Return the texts in the file of one language.

    Raises
    ------
    StudyError
        The file cannot be read, or texts are missing, unknown, or have other slots than the English ones, which
        the message lists.
    """
    try:
        table = tomllib.loads(without_byte_order_mark(file.read_bytes()).decode("utf-8"))
    except UnicodeDecodeError as error:
        raise StudyError(f"{file} is not UTF-8 text: save it as UTF-8") from error
    except (OSError, ValueError, RecursionError) as error:
        raise StudyError(f"{file} cannot be read as TOML ({error}): correct the file") from error
    faults = [*_language_faults("", _ENGLISH, table)]
    if table.get("language") != file.stem:
        faults.append(f'language must be "{file.stem}", as in the file name')
    if faults:
        more_text = f"; and {len(faults) - _MAX_FAULTS} more" if len(faults) > _MAX_FAULTS else ""
        raise StudyError(f"{file}: {'; '.join(faults[:_MAX_FAULTS])}{more_text}")
    return Words(table)


_MAX_FAULTS: Final = 8


def _language_faults(place: str, english: Mapping[str, Any], table: Mapping[str, Any]) -> Iterator[str]:
    """Yield problems of a table of texts, compared with the English one."""
    yield from (f"{place}{key} is unknown: remove it" for key in table if key not in english)
    for key, english_text in english.items():
        text = table.get(key)
        if not text:
            yield f"{place}{key} is missing"
        elif isinstance(english_text, Mapping):
            yield from (
                _language_faults(f"{key}.", english_text, text)
                if isinstance(text, Mapping)
                else [f"{key} must be a table"]
            )
        elif type(text) is not type(english_text) or (
            isinstance(text, list) and not all(isinstance(entry, str) for entry in text)
        ):
            yield f"{place}{key} must be {'a list of strings' if isinstance(english_text, list) else 'a string'}"
        elif key == "interval_coming" and len(text) != len(english_text):
            yield f"{place}{key} needs {len(english_text)} strings"
        elif isinstance(text, str) and (wrong_slots := _wrong_slots(text, english_text)):
            yield (
                f"{place}{key} must contain the same placeholders as “{english_text}”; these differ: "
                f"{{{'}, {'.join(sorted(wrong_slots))}}}"
            )


def _wrong_slots(text: str, english_text: str) -> set[str]:
    """Return the slots that only one of two texts has; a list may lack its count, as in some languages."""
    slots, english_slots = _slots(text), _slots(english_text)
    return (slots - english_slots) | (english_slots - slots - ({"n"} if "list" in slots else set()))


def _slots(text: str) -> set[str]:
    try:
        slots = [(name, form, conversion) for _, name, form, conversion in string.Formatter().parse(text)]
    except ValueError:  # a single brace
        return {"…"}
    return {f"{name}{'!' if conversion else ''}{form}" for name, form, conversion in slots if name is not None}


def own_languages(folder: File) -> tuple[dict[str, Words], dict[str, str]]:
    """Return the languages in a folder by code, and the reasons for rejecting others."""
    languages: dict[str, Words] = {}
    reasons: dict[str, str] = {}
    try:
        files = sorted(folder.glob("[a-z][a-z].toml"))
    except OSError as error:
        return {}, {folder.name: f"{folder} cannot be read ({error.strerror})"}
    for file in files:
        if file.stem in SHIPPED:
            reasons[file.stem] = f"{file}: the program already includes this language; remove the file"
            continue
        try:
            languages[file.stem] = read_language(file)
        except StudyError as error:
            reasons[file.stem] = str(error)
    return languages, reasons


SHIPPED: Final = {code: read_language(_FOLDER / f"{code}.toml") for code in ("en", "nl", "de", "fr", "ar")}
_LAB_LANGUAGES, REFUSED = own_languages(workspace().folder / "languages")
LANGUAGES: Final = SHIPPED | _LAB_LANGUAGES


def language_template(code: str) -> str:
    """Return a language file without texts, with the English ones in comments."""
    lines = (_FOLDER / "en.toml").read_text(encoding="utf-8").splitlines()[2:]
    text = "\n".join(re.sub(r'^(\w+) = ((?:".*?"|\[.*\]))(.*)$', _empty_line, line) for line in lines)
    return text.replace('language = ""', f'language = "{code}"', 1) + "\n"


def _empty_line(line: re.Match[str]) -> str:
    empty = "[]" if line[2].startswith("[") else '""'
    return f"{line[1]} = {empty}  # {line[2]}{line[3]}"


def languages_of(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the languages that a study's document states; the default is English."""
    return tuple(str(code) for _, code in entries(document, "study.languages.*")) or ("en",)


def language_name(code: str) -> str:
    """Return the English name of a language, or its code if the program has no texts in it."""
    return LANGUAGES[code].english_name if code in LANGUAGES else code


def missing_text(path: Path, language: str) -> Fault:
    """Return the fault that a text is missing in one of the study's languages."""
    hint = f"add {language}: every text is needed in every language of the study"
    return Fault(path, f"is missing in {language_name(language)}", hint, missing_language=language, kind="no text")


def words(language: str) -> Words:
    """Return the texts of a language; raise StudyError if there are none."""
    if language not in LANGUAGES:
        reason = REFUSED.get(
            language,
            f"known: {', '.join(sorted(LANGUAGES))}; copy languages/{language}.toml from the workspace in which the "
            f"study was made, or run liquid-study language {language}",
        )
        raise StudyError(f'the program does not have texts for the participant\'s pages in "{language}" ({reason})')
    return LANGUAGES[language]


def words_or_english(language: str) -> Words:
    """Return the texts of a language, or the English ones if there are none."""
    return LANGUAGES.get(language, SHIPPED["en"])
