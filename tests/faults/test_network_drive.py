"""Results on a simulated network drive."""

import errno
import glob
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any, Self

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.session.pages import TroublePage
from study_app.session.runner import RETRY_S
from study_app.session.transitions.events import Note
from study_app.session.transitions.state import Phase
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity import folder_lock
from study_app.store.journals import journal_events
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen_store
from study_app.store.verification.whole_study import verify_study
from tests.faults.support.worlds import StoredWorld
from tests.session import small
from tests.studies import rehearsed

Hide = Callable[[Path], AbstractContextManager[None]]


@pytest.fixture
def drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder without locks and links, whose entries cannot be flushed or renamed to another folder."""
    fcntl = pytest.importorskip("fcntl", reason="imitates the errors of POSIX systems")

    def refuse(*_given: object, **_named: object) -> None:
        raise OSError(errno.ENOTSUP, os.strerror(errno.ENOTSUP))

    def within_a_folder(rename: Callable[..., None]) -> Callable[..., None]:
        def renamed(old: Any, new: Any, **options: Any) -> None:
            if Path(old).parent != Path(new).parent:
                raise OSError(errno.EXDEV, os.strerror(errno.EXDEV))
            rename(old, new, **options)

        return renamed

    def flush(descriptor: int, whole: Callable[[int], None] = os.fsync) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        whole(descriptor)

    for module, name in ((fcntl, "flock"), (fcntl, "lockf"), (os, "link"), (os, "symlink")):
        monkeypatch.setattr(module, name, refuse)
    for name in ("rename", "replace"):
        monkeypatch.setattr(os, name, within_a_folder(getattr(os, name)))
    monkeypatch.setattr(os, "fsync", flush)
    return tmp_path


@pytest.mark.slow
def test_sessions_and_commands_do_without_locks_links_and_flushes_of_folders(drive: Path) -> None:
    world = StoredWorld(drive / "small")
    world.start()
    world.until(Phase.COMPLETE)
    assert verify_study(drive / "small").is_sound
    study, reason = rehearsed(drive), ("--by", "AB", "--reason", "a test")
    session = study / "data" / "sub-P001" / "ses-01"
    (session / "checksums.sha256").unlink()
    for words in (
        ("rebuild", session),
        ("unblind", study, *reason),
        ("exclude", study, "--participant", "P001", *reason),
        ("include", study, "--participant", "P001", *reason),
        ("export", study, "--to", drive / "exported"),
        ("merge", f"A={study}", "--to", drive / "merged"),
        ("withdraw", study, "--participant", "P002", *reason),
        ("verify", study),
    ):
        result = CliRunner().invoke(commands, [str(word) for word in words])
        assert result.exit_code == 0, (words, result.output, result.exception)


@pytest.mark.parametrize(("call", "number"), [("fsync", errno.EDQUOT), ("fsync", errno.EIO), ("fstat", errno.ESTALE)])
def test_a_drive_that_is_full_or_gone_at_a_flush_is_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, number: int
) -> None:
    def fail(_descriptor: int) -> None:
        raise OSError(number, os.strerror(number))

    world = StoredWorld(tmp_path / "study")
    world.start()
    world.until(Phase.ANSWERING)
    with monkeypatch.context() as patched:
        patched.setattr(os, call, fail)
        world.runner.post(Note(world.clock(), "note", "on a full drive"))
        assert isinstance(world.pages[-1], TroublePage)
        assert os.strerror(number) in (world.runner.stalled or "")
    world.run(RETRY_S + 0.1)
    world.until(Phase.COMPLETE)
    assert [line["n"] for line in world.lines] == list(range(1, len(world.lines) + 1))
    assert sum(len(line["items"]) for line in world.lines if line["event"] == "responses") == small.RESPONSES
    assert verify_study(tmp_path / "study").is_sound


class Entries(list[Any]):
    """The result of ``os.scandir`` for a list of entries."""

    def __next__(self) -> Any:
        if not self:
            raise StopIteration
        return self.pop(0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None: ...


@pytest.fixture
def hide(monkeypatch: pytest.MonkeyPatch) -> Hide:
    """Return a context manager that hides an existing path and its contents."""

    @contextmanager
    def hidden(path: Path) -> Iterator[None]:
        look, names, entries = os.stat, os.listdir, os.scandir

        def stat_of(looked: Any, **options: Any) -> os.stat_result:
            if not isinstance(looked, int) and path in (Path(looked), *Path(looked).parents):
                raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(looked))
            return look(looked, **options)

        def scanned(folder: Any = ".") -> Any:
            if isinstance(folder, int):
                return entries(folder)
            with entries(folder) as folder_entries:
                return Entries([entry for entry in folder_entries if Path(folder) / entry.name != path])

        with monkeypatch.context() as patched:
            patched.setattr(os, "stat", stat_of)
            patched.setattr(os, "listdir", lambda of=".": [it for it in names(of) if Path(of) / it != path])
            patched.setattr(os, "scandir", scanned)
            globber = getattr(glob, "_StringGlobber", None)
            if getattr(globber, "scandir", None) is entries:  # Path.glob of Python 3.13
                patched.setattr(globber, "scandir", staticmethod(scanned))
            yield

    return hidden


def begin_session(study: Path, participant: str) -> SessionStore:
    return StoredWorld(study, participant).store


def test_files_of_another_computer_that_appear_late_are_never_created_again(tmp_path: Path, hide: Hide) -> None:
    study = StudyFolder(tmp_path / "study")
    first = begin_session(study.path, "P001")
    before = {path: path.read_bytes() for path in study.path.rglob("*") if path.is_file()}
    for late, participant in ((study.session("P001", 1).path, "P001"), (study.key.parent, "P002")):
        with hide(late), pytest.raises(StoreError):
            begin_session(study.path, participant)
        assert before.items() <= {path: path.read_bytes() for path in study.path.rglob("*") if path.is_file()}.items()
    first.close()
    begin_session(study.path, "P002").close()
    assert verify_study(study.path).errors == ()


def test_of_two_programs_that_do_not_see_each_others_lock_the_first_writes_no_line_over_the_seconds(
    tmp_path: Path, hide: Hide
) -> None:
    first = begin_session(tmp_path / "study", "P001")
    (marker,) = folder_lock.markers(first.folder.path)
    with hide(marker):
        second = reopen_store(first.folder.path, small.protocol(), b"small", operator="AB", device={}, screens={})
    second.append(journal_events.Note(kind="note", text="of the second"))
    with pytest.raises(StoreError, match=r"journal\.jsonl was changed by another program"):
        first.append(journal_events.Note(kind="note", text="of the first"))
    second.finish("completed")
    first.close()
    assert second.lines[-2].text == "of the second"
    assert verify_study(tmp_path / "study").errors == ()
