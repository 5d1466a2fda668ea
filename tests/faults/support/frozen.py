"""Holds a session in windows that stands still within a trial: run as a program.

It is held as `run` holds it, by a scripted hand in real time. The process is stopped when the liquid is felt, until
whoever started it sends SIGCONT. Then the operator resumes what the program paused, and ends the session after that
trial.
"""

import os
import re
import signal
import sys
from pathlib import Path

from study_app import app
from study_app.app.session import live_session
from study_app.devices.rig import Rig
from study_app.gui.application import application_here
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.session import start
from study_app.session.pages import PausePage, QuestionnairePage, TaskPage, TextPage
from tests.faults.support import short
from tests.faults.support.watched_program import Person

LONGEST_S = "2"


def main(folder: str) -> int:
    machines: list[Rig] = []
    open_rig = live_session.open_rig
    live_session.open_rig = lambda *a, **k: machines.append(open_rig(*a, **k)) or machines[-1]
    start.MEASURED_S = 0.1
    stopped: list[int] = []

    def watch(participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if isinstance(participant.page, PausePage):
            operator.ask("resume")
            return True
        if not stopped and isinstance(participant.page, TaskPage):
            newest = machines[0].servo.telemetry.latest()
            if newest is not None and newest["scene"] > 0:  # the liquid is felt
                stopped.append(int(newest["scene"]))
                os.kill(os.getpid(), signal.SIGSTOP)
        if stopped and isinstance(participant.page, QuestionnairePage | TextPage):
            operator.ask("end", "aborted", "seen")
            return True
        return False

    protocol = short.write(Path(folder))
    text, count = re.subn(
        r"^max_s = 30\b", f"max_s = {LONGEST_S}", protocol.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    assert count == 1
    protocol.write_text(text, encoding="utf-8", newline="\n")
    application = application_here()
    person = Person(watch)
    code = app.run(
        str(protocol), participant="P001", device="scripted", windowed=True, seed=3, results=Path(folder) / "results"
    )
    person.leave()
    application.quit()
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
