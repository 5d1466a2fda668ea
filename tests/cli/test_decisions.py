"""What the commands for sites, exclusions, withdrawals and unblinding print and write: each value is another one's."""

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.store.blinded.blinding import read_key
from study_app.store.exclusions import Exclusion
from study_app.store.files.folders import StudyFolder
from study_app.store.files.output_files import Output, write_output
from study_app.store.integrity.checksums import checked_line
from study_app.store.receipt import read
from study_app.store.unblinding import Unblinded
from study_app.store.verification.reproduction import Reproduction
from study_app.store.withdrawals import Withdrawn, proof_of_withdrawal, tombstones
from tests.cli.test_transcripts import make_labs
from tests.studies import once

pytestmark = pytest.mark.slow

WHO = ("--by", "AK", "--reason")


def run(*words: object, code: int = 0) -> tuple[list[str], list[str]]:
    """Return the lines that a command prints, and those that it writes to the error stream without its progress."""
    result = CliRunner().invoke(commands, [str(word) for word in words])
    assert result.exit_code == code, result.output
    return result.stdout.splitlines(), [line for line in result.stderr.splitlines() if line.startswith("warning")]


@pytest.fixture
def labs(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three labs with two participants each, as the results of a workspace; B lacks P002."""
    folder = tmp_path / "results"
    shutil.copytree(once(tmp_path_factory, "cli-labs", make_labs), folder)
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    run("withdraw", folder / "B", "--participant", "P002", *WHO, "moved away")
    return folder


def rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))[1:]


def test_sites_are_merged_and_those_that_were_there_are_kept(labs: Path) -> None:
    pooled = labs / "pooled"
    keys = {site: read_key(labs / site).hash[:12] for site in "ABC"}
    protocol = read(StudyFolder(labs / "A").session("P001", 1).receipt)["protocol_hash"][:12]
    last = f"study demo, protocol {protocol}: {pooled}"
    a, b = f"site A: 2 sessions, key {keys['A']}", f"site B: 1 session, key {keys['B']}"
    assert run("merge", f"A={labs / 'A'}", f"B={labs / 'B'}", "--to", pooled)[0] == [
        f"merged  {a}",
        f"merged  {b}",
        last,
    ]
    c = f"merged  site C: 2 sessions, key {keys['C']}"
    assert run("merge", "C=C", "--to", pooled)[0] == [f"kept    {a}", f"kept    {b}", c, last]
    damaged = StudyFolder(labs / "C").session("P002", 1)
    with damaged.journal.open("ab") as file:
        file.write(b"damage\n")
    warnings = run("merge", "A=A", "C=C", "--to", labs / "others")[1]
    assert warnings == [
        f"warning: the journal of {damaged.path} (site C) is damaged, so its results may be incomplete; the verify "
        "command describes the damage"
    ]
    sites = json.loads((pooled / "sites.json").read_bytes())["sites"]
    assert [(site["name"], site["sessions"], site["withdrawals"]) for site in sites] == [
        ("A", 2, 0), ("B", 1, 1), ("C", 2, 0),
    ]  # fmt: skip
    for wrong in ("C", "C=", "=labs/C"):
        assert (
            "does not have the form NAME=RESULTS" in CliRunner().invoke(commands, ["merge", wrong, "--to", "x"]).output
        )


def test_decisions_about_a_session_are_recorded_at_its_site(labs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pooled, north = labs / "pooled", labs / "pooled" / "sites" / "A"
    run("merge", f"A={labs / 'A'}", f"C={labs / 'C'}", "--to", pooled)
    trial = ("--participant", "A-P002", "--trial", 2)
    assert run("exclude", pooled, *trial, *WHO, "coughed") == (["participant A-P002, session 1, trial 2"], [])
    rule = ("--rule", "fast_answers")
    hasty = ("--participant", "A-P001", *rule, *WHO, "hasty")
    run("exclude", pooled, *hasty, code=1)
    run("exclude", pooled, *hasty, "--trial", 2, code=2)
    monkeypatch.setattr("study_app.analysis.planned_exclusions.check_rule", lambda *_: False)
    assert run("exclude", pooled, *hasty) == (
        ["participant A-P001, session 1"],
        ["warning: the rule fast_answers can only be checked after unblinding; the report will check it"],
    )
    unchecked = "hasty; the rule could not be checked because the key was sealed (decided by AK)"
    assert [[*row[:5], row[6]] for row in rows(north / "exclusions.csv")] == [
        ["P002", "1", "2", "AK", "coughed", "false"],
        ["P001", "1", "n/a", "fast_answers", unchecked, "false"],
    ]
    assert not (pooled / "sites" / "C" / "exclusions.csv").exists()
    assert run("include", pooled, *trial, *WHO, "quietly")[0] == [
        "included again: participant A-P002, session 1, trial 2"
    ]
    assert run("include", pooled, "--participant", "C-P001", "--rule", "below_chance", *WHO, "tired")[0] == [
        "kept, although the rule below_chance applies: participant C-P001, session 1"
    ]
    run("include", pooled, *trial, *rule, *WHO, "both", code=2)
    codes, warnings = run("unblind", pooled, *WHO, "closed")
    key = read_key(north)
    for block, conditions in key.codes.items():
        assert [line for line in codes if line.startswith(f"{block}  A-")] == [
            f"{block}  A-{code}  {condition}" for code, condition in conditions.items()
        ]
    assert warnings == []
    warning_lines = ["warning: the key is open, so the report will state that this was decided after unblinding"]
    assert run("exclude", pooled, *trial, *WHO, "later") == (["participant A-P002, session 1, trial 2"], warning_lines)
    assert run("include", pooled, *trial, *WHO, "again")[1] == warning_lines
    reveals = [json.loads(line) for line in (north / "blinding" / "reveals.jsonl").read_bytes().splitlines()]
    assert [(reveal["by"], reveal["reason"]) for reveal in reveals] == [("AK", "closed")]


def test_unblinding_prints_the_codes_and_the_remaining_files(labs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    codes = {"liquids": {"K": "water/oil"}, "delays": {"M": "0.3/up", "R": "/down", "T": "honey"}}
    row = Exclusion(
        participant="A-P002", session=3, trial=5, rule_or_person="catch", reason="2 of 3 wrong", excluded_at="noon"
    )
    unblinded_sites = {
        "A-": Unblinded(codes, ("trials.csv is open",), (row,)),
        "C-": Unblinded({"delays": {"V": "tar"}}, (), ()),
    }
    monkeypatch.setattr("study_app.store.unblinding.unblind_folder", lambda *_, **__: unblinded_sites)
    assert run("unblind", labs / "A", *WHO, "closed", code=3) == (
        [
            "liquids  A-K  standard water", "delays  A-M  standard 0.3", "delays  A-R  all levels",
            "delays  A-T  honey", "excluded  participant A-P002, session 3, trial 5: 2 of 3 wrong", "delays  C-V  tar",
        ],
        ["warning: trials.csv is open"],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("differences", "closing", "code"),
    [
        ([], "reproduced: the order of trials and statements matches the receipt", 0),
        (["block a: trial 7 was water"], "orders or levels differ", 3),
    ],
)
def test_reproducing_lists_differences_then_followed_levels(
    labs: Path, monkeypatch: pytest.MonkeyPatch, differences: list[str], closing: str, code: int
) -> None:
    followed = ["block b: 4 of 5 levels are consistent with the answers"]
    reproduction = Reproduction(differences, followed)
    monkeypatch.setattr("study_app.store.verification.reproduce_session", lambda _session: reproduction)
    session = StudyFolder(labs / "A").session("P001", 1).path
    assert run("reproduce", session, code=code)[0] == [*differences, *followed, closing]


def test_a_withdrawal_prints_the_erased_and_the_remaining_files(
    labs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, person = labs / "A", ("--participant", "P001")
    write_output(study, tmp_path / "tables", {"a.csv": b"P001"}, None)
    lines, warnings = run("withdraw", study, *person, *WHO, "asked")
    tombstone = tombstones(StudyFolder(study))["P001"]
    assert (tombstone.by, tombstone.reason, tombstone.participant) == ("AK", "asked", "P001")
    proof = f"keep this line with the fingerprints:  {checked_line(*proof_of_withdrawal(tombstone))}".rstrip()
    searched = f"searched   {labs}; if there are copies elsewhere, repeat the command with --also DIR"
    assert [line for line in lines if line] == [
        f"erased     the data of participant P001 in {study}",
        f"deleted    {tmp_path / 'tables' / 'a.csv'}, which was produced from the results",
        proof, searched,
    ]  # fmt: skip
    assert warnings == []
    twice = ("--by", "BM", "--reason", "twice", "--also", labs / "B", "--also", labs / "C")
    again, _ = run("withdraw", study, *person, *twice)
    searched = searched.replace(f"{labs};", f"{labs}, {labs / 'B'}, {labs / 'C'};")
    nothing = f"nothing to erase: participant P001 already withdrew at {tombstone.at}"
    assert [line for line in again if line] == [proof, nothing, searched]
    outputs = tuple(Output(to=tmp_path / name, at=f"at {name}", files=("a.csv",)) for name in ("gone", "tables"))
    (tmp_path / "tables" / "a.csv").write_bytes(b"P001")
    withdrawal = Withdrawn(tombstone, (study,), (), outputs, ("notes.txt still names P001",))
    monkeypatch.setattr("study_app.store.withdrawals.withdraw", lambda *_, **__: withdrawal)
    assert run("withdraw", study, *person, *WHO, "asked")[1] == [
        f"warning: output created at at gone outside the workspace (it no longer exists): {tmp_path / 'gone'}",
        "warning: output created at at tables outside the workspace (delete it and create it again): "
        f"{tmp_path / 'tables'}",
        "warning: notes.txt still names P001",
    ]  # fmt: skip


@pytest.mark.parametrize("asked", ["", "--wide", "--parquet", "--sav", "--psych-ds"])
def test_each_option_of_an_export_asks_for_its_own_files(
    labs: Path, monkeypatch: pytest.MonkeyPatch, asked: str
) -> None:
    arguments: dict[str, Any] = {}

    def exported(folder: Path, to: Path, **given: Any) -> tuple[Path, ...]:
        arguments.update(given, folder=folder, to=to)
        return (to / "codebook.json",)

    monkeypatch.setattr("study_app.analysis.export_study.export", exported)
    lines, _ = run("export", labs / "A", "--to", labs / "out", *filter(None, [asked]))
    assert (arguments["folder"], arguments["to"], arguments["extras"]) == (
        labs / "A",
        labs / "out",
        [*filter(None, [asked[2:]])],
    )
    assert "codebook.json" in "".join(lines)
