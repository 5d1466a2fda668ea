"""The page of the protocol file: every key of the schema, with links that lead to its tables."""

import json
import re
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from study_app.protocol.file_format.json_schema import editor_schema, format_markdown
from study_app.protocol.source.files import shipped
from study_app.protocol.trials.designs import DESIGN_KINDS
from tests.protocol.edited_studies import FILES, STUDIES, cases_of, text_of

SCHEMA = editor_schema()
VALIDATOR = getattr(jsonschema, "Draft202012Validator", jsonschema.Draft7Validator)(SCHEMA)
ACCEPTED = {
    **{name: text_of(name) for name in shipped()},
    **{file.stem: file.read_text(encoding="utf-8") for file in STUDIES.glob("*.toml")},
    **{
        f"{file.stem}: {case.name}": case.text
        for file in FILES
        for case in cases_of(file)
        if case.asserted[0] == "accepted"
    },
}


def complaints(text: str, **keys: Any) -> list[str]:
    """Return the schema errors of a protocol file, as an editor reports them."""
    return [error.message for error in VALIDATOR.iter_errors(tomllib.loads(text) | keys)]


@pytest.mark.parametrize("name", ACCEPTED)
def test_the_schema_accepts_studies_that_check_accepts(name: str) -> None:
    assert complaints(ACCEPTED[name]) == []


@pytest.mark.parametrize("kind", DESIGN_KINDS)
def test_the_schema_knows_every_kind_of_design(kind: str) -> None:
    scale = 'scale = "agreement"' if kind == "rating" else ""
    text = text_of("levels").replace('design = "2ifc"', 'design = "own"') + f'[designs.own]\nkind = "{kind}"\n{scale}'
    assert complaints(text) == []
    assert complaints(text + "\npause_s = 99") != []
    assert complaints(text + "\npauses_s = 1") != []


@pytest.mark.parametrize(
    ("study", "old", "new"),
    [
        ("levels", 'vary = "viscosity_pa_s"', ""),
        ("levels", "levels = [0.1, 0.8]", "levels = [0.1]"),
        ("levels", "levels = [0.1, 0.8]", 'levels = [0.1, 0.8]\nspacing = "logarithmic"'),
        ("levels", "repetitions = 8", "repetition = 8"),
        ("levels", "level_error_percent = 100", "level_error_percent = 0"),
        ("levels", "level_error_percent = 100", "attempts = 0"),
        ("sound", "rate_hz = 1000", "rate = 1000"),
        ("sound", 'order = "shuffled"\nrepetitions', 'order = "shufled"\nrepetitions'),
        ("sound", "force_limit_n = 8", "force_limit_n = 9"),
        ("sound", "density_kg_m3 = 1400", 'density_kg_m3 = "heavy"'),
        ("sound", 'kind = "explore"', 'kind = "wander"'),
        ("sound", "[conditions.is_thick]", "[conditions.isThick]"),
        ("sound", "radius_mm = 6\n", ""),
        ("sound", "format = 2", "format = 3"),
        ("mixed", 'intro = "At the end."', ""),
        ("mixed", 'intro = "How was it?"\nscale = "agreement"', 'intro = "How was it?"'),
        ("sound", 'id = "cold"', 'id = "cold"\nkind = "number"\nstep = 1'),
    ],
)
def test_the_schema_refuses_studies_that_check_refuses(study: str, old: str, new: str) -> None:
    assert complaints(text_of(study).replace(old, new)) != []


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("taplo") is None, reason="taplo is not installed")
def test_an_editor_of_toml_accepts_shipped_studies_and_names_the_line_of_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "schema.json").write_text(json.dumps(SCHEMA), encoding="utf-8", newline="\n")
    for name in shipped():
        (tmp_path / f"{name}.toml").write_text(text_of(name), encoding="utf-8", newline="\n")
    words = ["taplo", "lint", "--colors", "never", "--schema", (tmp_path / "schema.json").as_uri()]

    def lint() -> tuple[int, str]:
        process = subprocess.run(
            [*words, *map(str, tmp_path.glob("*.toml"))], capture_output=True, text=True, check=False
        )
        return process.returncode, process.stderr

    assert lint()[0] == 0
    wrong = text_of("demo").replace('order = "shuffled"', 'order = "shufled"')
    (tmp_path / "demo.toml").write_text(wrong, encoding="utf-8", newline="\n")
    line = wrong[: wrong.index('\norder = "shufled"')].count("\n") + 2
    code, output = lint()
    assert (code, f"demo.toml:{line}:9" in output) == (1, True)


def test_every_key_is_described():
    """An editor shows what a key means (the models of the force model describe theirs in the table)."""
    ours = {"StudyHead", "DeviceNeeds", "SceneDefaults", "Condition", "Scale", "Statement", "Questionnaire", "PageText",
            "Block", "Limits", "Explore", "Reach", "Rating", "Slider", "Number", "Choice", "Option", "Text", "ShowIf",
            "Score", "Stimulus", "Constant", *(kind.__name__ for kind in DESIGN_KINDS.values())}  # fmt: skip
    for name in ours:
        for key, node in SCHEMA["$defs"][name]["properties"].items():
            assert "description" in node or key == "kind", f"{name}.{key}"


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
    header, rule, *cells = [line for line in tables()["device"].splitlines() if line.startswith("|")]
    assert (header, rule) == ("| key | value | default | meaning |", "| --- | --- | --- | --- |")
    (row,) = [line for line in cells if line.startswith("| `force_limit_n`")]
    assert row == "| `force_limit_n` | number, at least 0.1, at most 8 | `8.0` | Maximum force on the hand \\[N]. |"
    rows = [line.replace("\\|", "") for line in format_markdown().splitlines() if line.startswith("|")]
    assert {line.count("|") for line in rows} == {5}
