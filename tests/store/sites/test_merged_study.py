"""What is done with a merged study: unblinding, exclusions, withdrawals, lists."""

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.store.blinded.blinding import reveals
from study_app.store.exclusions import exclusions
from study_app.store.folders import StudyFolder
from study_app.store.sites.merged import all_exclusions
from study_app.store.sites.merged_rows import participants_of
from study_app.store.sites.unblind_sites import all_opened, reveals_of
from study_app.store.sites.verify_sites import verify_folder
from study_app.store.tables.study_description import check_study
from study_app.store.withdrawals.output_log import write_output
from study_app.store.withdrawals.withdraw import withdraw

pytestmark = pytest.mark.slow


def run(*words: object) -> Result:
    return CliRunner().invoke(commands, [str(word) for word in words])


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
    assert verify_folder(pooled).sound


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
    assert verify_folder(pooled).sound


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
    assert verify_folder(pooled).sound
    assert run("withdraw", pooled, "--participant", "P002", "--by", "AK", "--reason", "asked").exit_code != 0


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
