"""pydantic's errors as sentences for the author of the file: key, value, permitted values, and a hint."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, Literal, NamedTuple, TypeAlias

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from study_app.errors import Problem
from study_app.haptics.model.ranges import OF_MOST, REASON
from study_app.protocol.source.document import Path, Places, has

Schema = Mapping[str, Any]


_FaultKind: TypeAlias = Literal[
    "", "missing", "unknown key", "unknown name", "surplus", "other language", "one language", "alike", "not a number",
    "not in sequence", "part", "no text",
]  # fmt: skip
"""The kind of a fault, if it determines the repair: "surplus" is a key or entry that is not permitted here, "other
language" a text in a language that the study does not have, "one language" a plain text in a study with several
languages, "alike" a text that repeats another one, "part" the number of a part of the session, "no text" a text that is
missing in a language; "" is any other fault."""


class Fault(NamedTuple):
    """A problem before its line is known; indices in ``path`` count from 0.

    ``missing_language`` is the code of the language in which a text is missing, "" for other problems. ``use`` is a
    path and a value that may repair the fault, or for an unknown key the path and the suggested key; ``permitted`` are
    the permitted words if the value resembles none of them.
    """

    path: Path
    message: str
    hint: str = ""
    counts_entries: bool = False
    missing_language: str = ""
    use: tuple[Path, Any] | None = None
    kind: _FaultKind = ""
    permitted: tuple[str, ...] = ()

    def concerns(self, language: str, first: str) -> bool:
        """Return whether the fault is visible in texts of a language; plain texts are in ``first``."""
        return self.missing_language in ("", language) and not (self.kind == "one language" and language == first)

    def located(self, places: Places) -> Problem:
        """Return the problem with its line; in its displayed path, entries count from 1.

        The hint of a surplus key or entry also suggests removing it, as the designer does.
        """
        place = ".".join(str(step + 1) if isinstance(step, int) else step for step in self.path)
        hints = (self.hint, "remove it" if self.kind == "surplus" else "")
        return Problem(place or "file", self.message, places.line(self.path), hint=", or ".join(filter(None, hints)))


_PATTERNS = {
    r"^[a-z][a-z0-9_]*$": "lowercase letters, digits and underscores, starting with a letter",
    r"^[a-z0-9][a-z0-9_]*$": "lowercase letters, digits and underscores",
    r"^[a-z][a-z0-9]*$": "lowercase letters and digits (no underscores), starting with a letter",
    r"^[A-Za-z][A-Za-z0-9_]*$": "letters, digits and underscores, starting with a letter",
    r"^[a-z][a-z0-9-]*(:.+)?$": "the name of a device, such as falcon or scripted",
    r"^[a-z][a-z0-9-]*$": "lowercase letters, digits and hyphens, starting with a letter",
    r"^[^\x00]+$": "at least one character, and no NUL character",
    r"^(https?://\S+)?$": "an address that starts with http:// or https://",
    r"^([a-z]+:[^\x00-\x1f]+)?$": "a kind and an address, such as serial:/dev/ttyUSB0",
    r"^[a-z]{2}$": "a language code of two lowercase letters, such as en",
    r"^[A-Z]$": "one capital letter",
    r"^(tank|camera|[^\x00]+\.[0-9A-Za-z]+)$": "tank, camera, or a file such as film.mp4",
    r"^[0-9A-Za-z.+-]+$": "letters, digits, dots, plus and minus signs",
}

_KINDS = {
    "string_type": "a string",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "tuple_type": "an array",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "finite_number": "a finite number",
}

_BOUNDS = {
    "greater_than": ("gt", "more than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
_NO_BOUND: Final = 1e9
"""Bounds of at least this size are limits of the computer, which a message does not state."""
_LENGTHS = {
    "too_short": "has too few entries ({actual_length}): it needs at least {min_length}",
    "too_long": "has too many entries ({actual_length}): it may have at most {max_length}",
    "string_too_long": "{shown} is longer than {max_length} characters",
}


def shown_value(value: Any) -> str:
    """Return a value as shortened TOML text."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if len(value) <= 40 else f'"{value[:37]}…"'
    if isinstance(value, int | float):
        return f"{value:g}"
    return "a table" if isinstance(value, Mapping) else "an array" if isinstance(value, Sequence) else str(value)


def rule_of(pattern: str) -> str:
    """Return the text that describes a pattern's rule."""
    return _PATTERNS.get(pattern, "text in a different format")


def did_you_mean(word: str, permitted: Iterable[str]) -> str:
    """Return "did you mean …?" with the nearest permitted word, or the list of words if none is near."""
    known = sorted(permitted)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    if near:
        return f'did you mean "{near[0]}"?'
    return f"known: {', '.join(known)}" if known else ""


def unknown_name(path: Path, message: str, word: str, permitted: Iterable[str], cutoff: float = 0.0) -> Fault:
    """Return the fault of an unknown name, with the nearest permitted name or the list of names."""
    known = sorted(permitted)
    nearest = difflib.get_close_matches(word, known, n=1, cutoff=cutoff)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    use, unlike = (path, nearest[0]) if nearest else None, () if near else tuple(known)
    return Fault(path, message, did_you_mean(word, known), use=use, kind="unknown name", permitted=unlike)


def _unknown_value(path: Path, value: Any, message: str, permitted: str) -> Fault:
    """Return the fault of a value that is not among the quoted words in ``permitted``, with the nearest word."""
    near = difflib.get_close_matches(str(value), re.findall('"([^"]*)"', permitted), n=1)
    return Fault(path, message, f'did you mean "{near[0]}"?', use=(path, near[0])) if near else Fault(path, message)


def faults_of(error: ValidationError, document: Mapping[str, Any], schema: Schema) -> list[Fault]:
    """Return pydantic's findings in ``document`` as faults; ``schema`` is its JSON Schema."""
    faults = [_fault(details, document, schema) for details in error.errors(include_url=False)]
    paths = [fault.path for fault in faults]
    return [  # pydantic does not count invalid entries of an array, so that its length seems wrong
        fault
        for fault in faults
        if not (fault.counts_entries and any(path[:-1][: len(fault.path)] == fault.path for path in paths))
    ]


def _meaning(properties: Sequence[Schema]) -> str:
    """Return the first sentence of a key's description in lower case; "" without one."""
    description = next((str(node["description"]) for node in properties if "description" in node), "")
    sentence = re.split(r"[.;:](?:\s|$)", description, maxsplit=1)[0]
    return sentence[:1].lower() + sentence[1:]


def _fault(details: ErrorDetails, document: Mapping[str, Any], schema: Schema) -> Fault:
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    path = _path_in(document, details["loc"], keep_last=kind in {"missing", "extra_forbidden"})
    if "place" in context:
        path = (*path, context["place"])
    if kind == "missing":
        last = path[-1]
        if isinstance(last, int):
            return Fault(path, f"entry {last + 1} is missing")
        properties = [node.get("properties", {}).get(last, {}) for node in _nodes_at(document, path[:-1], schema)]
        constant = next((key["const"] for key in properties if "const" in key), None)
        hint = _meaning(properties) if constant is None else f"write {last} = {shown_value(constant)}"
        return Fault(path, "is missing", hint, kind="missing")
    if kind == "extra_forbidden":
        permitted = {key for node in _nodes_at(document, path[:-1], schema) for key in node.get("properties", {})}
        hint = did_you_mean(str(path[-1]), permitted)
        near_keys = difflib.get_close_matches(str(path[-1]), sorted(permitted), n=1)
        return Fault(path, "unknown key", hint, use=(path, near_keys[0]) if near_keys else None, kind="unknown key")
    if kind == "union_tag_not_found":
        key = _tag_key(context)
        choices = (node.get("properties", {}).get(key, {}) for node in _nodes_at(document, path, schema))
        values = [f'"{value}"' for choice in choices for value in choice.get("enum", (choice.get("const"),)) if value]
        return Fault((*path, key), "is missing", f"one of {', '.join(values)}", kind="missing")
    if kind == "union_tag_invalid":
        tag, tags = context["tag"], str(context["expected_tags"]).replace("'", '"')
        return _unknown_value((*path, _tag_key(context)), tag, f'"{tag}" is not one of {tags}', tags)
    if kind == "question_kind":
        tag = str(value["kind"])
        return unknown_name(path, f"{shown_value(tag)} {details['msg']}", tag, context["permitted"].split(", "))
    if kind == "literal_error":
        expected = str(context["expected"]).replace("'", '"')
        return _unknown_value(path, value, f"must be {expected}, not {shown_value(value)}", expected)
    if kind in _BOUNDS:
        key, expected = _BOUNDS[kind]
        names = (REASON, OF_MOST) if key in {"lt", "le"} else (REASON,)
        hints = (node.get(name, "") for node in _nodes_at(document, path, schema) for name in names)
        bound = int(context[key]) if float(context[key]).is_integer() else context[key]
        reason = next(filter(None, hints), "")
        if abs(bound) >= _NO_BOUND:
            return Fault(path, f"is {shown_value(value)}, which is too {'small' if bound < 0 else 'large'}", reason)
        sentence = f"is {shown_value(value)}, but must be {expected} {shown_value(bound)}"
        return Fault(path, sentence, reason, use=(path, bound) if key in {"ge", "le"} else None)
    if kind in _KINDS:
        number: _FaultKind = "not a number" if "number" in _KINDS[kind] else ""
        return Fault(path, f"must be {_KINDS[kind]}, not {shown_value(value)}", kind=number)
    if kind == "string_pattern_mismatch":
        return Fault(path, f"{shown_value(value)} is not permitted: use {rule_of(str(context['pattern']))}")
    if kind in _LENGTHS:
        details_by_name = {**context, "shown": shown_value(value)}
        return Fault(path, _LENGTHS[kind].format(**details_by_name), counts_entries=kind == "too_short")
    use = context.get("use")
    sentence = details["msg"].removeprefix("Value error, ")
    repair = ((*path[:-1], use[0]), use[1]) if use else None
    return Fault(path, sentence, context.get("hint", ""), use=repair, kind=context.get("kind", ""))


def _tag_key(context: Mapping[str, Any]) -> str:
    return str(context["discriminator"]).strip("'")


def _path_in(document: Any, loc: tuple[str | int, ...], *, keep_last: bool) -> Path:
    """Return ``loc`` without the parts that are not in the document, such as union tags and validator names."""
    path: list[str | int] = []
    node = document
    tagged: Any = None
    for position, step in enumerate(loc):
        if node is not tagged and isinstance(node, Mapping) and node.get("kind") == step:
            tagged = node  # the step is the tag of a union, even if the table has a key with this name
            continue
        if has(node, step):
            node = node[step]
        elif not (keep_last and position == len(loc) - 1):
            continue
        path.append(step)
    return tuple(path)


def _nodes_at(document: Any, path: Path, schema: Schema) -> list[Schema]:
    """Return the schema's alternatives for the value at ``path``."""
    nodes = list(_alternatives(schema, schema, document))
    for step in path:
        document = document[step]
        nodes = [
            alternative
            for node in nodes
            for child in _children(node, step)
            for alternative in _alternatives(child, schema, document)
        ]
    return nodes


def _children(node: Schema, step: str | int) -> Iterator[Schema]:
    if isinstance(step, int):
        prefix_items = node.get("prefixItems", ())
        if step < len(prefix_items):
            yield prefix_items[step]
        elif "items" in node:
            yield node["items"]
    elif step in node.get("properties", {}):
        yield node["properties"][step]
    else:
        yield from node.get("patternProperties", {}).values()


def _alternatives(node: Schema, schema: Schema, value: Any) -> Iterator[Schema]:
    """Yield the alternatives of a node; of several tables, only those whose fixed keys (kind, law) match the value."""
    if "$ref" in node:
        yield from _alternatives(schema["$defs"][node["$ref"].rsplit("/", 1)[-1]], schema, value)
    elif branches := node.get("anyOf") or node.get("oneOf"):
        for branch in branches:
            yield from _alternatives(branch, schema, value)
    elif all(
        part["const"] == value.get(key, part["const"])
        for key, part in node.get("properties", {}).items()
        if "const" in part and isinstance(value, Mapping)
    ):
        yield node
