"""A journal that was lost or cut is found by whatever else is left."""

import base64
import csv
import json
import multiprocessing
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded import blinding
from study_app.store.blinded.unblinding import unblind
from study_app.store.exclusions import exclude
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal_events
from study_app.store.sessions.folder_lock import never_begun
from study_app.store.sessions.recovery import rebuild
from study_app.store.tables.columns import TABLES
from study_app.store.tables.csv_files import csv_bytes, read_table
from study_app.store.tables.study_files import write_participants
from study_app.store.verification.verify_study import verify
from tests.faults.support import short
from tests.platforms import needs_fork
from tests.store.conftest import Attend, Start
from tests.store.earlier import TRIALS_HEADER
from tests.store.forging import forge
from tests.store.verification.findings import (
    PARTICIPANTS,
    RESPONSES,
    SESSION,
    TRIALS,
    append,
    of_receipt,
    only_the_journals_lines,
    replace,
    told,
    warned,
    without_line,
)

pytestmark = pytest.mark.slow


def test_a_table_of_an_earlier_version_is_compared_in_the_columns_it_has(study: Path) -> None:
    unblind(study, "AB", "done")
    (path,) = (study / SESSION).glob("*trials_data.csv")
    held = [column for column in TABLES["trials"] if column.name in TRIALS_HEADER.split(",")]
    earlier = csv_bytes(held, read_table(path.read_bytes(), held))
    assert earlier.startswith(TRIALS_HEADER.encode() + b"\n")
    path.write_bytes(earlier)
    assert [line for line in told(verify(study)).splitlines() if "its checksum differs" not in line] == []
    path.write_bytes(earlier.replace(b"complete", b"timeout", 1))
    assert "differs from the journal, from line" in told(verify(study))


def test_what_was_written_is_found_sound_and_not_changed_by_looking(study: Path) -> None:
    before = {path: (path.stat().st_mtime_ns, path.is_file() and path.read_bytes()) for path in study.rglob("*")}
    findings = verify(study)
    assert (findings.errors, findings.warnings) == ((), ())
    assert (findings.sound, findings.sessions) == (True, 2)
    after = {path: (path.stat().st_mtime_ns, path.is_file() and path.read_bytes()) for path in study.rglob("*")}
    assert after == before


RECORDING = f"{SESSION}/recordings/trial-001.parquet"
FRAMES = f"{SESSION}/recordings/trial-002_attempt-2_frames.parquet"


@pytest.mark.variants(18)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "act", "sentence"),
    [
        (RESPONSES, replace(",4,", ",5,"), "differs from the journal, from line 2 on; rebuild renews it"),
        (RESPONSES, append(b"x\n"), "differs from the journal, from line 14 on"),
        (RESPONSES, append(b"x\n"), "row 14 has 1 cells, not 21"),
        (RESPONSES, replace(",4,", ",9,"), "row 2, response: '9' is not a whole number from 1 to 7 or n/a"),
        (RESPONSES, replace("number", "place"), "columns are missing: number"),
        (RESPONSES, replace(",item,number,", ",number,item,"), "columns are in another order"),
        (RESPONSES, append(b"\xff\n"), "is not CSV in UTF-8"),
        (RESPONSES, Path.unlink, "is missing or cannot be read; rebuild makes it again"),
        (TRIALS, replace("true", "True"), "'True' is not true or false or n/a"),
        (TRIALS, replace(",999.98,", ",-9.0,"), "row 2, tick_rate_hz: '-9.0' is not a number of at least 0 or n/a"),
        (TRIALS, replace("complete", "over"), "outcome: 'over' is not one of complete, timeout, interrupted or n/a"),
        (PARTICIPANTS, replace("withdrawn", "completed"), "differs from the journal, from line 3 on"),
        (
            f"{SESSION}/journal.jsonl",
            replace('"outcome":"complete"', '"outcome":"timeout"'),
            "line 4 was written after another line than the one before it, which was changed",
        ),
        (
            f"{SESSION}/journal.jsonl",
            lambda path: forge(path, lambda lines: lines[2].update(outcome="timeout")),
            "checksum differs",
        ),
        (
            f"{SESSION}/journal.jsonl",
            lambda path: forge(path, lambda lines: lines.append(lines[-1] | {"event": "resumed", "by": "operator"})),
            "lines follow the session's end",
        ),
        (f"{SESSION}/journal.jsonl", without_line(3), "line 3: its n is 4: lines are missing or duplicated"),
        (f"{SESSION}/journal.jsonl", replace('"event":"trial_started"', '"event":'), "line 2: damaged"),
        (f"{SESSION}/journal.jsonl", replace('"attempt":1', '"attempts":1'), "line 2 (trial_started) lacks attempt"),
        (
            f"{SESSION}/journal.jsonl",
            lambda path: forge(path, lambda lines: lines[0].update(seed=12)),
            "seed: differ from the journal",
        ),
        (
            f"{SESSION}/journal.jsonl",
            lambda path: forge(path, lambda lines: lines[0].update(participant="P003")),
            "is of participant 'P003'",
        ),
        (f"{SESSION}/receipt.json", of_receipt(seed=12), "seed: differ from the journal"),
        (f"{SESSION}/receipt.json", of_receipt(screens=...), "lacks screens"),
        (f"{SESSION}/receipt.json", of_receipt(status="aborted"), "its status is 'aborted', the journal's 'completed'"),
        (f"{SESSION}/receipt.json", of_receipt(key_hash="0" * 64), "contains the hash of another key"),
        (f"{SESSION}/receipt.json", append(b"}"), "is not a receipt"),
        (f"{SESSION}/receipt.json", Path.unlink, "receipt.json: cannot be read"),
        (f"{SESSION}/checksums.sha256", Path.unlink, "checksums.sha256: is missing: was the program killed at the"),
        (f"{SESSION}/checksums.sha256", append(b"\xff"), "is not a list of checksums"),
        (f"{SESSION}/mood.txt", lambda path: path.write_text("fine"), "mood.txt: was added after the session ended"),
        (RECORDING, Path.unlink, "is missing, but the journal mentions it (trial 1, attempt 1)"),
        (RECORDING, append(b"x"), "has changed since it was recorded (trial 1, attempt 1)"),
        (RECORDING, lambda path: path.write_bytes(path.read_bytes()[:-9]), "is damaged"),
        (
            FRAMES,
            lambda path: path.write_bytes((path.parent / "trial-001.parquet").read_bytes()),
            "holds kind 'samples'",
        ),
        ("blinding/key.sealed", Path.unlink, "key.sealed: cannot be read"),
        ("blinding/key.sealed", append(b"eA=="), "contains the hash of another key"),
        ("blinding/key.sealed", lambda path: path.write_bytes(b"***"), "is no longer a sealed key"),
        (
            "blinding/reveals.jsonl",
            lambda path: path.write_text('{"at":"now","by":"AB"}\n'),
            "line 1 is not a reveal: it was changed",
        ),
        ("dataset_description.json", replace("Brackish", "Brine"), "differs from what this version writes"),
        (
            "exclusions.csv",
            lambda path: path.write_text("participant\nP007\n"),
            "its columns must be participant, session",
        ),
    ],
)
def test_what_is_not_as_it_was_is_found_and_named(
    study: Path, name: str, act: Callable[[Path], Any], sentence: str
) -> None:
    act(study / name)
    findings = verify(study)
    assert not findings.sound
    assert sentence in told(findings)
    places = {error.place for error in findings.errors}
    assert name in places or f"{SESSION}/receipt.json" in places
    assert str(study) not in told(findings)


def test_exclusions_are_checked_against_the_sessions(study: Path) -> None:
    exclude(study, "P007", 1, trial=2, by="AB", reason="the phone rang")
    exclude(study, "P008", 1, by="RT rule", reason="withdrew")
    assert verify(study).sound
    replace("P008", "P009")(study / "exclusions.csv")
    replace("P007,1,2", "P007,1,77")(study / "exclusions.csv")
    assert told(verify(study)).splitlines() == [
        "exclusions.csv: there is no participant P007, session 1, trial 77",
        "exclusions.csv: there is no participant P009, session 1",
    ]
    replace(",1,77,", ",1,x,")(study / "exclusions.csv")
    assert told(verify(study)).startswith("exclusions.csv: row 2: 'P007,1,x,AB,the phone rang")


def test_a_condition_that_is_told_is_found_but_not_repeated(study: Path, tmp_path: Path, start: Start) -> None:
    store = start("P009")
    store.append(journal_events.Note(kind="note", text="this must be mildew"))
    store.append(journal_events.Note(kind="note", text="density 1013.7, I think"))
    store.append(journal_events.Note(kind="note", text="137 seconds"))
    store.finish("completed")
    found = [line for line in warned(verify(study)).splitlines() if "reveals a condition" in line]
    place = "data/sub-P009/ses-01/journal.jsonl"
    assert [line.split(", line ")[1][0] for line in found] == ["2", "3"]
    assert all(place in line for line in found)
    assert "mildew" not in warned(verify(study))
    blinding.reveal(study, "AB", "done")
    assert "tells a condition" not in warned(verify(study))


def test_a_receipt_without_a_protocol_makes_no_word_of_the_study_a_telltale(study: Path) -> None:
    """A liquid may be called as a column or a page is; that stands in every receipt's protocol."""
    key = study / "blinding" / "key.sealed"
    content = json.loads(base64.b64decode(key.read_bytes()))
    content["tables"]["liquids"]["Settings"] = content["tables"]["liquids"].pop("mildew")
    key.write_bytes(base64.encodebytes(json.dumps(content).encode()))
    assert "tells a condition" not in warned(verify(study))
    for participant in ("P007", "P008"):
        of_receipt(protocol=...)(study / "data" / f"sub-{participant}" / "ses-01" / "receipt.json")
        assert "lacks protocol" in told(verify(study))
        assert "tells a condition" not in warned(verify(study))


def test_nothing_of_the_key_is_shown(study: Path) -> None:
    """Whatever is broken, no sentence tells a condition."""
    content = json.loads(base64.b64decode((study / "blinding" / "key.sealed").read_bytes()))
    for path in sorted(study.rglob("*")):
        if path.is_file() and path.name != "key.sealed":
            path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    try:
        findings = verify(study)
    except StoreError as error:
        shown = str(error)
    else:
        shown = told(findings) + warned(findings)
    assert not [word for word in content["tables"]["conditions"] if word in shown]


def test_a_description_of_an_earlier_version_is_a_warning_and_a_column_it_never_had_an_error(study: Path) -> None:
    path = study / "dataset_description.json"
    content = json.loads(path.read_bytes())
    variables = [it for it in content["variableMeasured"] if it["name"] != "withheld_share"]
    variables[0] = variables[0] | {"description": "In other words.", "valuePattern": "(.*)"}
    path.write_text(json.dumps(content | {"variableMeasured": variables}))
    findings = verify(study)
    assert not any(error.place == path.name for error in findings.errors)
    assert "describes the columns as an earlier version of the program did" in warned(findings)
    at = next(index for index, it in enumerate(variables) if "minValue" in it and "unitText" in it)
    for change in ({"minValue": -5}, {"maxValue": 7}, {"unitText": "mile"}, {"@type": "y"}, None):
        changed = variables[1:] if change is None else [*variables[:at], variables[at] | change, *variables[at + 1 :]]
        path.write_text(json.dumps(content | {"variableMeasured": changed}))
        assert "differs from what this version writes" in told(verify(study))


def test_a_column_that_earlier_versions_did_not_write_cannot_be_taken_from_a_table_of_today(study: Path) -> None:
    """The table reads as one of an earlier version; its checksum says that it was changed."""
    (path,) = (study / "data" / "sub-P007" / "ses-01").glob("*trials_data.csv")
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    at = rows[0].index("loop_delay_changes")
    path.write_text("".join(f"{','.join([*row[:at], *row[at + 1 :]])}\n" for row in rows), encoding="utf-8")
    assert f"{path.name}: has changed since the session ended" in told(verify(study))


@pytest.mark.parametrize(
    ("damage", "sentence"),
    [
        (Path.unlink, "journal.jsonl: is missing, but receipt"),
        (only_the_journals_lines(0), "journal.jsonl: has no complete line, but receipt"),
        (lambda path: path.write_bytes(bytes(path.stat().st_size)), "journal.jsonl: has no complete line, but"),
    ],
)
@pytest.mark.parametrize("left", ["receipt.json", "checksums.sha256", "*_data.csv", "recordings/*"])
def test_a_lost_journal_is_an_error_by_whatever_else_is_left(
    study: Path, damage: Callable[[Path], Any], sentence: str, left: str
) -> None:
    folder = study / SESSION
    damage(folder / "journal.jsonl")
    kept = {folder / "journal.jsonl", folder / "receipt.json", *folder.glob(left)}
    for path in folder.rglob("*"):
        if path.is_file() and path not in kept:
            path.unlink()
    if left != "receipt.json":
        of_receipt(status="unfinished")(folder / "receipt.json")
    assert sentence in told(verify(study))
    assert not never_begun(folder)
    write_participants(StudyFolder(study), "brackish")
    rows = list(csv.DictReader((study / PARTICIPANTS).read_text(encoding="utf-8").splitlines()))
    assert [(row["participant"], row["study"], row["status"]) for row in rows] == [
        ("P007", "brackish", "damaged"),
        ("P008", "brackish", "withdrawn"),
    ]


def test_a_session_killed_between_its_last_line_and_its_checksums_is_finished_by_rebuild(
    study: Path, start: Start, attend: Attend
) -> None:
    store = start("P009")
    attend(store)
    store.append(journal_events.SessionEnded(status="completed", reason=""))
    store.close()
    found = told(verify(study))
    for name in ("receipt.json: its status is 'unfinished'", "checksums.sha256: is missing"):
        (line,) = (line for line in found.splitlines() if f"sub-P009/ses-01/{name}" in line)
        assert "rebuild" in line
    rebuild(store.folder.path)
    assert told(verify(study)) == ""


ENOUGH = 1  # looks


def rehearse_short(study: Path, protocol: Path, _enough: Any) -> None:
    rehearse(protocol, participants=1, seed=7, results=study)


def look_beside(study: Path, *programs: tuple[Callable[..., None], tuple[Any, ...]]) -> tuple[int, int, list[str]]:
    """Verify until the programs have ended; return how often, how often a session ran, and every error."""
    forking = multiprocessing.get_context("fork")
    enough = forking.Event()
    started = [forking.Process(target=target, args=(study, *given, enough)) for target, given in programs]
    for program in started:
        program.start()
    looks = running = 0
    errors: list[str] = []
    while any(program.is_alive() for program in started):
        if (study / "dataset_description.json").exists():
            findings = verify(study)
            looks += 1
            running += findings.running > 0
            if running >= ENOUGH:
                enough.set()
            errors += map(str, findings.errors)
    assert [program.exitcode for program in started] == [0] * len(started)
    return looks, running, errors


@needs_fork
def test_a_rehearsal_with_recordings_beside_it_is_never_called_unsound(tmp_path: Path) -> None:
    _, running, errors = look_beside(tmp_path / "study", (rehearse_short, (short.write(tmp_path),)))
    assert errors == []
    assert running > 0
    assert verify(tmp_path / "study").sound
