"""Results of the program before hash chains (commit 17da715): P001's session ended, P002's was killed."""

import json
import shutil
from pathlib import Path

import pytest

from study_app.analysis.export.export import export
from study_app.analysis.report.write_report import report
from study_app.session.simulated import rehearsal
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.rebuild import rebuild
from study_app.store.verification.verify_study import verify
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

HELD = Path(__file__).parent / "releases" / "0.1"
ENDED = "data/sub-P001/ses-01"
KILLED = "data/sub-P002/ses-01"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(HELD / "rek2024", tmp_path_factory.mktemp("earlier") / "study"))


def warned(study: Path) -> str:
    findings = verify(study)
    assert findings.errors == ()
    assert findings.sound
    return "\n".join(map(str, findings.warnings))


def test_it_verifies_with_a_note(study: Path) -> None:
    found = warned(study)
    assert "data: 2 journals are of format 1, whose lines cannot show whether an earlier line was changed" in found
    assert f"{KILLED}: is unfinished: resume it, or leave it unfinished" in found
    changed = StudyFolder(study).session("P001", 1).journal
    content = changed.read_bytes()
    changed.write_bytes(content.replace(b'"value":4', b'"value":5', 1))
    assert "it was changed" in "\n".join(map(str, verify(study).errors))
    changed.write_bytes(content)


def test_it_is_exported_and_reported(study: Path, tmp_path: Path) -> None:
    written = export(study, tmp_path / "tables")
    (rows,) = [path.read_text().splitlines() for path in written if path.name.endswith("responses_data.csv")]
    assert sum(",P001," in row for row in rows) == 62
    codebook = json.loads((tmp_path / "tables" / "codebook.json").read_text())
    assert codebook["doubts"] == []
    failed: list[str] = []
    assert report(study, tmp_path / "report", failed=failed.append)[0].name == "report.html"
    assert failed == []


@needs_servo
def test_it_is_resumed_with_a_chain_that_covers_the_lines_before(study: Path) -> None:
    folder = StudyFolder(study).session("P002", 1)
    before = folder.journal.read_bytes()
    rehearsal.resume(folder.path, protocol=HELD / "rek2024.toml")
    assert folder.journal.read_bytes().startswith(before)
    lines = journal.read(folder.journal)
    assert lines[-1]["status"] == "completed"
    resumed = next(line["n"] for line in lines if line["event"] == "session_resumed")
    assert [line["n"] for line in lines if "previous" in line] == list(range(resumed, len(lines) + 1))
    assert len(StudyFolder(study).fingerprints.read_text().splitlines()) == 1
    assert "data: 1 journal is of format 1" in warned(study)
    content = folder.journal.read_bytes()
    folder.journal.write_bytes(content.replace(b'"value":4', b'"value":5', 1))  # in a line of format 1
    damage = journal.scan(folder.journal).damage
    assert damage is not None
    assert "was written after another line" in damage
    folder.journal.write_bytes(content)


def test_rebuild_mends_a_table_and_notes_the_columns_that_have_come_since(study: Path) -> None:
    folder = StudyFolder(study).session("P001", 1)
    table = folder.table("rek2024", "responses")
    before = table.read_bytes()
    table.write_bytes(before.replace(b",4,", b",5,"))
    trials = folder.table("rek2024", "trials")
    assert rebuild(folder.path).rewritten == (table, trials, folder.checksums, folder.rebuilt)
    assert table.read_bytes() == before
    assert folder.rebuilt.read_text().endswith(f"rebuild: other checksums were listed for {trials.name}\n")
    assert "rebuilt.txt" in warned(study)
