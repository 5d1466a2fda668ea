"""How long a rehearsed session takes: the first in a process, which loads the compiled loop, and the next ones.

Run it by itself: ``python tests/benchmarks/sessions/rehearsal.py [PROTOCOL] [PARTICIPANTS]``. What the wall time has
more than the processor's is waiting, mostly for the disk: every line of the journal is on it before the session goes
on.
"""

import sys
import tempfile
import time
from pathlib import Path

from study_app.protocol.load import load
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.folders import StudyFolder
from study_app.store.journals import journal


def main(name: str = "rek2024", participants: int = 5) -> None:
    """Rehearse into a folder that is thrown away, and print a row a session."""
    wall_s, processor_s = [time.perf_counter()], [time.process_time()]

    def took(_line: str) -> None:
        wall_s.append(time.perf_counter())
        processor_s.append(time.process_time())

    with tempfile.TemporaryDirectory() as scratch:
        rehearse(name, participants=participants, seed=1, results=Path(scratch) / "results", progress=took)
        print(f"{load(name).study.name}: rehearsed sessions, {participants} simulated participants")
        print("participant   wall s   processor s   session min   × real time   journal lines")
        for row, session in enumerate(StudyFolder(Path(scratch) / "results").sessions()):
            lines = journal.read(session.journal)
            lasted_s = lines[-1]["t_s"]
            wall, processor = wall_s[row + 1] - wall_s[row], processor_s[row + 1] - processor_s[row]
            print(
                f"{session.participant:<11} {wall:8.2f} {processor:13.2f} {lasted_s / 60:13.1f} {lasted_s / wall:13.0f}"
                f" {len(lines):15d}"
            )


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]))
