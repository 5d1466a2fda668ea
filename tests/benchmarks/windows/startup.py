"""How soon the program answers and shows its windows, with a warm compile cache, and what it loads until then.

Starts ``liquid-study --help``, ``liquid-study`` (home) and ``liquid-study run`` as a user would, on what display there
is (without one on Qt's offscreen platform), and prints when each had answered or was first painted; then the modules
that took longest to load until then, each without what it loads itself. Markdown, for docs/timing.md. Run by itself:

    python tests/benchmarks/windows/startup.py [--runs 5]
"""

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

kind, wanted, results = sys.argv[1:]
from study_app.gui import application
made = application.application_here
def with_probe():
    it = made()
    it.probe = Probe(wanted.split(","))
    it.installEventFilter(it.probe)
    return it
application.application_here = with_probe
run = ["run", "demo", "--participant", "P001", "--windowed", "--results", results]
sys.argv[1:] = [] if kind == "home" else run
from study_app.cli import main
main()
"""


WINDOWS = {"home": ("MainWindow",), "run": ("OpeningWindow", "OperatorWindow", "ParticipantWindow")}
LIMITS_S = {"help": 0.3, "MainWindow": 2.0, "OpeningWindow": 2.0}
NAMES = {
    "help": "`--help`, printed",
    "MainWindow": "home window",
    "OpeningWindow": "`run`: note while all is made ready",
    "OperatorWindow": "`run`: cockpit (2 s of measuring are in it)",
    "ParticipantWindow": "`run`: participant's window",
}
DEAREST = 10


def environment() -> dict[str, str]:
    """Return the surroundings that the program is started in."""
    variables = dict(os.environ)
    if not variables.get("DISPLAY") and not variables.get("WAYLAND_DISPLAY"):
        variables["QT_QPA_PLATFORM"] = "offscreen"
    return variables


def once(kind: str, *options: str) -> tuple[dict[str, float], str]:
    """Start the program once; return the seconds until its answer or each window, and its errors."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, *options]
        if kind == "help":
            command += ["-m", "study_app", "--help"]
        else:
            command += ["-c", PROBE, kind, ",".join(WINDOWS[kind]), str(Path(folder) / "demo")]
        began = time.time()
        process = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False, timeout=60)
        ended = time.time()
    if kind == "help":
        return {"help": ended - began}, process.stderr
    visible_lines = [line.split() for line in process.stdout.splitlines() if line.startswith("VISIBLE")]
    if len(visible_lines) != len(WINDOWS[kind]):
        sys.exit(f"{kind}: saw {[name for _, name, _ in visible_lines]} of {WINDOWS[kind]}\n{process.stderr}")
    return {name: float(at) - began for _, name, at in visible_lines}, process.stderr


def dearest(kind: str) -> list[tuple[str, float, float]]:
    """Return the modules with the longest import: name, own time and cumulative time [ms]."""
    _, said = once(kind, "-X", "importtime")
    rows = []
    for line in said.splitlines():
        words = line.removeprefix("import time:").split("|")
        if len(words) == 3 and words[0].strip().isdigit():
            rows.append((words[2].strip(), int(words[0]) / 1e3, int(words[1]) / 1e3))
    return sorted(rows, key=lambda row: -row[1])[:DEAREST]


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5)
    runs = parser.parse_args().runs
    print(f"| from the start of the program until | median of {runs} | slowest | limit |")
    print("| --- | --: | --: | --: |")
    for kind in ("help", *WINDOWS):
        once(kind)  # the first may compile
        times = [once(kind)[0] for _ in range(runs)]
        for name in times[0]:
            seconds = [start_times[name] for start_times in times]
            limit = f"{LIMITS_S[name]:g} s" if name in LIMITS_S else ""
            print(f"| {NAMES[name]} | {statistics.median(seconds):.2f} s | {max(seconds):.2f} s | {limit} |")
    tables = {kind: dearest(kind) for kind in ("help", *WINDOWS)}
    print(f"\nThe {DEAREST} modules that took longest to load until then, each by itself [ms]:\n")
    print("| `--help` | home | `run` |\n| --- | --- | --- |")
    for row in zip(*tables.values(), strict=True):
        print(f"| {' | '.join(f'`{name}` {alone_ms:.1f}' for name, alone_ms, _ in row)} |")


if __name__ == "__main__":
    main()
