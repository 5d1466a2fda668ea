"""The JSON Schema of a protocol file, and the tables of its keys for the documentation."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from copy import deepcopy
from functools import cache
from itertools import chain
from typing import Any, Final, TypeAlias

from pydantic import BaseModel
from pydantic.json_schema import CoreModeRef, DefsRef, GenerateJsonSchema
from pydantic_core import to_jsonable_python

from study_app.documentation import anchor_of
from study_app.number_text import counted
from study_app.protocol.file_format.formats import relax_schema
from study_app.protocol.model import Protocol

_LIQUID_FILE = (
    "Path, relative to this file, to a file with one liquid. Its values are used instead of the keys of this table."
)


_LINEAR_DRAG: Final = {"properties": {"law": {"const": "linear"}}, "required": ["law"]}
_NEED_NO_DENSITY: Final = [{"required": ["file"]}, {"properties": {"drag": _LINEAR_DRAG}, "required": ["drag"]}]
"""Schemas of liquids that need no density: liquid files and dampers."""


class _Generator(GenerateJsonSchema):
    """Writes defaults unchanged, without building a validator for the type of each one."""

    def encode_default(self, dft: Any) -> Any:
        """Return a default as JSON."""
        return to_jsonable_python(dft)

    def get_defs_ref(self, core_mode_ref: CoreModeRef) -> DefsRef:
        """Return the name of a definition; that of a plug-in contains its module."""
        ref = super().get_defs_ref(core_mode_ref)
        if not core_mode_ref[0].startswith("study_app."):
            del self._prioritized_defsref_choices[ref][:2]
        return ref


@cache
def schema(model: type[BaseModel] = Protocol) -> dict[str, Any]:
    """Return the JSON Schema of a protocol file with the meaning of each key."""
    document = model.model_json_schema(schema_generator=_Generator)
    for node in document["properties"].values():
        if "patternProperties" in node:
            node["additionalProperties"] = False
    for table in ("Liquid", "Block"):  # their ID is the name of their table
        for part in document["$defs"].values():
            if part.get("title") == table:
                part["properties"].pop("id")
                part["required"].remove("id")
                if "body" in part["properties"]:  # a study may refer to a liquid file instead
                    part["properties"]["file"] = {"type": "string", "description": _LIQUID_FILE}
                    part["if"], part["then"] = {"not": {"anyOf": _NEED_NO_DENSITY}}, {"required": part.pop("required")}
    if model is Protocol:
        relax_schema(document)
        items = document["$defs"]["Questionnaire"]["properties"]["items"]["items"]
        items["anyOf"] = items.pop("oneOf")  # a statement without a kind also matches a text, whose kind has a default
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **document}


def editor_schema() -> dict[str, Any]:
    """Return the JSON Schema for text editors with completion and checks.

    Unlike `schema`, it permits incomplete questions if an instrument supplies the missing parts.
    """
    document = deepcopy(schema())
    tables = document["$defs"]
    questions = tables["Questionnaire"]
    items = questions["properties"]["items"]["items"]
    complete = items["anyOf"]
    incomplete = [{**tables[kind["$ref"].rsplit("/", 1)[-1]], "required": ["id"]} for kind in complete]
    items["anyOf"] = [*complete, *incomplete]
    questions["then"]["properties"] = {"items": {"items": {"anyOf": complete}}}
    return document


_Node: TypeAlias = Mapping[str, Any]

_TYPES: Final = {"integer": "whole number", "number": "number", "string": "text", "boolean": "`true` or `false`"}
_BOUNDS: Final = {
    "minimum": "at least {}",
    "exclusiveMinimum": "more than {}",
    "maximum": "at most {}",
    "exclusiveMaximum": "less than {}",
}
_LENGTHS: Final = {
    "minItems": ("at least", "entry", "entries"),
    "maxItems": ("at most", "entry", "entries"),
    "maxLength": ("at most", "character", "characters"),
}


def format_markdown() -> str:
    """Return every table of a protocol file, with each key's values, default and meaning, as Markdown."""
    root = schema()
    places = _model_places(root)
    headings = _headings(root, places)
    lines = ["## Top level of the file", "", *_table_lines(root, root, headings)]
    for name, heading in headings.items():
        node = root["$defs"][name]
        lines += ["", f"## {heading}", "", _cell_text(node.get("description", "")), ""]
        if len(places[name]) > 1:
            lines += [f"In {', '.join(f'`{place}`' for place in places[name])}.", ""]
        lines += _table_lines(node, root, headings)
    return "\n".join(lines) + "\n"


def _model_places(root: _Node) -> dict[str, list[str]]:
    """Return the places of each model in the file, in file order, such as ``blocks.NAME.catch``."""
    places: dict[str, list[str]] = {}

    def visit(node: _Node, place: str) -> None:
        for key, below in node.get("properties", {}).items():
            for name, inside in _models(below, f"{place}.{key}" if place else key):
                paths = places.setdefault(name, [])
                if inside not in paths:
                    paths.append(inside)
                    if len(paths) == 1:
                        visit(root["$defs"][name], inside)

    visit(root, "")
    return places


def _models(node: _Node, place: str) -> Iterator[tuple[str, str]]:
    if "$ref" in node:
        yield node["$ref"].rsplit("/", 1)[-1], place
    for branch in (*node.get("anyOf", ()), *node.get("oneOf", ())):
        yield from _models(branch, place)
    if isinstance(node.get("items"), Mapping):
        yield from _models(node["items"], f"{place}[]")
    for inner in (*node.get("patternProperties", {}).values(), node.get("additionalProperties")):
        if isinstance(inner, Mapping):
            yield from _models(inner, f"{place}.NAME")


def _headings(root: _Node, places: Mapping[str, list[str]]) -> dict[str, str]:
    """Return the heading of each model: its first place, with a distinguishing value if several share it."""
    firsts = [paths[0] for paths in places.values()]
    return {
        name: paths[0] if firsts.count(paths[0]) == 1 else f"{paths[0]}, {_distinguishing_value(root['$defs'][name])}"
        for name, paths in places.items()
    }


def _distinguishing_value(node: _Node) -> str:
    for key in ("kind", "law", "instrument"):
        part = node.get("properties", {}).get(key, {})
        values = [part["const"]] if "const" in part else part.get("enum", [])
        if values:
            return f"{key} = {' or '.join(values)}"
    return str(node["title"])


def _table_lines(node: _Node, root: _Node, headings: Mapping[str, str]) -> list[str]:
    rows = [
        f"| `{key}` | {_values_text(part, headings)} | {_default_text(key, part, node)} "
        f"| {_cell_text(_description(part, root))} |"
        for key, part in node.get("properties", {}).items()
    ]
    return ["| key | value | default | meaning |", "| --- | --- | --- | --- |", *rows]


def _values_text(node: _Node, headings: Mapping[str, str]) -> str:
    texts = dict.fromkeys(_alternatives(node, headings))
    return " or ".join(text for text in texts if text)


def _alternatives(node: _Node, headings: Mapping[str, str]) -> Iterator[str]:
    if "$ref" in node:
        heading = headings[node["$ref"].rsplit("/", 1)[-1]]
        yield f"table [{heading}](#{anchor_of(heading)})".replace("[]", "\\[\\]", 1)
    elif branches := node.get("anyOf") or node.get("oneOf"):
        for branch in branches:
            yield from _alternatives(branch, headings)
    elif "const" in node or "enum" in node:
        yield ", ".join(f"`{json.dumps(value)}`" for value in node.get("enum", [node.get("const")]))
    elif node.get("type") == "array":
        yield _list_text(node, headings)
    elif node.get("type") == "object":
        inner_nodes = [*node.get("patternProperties", {}).values(), node.get("additionalProperties")]
        inner_texts = [_values_text(node, headings) for node in inner_nodes if isinstance(node, Mapping)]
        yield (
            f"tables by name, each {inner_texts[0]}"
            if "patternProperties" in node
            else f"table keyed by language or by name: {inner_texts[0]}"
        )
    elif node.get("type") != "null":
        yield ", ".join((_TYPES.get(node.get("type", ""), "any"), *_bound_texts(node)))


def _list_text(node: _Node, headings: Mapping[str, str]) -> str:
    entry = node.get("items")
    values = _values_text(entry, headings) if isinstance(entry, Mapping) else ""
    if "prefixItems" in node:
        values = ", ".join(dict.fromkeys(_values_text(part, headings) for part in node["prefixItems"]))
        return f"list of {len(node['prefixItems'])}: {values}"
    return ", ".join((f"list of: {values}", *_bound_texts(node)))


def _bound_texts(node: _Node) -> Iterator[str]:
    numbers = (template.format(f"{node[key]:g}") for key, template in _BOUNDS.items() if key in node)
    return chain(numbers, length_texts(node))


def length_texts(node: _Node) -> Iterator[str]:
    """Yield the permitted lengths of a list or text, such as "at least 1 entry"."""
    return (f"{bound} {counted(node[key], *noun)}" for key, (bound, *noun) in _LENGTHS.items() if key in node)


def _default_text(key: str, part: _Node, node: _Node) -> str:
    if key in node.get("required", ()):
        return "required"
    exceptions = node.get("if", {}).get("not", {}).get("required", ())
    if exceptions and key in node["then"]["required"]:
        return f"required without {' or '.join(f'`{name}`' for name in exceptions)}"
    value = part.get("default")
    return (
        "" if value is None or value in ([], {}) else f"`{json.dumps(value, ensure_ascii=False)}`".replace("|", "\\|")
    )


def _description(part: _Node, root: _Node) -> str:
    """Return the description of a key, of its only alternative to null, or of its only nested model."""
    alternatives = [branch for branch in part.get("anyOf", ()) if branch.get("type") != "null"]
    candidates = (part, *alternatives) if len(alternatives) == 1 else (part,)
    described = next((candidate for candidate in candidates if "description" in candidate), None)
    models = list(dict.fromkeys(name for name, _ in _models(part, "")))
    if described or len(models) != 1:
        return str((described or {}).get("description", ""))
    return str(root["$defs"][models[0]].get("description", "")).split("\n\n", maxsplit=1)[0]


def _cell_text(text: str) -> str:
    """Return a description without reStructuredText marks, safe in a table cell."""
    text = re.sub(r":\w+:`([^`]+)`", r"`\1`", text).replace("``", "`").replace("\n", " ")
    return text.replace("|", "\\|").replace("*", "\\*").replace("<", "\\<").replace("[", "\\[")
