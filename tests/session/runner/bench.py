"""A session on the real servo and a simulated device, on a virtual clock."""

from typing import Any

import numpy as np

from study_app.devices.hand import HandOrders, hand_of
from study_app.devices.rig import Rig
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.pages import TaskPage
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import Begin
from study_app.session.transitions.state import Phase
from tests.protocol.trials.level_studies import key_of
from tests.session.fakes import FakeJournal

TO_AND_FRO_M = 0.03
SWING_S = np.arange(0, 60, 0.005)


class Bench:
    """A session at its first interval, whose windows paint at once."""

    def __init__(self, rig: Rig, protocol: Protocol) -> None:
        key = key_of(protocol)
        self.servo = rig.servo
        hand = hand_of(rig.device)
        assert hand is not None
        self.hand: HandOrders = hand
        self.journal = FakeJournal([])
        self.pages: list[Any] = []
        ports = Ports(rig.servo, self.journal, self.present, self.clock, paints=False)
        schedule = build_schedule(protocol, "P001", 1)
        self.runner = Runner(protocol, schedule, key.codes, ports, "en", secret=key.secret)
        self.reader = rig.servo.telemetry.reader()
        self.servo.advance(20)
        self.runner.post(Begin(self.clock()))

    @property
    def state(self) -> Any:
        return self.runner.state

    def present(self, page: Any) -> None:
        self.pages.append(page)
        if isinstance(page, TaskPage) and not (page.interval and page.interval.resting):
            self.runner.frame_shown(self.servo.now_ns(), self.servo.now_ns())

    def clock(self) -> float:
        return self.servo.now_ns() / 1e9

    def swing(self) -> None:
        """Move the hand to and fro, so that whatever liquid there is resists it."""
        places = np.column_stack((TO_AND_FRO_M * np.sin(8 * SWING_S), 0 * SWING_S, 0 * SWING_S))
        self.hand.follow(SWING_S, places)

    def run(self, seconds: float) -> Any:
        """Let time pass and return the force at each tick [N] (n,)."""
        self.reader.read()
        forces = []
        for _ in range(round(seconds * 50)):
            self.servo.advance(20)
            self.runner.poll()
            forces.append(np.linalg.norm(self.reader.read().device_force_n, axis=1))
        return np.concatenate(forces)

    def run_to(self, phase: Phase) -> None:
        for _ in range(500):
            if self.state.phase is phase:
                return
            self.run(0.02)
        raise AssertionError(phase)
