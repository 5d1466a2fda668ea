"""Kills rehearsed sessions at random moments and lets them be resumed: run as a program, once for all of them.

Everything is loaded and compiled once; then each session is a fork that is killed with SIGKILL, and each going on
another one (a rebuilding, where only files that follow from the journal were missing, or the session's beginning, where
it had not begun). For every session it writes a line of JSON: the folder, after how long it was killed, what its
journal held then, and how the going on ended.
"""

from __future__ import annotations

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
from study_app.store.sessions.rebuild import rebuild

SEED = 7


def forked(task: Callable[[], object], until: Callable[[], object] | None = None) -> int:
    """Do ``task`` in a fork, killed when ``until`` returns; return its exit code, negative where a signal ended it."""
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


def session(protocol: str, folder: Path) -> None:
    rehearsal.rehearse(protocol, participants=1, seed=SEED, results=folder)


def grown(path: Path, size: int) -> None:
    """Wait until a file has this size."""
    while not path.exists() or path.stat().st_size < size:
        time.sleep(0.0002)


def main(protocol: str, folder: str, count: str, seed: str, at: str = "moments") -> None:
    """Kill sessions at random moments, or where their journals have grown to random sizes (``at`` is "bytes")."""
    whole, scratch = Path(folder) / "whole", Path(folder) / "scratch"
    session(protocol, whole)
    began = time.perf_counter()
    assert forked(lambda: session(protocol, scratch)) == 0
    lasts_s = time.perf_counter() - began
    size = (whole / "data" / "sub-P001" / "ses-01" / "journal.jsonl").stat().st_size
    draw = random.Random(int(seed))  # noqa: S311 - moments, not secrets
    for number in range(int(count)):
        killed = Path(folder) / f"killed-{number:02d}"
        place = killed / "data" / "sub-P001" / "ses-01"
        journal, share = place / "journal.jsonl", draw.random()
        after_s = share * lasts_s
        until = partial(grown, journal, round(share * size)) if at == "bytes" else partial(time.sleep, after_s)
        code = forked(lambda killed=killed: session(protocol, killed), until)
        held = journal.read_text(encoding="utf-8") if journal.exists() else ""
        resumed = None
        if code == -signal.SIGKILL and '"session_ended"' in held:
            resumed = forked(lambda place=place: rebuild(place))
        elif code == -signal.SIGKILL and "\n" in held:
            resumed = forked(lambda place=place: rehearsal.resume(place, protocol=protocol))
        elif code == -signal.SIGKILL:
            resumed = forked(lambda killed=killed: session(protocol, killed))
        became = {"folder": str(killed), "after_s": after_s, "code": code, "held": held, "resumed": resumed}
        sys.stdout.write(json.dumps(became) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])
