"""A controlled servo, store and clock, and the two windows of a session between them."""

from types import SimpleNamespace

import numpy as np

from study_app.app.session.bridge import Parts, SessionBridge, WatchedJournal
from study_app.errors import StoreError
from study_app.gui.operator.operator_view import Session, stages
from study_app.gui.operator.window import OperatorWindow
from study_app.gui.participant.window import ParticipantWindow
from study_app.haptics.model.layout import SAMPLE, records
from study_app.protocol.orders.schedule import build_schedule, draw_key, stream
from study_app.protocol.wording.languages import words
from study_app.session.pages import TaskPage
from study_app.session.transitions.events import Continue
from study_app.store.journals import journal_events
from study_app.store.session_progress.progress import Progress


class World:
    """Servo, store and clock of a session; ``done`` records their calls."""

    def __init__(self):
        self.done = []
        self.now_s = 0.0
        self.fault = None
        self.force_is_on = True
        self.overruns = 0
        self.rate_hz = 1000.0
        self.worst_gap_s = 0.001
        self.full = False
        self.broken_clock = False
        self.fingerprint = ""
        self.samples = records(SAMPLE, 0)
        self.telemetry = SimpleNamespace(reader=self._reader, position_at=lambda time_ns: (np.zeros(3), time_ns))
        self.serial = 0

    def _reader(self):
        return SimpleNamespace(read=lambda: self.samples, dropped=0)

    def load(self, _scene):
        self.serial += 1
        self.done.append("load")
        return self.serial

    def rest(self):
        self.done.append("rest")

    def stop_force(self):
        self.done.append("stop_force")
        self.force_is_on = False

    def fade_in(self):
        self.done.append("fade_in")
        self.force_is_on = True

    def now_ns(self):
        if self.broken_clock:
            raise RuntimeError("the clock fell off the wall")
        return round(self.now_s * 1e9)

    def seconds(self):
        return self.now_s

    def append(self, event, *, t_s=None, waits=True):
        if self.full:
            raise StoreError("no space left on the disk: free some")
        self.done.append((event.event, event.fields()))

    def check_flushed(self):
        pass

    def write_tables(self):
        pass

    def finish(self, status, reason=""):
        self.append(journal_events.SessionEnded(status=status, reason=reason))

    def events(self):
        return [call[0] for call in self.done if isinstance(call, tuple)]


def begin_bridge(protocol, servo, journal, clock, *, strip=None, force_limit_n=None, **parts):
    """Return the bridge of a session that has begun in its two windows; a test draws its frames."""
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
    parts_given = {
        "session": session,
        "key": draw_key(protocol, stream(1, "key").random),
        "language": "en",
        "servo": servo,
        "journal": WatchedJournal(journal, Progress(), clock),
        "clock": clock,
        "aim_m": lambda: (0.0, 0.0, 0.0),
    }
    participant = ParticipantWindow(words("en"), clock=clock, windowed=True, strip=strip)
    operator = OperatorWindow(
        protocol.study.name, lateness_limit_s=0.002, reach_m=0.05, pointer=True, force_limit_n=force_limit_n
    )
    for window in (participant, operator):
        window.show()
    bridge = SessionBridge(Parts(**(parts_given | parts)), participant, operator)
    bridge.start()
    bridge.frames.stop()
    return bridge


def begin_trial(bridge, world):
    """Advance to a trial and paint its first frame."""
    world.now_s += 1.0
    bridge.participant.event.emit(Continue(world.now_s))
    assert isinstance(bridge.participant.page, TaskPage)
    bridge.runner.frame_shown(world.now_ns(), world.now_ns())


def tick(world, at_s):
    """Return one sample of the scene now loaded, at a new time."""
    world.now_s = at_s
    sample = records(SAMPLE, 1)
    sample.time_ns = round(at_s * 1e9)
    sample.tick = round(at_s * 1000)
    sample.scene = world.serial
    sample.fresh = 1
    return sample
