"""Merging sites: folders are copied unchanged, whole or not at all."""

import json
import shutil
import signal
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.store.blinded.blinding import reveals
from study_app.store.blinded.unblinding import all_opened, reveals_of
from study_app.store.exclusions import exclusions
from study_app.store.folders import StudyFolder
from study_app.store.output_files import write_output
from study_app.store.sessions.folder_lock import open_alone
from study_app.store.sessions.recovery import rebuild
from study_app.store.sites import merge as merging
from study_app.store.sites.merge import merge
from study_app.store.sites.merged import all_exclusions, own_place, read_merged
from study_app.store.tables.study_files import check_study, participants_of
from study_app.store.verification.verify_study import verify
from study_app.store.withdrawals import withdraw
from tests.faults.support.killer import die, forked
from tests.platforms import needs_fork

pytestmark = pytest.mark.slow


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
    found = verify(pooled)
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
    assert verify(pooled).sessions == 6


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
    sites = [word.format(**labs, pooled=pooled) for word in words]
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


def merge_until(count: int, lab: Path, to: Path) -> None:
    """Merge site C; die after so many steps that write."""
    left = iter(range(count))

    def watched(whole: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *words, **options: die() if next(left, None) is None else whole(*words, **options)

    for module, name in ((merging, "_copy_file"), (merging, "write_file"), (merging, "sync_folder"), (Path, "rename")):
        setattr(module, name, watched(getattr(module, name)))
    merge({"C": lab}, to)


@needs_fork
@pytest.mark.parametrize("exists", [pytest.param(False, marks=pytest.mark.nightly), True])
def test_a_killed_merge_leaves_the_old_state_or_the_new_one(exists: bool, labs: dict[str, Path], results: Path) -> None:
    to, old, states = results / "killed", dict[str, bytes](), []
    for kill_at in (0, 3, 10, *range(20, 60, 2), *range(60, 90)):
        shutil.rmtree(to, ignore_errors=True)
        if exists:
            merge({"A": labs["A"]}, to)
            old = contents(to)
        code = forked(lambda count=kill_at: merge_until(count, labs["C"], to))
        merged = read_merged(to)
        listed = () if merged is None else merged.names
        states.append(listed)
        if merged is not None:
            assert verify(to).sound
        if "C" not in listed:
            assert code == -signal.SIGKILL
            held = {} if merged is None else contents(to)
            assert {name: held.get(name) for name in old} == old
            assert merge({"C": labs["C"]}, to).names[-1] == "C"
        assert contents(to / "sites/C") == contents(labs["C"])
        assert [path.name for path in (to / "sites").iterdir() if path.name not in ("A", "C")] == []
        if code == 0:
            break
    assert {"C" in listed for listed in states} == {False, True}


def test_keys_stay_sealed_and_are_opened_each(labs: dict[str, Path], pooled: Path) -> None:
    assert reveals_of(pooled) == ()
    one = run("unblind", pooled / "sites/B", "--by", "AK", "--reason", "closed")
    assert one.exit_code == 0
    assert not all_opened(pooled)
    done = run("unblind", pooled, "--by", "AK", "--reason", "closed")
    assert done.exit_code == 0
    assert all_opened(pooled)
    assert [(one["site"], one["by"]) for one in reveals_of(pooled)] == [("A", "AK"), ("B", "AK"), ("B", "AK")]
    assert {line.split()[1].partition("-")[0] for line in done.output.splitlines()} == {"A", "B"}
    assert reveals(labs["A"]) == ()
    assert verify(pooled).sound


def test_no_key_is_opened_where_one_is_missing(pooled: Path) -> None:
    (pooled / "sites/B/blinding/key.sealed").unlink()
    assert "key.sealed cannot be read" in str(run("unblind", pooled, "--by", "AK", "--reason", "closed").exception)
    assert reveals(pooled / "sites/A") == ()


def test_exclusions_go_to_the_site(pooled: Path) -> None:
    assert run("exclude", pooled, "--participant", "B-P001", "--by", "AK", "--reason", "x").output == (
        "participant B-P001, session 1\n"
    )
    assert [row.participant for row in all_exclusions(pooled)] == ["B-P001"]
    assert [row.participant for row in exclusions(pooled / "sites/B")] == ["P001"]
    assert exclusions(pooled / "sites/A") == ()
    assert run("include", pooled, "--participant", "B-P001", "--by", "AK", "--reason", "x").exit_code == 0
    assert all_exclusions(pooled) == ()


def test_no_session_runs_in_a_merged_study(pooled: Path) -> None:
    for folder in (pooled, pooled / "sites/A"):
        with pytest.raises(StoreError, match=r"run sessions in (the folder of a site|the site's own)"):
            check_study(StudyFolder(folder), "demo")


def test_a_withdrawal_reaches_the_merged_copy_of_that_site_alone(
    labs: dict[str, Path], pooled: Path, results: Path, tmp_path: Path
) -> None:
    lab = Path(shutil.copytree(labs["A"], tmp_path / "lab"))
    write_output(pooled, results / "tables", {"table.csv": b"of A-P001"})
    done = withdraw(lab, "P001", by="AK", reason="asked", also=[results])
    assert done.folders == (lab, pooled / "sites/A")
    assert (pooled / "sites/B/data/sub-P001/ses-01/journal.jsonl").is_file()
    assert [path.name for path in done.outputs] == ["table.csv"]
    assert list((results / "tables").iterdir()) == []
    assert [row["participant"] for row in participants_of(pooled)] == ["A-P002", "B-P001", "B-P002"]
    assert verify(pooled).sound


def test_a_participant_of_a_merged_study_withdraws_from_copy_and_site(
    labs: dict[str, Path], pooled: Path, tmp_path: Path
) -> None:
    lab = Path(shutil.copytree(labs["B"], tmp_path / "lab"))
    words = ("--participant", "B-P002", "--by", "AK", "--reason", "asked", "--also", lab)
    done = run("withdraw", pooled, *words)
    assert done.exit_code == 0, done.exception
    assert not (pooled / "sites/B/data/sub-P002").exists()
    assert not (lab / "data/sub-P002").exists()
    assert (pooled / "sites/A/data/sub-P002").is_dir()
    assert verify(pooled).sound
    assert run("withdraw", pooled, "--participant", "P002", "--by", "AK", "--reason", "asked").exit_code != 0


def test_verify_finds_what_was_changed_after_merging(labs: dict[str, Path], pooled: Path) -> None:
    response = next((pooled / "sites/B").glob("data/sub-P001/ses-01/*responses*"))
    response.write_bytes(response.read_bytes() + b"x")
    assert any(str(one).startswith("sites/B/data/sub-P001/ses-01/") for one in verify(pooled).errors)
    (pooled / "sites/A/dataset_description.json").rename(pooled / "sites/A/aside.json")
    found = list(map(str, verify(pooled).errors))
    assert any(one.startswith("sites/A: is not a study folder") for one in found)
    assert any(one.startswith("sites/B/data/sub-P001/ses-01/") for one in found)  # the other sites are checked, too
    (pooled / "sites/A/aside.json").rename(pooled / "sites/A/dataset_description.json")
    shutil.rmtree(pooled / "sites/A/data/sub-P001")
    assert "is missing, but fingerprints.txt lists it" in "\n".join(map(str, verify(pooled).errors))
    shutil.rmtree(pooled / "sites/B")
    assert "sites/B: is missing" in "\n".join(map(str, verify(pooled).errors))
    shutil.copytree(labs["C"], pooled / "sites/B")
    assert "is not the key that site B was merged with" in "\n".join(map(str, verify(pooled).errors))


def test_a_damaged_list_of_sites_is_refused_and_a_changed_one_is_an_error(pooled: Path) -> None:
    path = pooled / "sites.json"
    held = json.loads(path.read_text())
    path.write_text(json.dumps(held | {"study": "another"}))
    found = list(map(str, verify(pooled).errors))
    assert found == [f"sites/{name}: is of study demo, but sites.json lists sites of another" for name in "AB"]
    for text in ("{", "[]", '{"format": 1}', '{"format": 1, "study": "demo", "protocol_hash": "", "sites": [{}]}'):
        path.write_text(text)
        with pytest.raises(StoreError, match="does not list the sites"):
            read_merged(pooled)
    path.write_text(json.dumps(held | {"format": "x" * 5000}))
    with pytest.raises(StoreError, match=r"has format 'x{199}…, this version reads 1"):
        read_merged(pooled)


def test_a_site_elsewhere_is_not_read(pooled: Path, tmp_path: Path) -> None:
    (pooled / "sites/B").rename(tmp_path / "elsewhere")
    (pooled / "sites/B").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(
        StoreError,
        match=r"sites/B leads by a link out of .*pooled, to .*elsewhere: replace the link by the folder itself",
    ):
        read_merged(pooled)


def test_an_unfinished_session_that_was_deleted_at_a_site_is_missed(labs: dict[str, Path], results: Path) -> None:
    lab = Path(shutil.copytree(labs["A"], results / "lab"))
    session = lab / "data/sub-P002/ses-01"
    unfinished(session)
    assert verify(lab).sound
    pooled = merge({"A": lab, "B": labs["B"]}, results / "pooled").path
    assert verify(pooled).sound
    shutil.rmtree(pooled / "sites/A/data/sub-P002")
    said = "sites/A: has 1 of the 2 sessions that sites.json lists: restore the others from a copy"
    assert said in list(map(str, verify(pooled).errors))


def test_a_withdrawal_that_reaches_an_older_copy_after_merging_is_no_error(
    labs: dict[str, Path], results: Path, tmp_path: Path
) -> None:
    """The site withdrew the participant, then a copy from before was merged, and then withdrawn from."""
    lab, older = (Path(shutil.copytree(labs["A"], tmp_path / name)) for name in ("lab", "older"))
    withdraw(lab, "P001", by="AK", reason="asked", now=datetime.now().astimezone() - timedelta(hours=1))
    pooled = merge({"A": older, "B": labs["B"]}, results / "pooled").path
    assert withdraw(lab, "P001", by="AK", reason="asked", also=[results]).folders == (pooled / "sites/A",)
    assert verify(pooled).sound


def unfinished(session: Path) -> None:
    """Take the end of a session away, and what follows from it."""
    path = session / "journal.jsonl"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))
    (session / "checksums.sha256").unlink()
    receipt = json.loads((session / "receipt.json").read_text())
    held = receipt | {"status": "unfinished", "reason": "", "ended_at": None}
    (session / "receipt.json").write_text(json.dumps(held))
    fingerprints = session.parents[2] / "fingerprints.txt"
    kept = [line for line in fingerprints.read_text().splitlines(keepends=True) if session.parent.name not in line]
    fingerprints.write_text("".join(kept))
    rebuild(session)


def test_studies_and_sessions_list_a_merged_study(pooled: Path) -> None:
    listed = (pooled / "sites.json").read_bytes()
    assert "  pooled  4 sessions, sites A, B" in run("studies").output
    names = [line.split()[0] for line in run("sessions", "pooled").output.splitlines()]
    assert names == ["pooled/A-P001/1", "pooled/A-P002/1", "pooled/B-P001/1", "pooled/B-P002/1"]
    (pooled / "sites.json").write_text("{")
    assert "pooled  cannot be used: " in run("studies").output
    (pooled / "sites.json").write_bytes(listed)
    for name in names:
        assert "reproduced" in run("reproduce", name).output
