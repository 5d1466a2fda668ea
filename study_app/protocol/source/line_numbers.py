"""Where in a TOML file a key stands: its line number, which ``tomllib`` does not keep."""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property, lru_cache

from study_app.protocol.source.document import Path
from study_app.protocol.source.notation import scan


class Places:
    """The line of every key, table and array entry of a TOML text.

    Paths are keys and, for entries of arrays, indices from 0: ``("blocks", "liquids", "conditions", 2)``.
    """

    def __init__(self, source: str) -> None:
        self._source = source

    @cached_property
    def _lines(self) -> dict[Path, int]:
        """The lines by path; a text without problems is not scanned for them."""
        line_starts = [0, *(match.end() for match in re.finditer("\n", self._source))]
        found: dict[Path, int] = {}
        for node in scan(self._source):
            line = bisect_right(line_starts, node.start)
            for length in range(1, len(node.path)):
                found.setdefault(node.path[:length], line)
            found[node.path] = line
        return found

    def line(self, path: Path) -> int | None:
        """Return the line (from 1) of ``path``, or of the innermost table around it that is in the file."""
        for length in range(len(path), 0, -1):
            if (line := self._lines.get(path[:length])) is not None:
                return line
        return None


@lru_cache(maxsize=2)
def places_of(text: str) -> Places:
    """Return the lines of a TOML text, which may end its lines as it likes."""
    return Places(text.replace("\r\n", "\n"))
