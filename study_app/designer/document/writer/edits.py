"""Edits of a study: what each means for the document, and how it is written into the text.

An edit is refused with a sentence where it makes no sense. After its splices are applied, the text is read again and
compared with what was meant; a difference is a bug of the writer, and nothing is changed.
"""

import copy
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

from study_app.designer.document.writer import arrays, keys
from study_app.designer.document.writer.refused import Refused
from study_app.designer.document.writer.spans import Spans, spans_of
from study_app.designer.document.writer.splices import Editor, Splices, applied
from study_app.designer.document.writer.values import written
from study_app.protocol.source.document import Path

Document: TypeAlias = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Set:
    """Give a key or entry a value; a key that is missing is added, with the tables it is in, after ``after``."""

    path: Path
    value: Any
    after: str | None = None


@dataclass(frozen=True, slots=True)
class Unset:
    """Remove a key, table or entry."""

    path: Path


@dataclass(frozen=True, slots=True)
class Insert:
    """Insert an entry into an array, at the index that ends ``path``."""

    path: Path
    value: Any


@dataclass(frozen=True, slots=True)
class Duplicate:
    """Copy a table or entry right after itself; a table under the name ``name``."""

    path: Path
    name: str = ""


@dataclass(frozen=True, slots=True)
class Move:
    """Move an entry of an array to the index ``to``."""

    path: Path
    to: int


@dataclass(frozen=True, slots=True)
class Rename:
    """Give a table another name; ``references`` are the places of texts that name it and follow."""

    path: Path
    name: str
    references: tuple[Path, ...] = ()


Edit: TypeAlias = Set | Unset | Insert | Duplicate | Move | Rename


class WriterError(AssertionError):
    """The text that an edit produced does not mean what the edit meant: a bug of the writer."""


def apply(text: str, edit: Edit) -> tuple[str, tuple[Splices, ...]]:
    """Return the text after an edit, and the splices of its steps, each of the text before it.

    Raises
    ------
    Refused
        The edit makes no sense in this text.
    WriterError
        The edit was written wrongly; this is a bug.
    """
    document = _read(text)
    meant = meaning(document, edit)
    steps: list[Splices] = []
    parts = list(_parts(document, edit))
    while parts:
        part = parts.pop(0)
        spans, editor = spans_of(text), Editor(text)
        if isinstance(part, Set) and _written_apart(spans, part.path):
            parts = [Unset(part.path), part, *parts]
            continue
        _write(spans, editor, part)
        if editor.splices:
            steps.append(editor.splices)
            text = applied(text, editor.splices)
    try:
        found = _read(text)
    except tomllib.TOMLDecodeError as error:
        raise WriterError(f"{edit} made a text that is not TOML: {error}") from error
    if not same(found, meant) and not same(_pruned(copy.deepcopy(found), edit.path), _pruned(meant, edit.path)):
        raise WriterError(f"{edit} made another document than the one meant")
    return text, tuple(steps)


@lru_cache(maxsize=4)
def _read(text: str) -> Document:
    """Return the document of a text, which must not be changed."""
    return tomllib.loads(text)


def meaning(document: Mapping[str, Any], edit: Edit) -> Document:
    """Return the document that an edit means; what it does not change is shared with the document before.

    Raises
    ------
    Refused
        The edit makes no sense in this document.
    """
    found: Document = dict(document)
    *parent, last = edit.path
    if isinstance(edit, Set):
        _check_value(edit.value)
        node = _own(found, parent, makes=True)
        if isinstance(node, list):
            _at(node, last)
        elif not isinstance(node, dict):
            raise Refused(f"{_words(tuple(parent))} is not a table: it has no key {last}")
        node[last] = copy.deepcopy(edit.value)
        return found
    node = _own(found, parent)
    if isinstance(edit, Insert):
        _check_value(edit.value)
        if not isinstance(node, list) or not isinstance(last, int) or not 0 <= last <= len(node):
            raise Refused(f"{_words(tuple(parent))} has no place {last} for a new entry")
        node.insert(last, copy.deepcopy(edit.value))
        return found
    value = _at(node, last)
    if isinstance(edit, Unset):
        del node[last]
    elif isinstance(edit, Duplicate):
        _duplicate(node, last, value, edit.name)
    elif isinstance(edit, Move):
        if not isinstance(node, list) or not isinstance(last, int) or not 0 <= edit.to < len(node):
            raise Refused(f"{_words(edit.path)} cannot move to place {edit.to + 1}")
        node.insert(edit.to, node.pop(last))
    else:
        _rename(found, node, edit)
    return found


def _own(document: Document, path: Iterable[str | int], *, makes: bool = False) -> Any:
    """Return what is at a path as the document's own: tables and arrays on the way are copied, the rest is shared."""
    node: Any = document
    for step in path:
        inner = {} if makes and isinstance(node, dict) and step not in node else _at(node, step)
        node[step] = dict(inner) if isinstance(inner, dict) else list(inner) if _is_array(inner) else inner
        node = node[step]
    return node


def same(one: Any, other: Any) -> bool:
    """Return whether two values are the same in TOML: 1, 1.0 and true differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(same(*pair) for pair in zip(one, other, strict=True))
    return type(one) is type(other) and (one == other or (one != one and other != other))  # noqa: PLR0124 - NaN


def _duplicate(node: Any, last: Any, value: Any, name: str) -> None:
    if isinstance(node, list):
        node.insert(last + 1, copy.deepcopy(value))
        return
    _check_free(node, name)
    node[name] = copy.deepcopy(value)


def _rename(found: Document, node: Any, edit: Rename) -> None:
    if not isinstance(node, dict):
        raise Refused("entries of an array have no name")
    _check_free(node, edit.name)
    for *parent, last in edit.references:
        _own(found, parent)[last] = edit.name
    node = _own(found, edit.path[:-1])
    node[edit.name] = node.pop(edit.path[-1])


def _check_free(node: Mapping[str, Any], name: str) -> None:
    if name in node:
        raise Refused(f'the name "{name}" is taken: choose another one')


def _check_value(value: Any) -> None:
    if isinstance(value, Mapping):
        for key, part in value.items():
            _check_value(key)
            _check_value(part)
    elif isinstance(value, list | tuple):
        for part in value:
            _check_value(part)
    elif value is None:
        raise Refused("a value cannot be empty: remove the key")
    elif isinstance(value, str):
        check_encodable(value)


def check_encodable(text: str) -> None:
    """Refuse a text that UTF-8 cannot write.

    Raises
    ------
    Refused
        It holds half of a character that needs two units of UTF-16.
    """
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise Refused("the text holds half a character, which UTF-8 cannot write: type it again")


def _at(node: Any, step: str | int) -> Any:
    if not _has(node, step):
        raise Refused(f"there is no {step + 1 if isinstance(step, int) else step} in the study any more")
    return node[step]


def _has(node: Any, step: str | int) -> bool:
    if _is_array(node):
        return isinstance(step, int) and 0 <= step < len(node)
    return isinstance(node, dict) and step in node


def _is_array(node: Any) -> bool:
    return isinstance(node, list | tuple)


def _words(path: Path) -> str:
    return ".".join(str(step + 1) if isinstance(step, int) else step for step in path) or "the file"


def _parts(document: Document, edit: Edit) -> Iterator[Edit]:
    """Yield edits that are one step of writing each."""
    if not isinstance(edit, Set):
        yield edit
        return
    node: Any = document
    for depth, step in enumerate(edit.path):
        if isinstance(node, dict) and step not in node:
            value = edit.value
            for missing in reversed(edit.path[depth + 1 :]):
                value = {missing: value}
            yield Set(edit.path[: depth + 1], value, edit.after if depth == len(edit.path) - 1 else None)
            return
        node = node[step]
    yield from _changes(edit.path, node, edit.value)


def _changes(path: Path, old: Any, new: Any) -> Iterator[Edit]:
    """Yield the fewest edits that turn one value into another; what stays keeps its place and comments."""
    if same(old, new):
        return
    if isinstance(old, dict) and isinstance(new, Mapping) and new:
        for key in [key for key in new if key in old]:
            yield from _changes((*path, key), old[key], new[key])
        previous = None
        for key in new:
            if key not in old:
                yield Set((*path, key), new[key], previous)
            previous = key
        yield from (Unset((*path, key)) for key in old if key not in new)
    elif isinstance(old, list) and isinstance(new, list | tuple) and old and new:
        yield from _list_changes(path, old, list(new))
    else:
        yield Set(path, new)


def _list_changes(path: Path, old: list[Any], new: list[Any]) -> Iterator[Edit]:
    shortest, first = min(len(old), len(new)), 0
    while first < shortest and same(old[first], new[first]):
        first += 1
    last = 0
    while last < shortest - first and same(old[-1 - last], new[-1 - last]):
        last += 1
    for index in range(first, shortest - last):
        yield from _changes((*path, index), old[index], new[index])
    for index in range(shortest - last, len(new) - last):
        yield Insert((*path, index), new[index])
    for index in reversed(range(shortest - last, len(old) - last)):
        yield Unset((*path, index))


def _write(spans: Spans, editor: Editor, edit: Edit) -> None:
    path = edit.path
    if isinstance(edit, Insert):
        arrays.insert(spans, editor, path, edit.value)
    elif isinstance(edit, Move):
        arrays.move(spans, editor, path, edit.to)
    elif isinstance(edit, Rename):
        keys.rename(spans, editor, path, edit.name)
        for reference in edit.references:
            if (node := spans.node(reference)) is not None:
                editor.replace(node.value, node.end, written(edit.name, spans.text[node.value : node.end]))
    elif isinstance(edit, Duplicate):
        if isinstance(path[-1], int):
            arrays.copy(spans, editor, path)
        else:
            keys.copy(spans, editor, path, edit.name)
    elif isinstance(edit, Unset):
        (arrays if isinstance(path[-1], int) else keys).remove(spans, editor, path)
    elif spans.node(path) is None:
        keys.add(spans, editor, path, edit.value, edit.after)
    else:
        keys.replace(spans, editor, path, edit.value)


def _written_apart(spans: Spans, path: Path) -> bool:
    """Return whether a value is written with headers or dotted keys, so that another one cannot be put in its place."""
    node = spans.node(path)
    apart = node.kind in {"table", "array table"} if node is not None else bool(spans.pieces(path))
    if apart and isinstance(path[-1], int):
        raise Refused(f"{_words(path)} is a table with a header: it cannot become a value")
    return apart


def _pruned(document: Document, path: Path) -> Document:
    """Return a document without the tables and arrays around ``path`` that hold nothing: TOML may not write them."""
    for length in range(len(path), 0, -1):
        node: Any = document
        for step in path[: length - 1]:
            node = node[step] if _has(node, step) else None
        if isinstance(node, dict) and node.get(path[length - 1]) in ({}, []):
            del node[path[length - 1]]
    return document
