"""The form rows of a study's tables, made from the JSON Schema of the file format; initial values; references."""

from __future__ import annotations

import math
import operator
import re
import string
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final, Literal, TypeAlias

from study_app.designer.document.toml_edits import Edit, Rename, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.haptics.model.ranges import OF_MOST, REASON
from study_app.ids import MAX_FROM_TEXT, MAX_ID, free_id, id_of
from study_app.number_text import counted, exact_text
from study_app.protocol.checks import CHOICES, ITEM_REFERENCES
from study_app.protocol.file_format import length_texts, schema
from study_app.protocol.model import RULE_LIMITS
from study_app.protocol.questions import POINTS
from study_app.protocol.source import FormKey, Path, entries, has, names, rule_of, value_at
from study_app.protocol.trials import DESIGN_KINDS as DESIGNS
from study_app.protocol.trials import METHOD_KINDS as METHODS
from study_app.protocol.trials import Design, default_design
from study_app.protocol.wording import LANGUAGES, languages_of

Document = Mapping[str, Any]
ITEMS = "items"
CONTRASTS: Final[Path] = ("analysis", "contrasts")
EXCLUSIONS: Final[Path] = ("analysis", "exclusions")
_OMISSIBLE_REFERENCES = (("blocks", "task"), ("stimuli", "condition"))
"""Section and key of references that may be omitted if there is only one table to refer to."""


def referenced_element(document: Document, place: Path) -> Path | None:
    """Return the path of the element to which the text at ``place`` refers, or None."""
    name = value_at(document, place)
    if not isinstance(name, str):
        return None
    for pattern in CHOICES:
        if _matches_pattern(place, pattern):
            for section in _sections(document, pattern):
                if has(document.get(section), name):
                    return section, name
    if any(_matches_pattern(place, pattern) for pattern in ITEM_REFERENCES):
        return next(
            (path for path, item in _items(document) if item["id"] == name and _can_name_item(place, path)), None
        )
    return None


def references_to(document: Document, element: Path) -> tuple[Path, ...]:
    """Return the places of the texts that refer to a table, such as ``("liquids", "water")``, or an item."""
    return tuple(place for place, named in written_references(document) if named == element)


def choices_at(document: Document, place: Path) -> tuple[str, ...] | None:
    """Return the permitted names of a text at ``place``; None if it is not a reference."""
    block = value_at(document, place[:2]) if place[:1] == ("blocks",) and len(place) == 3 else None
    if isinstance(block, Mapping) and place[2] == "standard" and block.get("conditions"):
        return tuple(dict.fromkeys(block["conditions"]))
    if isinstance(block, Mapping) and place[2] in {"design", "method"}:
        kinds = METHODS if place[2] == "method" else _designs_for(block)
        return tuple(dict.fromkeys((*names(document, f"{place[2]}s"), *kinds)))
    for pattern in CHOICES:
        if _matches_pattern(place, pattern):
            return tuple(name for section in _sections(document, pattern) for name in names(document, section))
    if any(_matches_pattern(place, pattern) for pattern in ITEM_REFERENCES):
        items = (item for path, item in _items(document) if _can_name_item(place, path))
        return tuple(dict.fromkeys(str(item["id"]) for item in items))
    return None


@cache
def default_designs() -> dict[str, Design]:
    """Return the designs whose keys all have defaults."""
    return {
        kind: default_design(kind)
        for kind, design in DESIGNS.items()
        if not any(key.is_required() for key in design.model_fields.values())
    }


def _designs_for(block: Mapping[str, Any]) -> Iterator[str]:
    """Yield the kinds of designs that a block can have; without a stimulus, only those with a standard."""
    for kind, design in default_designs().items():
        if "stimulus" in block or (design.has_standard and not design.adjusts):
            yield kind


def kind_note(place: Path, kind: str) -> str:
    """Return the published name and the question of a kind of design, or the rule of a kind of method."""
    if place[-1] == "design" and kind in default_designs():
        design = default_designs()[kind]
        return f"{design.paper_name}: {LANGUAGES['en'].design_questions[design.wording]}"
    own = METHODS.own.get(kind) if place[-1] == "method" else None
    return "" if own is None else " ".join((own.__doc__ or "").split("\n\n")[0].split()).rstrip(".")


def sections_at(place: Path) -> tuple[str, ...]:
    """Return the sections whose tables a text at ``place`` may refer to; empty if it refers to none."""
    return next((sections for pattern, sections in CHOICES.items() if _matches_pattern(place, pattern)), ())


def edits_to_rename(
    document: Document, element: Path, name: str, recorded: frozenset[str] = frozenset()
) -> tuple[Edit, ...]:
    """Return the edits that rename a table or item and all references to it.

    Raises Refused if the name is invalid or taken, and proposes a free one without ``recorded`` answers.
    """
    item = _item_id(document, element)
    taken = _sibling_names(document, element)
    title = value_at(document, (*element, "text" if item is not None else "title"))
    text = next(iter(title.values()), "") if isinstance(title, Mapping) else title
    own = str(item or element[-1])
    base_id = id_of(name) or id_of(str(text or ""), MAX_FROM_TEXT) or id_of(own) or "question"
    free = free_id(taken | (recorded - {own}), base_id)
    check_id(name, free)
    if name in taken:
        scope = "" if item is None else " by another item in this questionnaire"
        raise Refused(f'the name "{name}" is already used{scope}; "{free}" is available')
    if item is None:
        return (Rename(element, name, references_to(document, element)),)
    return (Set((*element, "id"), name), *(Set(place, name) for place in references_to(document, element)))


def id_at(document: Document, element: Path) -> str:
    """Return the id of a table or item; "" if it has none."""
    return str(_item_id(document, element) or element[-1]) if value_at(document, element) is not None else ""


def suggested_id(document: Document, element: Path, recorded: frozenset[str] = frozenset()) -> str:
    """Return a free ID made from the text of a table or item; "" without a text, or if it has this ID already."""
    text = value_at(document, (*element, "text" if _item_id(document, element) is not None else "title"))
    if isinstance(text, Mapping):
        text = text.get(languages_of(document)[0])
    base_id = id_of(text, MAX_FROM_TEXT) if isinstance(text, str) else ""
    own = id_at(document, element)
    free = free_id(_sibling_names(document, element) | (recorded - {own}), base_id) if base_id else ""
    return "" if free == own else free


def _sibling_names(document: Document, element: Path) -> set[str]:
    """Return the names that other tables or items already have."""
    if _item_id(document, element) is None:
        node = value_at(document, element[:-1])
        return {*(tuple(node) if isinstance(node, Mapping) else ())} - {str(element[-1])}
    return {str(other["id"]) for path, other in _items(document) if (element[:2] == path[:2]) and path != element}


def edits_to_replace(document: Document, element: Path, other: str) -> tuple[Edit, ...]:
    """Return the edits that delete an element and redirect its references to another one."""
    return (*(Set(place, other) for place in references_to(document, element)), Unset(element))


def paths_to_delete(document: Document, element: Path, is_required: Callable[[Path], bool]) -> tuple[Path, ...]:
    """Return the paths to delete with an element: list entries, keys and whole tables; the element comes last.

    A table is deleted, too, if it loses a key that is required according to ``is_required``, or the last entry of a
    required list.
    """
    targets_by_place: dict[Path, list[Path]] = {}
    for place, target in _references_without_conditions(document):
        targets_by_place.setdefault(place, []).append(target)
    deleted = [element]
    for inner in deleted:  # grows while it is read
        for place, targets in targets_by_place.items():
            refers_to_deleted = any(_is_within(target, inner) for target in targets)
            if (
                not refers_to_deleted
                or _is_covered(place, deleted)
                or not all(_is_covered(target, deleted) for target in targets)
            ):
                continue
            array = place[:-1]
            if not isinstance(place[-1], int):
                deleted.append(place if value_at(document, place) is not None and not is_required(place) else place[:2])
                continue
            deleted.append(place)
            becomes_empty = all(
                _is_covered((*array, index), deleted) for index in range(len(value_at(document, array)))
            )
            if becomes_empty and len(array) > 2:
                deleted.append(array[:2] if is_required(array) else array)
    outermost = [path for path in deleted[1:] if not _is_covered(path, (other for other in deleted if other != path))]
    return (*outermost[::-1], element)


def edits_to_delete(paths: Iterable[Path]) -> tuple[Edit, ...]:
    """Return the edits that remove these paths: later entries of an array first, without duplicates."""
    all_paths = set(paths)
    outermost = [path for path in all_paths if not any(path[:length] in all_paths for length in range(1, len(path)))]
    return tuple(
        Unset(path)
        for path in sorted(
            outermost,
            key=lambda path: tuple((step, 0) if isinstance(step, str) else ("", step) for step in path),
            reverse=True,
        )
    )


def check_id(name: str, free: str = "") -> None:
    """Raise Refused if an ID is invalid; the message proposes ``free``, if given."""
    plain = name.isascii() and name.replace("_", "a").isalnum() and name == name.lower()
    if not plain or not name[:1].isalpha() or len(name) > MAX_ID:
        rule = f"at most {MAX_ID} lowercase letters, digits and underscores, starting with a letter"
        proposed = f'; "{free}" is available' if free else ""
        raise Refused(f'"{name}" is not a valid ID: use {rule}{proposed}')


def _is_within(path: Path, outer: Path) -> bool:
    return path[: len(outer)] == outer


def _is_covered(path: Path, outer: Iterable[Path]) -> bool:
    return any(_is_within(path, outer_path) for outer_path in outer)


def written_references(document: Document) -> Iterator[tuple[Path, Path]]:
    """Yield the path of every reference in the file, with its target."""
    for pattern in CHOICES:
        for place, name in entries(document, pattern):
            for section in _sections(document, pattern):
                if isinstance(name, str) and has(document.get(section), name):
                    yield place, (section, name)
    items = list(_items(document))
    for pattern in ITEM_REFERENCES:
        for place, name in entries(document, pattern):
            for path, item in items:
                if item["id"] == name and _can_name_item(place, path):
                    yield place, path


def all_references(document: Document) -> Iterator[tuple[Path, Path]]:
    """Yield every reference with its target; an omitted key refers to the only table that it can name."""
    yield from written_references(document)
    for section, key in _OMISSIBLE_REFERENCES:
        (target_section,) = _sections(document, f"{section}.*.{key}")
        yield from _implied_references(document, section, key, target_section)


def orphaned_keys(document: Document, tables: Iterable[Path]) -> tuple[Path, ...]:
    """Return the omitted keys that refer to nothing after these tables are deleted."""
    deleted = set(tables)
    targets_by_key: dict[Path, set[Path]] = {}
    for place, target in _references_without_conditions(document):
        if value_at(document, place) is None:
            targets_by_key.setdefault(place, set()).add(target)
    return tuple(place for place, target in targets_by_key.items() if target <= deleted)


def _references_without_conditions(document: Document) -> Iterator[tuple[Path, Path]]:
    """Yield `all_references`, and those that omitted keys would have in the study without its conditions."""
    yield from all_references(document)
    if "conditions" in document:
        yield from _implied_references(document, "stimuli", "condition", "liquids")


def _implied_references(document: Document, section: str, key: str, target_section: str) -> Iterator[tuple[Path, Path]]:
    if len(target_names := names(document, target_section)) == 1:
        tables = entries(document, f"{section}.*")
        yield from (((*path, key), (target_section, target_names[0])) for path, table in tables if not has(table, key))


def _sections(document: Document, pattern: str) -> tuple[str, ...]:
    """Return the sections to whose tables a pattern may refer; without conditions, each liquid counts as one."""
    sections = CHOICES[pattern]
    return ("liquids",) if sections == ("conditions",) and "conditions" not in document else sections


def _items(document: Document) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    for path, item in entries(document, f"questionnaires.*.{ITEMS}.*"):
        if isinstance(item, Mapping) and isinstance(item.get("id"), str):
            yield path, item


def _item_id(document: Document, element: Path) -> str | None:
    return next((item["id"] for path, item in _items(document) if path == element), None)


def _can_name_item(place: Path, item: Path) -> bool:
    """Return whether a text may refer to an item: within a questionnaire only to its own items."""
    return place[0] != item[0] or place[1] == item[1]


def _matches_pattern(place: Path, pattern: str) -> bool:
    steps = _steps_of(pattern)
    return len(steps) == len(place) and all(step in ("*", str(key)) for step, key in zip(steps, place, strict=True))


@cache
def _steps_of(pattern: str) -> tuple[str, ...]:
    return tuple(pattern.split("."))


_Node: TypeAlias = Mapping[str, Any]
OWN = "own description"
"""Key of a node's own description, which a description of the union around it would replace."""


def node_at(document: Any, path: Path) -> tuple[_Node, ...]:
    """Return the schema's alternatives for the value at ``path``, present or not; empty if no value is permitted."""
    nodes: tuple[_Node, ...] = (schema(),)
    for step in path:
        nodes = _nodes_below(table_of(nodes, document), step)
        document = document[step] if has(document, step) else None
    return nodes


def _nodes_below(table: _Node | None, step: Any) -> tuple[_Node, ...]:
    """Return the alternatives for a key or an entry of a table or array."""
    children = () if table is None else _children(table, step)
    return tuple(alternative for child in children for alternative in alternatives(child))


def table_of(nodes: tuple[_Node, ...], value: Any) -> _Node | None:
    """Return the alternative of a table or array whose fixed key, such as ``kind``, matches the value."""
    if isinstance(value, Mapping):
        tables = [node for node in nodes if node.get("type") == "object"]
        return next((node for node in tables if _matches_kind(node, tables, value)), tables[0] if tables else None)
    several = [node for node in nodes if node.get("type") in {"object", "array"}]
    arrays = [node for node in several if node["type"] == "array"]
    return next(iter(arrays if isinstance(value, tuple) and arrays else several), None)


def distinguishing_key(nodes: tuple[_Node, ...]) -> tuple[str, dict[str | None, _Node]]:
    """Return the key that distinguishes the tables, and the table of each of its values; None: the key is omitted."""
    tables = [node for node in nodes if node.get("type") == "object" and "properties" in node]
    if len(tables) < 2:
        return "", {}
    keys = {**tables[0]["properties"], **tables[1]["properties"]}
    key = next((key for key in keys if _is_distinguishing(key, tables)), "")
    return key, {value: node for node in tables for value in _fixed_values(node, key) or (None,)} if key else {}


def alternatives(node: _Node) -> Iterator[_Node]:
    """Yield the alternatives of a node except null, with references resolved and the keys of the union added."""
    around = {key: value for key, value in node.items() if key not in {"$ref", "anyOf", "oneOf", "discriminator"}}
    if "$ref" in node:
        definition = schema()["$defs"][node["$ref"].rsplit("/", 1)[-1]]
        yield from (_with_union_keys(around, alternative) for alternative in alternatives(definition))
    elif branches := node.get("anyOf") or node.get("oneOf"):
        for branch in branches:
            yield from (_with_union_keys(around, alternative) for alternative in alternatives(branch))
    elif node.get("type") != "null":
        yield node


def _with_union_keys(around: _Node, node: _Node) -> _Node:
    """Return a node with the keys of the union around it; `OWN` keeps the node's own description."""
    own = {OWN: node["description"]} if "description" in node and OWN not in node else {}
    return {**node, **own, **around}


def _matches_kind(node: _Node, tables: list[_Node], value: Mapping[str, Any]) -> bool:
    key, named = distinguishing_key(tuple(tables))
    if not key:
        return True
    default = next(
        (name for name, table in named.items() if table["properties"].get(key, {}).get("default") == name), None
    )
    chosen = value.get(key, None if None in named else default)
    return (chosen is None or isinstance(chosen, str)) and named.get(chosen) is node


def _is_distinguishing(key: str, tables: list[_Node]) -> bool:
    """Return whether the key has a different fixed value in each table; one table may lack it."""
    values = [_fixed_values(node, key) for node in tables]
    all_values = [value for table_values in values for value in table_values]
    return sum(map(bool, values)) >= len(tables) - 1 and len(all_values) == len(set(all_values))


def _fixed_values(node: _Node, key: str) -> tuple[str, ...]:
    part = node["properties"].get(key, {})
    return (part["const"],) if "const" in part else tuple(part.get("enum", ()))


def _children(node: _Node, step: str | int) -> Iterator[_Node]:
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


Kind: TypeAlias = Literal[
    "number", "whole number", "text", "paragraphs", "localised", "switch", "choice", "kind", "reference",
    "numbers", "vector", "points", "texts", "choices", "references", "list", "table", "tables", "either", "unknown",
]  # fmt: skip
"""How a value is edited: "localised" has a text per language, "switch" is true or false, "choice" is one of several
words, "kind" is a choice that determines the other rows, "vector" has the coordinates of one point, "list" has tables
in an array, "tables" has tables by name, "either" is one of several other kinds; an "unknown" key is not permitted."""

_UNITS: Final = {
    "mm": "mm", "m": "m", "s": "s", "ms": "ms", "n": "N", "hz": "Hz", "deg": "°", "percent": "%", "mps": "m/s",
    "mps2": "m/s²", "m2ps": "m²/s", "nspm": "N·s/m", "pa": "Pa", "pa_s": "Pa·s", "pa_sn": "Pa·sⁿ", "kg_m3": "kg/m³",
    "per_s": "1/s",
}  # fmt: skip
"""Unit of each key suffix."""

_BOUND_PHRASES: Final = {
    "minimum": "at least {}",
    "exclusiveMinimum": "more than {}",
    "maximum": "at most {}",
    "exclusiveMaximum": "less than {}",
}
_BOUND_CHECKS: Final = {
    "minimum": operator.ge, "exclusiveMinimum": operator.gt, "maximum": operator.le, "exclusiveMaximum": operator.lt,
}  # fmt: skip
_SENTENCES: Final = re.compile(r"((?:[a-z_0-9-]+, )*[a-z_0-9-]+): ([^;]+?)(?:; |\.?\Z)")


_KIND_LABELS: Final = {
    "2ifc": "2IFC",
    "3ifc": "3IFC",
    "4ifc": "4IFC",
    "abx": "ABX",
    "estimation": "Magnitude estimation",
    "questplus": "QUEST+",
    "samedifferent": "Same–different",
    "updown": "Up–down staircase",
    "yesno": "Yes/no",
}
"""Labels of designs and methods, also of elements named after them."""
_LABELS: Final = {
    **_KIND_LABELS,
    "1down1up": "1-down 1-up",
    "2down1up": "2-down 1-up",
    "3down1up": "3-down 1-up",
    "4down1up": "4-down 1-up",
    "alpha": "Significance level (alpha)",
    "velocity.alpha": "Filter weight (alpha)",
    "begin": "First level",
    "between_s": "Between trials",
    "bias_sd": "Response bias (SD)",
    "block_order": "Block order",
    "break_every": "Trials between breaks",
    "catch": "Catch trials",
    "code_prefix": "Code letter",
    "contrasts": "Hypotheses",
    "count": "Number of targets",
    "damping_nspm": "Viscosity (damping)",
    "delay_ms": "Visual delay",
    "design": "Trial design",  # a study has a design, too
    "designs": "Trial designs",
    "double": "Double-blind",
    "dwell_s": "Dwell time",
    "ewma": "EWMA",
    "expected": "Expected direction",
    "fade_s": "Fade-in",
    "falling": "Decreasing with delay",
    "feedback_s": "Feedback duration",
    "go_on": "Continue",
    "group_assignment": "Group assignment",
    "herschel-bulkley": "Herschel–Bulkley",
    "id": "ID",
    "intro": "Introduction",
    "latin": "Latin square",
    "lead_s": "Lead-in",
    "level_error_ms": "Level error for delays",
    "log": "Logarithmic",
    "looks": "Interim analyses",
    "max_repeats": "Maximum repeats in a row",
    "max_s": "Maximum duration",
    "min_distance": "Minimum distance between repeats",
    "min_s": "Minimum duration",
    "missed": "If not met",
    "missing_percent": "Missing trials",
    "most_s": "Maximum duration",
    "names": "Recognition questions",
    "noise_sd": "Noise (SD)",
    "noise_share": "Noise trials",
    "non_newtonian": "Non-Newtonian",
    "noticed": "Detection question",
    "obrien-fleming": "O’Brien–Fleming",
    "participants": "Participants planned",
    "primary": "Primary questions",
    "pse": "PSE",
    "replicates": "Pool equal conditions",
    "rising": "Increasing with delay",
    "sequence": "Session order",
    "setting_label": "Neutral trial name",
    "short": "Short label",
    "show_if": "Display condition",
    "single": "Single-blind",
    "slope_sd": "Slopes (SD)",
    "spending": "Alpha spending",
    "stop": "Stopping rule",
    "trends": "Trend test",
    "until": "Criterion",
    "url": "URL",
    "vary": "Varied quantity",
    "weber": "Weber fraction",
    "whole": "Whole numbers only",
    "williams": "Williams design",
    "withheld_percent": "Withheld force",
    "wrong_most": "Maximum incorrect catch trials",
}
"""Labels, without their unit, of keys and values whose names are unclear; sources in `docs/glossary.md`."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One value that can be chosen, with its description ("" if the model has none); None omits the key."""

    value: str | None
    sentence: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One row of a form."""

    path: Path  # path of the value that it edits
    kind: Kind  # how it is edited, see `Kind`
    # its texts, "" if there are none
    label: str
    unit: str = ""
    help: str = ""
    value: Any = None  # the value in the file, None if the key is omitted
    default: Any = None  # the value if the key is omitted; None if there is no default
    required: bool = False  # whether the key cannot be omitted
    bounds: tuple[str, ...] = ()  # the permitted values as in messages: "at least 0", "at most 8"
    reason: str = ""  # the reason of the bounds, "" if the model has none
    choices: tuple[Choice, ...] = ()  # the values or elements that can be chosen
    either: tuple[Row, ...] = ()  # the alternatives of kind "either"
    instead: str = ""  # the alternative key, if exactly one of the two must be given; "" otherwise
    model: str = ""  # the title of the model whose key it is, such as "Block"
    sections: tuple[str, ...] = ()  # for references, the sections that they can refer to


def rows(document: Mapping[str, Any], path: Path) -> tuple[Row, ...]:
    """Return the rows of the table or array at ``path``: its keys in the order of its model, then unknown ones."""
    nodes, value = node_at(document, path), value_at(document, path)
    node = table_of(nodes, value)
    if node is None:
        return ()
    if node.get("type") == "array":
        length = len(node["prefixItems"]) if "prefixItems" in node else len(value) if isinstance(value, tuple) else 0
        entry_rows = (_row_below(document, (*path, index), nodes, node) for index in range(length))
        return tuple(row for row in entry_rows if row is not None)
    properties = node.get("properties", {})
    present_keys = tuple(value) if isinstance(value, Mapping) else ()
    keys = list(dict.fromkeys((*filter(None, [distinguishing_key(nodes)[0]]), *properties, *present_keys)))
    all_rows = (_row_below(document, (*path, key), nodes, node) for key in keys)
    return tuple(row for row in all_rows if row is not None)


def sections_of(document: Mapping[str, Any], path: Path) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return the form sections of a table's model, each heading with its keys; other keys come last."""
    node = table_of(node_at(document, path), value_at(document, path)) or {}
    return tuple((heading, tuple(keys)) for heading, keys in node.get(FormKey.SECTIONS, ()))


def key_order(document: Mapping[str, Any], path: Path) -> dict[str, int]:
    """Return the position of each key of an element in its form, in which inner tables come last."""
    nodes, value = node_at(document, path), value_at(document, path)
    node, table = table_of(nodes, value) or {}, value if isinstance(value, Mapping) else {}
    in_sections = (key for _, keys in node.get(FormKey.SECTIONS, ()) for key in keys)
    ordered_keys = (distinguishing_key(nodes)[0], *in_sections, *node.get("properties", ()), *table)
    inner_tables = {key for key, part in table.items() if isinstance(part, Mapping)
             and any("properties" in node for node in node_at(document, (*path, key)))}  # fmt: skip
    return {
        key: position
        for position, key in enumerate(sorted(dict.fromkeys(ordered_keys), key=lambda key: key in inner_tables))
    }


def refused_at(document: Mapping[str, Any], path: Path) -> frozenset[str]:
    """Return the keys that a table does not permit with its current values."""
    table = value_at(document, path)
    node = table_of(node_at(document, path), table) or {}
    if not isinstance(table, Mapping):
        return frozenset()
    if path[:2] == EXCLUSIONS:
        return frozenset() if table.get("rule") in RULE_LIMITS else frozenset({"limit"})
    applicable = (keys for owners, keys in node.get(FormKey.NOT_WITH, ()) if all(key in table for key in owners))
    return frozenset(next(applicable, ()))


def row_at(document: Mapping[str, Any], path: Path) -> Row | None:
    """Return the row of a path; None if no model has this path."""
    owners = node_at(document, path[:-1])
    table = table_of(owners, value_at(document, path[:-1]))
    return None if table is None else _row_below(document, path, owners, table)


def _row_below(document: Mapping[str, Any], path: Path, owners: tuple[_Node, ...], table: _Node) -> Row | None:
    """Return the row of a path below a table, which is one of its owner's alternatives."""
    value = value_at(document, path)
    key, nodes_by_kind = distinguishing_key(owners)
    if key and key == path[-1]:
        options = tuple(
            Choice(tag, _plain_text(str(node.get(OWN, node.get("description", ""))).split("\n\n")[0]))
            for tag, node in nodes_by_kind.items()
        )
        return Row(
            path=path,
            kind="kind",
            label=label_of(key),
            value=value,
            default=table.get("properties", {}).get(key, {}).get("default") if None in nodes_by_kind else None,
            required=None not in nodes_by_kind,  # the schema has a default for each kind, but validation needs the key
            choices=options,
            model=table.get("title", ""),
        )
    nodes = _nodes_below(table, path[-1])
    if not nodes:
        return None if value is None else Row(path=path, kind="unknown", label=label_of(path[-1]), value=value)
    row = _make_row(document, path, nodes, value, required=path[-1] in table.get("required", ()))
    pairs = [pair for pair in table.get(FormKey.ONE_OF, ()) if path[-1] in pair]
    instead = next((key for pair in pairs for key in pair if key != path[-1]), "")
    return replace(row, instead=instead, model=table.get("title", ""))


def _make_row(document: Mapping[str, Any], path: Path, nodes: tuple[_Node, ...], value: Any, *, required: bool) -> Row:
    first = nodes[0]
    common: dict[str, Any] = {
        "label": label_at(path),
        "unit": unit_of(next((step for step in reversed(path) if isinstance(step, str)), "")),
        "help": _plain_text(first.get("description", "")),
        "value": value,
        "default": first.get("default", first.get("const")),
        "required": required,
    }
    if is_localised(nodes):
        return Row(path=path, kind="paragraphs" if first.get("lines") == "several" else "localised", **common)
    if len(nodes) > 1 and not distinguishing_key(nodes)[0]:
        either = tuple(_make_row(document, path, (node,), value, required=required) for node in nodes)
        return Row(path=path, kind="either", **common, either=either)
    reference_path = (*path, 0) if first.get("type") == "array" else path
    references = choices_at(document, reference_path)
    kind = _kind(first, isinstance(references, tuple))
    choices = first.get("items", first) if kind == "choices" else first
    names = references if kind in {"reference", "references"} and references is not None else _permitted_values(choices)
    sentences = _value_sentences(common["help"])
    options = tuple(Choice(name, sentences.get(name, "")) for name in names)
    limits = _number_node(first) if kind in {"vector", "numbers", "points"} else first
    common["sections"] = sections_at(reference_path) if kind in {"reference", "references"} else ()
    return Row(
        path=path,
        kind=kind,
        **common,
        choices=options,
        bounds=_bound_texts(first, limits),
        reason=limits.get(REASON, limits.get(OF_MOST, "")),
    )


def _kind(node: _Node, references: bool) -> Kind:
    kind = node.get("type")
    if kind == "array":
        if references:
            return "references"
        entry = next(alternatives(node["items"])) if "items" in node else node["prefixItems"][0]
        if "prefixItems" in node:
            return "vector"
        if entry.get("type") == "object":
            return "list"
        if entry.get("type") == "array":
            return "points" if "prefixItems" in entry else "list"
        return "choices" if "enum" in entry else "texts" if entry.get("type") == "string" else "numbers"
    if kind == "object":
        return "table" if "properties" in node else "tables"
    if kind == "string":
        return "reference" if references else "choice" if _permitted_values(node) else "text"
    if "enum" in node or "const" in node:
        return "choice"
    return "switch" if kind == "boolean" else "whole number" if kind == "integer" else "number"


def _permitted_values(node: _Node) -> tuple[Any, ...]:
    return (node["const"],) if "const" in node else tuple(node.get("enum", ()))


def is_localised(nodes: tuple[_Node, ...]) -> bool:
    """Return whether the value of these nodes is a text, or one text per language."""
    if len(nodes) != 2 or nodes[0].get("type") != "string":
        return False
    return nodes[1].get("additionalProperties") == {"type": "string"}


def _number_node(node: _Node) -> _Node:
    while node.get("type") == "array":
        node = node["prefixItems"][0] if "prefixItems" in node else next(alternatives(node["items"]))
    return node


_SHOWN_BOUND_LIMIT: Final = 1e6
"""Bounds of at least this size are not shown, because no author reaches them."""


def _bound_texts(node: _Node, numbers: _Node) -> tuple[str, ...]:
    bounds = {key: numbers[key] for key in _BOUND_PHRASES if key in numbers and abs(numbers[key]) < _SHOWN_BOUND_LIMIT}
    phrases = [_BOUND_PHRASES[key].format(exact_text(number)) for key, number in bounds.items()]
    if "prefixItems" not in node:
        phrases += length_texts(node)
    return (*phrases, rule_of(node["pattern"])) if "pattern" in node else tuple(phrases)


def violated_bound(document: Mapping[str, Any], row: Row, number: float) -> str:
    """Return the bound that a number violates, such as "at most 8"; "" if it is permitted."""
    node = node_at(document, row.path)[0]
    if row.kind == "whole number" and not isinstance(number, int):
        return "a whole number"
    violated = (key for key, is_met in _BOUND_CHECKS.items() if key in node and not is_met(number, node[key]))
    return next((_BOUND_PHRASES[key].format(exact_text(node[key])) for key in violated), "")


def label_of(step: str | int) -> str:
    """Return a key as a label without its unit: "Force limit" for ``force_limit_n``; for a list entry its number."""
    if isinstance(step, int):
        return str(step + 1)
    if step in _LABELS:
        return _LABELS[step]
    unit = _unit_suffix(step)
    plain = step.removesuffix(f"_{unit}") if unit else step
    return plain.replace("_", " ").strip().capitalize()


def label_at(path: Path) -> str:
    """Return the label of the key at a path, where the same key may have different labels in different tables."""
    return _LABELS.get(".".join(map(str, path[-2:]))) or label_of(path[-1])


def name_label(name: str) -> str:
    """Return an ID as a label: "Thick honey" for ``thick_honey``."""
    return _KIND_LABELS.get(name, name.replace("_", " ").strip().capitalize())


def unit_of(key: str) -> str:
    """Return the unit at the end of a key, "" if it has none."""
    return _UNITS.get(_unit_suffix(key), "")


def _unit_suffix(key: str) -> str:
    return max((suffix for suffix in _UNITS if key.endswith(f"_{suffix}")), key=len, default="")


def _plain_text(description: str) -> str:
    """Return a description without line breaks or markup.

    A table's description is its docstring, which contains both.
    """
    return re.sub("`(.+?)`", "“\\1”", " ".join(description.replace("``", "").split()))


def _value_sentences(description: str) -> dict[str, str]:
    """Return the sentence on each value in a description such as "fixed: as written; shuffled: anew each trial"."""
    return {value: match[2].strip() for match in _SENTENCES.finditer(description) for value in match[1].split(", ")}


_SINGULAR: Final = {"items": "question", "stimuli": "stimulus", "analysis": "analysis", "contrasts": "hypothesis"}
"""Singular names of sections' elements that are not the section's name without its last letter."""
_PLURAL: Final = {"items": "questions"}
"""Plural names of sections' elements that are not the section's name."""
LETTER: Final = "^[A-Z]$"


def element_noun(section: str | int) -> str:
    """Return the noun for an element of a section: "liquid" for ``liquids``."""
    return _SINGULAR.get(str(section), str(section).removesuffix("s"))


def counted_elements(number: int, section: str | int) -> str:
    """Return a count with the noun of a section: "1 stimulus", "2 stimuli" for ``stimuli``."""
    return counted(number, element_noun(section), _PLURAL.get(str(section), str(section)))


def _new_text(section: str | int) -> str:
    """Return the initial text of a list element: "New question" for ``items``."""
    return f"New {element_noun(section)}"


def initial_value(document: Mapping[str, Any], path: Path) -> Any:
    """Return a valid value for a key that is missing in the study."""
    row = row_at(document, path)
    if row is None or row.kind == "unknown":
        raise Refused(f"{label_of(path[-1])} is not a key in this table")
    if row.default not in (None, [], {}):
        return row.default
    nodes = node_at(document, path)
    node = table_of(nodes, None) or nodes[0]
    return _initial_of_kind(document, row.either[0] if row.kind == "either" else row, node)


def _initial_of_kind(document: Mapping[str, Any], row: Row, node: _Node) -> Any:
    path, kind = row.path, row.kind
    if kind in {"localised", "paragraphs", "text"}:
        return _initial_text(document, path, node, localised=kind != "text")
    if kind in {"choice", "kind", "reference"}:
        return next((choice.value for choice in row.choices if choice.value is not None), "")
    if kind in {"references", "choices"}:
        values = [choice.value for choice in row.choices]
        return values[: max(1, node.get("minItems", 1))]
    if kind == "switch":
        return False
    if kind in {"number", "whole number"}:
        return _initial_number(node, 1)
    if kind in {"vector", "numbers"}:
        parts = node.get("prefixItems") or [node["items"]] * node.get("minItems", 1)
        return [_initial_number(part, place) for place, part in enumerate(parts, start=1)]
    if kind == "points":
        size = len(node["items"]["prefixItems"])
        return [[x] + [0] * (size - 1) for x in (-20, 20)][: max(2, node.get("minItems", 2))]
    if kind == "texts":
        return [label_of(f"text_{number}") for number in range(1, node.get("minItems", 1) + 1)]
    entry = node.get("additionalProperties")
    if kind == "tables" and isinstance(entry, Mapping) and entry.get("type") == "array":
        points = [f"Point {number}" for number in range(1, POINTS + 1)]
        return dict.fromkeys(languages_of(document), points)
    return _initial_tables(document, path, node) if kind == "list" else {}


def _initial_tables(document: Mapping[str, Any], path: Path, node: _Node) -> list[Any]:
    """Return the minimum number of tables for a list, each with its required keys, or of lists for sequences."""
    tables: list[Any] = []
    for number in range(max(1, node.get("minItems", 1))):
        table_path = (*path, number)
        if node["items"].get("type") == "array":
            tables.append(initial_value(document, table_path))
            continue
        table = table_of(node_at(document, table_path), {})
        required = () if table is None else table.get("required", ())
        name = f"{element_noun(path[-1])}_{number + 1}"
        text = _text_in_each_language(document, label_of(name))
        known = {"id": name, "text": text}
        tables.append({key: known.get(key) or initial_value(document, (*table_path, key)) for key in required})
    return tables


def _initial_text(document: Mapping[str, Any], path: Path, node: _Node, *, localised: bool) -> Any:
    table = value_at(document, path[:-1])
    if path[-1] == "id":
        taken = (str(name) for _, name in entries(document, ".".join((*map(str, path[:2]), "*", "*", "id"))))
        return free_id(taken, element_noun(path[-3]))
    if node.get("pattern") == LETTER:
        used = {letter for _, letter in entries(document, f"{path[0]}.*.{path[-1]}")}
        return next((letter for letter in string.ascii_uppercase if letter not in used), "Z")
    name = table.get("id", path[-2]) if isinstance(table, Mapping) else path[-2]
    text = _new_text(path[-3]) if isinstance(name, int) else f"New {name_label(str(name)).lower()}"
    return _text_in_each_language(document, text) if localised else text


def _text_in_each_language(document: Mapping[str, Any], text: str) -> Any:
    languages = languages_of(document)
    return dict.fromkeys(languages, text) if len(languages) > 1 else text


def _initial_number(node: _Node, default: float) -> float:
    preferred = next(iter(node.get("examples", ())), default)
    lowest, highest = node.get("minimum", node.get("exclusiveMinimum", preferred)), node.get("maximum", preferred)
    number = min(max(preferred, lowest), highest)
    if number <= node.get("exclusiveMinimum", -math.inf):
        number += 1
    return int(number) if float(number).is_integer() else number
