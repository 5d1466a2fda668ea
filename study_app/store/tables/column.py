"""What a column of a table is: its name, the values of its cells and their meaning."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Literal, NamedTuple, TypeAlias

from study_app.store.tables.formulas import unguarded

Kind: TypeAlias = Literal["text", "integer", "number", "flag", "time"]

MISSING = "n/a"


class _Cells(NamedTuple):
    words: str
    pattern: str
    read: Callable[[str], Any]


def _number(cell: str) -> float:
    """Return a number; a whole one as a whole number, so that it is written again as it was read."""
    return int(cell) if re.fullmatch("-?[0-9]{1,15}", cell) else float(cell)


_KINDS: Final[dict[Kind, _Cells]] = {
    "text": _Cells("a text", r"[\s\S]*", unguarded),
    "integer": _Cells("a whole number", r"-?[0-9]{1,18}", int),
    "number": _Cells("a number", r"-?[0-9]+(\.[0-9]+)?(e[+-]?[0-9]+)?", _number),
    "flag": _Cells("true or false", "true|false", "true".__eq__),
    "time": _Cells(
        "a time with zone", r"[0-9]{4}(-[0-9]{2}){2}T[0-9]{2}(:[0-9]{2}){2}\.[0-9]{3}[+-][0-9]{2}:[0-9]{2}", str
    ),
}


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name, the kind of its cells, and their meaning.

    ``kind``: flags are ``true`` or ``false``, times ISO 8601 with zone. ``levels`` are all permitted values where
    these are few, each with its meaning. Where ``may_miss``, a cell can be ``n/a``. A ``sealed`` column can tell the
    condition: no table has it before the study's key was opened. Earlier versions did not write a ``later`` column:
    a table without them is read as if they held ``n/a``.
    """

    name: str
    kind: Kind
    description: str
    unit: str = ""
    levels: tuple[tuple[str, str], ...] = ()
    minimum: float | None = None
    maximum: float | None = None
    may_miss: bool = False
    sealed: bool = False
    later: bool = False

    def value(self, cell: str) -> Any:
        """Return what a cell holds, None where it is missing.

        Raises
        ------
        ValueError
            The column permits no such cell.
        """
        if cell == MISSING and self.may_miss:
            return None
        if re.fullmatch(self.pattern, cell):
            value = _KINDS[self.kind].read(cell)
            low, high = (-math.inf if self.minimum is None else self.minimum), self.maximum
            bounded = self.kind in {"integer", "number"}
            if not bounded or (low <= value <= (math.inf if high is None else high) and math.isfinite(value)):
                return value
        raise ValueError(f"{(cell if len(cell) <= 40 else cell[:39] + '…')!r} is not {self.permitted}")

    @property
    def pattern(self) -> str:
        """The regular expression of a cell that is not missing."""
        return "|".join(level for level, _ in self.levels) or _KINDS[self.kind].pattern

    @property
    def permitted(self) -> str:
        """What a cell may be, in words."""
        levels = ", ".join(level for level, _ in self.levels)
        words = f"one of {levels}" if levels else _KINDS[self.kind].words
        if self.maximum is not None:
            words += f" from {self.minimum:g} to {self.maximum:g}"
        elif self.minimum is not None:
            words += f" of at least {self.minimum:g}"
        return f"{words} or {MISSING}" if self.may_miss else words

    @property
    def variable(self) -> dict[str, Any]:
        """The column as a schema.org PropertyValue."""
        meanings = "; ".join(f"{level}: {meaning}" for level, meaning in self.levels)
        described = {
            "@type": "PropertyValue",
            "name": self.name,
            "description": f"{self.description} Levels: {meanings}." if meanings else self.description,
        }
        more = {"unitText": self.unit or None, "minValue": self.minimum, "maxValue": self.maximum}
        return described | {name: value for name, value in more.items() if value is not None}


optional = partial(Column, may_miss=True)
"""A column in which a cell can be ``n/a``."""


def unsealed(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return the columns that a table has before the key was opened."""
    return tuple(column for column in columns if not column.sealed)


def header(columns: tuple[Column, ...]) -> tuple[str, ...]:
    """Return the column names in file order."""
    return tuple(column.name for column in columns)
