"""A study that is open: undo and redo, its draft, and the versions that were run."""

import itertools
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.designer.document import document
from study_app.designer.document.document import (
    Document,
    check_version,
    next_version,
    open_file,
    open_new,
    open_unsaved,
    version_standing,
)
from study_app.designer.document.fields import rows
from study_app.designer.document.study import read_study
from study_app.designer.document.toml_edits import Insert, Set
from study_app.designer.document.toml_text import Refused
from study_app.errors import ProtocolError, StoreError, StudyError
from study_app.protocol.load import load, parse
from study_app.protocol.source.files import protocol_hash, shipped
from study_app.store.receipt import without_conditions
from study_app.store.versions.drafts import (
    REST_S,
    Draft,
    Keeper,
    delete_draft,
    draft_of,
    drafted_files,
    unsaved_files,
    write_draft,
)
from study_app.store.versions.study_runs import Run, keep_run_content, runs_of_study
from study_app.store.versions.study_versions import (
    ChangedOutsideError,
    content_hash,
    kept_content,
    kept_versions,
    save_study,
)
from study_app.user_folder import data_folder
from tests.designer.document.grown import PROTOCOLS
from tests.platforms import needs_links

DEMO = read_study((PROTOCOLS / "demo.toml").read_bytes())


@pytest.mark.parametrize("name", shipped())
def test_a_study_equals_the_protocol_that_check_reads(name: str) -> None:
    study = read_study((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS)
    assert study.protocol == load(name)
    assert study.problems == ()


@pytest.mark.parametrize(("old", "new"), [('liquid = "thin"', 'liquid = "thn"'), ("format = 2", "format = ")])
def test_problems_equal_those_of_check(old: str, new: str) -> None:
    source = DEMO.text.replace(old, new).encode()
    with pytest.raises(ProtocolError) as raised:
        parse(source, "demo")
    assert read_study(source).problems == raised.value.problems


def test_steps_of_one_key_join_until_the_keyboard_rests(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 0.0
    monkeypatch.setattr("study_app.designer.document.document.time", SimpleNamespace(perf_counter=lambda: now_s))
    document = Document(DEMO)
    for now_s, key in ((1.0, "title"), (1.5, "title"), (3.0, "title"), (3.1, "other"), (3.2, None), (3.3, None)):
        document.edit("Type", Set(("study", "title"), f"New at {now_s}"), key=key)
    assert len(document.done) == 5
    for _ in range(5):
        document.undo()
    assert document.study.text == DEMO.text


def test_a_step_of_several_edits_is_undone_and_redone_as_one() -> None:
    document = Document(DEMO, ("blocks", "liquids"))
    edits = Set(("study", "title"), "New"), Set(("study", "version"), "9.9"), Insert(("sequence", 0), "liquids")
    document.edit("All three", *edits, select=("study",))
    after = document.study.text
    assert [document.study.document["study"][name] for name in ("title", "version")] == ["New", "9.9"]
    document.undo()
    assert (document.study.text, document.selected) == (DEMO.text, ("blocks", "liquids"))
    document.redo()
    assert (document.study.text, document.selected) == (after, ("study",))


def title_of(document: Document) -> Any:
    return document.study.document["study"]["title"]


def edit_title(document: Document, title: str, **options: Any) -> None:
    document.edit(title, Set(("study", "title"), title), **options)


def test_undo_and_redo_keep_every_step_and_an_edit_clears_redo() -> None:
    document = Document(DEMO, ("tasks",))
    for title, selected in (("One", ("study",)), ("Two", ("scene",)), ("Three", None)):
        edit_title(document, title, select=selected, key="title")
        document.end_step()
    assert [(step.title, step.before, step.after) for step in document.done] == [
        ("One", ("tasks",), ("study",)), ("Two", ("study",), ("scene",)), ("Three", ("scene",), ("scene",))
    ]  # fmt: skip
    states = []
    for act in (
        document.undo,
        document.undo,
        document.redo,
        document.undo,
        document.undo,
        document.undo,
        document.redo,
    ):
        act()
        states.append((title_of(document), document.selected, len(document.done), len(document.undone)))
    first = DEMO.document["study"]["title"]
    assert states == [
        ("Two", ("scene",), 2, 1), ("One", ("study",), 1, 2), ("Two", ("scene",), 2, 1), ("One", ("study",), 1, 2),
        (first, ("tasks",), 0, 3), (first, ("tasks",), 0, 3), ("One", ("study",), 1, 2),
    ]  # fmt: skip
    edit_title(document, "Four", key="title")
    assert (len(document.done), document.undone) == (2, [])
    document.redo()
    assert title_of(document) == "Four"
    edit_title(document, "Five", select=("limits",), key="title")
    assert [(step.title, step.before, step.after) for step in document.done[1:]] == [("Five", ("study",), ("limits",))]
    document.undo()
    edit_title(document, "Six", key="title")
    assert [step.title for step in document.done] == ["One", "Six"], "an undone step is closed"
    document.undo()
    assert (title_of(document), document.selected) == ("One", ("study",))


def test_the_last_500_steps_can_be_undone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(document, "_MAX_STEPS", 3)
    edited_document = Document(DEMO)
    for number in range(5):
        edit_title(edited_document, f"Title {number}")
    for _ in range(5):
        edited_document.undo()
    assert (title_of(edited_document), len(edited_document.undone)) == ("Title 1", 3)


def test_a_text_and_edits_of_it_are_one_step() -> None:
    document = Document(DEMO)
    document.edit("Both", Set(("study", "version"), "7"), text=DEMO.text.replace('"A first look"', '"Typed"', 1))
    assert (title_of(document), document.version, document.title, document.name) == ("Typed", "7", "Typed", "demo")
    document.undo()
    assert document.study.text == DEMO.text
    document.edit("Text", text=re.sub(r"(?m)^version = .*\n", "", DEMO.text, count=1))
    assert (document.version, len(document.done)) == ("1", 1)


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a study of the workspace."""
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    file = tmp_path / "protocols" / "own.toml"
    file.parent.mkdir()
    file.write_text(TEXT.replace('name = "demo"', 'name = "own"'), encoding="utf-8", newline="\n")
    return file


def test_a_draft_is_kept_while_the_text_differs_from_the_file_and_comes_back(own: Path, tmp_path: Path) -> None:
    document = open_file(own, tmp_path / "results")
    assert (document.edited, document.draft, document.kept, document.selected) == (
        False,
        None,
        None,
        ("pages", "welcome"),
    )
    edit_title(document, "Draft", select=("tasks", "reach"))
    document.note_edit(5.0)
    assert (document.edited, document.write_draft(5.0 + REST_S - 0.01), document.kept) == (True, False, None)
    assert document.write_draft(5.0 + REST_S)
    assert document.kept is not None
    again = open_file(own, tmp_path / "results")
    assert (title_of(again), again.selected, [step.title for step in again.done]) == (
        "Draft", ("tasks", "reach"), ["Restore the draft"]
    )  # fmt: skip
    assert (again.draft.text, again.base) == (document.study.text, document.base)  # type: ignore[union-attr]
    again.undo()
    assert again.study.text == own.read_text("utf-8")
    again.note_edit(0.0)
    assert (draft_of(own), again.kept) == (None, None), "the text is the file's"
    edit_title(again, "Draft")
    again.note_edit(0.0)
    again.write_draft()
    again.discard_draft()
    assert (again.edited, again.draft, draft_of(own), again.done[-1].title) == (False, None, None, "Discard the draft")
    again.undo()
    assert title_of(again) == "Draft"


def test_changes_of_another_program_are_accepted_or_rejected(own: Path, tmp_path: Path) -> None:
    document, other = open_file(own, tmp_path / "results"), TEXT.replace('"A first look"', '"Other"', 1)
    edit_title(document, "Mine")
    assert not document.changed_outside()
    own.write_text(other, encoding="utf-8", newline="\n")
    assert document.changed_outside()
    document.keep_edits(0.0)
    assert (title_of(document), document.saved, document.changed_outside(), document.edited) == (
        "Mine",
        other,
        False,
        True,
    )
    document.take_file_content()
    assert (title_of(document), document.edited, document.done[-1].title) == ("Other", False, "Use the file's content")
    assert document.base == document.keeper.base == content_hash(other.encode())
    document.undo()
    assert title_of(document) == "Mine"
    own.unlink()
    assert document.changed_outside()
    document.keep_edits(0.0)
    assert (document.base, document.saved, document.changed_outside()) == ("", "", False)
    document.save(())
    assert own.read_text("utf-8") == document.study.text
    assert (document.edited, document.changed_outside(), draft_of(own)) == (False, False, None)
    own.unlink()
    assert Document(DEMO, (), own).changed_outside() is False, "it was never saved"


def test_a_read_only_study_states_the_reason(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = tmp_path / "results"
    assert open_file(shipped()["demo"], results).read_only.startswith("This study ships with the program.")
    edit_title(edited_document := open_file(own, results), "Draft")
    edited_document.note_edit(0.0)
    edited_document.write_draft()
    path = results / "own" / "data" / "sub-P001" / "ses-01"
    path.mkdir(parents=True)
    monkeypatch.setattr(document, "is_open", lambda folder: folder == path)
    reading = open_file(own, results)
    assert reading.read_only == "A session of this study is running. Make a copy, or wait until it has ended."
    assert (reading.draft, reading.edited) == (None, False)
    assert open_file(own, tmp_path / "others").read_only == ""
    monkeypatch.setattr(os, "access", lambda file, how: (file, how) != (own, os.W_OK))
    assert open_file(own, tmp_path / "others").read_only.startswith("You do not have permission to write this file.")


def test_a_copy_takes_the_edits_along_and_leaves_the_original_as_saved(own: Path, tmp_path: Path) -> None:
    document = open_file(own, tmp_path / "results")
    edit_title(document, "Mine", select=("scene",))
    copy = document.copy_as("other")
    assert (copy.name, copy.version, title_of(copy), copy.selected) == ("other", "0.1", "Mine", ("scene",))
    assert (copy.file, copy.base, [step.title for step in copy.done]) == (
        own.with_name("other.toml"), "", ["Mine", "Save as other"]
    )  # fmt: skip
    assert draft_of(copy.file).text == copy.study.text  # type: ignore[union-attr]
    assert (document.edited, title_of(document)) == (False, "A first look")
    unsaved = open_unsaved(copy.file, draft_of(copy.file))  # type: ignore[arg-type]
    assert (unsaved.study.text, unsaved.file, unsaved.base, unsaved.edited) == (copy.study.text, copy.file, "", True)
    assert (unsaved.selected, open_unsaved(copy.file, Draft(text="", base="")).selected) == (("scene",), ("study",))
    copy.discard()
    assert draft_of(copy.file) is None
    new = open_new(DEMO, "fresh")
    assert (new.name, new.version, new.file, new.base) == ("fresh", "0.1", own.with_name("fresh.toml"), "")
    with pytest.raises(Refused, match=r"own\.toml already exists; \"own2\" is free"):
        open_new(DEMO, "own")


def test_a_version_that_was_run_is_not_saved_with_other_content(own: Path, tmp_path: Path) -> None:
    document = open_file(own, tmp_path / "results")
    ran = (Run(hash=content_hash(document.study.source), version="1.1", sessions=2),)
    document.save(ran)
    edit_title(document, "Mine")
    with pytest.raises(Refused, match=r"version 1\.1 has .* content \(2 sessions\): save the study as version 1\.2"):
        document.save(ran)
    standing = document.standing(ran)
    assert (standing.version, standing.conflicts, standing.needs_confirmation) == ("1.2", 2, True)
    assert document.standing(()).needs_confirmation is False
    document.edit("Version", Set(("study", "version"), "1.2"))
    document.save(ran)
    assert kept_content(content_hash(document.study.source)) == document.study.source == own.read_bytes()


def test_an_edit_without_a_change_is_not_a_step() -> None:
    same = Document(DEMO, ())
    same.edit("Same", Set(("format",), 2), select=("study",))
    assert (same.done, same.selected) == ([], ("study",))


def test_a_study_with_a_liquid_file_shows_only_its_own_text(tmp_path: Path) -> None:
    (tmp_path / "thick.toml").write_text(
        "format = 2\n[liquids.any]\ndensity_kg_m3 = 1400\n", encoding="utf-8", newline="\n"
    )
    own = '[liquids.thick]\ndensity_kg_m3 = 1400\neffects = ["drag"]'
    text = DEMO.text.replace(own, '[liquids.thick]\nfile = "thick.toml"')
    study = read_study(text.encode(), tmp_path)
    assert study.protocol is not None
    assert set(study.document) == set(DEMO.document)
    assert study.document["liquids"]["thick"] == {"file": "thick.toml"}
    assert not [row for row in rows(study.document, ("liquids", "thick")) if row.kind == "unknown"]


def test_typed_refuses_half_a_character() -> None:
    with pytest.raises(StudyError, match="incomplete character"):
        DEMO.with_text(DEMO.text + "# \ud800")


def test_files_with_a_draft_are_listed(tmp_path: Path) -> None:
    assert drafted_files() == ()
    for name in ("b.toml", "a.toml"):
        write_draft(tmp_path / name, Draft(text="a = 1\n", base=""))
    (data_folder() / "drafts" / "broken.json").write_text("{", encoding="utf-8", newline="\n")
    assert drafted_files() == (tmp_path.resolve() / "a.toml", tmp_path.resolve() / "b.toml")
    (tmp_path / "within").mkdir()
    write_draft(tmp_path / "within" / "c.toml", Draft(text="c = 3\n", base=""))
    (tmp_path / "b.toml").write_text("b = 2\n", encoding="utf-8", newline="\n")
    assert unsaved_files(tmp_path) == (tmp_path.resolve() / "a.toml",)
    for name in ("a.toml", "within/c.toml"):
        delete_draft(tmp_path / name)
    assert drafted_files() == (tmp_path.resolve() / "b.toml",)


def test_keeper_writes_within_its_rest_however_fast_edits_follow(tmp_path: Path) -> None:
    keeper = Keeper(tmp_path / "a.toml", "")
    written = []
    for tick in range(300):
        now = tick / 100
        keeper.note_edit("x" * tick, (), now)
        if keeper.write_if_due(now):
            written.append(now)
    assert written[0] == REST_S
    assert max(later - earlier for earlier, later in itertools.pairwise(written)) <= REST_S + 0.02
    assert keeper.write()
    assert not keeper.write()
    assert not keeper.write_if_due(99)
    draft = draft_of(tmp_path / "a.toml")
    assert draft is not None
    assert draft.text == "x" * 299
    keeper.note_saved("hash")
    assert draft_of(tmp_path / "a.toml") is None


def test_the_draft_of_another_program_is_kept_as_a_version_and_not_discarded(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    first, second = Keeper(file, ""), Keeper(file, "")
    for keeper, text in ((first, "mine"), (second, "yours"), (first, "mine again")):
        keeper.note_edit(text, (), 0.0)
        keeper.write()
    assert [kept_content(kept.hash) for kept in kept_versions(file)] == [b"mine", b"yours"]
    assert {kept.origin for kept in kept_versions(file)} == {"draft"}
    assert (first.others, second.others) == (1, 1)
    second.note_saved("hash")
    assert draft_of(file) is not None
    first.note_saved("hash")
    assert draft_of(file) is None


def test_a_draft_that_cannot_be_written_stays_due(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keeper = Keeper(tmp_path / "a.toml", "")
    keeper.note_edit("x", (), 0.0)
    monkeypatch.setenv("LIQUID_STUDY_DATA", str(tmp_path / "file"))
    (tmp_path / "file").write_text("in the way", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match="there is a file where a folder is needed"):
        keeper.write()
    (tmp_path / "file").unlink()
    assert keeper.write_if_due(REST_S)


def test_a_draft_that_could_not_be_deleted_is_deleted_as_soon_as_that_is_possible(tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    keeper = Keeper(file, "")
    keeper.note_edit("x", (), 100.0)
    assert keeper.write_if_due(100.0 + REST_S)
    (path,) = (data_folder() / "drafts").glob("*.json")
    content = path.read_bytes()
    path.unlink()
    path.mkdir()
    (path / "in the way").touch()
    keeper.note_saved("saved")
    (path / "in the way").unlink()
    path.rmdir()
    path.write_bytes(content)
    assert not keeper.write_if_due(0.0)
    assert not path.exists()


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"text": 1, "base": "", "selected": [], "kept_at": ""}'])
def test_a_broken_draft_is_ignored(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "a.toml"
    write_draft(file, Draft(text="x", base=""))
    (path,) = Path(os.environ["LIQUID_STUDY_DATA"], "drafts").glob("*.json")
    path.write_bytes(content)
    assert draft_of(file) is None


TEXT = (PROTOCOLS / "demo.toml").read_text(encoding="utf-8")


def session(folder: Path, participant: str, source: bytes, **facts: Any) -> None:
    path = folder / "data" / f"sub-{participant}" / "ses-01" / "receipt.json"
    path.parent.mkdir(parents=True)
    protocol = without_conditions(parse(source, "demo"))
    held = {
        "key_hash": "0" * 64, "protocol_hash": protocol_hash(source), "protocol": protocol, "simulated": False,
        "pilot": False, "started_at": "2026-11-21T12:00:00+00:00", **facts,
    }  # fmt: skip
    path.write_text(json.dumps(held), encoding="utf-8", newline="\n")


def test_runs_counts_sessions_pilots_and_rehearsals_by_content(tmp_path: Path) -> None:
    source, other_source = TEXT.encode(), TEXT.replace('version = "1.1"', 'version = "1.2"').encode()
    session(tmp_path / "demo", "P001", source)
    session(tmp_path / "demo", "P002", source)
    session(tmp_path / "demo", "P003", other_source, started_at="2026-11-22T12:00:00+00:00")
    session(tmp_path / "demo-pilot", "P001", source, pilot=True)
    session(tmp_path / "demo-pilot-2", "P001", other_source, pilot=True, simulated=True)  # played and kept
    session(tmp_path / "demo-rehearsal-1", "P001", other_source, simulated=True)
    (tmp_path / "demo" / "data" / "sub-P004" / "ses-01").mkdir(parents=True)
    runs = runs_of_study(tmp_path, "demo")
    assert [(run.version, run.sessions, run.pilots, run.rehearsals) for run in runs] == [
        ("1.1", 2, 1, 0),
        ("1.2", 1, 1, 1),
    ]
    assert [run.hash for run in runs] == [protocol_hash(source), protocol_hash(other_source)]
    assert runs[0].protocol == json.loads(json.dumps(without_conditions(parse(source, "demo"))))
    assert runs_of_study(tmp_path, "other") == ()


def test_a_content_that_was_run_is_kept_before_the_file_changes(tmp_path: Path) -> None:
    file = tmp_path / "demo.toml"
    file.write_text(TEXT, encoding="utf-8", newline="\n")
    keep_run_content(file, [Run(hash="another", version="1.0", sessions=1)])
    assert kept_content(content_hash(TEXT.encode())) is None
    keep_run_content(file, [Run(hash=content_hash(TEXT.encode()), version="1.0", sessions=1)])
    assert kept_content(content_hash(TEXT.encode())) == TEXT.encode()


def test_standing_states_whether_saving_asks_and_the_free_version() -> None:
    ran = (
        Run(hash="abc", version="1.0", sessions=2),
        Run(hash="def", version="1.1", sessions=1),
        Run(hash="pil", version="1.2", pilots=3),
    )
    assert not version_standing(
        "new", "old", "0.1", [Run(hash="pil", version="0.1", pilots=1, rehearsals=2)]
    ).needs_confirmation
    same = version_standing("abc", "abc", "1.0", ran)
    assert (same.needs_confirmation, same.version, same.sessions) == (False, "1.0", 2)
    changed = version_standing("new", "abc", "1.0", ran)
    assert (changed.needs_confirmation, changed.version, changed.last_version, changed.conflicts) == (
        True,
        "1.2",
        "1.1",
        2,
    )
    raised = version_standing("new", "def", "2.0", ran)
    assert (raised.needs_confirmation, raised.version, raised.conflicts) == (True, "2.0", 0)
    assert not version_standing("newer", "new", "2.0", ran).needs_confirmation


@pytest.mark.parametrize("version", ["", "1 2", "1,2", "é"])
def test_invalid_and_reused_versions_are_rejected(version: str) -> None:
    check_version("1.2-rc+3", [Run(hash="abc", version="1.2-rc+3", pilots=1)])
    with pytest.raises(StudyError, match="is not a valid version"):
        check_version(version, [])
    with pytest.raises(StudyError, match="has already been run with different content"):
        check_version("1.0", [Run(hash="abc", version="1.0", sessions=1)])


@pytest.mark.parametrize(
    ("version", "following"),
    [("1", "2"), ("1.9", "1.10"), ("2026-a", "2027-a"), ("beta", "beta.1"), ("1.0-rc2", "1.0-rc3")],
)
def test_next_version_raises_the_last_number(version: str, following: str) -> None:
    assert next_version(version) == following


@needs_links
def test_save_replaces_the_file_keeps_its_permissions_and_its_previous_content(tmp_path: Path) -> None:
    file, link = tmp_path / "study.toml", tmp_path / "link.toml"
    file.write_bytes(b"a = 1\r\n")
    file.chmod(0o640)
    link.symlink_to(file)
    base = content_hash(b"a = 1\r\n")
    halves = [file.with_name(f".{name}.tmp") for name in ("study.toml.0123abcd", "study.toml.v2.0123abcd")]
    for half in (*halves, fresh := file.with_name(".study.toml.4567cdef.tmp")):
        half.write_text("a =", encoding="utf-8", newline="\n")
        os.utime(half, None if half == fresh else (0, 0))  # another program may be writing the fresh one
    after = save_study(link, "a = 2\r\n", base)
    assert [half.exists() for half in (*halves, fresh)] == [False, True, True]
    assert file.read_bytes() == b"a = 2\r\n"
    assert link.is_symlink()
    assert file.stat().st_mode & 0o777 == 0o640
    assert kept_content(base) == b"a = 1\r\n"
    assert kept_content(after) == b"a = 2\r\n"
    assert kept_content("0" * 64) is None
    assert [(kept.hash, kept.origin) for kept in kept_versions(file)] == [(base, "found"), (after, "saved")]
    save_study(file, "a = 1\r\n", after)
    assert [kept.hash for kept in kept_versions(link)] == [base, after]


def test_save_refuses_a_file_that_another_program_changed(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    base = save_study(file, "a = 1\n", "")
    with pytest.raises(ChangedOutsideError, match="changed by another program"):
        save_study(file, "a = 2\n", "")
    file.write_text("b = 1\n", encoding="utf-8", newline="\n")
    with pytest.raises(ChangedOutsideError, match="changed by another program"):
        save_study(file, "a = 2\n", base)
    assert file.read_text("utf-8") == "b = 1\n"
    file.unlink()
    with pytest.raises(ChangedOutsideError, match="deleted or moved"):
        save_study(file, "a = 2\n", base)


def test_lines_of_the_list_that_cannot_be_read_are_left_out(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    base = save_study(file, "a = 1\n", "")
    (path,) = (data_folder() / "versions").glob("*.jsonl")
    path.write_bytes(b'{"hash": "torn\n[]\n{"hash": "x", "origin": "else"}\n' + path.read_bytes())
    assert [kept.hash for kept in kept_versions(file)] == [base]


SAVING = """
import sys
from pathlib import Path
from study_app.store.versions.study_versions import ChangedOutsideError, content_hash, save_study
from study_app.errors import StoreError
file, name, saved = Path(sys.argv[1]), sys.argv[2], 0
while saved < 20:
    before = file.read_bytes()
    text = before.decode() + f"{name}{saved} = 1\\n"
    try:
        save_study(file, text, content_hash(before))
    except ChangedOutsideError:
        continue
    except StoreError:
        continue
    saved += 1
"""


@pytest.mark.slow
def test_two_programs_that_save_one_file_lose_nothing(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text("", encoding="utf-8", newline="\n")
    programs = [subprocess.Popen([sys.executable, "-c", SAVING, str(file), name]) for name in "ab"]
    assert [program.wait(120) for program in programs] == [0, 0]
    expected = {f"{name}{number} = 1" for name in "ab" for number in range(20)}
    assert set(file.read_text("utf-8").splitlines()) == expected
    assert len(list(Path(os.environ["LIQUID_STUDY_DATA"], "contents").glob("*.toml"))) == 41


SYRUP, FILM = "format = 2\n[liquids.any]\ndensity_kg_m3 = 1234\n", b"frames of waves"


def test_a_study_of_another_folder_is_saved_with_its_liquid_files_and_videos(tmp_path: Path) -> None:
    source, target = tmp_path / "source", tmp_path / "target"
    for folder in (source / "films", target / "films"):
        folder.mkdir(parents=True)
    (source / "syrup.toml").write_text(SYRUP, encoding="utf-8", newline="\n")
    (source / "films" / "waves.mp4").write_bytes(FILM)
    own = '[liquids.thick]\ndensity_kg_m3 = 1400\neffects = ["drag"]'
    text = DEMO.text.replace(own, '[liquids.thick]\nfile = "syrup.toml"')
    text = text.replace("[conditions.late]\n", '[conditions.late]\nview = "films/waves.mp4"\n')
    study, syrup, film = read_study(text.encode(), source), target / "syrup.toml", target / "films" / "waves.mp4"
    for path, content, kind in ((syrup, SYRUP.encode() + b"# another\n", "liquid"), (film, FILM + b"!", "video")):
        path.write_bytes(content)
        with pytest.raises(Refused, match=f"{re.escape(str(path))} already exists and contains a different {kind}"):
            Document(study, (), target / "refused.toml").save(())
        assert path.read_bytes() == content
        path.unlink()
    assert not (target / "refused.toml").exists()
    for name in ("first", "second"):  # the second one finds the same files there
        document = Document(study, (), target / f"{name}.toml")
        document.save(())
        assert (target / f"{name}.toml").read_text(encoding="utf-8") == text
        assert (syrup.read_text(encoding="utf-8"), film.read_bytes()) == (SYRUP, FILM)
        assert document.study.folder == target.resolve()
    assert {path.name for path in source.iterdir()} == {"films", "syrup.toml"}, "the other folder is only read"
