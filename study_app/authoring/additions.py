"""New elements: with the keys that check asks for, and valid initial values; only their texts are left to write."""

from __future__ import annotations

import string
from collections.abc import Mapping
from typing import Any, Final

from study_app.authoring.fields import Row, label_of, row_at, rows
from study_app.authoring.names import free_name
from study_app.authoring.repairs import repairs
from study_app.authoring.schema_nodes import Node, node_at, table_of
from study_app.authoring.study import Study
from study_app.authoring.writer.edits import Duplicate, Edit, Insert, Set
from study_app.authoring.writer.refused import Refused
from study_app.protocol.forms.scale import POINTS
from study_app.protocol.source.document import Path, entries, has, names
from study_app.protocol.source.problems import Fault, rule_of

SINGULAR: Final = {"items": "question", "stimuli": "stimulus"}
"""What an element of a section is called, where it is not the section without its last letter."""
_ROUNDS: Final = 12
_LETTER: Final = "^[A-Z]$"


def added(
    study: Study,
    section: Path,
    kind: Mapping[str, Any] | None = None,
    *,
    name: str = "",
    behind: str | int | None = None,
) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that add an element to a section or list, as one step, and the path of the element.

    Parameters
    ----------
    study : Study
        The study; faults that it has already stay.
    section : tuple of str or int
        A section of tables, as ``("liquids",)``, or a list of tables, as ``("questionnaires", "load", "items")``.
    kind : mapping, optional
        Keys that the element begins with, such as its kind.
    name : str
        What a table is called if that is free; "" for what its section holds.
    behind : str or int, optional
        The table or entry of the section that it is written after; the last one without.

    Raises
    ------
    Refused
        Nothing can be added there.
    """
    row = row_at(study.document, section)
    if row is None or row.kind not in {"tables", "list"}:
        raise Refused(f"nothing can be added to {label_of(section[-1])}")
    several = row.kind == "list"
    value: dict[str, Any] = dict(kind or {})
    path: Path
    first: Edit
    if several:
        count = len(row.value or ())
        path = (*section, behind + 1 if isinstance(behind, int) and behind < count else count)
        first = Insert(path, value) if row.value else Set(section, [value])
    else:
        path = (*section, free_name(names(study.document, str(section[0])), name or singular(section[-1])))
        first = Set(path, value, behind if isinstance(behind, str) else None)
    others: list[Edit] = []
    tried = {(fault.path, fault.message) for fault in study.faults}
    for _ in range(_ROUNDS):
        after, _splices = study.edited(first, *others)
        fault = next((one for one in after.faults if (one.path, one.message) not in tried), None)
        if fault is None:
            break
        tried.add((fault.path, fault.message))
        if (
            fault.path[: len(path)] == path
            and _value(after.document, fault.path) is None
            and len(fault.path) > len(path)
        ):
            _put(value, fault.path[len(path) :], initial(after.document, fault.path))
        else:
            others += _outside(after, fault)
    return (first, *others), path


def duplicated(study: Study, path: Path) -> tuple[tuple[Edit, ...], Path]:
    """Return the edits that copy an element right after itself, as one step, and the path of the copy.

    The copy has the next free name and code letter, and a place in the session where it needs one. Its texts are those
    of the original.

    Raises
    ------
    Refused
        There is no such element.
    """
    table = _value(study.document, path)
    if not isinstance(table, Mapping):
        raise Refused(f"{label_of(path[-1])} cannot be copied")
    last = path[-1]
    name = table.get("id", last) if isinstance(last, int) else last
    if isinstance(last, int):
        pattern = ".".join((*map(str, path[:2]), "*", "*"))
        taken = [entry.get("id") for _, entry in entries(study.document, pattern) if isinstance(entry, Mapping)]
        copy: Path = (*path[:-1], last + 1)
        edits: list[Edit] = [Duplicate(path)]
        if isinstance(name, str):
            edits.append(Set((*copy, "id"), free_name(filter(None, taken), name)))
    else:
        copy = (*path[:-1], free_name(names(study.document, str(path[0])), str(name)))
        edits = [Duplicate(path, str(copy[-1]))]
    return (*edits, *fitted(study, study.edited(*edits)[0], copy)), copy


def fitted(before: Study, after: Study, path: Path) -> tuple[Edit, ...]:
    """Return the edits that a copied element needs besides: a free code letter, and a place in the session.

    Parameters
    ----------
    before, after : Study
        The study without and with the copy.
    path : tuple of str or int
        The copy.
    """
    edits: list[Edit] = []
    for row in rows(after.document, path):
        if row.value is not None and rule_of(_LETTER) in row.bounds:
            letters = [letter for _, letter in entries(after.document, f"{path[0]}.*.{row.path[-1]}")]
            edits += [Set(row.path, initial(after.document, row.path))] if letters.count(row.value) > 1 else []
    after, _ = after.edited(*edits)
    for fault in after.faults:
        if fault.path == path and fault not in before.faults:
            edits += _outside(after, fault)
    return tuple(edits)


def _outside(study: Study, fault: Fault) -> tuple[Edit, ...]:
    """Return the edits elsewhere that a new element needs, such as its place in the session."""
    offered = repairs(study, fault)
    return offered[0].edits if offered else ()


def singular(section: str | int) -> str:
    """Return what an element of a section is called: "liquid" of ``liquids``."""
    return SINGULAR.get(str(section), str(section).removesuffix("s"))


def initial(document: Mapping[str, Any], path: Path) -> Any:
    """Return a valid value for a key that is not in the study.

    Raises
    ------
    Refused
        The key is not known.
    """
    row = row_at(document, path)
    if row is None or row.kind == "unknown":
        raise Refused(f"{label_of(path[-1])} is not a key of this table")
    if row.default not in (None, [], {}):
        return row.default
    nodes = node_at(document, path)
    node = table_of(nodes, None) or nodes[0]
    return _initial(document, row.either[0] if row.kind == "either" else row, node)


def _initial(document: Mapping[str, Any], row: Row, node: Node) -> Any:
    path, kind = row.path, row.kind
    if kind in {"localised", "paragraphs", "text"}:
        return _text(document, path, node, localised=kind != "text")
    if kind in {"choice", "kind", "reference"}:
        return next((choice.value for choice in row.choices if choice.value is not None), "")
    if kind in {"references", "choices"}:
        used = [choice.value for choice in row.choices]
        return used[: max(1, node.get("minItems", 1))]
    if kind == "switch":
        return False
    if kind in {"number", "whole number"}:
        return _number(node, 1)
    if kind in {"vector", "numbers"}:
        parts = node.get("prefixItems") or [node["items"]] * node.get("minItems", 1)
        return [_number(part, place) for place, part in enumerate(parts, start=1)]
    if kind == "points":
        size = len(node["items"]["prefixItems"])
        return [[x] + [0] * (size - 1) for x in (-20, 20)][: max(2, node.get("minItems", 2))]
    if kind == "texts":
        return [label_of(f"text_{number}") for number in range(1, node.get("minItems", 1) + 1)]
    if kind == "tables" and node.get("additionalProperties", {}).get("type") == "array":
        points = [f"Point {number}" for number in range(1, POINTS + 1)]
        return {str(language): points for _, language in entries(document, "study.languages.*")}
    return _tables(document, path, node) if kind == "list" else {}


def _tables(document: Mapping[str, Any], path: Path, node: Node) -> list[dict[str, Any]]:
    """Return as many tables as a list needs, each with its required keys."""
    found: list[dict[str, Any]] = []
    for number in range(max(1, node.get("minItems", 1))):
        place = (*path, number)
        table = table_of(node_at(document, place), {})
        required = () if table is None else table.get("required", ())
        name = f"{singular(path[-1])}_{number + 1}"
        text = _in_languages(document, label_of(name))
        found.append({key: name if key == "id" else text if key == "text" else initial(document, (*place, key))
                      for key in required})  # fmt: skip
    return found


def _text(document: Mapping[str, Any], path: Path, node: Node, *, localised: bool) -> Any:
    around = _value(document, path[:-1])
    if path[-1] == "id":
        taken = (str(name) for _, name in entries(document, ".".join((*map(str, path[:2]), "*", "*", "id"))))
        return free_name(taken, singular(path[-3]))
    if node.get("pattern") == _LETTER:
        used = {letter for _, letter in entries(document, f"{path[0]}.*.{path[-1]}")}
        return next((letter for letter in string.ascii_uppercase if letter not in used), "Z")
    name = around.get("id", path[-2]) if isinstance(around, Mapping) else path[-2]
    words = f"New {label_of(str(name)).lower()}"
    return _in_languages(document, words) if localised else words


def _in_languages(document: Mapping[str, Any], words: str) -> Any:
    languages = [str(name) for _, name in entries(document, "study.languages.*")]
    return dict.fromkeys(languages, words) if len(languages) > 1 else words


def _number(node: Node, wanted: float) -> float:
    least, most = node.get("minimum", node.get("exclusiveMinimum", wanted)), node.get("maximum", wanted)
    number = min(max(wanted, least), most)
    return int(number) if float(number).is_integer() else number


def _value(document: Any, path: Path) -> Any:
    for step in path:
        if not has(document, step):
            return None
        document = document[step]
    return document


def _put(value: dict[str, Any], path: Path, inner: Any) -> None:
    for step in path[:-1]:
        value = value.setdefault(str(step), {})
    value[str(path[-1])] = inner
