"""Merging sites: folders are copied unchanged, whole or not at all."""

import hashlib
import json
import os
import re
import shutil
import signal
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import reversals
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.merged import all_exclusions, read_merged
from study_app.store.sessions.recovery import rebuild_session
from study_app.store.sites import merge as merging
from study_app.store.sites.merge import merge_sites
from study_app.store.verification.proofs import proof_text
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import withdraw
from tests.faults.support.killer import die, forked
from tests.platforms import needs_fork
from tests.store.conftest import contents
from tests.studies import made_up

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def labs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the folders of three sites, each with its own key; do not change them."""
    root, features = tmp_path_factory.mktemp("labs"), made_up("demo")
    return {
        site: rehearse_answers("demo", participants=2, seed=seed, results=root / site / "demo", features=features)
        for seed, site in enumerate("ABC", start=1)
    }


def test_an_open_folder_is_refused(labs: dict[str, Path], results: Path, tmp_path: Path) -> None:
    lab = Path(shutil.copytree(labs["A"], tmp_path / "lab"))
    with lock_folder(lab / "data/sub-P001/ses-01"), pytest.raises(StoreError, match="is open in another program"):
        merge_sites({"A": lab}, results / "pooled")
    assert list(results.parent.glob("**/.*.tmp")) == []


def test_a_folder_that_changes_while_it_is_copied_is_refused(
    labs: dict[str, Path], results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = Path(shutil.copytree(labs["A"], tmp_path / "lab"))
    copytree = shutil.copytree

    def copy_while_a_session_ends(*words: object, **options: object) -> object:
        (lab / "fingerprints.txt").write_text("another line", encoding="utf-8", newline="\n")
        return copytree(*words, **options)  # type: ignore[arg-type]

    monkeypatch.setattr("shutil.copytree", copy_while_a_session_ends)
    with pytest.raises(StoreError, match="was changed while it was being copied"):
        merge_sites({"A": lab}, results / "pooled")
    assert list(results.iterdir()) == []


def test_a_lost_receipt_does_not_prevent_a_merge(labs: dict[str, Path], results: Path, tmp_path: Path) -> None:
    lab = Path(shutil.copytree(labs["A"], tmp_path / "lab"))
    session = lab / "data/sub-P001/ses-01"
    (session / "receipt.json").unlink()
    merged = merge_sites({"A": lab, "B": labs["B"]}, results / "pooled")
    assert [site.sessions for site in merged.sites] == [2, 2]
    problems = [f"{error.place}: {error.message}" for error in verify_study(merged.path).errors]
    missing = "cannot be read (No such file or directory): restore it from a backup"
    assert f"sites/A/data/sub-P001/ses-01/receipt.json: {missing}" in problems
    (session / "journal.jsonl").unlink()
    with pytest.raises(StoreError, match=r"receipt\.json cannot be read"):
        merge_sites({"A": lab, "B": labs["B"]}, results / "again")


def test_commands_name_an_excluded_participant_with_the_site(labs: dict[str, Path], results: Path) -> None:
    pooled = results / "pooled"
    merge_sites({"A": labs["A"], "B": labs["B"]}, pooled)
    decision = [str(pooled), "--participant", "B-P001", "--by", "AB", "--reason", "asleep"]
    for command, excluded in (("exclude", ["B-P001"]), ("include", [])):
        result = CliRunner().invoke(commands, [command, *decision])
        assert (result.exit_code, "B-P001, session 1" in result.output) == (0, True), result.output
        assert [row.participant for row in all_exclusions(pooled)] == excluded
    assert [row.participant for row in reversals(pooled / "sites" / "B")] == ["P001"]


def test_the_proof_of_a_merged_study_has_the_sessions_of_every_site(labs: dict[str, Path], results: Path) -> None:
    pooled, proof_file = results / "pooled", results / "proof.txt"
    merge_sites({"A": labs["A"], "C": labs["C"]}, pooled)
    text = proof_text(StudyFolder(pooled))
    proof_file.write_text(text, encoding="utf-8", newline="\n")
    sessions = {
        f"sites/{site}/{folder.relative_to(labs[site]).as_posix()}"
        for site in ("A", "C")
        for folder in labs[site].glob("data/sub-*/ses-*")
    }
    assert sessions <= {line.split()[1] for line in text.splitlines()}
    assert verify_study(pooled, proof_file).is_sound

    fewer = [line for line in text.splitlines(keepends=True) if min(sessions) not in line]
    proof_file.write_text("".join(fewer), encoding="utf-8", newline="\n")
    assert not verify_study(pooled, proof_file).is_sound


def edit_receipts(lab: Path, **fields: object) -> Path:
    for path in lab.glob("data/sub-*/ses-*/receipt.json"):
        path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | fields), encoding="utf-8", newline="\n")
    return lab


def test_a_refused_merge_names_the_site_and_leaves_the_results_unchanged(
    labs: dict[str, Path], results: Path, tmp_path: Path
) -> None:
    a, b, c = (labs[site] for site in "ABC")
    pooled, new = results / "pooled", results / "new"
    merge_sites({"A": a, "B": b}, pooled)
    before = contents(results)
    names = "half", "other", "mixed", "pilot", "empty"
    half, other, mixed, pilot, empty = (Path(shutil.copytree(b, tmp_path / name)) for name in names)
    shutil.rmtree(half / "data/sub-P001")
    edit_receipts(other, protocol_hash="ab" * 32)
    edit_receipts(mixed, protocol_hash="cd" * 32)
    shutil.copy(b / "data/sub-P001/ses-01/receipt.json", mixed / "data/sub-P001/ses-01/receipt.json")
    edit_receipts(pilot, pilot=True)
    for folder in empty.glob("data/sub-*"):
        shutil.rmtree(folder)
    same = json.loads((b / "data/sub-P001/ses-01/receipt.json").read_text("utf-8"))["protocol_hash"]
    refusals: tuple[tuple[dict[str, Path], Path, str], ...] = (
        ({}, new, "no sites were specified"),
        ({"A": a, "a": b}, new, "site 'a' is specified twice (case is ignored)"),
        ({"b": c}, pooled, "site 'b' has already been merged (case is ignored)"),
        ({"A-1": a}, new, "'A-1' cannot be used as the name of a site: use at most 16 letters"),
        ({"S" * 17: a}, new, f"'{'S' * 17}' cannot be used as the name of a site"),
        ({"nul": a}, new, "site 'nul' is reserved for a device on Windows"),
        ({"A": a}, a.parent, f"{a.parent} is not a merged study and is not empty"),
        ({"C": c}, a / "x" / "y", f"{a / 'x' / 'y'} is, or lies within, the results folder {a}"),
        ({"A": a, "D": pooled}, new, f"site D: {pooled} belongs to a merged study"),
        ({"A": a, "D": pooled / "sites/B"}, new, f"site D: {pooled / 'sites/B'} belongs to a merged study"),
        ({"A": a, "D": a / "data"}, new, f"site D: {a / 'data'} is not the results folder of a study (dataset_descr"),
        ({"A": a, "D": empty}, new, f"site D: {empty} does not contain any sessions yet"),
        ({"D": mixed}, new, f"site D: sessions in {mixed} used 2 different protocols (SHA-256 "
         f"{same}, {'cd' * 32})"),
        ({"A": a, "D": other}, new, f"site D ran the protocol demo with SHA-256 {'ab' * 32}, but site A ran demo with "
         f"SHA-256 {same}"),
        ({"A": a, "D": pilot}, new, "site D contains pilot sessions, but site A contains rehearsals"),
        ({"B": b, "D": half}, new, f"{half / 'data/sub-P002/ses-01'} is a copy of {b / 'data/sub-P002/ses-01'}, so"),
        ({"D": half}, pooled, f"{half / 'data/sub-P002/ses-01'} is a copy of "
         f"{pooled / 'sites/B/data/sub-P002/ses-01'}, so"),
    )  # fmt: skip
    for folders, to, sentence in refusals:
        with pytest.raises(StoreError, match=re.escape(sentence)):
            merge_sites(folders, to)
    assert contents(results) == before
    inside = Path(shutil.copytree(c, pooled / "lab"))
    with pytest.raises(StoreError, match=re.escape(f"site C: {inside} lies within {pooled}: specify a folder outside")):
        merge_sites({"C": inside}, pooled)


def test_the_list_of_sites_states_sessions_withdrawals_and_key_of_each_site(
    labs: dict[str, Path], results: Path, tmp_path: Path
) -> None:
    folders = {"A": labs["A"], "C": Path(shutil.copytree(labs["C"], tmp_path / "lab"))}
    withdraw(folders["C"], "P002", by="AK", reason="asked")
    steps: list[tuple[str, float]] = []
    merged = merge_sites(folders, results / "pooled", lambda step, step_number: steps.append((step, step_number)))
    assert steps == [("copying site A", 0.0), ("copying site C", 0.0)]
    assert read_merged(results / "pooled") == merged
    keys = {
        site: hashlib.sha256((lab / "blinding/key.sealed").read_bytes()).hexdigest() for site, lab in folders.items()
    }
    assert [(site.name, site.sessions, site.withdrawals, site.key_hash) for site in merged.sites] == [
        ("A", 2, 0, keys["A"]), ("C", 1, 1, keys["C"]),
    ]  # fmt: skip
    receipt = json.loads((labs["A"] / "data/sub-P001/ses-01/receipt.json").read_text("utf-8"))
    assert (merged.study, merged.protocol_hash) == ("demo", receipt["protocol_hash"])
    content = merged.manifest.read_text("utf-8")
    for field, value, error in (
        ("study", "demo", "sites/C: contains study demo, but sites.json lists the sites of x"),
        ("key_hash", keys["C"], "sites/C/blinding/key.sealed: is not the key that site C was merged with: restore it "
         "from a backup"),
        ("protocol_hash", merged.protocol_hash, "sites/C/data/sub-P001/ses-01/receipt.json: has protocol "
         f"{merged.protocol_hash}, but was merged with {'ab' * 32}"),
    ):  # fmt: skip
        other = "x" if field == "study" else "ab" * 32
        text = content.replace(f'"{field}": "{value}"', f'"{field}": "{other}"')
        merged.manifest.write_text(text, encoding="utf-8", newline="\n")
        assert error in list(map(str, verify_study(merged.path).errors))


def merge_until(count: int, lab: Path, to: Path) -> None:
    """Merge site C; die after so many steps that write."""
    left = iter(range(count))

    def watched(whole: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *words, **options: die() if next(left, None) is None else whole(*words, **options)

    for module, name in ((merging, "copy_file"), (merging, "write_file"), (merging, "sync_folder"), (Path, "rename")):
        setattr(module, name, watched(getattr(module, name)))
    merge_sites({"C": lab}, to)


@needs_fork
@pytest.mark.parametrize("exists", [pytest.param(False, marks=pytest.mark.nightly), True])
def test_a_killed_merge_leaves_the_old_state_or_the_new_one(exists: bool, labs: dict[str, Path], results: Path) -> None:
    to, old, states = results / "killed", dict[str, bytes](), []
    for kill_at in (0, 3, 10, *range(20, 60, 2), *range(60, 90)):
        shutil.rmtree(to, ignore_errors=True)
        if exists:
            merge_sites({"A": labs["A"]}, to)
            old = contents(to)
        code = forked(lambda count=kill_at: merge_until(count, labs["C"], to))
        merged = read_merged(to)
        site_names = () if merged is None else merged.names
        states.append(site_names)
        if merged is not None:
            assert verify_study(to).is_sound
        if "C" not in site_names:
            assert code == -signal.SIGKILL
            merged_files = {} if merged is None else contents(to)
            assert {name: merged_files.get(name) for name in old} == old
            assert merge_sites({"C": labs["C"]}, to).names[-1] == "C"
        assert contents(to / "sites/C") == contents(labs["C"])
        assert [path.name for path in (to / "sites").iterdir() if path.name not in ("A", "C")] == []
        if code == 0:
            break
    assert {"C" in names for names in states} == {False, True}


def test_an_unfinished_session_that_was_deleted_at_a_site_is_missed(labs: dict[str, Path], results: Path) -> None:
    lab = Path(shutil.copytree(labs["A"], results / "lab"))
    session = lab / "data/sub-P002/ses-01"
    unfinished(session)
    assert verify_study(lab).is_sound
    pooled = merge_sites({"A": lab, "B": labs["B"]}, results / "pooled").path
    assert verify_study(pooled).is_sound
    if os.name == "posix":
        assert (pooled / "sites/A/blinding/key.sealed").stat().st_mode & 0o777 == 0o600
    shutil.rmtree(pooled / "sites/A/data/sub-P002")
    message = "sites/A: contains only 1 of the 2 sessions that sites.json lists: restore the others from a backup"
    assert message in list(map(str, verify_study(pooled).errors))


def test_a_withdrawal_may_reach_an_older_copy_after_merging(
    labs: dict[str, Path], results: Path, tmp_path: Path
) -> None:
    """The site withdrew the participant, then a copy from before was merged, and then withdrawn from."""
    lab, older = (Path(shutil.copytree(labs["A"], tmp_path / name)) for name in ("lab", "older"))
    withdraw(lab, "P001", by="AK", reason="asked", now=datetime.now().astimezone() - timedelta(hours=1))
    pooled = merge_sites({"A": older, "B": labs["B"]}, results / "pooled").path
    assert withdraw(lab, "P001", by="AK", reason="asked", also=[results]).folders == (pooled / "sites/A",)
    assert verify_study(pooled).is_sound


def test_a_session_withdrawn_under_a_slow_clock_is_not_reported_missing(labs: dict[str, Path], results: Path) -> None:
    pooled = merge_sites({"A": labs["A"], "B": labs["B"]}, results / "pooled").path
    slow = datetime.now().astimezone() - timedelta(hours=1)
    withdraw(pooled / "sites/A", "P001", by="AK", reason="asked", now=slow)
    assert verify_study(pooled).is_sound
    shutil.rmtree(pooled / "sites/B/data/sub-P001")
    message = "sites/B: contains only 1 of the 2 sessions that sites.json lists: restore the others from a backup"
    assert message in list(map(str, verify_study(pooled).errors))


def test_a_list_of_sites_of_format_1_is_read(labs: dict[str, Path], results: Path) -> None:
    merged = merge_sites({"A": labs["A"], "B": labs["B"]}, results / "pooled")
    content = json.loads(merged.manifest.read_text("utf-8"))
    for site in content["sites"]:
        del site["withdrawals"]
    merged.manifest.write_text(json.dumps(content | {"format": 1}), encoding="utf-8", newline="\n")
    withdraw(merged.folder("A"), "P001", by="AK", reason="asked")
    assert verify_study(merged.path).is_sound


def unfinished(session: Path) -> None:
    """Remove the end of a session from its journal, and the files that depend on it."""
    path = session / "journal.jsonl"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))
    (session / "checksums.sha256").unlink()
    receipt = json.loads((session / "receipt.json").read_text("utf-8"))
    unfinished_receipt = receipt | {"status": "unfinished", "reason": "", "ended_at": None}
    (session / "receipt.json").write_text(json.dumps(unfinished_receipt), encoding="utf-8", newline="\n")
    fingerprints = session.parents[2] / "fingerprints.txt"
    kept_lines = [
        line for line in fingerprints.read_text("utf-8").splitlines(keepends=True) if session.parent.name not in line
    ]
    fingerprints.write_text("".join(kept_lines), encoding="utf-8", newline="\n")
    rebuild_session(session)
