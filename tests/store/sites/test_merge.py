"""Merging sites: folders are copied unchanged, whole or not at all."""

import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.store.folders import StudyFolder
from study_app.store.sessions.folder_lock import open_alone
from study_app.store.sites.merge import merge
from study_app.store.sites.merged import own_place, read_merged
from study_app.store.sites.merged_rows import participants_of
from study_app.store.sites.verify_sites import verify_folder
from study_app.store.verification.verify_study import verify

pytestmark = pytest.mark.slow

KILLED = """
import os, shutil, signal, sys
from pathlib import Path
from study_app.store import atomic
from study_app.store.sites import merge as merging

left = int(sys.argv[3])

def stop(*words, **options):
    global left
    left -= 1
    if left < 0:
        os.kill(os.getpid(), signal.SIGKILL)

for module, name in ((merging, "_copy_file"), (merging, "write_file"), (merging, "sync_folder"), (Path, "rename")):
    def watched(*words, whole=getattr(module, name), **options):
        stop()
        return whole(*words, **options)
    setattr(module, name, watched)
merging.merge({"C": Path(sys.argv[1])}, Path(sys.argv[2]))
print(left)
"""


def run(*words: object) -> Result:
    return CliRunner().invoke(commands, [str(word) for word in words])


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_sites_are_copied_unchanged_and_sound(labs: dict[str, Path], pooled: Path) -> None:
    for site in "AB":
        assert contents(pooled / "sites" / site) == contents(labs[site])
        assert verify(pooled / "sites" / site).sound
        copy = labs[site] / "fingerprints.txt"
        assert verify(pooled / "sites" / site, copy).sound
    found = verify_folder(pooled)
    assert (found.sound, found.sessions) == (True, 4)
    key = StudyFolder(pooled / "sites/A").key
    assert key.stat().st_mode & 0o777 == StudyFolder(labs["A"]).key.stat().st_mode & 0o777


def test_a_site_can_be_added_later(labs: dict[str, Path], pooled: Path) -> None:
    before = contents(pooled)
    made = merge({"C": labs["C"]}, pooled)
    assert made.names == ("A", "B", "C")
    assert read_merged(pooled) == made
    after = contents(pooled)
    assert {name: after[name] for name in before if name != "sites.json"} == {
        name: content for name, content in before.items() if name != "sites.json"
    }
    assert verify_folder(pooled).sessions == 6


def test_equal_ids_of_two_sites_are_two_participants(pooled: Path) -> None:
    rows = participants_of(pooled)
    assert [row["participant"] for row in rows] == ["A-P001", "A-P002", "B-P001", "B-P002"]
    assert own_place(pooled, "B-P001") == (pooled / "sites/B", "P001")
    for wrong in ("P001", "D-P001", "B-"):
        with pytest.raises(StoreError, match=r"several sites \(A, B\)"):
            own_place(pooled, wrong)


def test_another_protocol_is_refused_with_both_hashes(labs: dict[str, Path], results: Path) -> None:
    other = shutil.copytree(labs["B"], results / "other")
    for receipt in other.glob("data/sub-*/ses-*/receipt.json"):
        held = json.loads(receipt.read_text())
        receipt.write_text(json.dumps(held | {"protocol_hash": "f" * 64}))
    first = json.loads(next(labs["A"].glob("data/sub-*/ses-*/receipt.json")).read_text())["protocol_hash"]
    with pytest.raises(StoreError, match=rf"site B ran .* {'f' * 64}, site A demo with SHA-256 {first}"):
        merge({"A": labs["A"], "B": other}, results / "pooled")
    assert not (results / "pooled").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("A={A}", "a={B}"), "site 'a' is given twice"),
        (("A-1={A}",), "only letters A-Z, a-z and digits 0-9"),
        (("A={A}", "B={A}"), "is a copy of"),
        (("A={A}/data",), "is not the results folder of a study"),
        (("A={A}", "B={pooled}"), "belongs to a merged study"),
        (("A={A}", "B={pooled}/sites/B"), "belongs to a merged study"),
        (("A={A}", "B=nowhere"), "is not the results folder of a study"),
    ],
)
def test_what_cannot_be_merged_is_refused(
    words: tuple[str, ...], says: str, labs: dict[str, Path], pooled: Path, results: Path
) -> None:
    sites = [part for word in words for part in ("--site", word.format(**labs, pooled=pooled))]
    done = run("merge", *sites, "--to", results / "new")
    assert isinstance(done.exception, StoreError)
    assert says in str(done.exception)
    assert not (results / "new").exists()


def test_an_open_folder_and_a_used_target_are_refused(labs: dict[str, Path], results: Path, tmp_path: Path) -> None:
    lab = Path(shutil.copytree(labs["A"], tmp_path / "lab"))
    with open_alone(lab / "data/sub-P001/ses-01"), pytest.raises(StoreError, match="is open in another program"):
        merge({"A": lab}, results / "pooled")
    with pytest.raises(StoreError, match="not empty"):
        merge({"A": lab}, tmp_path)
    with pytest.raises(StoreError, match=r"lies within, the results folder"):
        merge({"B": labs["B"]}, lab / "pooled")
    assert list(results.parent.glob("**/.*.tmp")) == []


def test_a_folder_that_changes_while_it_is_copied_is_refused(
    labs: dict[str, Path], results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = Path(shutil.copytree(labs["A"], tmp_path / "lab"))
    copytree = shutil.copytree

    def copy_while_a_session_ends(*words: object, **options: object) -> object:
        (lab / "fingerprints.txt").write_text("another line")
        return copytree(*words, **options)  # type: ignore[arg-type]

    monkeypatch.setattr("shutil.copytree", copy_while_a_session_ends)
    with pytest.raises(StoreError, match="was changed while it was copied"):
        merge({"A": lab}, results / "pooled")
    assert list(results.iterdir()) == []


def test_a_session_that_begins_before_the_copy_is_refused(
    labs: dict[str, Path], results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = Path(shutil.copytree(labs["A"], tmp_path / "lab"))

    def begin_a_session(*_sources: object) -> None:
        shutil.copytree(lab / "data/sub-P001", lab / "data/sub-P009")

    monkeypatch.setattr("study_app.store.sites.merge._check_sessions", begin_a_session)
    with pytest.raises(StoreError, match="was changed while it was copied"):
        merge({"A": lab}, results / "pooled")
    assert list(results.iterdir()) == []


@pytest.mark.parametrize("exists", [pytest.param(False, marks=pytest.mark.nightly), True])
def test_a_killed_merge_leaves_the_old_state_or_the_new_one(exists: bool, labs: dict[str, Path], results: Path) -> None:
    to, old, states = results / "killed", dict[str, bytes](), []
    for kill_at in (0, 3, 10, *range(20, 60, 2), *range(60, 90)):
        shutil.rmtree(to, ignore_errors=True)
        if exists:
            merge({"A": labs["A"]}, to)
            old = contents(to)
        words = [sys.executable, "-c", KILLED, str(labs["C"]), str(to), str(kill_at)]
        done = subprocess.run(words, check=False, capture_output=True, text=True)
        merged = read_merged(to)
        listed = () if merged is None else merged.names
        states.append(listed)
        if merged is not None:
            assert verify_folder(to).sound
        if "C" not in listed:
            assert done.returncode == -signal.SIGKILL
            held = {} if merged is None else contents(to)
            assert {name: held.get(name) for name in old} == old
            assert merge({"C": labs["C"]}, to).names[-1] == "C"
        assert contents(to / "sites/C") == contents(labs["C"])
        assert [path.name for path in (to / "sites").iterdir() if path.name not in ("A", "C")] == []
        if done.returncode == 0:
            break
    assert {"C" in listed for listed in states} == {False, True}
