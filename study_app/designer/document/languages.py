"""Edits that add a language to every text of a study, fill in missing texts, and remove it again."""

from collections.abc import Iterator, Mapping
from typing import Any

from study_app.designer.document.edited_study import Study
from study_app.designer.document.initial_values import new_text
from study_app.designer.document.names import ITEMS
from study_app.designer.document.writer.edits import Edit, Set, Unset
from study_app.designer.document.writer.refused import Refused
from study_app.protocol.checks.cross_references import TEXTS
from study_app.protocol.source.document import Path, entries
from study_app.protocol.wording.languages import LANGUAGES, language_name


def languages_of(study: Study) -> tuple[str, ...]:
    """Return the languages of a study; a file that names none has English."""
    found = tuple(str(code) for _, code in entries(study.document, "study.languages.*"))
    return found or ("en",)


def with_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that add a language: plain texts become tables, whose new texts are missing.

    Raises
    ------
    Refused
        The study has it, or the program has no words in it.
    """
    there = languages_of(study)
    if code in there:
        raise Refused(f"the study is in {language_name(code)} already")
    if code not in LANGUAGES:
        raise Refused(f'the program has no words in "{code}": there are {", ".join(LANGUAGES)}')
    tables = (Set(path, {there[0]: text}) for path, text in texts_of(study) if isinstance(text, str))
    return (Set(("study", "languages"), [*there, code]), *tables)


def without_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that remove a language and its texts.

    Raises
    ------
    Refused
        It is the only one, or the study does not have it.
    """
    there = languages_of(study)
    if code not in there or len(there) == 1:
        raise Refused("a study has at least one language")
    gone = (Unset((*path, code)) for path, text in texts_of(study) if isinstance(text, Mapping) and code in text)
    return (*gone, Set(("study", "languages"), [one for one in there if one != code]))


def filled_in(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that copy the first language's texts to missing texts of a language."""
    first = languages_of(study)[0]
    found: list[Edit] = []
    for path, text in texts_of(study):
        if isinstance(text, Mapping) and code not in text and first in text:
            found.append(Set((*path, code), _plain(text[first])))
        elif isinstance(text, str):
            found.append(Set(path, {first: text, code: text}))
    return tuple(found)


def is_copied(texts: Mapping[str, Any], code: str, first: str) -> bool:
    """Return whether a text in a language is still that of the first language, or of a new question.

    A text without a letter, such as "7", is the same in every language.
    """
    text = texts.get(code)
    return text in (texts.get(first), new_text(ITEMS)) and any(map(str.isalpha, str(text or "")))


def texts_of(study: Study) -> Iterator[tuple[Path, Any]]:
    """Yield every text that is in the languages of a study, labels of scales included, with its place."""
    for pattern in TEXTS:
        yield from entries(study.document, pattern)


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
