"""How often a session with windows crashes at its start or end: each in a process of its own, without a screen.

Run it by itself: ``python tests/benchmarks/sessions/crashes.py [SESSIONS] [MINUTES]`` (defaults: 1000, 60). It starts
`run` with the scripted device, ends the session at its first page, and closes the windows; it stops after SESSIONS or
MINUTES, whichever comes first. A process that a signal ended counts as a crash. Printed, every 25 sessions and at the
end, are the counts and the upper bound of the one-sided 95 % interval (Clopper & Pearson 1934; without a crash about
3 / sessions).
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from scipy.stats import beta

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

PATIENCE_S = 600.0
EVERY = 25


def main(sessions: int = 1000, minutes: float = 60.0) -> None:
    """Run sessions and print the counts."""
    crashes = failures = done = 0
    ends_at = time.monotonic() + 60.0 * minutes
    while done < sessions and time.monotonic() < ends_at:
        if done and done % EVERY == 0:
            report(done, crashes, failures)
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-X", "faulthandler", __file__, "--one", folder]
            own = {"LIQUID_STUDY_CONFIG": str(Path(folder, "settings")), "LIQUID_STUDY_WORKSPACE": folder}
            environment = os.environ | own
            done += 1
            try:
                ended = subprocess.run(
                    command, env=environment, capture_output=True, text=True, timeout=PATIENCE_S, check=False
                )
            except subprocess.TimeoutExpired:
                failures += 1
                print(f"session {done}: failure, not over after {PATIENCE_S:g} s", flush=True)
                continue
            if ended.returncode == 0:
                continue
            kind = "crash" if ended.returncode < 0 else "failure"
            crashes, failures = crashes + (kind == "crash"), failures + (kind == "failure")
            print(f"session {done}: {kind}, exit code {ended.returncode}\n{ended.stdout}{ended.stderr}", flush=True)
            for trace in Path(folder).rglob("crash.txt"):
                print(trace.read_text(), flush=True)
    report(done, crashes, failures)


def report(done: int, crashes: int, failures: int) -> None:
    """Print the counts and the upper bound of the crash rate."""
    bound = float(beta.ppf(0.95, crashes + 1, done - crashes)) if crashes < done else 1.0
    counts = f"{done} sessions: {crashes} crashes, {failures} other failures"
    print(f"{counts}; crash rate at most {bound:.2%} (95 %)", flush=True)


def run_one(folder: str) -> int:
    """Start a session in its windows, end it at its first page, and return the exit code."""
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    from study_app import app
    from study_app.gui.application import application_here
    from study_app.gui.operator import OperatorWindow
    from study_app.gui.participant.window import ParticipantWindow
    from study_app.session.pages import EndPage

    application_here()
    asked = []

    def look() -> None:
        windows = QApplication.topLevelWidgets()
        for participant in (window for window in windows if isinstance(window, ParticipantWindow)):
            (operator,) = (window for window in windows if isinstance(window, OperatorWindow))
            if isinstance(participant.page, EndPage):
                operator.buttons.close_session.click()
            elif participant.page is not None and not asked:
                asked.append(True)
                operator.end_asked.emit("aborted", "benchmark")

    timer = QTimer()
    timer.timeout.connect(look)
    timer.start(20)
    code = app.run("demo", participant="P001", device="scripted", windowed=True, results=Path(folder) / "demo")
    return code if asked else 1


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        sys.exit(run_one(sys.argv[2]))
    main(*(kind(word) for kind, word in zip((int, float), sys.argv[1:], strict=False)))
