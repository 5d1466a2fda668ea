"""Kills rehearsed sessions at random moments and lets them be resumed: run as a program, once for all of them.

Everything is loaded and compiled once; then each session is a fork that is killed with SIGKILL, and each going on
another one (a rebuilding, where only files that follow from the journal were missing, or the session's beginning, where
it had not begun). For every session it writes a line of JSON: the folder, after how long it was killed, what its
journal held then, and how the going on ended. Or it kills one session again and again, whenever its journal has grown.
"""

import json
import os
import random
import signal
import sys
import time
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path

from study_app.session.simulated import rehearsal
from study_app.store.sessions.recovery import rebuild_session

SEED = 7


def forked(task: Callable[[], object], until: Callable[[], object] | None = None) -> int:
    """Run ``task`` in a fork that is killed when ``until`` returns; return its exit code, negative after a signal."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            task()
            code = 0
        except BaseException:  # noqa: BLE001 - a fork must never return into the loop
            traceback.print_exc()
        finally:
            os._exit(code)
    if until is not None:
        until()
        os.kill(child, signal.SIGKILL)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def die(*_given: object, **_named: object) -> None:
    """End this process, as a power cut would."""
    os.kill(os.getpid(), signal.SIGKILL)


def session(protocol: str, folder: Path) -> None:
    rehearsal.rehearse(protocol, participants=1, seed=SEED, results=folder)


def grown(path: Path, size: int) -> None:
    """Wait until a journal has this size or its session has ended."""
    while size_of(path) < size and not has_ended(path):
        time.sleep(0.0002)


def size_of(path: Path) -> int:
    return path.stat().st_size if path.exists() else 0


def has_ended(journal: Path) -> bool:
    """Return whether the last lines of a journal say that the session has ended."""
    if not journal.exists():
        return False
    with journal.open("rb") as file:
        file.seek(max(0, size_of(journal) - 2000))
        return b'"session_ended"' in file.read()


def going_on(protocol: str, folder: Path) -> Callable[[], object]:
    """Return the function that completes a killed session."""
    place = folder / "data" / "sub-P001" / "ses-01"
    journal = place / "journal.jsonl"
    if has_ended(journal):
        return partial(rebuild_session, place)
    if journal.exists() and b"\n" in journal.read_bytes():
        return partial(rehearsal.resume_rehearsal, place, protocol=protocol)
    return partial(session, protocol, folder)


def kill_again_and_again(protocol: str, folder: Path, count: int, size: int, draw: random.Random) -> int:
    """Kill a session up to ``count`` times, let it go on to its end, and return how many kills it took.

    On average size/count bytes are written from one kill to the next.
    """
    journal, kills = folder / "data" / "sub-P001" / "ses-01" / "journal.jsonl", 0
    while kills < count and not has_ended(journal):
        more = 1 + round(2 * draw.random() * size / count)
        code = forked(going_on(protocol, folder), partial(grown, journal, size_of(journal) + more))
        assert code in (0, -signal.SIGKILL)
        kills += code != 0
    assert forked(going_on(protocol, folder)) == 0
    return kills


def main(protocol: str, folder: str, count: str, seed: str, at: str = "moments") -> None:
    """Kill sessions at random moments, or where their journals have grown to random sizes (``at`` is "bytes").

    With "again" it is one session that is killed ``count`` times.
    """
    whole, scratch = Path(folder) / "whole", Path(folder) / "scratch"
    session(protocol, whole)
    size = (whole / "data" / "sub-P001" / "ses-01" / "journal.jsonl").stat().st_size
    draw = random.Random(int(seed))  # noqa: S311 - moments, not secrets
    if at == "again":
        killed = Path(folder) / "killed"
        kills = kill_again_and_again(protocol, killed, int(count), size, draw)
        sys.stdout.write(json.dumps({"folder": str(killed), "kills": kills}) + "\n")
        return
    began = time.perf_counter()
    assert forked(lambda: session(protocol, scratch)) == 0
    lasts_s = time.perf_counter() - began
    for number in range(int(count)):
        killed = Path(folder) / f"killed-{number:02d}"
        journal, share = killed / "data" / "sub-P001" / "ses-01" / "journal.jsonl", draw.random()
        after_s = share * lasts_s
        until = partial(grown, journal, round(share * size)) if at == "bytes" else partial(time.sleep, after_s)
        code = forked(lambda killed=killed: session(protocol, killed), until)
        held = journal.read_text(encoding="utf-8") if journal.exists() else ""
        resumed = forked(going_on(protocol, killed)) if code == -signal.SIGKILL else None
        became = {"folder": str(killed), "after_s": after_s, "code": code, "held": held, "resumed": resumed}
        sys.stdout.write(json.dumps(became) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
