"""Results of every released version are read by this one; tests/store/releases/record.py records those of a new one."""

import json
import re
import shutil
import sys
from pathlib import Path

import pandas as pd
import pytest

from study_app import __version__
from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.session.replay import replay
from study_app.session.simulated import rehearsal
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.unblinding import unblind
from study_app.store.upgrade import upgrade
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.journal_lines import raw

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

RELEASES = Path(__file__).parent / "releases"
ROOT = Path(__file__).parents[2]
RECORDED = sorted(path.parent for path in RELEASES.glob("*/*/data/sub-P001/ses-01/recordings"))
STUDIES = [
    (path.parent.name, study)
    for path in sorted(RELEASES.glob("*/expected.json"))
    for study in json.loads(path.read_text("utf-8"))
]


@pytest.fixture(params=STUDIES, ids="-".join)
def recorded_study(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, dict[str, tuple[str, int]]]:
    """Return an upgraded copy of a recorded study, and status and number of answers of each participant."""
    version, study = request.param
    expected = json.loads((RELEASES / version / "expected.json").read_text("utf-8"))[study]
    return upgraded_results(RELEASES / version / study, tmp_path / study), expected


def upgraded_results(results: Path, folder: Path) -> Path:
    """Return an upgraded copy of a results folder."""
    shutil.copytree(results, folder)
    upgrade(folder)
    return folder


def test_every_released_version_is_recorded() -> None:
    log = (ROOT / "CHANGELOG.md").read_text("utf-8")
    released = {version.rpartition(".")[0] for version in re.findall(r"^## \[(\d+\.\d+\.\d+)\]", log, re.MULTILINE)}
    assert __version__.rpartition(".")[0] in released
    assert {version for version, _ in STUDIES} == released


def upgraded(study: Path, folder: Path) -> Path:
    """Return an upgraded copy of a study's file."""
    (file,) = upgrade(Path(shutil.copy(study, folder)))
    return file


def written_by(folder: Path) -> list[str]:
    """Return the versions of the program in the receipts of a study."""
    return [json.loads(path.read_text("utf-8"))["versions"]["liquid-study"] for path in folder.rglob("receipt.json")]


def test_a_released_study_is_sound_except_for_unfinished_sessions(
    recorded_study: tuple[Path, dict[str, tuple[str, int]]],
) -> None:
    folder, expected = recorded_study
    verification = verify_study(folder)
    assert verification.errors == ()
    message = "\n".join(map(str, verification.warnings))
    for participant, (status, _) in expected.items():
        assert (f"sub-{participant}/ses-01: is unfinished" in message) == (status == "unfinished")


def test_every_answer_is_exported_and_the_report_is_whole(
    recorded_study: tuple[Path, dict[str, tuple[str, int]]], tmp_path: Path
) -> None:
    folder, expected = recorded_study
    unblind(folder, by="AB", reason="a test")
    exported_files = export(folder, tmp_path / "tables")
    assert json.loads((tmp_path / "tables" / "codebook.json").read_text("utf-8"))["doubts"] == []
    (table,) = [path for path in exported_files if path.name.endswith("responses_data.csv")]
    counts = pd.read_csv(table, dtype=str).groupby("participant").size()
    assert {name: int(counts.get(name, 0)) for name in expected} == {
        name: count for name, (_, count) in expected.items()
    }
    failed: list[str] = []
    assert report(folder, tmp_path / "report", failed=failed.append)[0].name == "report.html"
    assert failed == []
    (version,) = set(written_by(folder))
    methods = (tmp_path / "report" / "methods.txt").read_text("utf-8")
    analysed = "" if version == __version__ else f" with liquid-study {version}", f" with liquid-study {__version__}"
    assert f"The sessions were run{analysed[0]} and analysed{analysed[1]}." in methods


@needs_servo
@pytest.mark.parametrize("session", RECORDED, ids=lambda path: path.parts[-4])
def test_its_recordings_give_the_same_forces(session: Path) -> None:
    """The code of 0.2 recorded "honey" and "light_oil" (`recorded_sessions.stressed`)."""
    replay_result = replay(session)
    differences = replay_result.differences
    if sys.platform != "linux":  # another library rounds exp() differently: forces agree as rounded
        differences = tuple(text for text in differences if "column" in text)
    assert (differences, replay_result.uncompared) == ((), ())
    assert replay_result.recordings == len(list(session.glob("recordings/trial-???.parquet"))) > 0


@needs_servo
def test_an_unfinished_session_is_resumed_to_its_end(tmp_path: Path) -> None:
    folder = StudyFolder(upgraded_results(RELEASES / "0.2" / "demo", tmp_path / "demo"))
    session = folder.session("P002", 1)
    before = session.journal.read_bytes()
    rehearsal.resume_rehearsal(session.path, protocol=upgraded(RELEASES / "0.2" / "demo.toml", tmp_path))
    assert session.journal.read_bytes().startswith(before)
    assert raw(journal.read(session.journal))[-1]["status"] == "completed"
    assert verify_study(folder.path).errors == ()


@needs_servo
def test_a_new_session_of_the_upgraded_study_joins_the_earlier_ones(tmp_path: Path) -> None:
    folder = upgraded_results(RELEASES / "0.1" / "rek2024", tmp_path / "rek2024")
    file = upgraded(RELEASES / "0.1" / "rek2024.toml", tmp_path)
    rehearsal.finish_session(file, "P003", seed=1, device="scripted", results=folder)
    assert verify_study(folder).errors == ()
    export(folder, tmp_path / "tables")
    (path,) = (tmp_path / "tables").glob("*responses_data.csv")
    answers = pd.read_csv(path, dtype=str)
    counts = answers[answers["response"].notna()].groupby("participant").size()
    assert counts["P001"] == counts["P003"] == 62


HELD = Path(__file__).parent / "releases" / "0.1"
ENDED = "data/sub-P001/ses-01"
KILLED = "data/sub-P002/ses-01"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return upgraded_results(HELD / "rek2024", tmp_path_factory.mktemp("earlier") / "study")


def warnings_text(study: Path) -> str:
    findings = verify_study(study)
    assert findings.errors == ()
    assert findings.is_sound
    return "\n".join(map(str, findings.warnings))


def test_a_released_study_verifies_with_a_note_on_its_journal_format(study: Path) -> None:
    warning_text = warnings_text(study)
    assert "data: 2 journals are in format 1, which cannot show whether an earlier line was changed" in warning_text
    assert f"{KILLED}: is unfinished but can be resumed" in warning_text
    changed = StudyFolder(study).session("P001", 1).journal
    content = changed.read_bytes()
    changed.write_bytes(content.replace(b'"value":4', b'"value":5', 1))
    assert "it has been changed" in "\n".join(map(str, verify_study(study).errors))
    changed.write_bytes(content)


@needs_servo
def test_a_released_session_is_resumed_with_a_hash_chain_over_the_earlier_lines(study: Path, tmp_path: Path) -> None:
    folder = StudyFolder(study).session("P002", 1)
    before = folder.journal.read_bytes()
    rehearsal.resume_rehearsal(folder.path, protocol=upgraded(HELD / "rek2024.toml", tmp_path))
    assert folder.journal.read_bytes().startswith(before)
    lines = raw(journal.read(folder.journal))
    assert lines[-1]["status"] == "completed"
    resumed = next(line["n"] for line in lines if line["event"] == "session_resumed")
    assert [line["n"] for line in lines if "previous" in line] == list(range(resumed, len(lines) + 1))
    assert len(StudyFolder(study).fingerprints.read_text("utf-8").splitlines()) == 1
    assert "data: 1 journal is in format 1" in warnings_text(study)
    content = folder.journal.read_bytes()
    folder.journal.write_bytes(content.replace(b'"value":4', b'"value":5', 1))  # in a line of format 1
    damage = journal.scan(folder.journal).damage
    assert damage is not None
    assert "does not match the previous line" in damage
    folder.journal.write_bytes(content)
