"""The journal and its disk: full, slow, failing, and killed at any moment."""

import contextlib
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.errors import StoreError
from study_app.store.journals.journal import Journal, read, scan
from tests.journal_lines import event_of
from tests.platforms import files_up_to
from tests.store.conftest import AWKWARD


@pytest.mark.parametrize("mended", [True, False], ids=["taken back at once", "taken back before the next line"])
def test_the_journal_continues_after_a_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, mended: bool
) -> None:
    pytest.importorskip("resource", reason="sizes of files are limited through the resource module")
    path = tmp_path / "journal.jsonl"
    journal = Journal.create(path)
    first = journal.append(event_of("counted", value=1))
    with monkeypatch.context() as patched:
        if not mended:
            patched.setattr(journal, "file", NoTruncation(journal.file))
        with files_up_to(500), pytest.raises(StoreError, match=r"journal\.jsonl cannot be written \(File too large\)"):
            journal.append(event_of("said", text=AWKWARD))
    assert read(path) == [first]
    assert (scan(path).torn_bytes == 0) == mended
    second = journal.append(event_of("counted", value=2))
    journal.close()
    assert read(path) == [first, second]


class NoTruncation:
    """A file that cannot be truncated."""

    def __init__(self, file: Any) -> None:
        self.file = file

    def truncate(self, _size: int) -> int:
        raise OSError(28, "No space left on device")

    def __getattr__(self, name: str) -> Any:
        return getattr(self.file, name)


class Disk:
    """A patched ``os.fsync`` that remembers the flushed content, and fails or blocks on request.

    A flush that fails loses what it was to flush, as a system does that drops the pages it could not write.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.content = b""
        self.by: list[int] = []
        self.fails = 0
        self.failed = threading.Event()
        self.flushed = threading.Event()
        self.free = threading.Event()
        self.free.set()

    def fsync(self, _descriptor: int) -> None:
        assert self.free.wait(20)
        self.by.append(threading.get_ident())
        if self.fails:
            self.fails -= 1
            with self.path.open("r+b") as file:
                size = file.seek(0, 2)
                file.seek(len(self.content))
                file.write(bytes(max(0, size - len(self.content))))
            self.failed.set()
            raise OSError(5, "Input/output error")
        self.content = self.path.read_bytes()
        self.flushed.set()

    @property
    def mine(self) -> int:
        """How many flushes the thread that asks waited for."""
        return self.by.count(threading.get_ident())


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Disk:
    recorded_disk = Disk(tmp_path / "journal.jsonl")
    monkeypatch.setattr("study_app.store.journals.journal.os.fsync", recorded_disk.fsync)
    return recorded_disk


def test_lines_appended_without_waiting_are_flushed_in_the_background_in_order(disk: Disk) -> None:
    journal = Journal.create(disk.path)
    before = disk.mine  # the folder's entry
    disk.free.clear()  # no flush ends
    events = [journal.append(event_of("seen", count=number), waits=False) for number in range(9)]
    assert read(disk.path) == events
    assert disk.mine == before
    disk.free.set()
    answer = journal.append(event_of("counted", value=1))
    assert disk.content.count(b"\n") == 10
    journal.append(event_of("shown"), waits=False)
    journal.close()
    assert disk.content == disk.path.read_bytes()
    assert read(disk.path)[9] == answer
    assert len(disk.by) - before <= 4  # one flush is enough for all lines that wait


def test_a_failed_background_flush_is_reported_with_the_next_line_and_loses_none(
    disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study_app.store.journals.journal.RETRY_S", 3600.0)
    journal = Journal.create(disk.path)
    first = journal.append(event_of("counted", value=1))
    disk.fails = 2
    shown_event = journal.append(event_of("seen", item="calm"), waits=False)
    assert disk.failed.wait(20)
    with pytest.raises(StoreError, match=r"journal\.jsonl cannot be written \(Input/output error\)"):
        journal.append(event_of("seen", item="strong"), waits=False)
    second = journal.append(event_of("seen", item="strong"), waits=False)  # waits, since one failed
    assert disk.content == disk.path.read_bytes()
    disk.fails = -1  # every flush fails
    third = journal.append(event_of("seen", item="calm"), waits=False)
    with pytest.raises(StoreError, match="Input/output error"):
        journal.close()
    assert journal.is_closed
    journal.close()
    assert read(disk.path)[:3] == [first, shown_event, second]
    assert [line.n for line in (first, shown_event, second, third)] == [1, 2, 3, 4]


def test_a_failed_background_flush_is_reported_and_repeated(disk: Disk, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("study_app.store.journals.journal.RETRY_S", 0.0)
    journal = Journal.create(disk.path)
    journal.append(event_of("counted", value=1))
    journal.check_flushed()
    disk.fails = -1  # every flush fails
    disk.flushed.clear()
    shown_event = journal.append(event_of("seen", item="calm"), waits=False)
    for _ in range(3):
        assert disk.failed.wait(20)
        disk.failed.clear()
    with pytest.raises(StoreError, match=r"journal\.jsonl cannot be written \(Input/output error\)"):
        journal.check_flushed()
    with journal.flushing:  # no flush is under way
        disk.fails = 0
    assert disk.flushed.wait(20)
    with journal.flushing:
        journal.check_flushed()
    assert disk.content == disk.path.read_bytes()
    assert read(disk.path)[-1] == shown_event
    journal.close()


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(lines=st.lists(st.tuples(st.booleans(), st.booleans()), max_size=12), cut=st.integers(0, 400))
def test_a_power_cut_loses_only_the_end_of_the_unflushed_lines(
    tmp_path_factory: pytest.TempPathFactory, lines: list[tuple[bool, bool]], cut: int
) -> None:
    """Any part of the unflushed bytes may be on the disk, and flushes may fail."""
    disk = Disk(tmp_path_factory.mktemp("cut") / "journal.jsonl")
    with pytest.MonkeyPatch.context() as patched, contextlib.ExitStack() as over:
        patched.setattr("study_app.store.journals.journal.os.fsync", disk.fsync)
        journal = Journal.create(disk.path)
        over.callback(journal.close)
        kept_lines: list[Any] = []
        answers = 0
        for waits, fails in lines:
            disk.fails = int(fails)
            try:
                kept_lines.append(journal.append(event_of("counted" if waits else "seen"), waits=waits))
            except StoreError:
                continue
            if waits:
                answers = len(kept_lines)
        with journal.flushing:  # no flush is under way
            content, flushed = disk.path.read_bytes(), disk.content
            disk.fails = 0
    if flushed == content[: len(flushed)]:
        flushed = content[: len(flushed) + cut]
    disk.path.write_bytes(flushed)
    left = scan(disk.path)
    assert left.damage is None
    assert left.lines == kept_lines[: len(left.lines)]
    assert len(left.lines) >= answers


KILLED = """
import sys
from collections.abc import Callable
from pathlib import Path
from study_app.store.journals.journal import Journal
from study_app.store.journals.journal_events import read_event
journal = Journal.create(Path(sys.argv[1]))
count = 0
while True:
    count += 1
    journal.append(read_event({"event": "counted", "value": count, "text": "x" * (count % 977)}))
    print(count, flush=True)
"""


@pytest.mark.slow
def test_acknowledged_lines_survive_a_kill_at_any_moment(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout
        acknowledged = [int(program.stdout.readline()) for _ in range(200)]
        program.kill()
        acknowledged += [int(line) for line in program.stdout if line.endswith("\n")]
    values = [line.others["value"] for line in read(path)]
    assert values[: len(acknowledged)] == acknowledged
    assert len(values) <= len(acknowledged) + 1
