"""Edits that change the kind of a table."""

from collections.abc import Mapping
from typing import Any

from study_app.designer.document.edited_study import Study
from study_app.designer.document.initial_values import initial
from study_app.designer.document.schema_nodes import node_at, table_of, tags
from study_app.designer.document.writer.edits import Edit, Set, Unset
from study_app.designer.document.writer.refused import Refused
from study_app.protocol.source.document import Path, has


def switched(study: Study, path: Path, kind: str | None, left: Mapping[str, Any]) -> tuple[Edit, ...]:
    """Return the edits that change the kind of a table.

    Keys of both kinds keep their values, the others are removed; keys that the new kind needs get the value that they
    had before, or an initial one.

    Parameters
    ----------
    study : Study
        The study.
    path : tuple of str or int
        The table.
    kind : str or None
        Its new kind; None omits the key, if that is a kind.
    left : mapping
        Values of keys that were removed by earlier switches (`left_by`).

    Raises
    ------
    Refused
        There is no such kind.
    """
    key, node = _of_kind(study, path, kind)
    table = _table(study, path)
    edits: list[Edit] = [Unset((*path, name)) for name in table if name != key and name not in node["properties"]]
    if kind is not None:
        edits.insert(0, Set((*path, key), kind))
    elif key in table:
        edits.insert(0, Unset((*path, key)))
    after, _ = study.edited(*edits)
    wanted = [name for name in left if name in node["properties"] and name not in table]
    needed = [name for name in node.get("required", ()) if name not in {*table, *wanted, key}]
    return (
        *edits,
        *(Set((*path, name), left[name]) for name in wanted),
        *(Set((*path, name), initial(after.document, (*path, name))) for name in needed),
    )


def left_by(study: Study, path: Path, kind: str | None) -> dict[str, Any]:
    """Return the values that `switched` removes, for a switch back.

    Raises
    ------
    Refused
        There is no such kind.
    """
    key, node = _of_kind(study, path, kind)
    return {
        name: value for name, value in _table(study, path).items() if name != key and name not in node["properties"]
    }


def _of_kind(study: Study, path: Path, kind: str | None) -> tuple[str, Mapping[str, Any]]:
    key, named = tags(node_at(study.document, path))
    if not key or kind not in named:
        raise Refused(f"there is no kind {kind!r} here: {', '.join(map(str, named))}")
    node = table_of((named[kind],), {})
    if node is None:
        raise Refused(f"{kind} is not a kind of table")
    return key, node


def _table(study: Study, path: Path) -> Mapping[str, Any]:
    value: Any = study.document
    for step in path:
        value = value[step] if has(value, step) else {}
    return value if isinstance(value, Mapping) else {}
