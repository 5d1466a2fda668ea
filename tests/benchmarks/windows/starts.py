"""Whether the program ends as it should, however often it is started: run me, I print a table.

Starts the program with its windows and ends it: home, closed; every page visited, then closed; a session of the demo
in its two windows, ended by a signal at most a second later. Counts what ended in another way than asked for, or
printed an exception; of a program that hangs it prints the stacks. It runs on what display there is, without one on
Qt's offscreen platform. Run by itself:

    python tests/benchmarks/windows/starts.py [--starts 300] [--kind run]
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Final

import psutil

# Runs inside the started program: visits what it is asked to, then ends it.
PROBE: Final = """
import os, signal, sys
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
from study_app.app import main_controller
from study_app.app.session.bridge import SessionBridge
from study_app.cli import main

kind, results, later_ms = sys.argv[1:]

def visit(controller):
    names = list(controller.window.rail.buttons) if kind == "places" else []
    def step():
        if names:
            controller.window.go(names.pop(0))
        else:
            timer.stop()
            controller.window.close()
    timer = QTimer(controller.window, interval=50)
    timer.timeout.connect(step)
    timer.start()

def end(bridge, begin=SessionBridge.start):
    begin(bridge)
    QTimer.singleShot(int(later_ms), lambda: os.kill(os.getpid(), signal.SIGTERM))

SessionBridge.start = end
if kind == "run":
    sys.argv[1:] = ["run", "demo", "--participant", "P001", "--windowed", "--results", results]
    main()
from pathlib import Path
sys.exit(main_controller.run_home_window(Path(results), then=visit))
"""
KINDS: Final = {"home": 0, "places": 0, "run": 128 + signal.SIGTERM}  # the exit code that each ends with
LATEST_MS: Final = 1000  # a session is ended at any time of its first second
PATIENCE_S: Final = 120
LOOK_S: Final = 2
MOST_SHOWN: Final = 6000


def main() -> None:
    """Print how often each kind ended, and how."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=300)
    parser.add_argument("--kind", choices=KINDS, action="append", help="only this kind; without it, all in turn")
    options = parser.parse_args()
    surroundings = dict(os.environ)
    if not surroundings.get("DISPLAY") and not surroundings.get("WAYLAND_DISPLAY"):
        surroundings["QT_QPA_PLATFORM"] = "offscreen"
    ends: Counter[tuple[str, str]] = Counter()
    began = time.perf_counter()
    with suppress(KeyboardInterrupt):  # Ctrl+C prints what there is
        count(options.starts, options.kind or list(KINDS), surroundings, ends)
    print(f"{ends.total()} starts in {(time.perf_counter() - began) / 60:.0f} min\n\n| started | ended | times |")
    print("| --- | --- | --: |")
    for (kind, how), times in sorted(ends.items()):
        print(f"| {kind} | {how} | {times} |")
    sys.exit(any(how != "as it should" for _, how in ends))


def count(starts: int, kinds: list[str], surroundings: dict[str, str], ends: Counter[tuple[str, str]]) -> None:
    """Start and end the program, and count how it ended."""
    for at in range(starts):
        kind, later_ms = kinds[at % len(kinds)], at * 37 % LATEST_MS
        with tempfile.TemporaryDirectory() as folder:
            words = [kind, str(Path(folder) / "results" / "demo"), str(later_ms)]
            command = [sys.executable, "-X", "faulthandler", "-c", PROBE, *words]
            with subprocess.Popen(
                command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=surroundings
            ) as program:
                stderr = said_until_its_end(program)
        failed = program.returncode != KINDS[kind] or "Traceback" in stderr
        ends[kind, f"exit code {program.returncode}: {stderr[-MOST_SHOWN:]}" if failed else "as it should"] += 1


def said_until_its_end(program: subprocess.Popen[str]) -> str:
    """Return the output of a program; abort it if it hangs, so that it prints the stacks of its threads.

    A busy computer makes no start hang: what counts is a time without any progress, or the program's own time.
    """
    used_s, since_s = 0.0, time.perf_counter()
    while True:
        with suppress(subprocess.TimeoutExpired):
            return program.communicate(timeout=LOOK_S)[1]
        now_s = sum(psutil.Process(program.pid).cpu_times()[:2])
        if now_s > used_s:
            used_s, since_s = now_s, time.perf_counter()
        if used_s > PATIENCE_S or time.perf_counter() - since_s > PATIENCE_S:
            program.send_signal(signal.SIGABRT)


if __name__ == "__main__":
    main()
