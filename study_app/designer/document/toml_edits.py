"""Edits of keys, tables, array entries and values in a TOML text, as splices."""

import copy
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, TypeAlias

from study_app.designer.document.toml_text import (
    INDENT,
    WIDTH,
    Editor,
    Piece,
    Refused,
    Slot,
    Spans,
    Splices,
    apply_splices,
    common_ends,
    inline_value,
    key_text,
    spans_of,
    table_text,
    toml_value,
)
from study_app.protocol.source import Node, Path

_PADDING: Final = re.compile(r"([ \t]+)#")
_COMMA: Final = re.compile(r"[ \t]*,[ \t]*")
_BLANK_LINE: Final = re.compile(r"[ \t]*(?:\r?\n|\Z)")


def _replace_value(spans: Spans, edit: Editor, path: Path, value: Any) -> None:
    """Replace the value at ``path``; a comment after it keeps its column if possible."""
    node = spans.node(path)
    if node is None or node.kind in {"table", "array table"}:
        raise Refused("a table with headers cannot be replaced with a single value")
    text, old_text = spans.text, spans.text[node.value : node.end]
    line = text.rfind("\n", 0, node.start) + 1
    indent = re.match(r"[ \t]*", text[line:]).group()  # type: ignore[union-attr]
    column = node.value - line
    on_own_line = node.kind == "key"
    if on_own_line and isinstance(value, Mapping) and value and column + len(inline_value(value)) > WIDTH:
        key = text[node.parts[0][0] : node.parts[-1][1]]
        rows = (f"{key}.{key_text(name)} = {toml_value(part, newline=spans.newline)}" for name, part in value.items())
        edit.replace(node.start, node.end, f"{spans.newline}{indent}".join(rows))
        return
    new_text = (
        inline_value(value) if node.kind == "pair" else toml_value(value, old_text, spans.newline, indent, column)
    )
    edit.replace(node.value, node.end, new_text)
    padding = _PADDING.match(text, node.end)
    if padding and "\n" not in old_text + new_text:
        padding_width = len(padding.group(1))
        new_width = max(padding_width + len(old_text) - len(new_text), min(padding_width, 2))
        edit.replace(*padding.span(1), padding.group(1) if new_width == padding_width else " " * new_width)


def _add_key(spans: Spans, edit: Editor, path: Path, value: Any, after: str | None = None) -> None:
    """Add a missing key to an existing table; ``after`` names the key or table before it."""
    parent, pieces = path[:-1], spans.pieces(path[:-1])
    owner = spans.node(parent)
    if parent and not pieces:
        _add_key(spans, edit, parent, {path[-1]: value})
    elif owner is not None and owner.kind in {"key", "pair", "entry"}:
        _add_pair(spans, edit, owner, path, value)
    elif parent and owner is None and (dotted := [piece for piece in pieces if piece.node.kind in {"key", "pair"}]):
        _add_dotted(spans, edit, dotted[-1], path, value)
    elif _needs_header(spans, path, value):
        _add_table(spans, edit, path, value, after)
    elif parent and owner is None:
        body = table_text(parent, {path[-1]: value}, spans.newline)  # type: ignore[dict-item]
        edit.insert(pieces[0].start, body + spans.newline)
    else:
        _add_line(spans, edit, owner, path, value, after)


def _needs_header(spans: Spans, path: Path, value: Any) -> bool:
    """Return whether a new table gets a header: next to tables with headers, at the root, or if it is too long."""
    if isinstance(value, list | tuple):
        if not value or not all(isinstance(entry, Mapping) and entry for entry in value):
            return False
    elif not isinstance(value, Mapping):
        return False
    fits = len(key_text(str(path[-1]))) + 3 + len(inline_value(value)) <= WIDTH
    parent_depth = len(path) - 1
    has_neighbours = any(
        len(node.path) > parent_depth and node.path[:parent_depth] == path[:-1] for node in spans.headers()
    )
    return not fits or len(path) == 1 or (has_neighbours and isinstance(value, Mapping))


def _add_table(spans: Spans, edit: Editor, path: Path, value: Any, after: str | None) -> None:
    is_array = isinstance(value, list | tuple)
    rows = value if is_array else [value]
    body = spans.newline.join(table_text(path, row, spans.newline, entry=is_array) for row in rows)
    pieces = _header_pieces(spans, (*path[:-1], after)) if after is not None else []
    pieces = pieces or (_header_pieces(spans, path[:-1]) if len(path) > 1 else [])
    _insert_block(spans, edit, pieces[-1].end if pieces else len(spans.text), body)


def _header_pieces(spans: Spans, path: Path) -> list[Piece]:
    return [piece for piece in spans.pieces(path) if piece.node.kind in {"table", "array table"}]


def _insert_block(spans: Spans, edit: Editor, position: int, body: str) -> None:
    """Insert whole lines after the piece that ends at ``position``, with blank lines around them as needed."""
    text, newline = spans.text, spans.newline
    before = text[:position]
    opening = "" if not before.strip() else newline if before.endswith("\n") else newline * 2
    if before.endswith(newline * 2):
        opening = ""
    closing = "" if _BLANK_LINE.match(text, position) else newline
    if position == len(text) and before and not before.endswith("\n"):
        body = body.removesuffix(newline)
    edit.insert(position, opening + body + closing)


def _insert_lines(spans: Spans, edit: Editor, position: int, lines: str) -> None:
    """Insert whole lines; a text without a final line break stays without one."""
    if position and not spans.text[:position].endswith("\n"):
        lines = spans.newline + lines.removesuffix(spans.newline)
    edit.insert(position, lines)


def _add_line(spans: Spans, edit: Editor, owner: Node | None, path: Path, value: Any, after: str | None) -> None:
    section = list(spans.section(owner))
    depth = len(path)
    named = [node for node in section if after is not None and node.path[:depth] == (*path[:-1], after)]
    last = named[-1] if named else section[-1] if section else owner
    key = f"{key_text(str(path[-1]))} = "
    if last is None:
        first = next(spans.headers(), None)
        position = len(spans.text) if first is None else spans.owned_start(first)
        line = f"{key}{toml_value(value, newline=spans.newline, column=len(key))}{spans.newline}"
        _insert_lines(spans, edit, position, line if first is None else line + spans.newline)
        return
    line_start = spans.text.rfind("\n", 0, last.start) + 1
    indent = spans.text[line_start : last.start]
    line = f"{indent}{key}{toml_value(value, '', spans.newline, indent, len(indent + key))}{spans.newline}"
    _insert_lines(spans, edit, spans.line_end(last), line)


def _add_pair(spans: Spans, edit: Editor, owner: Node, path: Path, value: Any) -> None:
    owner_pieces = [piece for piece in spans.pieces(path[:-1])[:1] if piece.node is owner]
    if not owner_pieces or spans.text[owner.value] != "{":
        raise Refused("only a table can have keys")
    pair = f"{key_text(str(path[-1]))} = {inline_value(value)}"
    pairs = [node for node in spans.nodes if node.kind == "pair" and owner.value < node.start < owner.end]
    own_pairs = [node for node in pairs if len(node.path) - len(node.parts) == len(path) - 1]
    if own_pairs:
        edit.insert(own_pairs[-1].end, f", {pair}")
    else:
        edit.replace(owner.value, owner.end, f"{{ {pair} }}")


def _add_dotted(spans: Spans, edit: Editor, piece: Piece, path: Path, value: Any) -> None:
    """Add a key to a table written with dotted keys: after the last one, with the same prefix."""
    node, text = piece.node, spans.text
    parts = node.parts[: len(path) - 1 - (len(node.path) - len(node.parts))]
    key = f"{text[parts[0][0] : parts[-1][1]]}.{key_text(str(path[-1]))} = "
    if node.kind == "pair":
        edit.insert(node.end, f", {key}{inline_value(value)}")
        return
    indent = text[text.rfind("\n", 0, node.start) + 1 : node.start]
    like = text[node.value : node.end]
    value_text = toml_value(value, like, spans.newline, indent, len(indent + key))
    _insert_lines(spans, edit, piece.end, f"{indent}{key}{value_text}{spans.newline}")


def _remove_key(spans: Spans, edit: Editor, path: Path) -> None:
    """Remove a key or table with its comments, and the preceding blank line if two would remain."""
    for piece in spans.pieces(path):
        if piece.node.kind == "pair":
            _remove_pair(spans, edit, piece)
        else:
            edit.delete(_deletion_start(spans.text, piece), piece.end)


def _deletion_start(text: str, piece: Piece) -> int:
    """Return the start of a deletion, including the blank lines above if a blank line or the end follows."""
    start = piece.start
    if not _BLANK_LINE.match(text, piece.end):
        return start
    while start and not text[(above := text.rfind("\n", 0, start - 1) + 1) : start].strip():
        start = above
    return start


def _remove_pair(spans: Spans, edit: Editor, piece: Piece) -> None:
    comma = _COMMA.match(spans.text, piece.end)
    if comma:
        edit.delete(piece.start, comma.end())
        return
    before = spans.text[: piece.start].rstrip(" \t")
    edit.delete(len(before[:-1].rstrip(" \t")) if before.endswith(",") else piece.start, piece.end)


def _copy_table(spans: Spans, edit: Editor, path: Path, name: str) -> None:
    """Copy a key or table with its comments under another name, right after it."""
    pieces = spans.pieces(path)
    copies = [_renamed_text(spans, piece, len(path) - 1, name) for piece in pieces]
    last = pieces[-1]
    if last.node.kind == "pair":
        edit.insert(last.end, "".join(f", {text}" for text in copies))
    elif all(piece.node.kind == "key" for piece in pieces):
        _insert_lines(spans, edit, last.end, "".join(copies))
    else:
        _insert_block(spans, edit, last.end, spans.newline.join(copies))


def _renamed_text(spans: Spans, piece: Piece, depth: int, name: str) -> str:
    """Return the lines of a piece with another name for the step at ``depth`` of its paths."""
    editor = Editor(spans.text)
    for start, end in _key_spans(spans, piece.node.path[: depth + 1]):
        if piece.start <= start < piece.end:
            editor.replace(start, end, key_text(name))
    text, position = "", piece.start
    for splice in editor.splices:
        text += spans.text[position : splice.start] + splice.after
        position = splice.start + len(splice.before)
    text += spans.text[position : piece.end]
    return text if piece.node.kind == "pair" or text.endswith("\n") else text + spans.newline


def _key_spans(spans: Spans, path: Path) -> Iterator[tuple[int, int]]:
    """Yield the positions of a path's last step in headers and keys."""
    depth = len(path) - 1
    for node in spans.nodes:
        if node.path[: depth + 1] != path or not node.parts:
            continue
        if node.kind in {"table", "array table"}:
            yield node.parts[sum(isinstance(step, str) for step in path) - 1]
        elif (place := depth - (len(node.path) - len(node.parts))) >= 0:
            yield node.parts[place]


_TO_COMMA: Final = re.compile(r"(?:[ \t\r\n]|#[^\n]*+)*+,")
_LINE_REST: Final = re.compile(r"[ \t]*(\r?\n)")


def _array_and_index(path: Path) -> tuple[Path, int]:
    index = path[-1]
    if not isinstance(index, int):
        raise Refused("entries of an array are identified by number")
    return path[:-1], index


def _insert_entry(spans: Spans, edit: Editor, path: Path, value: Any) -> None:
    """Insert an entry into an existing array at the index that ends ``path``."""
    array, index = _array_and_index(path)
    node = spans.node(array)
    if node is None:
        _insert_table(spans, edit, path, value)
        return
    slots = spans.slots(array)
    if not slots:
        edit.insert(node.end - 1, inline_value(value))
    elif index < len(slots):
        slot = slots[index]
        on_own_line = slot.own_line
        edit.insert(
            slot.start,
            f"{_indent(spans, slot)}{inline_value(value)},{spans.newline}"
            if on_own_line
            else f"{inline_value(value)}, ",
        )
    elif slots[-1].own_line:
        _append_lines(spans, edit, slots[-1], inline_value(value))
    elif _fits_line(spans, node.start, node.end, value):
        edit.insert(slots[-1].end, f", {inline_value(value)}")
    else:
        _spread_array(spans, edit, array, slots, inline_value(value))


def _fits_line(spans: Spans, start: int, end: int, value: Any) -> bool:
    line = spans.text.rfind("\n", 0, start) + 1
    return "\n" in spans.text[start:end] or end - line + len(inline_value(value)) + 2 <= WIDTH


def _spread_array(spans: Spans, edit: Editor, array: Path, slots: list[Slot], value: str) -> None:
    """Write an array that becomes too long for its line with one entry per line."""
    node = spans.node(array)
    if node is None:
        return
    line = spans.text.rfind("\n", 0, node.start) + 1
    indent = re.match(r"[ \t]*", spans.text[line:]).group()  # type: ignore[union-attr]
    entries = [*(spans.text[slot.entry : slot.end] for slot in slots), value]
    rows = "".join(f"{indent}{INDENT}{entry},{spans.newline}" for entry in entries)
    edit.replace(node.value, node.end, f"[{spans.newline}{rows}{indent}]")


def _indent(spans: Spans, slot: Slot) -> str:
    return re.match(r"[ \t]*", spans.text[spans.text.rfind("\n", 0, slot.entry) + 1 :]).group()  # type: ignore[union-attr]


def _append_lines(spans: Spans, edit: Editor, last: Slot, body: str, tail: str = "") -> None:
    """Add lines after the one on which an entry ends, after its comment; add a missing comma."""
    newline = spans.newline
    comma = _TO_COMMA.match(spans.text, last.end)
    if comma is None:
        edit.insert(last.end, ",")
        edit.insert(last.tail_end, f"{newline}{_indent(spans, last)}{body}{tail}")
        return
    edit.insert(max(comma.end(), last.tail_end), f"{newline}{_indent(spans, last)}{body},{tail}")


def _insert_table(spans: Spans, edit: Editor, path: Path, value: Any) -> None:
    array, index = _array_and_index(path)
    if not isinstance(value, Mapping):
        raise Refused("each entry in an array of tables must be a table")
    body = table_text(path, value, spans.newline, entry=True)
    if following := spans.pieces((*array, index)):
        edit.insert(following[0].start, body + spans.newline)
    else:
        _insert_block(spans, edit, spans.pieces(array)[-1].end, body)


def _remove_entry(spans: Spans, edit: Editor, path: Path) -> None:
    """Remove an entry with its comments."""
    array, index = _array_and_index(path)
    if spans.node(array) is None:
        for piece in spans.pieces(path):
            edit.delete(_deletion_start(spans.text, piece), piece.end)
        return
    text, slots = spans.text, spans.slots(array)
    slot, last = slots[index], index == len(slots) - 1
    comma = _TO_COMMA.match(text, slot.end)
    if comma is None and index and not text[slots[index - 1].end : slot.entry].strip(", \t"):
        edit.delete(slots[index - 1].end, slot.tail_end)  # with the comma before it, on one line
        return
    if comma is not None and comma.end() > slot.tail:  # the comma stands on a later line
        edit.delete(comma.end() - 1, comma.end())
    line = _LINE_REST.match(text, slot.tail_end)
    if slot.own_line and line:
        edit.delete(slot.start, line.end())
        return
    space = "" if last or slot.tail_end > slot.tail else re.match(r"[ \t]*", text[slot.tail_end :]).group()  # type: ignore[union-attr]
    start = slot.start if text[slot.start : slot.entry].strip() else slot.entry
    edit.delete(start, slot.tail_end + len(space))


def _copy_entry(spans: Spans, edit: Editor, path: Path) -> None:
    """Copy an entry with its comments, right after it."""
    array, index = _array_and_index(path)
    text, newline = spans.text, spans.newline
    if spans.node(array) is None:
        pieces = spans.pieces(path)
        copies = (_whole_lines(text, piece, newline) for piece in pieces)
        _insert_block(spans, edit, pieces[-1].end, newline.join(copies))
        return
    slots = spans.slots(array)
    slot = slots[index]
    tail = text[slot.tail : slot.tail_end]
    if not slot.own_line and not tail:
        edit.insert(slot.end, f", {text[slot.entry : slot.end]}")
    elif slot.own_line and index < len(slots) - 1:
        edit.insert(slots[index + 1].start, f"{text[slot.start : slot.end]},{tail}{newline}")
    else:  # the comment behind it ends the line
        _append_lines(spans, edit, slot, text[slot.start : slot.end].lstrip(" \t"), tail)


def _whole_lines(text: str, piece: Piece, newline: str) -> str:
    lines = text[piece.start : piece.end]
    return lines if lines.endswith("\n") else lines + newline


def _move_entry(spans: Spans, edit: Editor, path: Path, to: int) -> None:
    """Move an entry with its comments to another index."""
    array, index = _array_and_index(path)
    order = list(range(max(index, to) + 1))
    order.insert(to, order.pop(index))
    if spans.node(array) is None:
        _move_table(spans, edit, array, order)
        return
    text, slots = spans.text, spans.slots(array)
    for place, source in enumerate(order):
        if place == source:
            continue
        old, new = slots[place], slots[source]
        body, tail = text[new.start : new.end], text[new.tail : new.tail_end]
        if old.own_line and not new.own_line:
            body = _indent(spans, old) + body
        elif new.own_line and not old.own_line:
            body = body.lstrip(" \t")
        edit.replace(old.start, old.end, body)
        if tail and not _LINE_REST.match(text, old.tail_end):
            tail += spans.newline
        edit.replace(old.tail, old.tail_end, tail)


def _move_table(spans: Spans, edit: Editor, array: Path, order: list[int]) -> None:
    """Reorder the entries of an array of tables."""
    text = spans.text
    pieces = [spans.pieces((*array, index)) for index in range(len(order))]
    for place, source in enumerate(order):
        if place == source:
            continue
        body = spans.newline.join(_whole_lines(text, piece, spans.newline) for piece in pieces[source])
        first, *others = pieces[place]
        if not text[first.start : first.end].endswith("\n"):
            body = body.removesuffix(spans.newline)
        edit.replace(first.start, first.end, body)
        for piece in others:
            edit.delete(_deletion_start(text, piece), piece.end)


Document: TypeAlias = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Set:
    """Set the value of a key or entry; a missing key is added after ``after``, with missing parent tables."""

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
    """Copy a table or entry right after itself; a table gets the name ``name``."""

    path: Path
    name: str = ""


@dataclass(frozen=True, slots=True)
class Move:
    """Move an entry of an array to the index ``to``."""

    path: Path
    to: int


@dataclass(frozen=True, slots=True)
class Rename:
    """Rename a table, and change the texts at the paths ``references``, which refer to it."""

    path: Path
    name: str
    references: tuple[Path, ...] = ()


Edit: TypeAlias = Set | Unset | Insert | Duplicate | Move | Rename


class WriterError(AssertionError):
    """The edited text does not have the intended meaning, which is a bug in this module."""


def apply_edit(text: str, edit: Edit) -> tuple[str, tuple[Splices, ...]]:
    """Return the text after an edit, and its splices, each relative to the text after the previous ones.

    Raises Refused if the edit is not possible, and WriterError if the text does not have the intended meaning.
    """
    document = _parse(text)
    intended = intended_document(document, edit)
    steps: list[Splices] = []
    parts = list(_single_edits(document, edit))
    while parts:
        single_edit = parts.pop(0)
        spans, editor = spans_of(text), Editor(text)
        if isinstance(single_edit, Set) and _has_headers_or_dotted_keys(spans, single_edit.path):
            parts = [Unset(single_edit.path), single_edit, *parts]
            continue
        _write_edit(spans, editor, single_edit)
        if editor.splices:
            steps.append(editor.splices)
            text = apply_splices(text, editor.splices)
    try:
        edited = _parse(text)
    except tomllib.TOMLDecodeError as error:
        raise WriterError(f"{edit} produced invalid TOML: {error}") from error
    if not is_same_value(edited, intended) and not is_same_value(
        _prune_empty_tables(copy.deepcopy(edited), edit.path), _prune_empty_tables(intended, edit.path)
    ):
        raise WriterError(f"{edit} did not produce the intended document")
    return text, tuple(steps)


@lru_cache(maxsize=4)
def _parse(text: str) -> Document:
    """Return the document of a text; it must not be changed."""
    return tomllib.loads(text)


def intended_document(document: Mapping[str, Any], edit: Edit) -> Document:
    """Return the document after an edit; unchanged parts are shared with the previous document."""
    intended: Document = dict(document)
    *parent, last = edit.path
    if isinstance(edit, Set):
        _check_value(edit.value)
        node = _private_copy(intended, parent, creates_missing=True)
        if isinstance(node, list) or isinstance(last, int):
            _value_at(node, last)
        elif not isinstance(node, dict):
            raise Refused(f"{_path_text(tuple(parent))} is not a table, so it cannot have the key {last}")
        node[last] = copy.deepcopy(edit.value)
        return intended
    node = _private_copy(intended, parent)
    if isinstance(edit, Insert):
        _check_value(edit.value)
        if not isinstance(node, list) or not isinstance(last, int) or not 0 <= last <= len(node):
            raise Refused(f"a new entry cannot be inserted at position {last} of {_path_text(tuple(parent))}")
        node.insert(last, copy.deepcopy(edit.value))
        return intended
    value = _value_at(node, last)
    if isinstance(edit, Unset):
        del node[last]
    elif isinstance(edit, Duplicate):
        _duplicate(node, last, value, edit.name)
    elif isinstance(edit, Move):
        if not isinstance(node, list) or not isinstance(last, int) or not 0 <= edit.to < len(node):
            raise Refused(f"{_path_text(edit.path)} cannot be moved to position {edit.to + 1}")
        node.insert(edit.to, node.pop(last))
    else:
        _rename(intended, node, edit)
    return intended


def _private_copy(document: Document, path: Iterable[str | int], *, creates_missing: bool = False) -> Any:
    """Copy the tables and arrays along a path, and return the copied value at its end; other values are shared."""
    node: Any = document
    for step in path:
        is_missing = isinstance(node, dict) and isinstance(step, str) and step not in node
        value = {} if creates_missing and is_missing else _value_at(node, step)
        node[step] = dict(value) if isinstance(value, dict) else list(value) if _is_array(value) else value
        node = node[step]
    return node


def is_same_value(first: Any, other: Any) -> bool:
    """Return whether two values are the same in TOML: 1, 1.0 and true differ."""
    if isinstance(first, dict) and isinstance(other, dict):
        return first.keys() == other.keys() and all(is_same_value(first[key], other[key]) for key in first)
    if isinstance(first, list | tuple) and isinstance(other, list | tuple):
        return len(first) == len(other) and all(is_same_value(*pair) for pair in zip(first, other, strict=True))
    return type(first) is type(other) and (first == other or (first != first and other != other))  # noqa: PLR0124 - NaN


def _duplicate(node: Any, last: Any, value: Any, name: str) -> None:
    if isinstance(node, list):
        node.insert(last + 1, copy.deepcopy(value))
        return
    _check_free(node, name)
    node[name] = copy.deepcopy(value)


def _rename(document: Document, node: Any, edit: Rename) -> None:
    if not isinstance(node, dict):
        raise Refused("entries of an array do not have names")
    _check_free(node, edit.name)
    for *parent, last in edit.references:
        _private_copy(document, parent)[last] = edit.name
    node = _private_copy(document, edit.path[:-1])
    node[edit.name] = node.pop(edit.path[-1])


def _check_free(node: Mapping[str, Any], name: str) -> None:
    if name in node:
        raise Refused(f'the name "{name}" is already taken: choose a different one')


def _check_value(value: Any) -> None:
    if isinstance(value, Mapping):
        for key, part in value.items():
            _check_value(key)
            _check_value(part)
    elif isinstance(value, list | tuple):
        for part in value:
            _check_value(part)
    elif value is None:
        raise Refused("a value cannot be empty: remove its key instead")
    elif isinstance(value, str):
        check_encodable(value)


def check_encodable(text: str) -> None:
    """Reject a text that cannot be encoded in UTF-8."""
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise Refused("the text contains an incomplete character, which UTF-8 cannot encode: type it again")


def _value_at(node: Any, step: str | int) -> Any:
    if not _has_step(node, step):
        raise Refused(f"the study no longer contains {f'entry {step + 1}' if isinstance(step, int) else step}")
    return node[step]


def _has_step(node: Any, step: str | int) -> bool:
    if _is_array(node):
        return isinstance(step, int) and 0 <= step < len(node)
    return isinstance(node, dict) and step in node


def _is_array(node: Any) -> bool:
    return isinstance(node, list | tuple)


def _path_text(path: Path) -> str:
    return ".".join(str(step + 1) if isinstance(step, int) else step for step in path) or "the file"


def _single_edits(document: Document, edit: Edit) -> Iterator[Edit]:
    """Split an edit into edits that each change one place of the text."""
    if not isinstance(edit, Set):
        yield edit
        return
    node: Any = document
    for depth, step in enumerate(edit.path):
        if isinstance(node, dict) and step not in node:
            value = edit.value
            for missing_key in reversed(edit.path[depth + 1 :]):
                value = {missing_key: value}
            yield Set(edit.path[: depth + 1], value, edit.after if depth == len(edit.path) - 1 else None)
            return
        node = node[step]
    yield from _edits_between(edit.path, node, edit.value)


def _edits_between(path: Path, old: Any, new: Any) -> Iterator[Edit]:
    """Yield edits that turn one value into another; unchanged parts keep their place and comments."""
    if is_same_value(old, new):
        return
    if isinstance(old, dict) and isinstance(new, Mapping) and new:
        for key in [key for key in new if key in old]:
            yield from _edits_between((*path, key), old[key], new[key])
        previous_key = None
        for key in new:
            if key not in old:
                yield Set((*path, key), new[key], previous_key)
            previous_key = key
        yield from (Unset((*path, key)) for key in old if key not in new)
    elif isinstance(old, list) and isinstance(new, list | tuple) and old and new:
        yield from _edits_between_lists(path, old, list(new))
    else:
        yield Set(path, new)


def _edits_between_lists(path: Path, old: list[Any], new: list[Any]) -> Iterator[Edit]:
    shortest = min(len(old), len(new))
    first, last = common_ends(old, new, is_same_value)
    for index in range(first, shortest - last):
        yield from _edits_between((*path, index), old[index], new[index])
    for index in range(shortest - last, len(new) - last):
        yield Insert((*path, index), new[index])
    for index in reversed(range(shortest - last, len(old) - last)):
        yield Unset((*path, index))


def _write_edit(spans: Spans, editor: Editor, edit: Edit) -> None:
    path = edit.path
    if isinstance(edit, Insert):
        _insert_entry(spans, editor, path, edit.value)
    elif isinstance(edit, Move):
        _move_entry(spans, editor, path, edit.to)
    elif isinstance(edit, Rename):
        for start, end in _key_spans(spans, path):
            editor.replace(start, end, key_text(edit.name))
        for reference in edit.references:
            if (node := spans.node(reference)) is not None:
                editor.replace(node.value, node.end, toml_value(edit.name, spans.text[node.value : node.end]))
    elif isinstance(edit, Duplicate):
        if isinstance(path[-1], int):
            _copy_entry(spans, editor, path)
        else:
            _copy_table(spans, editor, path, edit.name)
    elif isinstance(edit, Unset):
        (_remove_entry if isinstance(path[-1], int) else _remove_key)(spans, editor, path)
    elif spans.node(path) is None:
        _add_key(spans, editor, path, edit.value, edit.after)
    else:
        _replace_value(spans, editor, path, edit.value)


def _has_headers_or_dotted_keys(spans: Spans, path: Path) -> bool:
    """Return whether a value has headers or dotted keys, so that it must be removed and added again."""
    node = spans.node(path)
    is_apart = node.kind in {"table", "array table"} if node is not None else bool(spans.pieces(path))
    if is_apart and isinstance(path[-1], int):
        raise Refused(f"{_path_text(path)} is a table with a header, so it cannot be replaced with a single value")
    return is_apart


def _prune_empty_tables(document: Document, path: Path) -> Document:
    """Remove the empty tables and arrays along ``path``, which the text may omit, and return the document."""
    for length in range(len(path), 0, -1):
        node: Any = document
        for step in path[: length - 1]:
            node = node[step] if _has_step(node, step) else None
        if isinstance(node, dict) and node.get(path[length - 1]) in ({}, []):
            del node[path[length - 1]]
    return document
