"""Before unblinding no table tells a condition; after it every table is what an open study's would have been."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.protocol.model import Protocol, StudyHead
from study_app.store import unblinding as module
from study_app.store.blinded.blinding import open_events, open_or_draw_key, reveal
from study_app.store.exclusions import Exclusion
from study_app.store.files.columns import SEALED, TRIALS
from study_app.store.files.csv_files import header, unsealed_columns
from study_app.store.files.folders import REBUILT, StudyFolder
from study_app.store.journals import journal, journal_events
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import rebuild_session, reopen_store
from study_app.store.tables.study_files import description_bytes
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from tests.journal_lines import event_of, raw
from tests.store.conftest import SOURCE, Attend, Start, ticking_clock
from tests.store.forging import Lines, cover_up, forge

AT = "2026-03-02T09:30:00.000+01:00"


def names(path: Path) -> set[str]:
    with path.open(encoding="utf-8", newline="") as file:
        return set(next(csv.reader(file)))


def tables_in(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*.csv")}


def sound(folder: Path) -> bool:
    findings = verify_study(folder)
    assert not [str(error) for error in findings.errors]
    return findings.is_sound


def test_tables_of_a_sealed_study_lack_the_sealed_columns(tmp_path: Path, finished: Start) -> None:
    store = finished()
    folder = tmp_path / "study"
    assert names(store.folder.table("brackish", "trials")) == set(header(unsealed_columns(TRIALS)))
    for path in folder.rglob("*.*"):
        if path.is_file():
            content = path.read_bytes()
            assert not [name for name in SEALED if f'"{name}"'.encode() in content], path
    assert sound(folder)


@pytest.mark.slow
def test_an_unblinded_study_equals_one_that_was_never_blinded(
    tmp_path: Path, protocol: Protocol, start: Start, attend: Attend
) -> None:
    """Two studies with the same key, one opened before and one after its sessions, have identical tables."""
    folders = [tmp_path / name / "study" for name in ("before", "after")]
    for folder in folders:
        folder.mkdir(parents=True)
        open_or_draw_key(folder, protocol, iter([0.5, *(number / 97 % 1 for number in range(1000))]).__next__)
    reveal(folders[0], "AB", "no blinding")
    for folder in folders:
        for name in ("P007", "P008"):
            store = start(name, results=folder, clock=ticking_clock(), simulated=True)
            attend(store)
            store.append(
                journal_events.TrialStarted(
                    trial=6, attempt=1, block="b", phase="main", part=2, index=9, of=9, code="D1"
                )
            )
            store.append(event_of("trial_ended", trial=6, attempt=1, outcome="complete", withheld_share=0.9))
            store.finish("completed")
    before, sealed_tables = (tables_in(folder) for folder in folders)
    assert before.keys() == sealed_tables.keys()
    assert before != sealed_tables
    steps: list[tuple[str, float]] = []
    unblinding = unblind(folders[1], "AB", "done", lambda step, step_number: steps.append((step, step_number)))
    assert steps == [
        ("opening session 1 of 2", 0.0), ("opening session 2 of 2", 1 / 3), ("writing the tables of the study", 2 / 3),
    ]  # fmt: skip
    assert unblinding.left == ()
    assert set(unblinding.codes) == {"practice", "liquids", "delays"}
    assert tables_in(folders[1]) == before
    assert b",0.9," in before["data/sub-P007/ses-01/subject-P007_session-01_task-brackish_description-trials_data.csv"]
    assert b",invalid,n/a\n" in before["data/study-brackish_description-participants_data.csv"]
    description, ours = (StudyFolder(folder).description.read_bytes() for folder in folders)
    assert ours == description
    assert sound(folders[0])
    assert sound(folders[1])
    assert not list(folders[1].rglob(REBUILT)), "unblinding makes no proof again"


@pytest.mark.slow
def test_a_repeated_unblinding_finishes_an_interrupted_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, finished: Start
) -> None:
    """Ended between a session's table and its checksum."""
    for name in ("P007", "P008"):
        finished(name)
    folder = tmp_path / "study"

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "replace_checksums", killed)
    with pytest.raises(KeyboardInterrupt):
        unblind(folder, "AB", "done")
    monkeypatch.undo()
    monkeypatch.setattr("os.fsync", lambda _: None)
    assert not verify_study(folder).is_sound
    assert not module.is_unblinded(folder)
    assert unblind(folder, "AB", "again").left == ()
    assert module.is_unblinded(folder)
    assert sound(folder)
    files_before = tables_in(folder)
    assert unblind(folder, "AB", "once more").left == ()
    assert [row["reason"] for row in module.reveals_of(folder)] == ["done", "again", "once more"]
    assert tables_in(folder) == files_before


@pytest.mark.parametrize(
    "change", [lambda table: table.replace(b"complete", b"repaired", 1), lambda table: table[:-2] + b"x\n"]
)
def test_tables_of_a_resumed_session_are_completed_unless_they_were_changed(
    tmp_path: Path, start: Start, attend: Attend, change: Callable[[bytes], bytes]
) -> None:
    """The first table lacks half its last line, as after a crash; in the second the first or last cell was changed."""
    with start() as store:
        attend(store)
    StudyFolder(tmp_path / "study").session("P009", 1).path.mkdir(parents=True)  # of a session that never began
    behind, changed = (store.folder.table("brackish", name) for name in ("responses", "trials"))
    by_hand = change(changed.read_bytes())
    assert by_hand != changed.read_bytes()
    changed.write_bytes(by_hand)
    whole = behind.read_bytes()
    behind.write_bytes(whole[: whole.rindex(b",")])
    (left,) = unblind(tmp_path / "study", "AB", "done").left
    folder = store.folder.path
    assert left == f"{changed} differs from the journal, so it was not changed: run liquid-study rebuild {folder}"
    assert changed.read_bytes() == by_hand
    assert len(behind.read_bytes().splitlines()) == len(whole.splitlines())


def test_tables_that_say_more_than_a_cut_journal_are_left_with_the_remedy(
    tmp_path: Path, start: Start, attend: Attend
) -> None:
    """`rebuild` would refuse them, since the journal lacks answers."""
    with start() as store:
        attend(store)
    lines = store.folder.journal.read_bytes().splitlines(keepends=True)
    store.folder.journal.write_bytes(b"".join(lines[: len(lines) // 2]))
    tables = [store.folder.table("brackish", name) for name in ("responses", "trials")]
    before = [path.read_bytes() for path in tables]
    left = unblind(tmp_path / "study", "AB", "done").left
    assert left == tuple(
        f"{path} differs from the journal, so it was not changed: restore the journal from a backup" for path in tables
    )
    assert [path.read_bytes() for path in tables] == before


def test_a_session_continues_to_seal_after_unblinding(
    tmp_path: Path, protocol: Protocol, start: Start, attend: Attend
) -> None:
    """Events stay sealed after the key was opened; the tables then contain all columns."""
    with start() as store:
        attend(store)
    unblind(tmp_path / "study", "AB", "done")
    again = reopen_store(store.folder.path, protocol, SOURCE, operator="AB", device={"name": "scripted"}, screens={})
    fields = {"block": "delays", "phase": "main", "part": 2, "index": 2, "of": 2, "code": "D1"}
    again.append(journal_events.TrialStarted(trial=6, attempt=1, **fields))
    again.append(event_of("trial_ended", trial=6, attempt=1, outcome="complete", force_mean_n=1.25))
    again.finish("completed")
    assert journal.read(again.folder.journal)[-2].sealed
    assert b",1.25," in again.folder.table("brackish", "trials").read_bytes().splitlines()[-1]
    assert sound(tmp_path / "study")


def in_clear(store: SessionStore, study: StudyHead) -> None:
    """Turn a finished session into one of an earlier version, which did not seal fields."""
    lines = raw(open_events(journal.read(store.folder.journal), store.key))
    del lines[0]["measures_sealed"]

    def clear(held: Lines) -> None:
        held[:] = lines

    forge(store.folder.journal, clear)
    cover_up(store.place.study_folder.path)
    store.place.study_folder.description.write_bytes(description_bytes(study, sealed=False))


@pytest.mark.slow
def test_a_study_of_an_earlier_version_stays_sound_sealed_and_opened(
    tmp_path: Path, protocol: Protocol, finished: Start
) -> None:
    store = finished()
    in_clear(store, protocol.study)
    folder = tmp_path / "study"
    assert names(store.folder.table("brackish", "trials")) == set(header(TRIALS))
    assert sound(folder)
    assert rebuild_session(store.folder.path).rewritten == ()
    later = finished("P008")
    assert not SEALED & names(later.folder.table("brackish", "trials"))
    assert sound(folder)
    content = store.folder.table("brackish", "trials").read_bytes()
    assert unblind(folder, "AB", "done").left == ()
    assert store.folder.table("brackish", "trials").read_bytes() == content
    assert names(later.folder.table("brackish", "trials")) == set(header(TRIALS))
    assert sound(folder)


@pytest.fixture
def sites(tmp_path: Path) -> Path:
    """A merged study of two sites, of which the keys were not opened."""
    fields = {"merged_at": AT, "key_hash": "a" * 64, "sessions": 1, "withdrawals": 0}
    for name in ("north", "south"):
        (tmp_path / "both" / "sites" / name / "blinding").mkdir(parents=True)
    field_values = {"format": 2, "study": "stirring", "protocol_hash": "c" * 64}
    field_values |= {"sites": [{"name": name, **fields} for name in ("north", "south")]}
    (tmp_path / "both" / "sites.json").write_text(json.dumps(field_values), encoding="utf-8", newline="\n")
    return tmp_path / "both"


def test_a_merged_study_is_opened_site_by_site(sites: Path) -> None:
    records = {
        site: {"at": AT, "by": by, "reason": f"{site} is done", "key_hash": "a" * 64}
        for site, by in (("south", "CD"), ("north", "AB"))
    }
    for site, is_open in (("south", False), ("north", True)):
        assert not module.has_opened_keys(sites)
        path = StudyFolder(sites / "sites" / site).reveals
        path.write_text(f"{json.dumps(records[site])}\n", encoding="utf-8", newline="\n")
        assert module.has_opened_keys(sites / "sites" / site)
        assert module.has_opened_keys(sites) == is_open
    assert module.reveals_of(sites) == tuple({"site": site, **records[site]} for site in ("north", "south"))
    assert module.reveals_of(sites / "sites" / "south") == (records["south"],)
    assert not module.is_unblinded(sites), "the columns are not described yet"


def test_all_keys_are_verified_before_the_first_is_opened_and_exclusions_name_the_site(
    sites: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Any] = []

    def fake_unblind(folder: Path, *arguments: object) -> module.Unblinded:
        calls.append((folder.name, *arguments))
        row = Exclusion(
            participant="P7", session=2, trial=None, rule_or_person=module.RULE, reason=folder.name, excluded_at=AT
        )
        return module.Unblinded({"b": {"A1": folder.name}}, (f"{folder.name} is left",), (row,))

    monkeypatch.setattr(module, "unblind", fake_unblind)
    monkeypatch.setattr(module, "verified_key", lambda study: calls.append(study.path.name))
    unblinding = module.unblind_folder(sites, "AB", "closed", print)
    words = ("AB", "closed", print)
    assert calls == ["north", "south", ("north", *words), ("south", *words)]
    assert {prefix: (it.codes, it.left) for prefix, it in unblinding.items()} == {
        f"{site}-": ({"b": {"A1": site}}, (f"{site} is left",)) for site in ("north", "south")
    }
    rows = [row for result in unblinding.values() for row in result.excluded]
    assert [(row.participant, row.session, row.reason) for row in rows] == [
        ("north-P7", 2, "north"), ("south-P7", 2, "south"),
    ]  # fmt: skip
    calls.clear()
    assert list(module.unblind_folder(sites / "sites" / "south", "AB", "closed", print)) == [""]
    assert calls == [("south", *words)]


def test_catch_trials_are_judged_block_by_block(finished: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    session, catch = finished().folder, SimpleNamespace(wrong_most=0.25)
    blocks = {name: SimpleNamespace(id=name, catch=catch) for name in ("easy", "hard")}
    titles = {name: {"phase": "main", "title": {"en": f"{name} pairs"}, "catch": 1} for name in blocks}
    published = {"study": {"languages": ["en"]}, "blocks": titles}
    missed = {1: ("easy", 0), 2: ("easy", 0), 3: ("easy", 0), 4: ("hard", 1), 5: ("hard", 0), 6: ("hard", 1)}
    missed[7] = ("easy", 1)  # one of four is just permitted
    lines = [event_of("trial_started", trial=number, block=block) for number, (block, _) in missed.items()]
    results = [SimpleNamespace(trial=number, catch=True, correct=not wrong) for number, (_, wrong) in missed.items()]
    monkeypatch.setattr(module.receipt, "read", lambda _: {"protocol": published})
    monkeypatch.setattr(module, "complete_protocol", lambda *_: SimpleNamespace(blocks=blocks))
    monkeypatch.setattr(module, "open_events", lambda *_: lines)
    monkeypatch.setattr(module, "trial_results", lambda *_: results)
    key: Any = None
    assert list(module._missed_catch_trials(session, key)) == [
        "2 of 3 catch trials in “hard pairs” were answered incorrectly (at most 25 % are permitted)"
    ]
