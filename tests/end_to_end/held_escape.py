"""Esc held on a real X server, in a session and in the lab, each with the emulated Falcon and its force."""

import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from tests.end_to_end.real_windows import COMPILED_S, Program, virtual_display, wait_for

DELAYS_MS = (200, 300, 500, 660, None)  # until a held key repeats; None if it never does
HOLD_S = 0.6
SEEN_S = 1.5  # by then a hold has had its effect
STUDY = """format = 2
sequence = ["stir"]
study.name = "heldkeys"
liquids.thin.density_kg_m3 = 1000
liquids.thick.density_kg_m3 = 1400
tasks.explore = { kind = "explore", min_s = 1, max_s = 600, instruction = "Explore the liquid with the ball." }
scales.agree.labels.en = ["1", "2", "3", "4", "5", "6", "7"]
questionnaires.after = { intro = "How was it?", scale = "agree", items = [{ id = "t", text = "Thick", short = "T" }] }
blocks.stir = { conditions = ["thin", "thick"], order = "shuffled", questionnaire = "after" }
"""
LAB = """
import signal, sys
from PySide6.QtCore import QTimer
from study_app.app.lab_controller import LabController
from study_app.gui.application import application_here
from study_app.gui.lab.view import LabPlace

application = application_here()
place = LabPlace()
place.setWindowTitle("lab")
lab = LabController(place, device="falcon-emulated")
place.resize(1300, 760)
place.show()
told = ["stopped"]

def tell():
    state = "on" if lab.view().force_on else "stopped"
    if told[-1] != state:
        told.append(state)
        print(state, file=open(sys.argv[1], "a"), flush=True)

timer = QTimer(interval=20)
timer.timeout.connect(tell)
timer.start()
signal.signal(signal.SIGUSR1, lambda *_: place.ask("fade in"))
application.exec()
"""


class Counts(NamedTuple):
    """Counts of stopped forces, of restored forces, and of pauses without a stop."""

    stopped: int
    restored: int
    paused: int


class SessionBench:
    """A session with the emulated Falcon in its first trial."""

    def __init__(self, display: str, folder: Path) -> None:
        study = folder / "heldkeys.toml"
        study.write_text(STUDY, encoding="utf-8", newline="\n")
        options = ("--participant", "H1", "--windowed", "--device", "falcon-emulated", "--results", "results/heldkeys")
        self.program = Program(display, folder, "run", str(study), *options)
        self.xdotool = self.program.xdotool

    def open(self) -> None:
        wait_for(lambda: self.program.events("trial_started"), "the first trial", COMPILED_S)
        self.felt, self.operated = self.program.window("^Study$"), self.program.window("operator$")
        time.sleep(1.0)  # the tank's first frame, with which the force begins

    def counts(self) -> Counts:
        stops = [event for event in self.program.events("force_stopped") if event["by"] == "participant"]
        pauses = len(self.program.events("paused")) - len(stops)
        return Counts(len(stops), len(self.program.events("force_restored")), pauses)

    def focus(self) -> None:
        self.xdotool("windowfocus", "--sync", self.felt)

    def restore(self) -> None:
        self.xdotool("windowfocus", "--sync", self.operated, "key", "p")


class LabBench:
    """The lab with the emulated Falcon."""

    def __init__(self, display: str, folder: Path) -> None:
        self.told = folder / "lab.txt"
        self.program = Program(display, folder, str(self.told), program=("-c", LAB))
        self.xdotool = self.program.xdotool

    def open(self) -> None:
        wait_for(lambda: self._states()[-1:] == ["on"], "the force of the lab", COMPILED_S)
        self.window = self.program.window("^lab$")

    def _states(self) -> list[str]:
        return self.told.read_text("utf-8").split() if self.told.exists() else []

    def counts(self) -> Counts:
        states = self._states()
        return Counts(states.count("stopped"), states.count("on") - 1, 0)

    def focus(self) -> None:
        self.xdotool("windowfocus", "--sync", self.window)

    def restore(self) -> None:
        self.program.process.send_signal(signal.SIGUSR1)


@contextmanager
def opened_bench(
    made: Callable[[str, Path], SessionBench | LabBench], folder: Path
) -> Iterator[SessionBench | LabBench]:
    """Open a bench on a display of its own."""
    with virtual_display(size=(1366, 768)) as display:
        bench = made(display, folder)
        try:
            bench.open()
            yield bench
        finally:
            bench.program.close()


def count_stops(bench: SessionBench | LabBench, delay_ms: int | None, attempts: int) -> int:
    """Hold Esc for 0.6 s as often as ``attempts``, and return how often that stopped the force and nothing else.

    Enter of the participant must not restore the force; the operator then does.
    """
    repeat = ("r", "off") if delay_ms is None else ("r", "rate", str(delay_ms), "25")
    subprocess.run(["xset", "r", "on"], env=bench.program.environment, check=True)
    subprocess.run(["xset", *repeat], env=bench.program.environment, check=True)
    stops = 0
    for _ in range(attempts):
        before = bench.counts()
        bench.focus()
        bench.xdotool("keydown", "Escape")
        time.sleep(HOLD_S)
        bench.xdotool("keyup", "Escape")
        deadline = time.perf_counter() + SEEN_S
        while bench.counts().stopped == before.stopped and time.perf_counter() < deadline:
            time.sleep(0.02)
        bench.xdotool("key", "Return")
        time.sleep(0.2)
        after = bench.counts()
        stops += after == before._replace(stopped=before.stopped + 1)
        bench.restore()
        wait_for(lambda after=after: bench.counts().restored > after.restored, "the force")
        time.sleep(0.6)
    return stops
