"""What belongs to each part of a protocol file: its pieces in the text, with their own comments.

A comment behind a value belongs to its key or entry; one right above a header, key or entry, without a blank line in
between, belongs to it. Rulers (``# ---``) and comments between blank lines belong to nothing.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from functools import lru_cache
from typing import Final, NamedTuple

from study_app.protocol.source.document import Node, Path, scan

_RULER: Final = re.compile(r"\s*#\s*[-=*#~]{3,}")
_COMMENT: Final = re.compile(r"[ \t]*#")
_REST: Final = re.compile(r"[ \t]*(?:#[^\r\n]*)?(\r?\n|\Z)")
_TAIL: Final = re.compile(r"[ \t]*#[^\r\n]*")
_COMMA: Final = re.compile(r"[ \t]*,")


class Piece(NamedTuple):
    """A part of the text that belongs to one path, from ``start`` to ``end``; ``node`` is what it begins with."""

    node: Node
    start: int
    end: int


class Slot(NamedTuple):
    """An entry of an array in its place.

    ``start`` to ``end`` is the entry with its comments above, then follows a comma until ``tail`` (or none), then the
    comment behind it until ``tail_end``. ``own_line`` says that nothing precedes the entry on its line.
    """

    start: int
    entry: int
    end: int
    tail: int
    tail_end: int
    own_line: bool


@lru_cache(maxsize=4)
def spans_of(text: str) -> Spans:
    """Return where everything of a TOML text is written."""
    return Spans(text)


class Spans:
    """Where everything of a TOML text is written."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.nodes = scan(text)
        self.newline = "\r\n" if "\r\n" in text else "\n"
        self._by_path = {node.path: node for node in self.nodes}
        self._lines = [node for node in self.nodes if node.kind in {"table", "array table", "key"}]
        self._starts = [node.start for node in self._lines]

    def node(self, path: Path) -> Node | None:
        """Return the header, key or entry of a path; None where it is only a part of others' paths, or not there."""
        return self._by_path.get(path)

    def pieces(self, path: Path) -> list[Piece]:
        """Return everything that makes up the value at ``path``, in order.

        A table may be written as several headers and dotted keys, which need not be next to each other.
        """
        found: list[Piece] = []
        end = 0
        for node in self.nodes:
            if node.start >= end and node.path[: len(path)] == path:
                found.append(self._piece(node))
                end = found[-1].end
        return found

    def _piece(self, node: Node) -> Piece:
        if node.kind in {"pair", "entry"}:
            return Piece(node, node.start, node.end)
        last = self.last_of(node) if node.kind != "key" else node
        return Piece(node, self.owned_start(node), self.line_end(last))

    def last_of(self, header: Node | None) -> Node | None:
        """Return the last key of a header's section, the header where it has none; None stands for the root."""
        place = -1 if header is None else self._place(header)
        last = header
        for node in self._lines[place + 1 :]:
            if node.kind != "key":
                break
            last = node
        return last

    def section(self, header: Node | None) -> Iterator[Node]:
        """Yield the keys of a header's section; None stands for the root."""
        for node in self._lines[0 if header is None else self._place(header) + 1 :]:
            if node.kind != "key":
                return
            yield node

    def headers(self) -> Iterator[Node]:
        """Yield every header."""
        return (node for node in self._lines if node.kind != "key")

    def line_end(self, node: Node | None) -> int:
        """Return where the line ends on which a header or key ends, after its comment and line break."""
        if node is None:
            return 0
        rest = _REST.match(self.text, node.end)
        return rest.end() if rest else node.end

    def owned_start(self, node: Node) -> int:
        """Return where a header or key begins with its line and the comments right above it."""
        place = self._place(node)
        return self._with_comments(node.start, self.line_end(self._lines[place - 1]) if place else 0)

    def _place(self, node: Node) -> int:
        return bisect_right(self._starts, node.start) - 1

    def _line_start(self, position: int) -> int:
        return self.text.rfind("\n", 0, position) + 1

    def _with_comments(self, position: int, floor: int) -> int:
        """Return where the comments right above the line of ``position`` begin, not before ``floor``."""
        start = max(self._line_start(position), floor)
        while start > floor:
            above = self._line_start(start - 1)
            if above < floor or not _COMMENT.match(self.text, above) or _RULER.match(self.text, above):
                break
            start = above
        return start

    def slots(self, path: Path) -> list[Slot]:
        """Return the entries of the array written at ``path``, each with its comments."""
        node = self._by_path[path]
        floor, found = node.value + 1, list[Slot]()
        index = 0
        while (entry := self._by_path.get((*path, index))) is not None:
            line = self._line_start(entry.start)
            own = line >= floor and not self.text[line : entry.start].strip()
            start = self._with_comments(entry.start, floor) if own else entry.start
            comma = _COMMA.match(self.text, entry.end)
            after = comma.end() if comma else entry.end
            tail = _TAIL.match(self.text, after)
            found.append(Slot(start, entry.start, entry.end, after, tail.end() if tail else after, own))
            floor = found[-1].tail_end
            index += 1
        return found
