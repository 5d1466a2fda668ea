"""The page of the protocol file: every key of the schema, with links that lead to its tables."""

import re

from study_app.protocol.source.json_schema import schema
from study_app.protocol.source.schema_reference import format_markdown


def tables() -> dict[str, str]:
    parts = re.split(r"^## (.+)$", format_markdown(), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def keys_of(table: str) -> set[str]:
    return set(re.findall(r"^\| `([^`]+)` \|", table, re.MULTILINE))


def test_every_model_has_a_table_with_every_key() -> None:
    parts = tables()
    assert keys_of(parts.pop("Top of the file")) == set(schema()["properties"])
    models = [set(node["properties"]) for node in schema()["$defs"].values() if "properties" in node]
    written = [keys_of(part) for part in parts.values()]
    assert len(parts) == len(models)
    assert sorted(map(sorted, written)) == sorted(map(sorted, models))


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


def test_kinds_at_one_place_are_told_apart() -> None:
    found = [heading for heading in tables() if heading.startswith("tasks.NAME")]
    assert found == ["tasks.NAME, kind = explore", "tasks.NAME, kind = reach", "tasks.NAME, kind = follow"]


def test_every_key_but_kinds_has_a_meaning() -> None:
    rows = [line.split(" | ") for line in format_markdown().splitlines() if line.startswith("| `")]
    assert [row[0] for row in rows if row[-1] in {"|", " |"} and row[0] != "| `kind`"] == []
