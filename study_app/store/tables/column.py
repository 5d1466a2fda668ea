"""The description of a table's column."""

from dataclasses import dataclass
from functools import partial
from typing import Literal, TypeAlias

Kind: TypeAlias = Literal["text", "integer", "number", "flag", "time"]

MISSING = "n/a"


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name, the kind of its cells, and their meaning.

    ``kind``: flags are ``true`` or ``false``, times ISO 8601 with zone. ``levels`` are all permitted values where
    these are few, each with its meaning. Where ``may_miss``, a cell can be ``n/a``. A ``sealed`` column can tell the
    condition: no table has it before the study's key was opened.
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


optional = partial(Column, may_miss=True)
"""A column in which a cell can be ``n/a``."""


def unsealed(columns: tuple[Column, ...]) -> tuple[Column, ...]:
    """Return the columns that a table has before the key was opened."""
    return tuple(column for column in columns if not column.sealed)


def header(columns: tuple[Column, ...]) -> tuple[str, ...]:
    """Return the column names in file order."""
    return tuple(column.name for column in columns)
