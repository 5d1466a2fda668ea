"""Fields of a study, found by the words of their labels, of their choices, and of what the choices mean."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from study_app.designer.document.edited_study import Study
from study_app.designer.document.elements import outline
from study_app.designer.document.fields import Row, label_of, refused_at, rows
from study_app.protocol.source.document import Path

SHORTEST: Final = 3
"""So many letters are typed before fields are looked for."""
LABEL, CHOSEN, OTHER, SENTENCE = range(4)
_DEEPEST: Final = 3


@dataclass(frozen=True, slots=True)
class FoundField:
    """A field that was found.

    Attributes
    ----------
    element, field : tuple of str or int
        The element, and the field in it.
    label, choice, help : str
        Its label, what is chosen in it where that was looked for, and what it is for.
    rank : int
        What was found: 0 its label, 1 what is chosen in it, 2 another choice, 3 only the sentence of a choice.
    """

    element: Path
    field: Path
    label: str
    choice: str = ""
    help: str = ""
    rank: int = LABEL


def words_sought(words: str) -> list[str]:
    """Return the words that are looked for, each without the "s" of a plural."""
    return [part.removesuffix("s") if len(part) > SHORTEST else part for part in words.casefold().split()]


def found_fields(study: Study, words: str) -> tuple[FoundField, ...]:
    """Return the fields whose labels or choices have words that begin so, labels first.

    Choices that are not chosen count where no label and nothing that is chosen has the words; sentences count last.
    """
    parts = words_sought(words)
    if not parts or len(words.strip()) < SHORTEST:
        return ()
    found = [one for field in _fields(study) for one in _found_in(field, parts)]
    best = min((one.rank for one in found), default=0)
    return tuple(sorted((one for one in found if one.rank <= max(best, CHOSEN)), key=lambda one: one.rank))


def found_in_elements(study: Study, words: str) -> Mapping[Path, FoundField]:
    """Return for each element the first field that was found in it."""
    first: dict[Path, FoundField] = {}
    for one in found_fields(study, words):
        first.setdefault(one.element, one)
    return first


@lru_cache(maxsize=2)
def _fields(study: Study) -> tuple[tuple[Path, Row, str], ...]:
    """Return every field of every element, with its label."""
    shown = outline(study)
    parts = [one.path for one in (*shown.session, *shown.parts) if len(one.path) > 1]
    elements = dict.fromkeys((*parts, *(one.path for one in shown.study)))
    return tuple((element, row, label) for element in elements for row, label in _of_table(study, element, ""))


def _of_table(study: Study, path: Path, above: str, depth: int = 0) -> Iterator[tuple[Row, str]]:
    refused = refused_at(study.document, path)
    for row in rows(study.document, path):
        if row.value is None and row.path[-1] in refused:
            continue
        label = f"{above}{row.label}"
        yield row, label
        if row.kind == "table" and isinstance(row.value, Mapping) and depth < _DEEPEST:
            yield from _of_table(study, row.path, f"{label}, ", depth + 1)


def _found_in(field: tuple[Path, Row, str], parts: list[str]) -> Iterator[FoundField]:
    """Yield the field where its label has the words; else once for each of its choices that has them."""
    element, row, label = field
    if _has(label, parts):
        yield FoundField(element, row.path, label, help=row.help)
        return
    for choice in row.choices if row.kind in {"choice", "choices", "kind"} else ():
        named = label_of(choice.value or "")
        whole = f"{label} {named} {choice.sentence}"
        if choice.value and _has(whole, parts):
            there = row.default if row.value is None else row.value
            of_name = CHOSEN if choice.value == there else OTHER
            rank = of_name if any(_has(named, [part]) for part in parts) else SENTENCE
            yield FoundField(element, row.path, label, named, choice.sentence or row.help, rank)


def _has(text: str, parts: list[str]) -> bool:
    """Return whether a word of a text begins with each of some parts."""
    spaced = " " + " ".join(text.casefold().replace("-", " ").replace(",", " ").replace("(", " ").split())
    return all(f" {part}" in spaced for part in parts)
