"""The page of the protocol file: every key of the schema, with links that lead to its tables."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app.protocol.load import SceneFile
from study_app.protocol.source.json_schema import schema
from study_app.protocol.source.schema_reference import format_markdown
from study_app.protocol.trials.kinds import DESIGN_KINDS
from tests.protocol.faulty_protocols import case
from tests.protocol.forms.mixed import MIXED
from tests.protocol.sound import SOUND
from tests.protocol.trials.level_studies import BLOCK, HEAD

SCHEMA = schema()
PROTOCOLS = Path(__file__).parents[2] / "protocols"
TYPES = {
    "string": str,
    "object": dict,
    "array": list,
    "boolean": bool,
    "integer": int,
    "number": int | float,
    "null": type(None),
}


def complaints(value: Any, node: dict[str, Any], path: str = "") -> Iterator[str]:
    """Validate ``value`` as an editor would: the part of JSON Schema that ours uses."""
    if "$ref" in node:
        yield from complaints(value, SCHEMA["$defs"][node["$ref"].rsplit("/", 1)[-1]], path)
        return
    if "if" in node and not list(complaints(value, node["if"], path)):
        yield from complaints(value, node["then"], path)
    if "not" in node and not list(complaints(value, node["not"], path)):
        yield f"{path}: is what it must not be"
    for key in ("anyOf", "oneOf"):
        if key in node and all(list(complaints(value, branch, path)) for branch in node[key]):
            yield f"{path}: none of the alternatives"
    if "type" in node and (
        not isinstance(value, TYPES[node["type"]]) or (isinstance(value, bool) and node["type"] != "boolean")
    ):
        yield f"{path}: not {node['type']}"
        return
    if "const" in node and value != node["const"]:
        yield f"{path}: not {node['const']}"
    if "enum" in node and value not in node["enum"]:
        yield f"{path}: not in {node['enum']}"
    if isinstance(value, dict):
        yield from object_complaints(value, node, path)
    elif isinstance(value, list):
        inner = node.get("prefixItems", [])
        for index, entry in enumerate(value):
            yield from complaints(
                entry, inner[index] if index < len(inner) else node.get("items", {}), f"{path}/{index}"
            )
        if not node.get("minItems", 0) <= len(value) <= node.get("maxItems", 10**9):
            yield f"{path}: {len(value)} items"
    elif isinstance(value, str):
        if not re.search(node.get("pattern", ""), value):
            yield f"{path}: pattern"
    elif isinstance(value, int | float):
        low, high = node.get("minimum", -1e99), node.get("maximum", 1e99)
        if not low <= value <= high or not node.get("exclusiveMinimum", -1e99) < value:
            yield f"{path}: range"


def object_complaints(value: dict[str, Any], node: dict[str, Any], path: str) -> Iterator[str]:
    for name in node.get("required", ()):
        if name not in value:
            yield f"{path}: {name} is missing"
    for name, entry in value.items():
        if name in node.get("properties", {}):
            yield from complaints(entry, node["properties"][name], f"{path}/{name}")
            continue
        patterns = [inner for pattern, inner in node.get("patternProperties", {}).items() if re.search(pattern, name)]
        for inner in patterns:
            yield from complaints(entry, inner, f"{path}/{name}")
        if not patterns and node.get("additionalProperties") is False:
            yield f"{path}: {name} is unknown"


@pytest.mark.parametrize("name", sorted(path.stem for path in PROTOCOLS.glob("*.toml")))
def test_the_schema_accepts_what_ships(name: str):
    document = tomllib.loads((PROTOCOLS / f"{name}.toml").read_text(encoding="utf-8"))
    assert list(complaints(document, SCHEMA)) == []


def test_the_schema_accepts_what_format_2_leaves_out_and_format_1_may_not():
    assert list(complaints(tomllib.loads(MIXED), SCHEMA)) == []
    lacking = {one.rpartition(": ")[2] for one in complaints(tomllib.loads(MIXED) | {"format": 1}, SCHEMA)}
    assert {"device is missing", "conditions is missing", "title is missing", "task is missing"} <= lacking


LEVELS = HEAD + BLOCK


@pytest.mark.parametrize("kind", DESIGN_KINDS)
def test_the_schema_knows_every_kind_of_design(kind: str) -> None:
    scale = 'scale = "agreement"' if kind == "rating" else ""
    text = LEVELS.replace('design = "2ifc"', 'design = "own"') + f'[designs.own]\nkind = "{kind}"\n{scale}'
    assert list(complaints(tomllib.loads(text), SCHEMA)) == []
    assert list(complaints(tomllib.loads(text + "\npause_s = 99"), SCHEMA)) != []
    assert list(complaints(tomllib.loads(text + "\npauses_s = 1"), SCHEMA)) != []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('vary = "viscosity_pa_s"', ""),
        ("levels = [0.1, 0.8]", "levels = [0.1]"),
        ("levels = [0.1, 0.8]", 'levels = [0.1, 0.8]\nspacing = "logarithmic"'),
        ("repetitions = 8", "repetition = 8"),
        ("level_error_percent = 100", "level_error_percent = 0"),
        ("level_error_percent = 100", "attempts = 0"),
    ],
)
def test_the_schema_refuses_stimuli_methods_and_limits_that_the_program_refuses(old: str, new: str) -> None:
    assert list(complaints(tomllib.loads(LEVELS), SCHEMA)) == []
    assert list(complaints(tomllib.loads(LEVELS.replace(old, new)), SCHEMA)) != []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("rate_hz = 1000", "rate = 1000"),
        ('order = "shuffled"\nrepetitions', 'order = "shufled"\nrepetitions'),
        ("force_limit_n = 8", "force_limit_n = 9"),
        ("density_kg_m3 = 1400", 'density_kg_m3 = "heavy"'),
        ('kind = "explore"', 'kind = "wander"'),
        ("[conditions.is_thick]", "[conditions.isThick]"),
        ('task = "reach"\n', ""),
        ("format = 1", "format = 3"),
    ],
)
def test_the_schema_refuses_what_the_program_refuses(old: str, new: str):
    assert list(complaints(tomllib.loads(SOUND), SCHEMA)) == []
    assert list(complaints(tomllib.loads(case("", old, new).text), SCHEMA)) != []


def test_names_of_tables_are_not_asked_for_again():
    assert "id" not in SCHEMA["$defs"]["Block"]["properties"]
    assert "id" not in SCHEMA["$defs"]["StudyLiquid"]["then"]["required"]
    assert "id" in SCHEMA["$defs"]["Statement"]["required"]


def test_every_key_is_described():
    """An editor shows what a key means (the models of the force model describe theirs in the table)."""
    ours = {"StudyHead", "DeviceNeeds", "SceneDefaults", "Condition", "Scale", "Statement", "Questionnaire", "PageText",
            "Block", "Limits", "Explore", "Reach", "Rating", "Slider", "Number", "Choice", "Option", "Text", "ShowIf",
            "Score", "Stimulus", "Constant", *(kind.__name__ for kind in DESIGN_KINDS.values())}  # fmt: skip
    for name in ours:
        for key, node in SCHEMA["$defs"][name]["properties"].items():
            assert "description" in node or key == "kind", f"{name}.{key}"


def test_scene_files_have_a_schema_of_their_own():
    assert "rate_hz" in schema(SceneFile)["$defs"]["SceneTable"]["properties"]


def tables() -> dict[str, str]:
    parts = re.split(r"^## (.+)$", format_markdown(), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def test_every_link_leads_to_a_heading() -> None:
    text = format_markdown()
    anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in tables()}
    links = set(re.findall(r"\]\(#([^)]*)\)", text))
    assert links
    assert links <= anchors


def test_a_row_has_range_default_and_meaning() -> None:
    blocks = tables()["device"].splitlines()
    (row,) = [line for line in blocks if line.startswith("| `force_limit_n`")]
    assert row == "| `force_limit_n` | number, at least 0.1, at most 8 | `8.0` | Largest force on the hand \\[N]. |"
    rows = [line.replace("\\|", "") for line in format_markdown().splitlines() if line.startswith("|")]
    assert {line.count("|") for line in rows} == {5}
