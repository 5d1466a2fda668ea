"""Delays in a session: exact to the sample in virtual time, and measured in a complete real session."""

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication
from shiboken6 import isValid

from study_app.app import delay_session as held
from study_app.devices.simulated import ScriptedDevice
from study_app.errors import StudyError
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from study_app.protocol.load import parse
from study_app.session.trial import SETTLED_S
from tests.app.world import begin_bridge
from tests.compiled import needs_servo
from tests.session.fakes import FakeJournal

pytestmark = [pytest.mark.slow, needs_servo]

TRIAL_S = 1.0
ODD_S = (0.0, 0.0503, 0.1, 0.2)


class Room:
    """A session of delays in virtual time, whose frames a test draws."""

    def __init__(self, servo):
        self.servo = servo
        self.protocol = parse(held.study_of_delays(TRIAL_S), "delays.toml")
        self.frames = []
        limit_n = self.protocol.device.force_limit_n
        self.bridge = begin_bridge(
            self.protocol, servo, FakeJournal([]), self.seconds, recorder=self, force_limit_n=limit_n
        )

    def seconds(self):
        return self.servo.now_ns() / 1e9

    # the recorder: keeps the frames of each trial

    lost, dropped = (), 0

    def start(self, trial, _attempt, _rate_hz, _interval=None):
        self.frames.append((trial, []))

    def append(self, samples):
        pass

    def end_without_waiting(self):
        return True

    def stop(self):
        pass

    def frame(self, painted_ns, sample_ns, _video):
        self.frames[-1][1].append((painted_ns, sample_ns))

    def delay_s(self, trial):
        parts = self.bridge.parts
        (step,) = [scheduled for scheduled in parts.session.schedule.trials if scheduled.number == trial]
        return self.protocol.delay_s(parts.key[step.block][step.code])


@pytest.fixture
def room(qapp, monkeypatch):
    monkeypatch.setattr(held, "DELAYS_S", ODD_S)
    device = ScriptedDevice()
    t_s = np.arange(0, 20, 0.005)
    device.follow(t_s, np.column_stack((0.03 * np.sin(6 * t_s), 0.02 * np.cos(5 * t_s), 0.02 * np.cos(4 * t_s))))
    with device, Servo(device, clock=VirtualClock(), elements=2000) as servo:
        servo.advance(300)  # older than the longest delay
        live_room = Room(servo)
        yield live_room
        if isValid(live_room.bridge):
            live_room.bridge.leave_without_asking()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def test_each_frame_shows_the_requested_moment_at_every_delay(room):
    """Frames come at uneven times; each shows, and reports, the interpolated past position of the hand."""
    ticks = [17, 16, 17, 7, 6, 41]
    samples = []
    reader = room.servo.telemetry.reader()
    frame_count = compared = 0
    while not room.bridge.runner.finished:
        room.servo.advance(ticks[frame_count % len(ticks)])
        frame_count += 1
        assert not room.bridge.trouble, room.bridge.trouble
        samples.append(reader.read())
        count = len(room.frames[-1][1]) if room.frames else 0
        room.bridge.draw_frame()
        trial, frames = room.frames[-1]
        if len(frames) != count + 1:
            continue  # the first frame of the next trial comes with the next
        now_ns, sample_ns = frames[-1]
        assert now_ns == room.servo.now_ns()
        assert sample_ns == now_ns - round((room.delay_s(trial) + SETTLED_S) * 1e9)
        at = np.concatenate([part.time_ns for part in samples])
        places = np.concatenate([part.position_m for part in samples])
        if sample_ns < at[0]:
            continue
        expected_m = [np.interp(sample_ns, at, places[:, axis]) for axis in range(3)]
        tank = room.bridge.participant.tank
        if tank is not None and tank.view.sample_time_ns == sample_ns:
            assert tank.view.position_m == pytest.approx(expected_m, abs=1e-12)
            assert tank.ball == tank.placer.place(tuple(tank.view.position_m))
            compared += 1
    assert compared > 40 * len(ODD_S)
    assert {room.delay_s(trial) for trial, _ in room.frames} == set(ODD_S)
    assert all(len(frames) > 40 for _, frames in room.frames)


def test_a_session_of_delays_is_held_and_its_recordings_are_read(qapp, monkeypatch):
    """A short complete session with windows, servo and store shows every requested delay."""
    monkeypatch.setattr(held, "DELAYS_S", (0.0, 0.2))
    monkeypatch.setattr(held, "VIRTUAL_HZ", (60.0,))
    lines = []
    measured = held.measure_delays(0.5, "gui", progress=lines.append)
    assert lines == ["virtual, 60 Hz, tank alone", "virtual, 60 Hz, with the operator's window"]
    assert measured.loads == ("none", "gui")
    for load in measured.loads:
        trials = measured.on("virtual, 60 Hz", load)
        assert [trial.delay_s for trial in trials] == [0.0, 0.2]
        for trial in trials:
            assert trial.paced == "timed by the computer's clock"
            assert trial.frames > 2
            assert (trial.errors_ms > 1e3 * SETTLED_S - 0.001).all(), "nothing is drawn before it was settled"


@pytest.mark.parametrize("seconds", [0.0, 0.4, 601.0, float("nan")])
def test_times_that_make_no_sense_are_refused(seconds):
    with pytest.raises(StudyError, match=r"each delay must be shown for 0\.5 to 600 s"):
        held.measure_delays(seconds, "none")
