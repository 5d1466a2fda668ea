"""Documents with one value changed: the other values are shared, no file is written."""

from collections.abc import Mapping
from typing import Any

from study_app.protocol.source.document import Path, has


def with_value(node: Any, path: Path, value: Any) -> Any:
    """Return a document with a value at a path; unchanged if its parent is missing."""
    if not path:
        return value
    step, rest = path[0], path[1:]
    if isinstance(node, Mapping):
        return {**node, step: with_value(node.get(step, {}), rest, value)}
    if isinstance(step, int) and isinstance(node, tuple) and step < len(node):
        return (*node[:step], with_value(node[step], rest, value), *node[step + 1 :])
    return node


def without_value(node: Any, path: Path) -> Any:
    """Return a document without the value at a path; unchanged if there is none."""
    step, rest = path[0], path[1:]
    if not has(node, step):
        return node
    if isinstance(node, Mapping):
        if not rest:
            return {key: value for key, value in node.items() if key != step}
        return {**node, step: without_value(node[step], rest)}
    assert isinstance(step, int)  # noqa: S101 - of an array
    inner = () if not rest else (without_value(node[step], rest),)
    return (*node[:step], *inner, *node[step + 1 :])
