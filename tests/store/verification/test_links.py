"""Files of a results folder that lead elsewhere, and names in them that are paths."""

import hashlib
import json
import os
import signal
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import AnalysisError, StoreError, StudyError
from study_app.store import receipt
from study_app.store.blinded import blinding
from study_app.store.exclusions import exclude
from study_app.store.files.folders import StudyFolder
from study_app.store.files.output_files import write_files
from study_app.store.integrity.checksums import write_checksums
from study_app.store.journals import journal
from study_app.store.sessions.open_session import Place, SessionStore
from study_app.store.sessions.recovery import rebuild_session
from study_app.store.unblinding import unblind
from study_app.store.verification.verify_session import session_discrepancies
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import withdraw
from tests.faults.support.killer import forked
from tests.platforms import needs_fork, needs_links
from tests.store.conftest import Start


@pytest.fixture
def finished_session(finished: Start) -> SessionStore:
    store = finished()
    return store


def key_beside(path: Path) -> object:
    if path.name == "key.sealed":
        return blinding.read_key(path.parents[1])
    return journal.read(path) if path.suffix == ".jsonl" else receipt.read(path)


def test_a_study_that_is_called_by_a_path_is_not_exported(tmp_path: Path, finished_session: SessionStore) -> None:
    for path in (finished_session.folder.receipt, finished_session.place.study_folder.description):
        content = json.loads(path.read_bytes())
        (content["protocol"]["study"] if "protocol" in content else content)["name"] = "../../../../ESCAPED"
        path.write_text(json.dumps(content), encoding="utf-8", newline="\n")
    before = {path for path in tmp_path.rglob("*") if "out" not in path.parts}
    result = CliRunner().invoke(
        commands, ["export", str(tmp_path / "study"), "--to", str(tmp_path / "a" / "b" / "out")]
    )
    assert isinstance(result.exception, AnalysisError | StoreError)
    assert {path for path in tmp_path.rglob("*") if "out" not in path.parts} == before


@pytest.mark.parametrize("name", ["../escaped.csv", "within/../../escaped.csv", "/escaped.csv", "linked/escaped.csv"])
@needs_links
def test_files_are_written_only_into_the_requested_folder(tmp_path: Path, name: str) -> None:
    to = tmp_path / "out"
    to.mkdir()
    (to / "linked").symlink_to(tmp_path)
    with pytest.raises(AnalysisError, match=r"would be written outside .*out: nothing was written"):
        write_files(to, {"fine.csv": b"", name: b"x"})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out"]
    assert [path.name for path in to.iterdir()] == ["linked"]


@needs_links
def test_a_study_is_used_through_a_link_to_its_folder(tmp_path: Path, finished_session: SessionStore) -> None:
    study = tmp_path / "linked"
    study.symlink_to(tmp_path / "study")
    finished_session.folder.checksums.unlink()
    rebuild_session(study / "data/sub-P007/ses-01")
    assert verify_study(study).is_sound
    exclude(study, "P007", 1, by="AB", reason="coughed")
    assert unblind(study, "AB", "to analyse").left == ()
    assert withdraw(study, "P007", by="AB", reason="asked").left == ()


@pytest.mark.nightly
@pytest.mark.slow
@needs_fork
@pytest.mark.parametrize(
    "name",
    [
        "dataset_description.json",
        "blinding/reveals.jsonl",
        "blinding/key.sealed",
        "fingerprints.txt",
        "exclusions.csv",
        "data/study-brackish_description-participants_data.csv",
        "data/sub-P007/ses-01/checksums.sha256",
        "data/sub-P007/ses-01/rebuilt.txt",
        "data/sub-P007/ses-01/subject-P007_session-01_task-brackish_description-trials_data.csv",
    ],
)
def test_an_endless_device_is_never_read(tmp_path: Path, finished_session: SessionStore, name: str) -> None:
    """Neither `verify` nor the search for doubts reads it; both report the error."""
    path = tmp_path / "study" / name
    path.unlink(missing_ok=True)
    path.symlink_to("/dev/zero")
    output_file = tmp_path / "said.txt"

    def look() -> None:
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
        resource.setrlimit(resource.RLIMIT_DATA, (2**32, 2**32))
        study = StudyFolder(tmp_path / "study")
        try:
            discrepancies = [
                str(discrepancy)
                for of in study.sessions()
                for discrepancy in session_discrepancies(Place(study, of, "brackish"))
            ]
            output_file.write_text(
                "\n".join([*discrepancies, *map(str, verify_study(study.path).errors)]), encoding="utf-8", newline="\n"
            )
        except StudyError as error:
            output_file.write_text(str(error), encoding="utf-8", newline="\n")

    assert forked(look) == 0
    assert path.name in output_file.read_text("utf-8")


@needs_fork
@pytest.mark.parametrize("name", [".psychds-ignore", "data/sub-P007/ses-01/{}trials_data.csv"])
def test_a_pipe_is_never_waited_for(tmp_path: Path, finished_session: SessionStore, name: str) -> None:
    study = tmp_path / "study"
    path = study / name.format("subject-P007_session-01_task-brackish_description-")
    path.unlink()
    os.mkfifo(path)

    def act() -> None:
        signal.alarm(20)
        try:
            left_files = unblind(study, "AB", "to analyse").left
            withdraw(study, "P007", by="AB", reason="asked")
        except StoreError as error:
            left_files = (str(error),)
        assert path.name in "\n".join(left_files)

    assert forked(act) == 0
    assert not (study / "withdrawals.jsonl").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="file names are texts elsewhere")
def test_a_file_name_that_is_not_utf_8_is_reported_and_searched(tmp_path: Path, finished_session: SessionStore) -> None:
    study, name = tmp_path / "study", os.fsdecode(b"P007\xff.csv")
    for folder in (study, finished_session.folder.path):
        (folder / name).write_bytes(b"")
    assert name in [Path(error.place).name for error in verify_study(study).errors]
    finished_session.folder.checksums.unlink()
    rebuild_session(finished_session.folder.path)
    assert name not in [Path(error.place).name for error in verify_study(study).errors]
    left = withdraw(study, "P007", by="AB", reason="asked").left
    assert left == (f"{study / name} still names P007",)


def test_only_the_unreadable_of_the_listed_files_is_an_error(
    finished_session: SessionStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, study = finished_session.folder, finished_session.place.study_folder.path
    notes, photo = folder.path / "notes.txt", folder.path / "photo.jpg"
    notes.write_bytes(b"calm")
    photo.write_bytes(b"smile")
    write_checksums(folder)
    photo.unlink()

    def refused(path: Path) -> str:
        if path == notes:
            raise StoreError(f"{path} cannot be read")
        return hashlib.sha256(path.read_bytes()).hexdigest()

    monkeypatch.setattr("study_app.store.integrity.checksums.sha256", refused)
    errors = [(Path(error.place).name, error.message) for error in verify_study(study).errors]
    assert [error for error in errors if error[0] != "ses-01"] == [
        ("notes.txt", "cannot be read"),
        ("photo.jpg", "is missing"),
    ]
