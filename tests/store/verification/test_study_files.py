"""Files of a study that `verify` compares with each other, written by hand: which one is named, and why."""

import json
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.store import merged
from study_app.store.blinded.allocation import Claim, RecordedEntry
from study_app.store.files.folders import StudyFolder
from study_app.store.verification import whole_study
from study_app.store.verification.verify_session import Finding, Findings
from study_app.store.withdrawals import ErasedSession, Tombstone, add_tombstone

AT, LATER = "2026-03-02T09:30:00.000+01:00", "2026-03-02T11:30:00.000+01:00"
KEY: Any = SimpleNamespace(hash="a" * 64)
RESTORE = "restore it from a backup"


def finding_texts(findings: Iterable[Finding]) -> list[str]:
    return [str(finding) for finding in findings]


def write_receipt(study: StudyFolder, participant: str, session: int = 1, journal: bytes = b"", **fields: Any) -> None:
    folder = study.session(participant, session)
    folder.path.mkdir(parents=True)
    field_values = {"key_hash": "a" * 64, "protocol_hash": "c" * 64, "started_at": AT} | fields
    folder.receipt.write_text(json.dumps(field_values), encoding="utf-8", newline="\n")
    if journal:
        folder.journal.write_bytes(journal)


def test_findings_name_paths_in_the_folder_without_repeating_them(tmp_path: Path) -> None:
    findings = Findings(tmp_path)
    findings.error(tmp_path / "data" / "a.csv", "is wrong")
    findings.error(tmp_path, "is wrong")
    findings.add_failure(tmp_path / "b", whole_study.StoreError(f"{tmp_path / 'b'}, line 3 is wrong"))
    with findings.reading(tmp_path / "c"):
        raise whole_study.StoreError(f"{tmp_path / 'c'}: cannot be read")
    findings.warning(tmp_path.parent / "d", "is outside")
    assert finding_texts(findings.errors) == [
        "data/a.csv: is wrong",
        ".: is wrong",
        "b: line 3 is wrong",
        "c: cannot be read",
    ]
    assert (finding_texts(findings.warnings), findings.is_sound) == ([".: is outside"], False)
    others = Findings(tmp_path, warnings=(Finding("x", "y", shares=True),))
    assert others.is_sound
    others.extend(findings)
    assert (len(others.errors), finding_texts(others.warnings)) == (4, ["x: y", ".: is outside"])


def test_one_version_with_two_contents_of_the_studys_file_is_reported(tmp_path: Path) -> None:
    study, findings = StudyFolder(tmp_path), Findings(tmp_path)
    for participant, version, content in (("P1", "1.0", "c"), ("P2", "1.0", "c"), ("P3", "1.1", "d")):
        write_receipt(study, participant, protocol_hash=content * 64, protocol={"study": {"version": version}})
    whole_study._check_contents(study, findings)
    assert findings.warnings == ()
    write_receipt(study, "P4", protocol_hash="e" * 64, protocol={"study": {"version": "1.1"}})
    whole_study._check_contents(study, findings)
    assert finding_texts(findings.warnings) == [
        "data: sessions with version 1.1 used 2 different study files (see protocol_hash): change study.version "
        "whenever the file changes"
    ]


def test_plug_ins_that_are_missing_are_named_with_their_package(tmp_path: Path) -> None:
    """An outlet is not needed to check a session, and a task of the program itself is there."""
    study, findings = StudyFolder(tmp_path), Findings(tmp_path)
    plug_ins = [
        {"package": "oils", "version": "1.2", "kind": kind, "name": name}
        for kind, name in (("task", "swirl"), ("method", "ladder"), ("task", "reach"), ("outlet", "udp"))
    ]
    write_receipt(study, "P1", plug_ins=plug_ins)
    whole_study._check_plug_ins(study, findings)
    assert findings.plug_ins == {"oils 1.2": ["method ladder", "outlet udp", "task reach", "task swirl"]}
    assert finding_texts(findings.warnings) == [
        "data: sessions used method ladder, task swirl of oils 1.2, which is not installed: checks that need the "
        "plug-in were skipped"
    ]


def test_a_copy_of_a_list_is_distinguished_from_other_files(tmp_path: Path) -> None:
    study = StudyFolder(tmp_path)
    table = study.participants("stirring")
    table.parent.mkdir()
    copies = [
        tmp_path / "exclusions (1).csv", tmp_path / "EXCLUSIONS_conflict-2.csv", tmp_path / "exclusions.csv.bak",
        tmp_path / "withdrawals.sync-conflict-1.jsonl", table.with_name(f"{table.stem} copy.csv"),
    ]  # fmt: skip
    others = [study.exclusions, table, tmp_path / "exclusions2.csv", tmp_path / "exclusions.csv.gz", tmp_path / "a.csv"]
    for path in (*copies, *others):
        path.write_bytes(b"")
    originals = [study.exclusions] * 3 + [study.withdrawals, table]
    assert sorted(whole_study._stray_copies(study, "stirring")) == sorted(zip(copies, originals, strict=True))


def findings_of_allocation(
    study: StudyFolder,
    monkeypatch: pytest.MonkeyPatch,
    claims: list[Claim],
    recorded: dict[str, RecordedEntry],
    withdrawn: tuple[str, ...] = (),
) -> Findings:
    findings = Findings(study.path)
    monkeypatch.setattr(whole_study, "claims", lambda _study: claims)
    monkeypatch.setattr(whole_study, "recorded_entries", lambda _study: recorded)
    monkeypatch.setattr(whole_study, "is_unchanged", lambda claim, key: claim.sealed != "changed" and key is KEY)
    whole_study._check_allocation(study, KEY, withdrawn, findings)
    return findings


def test_each_entry_belongs_to_one_participant_with_a_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = StudyFolder(tmp_path)
    study.allocated.mkdir(parents=True)

    def claim(entry: int, participant: str, replaces: str | None = None, content: bytes = b"x", **more: Any) -> Claim:
        path = study.allocation(entry, more.get("group"), None if replaces is None else participant)
        path.write_bytes(content)
        return Claim(path=path, entry=entry, participant=participant, replaces=replaces, **more)

    where = study.allocated.relative_to(tmp_path).as_posix()
    sound = [claim(1, "P1"), claim(1, "P5", "P1"), claim(2, "P2"), claim(3, "P3", group="experts")]
    recorded = {
        "P1": RecordedEntry(1, None, None), "P5": RecordedEntry(1, None, "P1"), "P2": RecordedEntry(2, None, None),
        "P3": RecordedEntry(3, "experts", None),
    }  # fmt: skip
    findings = findings_of_allocation(study, monkeypatch, sound, recorded)
    assert (findings.errors, findings.warnings) == ((), ())
    others = [
        claim(4, "", content=b""), claim(5, ""), claim(6, "P6", sealed="changed"), claim(7, "P2"), claim(8, "P8"),
        claim(9, "P9"), claim(2, "P7", "P1"), claim(1, "P4", "P0"),
    ]  # fmt: skip
    findings = findings_of_allocation(study, monkeypatch, [*sound, *others], recorded, ("P9", "P7", "P4", "P6"))
    assert finding_texts(findings.warnings) == [
        f"{where}/004.json: was reserved by a program that ended early; it will remain unused",
        f"{where}/008.json: belongs to participant P8, who does not have a session yet",
    ]
    assert finding_texts(findings.errors) == [
        f"{where}/005.json: has been changed: {RESTORE}",
        f"{where}/006.json: has been changed: {RESTORE}",
        f"{where}/007.json: is a second entry for participant P2, who already has entry 002",
        f"{where}/002-P7.json: replaces participant P1, who does not have a matching entry",
        f"{where}/001-P4.json: replaces participant P0, who does not have a matching entry",
    ]
    elsewhere = recorded | {"P2": RecordedEntry(1, None, None), "P3": RecordedEntry(30, "experts", None)}
    elsewhere |= {"P5": RecordedEntry(1, None, "P2")}
    shared = "entry 1 of participant {} also belongs to another participant"
    assert finding_texts(findings_of_allocation(study, monkeypatch, sound, elsewhere).errors) == [
        f"{where}: {shared.format('P1')}",
        f"{where}/001-P5.json: does not belong to participant P5, whose journal has entry 1",
        f"{where}/001.json: does not belong to participant P2, whose journal has entry 1",
        f"{where}: {shared.format('P2')}",
        f"{where}/experts-030.json: is missing, although participant P3 has entry 30",
    ]
    findings = Findings(tmp_path)
    whole_study._check_allocation(study, None, (), findings)
    assert findings.errors == (), "without the key nothing can be compared"


def test_an_incomplete_withdrawal_is_distinguished_from_a_complete_one(tmp_path: Path) -> None:
    study, findings = StudyFolder(tmp_path), Findings(tmp_path)
    for participant, by in (("P1", "AB"), ("P2", "CD")):
        add_tombstone(study, Tombstone(participant=participant, at=AT, by=by, reason="asked", sessions=()))
    left = study.session("P2", 1).path
    left.mkdir(parents=True)
    withdrawn, unerased = whole_study._check_withdrawals(study, findings)
    assert (list(withdrawn), unerased) == (["P1", "P2"], {left.parent})
    assert finding_texts(findings.warnings) == [
        f"withdrawals.jsonl: participant P1 withdrew at {AT} (recorded by AB); the data were erased"
    ]
    assert finding_texts(findings.errors) == [
        "data/sub-P2: still exists, although P2 withdrew; the withdrawal was interrupted: run liquid-study withdraw "
        "again"
    ]
    study.withdrawals.write_bytes(b"7\n")
    assert whole_study._check_withdrawals(study, findings) == ({}, set())
    assert str(findings.errors[-1]).startswith("withdrawals.jsonl: line 1 is not a withdrawal")


def test_each_reveal_is_a_record_of_this_key(tmp_path: Path) -> None:
    study, findings = StudyFolder(tmp_path), Findings(tmp_path)
    (tmp_path / "blinding").mkdir()
    records = [{"at": AT, "by": "AB", "reason": "analysis", "key_hash": digit * 64} for digit in "aba"]
    lines = [json.dumps(records[0]), '{"by": 7}', json.dumps(records[1]), json.dumps(records[2]), '{"at": "2026']
    study.reveals.write_text("\n".join(lines), encoding="utf-8", newline="\n")
    whole_study._check_reveals(study, KEY, findings)
    assert finding_texts(findings.errors) == [
        "blinding/reveals.jsonl: line 2 is not a record of an unblinding: it has been changed; restore the file from a "
        "backup",
        "blinding/reveals.jsonl: unblinding 2 used a different key",
    ]
    assert finding_texts(findings.warnings) == [
        "blinding/reveals.jsonl: line 5 is an incomplete record of an unblinding (possibly because of a power failure)"
    ]


@pytest.mark.parametrize(
    ("listed", "present", "earlier", "times", "is_missing"),
    [
        (3, 3, 0, [], False),
        (3, 2, 0, [], True),
        (3, 2, 0, [AT], False),
        (3, 2, 1, [AT], True),
        (3, 2, 1, [AT, AT], False),
        (3, 2, None, ["2026-03-02T09:29:59.999+01:00"], True),
        (3, 2, None, [AT], False),
        (3, 4, 0, [], False),
    ],
)
def test_only_sessions_withdrawn_after_the_merge_may_be_missing_at_a_site(
    tmp_path: Path, listed: int, present: int, earlier: int | None, times: list[str], is_missing: bool
) -> None:
    """Lists of format 1 do not count withdrawals: then times decide."""
    site = merged.Site(name="north", merged_at=AT, key_hash="a" * 64, sessions=listed, withdrawals=earlier)
    study, findings = StudyFolder(tmp_path / "sites" / "north"), Findings(tmp_path)
    for number in range(present):
        study.session(f"P{number}", 1).path.mkdir(parents=True)
    for number, at in enumerate(times):
        erased = ErasedSession(session=1, begun="", checksums="", fingerprint="")
        add_tombstone(study, Tombstone(participant=f"Q{number}", at=at, by="AB", reason="asked", sessions=(erased,)))
    whole_study._check_site(merged.Merged(tmp_path, "stirring", "c" * 64, (site,)), site, findings)
    message = f"contains only {present} of the 3 sessions that sites.json lists: restore the others from a backup"
    assert finding_texts(findings.errors) == ([f"sites/north: {message}"] if is_missing else [])
    study.description.write_text('{"name": "shaking"}', encoding="utf-8", newline="\n")
    whole_study._check_site(merged.Merged(tmp_path, "stirring", "c" * 64, (site,)), site, findings)
    message = "sites/north: contains study shaking, but sites.json lists the sites of stirring"
    assert message in finding_texts(findings.errors)


def test_sites_are_compared_with_their_list_and_with_each_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sites = tuple(
        merged.Site(name=name, merged_at=AT, key_hash=digit * 64, sessions=1, withdrawals=0)
        for name, digit in (("north", "a"), ("south", "b"), ("west", "e"))
    )
    study, findings = merged.Merged(tmp_path, "stirring", "c" * 64, sites), Findings(tmp_path)
    write_receipt(StudyFolder(study.folder("north")), "P1", journal=b"same first line\n")
    write_receipt(StudyFolder(study.folder("south")), "P2", journal=b"same first line\n", protocol_hash="d" * 64)
    (tmp_path / "sites" / "east").mkdir()
    monkeypatch.setattr(whole_study, "sealed_hash", lambda _folder: "a" * 64)
    whole_study._check_sites(study, findings)
    key = StudyFolder(study.folder("south")).key.relative_to(tmp_path).as_posix()
    assert finding_texts(findings.errors) == [
        f"{key}: is not the key that site south was merged with: {RESTORE}",
        f"sites/south/data/sub-P2/ses-01/receipt.json: has protocol {'d' * 64}, but was merged with {'c' * 64}",
        "sites/south/data/sub-P2/ses-01: is a copy of sites/north/data/sub-P1/ses-01: its data are counted twice",
        f"sites/west: is missing, although sites.json lists site west: {RESTORE}",
    ]
    assert finding_texts(findings.warnings) == ["sites/east: is not listed as a site in sites.json, so it is ignored"]
