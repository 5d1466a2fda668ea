import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.gui.sessions.session_facts import sessions
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.recovery import rebuild_session
from study_app.store.tables import study_files
from study_app.store.verification.whole_study import verify_study
from tests.journal_lines import raw
from tests.platforms import needs_links
from tests.store.conftest import Start

pytestmark = pytest.mark.slow


def table(folder: Path) -> list[dict[str, str]]:
    path = StudyFolder(folder).participants("brackish")
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"), newline="")))


def test_every_session_has_its_row_and_its_status(tmp_path: Path, start: Start, finished: Start) -> None:
    finished("P002")
    start("P001", operator="ZQX").finish("withdrawn", "tired")
    start("P001", session=2).close()
    rows = table(tmp_path / "study")
    assert [(row["participant"], row["session"], row["status"]) for row in rows] == [
        ("P001", "1", "withdrawn"),
        ("P001", "2", "unfinished"),
        ("P002", "1", "completed"),
    ]
    assert (rows[2]["trials"], rows[2]["responses"], rows[2]["validity"]) == ("4", "12", "valid")
    assert (rows[2]["device"], rows[2]["language"]) == ("scripted", "en")
    assert rows[1]["session_ended_at"] == "n/a"
    assert not any("ZQX" in row.values() for row in rows), "no initials are in it"


def without_field(name: str) -> Callable[[list[dict[str, Any]]], None]:
    return lambda lines: lines[0].pop(name)


def beginning_late(lines: list[dict[str, Any]]) -> None:
    lines[0]["event"] = "session_resumed"


def about_a_trial_that_never_started(lines: list[dict[str, Any]]) -> None:
    next(line for line in lines if line["event"] == "trial_ended")["trial"] = 99


@pytest.mark.parametrize(
    "damage", [without_field("pilot"), without_field("participant"), beginning_late, about_a_trial_that_never_started]
)
def test_a_journal_without_a_row_is_marked_and_does_not_stop_other_sessions(
    tmp_path: Path, start: Start, damage: Callable[[list[dict[str, Any]]], None], finished: Start
) -> None:
    store = finished("P001")
    lines = raw(journal.read(store.folder.journal))
    damage(lines)
    store.folder.journal.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8", newline="\n")
    start("P002").finish("completed")
    first, second = table(tmp_path / "study")
    assert (first["participant"], first["session"], first["status"]) == ("P001", "1", "damaged")
    assert (second["participant"], second["status"]) == ("P002", "completed")
    assert not verify_study(tmp_path / "study").is_sound
    with pytest.raises(StoreError):
        rebuild_session(store.folder.path)


def into_a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def into_a_link_to_itself(path: Path) -> None:
    path.unlink()
    path.symlink_to(path)


def into_a_link_out_of_the_study(path: Path) -> None:
    path.symlink_to(path.rename(path.parents[4] / "elsewhere"))


LINKS = [pytest.param(turn, marks=needs_links) for turn in (into_a_link_to_itself, into_a_link_out_of_the_study)]


@pytest.mark.parametrize("name", ["journal.jsonl", "checksums.sha256", "receipt.json"])
@pytest.mark.parametrize("turn", [into_a_folder, *LINKS])
def test_an_unreadable_file_neither_hides_nor_stops_a_session(
    tmp_path: Path, start: Start, turn: Callable[[Path], None], name: str, finished: Start
) -> None:
    store = finished("P001")
    turn(store.folder.path / name)
    start("P002").finish("completed")
    there = "damaged" if name == "journal.jsonl" else "completed"
    assert [row["status"] for row in table(tmp_path / "study")] == [there, "completed"]
    assert [session.participant for session in sessions(tmp_path, {})] == ["P001", "P002"]
    findings = verify_study(tmp_path / "study")
    assert findings.sessions == 2
    assert any("P001/ses-01" in str(error) and name in str(error) for error in findings.errors)
    assert not any("P002" in str(error) for error in findings.errors)


class Killed(BaseException):
    """The program ends here."""


@pytest.mark.parametrize("killed", [False, True])
def test_the_participants_table_lists_the_sessions_of_two_concurrent_programs(
    tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch, killed: bool
) -> None:
    """While P001's program is between reading the journals and writing the table, P002's session ends and writes."""
    write, other = study_files.write_file, start("P002")
    store = start("P001")
    study = StudyFolder(tmp_path / "study")

    def late(path: Path, content: bytes, **given: Any) -> None:
        monkeypatch.setattr(study_files, "write_file", write)
        other.finish("withdrawn")
        write(path, content, **given)
        if killed:
            raise Killed

    monkeypatch.setattr(study_files, "write_file", late)
    if killed:
        with pytest.raises(Killed):
            store.finish("completed")
        assert [row["status"] for row in table(study.path)] == ["completed", "unfinished"]
        study_files.write_participants(study, "brackish")
    else:
        store.finish("completed")
    assert [row["status"] for row in table(study.path)] == ["completed", "withdrawn"]


def test_a_journal_is_read_again_only_where_it_changed(
    tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch, finished: Start
) -> None:
    for name in ("P001", "P002", "P003"):
        finished(name)
    study = StudyFolder(tmp_path / "study")
    scan, scanned_paths = journal.scan, []
    monkeypatch.setattr(journal, "scan", lambda file: (scanned_paths.append(file.parts[-3]), scan(file))[1])
    start("P004").finish("withdrawn")
    assert set(scanned_paths) == {"sub-P004"}
    path = study.participants("brackish")
    whole = path.read_bytes()
    for content in (whole[:-40], whole.replace(b"completed", b"damaged", 1), b""):
        path.write_bytes(content)
        study_files.write_participants(study, "brackish")
        assert path.read_bytes() == whole
