"""The export to share: a Psych-DS folder that holds what is needed to read, check and repeat the study."""

import hashlib
import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.analysis.export import psychds_dataset
from study_app.analysis.export.psychds_dataset import FOLDER, _footage, merged_variables
from study_app.analysis.export_study import export
from study_app.cli import commands
from study_app.errors import AnalysisError
from study_app.protocol.source.files import find_study_file, protocol_hash, shipped_file
from study_app.store.blinded.blinding import reveal
from study_app.store.files.csv_files import Column, optional
from study_app.store.files.output_files import FileCopy, write_files
from tests.analysis.export.described import undescribed
from tests.analysis.made_up import everybody, liquids, study
from tests.studies import rehearsed

pytestmark = pytest.mark.slow

OF_SCHEMA_ORG = {"@type", "name", "description", "unitText", "minValue", "maxValue"}
"""Properties of schema.org's PropertyValue that a column has."""


CREDITS = 'credits = { authors = ["A. Kox", "B. Lam"], license = "CC-BY-4.0", citation = "Kox and Lam (2026)" }\n'


FOOTAGE = b"waves"
"""A rehearsal shows no video."""


@pytest.fixture
def kitchen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Results of a study with footage in the workspace, whose file states authors and licence; the key is open."""
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    text = shipped_file("demo").read_text(encoding="utf-8")
    file = tmp_path / "protocols" / "kitchen.toml"
    file.parent.mkdir()
    text = text.replace("[study]\n", f"[study]\n{CREDITS}", 1).replace('"demo"', '"kitchen"', 1)
    head = '[conditions.thick]\nliquid = "thick"'
    text = text.replace(head, '[conditions.thick]\nliquid = "thin"\nview = "waves.mp4"', 1)
    file.write_text(text, encoding="utf-8", newline="\n")
    file.with_name("waves.mp4").write_bytes(FOOTAGE)
    folder = rehearsed(tmp_path / "results", "kitchen", people=4)
    reveal(folder, by="AK", reason="to share it")
    return folder


@pytest.fixture
def without_report(monkeypatch: pytest.MonkeyPatch) -> None:
    """Export without the report, which takes most of the time."""
    monkeypatch.setattr("study_app.analysis.report.write_report.has_questions", lambda _study: False)


@pytest.mark.nightly
def test_the_folder_has_all_that_is_needed_to_run_the_study_again(kitchen: Path, tmp_path: Path) -> None:
    stand_in, to = tmp_path / "validator", tmp_path / "out"
    stand_in.write_text(
        '#!/bin/sh\ntest -f "$1/dataset_description.json" && exit $(cat "$0.code")\n', encoding="utf-8", newline="\n"
    )
    stand_in.chmod(0o755)
    command = ["export", str(kitchen), "--to", str(to), "--validator", str(stand_in)]
    assert CliRunner().invoke(commands, command).exit_code == 2
    for code, expected in (("0", 0), ("1", 3)):
        Path(f"{stand_in}.code").write_text(code, encoding="utf-8", newline="\n")
        assert CliRunner().invoke(commands, [*command, "--psych-ds"]).exit_code == expected
    folder = to / FOLDER
    assert undescribed(folder) == set()
    assert (folder / "materials" / "kitchen.toml").read_bytes() == (tmp_path / "protocols/kitchen.toml").read_bytes()
    assert (folder / "materials" / "waves.mp4").read_bytes() == FOOTAGE
    report = (folder / "results" / "report.html").read_text(encoding="utf-8")
    assert "Which views were distinguished?" in report
    assert "Do the views differ, statement by statement?" in report
    assert "Thin, waves.mp4" in report
    assert "missing from" not in (folder / "README.md").read_text(encoding="utf-8")
    assert "questionnaires" in json.loads((folder / "materials" / "protocol.json").read_bytes())
    assert (folder / "results" / "report.html").is_file()
    assert not [path for path in (folder / "results").iterdir() if path.name.endswith("_data.csv")]
    if rscript := shutil.which("Rscript"):
        process = subprocess.run(
            [rscript, "analysis/report.R", "data", "results"], cwd=folder, check=False, capture_output=True
        )
        assert process.returncode == 0, process.stdout
        assert b"all numbers that R computed agree with the report" in process.stdout


@pytest.mark.usefixtures("without_report")
def test_missing_footage_is_named_with_its_hash(kitchen: Path, tmp_path: Path) -> None:
    digest = hashlib.sha256(FOOTAGE).hexdigest()
    footage = tmp_path / "protocols" / "waves.mp4"
    for change, why in (
        (lambda: footage.write_bytes(b"other waves"), "the file with this name has a different SHA-256"),
        (footage.unlink, "the file cannot be read: No such file or directory"),
    ):
        change()
        export(kitchen, tmp_path / "out", extras=["psych-ds"])
        folder = tmp_path / "out" / FOLDER
        assert (folder / "materials" / "kitchen.toml").is_file()
        assert not (folder / "materials" / "waves.mp4").exists()
        readme = (folder / "README.md").read_text(encoding="utf-8")
        assert f"Add the files that are missing from `materials`: waves.mp4 (SHA-256 {digest}; {why})." in readme


@pytest.mark.parametrize(
    ("is_revealed", "sentence"),
    [
        (True, "Conditions are identified by their names."),
        (False, "Conditions appear as codes, because the study is blinded."),
    ],
)
def test_the_readme_describes_participants_and_contents(is_revealed: bool, sentence: str) -> None:
    settings = liquids(2)
    case_study = study(settings, list(everybody(settings, 3, lambda *_: 4)))
    case_study = case_study if is_revealed else replace(case_study, settings={})
    tables, reports = {"a.csv": b"", "b.csv": b""}, {"report.html": b"", "report.R": b""}
    lines = psychds_dataset._readme(case_study, tables, reports, ["waves.mp4", "sea.mp4"]).decode().splitlines()
    assert lines[0] == "# Made up"
    assert lines[2].startswith("**All participants are simulated.** This Psych-DS dataset contains data from 3 part")
    assert f". {sentence} Missing values" in lines[2]
    assert [line for line in lines if line.startswith("- `")] == [
        "- `data/a.csv`",
        "- `data/b.csv`",
        "- `results/report.html`: the report; `Rscript analysis/report.R data results` recomputes its main numbers",
    ]
    assert "Add the files that are missing from `materials`: waves.mp4, sea.mp4." in lines


def test_a_studys_protocol_file_and_footage_are_found_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = shipped_file("rek2024")
    study_file = find_study_file("rek2024", {protocol_hash(file.read_bytes())}, {})
    assert study_file is not None
    assert (study_file[0].name, study_file[1]) == (file.name, (file.read_bytes(), {}, {}))
    conditions = {"fast": {"view": "b.mp4", "footage_sha256": "1f"}, "slow": {"view": "a.mp4", "footage_sha256": "2e"}}
    key = SimpleNamespace(tables={"conditions": conditions | {"none": {"view": ""}}})
    monkeypatch.setattr(psychds_dataset, "revealed_key", lambda _folder: key)
    study: Any = SimpleNamespace(folder=tmp_path)
    assert _footage(study) == {"a.mp4": "2e", "b.mp4": "1f"}


def test_footage_that_changes_during_copying_leaves_no_file(tmp_path: Path) -> None:
    source, to = tmp_path / "waves.mp4", tmp_path / "out"
    copied = FileCopy(source, hashlib.sha256(FOOTAGE).hexdigest())
    for content, says in (
        (None, r"waves.mp4 cannot be read \(No such file"),
        (b"other", "changed while it was being copied"),
    ):
        if content is not None:
            source.write_bytes(content)
        with pytest.raises(AnalysisError, match=says):
            write_files(to, {"README.md": b"x", "materials/waves.mp4": copied})
        assert list(to.rglob("*")) == []
    source.write_bytes(FOOTAGE)
    write_files(to, {"materials/waves.mp4": copied})
    assert (to / "materials" / "waves.mp4").read_bytes() == FOOTAGE


@pytest.mark.nightly
def test_descriptions_name_standard_properties_authors_and_licence(kitchen: Path, tmp_path: Path) -> None:
    (tmp_path / "protocols" / "gone.toml").symlink_to(tmp_path / "nowhere.toml")  # another study, not there any more
    export(kitchen, tmp_path / "out", extras=["psych-ds"])
    folder = tmp_path / "out" / FOLDER
    assert (folder / "materials" / "kitchen.toml").is_file()
    description = json.loads((folder / "dataset_description.json").read_bytes())
    assert {name for variable in description["variableMeasured"] for name in variable} <= OF_SCHEMA_ORG
    tables = sorted((folder / "data").glob("*.csv"))
    assert tables
    for table in tables:
        sidecar = json.loads(table.with_suffix(".json").read_bytes())
        header = table.read_text(encoding="utf-8").splitlines()[0].split(",")
        assert [variable["name"] for variable in sidecar["variableMeasured"]] == header
        assert {name for variable in sidecar["variableMeasured"] for name in variable} <= OF_SCHEMA_ORG
        assert (sidecar["license"], sidecar["citation"]) == ("CC-BY-4.0", "Kox and Lam (2026)")
    metadata = json.loads((folder / "data" / "file_metadata.json").read_bytes())
    assert metadata == {name: value for name, value in description.items() if name != "variableMeasured"}
    assert description["author"] == ["A. Kox", "B. Lam"]
    assert description["license"] == "CC-BY-4.0"
    assert description["citation"] == "Kox and Lam (2026)"
    stated = "Authors: A. Kox, B. Lam.", "Licence: CC-BY-4.0.", "How to cite: Kox and Lam (2026)."
    for name in ("README.md", "results/report.html", "analysis/report.R"):
        assert all(line in (folder / name).read_text(encoding="utf-8") for line in stated), name
    settings = json.loads((folder / "analysis/settings.json").read_bytes())
    for facts in (
        settings,
        json.loads((folder / "documentation/codebook.json").read_bytes())["study"],
        json.loads((folder / "results/report.json").read_bytes())["study"],
    ):
        assert (facts["name"], facts["license"], facts["citation"]) == ("kitchen", "CC-BY-4.0", "Kox and Lam (2026)")
        assert facts["author"] == ["A. Kox", "B. Lam"]
    assert settings["analysis"]["alpha"] == 0.05
    assert not settings["analysis"].keys() & {"made", "changed"}


def test_units_and_ranges_hold_in_every_table() -> None:
    (variable,) = merged_variables(
        {
            "study-x_description-a_data.csv": (Column("n", "integer", "Points.", unit="s", minimum=1, maximum=7),),
            "study-x_description-b_data.csv": (optional("n", "number", "Seconds.", minimum=0),),
            "study-x_description-c_data.csv": (optional("n", "number", "Points.", minimum=2, maximum=9),),
        }
    )
    assert variable == {
        "@type": "PropertyValue",
        "name": "n",
        "description": "In a, c: Points. In b: Seconds.",
        "minValue": 0,
    }
