"""Walking a document as ``tomllib`` reads it (arrays as tuples), whether it is a sound protocol or not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final, TypeAlias

Path: TypeAlias = tuple[str | int, ...]
_TABLE: Final = (dict, Mapping)
"""The first one is what is there nearly always, and found sooner."""


def has(node: Any, step: str | int) -> bool:
    """Return whether ``node`` is a table with that key or an array with that index."""
    if isinstance(step, int):
        return isinstance(node, tuple) and step < len(node)
    return isinstance(node, _TABLE) and step in node


def value_at(document: Any, path: Path) -> Any:
    """Return the value at ``path``, None where there is none."""
    for step in path:
        if not has(document, step):
            return None
        document = document[step]
    return document


def entries(document: Any, pattern: str) -> Iterator[tuple[Path, Any]]:
    """Yield what is at the places of ``pattern`` with their paths: "blocks.*.conditions.*", where ``*`` is any."""
    found: list[tuple[Path, Any]] = [((), document)]
    for step in pattern.split("."):
        found = [
            ((*path, key), value)
            for path, node in found
            for key, value in (_inside(node) if step == "*" else ((step, node[step]),) if has(node, step) else ())
        ]
    return iter(found)


def _inside(node: Any) -> Iterable[tuple[str | int, Any]]:
    """Return what is in a table or array, with its keys or indices."""
    return node.items() if isinstance(node, _TABLE) else enumerate(node) if isinstance(node, tuple) else ()


def names(document: Any, section: str) -> tuple[str, ...]:
    """Return the names of the tables of a section, sound or not."""
    return tuple(str(path[1]) for path, _ in entries(document, f"{section}.*") if isinstance(path[1], str))


def frozen(value: Any) -> Any:
    """Return what ``tomllib`` read with its arrays as tuples.

    Raises
    ------
    ValueError
        It holds a whole number beyond 64 bits, which TOML does not have.
    """
    if isinstance(value, list):
        return tuple(frozen(entry) for entry in value)
    if isinstance(value, dict):
        return {key: frozen(entry) for key, entry in value.items()}
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError("TOML has whole numbers of 64 bits")
    return value
