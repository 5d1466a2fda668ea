"""Where in a TOML file a key stands: a scan that keeps line numbers, which ``tomllib`` does not.

It reads files that ``tomllib`` has accepted, so it only has to follow structure, not to judge it.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right

from study_app.protocol.source.document import Path

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?!")'
    r"|'''.*?'''(?!')"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)
_SCALAR = re.compile(r"[^,\]}#\n]*")


class Places:
    """The line of every key, table and array entry of a TOML text.

    Paths are keys and, for entries of arrays, indices from 0: ``("blocks", "liquids", "conditions", 2)``.
    """

    def __init__(self, source: str) -> None:
        self._text = source
        self._at = 0
        self._line_starts = [0, *(match.end() for match in re.finditer("\n", source))]
        self._lines: dict[Path, int] = {}
        self._array_tables: dict[Path, int] = {}
        self._document()

    def line(self, path: Path) -> int | None:
        """Return the line (from 1) of ``path``, or of the innermost table around it that is in the file."""
        for length in range(len(path), 0, -1):
            if (line := self._lines.get(path[:length])) is not None:
                return line
        return None

    def _document(self) -> None:
        table: Path = ()
        while self._skip_blank():
            if self._take("[["):
                table = self._array_table_header()
            elif self._take("["):
                line = self._line()
                table = self._within_arrays(self._key())
                self._take("]")
                self._record(table, line)
            else:
                self._assignment(table)

    def _array_table_header(self) -> Path:
        line = self._line()
        path = self._within_arrays(self._key())
        self._take("]]")
        index = self._array_tables.get(path, 0)
        self._array_tables[path] = index + 1
        self._record((*path, index), line)
        return (*path, index)

    def _within_arrays(self, keys: Path) -> Path:
        """Return the path a header names: on the way, an array of tables stands for its latest entry."""
        path: Path = ()
        for key in keys[:-1]:
            path = (*path, key)
            if path in self._array_tables:
                path = (*path, self._array_tables[path] - 1)
        return (*path, keys[-1])

    def _assignment(self, table: Path) -> None:
        line = self._line()
        path = table + self._key()
        self._record(path, line)
        self._skip_blank()
        self._take("=")
        self._skip_blank()
        self._value(path)

    def _value(self, path: Path) -> None:
        if self._take("["):
            index = 0
            while self._skip_blank() and not self._take("]"):
                self._record((*path, index), self._line())
                self._value((*path, index))
                index += 1
                self._skip_blank()
                self._take(",")
        elif self._take("{"):
            while self._skip_blank() and not self._take("}"):
                self._assignment(path)
                self._skip_blank()
                self._take(",")
        elif string := _STRING.match(self._text, self._at):
            self._at = string.end()
        elif scalar := _SCALAR.match(self._text, self._at):
            self._at = scalar.end()

    def _key(self) -> Path:
        """Read a key, dotted or not, quoted or not."""
        keys: list[str] = []
        while True:
            self._skip_blank()
            if bare := _BARE_KEY.match(self._text, self._at):
                keys.append(bare.group())
                self._at = bare.end()
            elif quoted := _STRING.match(self._text, self._at):
                keys.append(str(tomllib.loads(f"key = {quoted.group()}")["key"]))
                self._at = quoted.end()
            self._skip_blank()
            if not self._take("."):
                return tuple(keys)

    def _record(self, path: Path, line: int) -> None:
        for length in range(1, len(path)):
            self._lines.setdefault(path[:length], line)
        self._lines[path] = line

    def _line(self) -> int:
        return bisect_right(self._line_starts, self._at)

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
