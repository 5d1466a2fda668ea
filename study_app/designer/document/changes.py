"""Edits of whole tables: another kind, languages, order, series of copies, short texts."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from study_app.designer.document.fields import initial, new_text, node_at, table_of, tags
from study_app.designer.document.names import ITEMS, languages_of
from study_app.designer.document.study import Study
from study_app.designer.document.toml_edits import Edit, Move, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.protocol.checks.cross_references import TEXTS
from study_app.protocol.source.document import Path, entries, has, value_at
from study_app.protocol.wording.languages import LANGUAGES, language_name


def switched(
    study: Study, path: Path, kind: str | None, left: Mapping[str, Any]
) -> tuple[tuple[Edit, ...], dict[str, Any]]:
    """Return the edits that change the kind of a table, None for the kind without the key, and the values removed.

    Keys of both kinds keep their values, the others are removed; keys that the new kind needs get the value that they
    had before (``left``, removed by earlier switches), or an initial one.
    """
    key, named = tags(node_at(study.document, path))
    if not key or kind not in named:
        raise Refused(f"there is no kind {kind!r} here: {', '.join(map(str, named))}")
    node = table_of((named[kind],), {})
    if node is None:
        raise Refused(f"{kind} is not a kind of table")
    table = _table(study, path)
    gone = {name: value for name, value in table.items() if name != key and name not in node["properties"]}
    edits: list[Edit] = [Unset((*path, name)) for name in gone]
    if kind is not None:
        edits.insert(0, Set((*path, key), kind))
    elif key in table:
        edits.insert(0, Unset((*path, key)))
    after, _ = study.edited(*edits)
    wanted = [name for name in left if name in node["properties"] and name not in table]
    edits += [Set((*path, name), left[name]) for name in wanted]
    needed = [name for name in node.get("required", ()) if name not in {*table, *wanted, key}]
    edits += [Set((*path, name), initial(after.document, (*path, name))) for name in needed]
    return tuple(edits), gone


def _table(study: Study, path: Path) -> Mapping[str, Any]:
    value: Any = study.document
    for step in path:
        value = value[step] if has(value, step) else {}
    return value if isinstance(value, Mapping) else {}


def with_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that add a language: plain texts become tables, whose new texts are missing."""
    there = languages_of(study.document)
    if code in there:
        raise Refused(f"the study is in {language_name(code)} already")
    if code not in LANGUAGES:
        raise Refused(f'the program has no words in "{code}": there are {", ".join(LANGUAGES)}')
    tables = (Set(path, {there[0]: text}) for path, text in texts_of(study) if isinstance(text, str))
    return (Set(("study", "languages"), [*there, code]), *tables)


def without_language(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that remove a language and its texts."""
    there = languages_of(study.document)
    if code not in there or len(there) == 1:
        raise Refused("a study has at least one language")
    gone = (Unset((*path, code)) for path, text in texts_of(study) if isinstance(text, Mapping) and code in text)
    return (*gone, Set(("study", "languages"), [one for one in there if one != code]))


def filled_in(study: Study, code: str) -> tuple[Edit, ...]:
    """Return the edits that copy the first language's texts to missing texts of a language."""
    first = languages_of(study.document)[0]
    found: list[Edit] = []
    for path, text in texts_of(study):
        if isinstance(text, Mapping) and code not in text and first in text:
            found.append(Set((*path, code), (list(text[first]) if isinstance(text[first], tuple) else text[first])))
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


def moved(study: Study, entries: Sequence[Path], to: int) -> tuple[tuple[Edit, ...], tuple[Path, ...]]:
    """Return the edits that move entries of a list, in their order, before the entry ``to``, and their new paths.

    ``to`` counts before the move; the length of the list stands for its end. Parts of the study are renumbered if they
    were numbered correctly before.
    """
    places = sorted({entry[:-1] for entry in entries}, key=str)
    if len(places) != 1:
        raise Refused("these elements are in several lists: only neighbours of one list move together")
    place = places[0]
    indices = sorted({int(entry[-1]) for entry in entries})
    before = [index for index in indices if index < to]
    after = [index for index in indices if index >= to]
    moves: list[Edit] = []
    for done, index in enumerate(before):
        if index - done != to - 1:
            moves.append(Move((*place, index - done), to - 1))
    moves += [Move((*place, index), to + done) for done, index in enumerate(after) if index != to + done]
    first = to - len(before)
    paths = tuple((*place, first + number) for number in range(len(indices)))
    return (*moves, *_renumbered(study, place, moves)), paths


def _renumbered(study: Study, place: Path, moves: Sequence[Edit]) -> tuple[Edit, ...]:
    """Return the edits that number the parts of the session 1, 2 … again."""
    if place != ("sequence",) or not moves or any(fault.path[2:] == ("part",) for fault in study.faults):
        return ()
    after, _ = study.edited(*moves)
    blocks: Any = after.document.get("blocks", {})
    edits: list[Edit] = []
    old = number = 0
    for name in after.document["sequence"]:
        part = blocks[name].get("part") if has(blocks, name) else None
        if not isinstance(part, int):
            continue
        number += part != old
        old = part
        if part != number:
            edits.append(Set(("blocks", name, "part"), number))
    return tuple(edits)


LONGEST: Final = 40


def short_of(text: str) -> str:
    """Return the initial short text of a question: the beginning of its text."""
    return " ".join(text.split())[:LONGEST].rstrip(" ?.!:")


def followed(study: Study, path: Path, language: str, text: str) -> tuple[Edit, ...]:
    """Return the edit of the short text of a question whose text is typed; none if it was edited separately."""
    place = (*path[:-1], "short")
    before, short = value_at(study.document, path), value_at(study.document, place)
    if path[-1] != "text" or isinstance(before, Mapping) != isinstance(short, Mapping):
        return ()
    old, own = _in(before, language), _in(short, language)
    if old is None or own is None or own != short_of(old):
        return ()
    return (Set((*place, language) if isinstance(short, Mapping) else place, short_of(text)),)


def _in(value: Any, language: str) -> str | None:
    found = value.get(language) if isinstance(value, Mapping) else value
    return found if isinstance(found, str) else None
