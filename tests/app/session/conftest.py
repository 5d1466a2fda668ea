"""A bridge between two windows and a world that is told what to do."""

import re
import sys
from pathlib import Path

import pytest
from PySide6.QtCore import QCoreApplication, QEvent, QTimer
from PySide6.QtWidgets import QApplication
from shiboken6 import isValid

from study_app.app.session.bridge import SessionBridge
from study_app.app.session.parts import Parts
from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.watch import WatchedJournal
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load, source_bytes
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.wording.languages import words
from study_app.session import start
from study_app.store.progress import Progress
from study_app.viewmodels.operator import Session
from study_app.viewmodels.session.stages import stages
from tests.app.world import World

PATIENCE_MS = 150_000  # less than pytest's timeout


@pytest.fixture
def world():
    return World()


@pytest.fixture
def make(qapp, world):
    def build(blinding="double", force_limit_n=None, strip=None, **parts):
        protocol = load("demo")
        protocol = protocol.model_copy(update={"study": protocol.study.model_copy(update={"blinding": blinding})})
        schedule = build_schedule(protocol, "P001", 1)
        session = Session(
            protocol=protocol,
            schedule=schedule,
            stages=stages(protocol, schedule),
            who="Participant P001",
            expected_s=180.0,
            answers_of=8,
            lateness_limit_s=0.002,
            device_name="Mouse",
            device_icon="mouse",
            device_rows=(),
        )
        given = {
            "session": session,
            "key": draw_key(protocol, stream(1, "key").random),
            "language": "en",
            "servo": world,
            "journal": WatchedJournal(world, Progress(), world.seconds),
            "clock": world.seconds,
            "aim_m": lambda: (0.0, 0.0, 0.0),
        }
        made = Parts(**(given | parts))
        participant = ParticipantWindow(words("en"), clock=world.seconds, windowed=True, strip=strip)
        operator = OperatorWindow(
            "demo", lateness_limit_s=0.002, reach_m=0.05, pointer=True, force_limit_n=force_limit_n
        )
        for window in (participant, operator):
            window.show()
        bridge = SessionBridge(made, participant, operator)
        made_bridges.append(bridge)
        bridge.start()
        bridge.frames.stop()  # a test moves time itself
        return bridge

    made_bridges = []
    hook = sys.excepthook
    yield build
    for bridge in made_bridges:
        if isValid(bridge):
            bridge.leave_now()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert sys.excepthook is hook


@pytest.fixture
def bridge(make):
    return make()


@pytest.fixture
def nobody_stays():
    """Let no simulated person of one test look at the windows of the next, and no window wait for ever.

    The timeout of pytest raises in a slot, where it ends no event loop.
    """
    late = QTimer(singleShot=True, interval=PATIENCE_MS)
    late.timeout.connect(lambda: QCoreApplication.exit(1))
    late.start()
    yield
    late.stop()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def quick_preflight(monkeypatch):
    """Measure a tenth of a second: what is judged of it is tested by itself."""
    monkeypatch.setattr(start, "MEASURED_S", 0.1)


@pytest.fixture
def short_demo(tmp_path: Path) -> str:
    """Return the demo protocol with tasks of a second."""
    text = source_bytes("demo").decode()
    for key, value in (("min_s", "0.3"), ("count", "1"), ("dwell_s", "0.05")):
        text, found = re.subn(rf"^{key} = [\d.]+", f"{key} = {value}", text, flags=re.MULTILINE)
        assert found == 1
    path = tmp_path / "demo.toml"
    path.write_text(text)
    return str(path)


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return tmp_path / "results" / "demo"
