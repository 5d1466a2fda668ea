"""Where in a TOML text everything is written: a scan that keeps character positions, which ``tomllib`` does not.

It reads texts that ``tomllib`` has accepted, so it only has to follow structure, not to judge it.
"""

from __future__ import annotations

import re
import tomllib
from functools import lru_cache
from operator import attrgetter
from typing import Literal, NamedTuple, TypeAlias

from study_app.protocol.source.document import Path

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

    Attributes
    ----------
    kind : str
        "table" is a header ``[a.b]``, "array table" a header ``[[a.b]]``, "key" a key on lines of its own, "pair" a key
        of an inline table, "entry" an entry of an array.
    path : tuple of str or int
        Keys and, for entries of arrays, indices from 0: ``("blocks", "liquids", "conditions", 2)``.
    parts : tuple of (int, int)
        Where each part of its key is written: ``a`` and ``"b c"`` of ``a . "b c"``; none for an entry.
    start, value, end : int
        Where it begins, where its value begins (for a header: its end), and where it ends, without a comma or comment.
    """

    kind: Kind
    path: Path
    parts: tuple[tuple[int, int], ...]
    start: int
    value: int
    end: int


@lru_cache(maxsize=2)
def scan(text: str) -> tuple[Node, ...]:
    """Return every header, key and array entry of a TOML text, in the order in which they begin."""
    found = _Scan(text).nodes
    return tuple(sorted(found, key=attrgetter("start")))


class _Scan:
    def __init__(self, text: str) -> None:
        self.nodes: list[Node] = []
        self._text = text
        self._at = 0
        self._array_tables: dict[Path, int] = {}
        table: Path = ()
        while self._skip_blank():
            table = self._header() if text.startswith("[", self._at) else self._assignment(table, "key")

    def _header(self) -> Path:
        """Read a header and return the path of its table."""
        start = self._at
        many = self._take("[[")
        if not many:
            self._take("[")
        keys, parts = self._key()
        self._take("]]" if many else "]")
        path = self._within_arrays(keys)
        if many:
            index = self._array_tables.get(path, 0)
            self._array_tables[path] = index + 1
            path = (*path, index)
        self.nodes.append(Node("array table" if many else "table", path, parts, start, self._at, self._at))
        return path

    def _within_arrays(self, keys: Path) -> Path:
        """Return the path a header names: on the way, an array of tables stands for its latest entry."""
        path: Path = ()
        for key in keys[:-1]:
            path = (*path, key)
            if path in self._array_tables:
                path = (*path, self._array_tables[path] - 1)
        return (*path, *keys[-1:])  # none while a header is typed

    def _assignment(self, table: Path, kind: Kind) -> Path:
        """Read a key and its value; return the table that they belong to."""
        start = self._at
        keys: Path
        parts: tuple[tuple[int, int], ...]
        if plain := _PLAIN_KEY.match(self._text, start):
            keys, parts, self._at = (plain[1],), (plain.span(1),), plain.end()
        else:
            keys, parts = self._key()
            self._skip_blank()
            self._take("=")
            self._skip_blank()
        value, path = self._at, table + keys
        self._value(path)
        self.nodes.append(Node(kind, path, parts, start, value, self._at))
        return table

    def _value(self, path: Path) -> None:
        if self._take("["):
            index = 0
            while self._skip_blank() and not self._take("]"):
                start, entry = self._at, (*path, index)
                self._value(entry)
                self.nodes.append(Node("entry", entry, (), start, start, self._at))
                index += 1
                self._skip_blank()
                self._take(",")
        elif self._take("{"):
            while self._skip_blank() and not self._take("}"):
                self._assignment(path, "pair")
                self._skip_blank()
                self._take(",")
        elif string := _STRING.match(self._text, self._at):
            self._at = string.end()
        elif scalar := _SCALAR.match(self._text, self._at):
            self._at += len(scalar.group().rstrip(" \t"))

    def _key(self) -> tuple[Path, tuple[tuple[int, int], ...]]:
        """Read a key, dotted or not, quoted or not; return its parts and where they are written."""
        keys: list[str] = []
        parts: list[tuple[int, int]] = []
        while True:
            self._skip_blank()
            if bare := _BARE_KEY.match(self._text, self._at):
                keys.append(bare.group())
                parts.append(bare.span())
                self._at = bare.end()
            elif quoted := _STRING.match(self._text, self._at):
                keys.append(str(tomllib.loads(f"key = {quoted.group()}")["key"]))
                parts.append(quoted.span())
                self._at = quoted.end()
            self._skip_blank()
            if not self._take("."):
                return tuple(keys), tuple(parts)

    def _skip_blank(self) -> bool:
        """Go past white space and comments; False at the end of the text."""
        if blank := _BLANK.match(self._text, self._at):
            self._at = blank.end()
        return self._at < len(self._text)

    def _take(self, mark: str) -> bool:
        if self._text.startswith(mark, self._at):
            self._at += len(mark)
            return True
        return False
