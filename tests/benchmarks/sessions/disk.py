"""Thousands of sessions, 10 a study, each with a fault of the disk at a random call: nothing is lost or doubled.

Run as ``python -m tests.benchmarks.sessions.disk [--sessions N] [--seed S]``. A flush, a write or a renaming fails, a
write ends in the middle, or the disk is full for a while, at the session's beginning, within it or at its end. Real
files, simulated time; a flush that succeeds does not wait for the disk. Prints the faults of each kind that happened,
the time of the first and of the last hundred sessions, memory, and what `verify` finds.
"""

import argparse
import errno
import os
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO
from unittest import mock

from study_app.errors import SessionError, StoreError
from study_app.session.runner import RETRY_S
from study_app.session.transitions.state import Phase
from study_app.store.files import atomic
from study_app.store.journals import journal
from study_app.store.sessions.recovery import rebuild_session
from study_app.store.verification.verify_session import Findings
from study_app.store.verification.whole_study import verify_study
from tests.benchmarks.sessions.day import state
from tests.faults.support.worlds import StoredWorld
from tests.session import small

CALLS = {"flush": "fsync", "write": "write", "short write": "write", "renaming": "replace", "full": "fsync write"}
MOST_CALL, FULL_FOR, MOST_TRIES, OF_STUDY = 40, 12, 300, 10
SHORT = {"sequence": ["welcome", "feeling", "thanks"], "blocks": {"feeling": small.TABLES["blocks"]["feeling"]}}
ANSWERS = 2 * 3


class Disk:
    """A disk that fails at a call of a kind, once, or for a while if it is full."""

    def __init__(self, kind: str, call: int) -> None:
        self.kind, self.happened = kind, 0
        self._until = call
        self._times = FULL_FOR if kind == "full" else 1

    def fails(self, call: str) -> bool:
        if call not in CALLS[self.kind].split() or self.happened == self._times:
            return False
        self._until -= 1
        self.happened += self._until < 0
        return self._until < 0

    def refusing(self, call: str, whole: Callable[..., Any]) -> Callable[..., Any]:
        def refuse(*words: Any, **given: Any) -> Any:
            if self.fails(call):
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            return whole(*words, **given)

        return refuse

    def write(self, file: BinaryIO, content: bytes, whole: Callable[..., None] = atomic.write_all) -> None:
        if self.fails("write"):
            whole(file, content[: len(content) // 2] if self.kind == "short write" else b"")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        whole(file, content)

    @contextmanager
    def used(self) -> Iterator[None]:
        with (
            mock.patch.object(os, "fsync", self.refusing("fsync", lambda *_: None)),
            mock.patch.object(os, "rename", self.refusing("replace", os.rename)),
            mock.patch.object(os, "replace", self.refusing("replace", os.replace)),
            mock.patch.object(atomic, "write_all", self.write),
            mock.patch.object(journal, "write_all", self.write),
        ):
            yield


def tried(act: Callable[[], Any]) -> Any:
    """Repeat an action while the disk refuses it."""
    for _ in range(MOST_TRIES):
        with suppress(StoreError):
            return act()
    raise AssertionError("the disk never took it")


def hold_session(folder: Path, person: str, disk: Disk) -> None:
    """Hold a session to its end."""
    with disk.used(), mock.patch.dict(small.TABLES, SHORT):
        world = tried(lambda: StoredWorld(folder, person))
        world.start()
        for _ in range(MOST_TRIES):
            if world.state.phase is Phase.COMPLETE and not world.runner.stalled:
                break
            if world.runner.stalled:
                world.run(RETRY_S + 0.1)
                continue
            try:
                world.step()
            except SessionError:  # the page that was being answered is covered
                assert world.runner.stalled
        assert world.state.phase is Phase.COMPLETE, (person, disk.kind)
        session = world.store.folder
        tried(world.store.close)
        if not session.checksums.exists():
            tried(lambda: rebuild_session(session.path))
    lines = journal.read(session.journal)
    answers = sum(len(line.fields()["items"]) for line in lines if line.event == "responses")
    assert answers == ANSWERS, (person, disk.kind, answers)


def main() -> None:
    """Run the sessions and print the findings."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chance = random.Random(options.seed)  # noqa: S311 - faults
    happened, times = Counter[str](), []
    with tempfile.TemporaryDirectory() as kept:
        for number in range(options.sessions):
            began_s, disk = time.process_time(), Disk(chance.choice([*CALLS]), chance.randrange(MOST_CALL))
            hold_session(Path(kept, f"{number // OF_STUDY:03d}"), f"P{number % OF_STUDY + 1:03d}", disk)
            happened[disk.kind] += disk.happened > 0
            times.append(time.process_time() - began_s)
            if not (number + 1) % max(options.sessions // 4, 1):
                sys.stdout.write(f"after {number + 1} sessions: {state()}\n")
                sys.stdout.flush()
        findings = Findings(Path(kept))
        for study in sorted(findings.folder.iterdir()):
            findings.extend(verify_study(study))
    few = times[:100], times[-100:]
    listed = ", ".join(f"{count} {kind}" for kind, count in sorted(happened.items()))
    sys.stdout.write(
        f"{options.sessions} sessions, {happened.total()} with a fault ({listed}); a session took "
        f"{sum(few[0]) / len(few[0]):.2f} s of CPU first, {sum(few[1]) / len(few[1]):.2f} s last; "
        f"{len(findings.errors)} errors, {len(findings.warnings)} warnings\n"
    )
    sys.stdout.write("".join(f"{message}\n" for message in (*findings.errors, *findings.warnings)[:40]))
    if findings.errors:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
