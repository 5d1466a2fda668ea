"""How long a withdrawal takes in a large study: ``python tests/benchmarks/sessions/withdrawal.py [SESSIONS]``.

It rehearses the answers of SESSIONS participants (default 1000), erases one of them, and prints the seconds.
"""

import sys
import tempfile
import time
from pathlib import Path

from study_app.store.withdrawals import withdraw
from tests.studies import rehearsed


def main(sessions: int = 1000) -> None:
    """Print the wall and processor time of one withdrawal."""
    with tempfile.TemporaryDirectory() as folder:
        study = rehearsed(Path(folder), people=sessions)
        began_s, worked_s = time.perf_counter(), time.process_time()
        withdraw(study, "P007", by="AK", reason="benchmark")
        wall_s, worked_s = time.perf_counter() - began_s, time.process_time() - worked_s
        print(f"one of {sessions} sessions erased in {wall_s:.2f} s, {worked_s:.2f} s of processor time")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
