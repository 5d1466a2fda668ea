"""Texts in a different language than the study states for them.

They are recognised by comparison with the texts that ship with the program (studies, templates, standard
questionnaires), with the other languages of the study, and with the other studies of the workspace.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, lru_cache
from pathlib import Path as File
from typing import Any, Final, NamedTuple

from study_app.errors import SessionError, StudyError
from study_app.number_text import counted
from study_app.protocol.checks.cross_references import TEXTS, visible_text
from study_app.protocol.load import read_document
from study_app.protocol.questionnaires import FOLDER as INSTRUMENTS
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.source.files import shipped_studies
from study_app.protocol.wording.languages import language_name, languages_of
from study_app.workspace import workspace

SAME_WORDS: Final[Mapping[str, frozenset[str]]] = {
    "de": frozenset({"anders", "baseline", "frustration", "hand", "neutral", "performance"}),
    "fr": frozenset({"effort", "frustration", "performance"}),
    "nl": frozenset({"baseline", "begin", "hand"}),
}
"""Shipped texts of another language that are also correct in this language."""
_SENTENCE_WORDS: Final = 3
"""Texts of this many words are not the same in two languages by chance."""
_PLACES_LISTED: Final = 5
_PLACEHOLDER: Final = re.compile(r"new [a-z0-9 ]+")
"""The designer's English text for a new element, such as "New question"."""
_PARAGRAPHS: Final = re.compile(r"\n\s*\n")
_INSTRUMENT_TEXTS: Final = ("title", "intro", "scales.*.labels", "scales.*.cannot_judge",
                          *(f"items.*.{key}" for key in ("text", "short", "low", "high")))  # fmt: skip


class UntranslatedText(NamedTuple):
    """A text that should be in ``language`` but is in ``source``, the codes of two languages.

    If it ``ships``, the program contains it in ``source``; otherwise it equals a text of another language or study. If
    it ``is_word``, it may be correct, because a word can be the same in two languages.
    """

    path: Path
    language: str
    source: str
    ships: bool
    is_word: bool

    @property
    def is_shown(self) -> bool:
        """Whether participants read it; short texts are for tables, the study's title is for the operator."""
        return self.path[-1] != "short" and self.path != ("study", "title")


def untranslated_texts(document: Mapping[str, Any]) -> tuple[UntranslatedText, ...]:
    """Return the texts of a document that are in another language than stated."""
    languages, own_texts = languages_of(document), _workspace_texts(document)
    return tuple(
        text for pattern in TEXTS for path, value in entries(document, pattern)
        for text in _untranslated(path, value, languages, own_texts)
    )  # fmt: skip


def untranslated_at(
    document: Mapping[str, Any], path: Path, value: Any, languages: Sequence[str]
) -> Iterator[UntranslatedText]:
    """Yield the text at ``path`` for each language into which it is not translated."""
    return _untranslated(path, value, languages, _workspace_texts(document))


def _untranslated(
    path: Path, value: Any, languages: Sequence[str], own_texts: Mapping[str, frozenset[str]]
) -> Iterator[UntranslatedText]:
    first = languages[0]
    texts = value if isinstance(value, Mapping) else {first: value}
    for code in languages:
        parts = _text_parts(texts.get(code))
        is_word = len(parts) == 1 and len(parts[0].split()) == 1
        if (source := _source_language(parts, code, _shipped_texts())) is not None:
            yield UntranslatedText(path, code, source, ships=True, is_word=is_word)
        elif code != first and texts.get(code) == texts.get(first) and not _same_words(code).issuperset(parts):
            yield UntranslatedText(path, code, first, ships=False, is_word=is_word)
        else:
            sentences = [part for part in parts if len(part.split()) >= _SENTENCE_WORDS]
            if (source := _source_language(sentences, code, own_texts)) is not None:
                yield UntranslatedText(path, code, source, ships=False, is_word=False)


def describe_untranslated(document: Mapping[str, Any], *, lists_places: bool) -> Iterator[str]:
    """Yield a warning for each language with untranslated texts, and one with words that may be the same in both.

    With ``lists_places`` it adds their first places; otherwise it begins with the place of the first text.
    """
    texts, only_one = untranslated_texts(document), len(languages_of(document)) == 1
    for (language, source, may_be_right), count in Counter(map(_kind_of, texts)).items():
        source_name, target = language_name(source), language_name(language)
        count_text = f"{counted(count, 'text')} {'is' if count == 1 else 'are'}"
        problem = f"{count_text} still in {source_name} and must be translated into {target}"
        if may_be_right:
            problem = f"{count_text} the same in {source_name} and {target} and may have to be translated into {target}"
        if only_one:
            problem = f"{count_text} still in {source_name}, but the study's only language is {target}"
        untranslated = [text for text in texts if _kind_of(text) == (language, source, may_be_right)]
        place, more = _place_text(untranslated[0]), "; this is the first of them" if count > 1 else ""
        if lists_places:
            place, more = "study.languages", f": {listed_places(untranslated)}"
        yield f"{place}: {problem}{more}"


def _kind_of(text: UntranslatedText) -> tuple[str, str, bool]:
    """Return a text's language and source, and whether it is a word of the author that may be the same in both."""
    return text.language, text.source, text.is_word and not text.ships


def untranslated_on_pages(document: Mapping[str, Any]) -> tuple[UntranslatedText, ...]:
    """Return the untranslated texts that participants may read in any of the study's languages."""
    return tuple(text for text in untranslated_texts(document) if text.is_shown)


def check_translated(document: Mapping[str, Any]) -> None:
    """Raise SessionError if pages would show shipped texts in another language, not only single words."""
    shipped = [text for text in untranslated_on_pages(document) if text.ships]
    wrong_language = next((text.language for text in shipped if not text.is_word), None)
    if texts := [text for text in shipped if text.language == wrong_language]:
        language, source = language_name(texts[0].language), language_name(texts[0].source)
        count = f"{counted(len(texts), 'text')} on {language} pages {'is' if len(texts) == 1 else 'are'}"
        raise SessionError(
            f"{count} still in {source}: {listed_places(texts)}; translate the texts that the designer lists under "
            "Languages, or run a pilot session"
        )


def listed_places(texts: Sequence[UntranslatedText]) -> str:
    """Return the places of the first texts in the file, and the number of others."""
    names = [_place_text(text) for text in texts[:_PLACES_LISTED]]
    more = len(texts) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


def _place_text(text: UntranslatedText) -> str:
    """Return the place of a text in the file, in which entries count from 1."""
    return ".".join(str(step + 1) if isinstance(step, int) else step for step in text.path)


@lru_cache(maxsize=4096)  # the texts of a study are compared after each edit: 1 to 2 ms instead of 10 to 40
def _text_parts(text: Any) -> tuple[str, ...]:
    """Return a text's paragraphs or a scale's labels for comparison, without those that contain no letters."""
    raw_parts = text if isinstance(text, tuple) else _PARAGRAPHS.split(text) if isinstance(text, str) else ()
    visible_parts = (visible_text(part) for part in raw_parts if isinstance(part, str))
    return tuple(part for part in visible_parts if any(map(str.isalpha, part)))


def _source_language(parts: Sequence[str], code: str, known: Mapping[str, frozenset[str]]) -> str | None:
    """Return the language of the first part that is known only in another language; None if there is none."""
    for part in parts:
        if code != "en" and _PLACEHOLDER.fullmatch(part):
            return "en"
        sources = known.get(part, frozenset())
        if sources and code not in sources and part not in _same_words(code):
            return min(sources)
    return None


def _same_words(code: str) -> frozenset[str]:
    return SAME_WORDS.get(code, frozenset())


@cache
def _shipped_texts() -> Mapping[str, frozenset[str]]:
    """Return every shipped text with its languages."""
    studies = ((_read_table(file), TEXTS) for file in shipped_studies())
    instruments = ((_read_table(file), _INSTRUMENT_TEXTS) for file in sorted(INSTRUMENTS.glob("*.toml")))
    return _languages_by_text((*studies, *instruments))


def _workspace_texts(document: Mapping[str, Any]) -> Mapping[str, frozenset[str]]:
    """Return the texts of the workspace's other studies with their stated languages."""
    files = []
    for file in workspace().own_protocols():
        try:
            status = file.stat()
        except OSError:
            continue  # it was deleted meanwhile
        files.append((file, status.st_size, status.st_mtime_ns))
    return _texts_of_files(tuple(files), str(value_at(document, ("study", "name"))))


@lru_cache(maxsize=2)
def _texts_of_files(files: tuple[tuple[File, int, int], ...], except_name: str) -> Mapping[str, frozenset[str]]:
    tables = (_read_table_or_nothing(*file) for file in files)
    others = [(table, TEXTS) for table in tables if value_at(table, ("study", "name")) != except_name]
    shipped = _shipped_texts()
    return {text: codes for text, codes in _languages_by_text(others).items() if text not in shipped}


@lru_cache(maxsize=256)
def _read_table_or_nothing(file: File, _size: int, _changed_ns: int) -> Mapping[str, Any]:
    try:
        return _read_table(file)
    except (StudyError, OSError):
        return {}  # `check` of that file reports the error


def _read_table(file: File) -> Mapping[str, Any]:
    return read_document(file.read_bytes(), file.name)[0]


def _languages_by_text(tables: Sequence[tuple[Mapping[str, Any], Sequence[str]]]) -> Mapping[str, frozenset[str]]:
    """Return the parts of all texts of documents with their stated languages."""
    languages: dict[str, set[str]] = {}
    for table, patterns in tables:
        first = languages_of(table)[0]
        for pattern in patterns:
            for _, value in entries(table, pattern):
                for code, text in (value if isinstance(value, Mapping) else {first: value}).items():
                    for part in _text_parts(text):
                        languages.setdefault(part, set()).add(code)
    return {text: frozenset(codes) for text, codes in languages.items()}
