"""A TOML document as ``tomllib`` reads it (arrays as tuples), and the positions of its keys and values in the text.

Unlike ``tomllib``, the scan records character positions. It assumes that ``tomllib`` has accepted the text, and does
not validate it.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, lru_cache
from operator import attrgetter
from typing import Any, Final, Literal, NamedTuple, TypeAlias

Path: TypeAlias = tuple[str | int, ...]
_TABLE: Final = (dict, Mapping)
"""Types of tables; ``dict`` comes first, because nearly all tables are of this type and the check is faster."""


def has(node: Any, step: str | int) -> bool:
    """Return whether ``node`` is a table with the key ``step``, or an array with the index ``step``."""
    if isinstance(step, int):
        return isinstance(node, tuple) and step < len(node)
    return isinstance(node, _TABLE) and step in node


def value_at(document: Any, path: Path) -> Any:
    """Return the value at ``path``, None if there is none."""
    for step in path:
        if not has(document, step):
            return None
        document = document[step]
    return document


def entries(document: Any, pattern: str) -> Iterator[tuple[Path, Any]]:
    """Yield the values that match ``pattern`` with their paths: "blocks.*.conditions.*", where ``*`` is any key."""
    nodes: list[tuple[Path, Any]] = [((), document)]
    for step in pattern.split("."):
        nodes = [
            ((*path, key), value)
            for path, node in nodes
            for key, value in (_children(node) if step == "*" else ((step, node[step]),) if has(node, step) else ())
        ]
    return iter(nodes)


def _children(node: Any) -> Iterable[tuple[str | int, Any]]:
    """Return the entries of a table or array with keys or indices; none of other values."""
    return node.items() if isinstance(node, _TABLE) else enumerate(node) if isinstance(node, tuple) else ()


def names(document: Any, section: str) -> tuple[str, ...]:
    """Return the names of a section's tables, valid or not."""
    return tuple(str(path[1]) for path, _ in entries(document, f"{section}.*") if isinstance(path[1], str))


def frozen(value: Any) -> Any:
    """Return a ``tomllib`` value with arrays as tuples; raise ValueError for whole numbers beyond TOML's 64 bits."""
    if isinstance(value, list):
        return tuple(frozen(entry) for entry in value)
    if isinstance(value, dict):
        return {key: frozen(entry) for key, entry in value.items()}
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError("TOML permits whole numbers of up to 64 bits")
    return value


_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_PLAIN_KEY = re.compile(r"([A-Za-z0-9_-]+)[ \t]*=[ \t]*")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?!")'
    r"|'''.*?'''(?!')"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^,\]}#\r\n]*")

Kind: TypeAlias = Literal["table", "array table", "key", "pair", "entry"]


class Node(NamedTuple):
    """One header, key or array entry of a text; positions count characters from 0, ends are exclusive.

    The ``kind`` is "table" for a header ``[a.b]``, "array table" for ``[[a.b]]``, "key" for a key on its own lines,
    "pair" for a key of an inline table, "entry" for an entry of an array. The path consists of keys and, for array
    entries, indices from 0: ``("blocks", "liquids", "conditions", 2)``; ``parts`` are the positions of the parts of the
    key: ``a`` and ``"b c"`` of ``a . "b c"``. The value begins at ``value`` (for a header, at its end); the node ends
    before a comma or comment.
    """

    kind: Kind
    path: Path
    parts: tuple[tuple[int, int], ...]
    start: int
    value: int
    end: int


@lru_cache(maxsize=2)
def scan_nodes(text: str) -> tuple[Node, ...]:
    """Return every header, key and array entry of a TOML text, in order of position."""
    nodes = _Scan(text).nodes
    return tuple(sorted(nodes, key=attrgetter("start")))


class _Scan:
    def __init__(self, text: str) -> None:
        self.nodes: list[Node] = []
        self._text = text
        self._position = 0
        self._array_tables: dict[Path, int] = {}
        table: Path = ()
        while self._skip_blank():
            table = self._read_header() if text.startswith("[", self._position) else self._read_assignment(table, "key")

    def _read_header(self) -> Path:
        start = self._position
        is_array = self._skip_mark("[[")
        if not is_array:
            self._skip_mark("[")
        keys, parts = self._read_key()
        self._skip_mark("]]" if is_array else "]")
        path = self._resolve_array_tables(keys)
        if is_array:
            index = self._array_tables.get(path, 0)
            self._array_tables[path] = index + 1
            path = (*path, index)
        self.nodes.append(
            Node(
                kind="array table" if is_array else "table",
                path=path,
                parts=parts,
                start=start,
                value=self._position,
                end=self._position,
            )
        )
        return path

    def _resolve_array_tables(self, keys: Path) -> Path:
        """Return the path of a header's keys; an array of tables in the path stands for its last entry."""
        path: Path = ()
        for key in keys[:-1]:
            path = (*path, key)
            if path in self._array_tables:
                path = (*path, self._array_tables[path] - 1)
        return (*path, *keys[-1:])  # a header that is being typed may have no key

    def _read_assignment(self, table: Path, kind: Kind) -> Path:
        """Read a key and its value; return the table to which they belong."""
        start = self._position
        keys: Path
        parts: tuple[tuple[int, int], ...]
        if plain := _PLAIN_KEY.match(self._text, start):
            keys, parts, self._position = (plain[1],), (plain.span(1),), plain.end()
        else:
            keys, parts = self._read_key()
            self._skip_blank()
            self._skip_mark("=")
            self._skip_blank()
        value, path = self._position, table + keys
        self._read_value(path)
        self.nodes.append(Node(kind=kind, path=path, parts=parts, start=start, value=value, end=self._position))
        return table

    def _read_value(self, path: Path) -> None:
        if self._skip_mark("["):
            index = 0
            while self._skip_blank() and not self._skip_mark("]"):
                start, entry_path = self._position, (*path, index)
                self._read_value(entry_path)
                self.nodes.append(
                    Node(kind="entry", path=entry_path, parts=(), start=start, value=start, end=self._position)
                )
                index += 1
                self._skip_blank()
                self._skip_mark(",")
        elif self._skip_mark("{"):
            while self._skip_blank() and not self._skip_mark("}"):
                self._read_assignment(path, "pair")
                self._skip_blank()
                self._skip_mark(",")
        elif string := _STRING.match(self._text, self._position):
            self._position = string.end()
        elif scalar := _SCALAR.match(self._text, self._position):
            self._position += len(scalar.group().rstrip(" \t"))

    def _read_key(self) -> tuple[Path, tuple[tuple[int, int], ...]]:
        keys: list[str] = []
        parts: list[tuple[int, int]] = []
        while True:
            self._skip_blank()
            if bare := _BARE_KEY.match(self._text, self._position):
                keys.append(bare.group())
                parts.append(bare.span())
                self._position = bare.end()
            elif quoted := _STRING.match(self._text, self._position):
                keys.append(str(tomllib.loads(f"key = {quoted.group()}")["key"]))
                parts.append(quoted.span())
                self._position = quoted.end()
            self._skip_blank()
            if not self._skip_mark("."):
                return tuple(keys), tuple(parts)

    def _skip_blank(self) -> bool:
        """Skip white space and comments; return False at the end of the text."""
        if blank := _BLANK.match(self._text, self._position):
            self._position = blank.end()
        return self._position < len(self._text)

    def _skip_mark(self, mark: str) -> bool:
        """Skip ``mark`` and return True if it comes next."""
        if self._text.startswith(mark, self._position):
            self._position += len(mark)
            return True
        return False


class Places:
    """The line of every key, table and array entry of a TOML text."""

    def __init__(self, source: str) -> None:
        self._source = source

    @staticmethod
    @lru_cache(maxsize=2)
    def of(text: str) -> Places:
        """Return the lines of a TOML text with any kind of line endings."""
        return Places(text.replace("\r\n", "\n"))

    @cached_property
    def _lines(self) -> dict[Path, int]:
        """The line of each path; computed on first use, because only texts with problems need it."""
        line_starts = [0, *(match.end() for match in re.finditer("\n", self._source))]
        lines: dict[Path, int] = {}
        for node in scan_nodes(self._source):
            line = bisect_right(line_starts, node.start)
            for length in range(1, len(node.path)):
                lines.setdefault(node.path[:length], line)
            lines[node.path] = line
        return lines

    def line(self, path: Path) -> int | None:
        """Return the line (from 1) of ``path``, or of its innermost ancestor in the file."""
        for length in range(len(path), 0, -1):
            if (line := self._lines.get(path[:length])) is not None:
                return line
        return None
