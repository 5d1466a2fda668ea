"""Holds a session in windows that stops itself within a trial, as SIGSTOP does: run as a program.

It is held as `run` holds it, by a scripted hand in real time. Whoever started it sends SIGCONT after a while. Then the
operator resumes what the program paused, and ends the session after that trial.
"""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

from study_app import app
from study_app.app import live_session
from study_app.gui import beginning
from study_app.gui.application import application_here
from study_app.gui.machine import Machine
from study_app.gui.operator import OperatorWindow
from study_app.gui.participant import ParticipantWindow
from study_app.session.pages import PausePage, QuestionnairePage, TaskPage, TextPage
from tests.faults import short
from tests.faults.windows import Person


def main(folder: str) -> int:
    machines: list[Machine] = []
    open_machine = live_session.open_machine
    live_session.open_machine = lambda *a, **k: machines.append(open_machine(*a, **k)) or machines[-1]
    beginning.MEASURED_S = 0.1
    stopped: list[int] = []

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if isinstance(participant.page, PausePage):
            operator.resume_asked.emit()
            return True
        if not stopped and isinstance(participant.page, TaskPage):
            newest = machines[0].servo.telemetry.latest()
            if newest is not None and newest["scene"] > 0:  # the liquid is felt
                stopped.append(int(newest["scene"]))
                os.kill(os.getpid(), signal.SIGSTOP)
        if stopped and isinstance(participant.page, QuestionnairePage | TextPage):
            operator.end_asked.emit("aborted", "seen")
            return True
        return False

    application = application_here()
    person = Person(watch)
    code = app.run(
        str(short.write(Path(folder))),
        participant="P001",
        device="scripted",
        windowed=True,
        seed=3,
        results=Path(folder) / "results",
    )
    person.leave()
    application.quit()
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
