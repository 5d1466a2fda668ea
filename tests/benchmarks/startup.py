"""How soon a window is visible, from the start of the program, with a warm compile cache.

Starts ``liquid-study`` (home) and ``liquid-study run`` as a user would, on whatever display there is (without one on
Qt's offscreen platform), and prints when each window was first painted. Run by itself:

    python tests/benchmarks/startup.py [--runs 5]
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Runs inside the started program: tells the time at which each window was first painted, then ends it.
PROBE = """
import os, signal, sys, time
from PySide6.QtCore import QEvent, QObject, QTimer
from PySide6.QtWidgets import QApplication

class Probe(QObject):
    def __init__(self, wanted):
        super().__init__()
        self.wanted, self.seen = set(wanted), set()

    def eventFilter(self, watched, event):
        name = type(watched).__name__
        if event.type() == QEvent.Type.Paint and name in self.wanted and name not in self.seen:
            self.seen.add(name)
            print("VISIBLE", name, time.time(), flush=True)
            if self.seen == self.wanted:
                QTimer.singleShot(0, lambda: os.kill(os.getpid(), signal.SIGTERM))
        return False

from study_app import app
from study_app.app import live_session, visit
made = visit.application_here
def with_probe():
    application = made()
    application.probe = Probe(sys.argv[2].split(","))
    application.installEventFilter(application.probe)
    return application
live_session.application_here = visit.application_here = with_probe
if sys.argv[1] == "home":
    app.home()
else:
    app.run("demo", participant="P001", windowed=True, results=__import__("pathlib").Path(sys.argv[3]))
"""


def once(kind: str, windows: tuple[str, ...]) -> dict[str, float]:
    """Start the program once; return the seconds until each window was painted."""
    environment = dict(os.environ)
    if not environment.get("DISPLAY") and not environment.get("WAYLAND_DISPLAY"):
        environment["QT_QPA_PLATFORM"] = "offscreen"
    with tempfile.TemporaryDirectory() as folder:
        began = time.time()
        command = [sys.executable, "-c", PROBE, kind, ",".join(windows), str(Path(folder) / "demo")]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False, timeout=600)
    seen = [line.split() for line in done.stdout.splitlines() if line.startswith("VISIBLE")]
    if len(seen) != len(windows):
        sys.exit(f"{kind}: saw {[name for _, name, _ in seen]} of {windows}\n{done.stderr}")
    return {name: float(at) - began for _, name, at in seen}


def main() -> None:
    """Print a table: the first start (which may compile), then median and slowest of the warm ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    print(f"{'window':<34}{'first':>8}{'median':>9}{'slowest':>9}   seconds from the start of the program")
    for kind, windows in (
        ("home", ("MainWindow",)),
        ("run", ("OpeningWindow", "OperatorWindow", "ParticipantWindow")),
    ):
        times = [once(kind, windows) for _ in range(runs + 1)]
        for name in windows:
            first, *warm = (seconds[name] for seconds in times)
            print(f"{kind + ': ' + name:<34}{first:>8.2f}{statistics.median(warm):>9.2f}{max(warm):>9.2f}")


if __name__ == "__main__":
    main()
