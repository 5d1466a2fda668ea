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
from study_app.store import receipt
from study_app.store.blinded import blinding
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.journals import journal_events
from study_app.store.sessions import rebuild_session
from study_app.store.sessions.open_session import Place
from study_app.store.verification import Discrepancy, session_discrepancies, verify_session
from study_app.store.verification.whole_study import verify_study
from tests.faults.support import short
from tests.platforms import needs_fork
from tests.store.conftest import Start
from tests.store.verification.played_studies import P007, told, warned

pytestmark = pytest.mark.slow


def test_the_questions_of_designs_are_compared_unless_a_language_is_the_labs_own() -> None:
    questions = {"after": {}, f"pairs{receipt.ANSWER}": {}}
    for languages, compared in ((["nl", "en"], questions), (["en", "fy"], {"after": {}})):
        protocol = {"study": {"languages": languages}, "questionnaires": questions}
        assert verify_session._without_own_texts(protocol)["questionnaires"] == compared


def test_a_revealed_condition_is_reported_without_naming_it(study: Path, tmp_path: Path, start: Start) -> None:
    store = start("P009")
    store.append(journal_events.Note(kind="note", text="this must be mildew"))
    store.append(journal_events.Note(kind="note", text="density 1013.7, I think"))
    store.append(journal_events.Note(kind="note", text="137 seconds"))
    store.finish("completed")
    reveal_lines = [line for line in warned(verify_study(study)).splitlines() if "reveals a condition" in line]
    place = "data/sub-P009/ses-01/journal.jsonl"
    assert [line.split(", line ")[1][0] for line in reveal_lines] == ["2", "3"]
    assert all(place in line for line in reveal_lines)
    assert "mildew" not in warned(verify_study(study))
    blinding.reveal(study, "AB", "done")
    assert "reveals a condition" not in warned(verify_study(study))


def test_a_receipt_without_a_protocol_makes_no_word_of_the_study_a_telltale(study: Path) -> None:
    """A liquid may have the name of a column or a page, which every receipt's protocol contains."""
    key = study / "blinding" / "key.sealed"
    content = json.loads(base64.b64decode(key.read_bytes()))
    content["tables"]["liquids"]["Settings"] = content["tables"]["liquids"].pop("mildew")
    key.write_bytes(base64.encodebytes(json.dumps(content).encode()))
    assert "reveals a condition" not in warned(verify_study(study))
    for participant in ("P007", "P008"):
        path = study / "data" / f"sub-{participant}" / "ses-01" / "receipt.json"
        receipt.write(path, {name: value for name, value in receipt.read(path).items() if name != "protocol"})
        assert "does not contain protocol" in told(verify_study(study))
        assert "reveals a condition" not in warned(verify_study(study))


def test_two_files_under_one_version_are_named(study: Path) -> None:
    assert "different study files" not in warned(verify_study(study))
    path = study / P007 / "receipt.json"
    receipt.write(path, {**receipt.read(path), "protocol_hash": "ab" * 32})
    assert "version 1.0 used 2 different study files" in warned(verify_study(study))


def test_each_difference_from_a_list_of_fingerprints_names_its_session(study: Path, tmp_path: Path) -> None:
    path, copy = study / "fingerprints.txt", tmp_path / "copy.txt"
    first, second = path.read_text("utf-8").splitlines()
    proof, other = first.split()[0], second.split()[0]
    missing, record = "aaaa-bbbb-cccc  data/sub-P009/ses-01", "dddd-eeee-ffff  exclusions.csv/sub-P007"
    forged = f"cccc-bbbb-aaaa  {P007}"
    begins = f"{P007}: is not the session that "

    def errors(*, own: list[str], kept: list[str]) -> list[str]:
        path.write_text("\n".join([*own, ""]), encoding="utf-8", newline="\n")
        copy.write_text("\n".join([*kept, ""]), encoding="utf-8", newline="\n")
        return [str(error) for error in verify_study(study, copy).errors]

    entries = [first, second]
    assert first.endswith(f"  {P007}")
    assert errors(own=entries, kept=entries) == []
    assert errors(own=entries, kept=[second]) == [
        f"{P007}: (fingerprint {proof}) is not in {copy}: the session was added or ended after that copy was made"
    ]
    assert errors(own=entries, kept=[forged, second, missing, record]) == [
        f"exclusions.csv: does not contain dddd-eeee-ffff (exclusions.csv/sub-P007), although {copy} lists it: it was "
        "deleted or changed",
        f"{begins}{copy} lists as cccc-bbbb-aaaa: it has been changed (its fingerprint is {proof})",
        f"data/sub-P009/ses-01: is missing, but {copy} lists it: the session was deleted after it had ended",
    ]
    assert errors(own=[first, "P008"], kept=entries) == [
        "fingerprints.txt: line 2 is not a fingerprint: restore it from a backup",
        "fingerprints.txt: does not list data/sub-P008/ses-01, which has ended; the rebuild command adds it",
    ]
    assert errors(own=[forged, second], kept=entries) == [
        f"{begins}fingerprints.txt lists as cccc-bbbb-aaaa: it has been changed (its fingerprint is {proof})"
    ]
    with lock_folder(study):
        assert errors(own=[first], kept=entries) == [], "a program lists a session just after creating it"
    assert other != proof


def test_findings_do_not_reveal_the_key(study: Path) -> None:
    """No message reveals a condition, whatever is damaged."""
    content = json.loads(base64.b64decode((study / "blinding" / "key.sealed").read_bytes()))
    for path in sorted(study.rglob("*")):
        if path.is_file() and path.name != "key.sealed":
            path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    try:
        findings = verify_study(study)
    except StoreError as error:
        message = str(error)
    else:
        message = told(findings) + warned(findings)
    assert not [word for word in content["tables"]["conditions"] if word in message]


def test_another_description_of_a_column_is_a_warning_and_another_range_an_error(study: Path) -> None:
    path = study / "dataset_description.json"
    content = json.loads(path.read_bytes())
    variables = content["variableMeasured"]
    variables[0] = variables[0] | {"description": "In other words."}
    path.write_text(json.dumps(content | {"variableMeasured": variables}), encoding="utf-8", newline="\n")
    findings = verify_study(study)
    assert not any(error.place == path.name for error in findings.errors)
    assert "contains the column descriptions of an earlier version of the program" in warned(findings)
    at = next(index for index, it in enumerate(variables) if "minValue" in it and "unitText" in it)
    for change in ({"minValue": -5}, {"maxValue": 7}, {"unitText": "mile"}, {"@type": "y"}):
        changed = [*variables[:at], variables[at] | change, *variables[at + 1 :]]
        path.write_text(json.dumps(content | {"variableMeasured": changed}), encoding="utf-8", newline="\n")
        assert "does not match the study in the receipts" in told(verify_study(study))


def test_a_column_that_was_removed_from_a_table_is_found(study: Path) -> None:
    (path,) = (study / "data" / "sub-P007" / "ses-01").glob("*trials_data.csv")
    rows = list(csv.reader(path.read_text(encoding="utf-8").splitlines()))
    at = rows[0].index("loop_delay_changes")
    path.write_text(
        "".join(f"{','.join([*row[:at], *row[at + 1 :]])}\n" for row in rows), encoding="utf-8", newline="\n"
    )
    assert f"{path.name}: has changed since the session ended" in told(verify_study(study))


def test_each_difference_of_a_receipt_and_a_recording_from_the_journal_is_named(study: Path) -> None:
    session = study / P007
    path, start_receipt = session / "receipt.json", receipt.read(session / "receipt.json")
    blocks = start_receipt["protocol"]["blocks"]
    name, block = next((name, block) for name, block in blocks.items() if len(block["codes"]) > 1)

    def errors(**changes: object) -> set[str]:
        receipt.write(path, start_receipt | changes)
        return {line.partition(": ")[2] for line in told(verify_study(study)).splitlines() if path.name in line}

    changed = "has changed since the session ended (its checksum differs)"
    settings = "differs from the journal in the settings used when the session began"
    assert errors() == set()
    for codes in (block["codes"][::-1], ["Z9"]):  # in another order, and one that the key does not have
        protocol = start_receipt["protocol"] | {"blocks": blocks | {name: block | {"codes": codes}}}
        assert errors(protocol=protocol) == {
            changed, settings, "its protocol has been changed: restore it from a backup",
        }  # fmt: skip
    assert errors(seed=9, operator="XY", key_hash="ab" * 32) == {
        changed, "contains the hash of a different key", "differs from the journal in seed, operator, key_hash",
    }  # fmt: skip
    assert errors(device=start_receipt["device"] | {"name": "mouse"}) == {changed, "differs from the journal in device"}
    assert errors(row_of="P001", group="g") == {changed, "differs from the journal in row_of, group"}
    receipt.write(path, start_receipt)
    first, second = (session / "recordings" / f"trial-00{trial}.parquet" for trial in (1, 3))
    contents = first.read_bytes(), second.read_bytes()
    first.write_bytes(contents[1])
    second.write_bytes(contents[0])
    findings = told(verify_study(study))
    for recording, trial, other_trial in ((first, 1, 3), (second, 3, 1)):
        for sentence in (
            f"has changed since it was recorded (trial {trial}, attempt 1)",
            f"contains trial {other_trial}, but the journal says {trial}",
            f"contains rows {500 + other_trial}, but the journal says {500 + trial}",
        ):
            assert f"{P007}/recordings/{recording.name}: {sentence}" in findings


def test_an_analysis_lists_each_differing_file_once_with_its_remedy(study: Path) -> None:
    place = Place(StudyFolder(study), StudyFolder(study).session("P007", 1), "brackish")
    table = place.folder.table("brackish", "trials")
    advice = f"run liquid-study verify {study} to check everything"
    assert session_discrepancies(place) == ()
    place.folder.crash.write_text("Fatal Python error", encoding="utf-8", newline="\n")
    table.write_bytes(table.read_bytes().replace(b"999.98", b"-9.0"))
    difference = "differs from the journal, starting at line 2; the rebuild command recreates it"
    assert session_discrepancies(place) == (Discrepancy(table, difference, advice),)
    place.folder.rebuilt.write_text("rewritten", encoding="utf-8", newline="\n")
    first, *others = session_discrepancies(place)
    assert (first.path, first.what) == (
        place.folder.rebuilt, "states that the checksums or the fingerprint were rewritten after the session ended",
    )  # fmt: skip
    assert first.remedy.startswith("compare it with fingerprints stored elsewhere: liquid-study verify --fingerprints")
    assert {(doubt.path, doubt.remedy) for doubt in others} == {(table, advice), (place.folder.rebuilt, advice)}
    with lock_folder(place.folder.path):
        assert session_discrepancies(place) == ()


ENOUGH = 1  # looks


def rehearse_short(study: Path, protocol: Path, _enough: Any) -> None:
    rehearse(protocol, participants=1, seed=7, results=study)


def test_a_missing_description_is_an_error_that_rebuild_corrects(study: Path) -> None:
    path = study / "dataset_description.json"
    content = path.read_bytes()
    path.unlink()
    findings = verify_study(study)
    assert findings.sessions
    assert f"{path.name}: is missing; the rebuild command creates it" in told(findings)
    assert path in rebuild_session(StudyFolder(study).sessions()[0].path).rewritten
    assert path.read_bytes() == content
    assert verify_study(study).is_sound


def look_beside(study: Path, *programs: tuple[Callable[..., None], tuple[Any, ...]]) -> tuple[int, int, list[str]]:
    """Verify until the programs have ended; return how often, how often a session ran, and every error."""
    forking = multiprocessing.get_context("fork")
    enough = forking.Event()
    programs_running = [
        forking.Process(target=target, args=(study, *arguments, enough)) for target, arguments in programs
    ]
    for program in programs_running:
        program.start()
    looks = running = 0
    errors: list[str] = []
    while any(program.is_alive() for program in programs_running):
        if (study / "dataset_description.json").exists():
            findings = verify_study(study)
            looks += 1
            running += findings.running > 0
            if running >= ENOUGH:
                enough.set()
            errors += map(str, findings.errors)
    assert [program.exitcode for program in programs_running] == [0] * len(programs_running)
    return looks, running, errors


@needs_fork
def test_a_rehearsal_with_recordings_beside_it_is_never_called_unsound(tmp_path: Path) -> None:
    _, running, errors = look_beside(tmp_path / "study", (rehearse_short, (short.write(tmp_path),)))
    assert errors == []
    assert running > 0
    assert verify_study(tmp_path / "study").is_sound
