"""How long the main window does not answer: run me, I print a table.

Each row is the longest time that the window's thread spent in one round of events [ms], and the longest processor time
of its own, which other programs change less: home with many sessions, keys in New session, the first entry of the
liquid lab once home has stood for some seconds, and the second, of the study designer, and a session from *Start* to
its first page, in a trial, when it is ended while the trial is recorded, and when its windows go. A round may hold two
slots.
"""

import os
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from study_app.app.main_controller import MainController
from study_app.app.session.garbage_collection import collecting_here
from study_app.app.session.live_session import LiveSession
from study_app.gui.application import application_here
from study_app.gui.home.new_session_dialog import NewSessionDialog
from study_app.gui.theme.theme import LIGHT
from study_app.protocol.load import load, source_bytes
from study_app.session.pages import TaskPage
from study_app.session.request import NewSession
from study_app.session.transitions.events import Continue, EndAsked
from study_app.store.sessions.begin import SessionStart, begin
from study_app.viewmodels.home import study_facts

SESSIONS = 300
STANDS_S = 4.0


def hold(folder: Path, count: int) -> None:
    """Hold ``count`` sessions of the demo."""
    for number in range(1, count + 1):
        with begin(
            folder,
            load("demo"),
            source_bytes("demo"),
            SessionStart(
                f"P{number:04d}",
                seed=1,
                operator="",
                language="en",
                device={"name": "mouse"},
                screens={},
                simulated=False,
            ),
        ) as store:
            store.finish("completed")


def worst(act: Callable[[], object], lasts_s: float) -> tuple[float, float]:
    """Return the longest of the action and of the rounds of events after it, and the longest processor time [ms]."""
    app, begun = application_here(), time.perf_counter()
    rounds = [timed(act)]
    while time.perf_counter() - begun < lasts_s:
        rounds.append(timed(app.processEvents))
        time.sleep(0.002)
    return max(wall for wall, _ in rounds), max(own for _, own in rounds)


def timed(act: Callable[[], object]) -> tuple[float, float]:
    """Return how long a call took, and the processor time of this thread in it [ms]."""
    wall_s, own_s = time.perf_counter(), time.thread_time()
    act()
    return 1e3 * (time.perf_counter() - wall_s), 1e3 * (time.thread_time() - own_s)


def session(results: Path) -> dict[str, tuple[float, float]]:
    """Hold a session, which is ended in its first trial, and return its rows."""
    chosen = NewSession("demo", "P001", 1, 1, "", "en", "scripted", True, None, results)
    live = LiveSession(chosen, LIGHT)
    made: list[object] = []
    live._ready.disconnect()
    live._ready.connect(made.append)
    worst(live.open, 0.0)
    while not made:
        timed(application_here().processEvents)
        time.sleep(0.002)
    rows = {"a session, Start to first page": worst(partial(live._begin, made[0]), 1.0)}
    bridge = live.bridge
    assert bridge is not None

    def go_on() -> None:
        bridge.runner.post(Continue(bridge.parts.clock()))

    while not isinstance(bridge.participant.page, TaskPage):
        worst(go_on, 0.5)
    rows["a session, in a trial"] = worst(application_here, 5.0)
    ends = EndAsked(bridge.parts.clock(), "aborted", "measured")
    rows["a session, its end"] = worst(partial(bridge.runner.post, ends), 1.0)
    rows["a session, its windows go"] = worst(bridge.operator.close_asked.emit, 2.0)
    assert live.code == 0
    return rows


def main() -> None:
    """Measure and print."""
    application_here()
    with tempfile.TemporaryDirectory() as kept, collecting_here():
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
        rows["designer, first entry"] = worst(lambda: visit.window.go("designer"), 2.0)
        rows |= session(Path(kept) / "session")
        visit.window.close()
        visit.end()
    for name, (wall_ms, own_ms) in rows.items():
        print(f"{name:<36}{wall_ms:>8.0f} ms, own {own_ms:>4.0f} ms")


if __name__ == "__main__":
    main()
