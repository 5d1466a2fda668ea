"""Source spans of the keys, values and comments in a TOML text; values in TOML notation; splices."""

from __future__ import annotations

import operator
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, Final, NamedTuple, TypeAlias

import tomlkit
import tomlkit.items

from study_app.errors import StudyError
from study_app.protocol.source import Node, Path, scan_nodes


class Refused(StudyError):
    """The requested change of the study is not possible; the study is unchanged, and the message gives the reason."""


class Splice(NamedTuple):
    """A replacement of ``before``, which begins at position ``start`` of a text, by ``after``."""

    start: int
    before: str
    after: str


Splices: TypeAlias = tuple[Splice, ...]
"""Splices of one text that do not overlap, in the order of their positions."""


class Editor:
    """Collects replacements of one text; insertions at the same position keep their order."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._replacements: list[Splice] = []

    def replace(self, start: int, end: int, after: str) -> None:
        """Replace the text from ``start`` to ``end``; a replacement without a change is dropped."""
        if (before := self.text[start:end]) != after:
            self._replacements.append(Splice(start, before, after))

    def insert(self, position: int, after: str) -> None:
        self.replace(position, position, after)

    def delete(self, start: int, end: int) -> None:
        """Delete a piece; overlapping deletions are joined."""
        self.replace(start, end, "")

    @property
    def splices(self) -> Splices:
        """The collected splices, overlapping deletions joined."""
        joined: list[Splice] = []
        for splice in sorted(self._replacements, key=lambda splice: splice.start):
            if joined and splice.start < (end := joined[-1].start + len(joined[-1].before)):
                last = joined.pop()
                replaced = self.text[last.start : max(end, splice.start + len(splice.before))]
                splice = Splice(last.start, replaced, last.after + splice.after)  # noqa: PLW2901
            joined.append(splice)
        return tuple(joined)


def common_ends(
    old: Sequence[Any], new: Sequence[Any], same: Callable[[Any, Any], bool] = operator.eq
) -> tuple[int, int]:
    """Return the number of equal letters or entries at the beginning and at the end of two texts or arrays."""
    shortest, first, last = min(len(old), len(new)), 0, 0
    while first < shortest and same(old[first], new[first]):
        first += 1
    while last < shortest - first and same(old[-1 - last], new[-1 - last]):
        last += 1
    return first, last


def apply_splices(text: str, splices: Iterable[Splice]) -> str:
    """Return a text with splices applied."""
    parts: list[str] = []
    end = 0
    for position, before, after in splices:
        if position < end or text[position : position + len(before)] != before:
            raise ValueError("the text has changed since these edits were computed")
        parts += (text[end:position], after)
        end = position + len(before)
    return "".join((*parts, text[end:]))


def revert_splices(splices: Splices) -> Splices:
    """Return the splices that undo the given ones in the resulting text."""
    shift, reverted = 0, list[Splice]()
    for position, before, after in splices:
        reverted.append(Splice(position + shift, after, before))
        shift += len(after) - len(before)
    return tuple(reverted)


_ENDS: Final = re.compile("\r\n|\r|\u2029")
"""Line ends other than line feeds that the text editor recognises."""


def with_line_feeds(text: str) -> str:
    """Return a text with LF line endings."""
    return _ENDS.sub("\n", text)


def with_own_line_ends(text: str, typed: str) -> str:
    """Return the typed text with the line endings of the original text."""
    old, newline = with_line_feeds(text), "\r\n" if "\r\n" in text else "\n"
    first, last = common_ends(old, typed)
    begin, end = _original_position(text, first), _original_position(text, len(old) - last)
    return text[:begin] + typed[first : len(typed) - last].replace("\n", newline) + text[end:]


def _original_position(text: str, position: int) -> int:
    """Return the position in the file's text for a position in the displayed text."""
    for match in _ENDS.finditer(text):
        if match.start() >= position:
            break
        position += len(match[0]) - 1
    return position


_RULER: Final = re.compile(r"\s*#\s*[-=*#~]{3,}")
_COMMENT: Final = re.compile(r"[ \t]*#")
_REST: Final = re.compile(r"[ \t]*(?:#[^\r\n]*)?(\r?\n|\Z)")
_TAIL: Final = re.compile(r"[ \t]*#[^\r\n]*")
_COMMA: Final = re.compile(r"[ \t]*,")


class Piece(NamedTuple):
    """A part of the text that belongs to one path, from ``start`` to ``end``; ``node`` is its first node."""

    node: Node
    start: int
    end: int


class Slot(NamedTuple):
    """An array entry with its surroundings.

    From ``start`` to ``end`` it contains the comments above and the entry, which begins at ``entry``. A comma, if any,
    ends at ``tail``, and the comment after it at ``tail_end``. With ``own_line`` the entry is the first on its line.
    """

    start: int
    entry: int
    end: int
    tail: int
    tail_end: int
    own_line: bool


@lru_cache(maxsize=4)
def spans_of(text: str) -> Spans:
    """Return the source span of every key and value in a TOML document."""
    return Spans(text)


class Spans:
    """The source spans of the parts of a TOML text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.nodes = scan_nodes(text)
        self.newline = "\r\n" if "\r\n" in text else "\n"
        self._by_path = {node.path: node for node in self.nodes}
        self._lines = [node for node in self.nodes if node.kind in {"table", "array table", "key"}]
        self._starts = [node.start for node in self._lines]

    def node(self, path: Path) -> Node | None:
        """Return the node of a header, key or entry; None if there is none with exactly this path."""
        return self._by_path.get(path)

    def pieces(self, path: Path) -> list[Piece]:
        """Return all pieces of the value at ``path``, in order.

        A table may be written as several headers and dotted keys, which need not be next to each other.
        """
        pieces: list[Piece] = []
        end = 0
        for node in self.nodes:
            if node.start >= end and node.path[: len(path)] == path:
                pieces.append(self._piece(node))
                end = pieces[-1].end
        return pieces

    def _piece(self, node: Node) -> Piece:
        if node.kind in {"pair", "entry"}:
            return Piece(node, node.start, node.end)
        last = self.last_of(node) if node.kind != "key" else node
        return Piece(node, self.owned_start(node), self.line_end(last))

    def last_of(self, header: Node | None) -> Node | None:
        """Return the last key in a header's section, or the header if it has none; None means the root."""
        index = -1 if header is None else self._line_index(header)
        last = header
        for node in self._lines[index + 1 :]:
            if node.kind != "key":
                break
            last = node
        return last

    def section(self, header: Node | None) -> Iterator[Node]:
        """Yield the keys of a header's section; None means the root."""
        for node in self._lines[0 if header is None else self._line_index(header) + 1 :]:
            if node.kind != "key":
                return
            yield node

    def headers(self) -> Iterator[Node]:
        return (node for node in self._lines if node.kind != "key")

    def line_end(self, node: Node | None) -> int:
        """Return the end of the line on which a header or key ends, after its comment and line break."""
        if node is None:
            return 0
        match = _REST.match(self.text, node.end)
        return match.end() if match else node.end

    def owned_start(self, node: Node) -> int:
        """Return the start of a header or key including its line and the comments directly above."""
        index = self._line_index(node)
        return self._start_with_comments(node.start, self.line_end(self._lines[index - 1]) if index else 0)

    def _line_index(self, node: Node) -> int:
        return bisect_right(self._starts, node.start) - 1

    def _line_start(self, position: int) -> int:
        return self.text.rfind("\n", 0, position) + 1

    def _start_with_comments(self, position: int, earliest: int) -> int:
        """Return the start of the comments directly above the line of ``position``, but not before ``earliest``."""
        start = max(self._line_start(position), earliest)
        while start > earliest:
            above = self._line_start(start - 1)
            if above < earliest or not _COMMENT.match(self.text, above) or _RULER.match(self.text, above):
                break
            start = above
        return start

    def slots(self, path: Path) -> list[Slot]:
        """Return the entries of the array at ``path``, each with its comments."""
        node = self._by_path[path]
        floor, slots = node.value + 1, list[Slot]()
        index = 0
        while (entry := self._by_path.get((*path, index))) is not None:
            line = self._line_start(entry.start)
            own_line = line >= floor and not self.text[line : entry.start].strip()
            start = self._start_with_comments(entry.start, floor) if own_line else entry.start
            comma = _COMMA.match(self.text, entry.end)
            after = comma.end() if comma else entry.end
            tail = _TAIL.match(self.text, after)
            slots.append(
                Slot(
                    start=start,
                    entry=entry.start,
                    end=entry.end,
                    tail=after,
                    tail_end=tail.end() if tail else after,
                    own_line=own_line,
                )
            )
            floor = slots[-1].tail_end
            index += 1
        return slots


WIDTH: Final = 120
INDENT: Final = "    "
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")
_LITERAL: Final = re.compile(r"[^'\x00-\x08\x0a-\x1f\x7f]*")


def key_text(key: str) -> str:
    """Return a key in TOML notation, with quotes if it needs them."""
    return key if _BARE.fullmatch(key) else str(tomlkit.key(key).as_string())


def toml_value(value: Any, like: str = "", newline: str = "\n", indent: str = "", column: int = 0) -> str:
    """Return a value, as read by ``tomllib``, in TOML notation.

    ``like`` is the text that it replaces, or that of a neighbour, whose quotes and line breaks are kept if possible;
    ``indent`` and ``column`` describe what precedes the value on its line.
    """
    if isinstance(value, str):
        return _toml_string(value, like, newline)
    if isinstance(value, list | tuple) and value:
        line = inline_value(value)
        if "\n" not in like and column + len(line) <= WIDTH:
            return line
        inner = indent + (INDENT if not like else _array_indent(like, indent))
        rows = "".join(f"{inner}{inline_value(entry)},{newline}" for entry in value)
        return f"[{newline}{rows}{indent}]"
    return inline_value(value)


def inline_value(value: Any) -> str:
    """Return a value in TOML notation without a line break."""
    if isinstance(value, Mapping):
        pairs = ", ".join(f"{key_text(key)} = {inline_value(entry)}" for key, entry in value.items())
        return f"{{ {pairs} }}" if pairs else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(inline_value, value))}]"
    return str(tomlkit.item(value).as_string())


def table_text(path: tuple[str | int, ...], value: Mapping[str, Any], newline: str, *, entry: bool = False) -> str:
    """Return a table with its header; inner tables longer than a line get their own headers.

    ``entry`` means that it is an entry of an array of tables.
    """
    name = ".".join(key_text(key) for key in path if isinstance(key, str))
    lines, inner_tables = [f"[[{name}]]" if entry else f"[{name}]"], list[str]()
    for key, part in value.items():
        column = len(key_text(key)) + 3
        fits = column + len(inline_value(part)) <= WIDTH
        if isinstance(part, Mapping) and part and not fits:
            inner_tables.append(table_text((*path, key), part, newline))
        elif isinstance(part, list | tuple) and part and not fits and all(isinstance(row, Mapping) for row in part):
            inner_tables += [table_text((*path, key), row, newline, entry=True) for row in part]
        else:
            lines.append(f"{key_text(key)} = {toml_value(part, newline=newline, column=column)}")
    return newline.join(["".join(f"{line}{newline}" for line in lines), *inner_tables])


def _toml_string(value: str, like: str, newline: str) -> str:
    if "\n" in value and "\r" not in value:
        # tomlkit adds a line break before a text that begins with one; the leading sign prevents it.
        body = tomlkit.string(f"-{value}", multiline=True).as_string()[4:-3]
        return f'"""{newline}{body.replace(chr(10), newline)}"""'
    if like.startswith("'") and _LITERAL.fullmatch(value):
        return f"'{value}'"
    return inline_value(value)


def _array_indent(array: str, indent: str) -> str:
    """Return the indent of an array's entries."""
    match = re.search(r"\n([ \t]*)[^\s#\]]", array)
    return match.group(1).removeprefix(indent) if match else INDENT
