"""No picture reveals the felt liquid or the visual delay: the same motion looks the same in every trial."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.load import load
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.session.pages import Page, QuestionnairePage, TaskPage, TextPage
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import Begin, Chosen, Continue, Submitted, TaskDone
from study_app.session.trial import SETTLED_S
from tests.gui.participant.driver import Participant
from tests.gui.small import ManualClock
from tests.session.fakes import FakeJournal, FakeServo

pytestmark = pytest.mark.slow

STEP_S = 0.02
LASTS_S = 3.0
LOOKS_S = (0.30, 0.74, 1.28, 1.66, 2.42)  # seconds into the trial; between them the ring closes


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    return load("rek2024")


class Held:
    """A session up to the first trial of a block, in a given condition."""

    def __init__(self, protocol: Protocol, block: str, condition: str) -> None:
        schedule = build_schedule(protocol, "P001", 1)
        key = {name: dict(codes) for name, codes in draw_key(protocol, stream(1, "key").random).items()}
        first = next(trial for trial in schedule.trials if trial.block == block)
        was = key[block][first.code]
        other = next(code for code, name in key[block].items() if name == condition)
        key[block] |= {first.code: condition, other: was}
        log: list[Any] = []
        self.page: Page | None = None
        self.clock = ManualClock()
        self.servo = FakeServo(log)
        ports = Ports(self.servo, FakeJournal(log), self._present, self.clock, paints=False)
        self.runner = Runner(protocol, schedule, key, ports, "en")
        self.delay_s = protocol.delay_s(condition)
        self.runner.post(Begin(self.clock()))
        while not (isinstance(self.page, TaskPage) and self.page.trial == first.number):
            self._pass()
        self.began_ns = self.servo.now_ns()
        self.runner.frame_shown(self.began_ns, self.began_ns)

    def _present(self, page: Page) -> None:
        self.page = page

    def _pass(self) -> None:
        """Continue past a page that is not checked."""
        match self.page:
            case TextPage():
                self.runner.post(Continue(self.clock()))
            case TaskPage():
                self.runner.post(TaskDone(self.clock(), "complete", {}))
            case QuestionnairePage(items=items):
                for item in items:
                    self.runner.post(Chosen(self.clock(), item.id, 4))
                self.runner.post(Submitted(self.clock()))

    def move(self) -> None:
        """Move from target to target with pauses, in the same way for every condition."""
        for step in range(round((LASTS_S + self.delay_s) / STEP_S)):
            turn = math.tau * step * STEP_S / 2.4
            x = max(-0.030, min(0.030, 0.055 * math.sin(turn)))
            self.servo.run(STEP_S, (x, 0.004 * math.sin(3 * turn), 0.003 * math.cos(2 * turn)))
            self.runner.poll()

    def pictures(self, window: ParticipantWindow) -> list[QImage]:
        """Return the participant's pictures of the motion at `LOOKS_S`, each after the visual delay."""
        assert isinstance(self.page, TaskPage)
        window.show_page(self.page)
        images = []
        for look_s in LOOKS_S:
            now_ns = self.began_ns + round((look_s + self.delay_s + SETTLED_S) * 1e9)
            view = self.runner.view(now_ns)
            assert view is not None
            window.show_view(view)
            QApplication.processEvents()
            images.append(window.grab().toImage())
        return images


@pytest.mark.parametrize(
    ("block", "conditions"),
    [("liquids", ("water", "honey", "light_oil")), ("delays", ("delay_0", "delay_75", "delay_200"))],
)
def test_the_same_motion_makes_the_same_pixels_in_every_condition(
    opening: Callable[..., Participant], protocol: Protocol, block: str, conditions: tuple[str, ...]
) -> None:
    window = opening(size=(1024, 640)).window
    by_condition: list[tuple[Page | None, list[QImage]]] = []
    for condition in conditions:
        held = Held(protocol, block, condition)
        held.move()
        by_condition.append((held.page, held.pictures(window)))
    page, pictures = by_condition[0]
    assert all(picture != next_picture for picture, next_picture in pairwise(pictures))  # the motion is seen
    for other_page, others in by_condition[1:]:
        assert other_page == page
        assert others == pictures
