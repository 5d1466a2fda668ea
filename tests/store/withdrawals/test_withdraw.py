"""Withdrawal: nothing of the person remains, the study stays sound, and an interrupted erasure is finished."""

import hashlib
import json
import os
import re
import shutil
import signal
from datetime import UTC, datetime
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from study_app.analysis.export_study import export
from study_app.analysis.report.write_report import report
from study_app.cli import commands
from study_app.errors import StoreError
from study_app.store.exclusions import exclude, include
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.checksums import checked_line
from study_app.store.integrity.folder_lock import lock_folder
from study_app.store.sessions.begin import used_ids
from study_app.store.sites.merge import merge_sites
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import Withdrawn, proof_of_withdrawal, tombstones, withdraw
from tests.faults.support.killer import die, forked
from tests.platforms import needs_fork
from tests.studies import begun, rehearsed

pytestmark = pytest.mark.slow

NOW = datetime(2026, 11, 22, 9, 30, tzinfo=UTC)
PERSON = "P002"


@pytest.fixture(scope="module")
def finished_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of three finished sessions, to be copied."""
    folder = rehearsed(tmp_path_factory.mktemp("made"))
    exclude(folder, PERSON, 1, trial=2, by="AK", reason="the phone of P002 rang")
    exclude(folder, PERSON, 1, trial=3, by="AK", reason="coughed")
    include(folder, PERSON, 1, trial=3, by="AK", reason="not so bad")
    return folder


@pytest.fixture
def study(finished_study: Path, results: Path) -> Path:
    return Path(shutil.copytree(finished_study, results / finished_study.name))


def erase(study: Path, **given: object) -> Withdrawn:
    return withdraw(study, PERSON, **({"by": "AK", "reason": "asked by letter", "now": NOW} | given))  # type: ignore[arg-type]


def run(*words: object) -> Result:
    return CliRunner().invoke(commands, [str(word) for word in words])


def personal(study: Path) -> set[bytes]:
    """Return the texts that occur only in this person's files: hashes, times, seeds, file names."""
    session = study / "data" / f"sub-{PERSON}"
    words = re.compile(rb"[0-9A-Za-z][0-9A-Za-z:.+_-]{7,}")
    own, other = set(), set()
    for path in (path for path in study.rglob("*") if path.is_file()):
        (own if path.is_relative_to(session) else other).update(words.findall(path.read_bytes()))
    return own - other


def contents(folder: Path) -> dict[Path, bytes]:
    left_out = ("withdrawals.jsonl",)
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.name not in left_out}


def test_a_withdrawal_erases_every_byte_of_the_person_and_keeps_the_study_sound(study: Path, results: Path) -> None:
    own = personal(study)
    assert len(own) > 30
    unblind(study, "AK", "closed")
    export(study, results / "tables", extras=["wide", "parquet"])
    report(study, study / "report")
    copy = study.parent / "fingerprints-kept.txt"
    shutil.copy(study / "fingerprints.txt", copy)
    withdrawal = erase(study)
    copy = copy.rename(results.parent / "fingerprints-kept.txt")
    with copy.open("a", encoding="utf-8", newline="\n") as kept:
        kept.write(checked_line(*proof_of_withdrawal(withdrawal.tombstone)))
    assert withdrawal.left == ()
    assert withdrawal.elsewhere == ()
    for path, content in contents(results).items():
        assert PERSON.encode() not in content, path
        assert PERSON not in str(path)
        assert not [word for word in own if word in content], path
    assert verify_study(study, copy).is_sound
    assert "participant P002 withdrew at 2026-11-22T09:30:00+00:00" in "\n".join(map(str, verify_study(study).warnings))
    (page,) = [path for path in report(study, results.parent / "again") if path.name == "report.html"]
    text = page.read_text(encoding="utf-8")
    assert "1 participant withdrew; their data were erased." in text
    assert "2026-11-22, recorded by AK: asked" in text


def test_the_tombstone_proves_which_session_was_erased(study: Path) -> None:
    session = study / "data" / f"sub-{PERSON}" / "ses-01"
    content = (study / "fingerprints.txt").read_text("utf-8")
    sums = hashlib.sha256((session / "checksums.sha256").read_bytes()).hexdigest()
    first = (session / "journal.jsonl").read_bytes().splitlines(keepends=True)[0]
    erase(study)
    (line,) = (study / "withdrawals.jsonl").read_text("utf-8").splitlines()
    json_content = json.loads(line)
    (erased,) = json_content.pop("sessions")
    assert json_content == {
        "participant": PERSON,
        "at": "2026-11-22T09:30:00+00:00",
        "by": "AK",
        "reason": "asked by letter",
    }
    assert erased["checksums"] == sums
    assert erased["begun"] == hashlib.sha256(first).hexdigest()
    assert f"{erased['fingerprint']}  data/sub-{PERSON}/ses-01\n" in content
    assert PERSON not in (study / "fingerprints.txt").read_text("utf-8")
    with pytest.raises(StoreError, match=r"participant p002 withdrew, .* \(next free: P004\)"):
        used_ids(StudyFolder(study)).check_unused("p002", 1)


@needs_fork
def test_a_killed_withdrawal_is_reported_and_finished_by_the_same_command(
    study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def half(folder: Path) -> None:
        next(folder.rglob("journal.jsonl")).unlink()
        die()

    before = contents(study)
    with monkeypatch.context() as patched:
        patched.setattr(shutil, "rmtree", half)
        assert forked(lambda: erase(study)) == -signal.SIGKILL
    wrong = verify_study(study)
    assert "was interrupted: run liquid-study withdraw again" in "\n".join(map(str, wrong.errors))
    withdrawal = erase(study, by="BM", reason="again")
    assert withdrawal.folders == (study,)
    assert tombstones(StudyFolder(study))[PERSON].by == "AK"
    assert verify_study(study).is_sound
    again = erase(study)
    assert (again.folders, again.outputs) == ((), ())
    for path in (study / "exclusions.csv", study / "exclusions_reversed.jsonl", *study.glob("data/*.csv")):
        erased = path.read_bytes()
        path.write_bytes(before[path])
        errors_text = "\n".join(map(str, verify_study(study).errors))
        assert f"{path.name}: still lists {PERSON}, although {PERSON} withdrew" in errors_text
        path.write_bytes(erased)


@pytest.mark.nightly
def test_an_export_among_the_copies_is_listed_and_not_changed(study: Path, results: Path, tmp_path: Path) -> None:
    shared = tmp_path / "disk" / "shared"
    export(study, tmp_path / "out", extras=["psych-ds"])
    shutil.move(tmp_path / "out" / "psych-ds", shared)
    by_chance, named_folder = (tmp_path / "disk" / name for name in ("by chance", "named"))
    for folder, where in ((by_chance, "materials/honey.mp4"), (named_folder, "results/report.txt")):
        (folder / "data").mkdir(parents=True)
        shutil.copy(shared / "dataset_description.json", folder)
        (folder / where).parent.mkdir()
        (folder / where).write_bytes(b"\0" + PERSON.encode() + b"\xff")
    foreign = tmp_path / "disk" / "bids"
    (foreign / "data").mkdir(parents=True)
    (foreign / "dataset_description.json").write_text('{"Name": "of another program"}', encoding="utf-8", newline="\n")
    export(study, results / "tables", extras=["psych-ds"])  # deleted, since this machine wrote it there
    before = contents(shared)
    withdrawal = erase(study, also=[tmp_path])
    assert withdrawal.folders == (study,)
    assert withdrawal.left == tuple(
        f"{copy} is an export that contains data from {PERSON}: delete it and create it again"
        for copy in (named_folder, shared)
    )
    assert contents(shared) == before


def test_every_copy_and_output_in_the_workspace_is_erased_without_being_named(study: Path, results: Path) -> None:
    pooled, saved, other = (results / name for name in ("pooled", "saved earlier/demo", "another"))
    merge_sites({"A": study}, pooled)
    shutil.copytree(study, saved)
    with begun(other, PERSON) as store:  # another person with the same ID
        store.finish("completed")
    unrelated = contents(other)
    notes = [folder / "notes.txt" for folder in (pooled / "sites" / "A", study, saved)]
    for path in notes:
        path.write_text(f"{PERSON} was late\n", encoding="utf-8", newline="\n")
    report(study, results.parent / "report")
    tables, others = results / "tables, a copy", results / "of another study"
    shutil.copytree(results.parent / "report", tables)
    others.mkdir()
    (others / "answers.csv").write_text(f"study,participant\nanother,{PERSON}\n", encoding="utf-8", newline="\n")
    archive = Path(shutil.make_archive(str(results / "before"), "zip", study))

    withdrawal = erase(pooled / "sites" / "A")

    assert set(withdrawal.folders) == {pooled / "sites" / "A", study, saved}
    assert not [path for path in results.parent.rglob(f"sub-{PERSON}") if not path.is_relative_to(other)]
    assert results.parent / "report" / "report.html" in withdrawal.outputs
    copied = [path for path in tables.rglob("*") if PERSON in path.read_text("utf-8", errors="replace")]
    assert {path.name for path in copied} >= {"report.html", "study-demo_description-responses_data.csv"}
    assert set(withdrawal.left) == {
        *(f"{path} still names {PERSON}" for path in (*notes, *copied)),
        f"{archive} is an archive, which is not searched: delete it if it contains data from {PERSON}",
    }
    assert withdrawal.elsewhere == ()
    assert contents(other) == unrelated
    assert verify_study(pooled).is_sound


def test_sessions_without_journals_are_not_taken_for_copies_of_each_other(study: Path, results: Path) -> None:
    """A participant of another study has the same ID, and only the first journal line identifies a session."""
    other = results / "another"
    with begun(other, PERSON) as store:
        store.finish("completed")
    for folder in (study, other):
        StudyFolder(folder).session(PERSON, 1).journal.write_bytes(b"")
    before = contents(other)
    refusal_text = (
        f"{other} was not changed, because its session {store.folder.path} is not a copy of an erased session"
    )
    for also in ((), (other,)):
        left = [line for line in erase(study, also=also).left if "was not changed" in line]
        assert [line.startswith(refusal_text) for line in left] == [True] * len(also)
    assert contents(other) == before
    assert not (study / "data" / f"sub-{PERSON}").exists()


@needs_fork  # where folders can be linked, and pipes made
def test_a_link_and_a_pipe_are_named_before_anything_is_written(study: Path, tmp_path: Path) -> None:
    person = study / "data" / f"sub-{PERSON}"
    pipe = person / "ses-01" / "notes"
    os.mkfifo(pipe)
    before = {path: path.read_bytes() for path in study.rglob("*") if path.is_file()}
    for act in (lambda: erase(study), lambda: merge_sites({"A": study}, tmp_path / "pooled")):
        with pytest.raises(StoreError, match=f"^{pipe} is neither a file nor a folder: remove it$"):
            act()
    with pytest.raises(StoreError, match=f"^{pipe} is not a folder: specify a study folder"):
        erase(pipe)
    pipe.unlink()
    pipe.symlink_to(tmp_path)
    for act in (lambda: erase(study), lambda: merge_sites({"A": study}, tmp_path / "pooled")):
        with pytest.raises(StoreError, match=f"^{pipe} is a link to {tmp_path}: replace the link with its target$"):
            act()
    pipe.unlink()
    person.rename(tmp_path / "elsewhere")
    person.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match=f"^{person} is a link to {tmp_path / 'elsewhere'}: replace the link"):
        erase(study)
    assert {path: path.read_bytes() for path in before} == before
    assert not (study / "withdrawals.jsonl").exists()
    assert not (tmp_path / "pooled").exists()


def test_a_running_session_is_not_erased(study: Path) -> None:
    opening = lock_folder(study / "data" / f"sub-{PERSON}" / "ses-01")
    before = contents(study)
    with pytest.raises(StoreError, match="is open in another program"):
        erase(study)
    opening.release()
    assert contents(study) == {path: content for path, content in before.items() if not path.name.startswith(".open-")}
