"""Entries of an array, or of an array of tables: insert, remove, copy and move them, as splices."""

import re
from collections.abc import Mapping
from typing import Any, Final

from study_app.designer.document.writer.keys import blank_before, insert_block
from study_app.designer.document.writer.refused import Refused
from study_app.designer.document.writer.spans import Piece, Slot, Spans
from study_app.designer.document.writer.splices import Editor
from study_app.designer.document.writer.values import INDENT, WIDTH, inline, tables
from study_app.protocol.source.document import Path

_TO_COMMA: Final = re.compile(r"(?:[ \t\r\n]|#[^\n]*+)*+,")
_LINE_REST: Final = re.compile(r"[ \t]*(\r?\n)")


def _entry(path: Path) -> tuple[Path, int]:
    index = path[-1]
    if not isinstance(index, int):
        raise Refused("an entry of an array has a number")
    return path[:-1], index


def insert(spans: Spans, edit: Editor, path: Path, value: Any) -> None:
    """Insert an entry at the index that ends ``path``, into an array that is in the text."""
    array, index = _entry(path)
    node = spans.node(array)
    if node is None:
        _insert_table(spans, edit, path, value)
        return
    slots = spans.slots(array)
    if not slots:
        edit.insert(node.end - 1, inline(value))
    elif index < len(slots):
        slot = slots[index]
        own = slot.own_line
        edit.insert(
            slot.start, f"{_indent(spans, slot)}{inline(value)},{spans.newline}" if own else f"{inline(value)}, "
        )
    elif slots[-1].own_line:
        _append(spans, edit, slots[-1], inline(value))
    elif _fits(spans, node.start, node.end, value):
        edit.insert(slots[-1].end, f", {inline(value)}")
    else:
        _spread(spans, edit, array, slots, inline(value))


def _fits(spans: Spans, start: int, end: int, value: Any) -> bool:
    line = spans.text.rfind("\n", 0, start) + 1
    return "\n" in spans.text[start:end] or end - line + len(inline(value)) + 2 <= WIDTH


def _spread(spans: Spans, edit: Editor, array: Path, slots: list[Slot], value: str) -> None:
    """Write an array that becomes too long for its line with a line for each entry."""
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


def _append(spans: Spans, edit: Editor, last: Slot, body: str, tail: str = "") -> None:
    """Add lines after the line on which an entry ends, with a comment behind; a missing comma is added before them."""
    newline = spans.newline
    comma = _TO_COMMA.match(spans.text, last.end)
    if comma is None:
        edit.insert(last.end, ",")
        edit.insert(last.tail_end, f"{newline}{_indent(spans, last)}{body}{tail}")
        return
    edit.insert(max(comma.end(), last.tail_end), f"{newline}{_indent(spans, last)}{body},{tail}")


def _insert_table(spans: Spans, edit: Editor, path: Path, value: Any) -> None:
    array, index = _entry(path)
    if not isinstance(value, Mapping):
        raise Refused("an entry of an array of tables is a table")
    body = tables(path, value, spans.newline, entry=True)
    if following := spans.pieces((*array, index)):
        edit.insert(following[0].start, body + spans.newline)
    else:
        insert_block(spans, edit, spans.pieces(array)[-1].end, body)


def remove(spans: Spans, edit: Editor, path: Path) -> None:
    """Remove an entry with its comments."""
    array, index = _entry(path)
    if spans.node(array) is None:
        for piece in spans.pieces(path):
            edit.delete(blank_before(spans.text, piece), piece.end)
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


def copy(spans: Spans, edit: Editor, path: Path) -> None:
    """Copy an entry with its comments, right after it."""
    array, index = _entry(path)
    text, newline = spans.text, spans.newline
    if spans.node(array) is None:
        pieces = spans.pieces(path)
        copies = (_lines(text, piece, newline) for piece in pieces)
        insert_block(spans, edit, pieces[-1].end, newline.join(copies))
        return
    slots = spans.slots(array)
    slot = slots[index]
    tail = text[slot.tail : slot.tail_end]
    if not slot.own_line and not tail:
        edit.insert(slot.end, f", {text[slot.entry : slot.end]}")
    elif slot.own_line and index < len(slots) - 1:
        edit.insert(slots[index + 1].start, f"{text[slot.start : slot.end]},{tail}{newline}")
    else:  # the comment behind it ends the line
        _append(spans, edit, slot, text[slot.start : slot.end].lstrip(" \t"), tail)


def _lines(text: str, piece: Piece, newline: str) -> str:
    found = text[piece.start : piece.end]
    return found if found.endswith("\n") else found + newline


def move(spans: Spans, edit: Editor, path: Path, to: int) -> None:
    """Move an entry with its comments to another index; the others close up."""
    array, index = _entry(path)
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
    """Write the entries of an array of tables in another order, each into the place of another one."""
    text = spans.text
    pieces = [spans.pieces((*array, index)) for index in range(len(order))]
    for place, source in enumerate(order):
        if place == source:
            continue
        body = spans.newline.join(_lines(text, piece, spans.newline) for piece in pieces[source])
        first, *others = pieces[place]
        if not text[first.start : first.end].endswith("\n"):
            body = body.removesuffix(spans.newline)
        edit.replace(first.start, first.end, body)
        for piece in others:
            edit.delete(blank_before(text, piece), piece.end)
