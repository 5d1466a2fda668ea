"""The page of the protocol file: every key of the schema, with links that lead to its tables."""

import re

from study_app.protocol.source.schema_reference import format_markdown


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
