"""How long an answer takes to become the next page: kept on the disk, then composed, shown and painted.

Run it by itself: ``python tests/benchmarks/windows/answer.py [PROTOCOL] [ANSWERS] [FOLDER]``. Each answer is a page of
statements that is confirmed: from the key that confirms it to the end of the first painting of what follows, in a
window of 1366 × 768 without a screen, with a journal whose lines are flushed to the disk of FOLDER (default: the
system's temporary one). A plain write and flush on the same disk is timed as well: an answer waits for that most of the
time. A page of statements that are shown, and a look at the device with which a target is reached, wait for no flush.
"""

import os
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtWidgets import QApplication

from study_app.errors import SessionError
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load, parse, source_bytes
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.wording.languages import words
from study_app.session.pages import Page, TaskPage
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import Begin, Chosen, Continue, Event, ItemShown, Submitted
from study_app.session.transitions.state import Phase
from study_app.store.clock import SessionClock
from study_app.store.sessions.begin import SessionStart, begin
from tests.session.fakes import FakeServo


def main(name: str = "rek2024", answers: int = 100, folder: str = "") -> None:
    """Answer through sessions until there are enough, and print the table."""
    application = QApplication.instance() or QApplication([])
    pages_ms: list[float] = []
    choices_ms: list[float] = []
    shown_ms: list[float] = []
    reached_ms: list[float] = []
    took_ms = pages_ms, choices_ms, shown_ms, reached_ms
    with tempfile.TemporaryDirectory(dir=folder or None) as scratch:
        number = 0
        while len(pages_ms) < answers:
            number += 1
            session(application, name, Path(scratch) / "results", f"P{number:03d}", *took_ms)
        flush_ms = flushes(Path(scratch) / "probe")
    print(f"{load(name).study.name}: {len(pages_ms)} pages answered in {number} sessions, offscreen")
    print("                                   p50 ms    p99 ms    max ms")
    for what, took in (
        ("page confirmed → next page painted", pages_ms),
        ("choice → on the disk", choices_ms),
        ("statements of a page shown", shown_ms),
        ("look at the device, target reached", reached_ms),
        ("4 kB written and flushed, bare", flush_ms),
    ):
        p50, p99 = np.percentile(took, (50, 99))
        print(f"{what:<34} {p50:7.2f} {p99:9.2f} {max(took):9.2f}")


def session(
    application: object,
    name: str,
    results: Path,
    participant: str,
    pages_ms: list[float],
    choices_ms: list[float],
    shown_ms: list[float],
    reached_ms: list[float],
) -> None:
    """Go through a session with a servo that is all memory; time what follows each answer."""
    source = source_bytes(name)
    study = parse(source, name)
    servo = FakeServo([])
    clock = SessionClock(servo.now_ns)
    store = begin(
        results,
        study,
        source,
        SessionStart(
            participant,
            seed=1,
            operator="",
            language=study.study.languages[0],
            device={"name": "memory"},
            screens={},
            simulated=True,
        ),
        clock=clock,
    )
    window = ParticipantWindow(words(study.study.languages[0]), clock=clock.seconds, windowed=True)
    window.open_on()

    def present(page: Page) -> None:
        window.show_page(page)
        if isinstance(page, TaskPage):
            runner.frame_shown(servo.now_ns(), servo.now_ns())

    ports = Ports(servo, store, present, clock.seconds, paints=False)
    runner = Runner(study, build_schedule(study, participant, 1), store.key.codes, ports, study.study.languages[0])

    def hear(event: Event) -> None:
        with suppress(SessionError):  # a page says what it shows when it is seen, which may be too late here
            runner.post(event)

    window.event.connect(hear)
    runner.post(Begin(clock.seconds()))
    places = [target for task in study.tasks.values() for target in getattr(task, "targets_m", ())] or [(0.0, 0.0, 0.0)]
    tick = 0
    while not runner.finished:
        state = runner.state
        if state.phase is Phase.READING:
            runner.post(Continue(clock.seconds()))
        elif state.phase is Phase.ANSWERING:
            began = time.perf_counter()
            for item in state.trial.items:
                runner.post(ItemShown(clock.seconds(), item))
            shown_ms.append((time.perf_counter() - began) * 1e3)
            for item in state.trial.items:
                began = time.perf_counter()
                runner.post(Chosen(clock.seconds(), item, 4))
                choices_ms.append((time.perf_counter() - began) * 1e3)
            began = time.perf_counter()
            runner.post(Submitted(clock.seconds()))
            window.widget.repaint()
            pages_ms.append((time.perf_counter() - began) * 1e3)
        else:
            servo.run(1.0, places[tick % len(places)])
            runner.post(Continue(clock.seconds()))
            lines = len(store.lines)
            began = time.perf_counter()
            runner.poll()
            if any(line["event"] == "target_reached" for line in store.lines[lines:]):
                reached_ms.append((time.perf_counter() - began) * 1e3)
            tick += 1
        QApplication.processEvents()
    window.may_close = True
    window.close()
    store.close()


def flushes(path: Path) -> list[float]:
    """Return how long writing and flushing 4 kB takes, a hundred times [ms]."""
    took: list[float] = []
    with path.open("wb", buffering=0) as file:
        for _ in range(100):
            began = time.perf_counter()
            file.write(b"x" * 4096)
            os.fsync(file.fileno())
            took.append((time.perf_counter() - began) * 1e3)
    return took


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]), *sys.argv[3:4])
