"""What the recordings of a real session miss while two windows are busy drawing beside the servo.

Run it by itself: ``python tests/benchmarks/load.py [PROTOCOL] [SECONDS]``. A session with the scripted hand runs in
real time, both windows on the offscreen platform, answered by itself; after so long it is ended. Every trial's row says
what was dropped. Sixty times a second the operator's window is drawn anew, on top of what it draws anyway.
"""

from __future__ import annotations

import csv
import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from study_app import app
from study_app.gui.operator import OperatorWindow
from study_app.gui.participant import ParticipantWindow
from study_app.store.layout import StudyFolder
from tests.faults.windows import Person

COLUMNS = ("trial", "code", "ticks", "tick_rate_hz", "lateness_p99_ms", "worst_gap_ms", "overruns", "samples_dropped")
MORE = ("samples_recorded", "samples_unrecorded", "frames", "frames_late", "delay_error_p95_ms", "valid")


def main(name: str = "rek2024", seconds: float = 600.0) -> None:
    """Run the session and print a row a trial."""
    began = time.monotonic()

    def watch(_participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        operator.repaint()
        if time.monotonic() - began > seconds and operator.buttons.end.isVisible():
            operator.end_asked.emit("aborted", "measured")
        return False

    with tempfile.TemporaryDirectory() as scratch:
        results = Path(scratch) / "results"
        application = app.QApplication.instance() or app.QApplication(["load"])
        person = Person(watch, every_ms=16)
        app.run(name, participant="P001", device="scripted", windowed=True, seed=1, results=results, tell=print)
        person.leave()
        (session,) = StudyFolder(results).sessions()
        (table,) = session.path.glob("*description-trials_data.csv")
        with table.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        print(*COLUMNS, *MORE, sep="  ")
        for row in rows:
            print(*(row[column] for column in (*COLUMNS, *MORE)), sep="  ")
        for name_ in ("ticks", "samples_dropped", "samples_recorded", "samples_unrecorded"):
            print(f"{name_} in all: {sum(int(row[name_]) for row in rows if row[name_].isdigit())}")
        del application


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(float, sys.argv[2:3]))
