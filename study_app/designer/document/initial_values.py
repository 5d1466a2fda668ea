"""Valid initial values for keys that are not in a study."""

import string
from collections.abc import Mapping
from typing import Any, Final

from study_app.designer.document.fields import Row, label_of, row_at
from study_app.designer.document.schema_nodes import Node, node_at, table_of
from study_app.designer.document.writer.refused import Refused
from study_app.ids import free_id
from study_app.number_text import counted
from study_app.protocol.questions import POINTS
from study_app.protocol.source.document import Path, entries, value_at

SINGULAR: Final = {"items": "question", "stimuli": "stimulus", "analysis": "analysis"}
"""Singular names of sections' elements that are not the section's name without its last letter."""
_PLURAL: Final = {"items": "questions"}
"""Plural names of sections' elements that are not the section's name."""
LETTER: Final = "^[A-Z]$"


def singular(section: str | int) -> str:
    """Return the name of an element of a section: "liquid" of ``liquids``."""
    return SINGULAR.get(str(section), str(section).removesuffix("s"))


def counted_elements(number: int, section: str | int) -> str:
    """Return "1 stimulus", "2 stimuli" of ``stimuli``."""
    return counted(number, singular(section), _PLURAL.get(str(section), str(section)))


def new_text(section: str | int) -> str:
    """Return the initial text of an element of a list: "New question" of ``items``."""
    return f"New {singular(section)}"


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
    entry = node.get("additionalProperties")
    if kind == "tables" and isinstance(entry, Mapping) and entry.get("type") == "array":
        points = [f"Point {number}" for number in range(1, POINTS + 1)]
        return dict.fromkeys(_languages(document) or ["en"], points)
    return _tables(document, path, node) if kind == "list" else {}


def _tables(document: Mapping[str, Any], path: Path, node: Node) -> list[Any]:
    """Return the least number of tables of a list, each with its required keys; or of lists, as of sequences."""
    found: list[Any] = []
    for number in range(max(1, node.get("minItems", 1))):
        place = (*path, number)
        if node["items"].get("type") == "array":
            found.append(initial(document, place))
            continue
        table = table_of(node_at(document, place), {})
        required = () if table is None else table.get("required", ())
        name = f"{singular(path[-1])}_{number + 1}"
        text = _in_languages(document, label_of(name))
        found.append({key: name if key == "id" else text if key == "text" else initial(document, (*place, key))
                      for key in required})  # fmt: skip
    return found


def _text(document: Mapping[str, Any], path: Path, node: Node, *, localised: bool) -> Any:
    around = value_at(document, path[:-1])
    if path[-1] == "id":
        taken = (str(name) for _, name in entries(document, ".".join((*map(str, path[:2]), "*", "*", "id"))))
        return free_id(taken, singular(path[-3]))
    if node.get("pattern") == LETTER:
        used = {letter for _, letter in entries(document, f"{path[0]}.*.{path[-1]}")}
        return next((letter for letter in string.ascii_uppercase if letter not in used), "Z")
    name = around.get("id", path[-2]) if isinstance(around, Mapping) else path[-2]
    words = new_text(path[-3]) if isinstance(name, int) else f"New {label_of(str(name)).lower()}"
    return _in_languages(document, words) if localised else words


def _in_languages(document: Mapping[str, Any], words: str) -> Any:
    languages = _languages(document)
    return dict.fromkeys(languages, words) if len(languages) > 1 else words


def _languages(document: Mapping[str, Any]) -> list[str]:
    return [str(name) for _, name in entries(document, "study.languages.*")]


def _number(node: Node, otherwise: float) -> float:
    wanted = next(iter(node.get("examples", ())), otherwise)
    least, most = node.get("minimum", node.get("exclusiveMinimum", wanted)), node.get("maximum", wanted)
    number = min(max(wanted, least), most)
    return int(number) if float(number).is_integer() else number
