"""Recordings are sealed as files until the study is unblinded, which nothing interrupts half-way."""

import os
import shutil
import signal
import sys
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StoreError
from study_app.store.blinded.blinding import read_key, reveal
from study_app.store.recordings import read_frames, read_samples
from study_app.store.unblinding import unblind
from study_app.store.verification.whole_study import verify_study
from study_app.store.withdrawals import withdraw
from tests.journal_lines import event_of
from tests.platforms import needs_fork
from tests.store.conftest import Make, Start, ticking_clock
from tests.store.forging import Lines, change, forge

SESSION = "data/sub-P007/ses-01"
RECORDING = f"{SESSION}/recordings/trial-001.parquet"
FRAMES = f"{SESSION}/recordings/trial-001_frames.parquet"


def record_session(start: Start, samples: list[Any], **given: Any) -> Path:
    """Return the folder of a study with one session that recorded these samples, trial by trial."""
    store = start(recordings=True, clock=ticking_clock(), simulated=True, **given)
    assert store.recorder is not None
    about: dict[str, Any] = {"block": "b", "phase": "main", "part": 1, "of": len(samples), "code": "L1"}
    for trial, rows in enumerate(samples, start=1):
        store.append(event_of("trial_started", trial=trial, attempt=1, index=trial, **about))
        store.recorder.start(trial, 1, 1000.0)
        store.recorder.append(rows)
        store.recorder.frame(20, 3)
        store.recorder.stop()
        store.append(event_of("trial_ended", trial=trial, attempt=1, outcome="complete"))
    store.finish("completed")
    return store.place.study_folder.path


def contents(study: Path) -> dict[str, bytes]:
    """Return the files of a study except locks and the record of its unblinding."""
    files = (
        path for path in study.rglob("*") if path.is_file() and path.name[0] != "." and path.name != "reveals.jsonl"
    )
    return {path.relative_to(study).as_posix(): path.read_bytes() for path in files}


@pytest.fixture
def study(start: Start, samples_of: Make) -> Path:
    return record_session(start, [samples_of(2_500), samples_of(3_500, seed=6)])


def test_sealed_recordings_have_rounded_lengths_and_are_read_only_with_the_key(study: Path) -> None:
    samples, frames = study / RECORDING, study / FRAMES
    assert samples.read_bytes().startswith(b"This file is sealed until the study is unblinded")
    for path in (samples, frames):
        assert path.stat().st_size == path.with_name(path.name.replace("001", "002")).stat().st_size
    with pytest.raises(StoreError, match="sealed until the study is unblinded: run liquid-study unblind"):
        read_samples(samples)
    assert len(read_samples(samples, read_key(study).nonce)) == 2_500
    assert read_frames(frames, read_key(study).nonce)["painted_ns"].tolist() == [20]
    assert verify_study(study).errors == ()


def test_an_unblinded_study_holds_the_recordings_of_one_that_was_never_sealed(
    study: Path, start: Start, samples_of: Make, tmp_path: Path
) -> None:
    copy = shutil.copy(study / "fingerprints.txt", tmp_path / "kept.txt")
    other = tmp_path / "open" / "study"
    (other / "blinding").mkdir(parents=True)
    shutil.copy(study / "blinding" / "key.sealed", other / "blinding")
    reveal(other, "AB", "no blinding")
    record_session(start, [samples_of(2_500), samples_of(3_500, seed=6)], results=other)
    assert unblind(study, "AB", "done").left == ()
    ours, theirs = contents(study), contents(other)
    assert {name: ours[name] for name in ours if name.endswith((".parquet", ".csv"))} == {
        name: theirs[name] for name in theirs if name.endswith((".parquet", ".csv"))
    }
    for verification in (verify_study(study, Path(copy)), verify_study(other)):
        assert (verification.errors, verification.warnings) == ((), ())


def test_temporary_files_of_a_killed_unblinding_are_removed_by_the_next(study: Path) -> None:
    folders = (study, study / "data", study / SESSION, (study / RECORDING).parent)
    left = [path / f".{path.name}.0123abcd.tmp" for path in folders]
    for path in left:
        path.write_bytes(b"sealed no more")
        os.utime(path, (0, 0))
    assert unblind(study, "AB", "done").left == ()
    assert [path for path in left if path.exists()] == []


def test_a_sealed_recording_is_withdrawn(study: Path) -> None:
    content = (study / RECORDING).read_bytes()
    withdrawal = withdraw(study, "P007", by="AB", reason="asked")
    assert (withdrawal.folders, withdrawal.left) == ((study,), ())
    assert not [path for path in study.rglob("*") if path.is_file() and content[100:200] in path.read_bytes()]
    assert verify_study(study).errors == ()


def in_line(event: str, **changes: Any) -> Any:
    def edit(lines: Lines) -> None:
        next(line for line in lines if line["event"] == event).update(changes)

    return edit


def test_a_recording_that_differs_from_its_sealed_value_is_found_before_unblinding(study: Path) -> None:
    change(study / SESSION, in_line("recorded", samples_recorded=2_499))
    assert f"{RECORDING}: contains rows 2500, but the journal says 2499" in map(str, verify_study(study).errors)
    forge(study / SESSION / "journal.jsonl", in_line("recorded", sealed="00" * 1040))
    assert "cannot be decrypted with the study's key" in "".join(map(str, verify_study(study).errors))


def test_a_changed_recording_is_named_and_not_opened(study: Path) -> None:
    content = bytearray((study / RECORDING).read_bytes())
    content[5_000] ^= 1
    (study / RECORDING).write_bytes(content)
    (left,) = unblind(study, "AB", "done").left
    assert left.startswith(f"{study / RECORDING} has changed since it was recorded, so it was not opened")
    assert (study / RECORDING).read_bytes() == content
    assert len(read_frames(study / FRAMES)) == 1


@needs_fork
@pytest.mark.slow
@pytest.mark.variants(1)
@pytest.mark.parametrize("first", range(4))
def test_an_unblinding_that_is_killed_anywhere_is_finished_by_the_next(study: Path, tmp_path: Path, first: int) -> None:
    """Killed with SIGKILL before every fourth file that is opened or renamed."""
    whole = tmp_path / "whole"
    shutil.copytree(study, whole)
    unblind(whole, "AB", "done")
    sealed, open_contents = contents(study), contents(whole)
    at, code = first, -signal.SIGKILL
    while code == -signal.SIGKILL:
        copy = tmp_path / "killed"
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(study, copy)
        if (child := os.fork()) == 0:
            dies_at(at, copy)
            unblind(copy, "AB", "done")
            os._exit(0)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        for name in (RECORDING, FRAMES):
            assert (copy / name).read_bytes() in (sealed[name], open_contents[name])
        assert not [error for error in verify_study(copy).errors if ".parquet" in str(error)]
        assert unblind(copy, "AB", "again").left == ()
        assert contents(copy) == open_contents
        at += 4
    assert at > 20


def dies_at(number: int, folder: Path) -> None:
    """Kill this process before its n-th opening or renaming of a file in a folder."""
    left = iter(range(number, -1, -1))

    def watched(event: str, arguments: tuple[Any, ...]) -> None:
        if event in ("open", "os.rename") and str(arguments[0]).startswith(str(folder)) and next(left) == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(watched)
