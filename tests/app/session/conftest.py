"""A bridge between two windows and a world that is told what to do."""

from __future__ import annotations

import sys

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication
from shiboken6 import isValid

from study_app.app.session.bridge import SessionBridge
from study_app.app.session.parts import Parts
from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.watch import WatchedJournal
from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.wording.languages import words
from study_app.viewmodels.operator import Session
from study_app.viewmodels.session_stages import SessionProgress, stages
from tests.app.session.world import World


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
            stages=stages(protocol, schedule),
            who="Participant P001",
            expected_s=180.0,
            answers_of=8,
            lateness_limit_s=0.002,
            device_name="Mouse",
            device_kind="mouse",
            device_rows=(),
        )
        given = {
            "session": session,
            "schedule": schedule,
            "key": draw_key(protocol, stream(1, "key").random),
            "language": "en",
            "servo": world,
            "journal": WatchedJournal(world, SessionProgress(protocol, schedule), world.seconds),
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
        bridge = SessionBridge(made, participant, operator, strip=strip)
        made_bridges.append(bridge)
        bridge.start()
        bridge._frames.stop()  # a test moves time itself
        return bridge

    made_bridges = []
    hook = sys.excepthook
    yield build
    for bridge in made_bridges:
        if isValid(bridge):
            bridge._leave()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert sys.excepthook is hook


@pytest.fixture
def bridge(make):
    return make()
