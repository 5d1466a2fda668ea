"""A session in real windows in which a device, a panel and the recorder fail in turn: run as a program.

With the emulated Falcon, driven by keys and clicks. It prints one JSON object: what was seen and measured at each
step. With a folder for pictures, a picture of the screens is kept at each step.
"""

import json
import sys
import threading
from pathlib import Path
from typing import Any

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QWidget

from study_app import app
from study_app.app.session import live_session
from study_app.devices.rig import Rig
from study_app.gui.application import application_here
from study_app.gui.kit.dialogs import Question
from study_app.gui.operator import session_panels
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.widgets.live_plots import TracePlot
from study_app.session import start
from study_app.session.pages import PausePage, TaskPage, TroublePage
from study_app.store import recordings
from tests.faults.support import short
from tests.faults.support.watched_program import Person

LEFT = Qt.MouseButton.LeftButton


class Scene:
    """What happens to the session, step by step; ``told`` is what was seen."""

    def __init__(self, rigs: list[Rig], pictures: Path | None) -> None:
        self.rigs, self.pictures = rigs, pictures
        self.told: dict[str, Any] = {"errors": []}
        self.step = self.unplug

    def __call__(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        try:
            return self.mend(participant, operator) or bool(self.step(participant, operator))
        except Exception as error:
            self.told["errors"].append(f"{self.step.__name__}: {error!r}")
            operator.may_close = True
            raise

    def mend(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        """Reconnect a device that failed by itself: a machine under load is too slow for the emulated one."""
        expected = self.step in (self.try_while_unplugged, self.plug_in)
        if expected or (self.step == self.resume and isinstance(participant.page, PausePage)):
            return False
        if isinstance(participant.page, TroublePage) and operator.banner.reconnect.isEnabled():
            self.told["failed by itself"] = self.told.get("failed by itself", 0) + 1
            QTest.mouseClick(operator.banner.reconnect, LEFT)
        elif isinstance(participant.page, PausePage):
            QTest.mouseClick(operator.buttons.pause, LEFT)
        return isinstance(participant.page, TroublePage | PausePage)

    @property
    def rig(self) -> Rig:
        return self.rigs[0]

    def picture(self, name: str) -> None:
        if self.pictures is not None:
            for number, screen in enumerate(QGuiApplication.screens(), start=1):
                screen.grabWindow(0).save(str(self.pictures / f"{name}-{number}.png"))

    # The device.

    def unplug(self, participant: ParticipantWindow, _operator: OperatorWindow) -> bool:
        if isinstance(participant.page, TaskPage) and participant.tank is not None and participant.tank.isVisible():
            self.rig.device.hand.faults.on("unplugged")
            self.step = self.try_while_unplugged
        return isinstance(participant.page, TaskPage)

    def try_while_unplugged(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if isinstance(participant.page, TroublePage) and operator.banner.reconnect.isVisible():
            if not operator.isActiveWindow():  # then it hears no keys
                operator.bring_forward()
                return True
            self.told["lost"] = {
                "force": self.rig.servo.force_is_on,
                "banner": operator.banner.what.text(),
                "advice": operator.banner.then.text(),
                "page": participant.page.paragraph,
                "banner_in_window": operator.rect().contains(
                    operator.banner.reconnect.mapTo(operator, QPoint(5, operator.banner.reconnect.height() - 5))
                ),
            }
            self.picture("lost")
            QTest.keyClick(operator, Qt.Key.Key_C)
            self.step = self.plug_in
        return True

    def plug_in(self, _participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        said = operator.banner.then.text()
        if said.startswith("Not connected"):
            self.told["still unplugged"] = said
            self.picture("not-connected")
            self.rig.device.hand.faults.off("unplugged")
            QTest.mouseClick(operator.banner.reconnect, LEFT)
            self.told["button while connecting"] = operator.banner.reconnect.isEnabled()
            self.step = self.resume
        return True

    def resume(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if isinstance(participant.page, PausePage):
            self.told["reconnected"] = {
                "force": self.rig.servo.force_is_on,
                "fault": self.rig.servo.fault,
                "held": participant.page.held,
                "banner": operator.banner.isVisible(),
                "resume": operator.buttons.pause.text(),
            }
            QTest.keyClick(participant, Qt.Key.Key_Return)  # the participant cannot resume
            self.told["resumed by the participant"] = not isinstance(participant.page, PausePage)
            self.picture("reconnected")
            QTest.mouseClick(operator.buttons.pause, LEFT)
            self.step = self.break_panels
        return True

    # A plot and a panel, in the same trial, presented again.

    def break_panels(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        if isinstance(participant.page, TaskPage):
            self.told["force in the next attempt"] = self.rig.servo.force_is_on
            self.painter, session_panels.smooth_painter = session_panels.smooth_painter, _begins_and_fails
            self.drawn, TracePlot.show_traces = TracePlot.show_traces, _fails
            operator.update()
            self.step = self.see_lines
        return True

    def see_lines(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        failed = [label.text() for label in operator.findChildren(QLabel) if "session continues" in label.text()]
        if len(failed) == 2:
            self.told["panels"] = sorted(failed)
            self.told["force with failed panels"] = self.rig.servo.force_is_on
            self.told["trouble with failed panels"] = operator.banner.isVisible()
            operator.bring_forward()
            self.step = self.see_lines_in_front
        return len(failed) < 2

    def see_lines_in_front(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        QGuiApplication.processEvents()
        self.picture("panels")
        participant.bring_forward()
        session_panels.smooth_painter, TracePlot.show_traces = self.painter, self.drawn
        self.samples_file, recordings.SamplesFile = recordings.SamplesFile, _ends
        self.trial = participant.page.trial if isinstance(participant.page, TaskPage) else None
        self.step = self.lose_recording
        return False

    # The recorder, in the next trial.

    def lose_recording(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        lost = operator.rail.tally.beyond.text()
        notices = [label.text() for label in operator.findChildren(QLabel) if "recorder" in label.text()]
        if "lost" in lost and notices:  # the tally may be shown first
            recordings.SamplesFile = self.samples_file
            self.told["recording"] = lost
            self.told["page at the loss"] = type(participant.page).__name__
            self.told["force without a recording"] = self.rig.servo.force_is_on
            self.told["notices"] = notices
            operator.bring_forward()
            self.step = self.see_loss
        return False

    def see_loss(self, participant: ParticipantWindow, operator: OperatorWindow) -> bool:
        QGuiApplication.processEvents()
        self.picture("recorder")
        for notice in operator.findChildren(Question):
            notice.accept()
        participant.bring_forward()
        self.step = self.go_on
        return False

    def go_on(self, _participant: ParticipantWindow, _operator: OperatorWindow) -> bool:
        return False


def _begins_and_fails(widget: QWidget) -> QPainter:
    painter = QPainter(widget)
    painter.drawLine(0, 0, 10, 10)
    raise ValueError("no such colour")


def _fails(*_arguments: object) -> None:
    raise ValueError("no such curve")


class Ended(BaseException):
    """An exception that no handler catches."""


def _ends(*_arguments: object) -> None:
    raise Ended("pulled")


def main(folder: str, pictures: str = "") -> None:
    start.MEASURED_S = 0.7  # the force has faded in by the first trial, as in a real session
    rigs: list[Rig] = []
    open_rig = live_session.open_rig
    live_session.open_rig = lambda *a, **k: rigs.append(open_rig(*a, **k)) or rigs[-1]
    scene = Scene(rigs, Path(pictures) if pictures else None)
    application_here()
    person = Person(scene)
    code = app.run(
        str(short.write(Path(folder))),
        participant="P001",
        device="falcon-emulated",
        seed=3,
        results=Path(folder) / "results",
    )
    person.leave()
    scene.told |= {
        "code": code,
        "step": scene.step.__name__,
        "threads": [thread.name for thread in threading.enumerate() if thread.name == "reconnecting"],
    }
    sys.stdout.write(json.dumps(scene.told))


if __name__ == "__main__":
    main(*sys.argv[1:])
