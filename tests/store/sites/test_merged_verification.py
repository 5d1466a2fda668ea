"""Every site of a merged study stays provable."""

import json
import shutil
from datetime import datetime, timedelta
from pathlib import Path

import pytest

from study_app.errors import StoreError
from study_app.store.folders import StudyFolder
from study_app.store.sessions.rebuild import rebuild
from study_app.store.sites.merge import merge
from study_app.store.sites.merged import read_merged
from study_app.store.sites.merged_rows import participants_of
from study_app.store.sites.verify_sites import verify_folder
from study_app.store.tables.study_description import check_study
from study_app.store.verification.verify_study import verify
from study_app.store.withdrawals.withdraw import withdraw

pytestmark = pytest.mark.slow


def test_what_is_no_listed_site_does_not_count_and_is_named(labs: dict[str, Path], pooled: Path) -> None:
    shutil.copytree(labs["C"], pooled / "sites/C")
    assert len(participants_of(pooled)) == 4
    assert "sites/C: is not a site that sites.json lists" in "\n".join(map(str, verify_folder(pooled).warnings))


def test_verify_finds_what_was_changed_after_merging(labs: dict[str, Path], pooled: Path) -> None:
    response = next((pooled / "sites/B").glob("data/sub-P001/ses-01/*responses*"))
    response.write_bytes(response.read_bytes() + b"x")
    assert any(str(one).startswith("sites/B/data/sub-P001/ses-01/") for one in verify_folder(pooled).errors)
    (pooled / "sites/A/dataset_description.json").rename(pooled / "sites/A/aside.json")
    found = list(map(str, verify_folder(pooled).errors))
    assert any(one.startswith("sites/A: is not a study folder") for one in found)
    assert any(one.startswith("sites/B/data/sub-P001/ses-01/") for one in found)  # the other sites are checked, too
    (pooled / "sites/A/aside.json").rename(pooled / "sites/A/dataset_description.json")
    shutil.rmtree(pooled / "sites/A/data/sub-P001")
    assert "is missing, but fingerprints.txt lists it" in "\n".join(map(str, verify_folder(pooled).errors))
    shutil.rmtree(pooled / "sites/B")
    assert "sites/B: is missing" in "\n".join(map(str, verify_folder(pooled).errors))
    shutil.copytree(labs["C"], pooled / "sites/B")
    assert "is not the key that site B was merged with" in "\n".join(map(str, verify_folder(pooled).errors))


def test_a_damaged_list_of_sites_is_refused(pooled: Path) -> None:
    for text in ("{", "[]", '{"format": 1}', '{"format": 1, "study": "demo", "protocol_hash": "", "sites": [{}]}'):
        (pooled / "sites.json").write_text(text)
        with pytest.raises(StoreError, match="does not list the sites"):
            read_merged(pooled)
    (pooled / "sites.json").write_text('{"format": 2}')
    with pytest.raises(StoreError, match="format 2"):
        read_merged(pooled)


def test_a_site_elsewhere_is_not_read(pooled: Path, tmp_path: Path) -> None:
    (pooled / "sites/B").rename(tmp_path / "elsewhere")
    (pooled / "sites/B").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(
        StoreError,
        match=r"sites/B leads by a link out of .*pooled, to .*elsewhere: replace the link by the folder itself",
    ):
        read_merged(pooled)


def test_a_site_that_is_a_loop_of_links_is_missing(pooled: Path) -> None:
    shutil.rmtree(pooled / "sites/B")
    (pooled / "sites/B").symlink_to("B")
    assert "sites/B: is missing, but sites.json lists site B" in "\n".join(map(str, verify_folder(pooled).errors))
    with pytest.raises(StoreError, match="is the copy of a site in the merged study"):
        check_study(StudyFolder(pooled / "sites/B"), "demo")


def test_a_list_of_sites_that_was_changed_is_an_error(pooled: Path) -> None:
    path = pooled / "sites.json"
    held = json.loads(path.read_text())
    path.write_text(json.dumps(held | {"study": "another"}))
    found = list(map(str, verify_folder(pooled).errors))
    assert found == [f"sites/{name}: is of study demo, but sites.json lists sites of another" for name in "AB"]
    path.write_text(json.dumps(held | {"format": "x" * 5000}))
    with pytest.raises(StoreError, match=r"has format 'x{199}…, this version reads 1"):
        read_merged(pooled)


def test_an_unfinished_session_that_was_deleted_at_a_site_is_missed(labs: dict[str, Path], results: Path) -> None:
    lab = Path(shutil.copytree(labs["A"], results / "lab"))
    session = lab / "data/sub-P002/ses-01"
    unfinished(session)
    assert verify(lab).sound
    pooled = merge({"A": lab, "B": labs["B"]}, results / "pooled").path
    assert verify_folder(pooled).sound
    shutil.rmtree(pooled / "sites/A/data/sub-P002")
    said = "sites/A: has 1 of the 2 sessions that sites.json lists: restore the others from a copy"
    assert said in list(map(str, verify_folder(pooled).errors))


def test_a_withdrawal_before_merging_excuses_no_session_that_was_deleted_later(
    labs: dict[str, Path], results: Path
) -> None:
    lab = Path(shutil.copytree(labs["A"], results / "lab"))
    before = datetime.now().astimezone() - timedelta(hours=1)
    withdraw(lab, "P001", by="AK", reason="asked", now=before)
    unfinished(lab / "data/sub-P002/ses-01")
    pooled = merge({"A": lab, "B": labs["B"]}, results / "pooled").path
    assert verify_folder(pooled).sound
    shutil.rmtree(pooled / "sites/A/data/sub-P002")
    said = "sites/A: has 0 of the 1 sessions that sites.json lists: restore the others from a copy"
    assert said in list(map(str, verify_folder(pooled).errors))


def test_a_withdrawal_that_reaches_an_older_copy_after_merging_is_no_error(
    labs: dict[str, Path], results: Path, tmp_path: Path
) -> None:
    """The site withdrew the participant, then a copy from before was merged, and then withdrawn from."""
    lab, older = (Path(shutil.copytree(labs["A"], tmp_path / name)) for name in ("lab", "older"))
    withdraw(lab, "P001", by="AK", reason="asked", now=datetime.now().astimezone() - timedelta(hours=1))
    pooled = merge({"A": older, "B": labs["B"]}, results / "pooled").path
    assert withdraw(lab, "P001", by="AK", reason="asked", also=[results]).folders == (pooled / "sites/A",)
    assert verify_folder(pooled).sound


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
