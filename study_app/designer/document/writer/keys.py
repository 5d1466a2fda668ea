"""Keys and tables of a text: replace, add, remove, copy and rename them, as splices."""

import re
from collections.abc import Iterator, Mapping
from typing import Any, Final

from study_app.designer.document.writer.refused import Refused
from study_app.designer.document.writer.spans import Piece, Spans
from study_app.designer.document.writer.splices import Editor
from study_app.designer.document.writer.values import WIDTH, inline, key_text, tables, written
from study_app.protocol.source.document import Node, Path

_PADDING: Final = re.compile(r"([ \t]+)#")
_COMMA: Final = re.compile(r"[ \t]*,[ \t]*")
_BLANK_LINE: Final = re.compile(r"[ \t]*(?:\r?\n|\Z)")


def replace(spans: Spans, edit: Editor, path: Path, value: Any) -> None:
    """Replace the value that is written at ``path``; a comment behind it stays in its column where possible."""
    node = spans.node(path)
    if node is None or node.kind in {"table", "array table"}:
        raise Refused("a table with headers cannot become a value in place")
    text, like = spans.text, spans.text[node.value : node.end]
    line = text.rfind("\n", 0, node.start) + 1
    indent = re.match(r"[ \t]*", text[line:]).group()  # type: ignore[union-attr]
    column = node.value - line
    lines = node.kind == "key"
    if lines and isinstance(value, Mapping) and value and column + len(inline(value)) > WIDTH:
        key = text[node.parts[0][0] : node.parts[-1][1]]
        rows = (f"{key}.{key_text(name)} = {written(part, newline=spans.newline)}" for name, part in value.items())
        edit.replace(node.start, node.end, f"{spans.newline}{indent}".join(rows))
        return
    after = inline(value) if node.kind == "pair" else written(value, like, spans.newline, indent, column)
    edit.replace(node.value, node.end, after)
    padding = _PADDING.match(text, node.end)
    if padding and "\n" not in like + after:
        wide = len(padding.group(1))
        kept = max(wide + len(like) - len(after), min(wide, 2))
        edit.replace(*padding.span(1), padding.group(1) if kept == wide else " " * kept)


def add(spans: Spans, edit: Editor, path: Path, value: Any, after: str | None = None) -> None:
    """Add a key that is not there to a table that is; ``after`` names the key or table that it comes after."""
    parent, pieces = path[:-1], spans.pieces(path[:-1])
    owner = spans.node(parent)
    if parent and not pieces:
        add(spans, edit, parent, {path[-1]: value})
    elif owner is not None and owner.kind in {"key", "pair", "entry"}:
        _add_pair(spans, edit, owner, path, value)
    elif parent and owner is None and (dotted := [piece for piece in pieces if piece.node.kind in {"key", "pair"}]):
        _add_dotted(spans, edit, dotted[-1], path, value)
    elif _with_header(spans, path, value):
        _add_table(spans, edit, path, value, after)
    elif parent and owner is None:
        body = tables(parent, {path[-1]: value}, spans.newline)  # type: ignore[dict-item]
        edit.insert(pieces[0].start, body + spans.newline)
    else:
        _add_line(spans, edit, owner, path, value, after)


def _with_header(spans: Spans, path: Path, value: Any) -> bool:
    """Return whether a new table gets a header: as its neighbours have, at the root, or where it fills more lines."""
    if isinstance(value, list | tuple):
        if not value or not all(isinstance(entry, Mapping) and entry for entry in value):
            return False
    elif not isinstance(value, Mapping):
        return False
    fits = len(key_text(str(path[-1]))) + 3 + len(inline(value)) <= WIDTH
    within = len(path) - 1
    neighbours = any(len(node.path) > within and node.path[:within] == path[:-1] for node in spans.headers())
    return not fits or len(path) == 1 or (neighbours and isinstance(value, Mapping))


def _add_table(spans: Spans, edit: Editor, path: Path, value: Any, after: str | None) -> None:
    entry = isinstance(value, list | tuple)
    rows = value if entry else [value]
    body = spans.newline.join(tables(path, row, spans.newline, entry=entry) for row in rows)
    pieces = _headed(spans, (*path[:-1], after)) if after is not None else []
    pieces = pieces or (_headed(spans, path[:-1]) if len(path) > 1 else [])
    insert_block(spans, edit, pieces[-1].end if pieces else len(spans.text), body)


def _headed(spans: Spans, path: Path) -> list[Piece]:
    return [piece for piece in spans.pieces(path) if piece.node.kind in {"table", "array table"}]


def insert_block(spans: Spans, edit: Editor, at: int, body: str) -> None:
    """Insert whole lines after the piece that ends at ``at``, with a blank line before them, and after where needed."""
    text, newline = spans.text, spans.newline
    before = text[:at]
    opening = "" if not before.strip() else newline if before.endswith("\n") else newline * 2
    if before.endswith(newline * 2):
        opening = ""
    closing = "" if _BLANK_LINE.match(text, at) else newline
    if at == len(text) and before and not before.endswith("\n"):
        body = body.removesuffix(newline)
    edit.insert(at, opening + body + closing)


def insert_lines(spans: Spans, edit: Editor, at: int, lines: str) -> None:
    """Insert whole lines; at the end of a text without a last line break, the text stays without."""
    if at and not spans.text[:at].endswith("\n"):
        lines = spans.newline + lines.removesuffix(spans.newline)
    edit.insert(at, lines)


def _add_line(spans: Spans, edit: Editor, owner: Node | None, path: Path, value: Any, after: str | None) -> None:
    section = list(spans.section(owner))
    depth = len(path)
    named = [node for node in section if after is not None and node.path[:depth] == (*path[:-1], after)]
    last = named[-1] if named else section[-1] if section else owner
    key = f"{key_text(str(path[-1]))} = "
    if last is None:
        first = next(spans.headers(), None)
        at = len(spans.text) if first is None else spans.owned_start(first)
        line = f"{key}{written(value, newline=spans.newline, column=len(key))}{spans.newline}"
        insert_lines(spans, edit, at, line if first is None else line + spans.newline)
        return
    line_start = spans.text.rfind("\n", 0, last.start) + 1
    indent = spans.text[line_start : last.start]
    line = f"{indent}{key}{written(value, '', spans.newline, indent, len(indent + key))}{spans.newline}"
    insert_lines(spans, edit, spans.line_end(last), line)


def _add_pair(spans: Spans, edit: Editor, owner: Node, path: Path, value: Any) -> None:
    """Add a pair to an inline table, after its last one."""
    inner = [piece for piece in spans.pieces(path[:-1])[:1] if piece.node is owner]
    if not inner or spans.text[owner.value] != "{":
        raise Refused("a value that is not a table has no keys")
    pair = f"{key_text(str(path[-1]))} = {inline(value)}"
    pairs = [node for node in spans.nodes if node.kind == "pair" and owner.value < node.start < owner.end]
    top = [node for node in pairs if len(node.path) - len(node.parts) == len(path) - 1]
    if top:
        edit.insert(top[-1].end, f", {pair}")
    else:
        edit.replace(owner.value, owner.end, f"{{ {pair} }}")


def _add_dotted(spans: Spans, edit: Editor, piece: Piece, path: Path, value: Any) -> None:
    """Add a key to a table that is written with dotted keys: after the last one, with the same beginning."""
    node, text = piece.node, spans.text
    parts = node.parts[: len(path) - 1 - (len(node.path) - len(node.parts))]
    key = f"{text[parts[0][0] : parts[-1][1]]}.{key_text(str(path[-1]))} = "
    if node.kind == "pair":
        edit.insert(node.end, f", {key}{inline(value)}")
        return
    indent = text[text.rfind("\n", 0, node.start) + 1 : node.start]
    like = text[node.value : node.end]
    value_text = written(value, like, spans.newline, indent, len(indent + key))
    insert_lines(spans, edit, piece.end, f"{indent}{key}{value_text}{spans.newline}")


def remove(spans: Spans, edit: Editor, path: Path) -> None:
    """Remove a key or table with its comments, and the blank line before it where two would be left."""
    for piece in spans.pieces(path):
        if piece.node.kind == "pair":
            _remove_pair(spans, edit, piece)
        else:
            edit.delete(blank_before(spans.text, piece), piece.end)


def blank_before(text: str, piece: Piece) -> int:
    """Return where to begin a deletion: before the blank lines above, if a blank line or the end follows."""
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


def copy(spans: Spans, edit: Editor, path: Path, name: str) -> None:
    """Copy a key or table with its comments under another name, right after it."""
    pieces = spans.pieces(path)
    copies = [_renamed(spans, piece, len(path) - 1, name) for piece in pieces]
    last = pieces[-1]
    if last.node.kind == "pair":
        edit.insert(last.end, "".join(f", {text}" for text in copies))
    elif all(piece.node.kind == "key" for piece in pieces):
        insert_lines(spans, edit, last.end, "".join(copies))
    else:
        insert_block(spans, edit, last.end, spans.newline.join(copies))


def _renamed(spans: Spans, piece: Piece, depth: int, name: str) -> str:
    """Return the text of a piece with another name for the step at ``depth`` of its paths, whole lines."""
    editor = Editor(spans.text)
    for start, end in _parts(spans, piece.node.path[: depth + 1]):
        if piece.start <= start < piece.end:
            editor.replace(start, end, key_text(name))
    found, at = "", piece.start
    for splice in editor.splices:
        found += spans.text[at : splice.at] + splice.after
        at = splice.at + len(splice.before)
    found += spans.text[at : piece.end]
    return found if piece.node.kind == "pair" or found.endswith("\n") else found + spans.newline


def rename(spans: Spans, edit: Editor, path: Path, name: str) -> None:
    """Write another name for a key wherever it stands."""
    for start, end in _parts(spans, path):
        edit.replace(start, end, key_text(name))


def _parts(spans: Spans, path: Path) -> Iterator[tuple[int, int]]:
    """Yield where the last step of a path is written, in headers and keys."""
    depth = len(path) - 1
    for node in spans.nodes:
        if node.path[: depth + 1] != path or not node.parts:
            continue
        if node.kind in {"table", "array table"}:
            yield node.parts[sum(isinstance(step, str) for step in path) - 1]
        elif (place := depth - (len(node.path) - len(node.parts))) >= 0:
            yield node.parts[place]
