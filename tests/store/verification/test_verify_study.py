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
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded import blinding
from study_app.store.blinded.unblinding import unblind
from study_app.store.exclusions import exclude
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.sessions.rebuild import rebuild
from study_app.store.sessions.unstarted_sessions import never_begun
from study_app.store.tables.columns import TABLES
from study_app.store.tables.csv_files import csv_bytes, read_table
from study_app.store.tables.participants import write_participants
from study_app.store.verification.verify_study import verify
from tests.faults.support import short
from tests.platforms import needs_fork
from tests.store.conftest import SOURCE, Attend, Start, choose, study_tables, summary_of_trial
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


def test_what_was_written_is_found_sound(study: Path) -> None:
    findings = verify(study)
    assert (findings.errors, findings.warnings, findings.psychds.errors) == ((), (), ())
    assert findings.sound
    assert findings.sessions == 2


def test_nothing_is_changed_by_looking(study: Path) -> None:
    before = {path: (path.stat().st_mtime_ns, path.is_file() and path.read_bytes()) for path in study.rglob("*")}
    verify(study)
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


def test_a_psych_ds_rule_that_is_not_kept_is_an_error_of_its_own(study: Path) -> None:
    (study / "data" / "extra_data.csv").write_text("mood\nfine\n")
    findings = verify(study)
    assert findings.errors == ()
    assert {issue.code for issue in findings.psychds.errors} == {
        "FILENAME_KEYWORD_FORMATTING_ERROR",
        "CSV_COLUMN_MISSING_FROM_METADATA",
    }
    assert not findings.sound


def test_lines_after_the_end_are_found(study: Path) -> None:
    path = study / SESSION / "journal.jsonl"
    last = journal.read(path)[-1]
    forge(path, lambda lines: lines.append(last | {"event": "resumed", "by": "operator"}))
    assert "lines follow the session's end" in told(verify(study))


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
    store.append("note", kind="note", text="this must be mildew")
    store.append("note", kind="note", text="density 1013.7, I think")
    store.append("note", kind="note", text="137 seconds")
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


def test_a_key_of_another_study_under_the_reveals_is_found(study: Path) -> None:
    blinding.reveal(study, "AB", "done")
    replace(blinding.reveals(study)[0]["key_hash"], "0" * 64)(study / "blinding" / "reveals.jsonl")
    assert "reveals.jsonl: reveal 1 was of another key" in told(verify(study))


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


def test_a_folder_that_is_no_study_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="is not a study folder"):
        verify(tmp_path)


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


def test_damaged_lines_at_the_end_are_an_error(study: Path, start: Start) -> None:
    with start("P009") as store:
        for text in ("one", "two"):
            store.append("note", kind="note", text=text)
    lines = store.folder.journal.read_bytes().split(b"\n")
    store.folder.journal.write_bytes(b"\n".join([lines[0], *(b"#" + line[1:] for line in lines[1:3]), b""]))
    assert "sub-P009/ses-01/journal.jsonl: line 2: damaged; restore it from a copy" in told(verify(study))


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


@pytest.mark.parametrize(
    ("left", "sentence"),
    [
        ("checksums.sha256", "checksums.sha256: was written after the session ended, but the journal has no end"),
        ("*responses_data.csv", "responses_data.csv: has 12 rows, and the journal gives 0: restore the journal"),
        ("*trials_data.csv", "trials_data.csv: has 6 rows, and the journal gives 2: restore the journal"),
        ("recordings/trial-004.parquet", "trial-004.parquet: is of a trial that the journal never started"),
    ],
)
def test_a_journal_cut_in_half_says_less_than_what_is_left(study: Path, left: str, sentence: str) -> None:
    folder = study / SESSION
    only_the_journals_lines(5)(folder / "journal.jsonl")
    of_receipt(status="unfinished", reason="", ended_at=None)(folder / "receipt.json")
    kept = {folder / "journal.jsonl", folder / "receipt.json", *folder.glob(left)}
    for path in folder.rglob("*"):
        if path.is_file() and path not in kept:
            path.unlink()
    assert sentence in told(verify(study))


def test_a_receipt_of_a_session_resumed_more_often_than_the_journal_tells_is_an_error(study: Path) -> None:
    of_receipt(resumed=[{"at": "now"}])(study / SESSION / "receipt.json")
    assert "says that the session was resumed more often than the journal does" in told(verify(study))


def test_a_session_killed_between_its_last_line_and_its_checksums_is_finished_by_rebuild(
    study: Path, start: Start, attend: Attend
) -> None:
    store = start("P009")
    attend(store)
    store.append("session_ended", status="completed", reason="")
    store.close()
    found = told(verify(study))
    for name in ("receipt.json: its status is 'unfinished'", "checksums.sha256: is missing"):
        (line,) = (line for line in found.splitlines() if f"sub-P009/ses-01/{name}" in line)
        assert "rebuild" in line
    rebuild(store.folder.path)
    assert told(verify(study)) == ""


ENOUGH = 1  # looks
MOST = 100  # sessions of a program, which ends after as many looks as are enough


def hold_sessions(study: Path, first: int, enough: Any) -> None:
    """Begin, hold and end short sessions, one after the other, until it was looked at them often enough."""
    protocol = Protocol.model_validate(study_tables())
    for number in range(first, first + MOST):
        if enough.is_set():
            break
        person = f"P{number:03d}"
        who: dict[str, Any] = {"seed": 11, "operator": "AB", "language": "en", "simulated": True}
        store = begin(study, protocol, SOURCE, SessionStart(person, device={"name": "scripted"}, screens={}, **who))
        for trial in build_schedule(protocol, person, 11).trials:
            which = {"trial": trial.number, "attempt": 1}
            told = {name: getattr(trial, name) for name in ("block", "phase", "part", "index", "of", "code")}
            store.append("trial_started", **which, **told)
            store.append("trial_ended", **which, outcome="complete", **summary_of_trial())
            store.write_tables()
            times = {"onset_s": 1.5, "first_s": 2.25, "last_s": 2.25, "changes": 0}
            items = [{"item": it, "number": at, "value": 4, **times} for at, it in enumerate(trial.items, start=1)]
            if items:
                choose(store, trial.number, items)
                store.append("responses", **which, items=items)
                store.write_tables()
        store.finish("completed")


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
            errors += [*map(str, findings.errors), *map(str, findings.psychds.errors)]
    assert [program.exitcode for program in started] == [0] * len(started)
    return looks, running, errors


@pytest.mark.nightly
@needs_fork
def test_sessions_that_are_begun_and_ended_beside_it_are_never_called_unsound(tmp_path: Path) -> None:
    """Two programs write to one study, with all that begins and ends a session."""
    study = tmp_path / "study"
    _, running, errors = look_beside(study, (hold_sessions, (101,)), (hold_sessions, (1,)))
    assert errors == []
    assert running >= ENOUGH
    findings = verify(study)
    assert (findings.sound, findings.running) == (True, 0)


@needs_fork
def test_a_rehearsal_with_recordings_beside_it_is_never_called_unsound(tmp_path: Path) -> None:
    _, running, errors = look_beside(tmp_path / "study", (rehearse_short, (short.write(tmp_path),)))
    assert errors == []
    assert running > 0
    assert verify(tmp_path / "study").sound


def test_a_damaged_line_of_a_running_session_is_an_error(tmp_path: Path, start: Start) -> None:
    with start() as store:
        store.append("note", kind="note", text="one")
        store.append("note", kind="note", text="two")
        path = store.folder.journal
        path.write_bytes(path.read_bytes().replace(b'"one"', b'"six"'))
        findings = verify(tmp_path / "study")
        assert findings.running == 1
        assert ["which was changed" in str(error) for error in findings.errors] == [True]
