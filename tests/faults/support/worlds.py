"""A session of the small study with a real store and a servo that is all memory, walked through by hand."""

from pathlib import Path
from typing import Any

from study_app.protocol.orders.schedule import build_schedule
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import Begin, Chosen, Continue, ItemShown, ResumeRequested, Submitted
from study_app.session.transitions.state import Phase
from study_app.store.journals.journal import SessionClock
from tests.journal_lines import raw
from tests.session import small
from tests.session.fakes import World
from tests.studies import begun

LEFT, RIGHT = (-0.02, 0.0, 0.0), (0.02, 0.0, 0.0)


class StoredWorld(World):
    """``World`` whose journal is a session in ``folder``."""

    def __init__(self, folder: Path, participant: str = "P001") -> None:
        super().__init__()
        who = {"operator": "AK", "device": {"name": "memory"}, "clock": SessionClock(self.servo.now_ns)}
        self.store = begun(folder, participant, small.protocol(), b"small", **who)
        plan = small.opened().plan
        ports = Ports(self.servo, self.store, self._present, self.clock, paints=False)
        schedule = build_schedule(plan.protocol, participant, 1)
        self.runner = Runner(plan.protocol, schedule, self.store.key.codes, ports, "en")

    @property
    def lines(self) -> tuple[dict[str, Any], ...]:
        return tuple(raw(self.store.lines))

    def start(self) -> None:
        self.runner.post(Begin(self.clock()))

    def step(self) -> None:
        """Advance by a page, an answer page or a part of a task."""
        state = self.state
        match state.phase:
            case Phase.READING:
                self.runner.post(Continue(self.clock()))
            case Phase.ANSWERING:
                for item in state.trial.items:
                    self.runner.post(ItemShown(self.clock(), item))
                    self.runner.post(Chosen(self.clock(), item, 5))
                self.runner.post(Submitted(self.clock()))
            case Phase.PAUSED:
                self.runner.post(ResumeRequested(self.clock(), "operator"))
            case _:
                self.run(0.3, LEFT)
                self.run(0.3, RIGHT)

    def until(self, phase: Phase) -> None:
        """Advance until this phase."""
        for _ in range(100):
            if self.state.phase is phase:
                return
            self.step()
        raise AssertionError(self.state.phase)
