"""Files that have changed since recording: an analysis goes on, and says so wherever it speaks."""

import csv
import hashlib
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.analysis.data.study_tables import load_study
from study_app.cli import commands
from study_app.errors import AnalysisError
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.sessions.recovery import rebuild_session
from tests.analysis.conftest import SAMPLE


@pytest.fixture
def copy(tmp_path: Path) -> StudyFolder:
    """Three sessions of the sample."""
    folder = Path(shutil.copytree(SAMPLE.path, tmp_path / "copy"))
    for session in StudyFolder(folder).sessions()[3:]:
        shutil.rmtree(session.path.parent)
    return StudyFolder(folder)


def doubts_of(folder: StudyFolder) -> list[str]:
    return [str(doubt) for doubt in load_study(folder.path).doubts]


def change(path: Path, old: bytes, new: bytes) -> None:
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))


def cut_last_line(path: Path) -> None:
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))


def another_answer(session: SessionFolder) -> Path:
    """Change the first answer of the table by hand."""
    path = session.table("rek2024", "responses")
    head, first, *rest = path.read_text(encoding="utf-8").split("\n")
    cells = first.split(",")
    place = head.split(",").index("response")
    cells[place] = "1" if cells[place] != "1" else "2"
    path.write_text("\n".join((head, ",".join(cells), *rest)), encoding="utf-8", newline="\n")
    return path


@pytest.mark.slow
def test_a_table_changed_by_hand_is_named_with_the_command_that_repairs_it(copy: StudyFolder) -> None:
    session = copy.sessions()[1]
    path = another_answer(session)
    (line,) = doubts_of(copy)
    assert line.startswith(
        f"{path} differs from the journal, starting at line 2; the rebuild command recreates it: run liquid-study"
    )
    rebuild_session(session.path)
    assert doubts_of(copy) == []


def test_a_changed_journal_is_not_used_for_rebuilding(copy: StudyFolder) -> None:
    session = copy.sessions()[0]
    change(session.journal, b'"operator":"', b'"operator":"X')
    (line,) = doubts_of(copy)
    assert line.startswith(f"{session.journal} line ")
    assert "restore the journal from a backup" in line
    assert "rebuild" not in line


@pytest.mark.parametrize(
    ("harm", "says"),
    [
        (lambda session: session.journal.unlink(), "is missing, but the receipt, tables"),
        (lambda session: change(session.journal, b"\n", b"garbage\n"), "line 1 is damaged"),
        (lambda session: change(session.journal, b'"n":2,', b'"n":3,'), "line 2 has n 3; lines are missing"),
        (lambda session: session.journal.write_bytes(b""), "does not contain a complete line, but the receipt"),
        (lambda session: cut_last_line(session.journal), "but the journal does not record the end"),
        (lambda session: change(session.receipt, b'"version"', b'"version" '), "has changed since the session ended"),
        (lambda session: session.checksums.unlink(), "is missing: the program may have been killed"),
    ],
)
def test_every_damage_behind_the_numbers_is_a_line_of_its_file(
    copy: StudyFolder, harm: Callable[[SessionFolder], object], says: str
) -> None:
    harm(copy.sessions()[2])
    lines = doubts_of(copy)
    assert says in "\n".join(lines)
    assert all("liquid-study verify" in line for line in lines)


@pytest.mark.parametrize("content", [None, b"", b"{}"])
def test_a_session_with_a_lost_receipt_is_not_included(
    copy: StudyFolder, tmp_path: Path, content: bytes | None
) -> None:
    lost = copy.sessions()[0]
    lost.receipt.unlink()
    if content is not None:
        lost.receipt.write_bytes(content)
    study = load_study(copy.path)
    assert (study.n, study.left_out, study.damaged_sessions) == (2, 0, 1)
    assert list(study.participants["status"]) == ["completed", "completed", "damaged"]
    to = tmp_path / "out"
    finished = CliRunner().invoke(commands, ["report", str(copy.path), "--to", str(to)])
    what = "is missing or damaged, so the session is not included in the analysis"
    assert (finished.exit_code, finished.stderr) == (0, f"warning: {lost.receipt} {what}: restore it from a backup\n")
    summary = json.loads((to / "report.json").read_text(encoding="utf-8"))
    assert summary["doubts"] == [{"file": lost.receipt.relative_to(copy.path).as_posix(), "what": what}]
    assert "Three sessions: 2 completed and 1 damaged." in (to / "report.html").read_text(encoding="utf-8")
    assert "file is used" not in (to / "liquids.txt").read_text(encoding="utf-8")
    exclude = ["exclude", str(copy.path), "--participant", lost.participant, "--by", "AK", "--reason", "lost"]
    assert CliRunner().invoke(commands, exclude).exit_code == 0
    excluded = load_study(copy.path)
    assert (len(excluded.excluded_sessions), excluded.damaged_sessions) == (1, 0)


def test_a_table_without_one_of_its_columns_is_refused(copy: StudyFolder) -> None:
    path = copy.sessions()[0].table("rek2024", "trials")
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    place = rows[0].index("loop_delay_ticks")
    path.write_text(
        "".join(f"{','.join(row[:place] + row[place + 1 :])}\n" for row in rows), encoding="utf-8", newline="\n"
    )
    with pytest.raises(AnalysisError, match=r"trials_data\.csv does not begin with the columns of this table"):
        load_study(copy.path)


@pytest.mark.slow
@pytest.mark.parametrize("command", ["export", "plot"])
def test_commands_continue_with_a_warning_in_the_terminal_and_beside_the_output(
    copy: StudyFolder, tmp_path: Path, command: str
) -> None:
    path = another_answer(copy.sessions()[0])
    finished = CliRunner().invoke(commands, [command, str(copy.path), "--to", str(tmp_path / "out")])
    assert finished.exit_code == 0
    (line,) = finished.stderr.splitlines()
    assert line.startswith(f"warning: {path} differs from the journal")
    name = path.relative_to(copy.path).as_posix()
    if command == "export":
        codebook = json.loads((tmp_path / "out" / "codebook.json").read_text(encoding="utf-8"))
        what = "differs from the journal, starting at line 2; the rebuild command recreates it"
        assert codebook["doubts"] == [{"file": name, "what": what}]
    else:
        caption = (tmp_path / "out" / "liquids.txt").read_text(encoding="utf-8")
        assert f"1 file is used although it has changed since recording: {name}." in caption


@pytest.mark.slow
def test_one_file_that_was_changed_brings_all_of_its_session_under_suspicion(copy: StudyFolder) -> None:
    """The other tables of the session are then also compared with the journal."""
    session = copy.sessions()[0]
    table = another_answer(session)
    name = table.name
    checksums_text = session.checksums.read_text(encoding="utf-8")
    forged = hashlib.sha256(table.read_bytes()).hexdigest()
    session.checksums.write_text(
        re.sub(rf"[0-9a-f]{{64}}  {name}", f"{forged}  {name}", checksums_text), encoding="utf-8", newline="\n"
    )
    trials = session.table("rek2024", "trials")
    change(trials, b",complete,", b",timeout,")
    assert {line.split()[0] for line in doubts_of(copy)} == {str(trials), str(table)}
