"""What the JSON Schema of the file format says of a place in a study."""

from collections.abc import Iterator, Mapping
from typing import Any, TypeAlias

from study_app.protocol.source.document import Path, has
from study_app.protocol.source.json_schema import schema

Node: TypeAlias = Mapping[str, Any]
OWN = "own description"
"""Where a node keeps what its own model says of it, if the place it is at has a description, too."""


def node_at(document: Any, path: Path) -> tuple[Node, ...]:
    """Return the schema's alternatives for the value at ``path``, there or not; none where no value is permitted."""
    nodes: list[Node] = [schema()]
    for step in path:
        nodes = [child for node in (table_of(tuple(nodes), document),) if node for child in _children(node, step)]
        nodes = [found for node in nodes for found in alternatives(node)]
        document = document[step] if has(document, step) else None
    return tuple(nodes)


def table_of(nodes: tuple[Node, ...], value: Any) -> Node | None:
    """Return the alternative that a table or array is of: the one whose fixed key, such as ``kind``, is the value's."""
    if isinstance(value, Mapping):
        tables = [node for node in nodes if node.get("type") == "object"]
        return next((node for node in tables if _is_of(node, tables, value)), tables[0] if tables else None)
    several = [node for node in nodes if node.get("type") in {"object", "array"}]
    arrays = [node for node in several if node["type"] == "array"]
    return next(iter(arrays if isinstance(value, tuple) and arrays else several), None)


def tags(nodes: tuple[Node, ...]) -> tuple[str, dict[str | None, Node]]:
    """Return the key that distinguishes the tables, and the table for each of its values; None: the key is left out."""
    tables = [node for node in nodes if node.get("type") == "object" and "properties" in node]
    if len(tables) < 2:
        return "", {}
    keys = {**tables[0]["properties"], **tables[1]["properties"]}
    key = next((key for key in keys if _tells_apart(key, tables)), "")
    return key, {value: node for node in tables for value in _values(node, key) or (None,)} if key else {}


def alternatives(node: Node) -> Iterator[Node]:
    """Yield the alternatives of a node except null, with references resolved and the node's common keys added."""
    around = {key: value for key, value in node.items() if key not in {"$ref", "anyOf", "oneOf", "discriminator"}}
    if "$ref" in node:
        found = schema()["$defs"][node["$ref"].rsplit("/", 1)[-1]]
        yield from (_joined(around, one) for one in alternatives(found))
    elif branches := node.get("anyOf") or node.get("oneOf"):
        for branch in branches:
            yield from (_joined(around, one) for one in alternatives(branch))
    elif node.get("type") != "null":
        yield node


def _joined(around: Node, found: Node) -> Node:
    """Return a node with the words around the union that it is of; its own description is `OWN` then."""
    own = {OWN: found["description"]} if "description" in found and OWN not in found else {}
    return {**found, **own, **around}


def _is_of(node: Node, tables: list[Node], value: Mapping[str, Any]) -> bool:
    key, named = tags(tuple(tables))
    if not key:
        return True
    default = next((name for name, one in named.items() if one["properties"].get(key, {}).get("default") == name), None)
    chosen = value.get(key, None if None in named else default)
    return (chosen is None or isinstance(chosen, str)) and named.get(chosen) is node


def _tells_apart(key: str, tables: list[Node]) -> bool:
    """Return whether the key has different fixed values in each table; one table may lack the key."""
    values = [_values(node, key) for node in tables]
    every = [value for some in values for value in some]
    return sum(map(bool, values)) >= len(tables) - 1 and len(every) == len(set(every))


def _values(node: Node, key: str) -> tuple[str, ...]:
    part = node["properties"].get(key, {})
    return (part["const"],) if "const" in part else tuple(part.get("enum", ()))


def _children(node: Node, step: str | int) -> Iterator[Node]:
    if isinstance(step, int):
        fixed = node.get("prefixItems", ())
        if step < len(fixed):
            yield fixed[step]
        elif isinstance(node.get("items"), Mapping):
            yield node["items"]
    elif step in node.get("properties", {}):
        yield node["properties"][step]
    else:
        yield from node.get("patternProperties", {}).values()
        if isinstance(node.get("additionalProperties"), Mapping):
            yield node["additionalProperties"]
