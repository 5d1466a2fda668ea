"""A day of a lab in one process: sessions of all shipped studies, in simulated time, with faults.

Run as ``python -m tests.benchmarks.sessions.day [STUDY ...] [--sessions N]``. A fault is drawn for each session: its
program is killed anywhere, perhaps within a line; the device is unplugged; the disk takes nothing for a while; a second
operator uses the folder; the clock was set back, or the computer slept, before the session is resumed. At the end every
study must be sound, every session completed, and every answer there. Prints what happened, and memory, open files and
threads after each sixth of the sessions.
"""

import argparse
import ctypes
import gc
import os
import random
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from unittest import mock

from study_app.errors import StoreError, StudyError
from study_app.protocol.load import load
from study_app.protocol.source.files import shipped, source_bytes
from study_app.session.simulated.rehearsal import open_session, resume_rehearsal
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.session_progress.progress import progress_of
from study_app.store.sessions import recovery
from study_app.store.sessions.open_session import SessionStore
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study

FAULTS = ("none", "killed", "torn", "unplugged", "disk full", "two operators", "clock set back", "slept")
MOST_RESUMED = 20


class Killed(BaseException):
    """Raised in place of the death of the program."""


@contextmanager
def fails(number: int, error: BaseException, times: int = 1) -> Iterator[None]:
    """Let a number of writes of a journal fail, starting at a line."""
    append, append_numbers = SessionStore.append, iter(range(10**9))

    def failing(store: SessionStore, *words: Any, **given: Any) -> None:
        if number <= next(append_numbers) < number + times:
            raise error
        append(store, *words, **given)

    with mock.patch.object(SessionStore, "append", failing):
        yield


@contextmanager
def clock_moved(by: timedelta) -> Iterator[None]:
    class Moved(datetime):
        @classmethod
        def now(cls, tz: Any = None) -> datetime:
            return datetime.now(tz) + by

    with mock.patch.object(journal, "datetime", Moved), mock.patch.object(recovery, "datetime", Moved):
        yield


def hold_session(study: str, folder: Path, person: str, seed: int, fault: str, chance: random.Random) -> None:
    """Hold a session until its fault, or its end."""
    error: BaseException = StoreError("no space left") if fault == "disk full" else Killed()
    line = 10**9 if fault in ("none", "two operators", "unplugged") else chance.randrange(3, 60)
    times = chance.randrange(1, 4) if fault == "disk full" else 1
    words = load(study), source_bytes(study), person
    with (
        suppress(Killed, StudyError),
        fails(line, error, times),
        open_session(*words, results=folder, seed=seed, recordings=False) as (session, store),
    ):
        if fault == "two operators":
            with suppress(StoreError):
                resume_rehearsal(store.folder.path)
                raise AssertionError("the session has two operators")
            with open_session(*words[:2], f"{person}B", results=folder, seed=seed, recordings=False):
                pass  # another session in the same folder, which stays unfinished
        if fault == "unplugged":
            threading.Timer(chance.random() * 0.3, session.rig.device.unplug).start()
        session.run()


def finish(session: SessionFolder, fault: str) -> int:
    """Resume a session until it is completed; return how often."""
    if fault == "torn" and not progress_of(journal.read(session.journal)).ended:
        with session.journal.open("ab") as file:  # as far as the next line came
            file.write(session.journal.read_bytes().splitlines()[-1][:-7])
    moved = {"clock set back": timedelta(hours=-1), "slept": timedelta(hours=5)}.get(fault, timedelta())
    for count in range(MOST_RESUMED):
        if progress_of(journal.read(session.journal)).ended:
            return count
        with clock_moved(moved):
            resume_rehearsal(session.path)
    raise AssertionError(f"{session.path} has no end")


def memory_mib() -> float:
    return int(Path("/proc/self/statm").read_text("utf-8").split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def state() -> str:
    used_mib = memory_mib()
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)  # glibc keeps freed pages, between those in use, until it is asked
    files = len(list(Path("/proc/self/fd").iterdir()))
    threads = threading.active_count()
    return f"{used_mib:.0f} MiB, {memory_mib():.0f} MiB of them in use, {files} open files, {threads} threads"


def main() -> None:
    """Run the sessions and print the findings."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("studies", nargs="*", default=shipped())
    parser.add_argument("--sessions", type=int, default=60)
    parser.add_argument("--minutes", type=float, default=600.0, help="begin no session after so many")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    chance, began, studies = random.Random(options.seed), time.perf_counter(), options.studies  # noqa: S311 - faults
    faults, resumed, simulated_s = Counter[str](), 0, 0.0
    with tempfile.TemporaryDirectory() as kept:
        for number in range(options.sessions):
            if time.perf_counter() - began > 60 * options.minutes:
                break
            study, fault = studies[number % len(studies)], chance.choice(FAULTS)
            folder, person = Path(kept) / study, f"P{1 + number // len(studies):03d}"
            hold_session(study, folder, person, number, fault, chance)
            session = StudyFolder(folder).session(person, 1)
            resumed += finish(session, fault)
            progress = progress_of(journal.read(session.journal))
            if reproduction := reproduce_session(session.path).differences:
                raise AssertionError(reproduction)
            faults[fault] += 1
            simulated_s += progress.t_s
            if not (number + 1) % max(options.sessions // 6, 1):
                sys.stdout.write(f"after {number + 1} sessions: {state()}\n")
            sys.stderr.write(f"{number} {study} {fault} {time.perf_counter() - began:.0f} s\n")
        errors = [str(error) for folder in sorted(Path(kept).iterdir()) for error in verify_study(folder).errors]
    listed = ", ".join(f"{count} {fault}" for fault, count in sorted(faults.items()))
    sys.stdout.write(
        f"{faults.total()} sessions of {len(studies)} studies ({listed}), resumed {resumed} times, "
        f"{simulated_s / 3600:.1f} simulated hours in {time.perf_counter() - began:.0f} s; {len(errors)} errors\n"
    )
    sys.stdout.write("\n".join(errors))
    if errors:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
