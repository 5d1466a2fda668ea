"""How long the main window does not answer: run me, I print a table.

Each row is the longest time that the window's thread spent in one go [ms]: home with many sessions, keys in New
session, the first entry of the liquid lab once home has stood for some seconds, and the second.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from study_app.app.main_controller import MainController
from study_app.gui.application import application_here
from study_app.gui.home.new_session_dialog import NewSessionDialog
from study_app.protocol.load import load, source_bytes
from study_app.store.sessions.begin import begin
from study_app.viewmodels.home import study_facts

SESSIONS = 300
STANDS_S = 4.0


def hold(folder: Path, count: int) -> None:
    """Hold ``count`` sessions of the demo."""
    for number in range(1, count + 1):
        with begin(
            folder, load("demo"), source_bytes("demo"), f"P{number:04d}", seed=1, operator="", language="en",
            device={"name": "mouse"}, screens={}, simulated=False,
        ) as store:  # fmt: skip
            store.finish("completed")


def worst(act: Callable[[], object], lasts_s: float) -> float:
    """Return the longest of the action and of the rounds of events after it [ms]."""
    app, begun = application_here(), time.perf_counter()
    act()
    longest = time.perf_counter() - begun
    while time.perf_counter() - begun < lasts_s:
        start = time.perf_counter()
        app.processEvents()
        longest = max(longest, time.perf_counter() - start)
        time.sleep(0.002)
    return 1e3 * longest


def main() -> None:
    """Measure and print."""
    application_here()
    with tempfile.TemporaryDirectory() as kept:
        results = Path(kept) / "results"
        hold(results / "demo", SESSIONS)
        visit = MainController(results)
        rows = {"first seconds of the window": worst(visit.open, STANDS_S)}
        home = visit.window.place("home")
        rows[f"home, {SESSIONS} sessions read again"] = worst(home.enter, 3.0)
        dialog = NewSessionDialog(study_facts("demo"), results)  # type: ignore[arg-type]  # it ships with the program
        rows["a key in New session"] = max(worst(lambda n=n: dialog.participant.setText(f"P{n}"), 0.2) for n in (1, 2))
        dialog.deleteLater()
        rows["lab, first entry"] = worst(lambda: visit.window.go("lab"), 3.0)
        visit.window.go("home")
        rows["lab, second entry"] = worst(lambda: visit.window.go("lab"), 2.0)
        visit.window.close()
        visit.end()
    for name, longest_ms in rows.items():
        print(f"{name:<36}{longest_ms:>8.0f} ms")


if __name__ == "__main__":
    main()
