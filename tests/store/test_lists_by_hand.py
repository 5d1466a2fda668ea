"""Lists, tables and messages of the store, from files written by hand: every value differs from its neighbours."""

import json
import os
import platform
import shutil
import time
from collections.abc import Callable
from contextlib import nullcontext, suppress
from pathlib import Path
from re import escape
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from study_app.errors import StoreError, StudyError
from study_app.protocol.load import parse
from study_app.protocol.source.files import source_bytes
from study_app.protocol.trials.stimuli import Stimulated
from study_app.store import exclusions, merged, receipt, withdrawals
from study_app.store.blinded import blinding
from study_app.store.exclusions import Exclusion
from study_app.store.files import atomic, csv_files, output_files
from study_app.store.files.folders import SessionFolder, StudyFolder, kept_pilot_folder, rehearsal_folder
from study_app.store.integrity.checksums import (
    file_hash,
    note_rebuilt,
    read_checksums,
    renew_checksums,
    replace_checksums,
)
from study_app.store.integrity.folder_lock import lock_folder, remove_abandoned_claims
from study_app.store.recorder import Recorder
from study_app.store.session_progress.delivered import broken_limits, delay_error_ms, is_within_limits
from study_app.store.sessions import begin
from study_app.store.sites import merge
from study_app.store.tables.study_files import study_folders
from study_app.store.versions import drafts, study_runs, study_settings, study_versions
from study_app.user_folder import data_folder
from tests.platforms import needs_links
from tests.store.recorded_disk import Disk

AT = "2026-03-02T09:30:00.000+01:00"
COLUMNS = "participant,session,trial,rule_or_person,reason,excluded_at,key_open\n"
FAILED = OSError(28, "No space left on device")


def refuse(*_: object, **__: object) -> None:
    raise FAILED


@pytest.fixture
def sites(tmp_path: Path) -> Path:
    """A merged study of two sites, whose P007 and P012 are excluded."""
    folder = tmp_path / "both"
    for site, row in (("north", f"P007,2,n/a,AB,slept,{AT},true\n"), ("south", f"P012,1,3,CD,coughed,{AT},false\n")):
        place = folder / "sites" / site
        (place / "data" / f"sub-{row[:4]}" / f"ses-0{row[5]}").mkdir(parents=True)
        (place / "exclusions.csv").write_text(COLUMNS + row, encoding="utf-8", newline="\n")
    site_entries = [
        {"name": name, "merged_at": AT, "key_hash": digit * 64, "sessions": sessions, "withdrawals": withdrawals}
        for name, digit, sessions, withdrawals in (("north", "a", 7, 1), ("south", "b", 9, None))
    ]
    fields = {"format": 2, "study": "stirring", "protocol_hash": "c" * 64, "sites": site_entries}
    (folder / "sites.json").write_text(json.dumps(fields), encoding="utf-8", newline="\n")
    return folder


def test_a_merged_study_names_each_participant_and_exclusion_with_the_site(sites: Path) -> None:
    study = merged.read_merged(sites)
    assert study is not None
    assert [(site.name, site.key_hash[0], site.sessions, site.withdrawals) for site in study.sites] == [
        ("north", "a", 7, 1), ("south", "b", 9, None),
    ]  # fmt: skip
    assert (study.path, study.study, study.protocol_hash) == (sites, "stirring", "c" * 64)
    assert study.manifest == sites / "sites.json"
    assert json.loads(study.content()) == json.loads(study.manifest.read_text("utf-8"))
    assert merged.read_merged(study.manifest) is merged.read_merged(sites / "sites") is None
    assert merged.folders_of(sites) == {"north-": sites / "sites" / "north", "south-": sites / "sites" / "south"}
    assert merged.locate_participant(sites, "south-P012") == (sites / "sites" / "south", "P012")
    assert merged.session_in(sites, "north-P007", 2) == SessionFolder(
        sites / "sites" / "north" / "data" / "sub-P007" / "ses-02", "P007", 2
    )
    assert [(row.participant, row.session, row.trial, row.key_open) for row in merged.all_exclusions(sites)] == [
        ("north-P007", 2, None, True), ("south-P012", 1, 3, False),
    ]  # fmt: skip
    for participant in ("P007", "west-P007", "south-"):
        with pytest.raises(StoreError, match=r"\(north, south\), but '.*' does not include .* such as north-P007"):
            merged.locate_participant(sites, participant)
    alone, hidden = sites / "sites" / "north", sites.parent / ".hidden"
    shutil.copytree(sites, hidden)
    (sites / "sites" / "west").mkdir()
    assert merge.stray_entries(study) == (sites / "sites" / "west",)
    (sites.parent / "another" / "data").mkdir(parents=True)
    assert list(study_folders(sites.parent)) == [sites.parent / "another", sites]
    assert merged.folders_of(alone) == {"": alone}
    assert merged.locate_participant(alone, "a-P007") == (alone, "a-P007")
    assert (merged.merged_above(alone), merged.merged_above(sites), merged.merged_above(alone.parent)) == (
        sites, None, None,
    )  # fmt: skip
    assert merged.merged_above(sites.parent / "sites" / "north") is None, "no list of sites"
    with pytest.raises(
        StoreError, match=f"^{escape(str(alone))} is the copy of a site in the merged study {escape(str(sites))}: run"
    ):
        merged.refuse_merged(alone)
    with pytest.raises(StoreError, match=f"^{escape(str(sites))} is a merged study"):
        merged.refuse_merged(sites)


SITE = {"name": "north", "merged_at": AT, "key_hash": "a" * 64, "sessions": 7, "withdrawals": 1}


@pytest.mark.parametrize(
    "change",
    [
        {"sites": []},
        {"protocol_hash": 7},
        {"study": "../x"},
        {"sites": [{"name": "north"}]},
        {"study": 7},
        *(
            {"sites": [SITE | {name: wrong}]}
            for name, wrong in (
                ("name", "a-b"), ("name", 7), ("merged_at", "noon"), ("key_hash", 7), ("sessions", "7"),
                ("withdrawals", "1"),
            )
        ),
        {"format": 0},
        {"format": 3},
    ],
)  # fmt: skip
def test_an_invalid_list_of_sites_is_refused(sites: Path, change: dict[str, Any]) -> None:
    path = sites / "sites.json"
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | change), encoding="utf-8", newline="\n")
    problem = "does not list the sites of a merged study: restore it from a backup"
    if "format" in change:
        problem = f"has format {change['format']}, but this version reads only formats 1 and 2: install a newer version"
    with pytest.raises(StoreError, match=f"^{escape(f'{path} {problem}')}$"):
        merged.read_merged(sites)


@needs_links
def test_a_site_that_is_a_link_is_named_with_its_place(sites: Path, tmp_path: Path) -> None:
    (sites / "sites" / "north").rename(tmp_path / "away")
    (sites / "sites" / "north").symlink_to(tmp_path / "away")
    with pytest.raises(StoreError, match=f"^{sites / 'sites' / 'north'} is a link to {tmp_path / 'away'}, .*{sites}:"):
        merged.read_merged(sites)


def test_a_withdrawal_erases_every_file_that_names_the_participant_and_no_other(
    sites: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """P0071 stays; outputs of the merged study are erased, too."""
    monkeypatch.setenv("LIQUID_STUDY_DATA", str(tmp_path / "user"))
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    north, results = sites / "sites" / "north", tmp_path / "results"
    study, participants = StudyFolder(north), ("P007", "P0071")
    results.mkdir()
    study.session("P0071", 1).path.mkdir(parents=True)
    lists = {
        study.description: ['{"name": "stirring"}'],
        study.ignore: ["rebuilt.txt"],
        study.fingerprints: [f"k3vq-7m2p-xw4d  data/sub-{participant}/ses-01" for participant in participants],
        study.reversed_exclusions: [
            json.dumps({"exclusion": {"participant": participant}}) for participant in participants
        ],
        study.participants("stirring"): ["study,participant", "stirring,P0071"],
        north / "notes.txt": ["(P007) was late"],
        north / "other.txt": ["P0071 and XP007 were early"],
        results / "old.ZIP": [],
        results / "mail.txt": ["stirring: P007 called"],
        results / "another.txt": ["shaking: P007 called"],
        results / "mine" / "dataset_description.json": ["{}"],
        results / "mine" / "notes.txt": ["stirring: P007 called"],
    }
    for path, lines in lists.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8", newline="\n")
    output_files.write_output(sites, tmp_path / "report", {"report.html": b"P007"})
    assert list(withdrawals.unerased_files(study, "P007")) == [
        north / "data" / "sub-P007", study.exclusions, study.fingerprints, study.reversed_exclusions,
    ]  # fmt: skip
    withdrawal = withdrawals.withdraw(north, "P007", by="AB", reason="asked")
    assert (withdrawal.folders, withdrawal.outputs) == ((north,), (tmp_path / "report" / "report.html",))
    assert withdrawal.left[0] == f"{north / 'notes.txt'} still names P007"
    assert set(withdrawal.left[1:]) == {
        f"{results / 'old.ZIP'} is an archive, which is not searched: delete it if it contains data from P007",
        f"{results / 'mail.txt'} still names P007",
    }
    assert list(withdrawals.unerased_files(study, "P007")) == []
    assert (study.exclusions.read_text("utf-8"), study.ids()) == (COLUMNS, ("P0071",))
    for path in (study.fingerprints, study.reversed_exclusions):
        assert path.read_text("utf-8") == f"{lists[path][1]}\n"
    assert withdrawals.withdraw(north, "P007", by="CD", reason="again").folders == ()
    assert study.ignore.read_text("utf-8").splitlines() == ["rebuilt.txt", "withdrawals.jsonl"]
    tombstones = withdrawals.tombstones(study).values()
    assert [(tombstone.participant, tombstone.by, tombstone.reason) for tombstone in tombstones] == [
        ("P007", "AB", "asked"),
    ]  # fmt: skip


HELD = {"session": 2, "begun": "b" * 64, "checksums": "c" * 64, "fingerprint": "k3vq-7m2p-xw4d"}
TOMBSTONE = {"participant": "P007", "at": AT, "by": "AB", "reason": "asked", "sessions": [HELD]}


@pytest.mark.parametrize(
    "change",
    [
        {"at": "on Monday"}, {"participant": "P-7"}, {"participant": 7}, {"by": 7}, {"reason": None}, {"more": 1},
        {"sessions": 7}, {"sessions": [7]},
        *({"sessions": [HELD, HELD | {name: wrong}]} for name, wrong in (
            ("session", "2"), ("begun", 7), ("checksums", None), ("fingerprint", []), ("more", 1),
        )),
    ],
)  # fmt: skip
def test_an_invalid_withdrawal_line_is_refused_with_its_number(tmp_path: Path, change: dict[str, Any]) -> None:
    study = StudyFolder(tmp_path)
    lines = [TOMBSTONE, TOMBSTONE | {"participant": "P011", "by": "CD"}]
    text = "\n".join(json.dumps(line) for line in lines)
    study.withdrawals.write_text(f"{text}\n \n", encoding="utf-8", newline="\n")
    first, second = withdrawals.tombstones(study).values()
    assert (first.participant, first.at, first.by, first.reason) == ("P007", AT, "AB", "asked")
    assert first.sessions == (withdrawals.ErasedSession(**HELD),)  # type: ignore[arg-type]
    assert (second.participant, second.by) == ("P011", "CD")
    study.withdrawals.write_text(f"{text}\n \n{json.dumps(TOMBSTONE | change)}\n", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match=f"^{escape(str(study.withdrawals))}, line 4 is not a withdrawal: restore it"):
        withdrawals.tombstones(study)


def test_a_copy_has_a_key_or_sessions_and_an_export_the_name_of_the_study(tmp_path: Path) -> None:
    study, also = tmp_path / "mine", tmp_path / "disk"
    places = {
        name: also / f"{number} {name}"
        for number, name in enumerate(("key", "sessions", "export", "other", "of BIDS", "x"))
    }
    for folder in (study, *places.values()):
        (folder / "data").mkdir(parents=True)
        name = "shaking" if folder == places["other"] else "stirring"
        field = "Name" if folder == places["of BIDS"] else "name"
        StudyFolder(folder).description.write_text(json.dumps({field: name}), encoding="utf-8", newline="\n")
    for folder in (study, places["sessions"]):
        (folder / "data" / "sub-P007" / "ses-01").mkdir(parents=True)
    (places["key"] / "blinding").mkdir()
    StudyFolder(places["key"]).key.write_bytes(b"")
    (places["x"] / "data").rmdir()
    copies, exports = withdrawals._find_copies(StudyFolder(study), [tmp_path, also])
    assert [copy.path for copy in copies] == [places["key"], places["sessions"]]
    assert [export.path for export in exports] == [places["export"]]
    with pytest.raises(StoreError, match=f"^{escape(str(tmp_path / 'none'))} is not a folder: --also requires"):
        withdrawals._find_copies(StudyFolder(study), [tmp_path / "none"])


def test_a_decision_of_a_person_or_a_rule_is_reversed_with_its_own_words(tmp_path: Path) -> None:
    """The rule on missing trials excludes sessions kept despite another rule, but none that a person included."""
    for participant in ("P007", "P008", "P009", "P011"):
        (tmp_path / "data" / f"sub-{participant}" / "ses-02").mkdir(parents=True)
    for participant in ("P007", "P008"):
        exclusions.exclude_incomplete(tmp_path, participant, 2, f"{participant} lacks trials")
    inclusion = exclusions.include(tmp_path, "P007", 2, by="AB", reason="enough trials")
    exclusions.exclude_incomplete(tmp_path, "P007", 2, "again")
    assert (inclusion.participant, inclusion.rule_or_person, inclusion.reason) == (
        "P007", exclusions.MISSING_RULE, "P007 lacks trials",
    )  # fmt: skip
    assert [row.participant for row in exclusions.exclusions(tmp_path)] == ["P008"]
    assert exclusions.reversals(tmp_path) == (inclusion,)
    (reversal,) = exclusions.dated_reversals(tmp_path)
    assert (reversal.by, reversal.reason, reversal.key_open) == ("AB", "enough trials", False)
    kept_decision = exclusions.keep(tmp_path, "P009", 2, rule="fast_answers", by="CD", reason="read aloud")
    assert (kept_decision.rule_or_person, kept_decision.reason) == ("fast_answers", "read aloud (decided by CD)")
    exclusions.exclude_incomplete(tmp_path, "P009", 2, "P009 lacks trials")
    assert [row.what for row in exclusions.exclusions(tmp_path)] == [("P008", 2, None), ("P009", 2, None)]
    ruled = exclusions.exclude(tmp_path, "P007", 2, by="EF", reason="too fast", rule="fast_answers")
    assert (ruled.rule_or_person, ruled.reason) == ("fast_answers", "too fast (decided by EF)")
    with pytest.raises(StoreError, match=r"is excluded: include it without --rule"):
        exclusions.keep(tmp_path, "P007", 2, rule="fast_answers", by="CD", reason="no")
    with pytest.raises(StoreError, match="there is no exclusion rule 'fast'"):
        exclusions.keep(tmp_path, "P007", 2, rule="fast", by="CD", reason="no")
    with pytest.raises(StoreError, match=r"^participant P010, session 2, trial 4 is not excluded; exclusions: partici"):
        exclusions.include(tmp_path, "P010", 2, trial=4, by="AB", reason="no")
    with pytest.raises(StoreError, match=r"session 1 of participant P007; sessions of that participant: 2$"):
        exclusions.exclude(tmp_path, "P007", 1, by="AB", reason="no")
    with pytest.raises(StoreError, match=r"session 1 of participant P1; participants: P007, P008, P009, P011$"):
        exclusions.exclude(tmp_path, "P1", 1, by="AB", reason="no")
    with pytest.raises(StoreError, match=r"^fast_answers is an exclusion rule, not a person"):
        exclusions.exclude(tmp_path, "P011", 2, by="fast_answers", reason="no")
    with pytest.raises(StoreError, match="does not contain session 3 of participant P009"):
        exclusions.keep(tmp_path, "P009", 3, rule="fast_answers", by="CD", reason="no")
    (tmp_path / "blinding").mkdir()
    reveal = {"at": AT, "by": "GH", "reason": "analysis", "key_hash": "a" * 64}
    (tmp_path / "blinding" / "reveals.jsonl").write_text(f"{json.dumps(reveal)}\n", encoding="utf-8", newline="\n")
    exclusions.keep(tmp_path, "P011", 2, rule="fast_answers", by="IJ", reason="read twice")
    decisions = exclusions.dated_reversals(tmp_path)
    rows = [(decision.exclusion.participant, decision.by, decision.reason, decision.key_open) for decision in decisions]
    assert rows == [
        ("P007", "AB", "enough trials", False), ("P009", "CD", "read aloud", False), ("P011", "IJ", "read twice", True),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("key_open", "is_valid"), [(True, True), (False, True), (None, True), ("true", False), (1, False)]
)
def test_a_reversed_exclusion_states_whether_the_key_was_open(tmp_path: Path, key_open: Any, is_valid: bool) -> None:
    row = Exclusion(participant="P7", session=3, trial=5, rule_or_person="AB", reason="rang", excluded_at=AT)
    record = {"at": "later", "by": "CD", "reason": "heard", "key_open": not key_open}
    held = record | {"exclusion": row.fields() | {"key_open": key_open}}
    path = tmp_path / "exclusions_reversed.jsonl"
    path.write_text(f"\n{json.dumps(held)}\n", encoding="utf-8", newline="\n")
    if not is_valid:
        with pytest.raises(StoreError, match=f"^{escape(str(path))}, line 2 is not a reversed exclusion"):
            exclusions.dated_reversals(tmp_path)
        return
    (reversal,) = exclusions.dated_reversals(tmp_path)
    assert (reversal.at, reversal.by, reversal.reason, reversal.key_open) == ("later", "CD", "heard", not key_open)
    assert (reversal.exclusion.what, reversal.exclusion.key_open) == (("P7", 3, 5), key_open)


def test_files_are_written_into_folders_that_a_failure_removes_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "there").mkdir()
    study, files = tmp_path / "study", {"there/a.csv": b"1", "new/deep/b.csv": b"22", "c.csv": b"333"}
    with monkeypatch.context() as failing:
        failing.setattr(output_files, "move", refuse)
        with pytest.raises(
            StudyError, match=f"^{escape(str(tmp_path))} cannot be written \\(No space left on device\\)"
        ):
            output_files.write_files(tmp_path, files)
    assert [path.name for path in tmp_path.rglob("*")] == ["there"]
    warnings: list[str] = []
    outputs = output_files.write_output(study, tmp_path, files, warnings.append)
    assert [(path, path.read_bytes()) for path in outputs] == [
        (tmp_path / name, file_content) for name, file_content in files.items()
    ]
    for of, to, names in ((tmp_path / "other", tmp_path, ["c.csv"]), (study, tmp_path / "away", ["d.csv"])):
        output_files.write_output(of, to, dict.fromkeys(names, b"4"), warnings.append)
    assert [(output.to, output.files) for output in output_files.outputs(study)] == [
        (tmp_path, tuple(files)), (tmp_path / "away", ("d.csv",)),
    ]  # fmt: skip
    erased, elsewhere = output_files.erase_outputs(study, tmp_path / "away")
    assert (erased, [output.to for output in elsewhere]) == ((tmp_path / "away" / "d.csv",), [tmp_path])
    with monkeypatch.context() as failing:
        failing.setattr(output_files, "append_line", lambda path, *_, **__: atomic.append_line(path / "x", b""))
        output_files.write_output(study, tmp_path / "third", {"e.csv": b"5"}, warnings.append)
    assert [line.partition(" could")[0] for line in warnings] == [f"the output in {tmp_path / 'third'}"]


def test_a_rebuilt_list_of_checksums_names_the_files_that_changed(tmp_path: Path) -> None:
    session = SessionFolder(tmp_path / "data" / "sub-P1" / "ses-01", "P1", 1)
    session.path.mkdir(parents=True)
    files = [session.path / name for name in ("a.csv", "b.csv", "c.csv")]
    for length, path in enumerate(files, start=1):
        path.write_bytes(b"x" * length)
    renew_checksums(session, ())
    before = read_checksums(session)
    files[1].write_bytes(b"new")
    files[2].write_bytes(b"newer")
    assert renew_checksums(session, files[:2])
    after = read_checksums(session)
    assert (after["a.csv"], after["c.csv"]) == (before["a.csv"], before["c.csv"])
    assert after["b.csv"] == file_hash(session, "b.csv") != before["b.csv"]
    lines = session.rebuilt.read_text("utf-8").splitlines()
    assert [line.partition(" rebuild: ")[2] for line in lines] == [
        "the list of checksums was missing and has been recreated from the existing files",
        "different checksums were listed for b.csv",
    ]
    assert not renew_checksums(session, files[:2])
    note_rebuilt(session, "by hand")
    assert renew_checksums(session, [session.rebuilt])
    assert read_checksums(session)["rebuilt.txt"] == file_hash(session, "rebuilt.txt")
    assert len(session.rebuilt.read_text("utf-8").splitlines()) == 3


def test_only_the_checksum_of_the_content_before_unblinding_is_replaced(tmp_path: Path) -> None:
    session = SessionFolder(tmp_path, "P007", 2)
    listed = {"changed.csv": "a" * 64, "opened.csv": "b" * 64, "other.csv": "c" * 64}
    text = "".join(f"{digest}  {name}\n" for name, digest in listed.items())
    session.checksums.write_text(text, encoding="utf-8", newline="\n")
    before = session.checksums.stat().st_mtime_ns
    replace_checksums(session, {"changed.csv": ("d" * 64, "e" * 64), "unlisted.csv": ("f" * 64, "0" * 64)})
    assert (session.checksums.read_text("utf-8"), session.checksums.stat().st_mtime_ns) == (text, before)
    replace_checksums(session, {"changed.csv": ("d" * 64, "e" * 64), "opened.csv": ("b" * 64, "1" * 64)})
    assert session.checksums.read_text("utf-8") == text.replace("b" * 64, "1" * 64)


def test_a_draft_that_another_program_wrote_is_kept_as_a_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_DATA", str(tmp_path / "data"))
    file, kept_files = tmp_path / "study.toml", list[tuple[Path, bytes]]()
    monkeypatch.setattr(drafts, "keep_version", lambda file, text, _why: kept_files.append((file, text)))
    keeper = drafts.Keeper(file, "base")
    keeper.note_edit("mine", ("blocks", 2), 10.0)
    assert not keeper.write_if_due(10.0 + drafts.REST_S - 0.01)
    keeper.note_edit("mine too", ("blocks", 3), 10.9)
    assert keeper.write_if_due(10.0 + drafts.REST_S)
    draft = drafts.draft_of(file)
    assert draft is not None
    assert (draft.text, draft.base, draft.selected) == ("mine too", "base", ("blocks", 3))
    assert (drafts.drafted_files(), drafts.unsaved_files(tmp_path)) == ((file,), (file,))
    drafts.write_draft(file, drafts.Draft(text="theirs", base="other", selected=()))
    keeper.note_edit("mine again", (), 20.0)
    assert keeper.write()
    assert (kept_files, keeper.others) == ([(file, b"theirs")], 1)
    drafts.write_draft(file, drafts.Draft(text="theirs again", base="other", selected=()))
    keeper.note_saved("saved")
    assert drafts.draft_of(file) is not None, "the draft of another program stays"
    (path,) = drafts.draft_files()
    path.write_text(path.read_text("utf-8").replace('"selected": []', '"selected": ["a", null, 7]'), "utf-8")
    assert drafts.draft_of(file).selected == ("a", 7)  # type: ignore[union-attr]
    monkeypatch.setattr(Path, "unlink", refuse)
    with pytest.raises(
        StoreError, match=f"^the draft of {escape(str(file))} cannot be deleted: No space left on device$"
    ):
        drafts.delete_draft(file)


def test_abandoned_claims_are_removed(tmp_path: Path) -> None:
    now = time.time()
    ages_s = {"new": 0.0, "old": 3600.0 * 48, "later": -3600.0 * 48}
    folders = {name: atomic.temporary_path(tmp_path / name) for name in ages_s}
    for name, folder in folders.items():
        folder.mkdir()
        os.utime(folder, (now - ages_s[name],) * 2)
    remove_abandoned_claims(tmp_path)
    assert {name for name, folder in folders.items() if folder.exists()} == {"new", "later"}


def test_marked_claims_are_removed_at_any_age_unless_their_program_runs(tmp_path: Path) -> None:
    ended = json.dumps({"pid": os.getpid(), "host": platform.node(), "began": 0.0})
    folders = {name: atomic.temporary_path(tmp_path / name) for name in ("ended", "running", "old and running")}
    for name, folder in folders.items():
        folder.mkdir()
        if name == "ended":
            (folder / ".open-0a1b2c3d.json").write_text(ended, encoding="utf-8", newline="\n")
        else:
            lock_folder(folder)
    os.utime(folders["old and running"], (time.time() - 3600.0 * 48,) * 2)
    remove_abandoned_claims(tmp_path)
    assert {name for name, folder in folders.items() if folder.exists()} == {"running", "old and running"}


def test_a_claim_that_cannot_be_removed_is_left_and_the_others_are_removed(tmp_path: Path) -> None:
    folders = [atomic.temporary_path(tmp_path / name) for name in ("ses-01", "ses-02", "ses-03")]
    for folder in folders:
        folder.mkdir()
        os.utime(folder, (time.time() - 3600.0 * 48,) * 2)
    with Disk(tmp_path, "input/output error", at=1).used():
        remove_abandoned_claims(tmp_path)
    assert [folder.exists() for folder in folders] == [False, True, False]


def test_plug_ins_are_named_by_package_and_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fields = {
        "a": [{"package": "oils", "version": "1.2", "kind": "task", "name": "swirl"}],
        "b": [
            {"package": "oils", "version": "1.2", "kind": "method", "name": "ladder"},
            {"package": "oils", "version": "1.3", "kind": "task", "name": "tilt"},
        ],
        "c": None,
    }
    monkeypatch.setattr(receipt, "read", lambda path: {"plug_ins": fields[path.name]} if path.name in fields else {})
    assert receipt.recorded_plug_ins(tmp_path / name for name in ("none", *fields)) == {
        "oils 1.2": ["method ladder", "task swirl"],
        "oils 1.3": ["task tilt"],
    }


@pytest.mark.parametrize(
    ("name", "edit", "codes", "compares", "orders"),
    [
        (
            "viscosityjnd", ("", ""), {"training": ["practice"], "viscosity": ["V1", "V2", "V3", "V4"]},
            [None, "liquids"],
            [("interleaved", [20], "training/answer"), ("interleaved", [55] * 4, "viscosity/answer")],
        ),
        (
            "thickness", ("kind = \"estimation\"", "kind = \"estimation\"\nmodulus = { level = 0.321, number = 10 }"),
            {"thickness": ["A1"]}, ["liquids"], [("interleaved", [37], "thickness/answer")],
        ),
        (
            "demo", ("", ""), {"liquids": ["L1", "L2"], "delays": ["D1", "D2"]}, ["liquids", "delays"],
            [("shuffled", None, "liquid"), ("shuffled", None, "delay")],
        ),
    ],
)  # fmt: skip
def test_a_receipt_publishes_codes_and_comparisons_but_not_the_conditions(
    name: str, edit: tuple[str, str], codes: dict[str, Any], compares: list[Any], orders: list[Any]
) -> None:
    protocol = parse(source_bytes(name).decode().replace(*edit).encode(), name)
    published = receipt.without_conditions(protocol)
    assert {"liquids", "conditions", "stimuli", "methods"}.isdisjoint(published)
    blocks = published["blocks"].values()
    assert {"conditions", "standard", "stimulus", "standards", "method"}.isdisjoint(
        key for table in blocks for key in table
    )
    assert {block: table["codes"] for block, table in published["blocks"].items()} == codes
    assert [table["compares"] for table in blocks] == compares
    assert [(table["order"], table.get("slots"), table["questionnaire"]) for table in blocks] == orders
    for table in blocks:
        assert published["questionnaires"][table["questionnaire"]]["items"]
    assert "0.321" not in json.dumps(published)
    assert not any("modulus" in design for design in published.get("designs", {}).values())


@pytest.mark.parametrize(
    "name", ["versions", "device", "screens", "clock", "protocol", "motors_masked", "outlets", "outlets_lost", "video"]
)
def test_a_section_of_a_receipt_is_a_table_and_others_are_of_their_kind(tmp_path: Path, name: str) -> None:
    path = tmp_path / "receipt.json"
    wrong = [(name, 7), (name, [1]), ("plug_ins", {}), ("resumed", "x"), ("started_at", "noon"), ("ended_at", 7)]
    for field, value in wrong:
        receipt.write(path, {"key_hash": "a" * 64, field: value})
        with pytest.raises(StoreError, match=f"is not a receipt \\({field} is "):
            receipt.read(path)
    valid = {"key_hash": "a" * 64, name: {"b": 1}, "plug_ins": [], "resumed": [{}], "started_at": AT, "ended_at": None}
    receipt.write(path, valid)
    assert receipt.read(path) == valid
    path.write_text('{"seed": 1}', encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match=r"is not a receipt \(no key_hash\): restore it from a backup$"):
        receipt.read(path)


@pytest.mark.parametrize(
    ("fields", "at"),
    [
        ({}, "start"),
        ({"resumed": [{"at": "later"}]}, "start"),
        ({"resumed": [{"at": "later"}, {"at": "last"}], "screens": {"steps": 3}}, "later"),
        ({"resumed": [], "screens": {"steps": 3}}, "start"),
    ],
)
def test_a_session_began_when_a_person_did(fields: dict[str, Any], at: str) -> None:
    assert receipt.began_at({"started_at": "start", **fields}) == at


def test_the_delay_error_of_a_force_is_that_of_its_delay() -> None:
    summary = {"delay_error_mean_ms": 3.0, "value_delivered": 47.0}
    errors = [
        delay_error_ms(Stimulated("oil", vary=vary, value=40.0), summary) for vary in ("delay_ms", "force_delay_ms")
    ]
    assert errors == [3.0, 7.0]
    assert delay_error_ms(Stimulated("oil", vary="force_delay_ms", value=40.0), {"delay_error_mean_ms": 3.0}) is None


def test_all_recordings_are_lost_with_the_thread_that_writes_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = Recorder(tmp_path, {})
    recorder._expected = {(3, 1, None): None, (4, 2, 1): None}
    monkeypatch.setattr(recorder, "_process_queue", refuse)
    with pytest.raises(OSError, match="No space"):
        recorder._run_writer()
    lost = recorder.collect_results()
    assert [(line.trial, line.attempt, line.interval) for line in lost] == [(3, 1, None), (4, 2, 1)]
    assert {line.reason for line in lost} == {"its thread ended (OSError: [Errno 28] No space left on device)"}
    assert (recorder._waiting, recorder.thread) == (0, None)


def test_tables_are_written_and_read_cell_by_cell(tmp_path: Path) -> None:
    table = np.rec.fromrecords([(0.1, 2.5), (-3.0, 4e-7)], names="time_s,force_n")
    csv_files.write_columns(tmp_path / "t.csv", table)
    assert (tmp_path / "t.csv").read_text("utf-8") == "time_s,force_n\n0.1,2.5\n-3.0,4e-07\n"
    table.force_n[1] = np.inf
    with pytest.raises(StudyError, match=r"other.csv was not written, because force_n is inf in row 2; it must"):
        csv_files.write_columns(tmp_path / "other.csv", table)
    assert not (tmp_path / "other.csv").exists()
    names = [csv_files.Column("a", "integer", "first", minimum=1), csv_files.Column("b", "text", "second")]
    assert list(csv_files.table_problems(b"a,c\n1,x\n", names)) == ["columns are missing: b", "columns are unknown: c"]
    assert list(csv_files.table_problems(b"b,a\nx,1\n", names)) == ["columns are in a different order or duplicated"]
    assert [text.partition(":")[0] for text in csv_files.table_problems(b"a,b\n1,x\n0,y\n-1,z\n", names)] == [
        "row 3, a"
    ]
    assert list(csv_files.table_problems(b"a,b\n1,x\n2,y,3\n", names)) == ["row 3 has 3 cells, not 2"]
    assert names[0].variable == {"@type": "PropertyValue", "name": "a", "description": "first", "minValue": 1}


@pytest.mark.parametrize(
    ("act", "sentence"),
    [
        (lambda at: atomic.flush_entry(at / "b"), "{at}/b was written, but the disk did not confirm it (No space"),
        (lambda at: atomic.copy_folder(at / "a", at / "b"), "{at}/b cannot be written (No space left on device): free"),
        (atomic.remove_temporary_files, "{at}/{half} cannot be written (No space left on device): free"),
        (lambda at: atomic.is_there(at / "b"), "{at}/b cannot be read (No space left on device): "),
        (lambda at: blinding.reveal(at, "AB", "why"), "{at} is not a study folder (key.sealed is missing): specify"),
        (lambda at: _protocol_error(at / "r"), "{at}/r does not contain 'scene': restore it from a backup"),
        (
            lambda at: _raise(atomic.cannot_write(at / "r" / "b", FileNotFoundError(2, "No path"))),
            "{at}/r/b cannot be written (there is a file where a folder is needed): ",
        ),
        (lambda at: receipt.read(at / "r"), "{at}/r is not a receipt (Expecting value"),
    ],
)
def test_a_message_names_the_file_and_then_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, act: Callable[[Path], Any], sentence: str
) -> None:
    half = atomic.temporary_path(tmp_path / "a")
    half.write_bytes(b"")
    (tmp_path / "r").write_bytes(b"[")
    if "No space" in sentence:
        for name in ("sync_folder", "shutil.copytree"):
            monkeypatch.setattr(f"study_app.store.files.atomic.{name}", refuse)
        monkeypatch.setattr(Path, "unlink", refuse)
        if "read" in sentence:
            monkeypatch.setattr(Path, "stat", refuse)
    with pytest.raises(StoreError) as error:
        act(tmp_path)
    monkeypatch.undo()
    message = str(error.value).replace(os.sep, "/")
    assert message.startswith(sentence.format(at=tmp_path.as_posix(), half=half.name))


def _raise(error: Exception) -> None:
    raise error


def _protocol_error(path: Path) -> None:
    with blinding.protocol_errors(path):
        raise KeyError("scene")


def test_names_of_new_folders_are_numbered(tmp_path: Path) -> None:
    assert kept_pilot_folder(tmp_path, "demo") == tmp_path / "demo-pilot-1"
    for number in (1, 2, 4):
        (tmp_path / f"demo-rehearsal-{number}").mkdir()
    assert rehearsal_folder(tmp_path, "demo") == tmp_path / "demo-rehearsal-3"
    with suppress(StoreError):
        atomic.copy_folder(tmp_path / "demo-rehearsal-1", tmp_path / "copy")
    assert (tmp_path / "copy").is_dir()
    assert data_folder().name


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Sessions, pilots and rehearsals with two contents of a study's file, in the folders that each kind has."""
    sessions = (
        ("demo", "P001", "a", "2026-03-01", {}),
        ("demo", "P002", "b", "2026-03-04", {"saved_by": "AK"}),
        ("demo", "P003", "b", "2026-03-03", {"saved_by": "BL"}),
        ("demo-pilot", "pilot", "a", "2026-03-05", {"pilot": True}),
        ("demo-pilot-1", "pilot", "a", "2026-03-02", {"pilot": True, "simulated": True}),
        ("demo-rehearsal-2", "P001", "b", "2026-03-09", {"simulated": True}),
        ("demo-other-1", "P001", "a", "2026-03-08", {}),
    )
    for folder, participant, content, day, fields in sessions:
        items = [{"id": "thick"}, {"id": "warm"}] if content == "a" else [{"id": "thick"}]
        protocol = {"study": {"version": f"0.{content}"}, "questionnaires": {"feel": {"items": items}}}
        field_values = {
            "key_hash": "c" * 64,
            "protocol_hash": content * 64,
            "protocol": protocol,
            "started_at": f"{day}T09:00:00+01:00",
            **fields,
        }
        path = tmp_path / folder / "data" / f"sub-{participant}" / "ses-01" / "receipt.json"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps(field_values), encoding="utf-8", newline="\n")
    return tmp_path


def test_runs_of_a_study_are_counted_by_kind_and_content(runs: Path) -> None:
    listed_runs = study_runs.runs_of_study(runs, "demo")
    facts = [(run.hash[0], run.version, run.sessions, run.pilots, run.rehearsals, run.last[:10]) for run in listed_runs]
    assert facts == [
        ("a", "0.a", 1, 2, 0, "2026-03-05"), ("b", "0.b", 2, 0, 1, "2026-03-09"),
    ]  # fmt: skip
    assert study_runs.recorded_items(listed_runs) == {("feel", "thick"): 3, ("feel", "warm"): 1}
    assert study_runs.runs_of_study(runs, "../demo") == ()
    contents = study_runs.recorded_contents(runs / "demo")
    assert [content.name for content in contents] == [
        "0.a (first session: P001, 2026-03-01)", "0.b (first session: P003, 2026-03-03; saved by BL)",
    ]  # fmt: skip


def test_the_original_and_the_versions_of_a_study_are_kept_by_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_DATA", str(tmp_path / "data"))
    file, other = tmp_path / "copy.toml", tmp_path / "other.toml"
    study_settings.keep_original(file, "rek2024")
    assert (study_settings.kept_original(file), study_settings.kept_original(other)) == ("rek2024", "")
    (path,) = (tmp_path / "data" / "settings").glob("*.json")
    assert json.loads(path.read_text("utf-8")) == {"file": str(file.resolve()), "copy_of": "rek2024"}
    study_settings.keep_original(file)
    assert study_settings.kept_original(file) == ""
    monkeypatch.setattr(study_versions, "load_or_default", lambda: (SimpleNamespace(operator="AK"), None))
    for origin, text in (("saved", b"one"), ("draft", b"two"), ("found", b"one")):
        study_versions.keep_version(file, text, origin)
    kept_files = study_versions.kept_versions(file)
    assert [(kept_file.origin, kept_file.by, kept_file.hash) for kept_file in kept_files] == [
        ("saved", "AK", study_versions.content_hash(b"one")), ("draft", "", study_versions.content_hash(b"two")),
    ]  # fmt: skip
    assert [study_versions.saver_of(study_versions.content_hash(text)) for text in (b"two", b"one", b"3")] == [
        "", "AK", "",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("participant", "sentence"),
    [
        ("P-7", "participant ID 'P-7' cannot be used: use at most 32 letters"),
        ("p" * 33, f"participant ID '{'p' * 33}' cannot be used: use at most 32 letters"),
        ("pilot", "participant ID 'pilot' is reserved for pilot sessions"),
    ],
)
def test_an_invalid_participant_id_is_refused_with_the_permitted_form(participant: str, sentence: str) -> None:
    with pytest.raises(StoreError, match=f"^{sentence}"):
        begin.check_participant(participant)
    begin.check_participant("p" * 32)
    begin.check_participant("pilot", pilot=True)


@pytest.mark.parametrize(
    ("names", "sentence"),
    [
        ((), "no sites were specified"),
        (("a", "B"), "site 'B' has already been merged"),
        (("c", "C"), "site 'C' is specified twice"),
        (("c", "d-e"), "'d-e' cannot be used as the name of a site"),
        (("c", "d" * 17), f"'{'d' * 17}' cannot be used as the name of a site"),
    ],
)
def test_names_of_sites_differ_from_those_merged_and_from_each_other(
    tmp_path: Path, names: tuple[str, ...], sentence: str
) -> None:
    there = merged.Site(name="b", merged_at=AT, key_hash="a" * 64, sessions=1)
    study = merged.Merged(tmp_path, "stirring", "c" * 64, (there,))
    with pytest.raises(StoreError, match=f"^{sentence}"):
        merge._check_names(dict.fromkeys(names, tmp_path), study)
    merge._check_names({"a": tmp_path, "c" * 16: tmp_path}, study)
    merge._check_names({"a": tmp_path, "b": tmp_path}, None)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"study": "other"}, f"site south ran the protocol other with SHA-256 {'c' * 64}, but site north ran stirring"),
        ({"protocol_hash": "d" * 64}, f"site south ran the protocol stirring with SHA-256 {'d' * 64}, but site north"),
        ({"pilot": True}, "site south contains pilot sessions, but site north contains real sessions: only"),
        ({"key": SimpleNamespace(drawn="seed")}, "site south contains rehearsals, but site north contains real sess"),
        ({"pilot": None, "protocol_hash": ""}, ""),
        ({"begun": {"2": Path("south/2"), "1": Path("south/1")}}, f"{Path('south/1')} is a copy of {Path('north/1')}"),
    ],
)
def test_sites_of_another_kind_and_sessions_of_two_sites_are_not_merged(changed: dict[str, Any], sentence: str) -> None:
    alike = {"study": "stirring", "protocol_hash": "c" * 64, "pilot": False, "key": SimpleNamespace(drawn="system")}
    south = alike | {"begun": {"2": Path("south/2")}} | changed
    sources: Any = (
        SimpleNamespace(name="north", begun={"1": Path("north/1")}, **alike),
        SimpleNamespace(name="south", **south),
    )
    with pytest.raises(StoreError, match=f"^{escape(sentence)}") if sentence else nullcontext():
        merge._check_same_protocol(sources, "c" * 64)
        merge._check_sessions(sources)


def test_the_hash_of_a_receipt_covers_the_fields_that_never_change() -> None:
    fields = {"participant": "P7", "status": "unfinished", "resumed": [], "device": {"name": "falcon", "serial": "7"}}
    later = {
        "status": "completed",
        "reason": "r",
        "ended_at": AT,
        "resumed": [{"at": AT}],
        "outlets_lost": {"LSL": "1"},
    }
    assert receipt.digest(fields | later) == receipt.digest(dict(reversed(fields.items())))
    for changed in ({"participant": "P8"}, {"device": {"name": "falcon", "serial": "8"}}):
        assert receipt.digest(fields | changed) != receipt.digest(fields)


def test_temporary_files_of_a_name_are_not_those_of_a_longer_one(tmp_path: Path) -> None:
    halves = [atomic.temporary_path(tmp_path / name) for name in ("a", "ab", "a.csv")]
    for half in (*halves, tmp_path / ".a.tmp", tmp_path / ".a.0123456.tmp"):
        half.write_bytes(b"")
    assert atomic.temporary_files(tmp_path, "a") == (halves[0],)
    assert set(atomic.temporary_files(tmp_path)) == set(halves)


@pytest.mark.parametrize(
    ("row", "sentence"),
    [
        (f"P1,one,2,AB,rang,{AT},true", f"line 3: 'P1,one,2,AB,rang,{AT},true' is not a valid exclusion"),
        (f"P1,1,2,AB,rang,{AT},perhaps", f"line 3: 'P1,1,2,AB,rang,{AT},perhaps' is not a valid exclusion"),
        (f"P1,1,AB,rang,{AT},true", "line 3: has 6 fields"),
    ],
)
def test_an_invalid_exclusion_is_quoted_with_its_line(tmp_path: Path, row: str, sentence: str) -> None:
    path = tmp_path / "exclusions.csv"
    path.write_text(f"{COLUMNS}P2,1,n/a,AB,rang,{AT},TRUE\n{row}\n", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError) as error:
        exclusions.exclusions(tmp_path)
    assert str(error.value).startswith(f"{path}, {sentence}")
    path.write_bytes(b"\xff")
    with pytest.raises(StoreError, match=f"^{escape(str(path))}: "):
        exclusions.exclusions(tmp_path)


def test_a_key_of_another_session_is_named_with_that_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "data" / "sub-P1" / "ses-01"
    path.mkdir(parents=True)
    (tmp_path / "blinding").mkdir()
    key: Any = SimpleNamespace(hash="a" * 64, codes={})
    monkeypatch.setattr(blinding, "read_key", lambda _folder: key)
    assert blinding.verified_key(StudyFolder(tmp_path)) is key, "a session without any proof does not block others"
    assert blinding.revealed_key(tmp_path) is None
    (path / "receipt.json").write_text(json.dumps({"key_hash": "b" * 64}), encoding="utf-8", newline="\n")
    with pytest.raises(
        StoreError,
        match=f"^{escape(str(tmp_path / 'blinding' / 'key.sealed'))} is not the key for session {escape(str(path))} ",
    ):
        blinding.verified_key(StudyFolder(tmp_path))
    (path / "receipt.json").write_text(json.dumps({"key_hash": "a" * 64}), encoding="utf-8", newline="\n")
    blinding.reveal(tmp_path, "AB", "analysis")
    assert blinding.revealed_key(tmp_path) is key
    (record,) = blinding.reveals(tmp_path)
    assert [record[name] for name in ("by", "reason", "key_hash")] == ["AB", "analysis", "a" * 64]
    for by in ("AB", "CD", "AB"):
        blinding.reveal(tmp_path, by, "analysis")
    assert [record["by"] for record in blinding.reveals(tmp_path)] == ["AB", "CD", "AB"], "the first one only repeats"
    assert blinding.sealed_hash(tmp_path) is None


def test_values_within_the_limits_are_valid_and_missing_values_unknown() -> None:
    limits = {"lateness_ms": 2.0, "withheld_percent": 5.0}
    measured = ({"lateness_p99_ms": 1.9}, {"lateness_p99_ms": 2.1}, {"worst_gap_ms": 99.0}, {})
    assert [is_within_limits(row, limits) for row in measured] == [True, False, None, None]
    assert broken_limits({"lateness_p99_ms": 2.1, "withheld_share": 0.06}, limits) == tuple(limits)
