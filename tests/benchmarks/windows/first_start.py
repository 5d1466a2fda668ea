"""Whether a window stays alive while the force model is compiled for the first time: run me, I print a table.

A session of the demo is opened with an empty cache of its own, as a user's first one, and then again with what that
left; a timer of 20 ms beats in the windows' thread meanwhile. Its longest silence is what a frozen window is. The
compiler holds the interpreter's lock, but gives it away every few milliseconds. Run by itself, also beside busy cores:

    python tests/benchmarks/windows/first_start.py [--busy]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path

from study_app.evidence.computer import busy_cores

BEAT_MS = 20
LIMIT_MS = 200

PROGRAM = """
import json, sys, time
from pathlib import Path
from PySide6.QtCore import QEventLoop, QTimer
from study_app.app.session.live_session import LiveSession
from study_app.gui.application import application_here
from study_app.session.start import NewSession
from study_app.app.session.timing import collecting_here
from study_app.gui.theme.theme import LIGHT

application_here()
live = LiveSession(NewSession("demo", "P001", 1, 1, "", "en", "scripted", True, None, Path(sys.argv[1])), LIGHT)
loop, beats, began = QEventLoop(), [], time.perf_counter()
timer = QTimer()
timer.timeout.connect(lambda: beats.append(time.perf_counter()))
timer.start(20)

def opened(_made):
    timer.stop()
    live.cancel()
    loop.quit()

live.open_windows = opened
with collecting_here():
    QTimer.singleShot(0, live.open)
    loop.exec()
    live.wait()
gaps = [1e3 * (b - a) for a, b in zip(beats, beats[1:])]
print(json.dumps([time.perf_counter() - began, gaps]))
"""


def opened(folder: str) -> tuple[float, list[float]]:
    """Open a session with the cache in a folder; return how long it took [s] and the silences [ms]."""
    environment = os.environ | {"NUMBA_CACHE_DIR": folder}
    if not environment.get("DISPLAY") and not environment.get("WAYLAND_DISPLAY"):
        environment["QT_QPA_PLATFORM"] = "offscreen"
    command = [sys.executable, "-c", PROGRAM, str(Path(folder) / "results")]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False, timeout=900)
    if done.returncode:
        sys.exit(done.stderr)
    took_s, gaps_ms = json.loads(done.stdout.splitlines()[-1])
    return took_s, gaps_ms


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--busy", action="store_true", help="keep every core busy meanwhile")
    busy = parser.parse_args().busy
    print(f"{'cache':<10}{'session opened':>16}{'longest silence':>17}{f'over {LIMIT_MS} ms':>13}{'silent in all':>15}")
    with tempfile.TemporaryDirectory() as folder, busy_cores() if busy else nullcontext():
        for name in ("empty", "filled"):
            took_s, gaps_ms = opened(folder)
            long = [gap_ms for gap_ms in gaps_ms if gap_ms > LIMIT_MS]
            silent_s = sum(gap_ms - BEAT_MS for gap_ms in gaps_ms if gap_ms > 2 * BEAT_MS) / 1e3
            print(f"{name:<10}{took_s:>14.1f} s{max(gaps_ms):>14.0f} ms{len(long):>13}{silent_s:>13.1f} s")


if __name__ == "__main__":
    main()
