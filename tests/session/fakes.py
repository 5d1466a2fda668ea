"""A world for the runner that is all memory: a servo, a journal, a screen and a clock that moves when told."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from study_app.errors import StoreError
from study_app.haptics.model.scene import Scene
from study_app.session.pages import TaskPage
from study_app.session.ports import Ports
from study_app.session.runner import Runner
from study_app.session.transitions.events import Chosen, Continue, Submitted
from study_app.session.transitions.state import Phase, SessionState
from study_app.store.journals.journal_events import Event
from tests.session import small

LEFT, RIGHT, AWAY = (-0.02, 0.0, 0.0), (0.02, 0.0, 0.0), (0.0, 0.01, 0.0)


class FakeTelemetry:
    def __init__(self) -> None:
        self.samples = small.samples([], np.zeros((0, 3)))
        self.read_until = 0
        self.dropped = 0

    def reader(self) -> FakeTelemetry:
        return self

    def read(self) -> Any:
        new = self.samples[self.read_until :]
        self.read_until = len(self.samples)
        return new

    def position_at(self, time_ns: int) -> tuple[Any, int]:
        """Without interpolation: the newest sample not after ``time_ns``."""
        index = max(int(np.searchsorted(self.samples.time_ns, time_ns, side="right")) - 1, 0)
        return self.samples.position_m[index], int(self.samples.time_ns[index])


class FakeServo:
    """Its time is that of the last sample; ``run`` makes samples at 1 kHz under the scene loaded."""

    rate_hz = 1000.0
    worst_gap_s = 0.001

    def __init__(self, log: list[Any]) -> None:
        self.telemetry = FakeTelemetry()
        self.fault: str | None = None
        self.refuses: Exception | None = None
        self.scenes: list[Scene] = []
        self.scene = 0
        self.ticks = 0
        self.force_is_on = True
        self._log = log

    def run(self, seconds: float, position_m: Any = (0.0, 0.0, 0.0), **fields: Any) -> None:
        count = round(seconds * 1000)
        ticks = np.arange(self.ticks + 1, self.ticks + count + 1)
        samples = small.samples(ticks / 1000, np.tile(position_m, (count, 1)), tick=ticks, scene=self.scene, **fields)
        self.telemetry.samples = np.concatenate((self.telemetry.samples, samples)).view(np.recarray)
        self.ticks += count

    def now_ns(self) -> int:
        return self.ticks * 1_000_000

    def load(self, scene: Scene) -> int:
        if self.refuses is not None:
            raise self.refuses
        self._log.append("load")
        self.scenes.append(scene)
        self.scene = len(self.scenes)
        return self.scene

    def adjust(self, scene: Scene) -> int:
        self._log.append("adjust")
        self.scenes.append(scene)
        self.scene = len(self.scenes)
        return self.scene

    def rest(self) -> None:
        self._log.append("rest")
        self.scene = 0

    def stop_force(self) -> None:
        self._log.append("stop_force")
        self.force_is_on = False

    def fade_in(self) -> None:
        self._log.append("fade_in")
        self.force_is_on = True


class FakeJournal:
    """Keeps lines; after ``fails_after`` lines the disk is full; ``unflushed`` is why lines could not be flushed."""

    def __init__(self, log: list[Any]) -> None:
        self.lines: list[dict[str, Any]] = []
        self.waited: list[str] = []
        self.fails_after: int | None = None
        self.finish_fails = False
        self.unflushed: str | None = None
        self.tables_written = 0
        self.status: str | None = None
        self.fingerprint = ""
        self._log = log

    def append(self, event: Event, *, t_s: float | None = None, waits: bool = True) -> None:
        if self.fails_after is not None and len(self.lines) >= self.fails_after:
            raise StoreError("disk full")
        self._log.append(event.event)
        self.waited += [event.event] if waits else []
        self.lines.append({"event": event.event, "t_s": t_s, **event.fields()})

    def check_flushed(self) -> None:
        if self.unflushed is not None:
            raise StoreError(self.unflushed)

    def write_tables(self) -> None:
        if self.fails_after is None:
            self.tables_written += 1

    def finish(self, status: str, reason: str = "") -> None:
        self._log.append("finish")
        self.status = status
        if self.finish_fails:
            raise StoreError("no room for the receipt")
        self.fingerprint = "k3vq-7m2p-xw4d"

    def of(self, event: str) -> list[dict[str, Any]]:
        return [line for line in self.lines if line["event"] == event]


class World:
    """A runner of the small study with fake ports; ``log`` lists the calls in order.

    With ``paints`` a tank's first frame is painted as soon as its page is presented.
    """

    def __init__(self, seed: int = 1, recorder: Any = None, **ports: Any) -> None:
        self.log: list[Any] = []
        self.servo = FakeServo(self.log)
        self.journal = FakeJournal(self.log)
        self.pages: list[Any] = []
        self.on_page: Callable[[Any], None] = lambda _page: None
        self.paints = True
        plan = small.opened(seed).plan
        ports = Ports(self.servo, self.journal, self._present, self.clock, recorder, paints=False, **ports)
        self.runner = Runner(plan.protocol, plan.schedule, plan.key, ports, plan.language)

    def clock(self) -> float:
        return self.servo.now_ns() / 1e9

    @property
    def state(self) -> SessionState:
        return self.runner.state

    def run(self, seconds: float, position_m: Any = (0.0, 0.0, 0.0), **fields: Any) -> None:
        """Advance the time and poll the device once."""
        self.servo.run(seconds, position_m, **fields)
        self.runner.poll()

    def _present(self, page: Any) -> None:
        self.log.append(type(page).__name__)
        self.pages.append(page)
        if self.paints and isinstance(page, TaskPage):
            self.runner.frame_shown(self.servo.now_ns(), self.servo.now_ns())
        self.on_page(page)


def step(world: World) -> None:
    """Advance the session by one page, or by one target of a reaching task."""
    state = world.state
    if state.phase is Phase.READING:
        world.runner.post(Continue(world.clock()))
    elif state.phase is Phase.ANSWERING:
        for item in state.trial.items:
            world.runner.post(Chosen(world.clock(), item, 4))
        world.runner.post(Submitted(world.clock()))
    else:
        world.run(0.3, LEFT)
        if (world.state.phase, world.state.index) == (state.phase, state.index):
            world.run(0.3, RIGHT)
