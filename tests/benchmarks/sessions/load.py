"""What the recordings of real sessions miss while two windows are busy drawing beside the servo.

Run it by itself: ``python tests/benchmarks/sessions/load.py [PROTOCOL] [SECONDS]``. Sessions with the scripted hand run
in real time, one after the other, in both windows on the offscreen platform (or on that of ``QT_QPA_PLATFORM``); every
page is answered with keys and clicks, and after so long the last one is ended. Every trial's row says what was dropped.
Sixty times a second the operator's window is drawn anew, on top of what it draws anyway.
"""

import csv
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtWidgets import QApplication

from study_app import app
from study_app.gui.operator import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder
from tests.faults.support.watched_program import Person

COLUMNS = (
    "participant",
    "trial",
    "code",
    "outcome",
    "ticks",
    "tick_rate_hz",
    "lateness_p99_ms",
    "worst_gap_ms",
    "overruns",
    "samples_dropped",
    "samples_recorded",
    "samples_unrecorded",
    "frames",
    "frames_late",
    "delay_error_p95_ms",
    "worst_frame_gap_ms",
    "valid",
)
SUMS = ("ticks", "samples_recorded", "samples_dropped", "samples_unrecorded", "overruns", "frames")
GAP_S = 1.0  # less is no session


def main(name: str = "rek2024", seconds: float = 600.0) -> None:
    """Hold the sessions and print a row a trial."""
    began = time.monotonic()

    def watch(_participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        operator.repaint()
        if time.monotonic() - began > seconds and operator.buttons.end.isVisible():
            operator.end_asked.emit("aborted", "measured")
            return True
        return False

    with tempfile.TemporaryDirectory() as scratch:
        results = Path(scratch) / "results"
        application = QApplication.instance() or QApplication(["load"])
        sessions = 0
        while time.monotonic() - began < seconds - GAP_S:
            sessions += 1
            person = Person(watch, every_ms=16)
            app.run(
                name,
                participant=f"P{sessions:03d}",
                device="scripted",
                windowed=True,
                seed=sessions,
                results=results,
                progress=print,
            )
            person.leave()
        lasted_s = time.monotonic() - began
        unblind(results, "load", "to print what was measured")
        rows = [row for session in StudyFolder(results).sessions() for row in trials(session.path)]
        del application
    report(rows, sessions, lasted_s)


def trials(folder: Path) -> list[dict[str, str]]:
    """Return the rows of a session's trials."""
    (table,) = folder.glob("*description-trials_data.csv")
    with table.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def report(rows: Sequence[dict[str, str]], sessions: int, lasted_s: float) -> None:
    """Print a line a trial and what it comes to."""
    print(*COLUMNS, sep="  ")
    for row in rows:
        print(*(row[column] for column in COLUMNS), sep="  ")
    total = {name: sum(int(row[name]) for row in rows if row[name].isdigit()) for name in SUMS}
    in_trials_s = sum(float(row["duration_s"]) for row in rows if row["duration_s"] != "n/a")
    print(f"{sessions} sessions in {lasted_s:.0f} s, {in_trials_s:.0f} s of them in trials")
    for name, count in total.items():
        print(f"{name} in all: {count:,}")
    p95 = sorted(float(row["delay_error_p95_ms"]) for row in rows if row["delay_error_p95_ms"] != "n/a")
    if p95:
        print(f"delay_error_p95_ms: {p95[len(p95) // 2]:.1f} in the middle, {p95[-1]:.1f} in the worst trial")
    print(f"valid: {sum(row['valid'] == 'true' for row in rows)} of {len(rows)} trials")


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(float, sys.argv[2:3]))
