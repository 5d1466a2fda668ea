"""The bridge between Qt and a session: events in, views out, and zero force whatever fails."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from shiboken6 import isValid

from study_app.errors import StoreError
from study_app.gui.bridge import Parts, SessionBridge
from study_app.gui.operator import OperatorWindow
from study_app.gui.operator.progress import SessionProgress, stages
from study_app.gui.operator.view import Session
from study_app.gui.operator.watch import WatchedJournal
from study_app.gui.participant import ParticipantWindow
from study_app.haptics.layout import SAMPLE, records
from study_app.protocol.load import load
from study_app.protocol.schedule import build_schedule, draw_key, stream
from study_app.protocol.words import words
from study_app.session.events import Continue, ForceStopped, ResumeAsked, Submitted
from study_app.session.pages import EndPage, PausePage, TaskPage, TextPage, TroublePage

# The platform without a screen cannot limit or raise windows, and says so.


class World:
    """Servo, store and clock of a session, with everything they were asked in ``done``."""

    def __init__(self):
        self.done = []
        self.now_s = 0.0
        self.fault = None
        self.force_is_on = True
        self.overruns = 0
        self.rate_hz = 1000.0
        self.full = False
        self.broken_clock = False
        self.samples = records(SAMPLE, 0)
        self.telemetry = SimpleNamespace(reader=self._reader, position_at=lambda time_ns: (np.zeros(3), time_ns))
        self._serial = 0

    def _reader(self):
        return SimpleNamespace(read=lambda: self.samples, dropped=0)

    def load(self, _scene):
        self._serial += 1
        self.done.append("load")
        return self._serial

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

    def append(self, event, *, t_s=None, **fields):
        if self.full:
            raise StoreError("no space left on the disk: free some")
        self.done.append((event, fields))

    def write_tables(self):
        pass

    def finish(self, status, reason=""):
        self.append("session_ended", status=status, reason=reason)

    def events(self):
        return [done[0] for done in self.done if isinstance(done, tuple)]


@pytest.fixture
def world():
    return World()


@pytest.fixture
def make(qapp, world):
    def build(**parts):
        protocol = load("demo")
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
        made = Parts(
            session=session,
            schedule=schedule,
            key=draw_key(protocol, stream(1, "key").random),
            language="en",
            servo=world,
            journal=WatchedJournal(world, SessionProgress(protocol, schedule), world.seconds),
            clock=world.seconds,
            aim_m=lambda: (0.0, 0.0, 0.0),
            **parts,
        )
        participant = ParticipantWindow(words("en"), clock=world.seconds, windowed=True)
        operator = OperatorWindow("demo", lateness_limit_s=0.002, reach_m=0.05, pointer=True)
        for window in (participant, operator):
            window.show()
        bridge = SessionBridge(made, participant, operator)
        made_bridges.append(bridge)
        bridge.start()
        for timer in bridge._timers:
            timer.stop()  # a test moves time itself
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


def begin_trial(bridge, world):
    world.now_s += 1.0
    bridge.participant.event.emit(Continue(world.now_s))
    assert isinstance(bridge.participant.page, TaskPage)


def test_starting_shows_the_first_page_to_both(bridge, world):
    assert isinstance(bridge.participant.page, TextPage)
    assert bridge.operator.rail.heading.text() == "A first look"
    assert world.events() == ["page_shown"]


def test_stop_force_reaches_the_servo_before_the_disk(bridge, world):
    begin_trial(bridge, world)
    before = len(world.done)
    bridge.operator.stop_asked.emit()
    after = world.done[before:]
    assert after[0] == "stop_force"
    assert "force_stopped" in world.events()
    assert isinstance(bridge.participant.page, PausePage)
    assert bridge.operator.stop.word.text() == "Force is off"


def test_stop_force_works_with_a_full_disk(bridge, world, caplog):
    begin_trial(bridge, world)
    world.full = True
    bridge.operator.stop_asked.emit()
    assert not world.force_is_on
    assert isinstance(bridge.participant.page, TroublePage)
    assert "No space left" in bridge.operator.banner.what.text()
    assert bridge.operator.header.state.word == "Waiting for the disk"
    assert "no space left" in caplog.text
    caplog.clear()


def test_when_there_is_space_again_the_session_goes_on_paused_with_nothing_lost(bridge, world, caplog):
    begin_trial(bridge, world)
    world.full = True
    bridge.operator.mark_set.emit()
    bridge.operator.note_written.emit("dropped while the disk is full")
    assert "Make room" in bridge.operator.banner.then.text()
    assert bridge.operator.device.chip.word == "Ready"
    world.full = False
    world.now_s += 2.0
    bridge._frame()
    assert isinstance(bridge.participant.page, PausePage)
    assert not bridge.operator.banner.isVisible()
    assert ("note", {"kind": "mark", "text": ""}) in world.done
    bridge.operator.fade_in_asked.emit()
    assert isinstance(bridge.participant.page, TaskPage)
    assert world.force_is_on
    assert "takes data again" in caplog.text
    caplog.clear()


def test_the_participants_stop_reaches_the_servo_at_once(bridge, world):
    begin_trial(bridge, world)
    bridge.participant.event.emit(ForceStopped(world.now_s, "participant"))
    assert not world.force_is_on
    assert ("force_stopped", {"by": "participant"}) in world.done


def test_the_participant_cannot_bring_back_a_force_that_the_operator_stopped(bridge, world):
    begin_trial(bridge, world)
    bridge.operator.stop_asked.emit()
    assert bridge.participant.page == PausePage(force_off=True, held="force")
    before = list(world.done)
    QTest.keyClick(bridge.participant.widget, Qt.Key.Key_Return)
    bridge.participant.event.emit(ResumeAsked(world.now_s, "participant"))
    assert not world.force_is_on
    assert world.done == before
    bridge.operator.fade_in_asked.emit()
    assert world.force_is_on
    assert ("force_restored", {"by": "operator"}) in world.done


def test_fade_in_brings_the_force_back_and_the_trial_again(bridge, world):
    begin_trial(bridge, world)
    bridge.operator.stop_asked.emit()
    bridge.operator.fade_in_asked.emit()
    assert world.force_is_on
    assert isinstance(bridge.participant.page, TaskPage)
    assert world.events().count("trial_started") == 2


def test_an_exception_in_a_slot_ends_in_zero_force(bridge, world, caplog):
    begin_trial(bridge, world)
    world.broken_clock = True
    bridge._frame()
    assert "stop_force" in world.done
    assert not world.force_is_on
    assert "the clock fell off the wall" in caplog.text
    caplog.clear()
    world.broken_clock = False
    bridge._tiles()
    assert "the clock fell off the wall" in bridge.operator.banner.what.text()


def test_what_breaks_again_and_again_is_written_once(bridge, world, caplog):
    begin_trial(bridge, world)
    bridge.participant.show_view = None  # not callable: every frame fails
    for _ in range(5):
        world.now_s += 0.1
        bridge._frame()
    assert world.events().count("broke") == 1
    assert len(caplog.records) == 1
    caplog.clear()
    assert isinstance(bridge.participant.page, TroublePage)
    assert isinstance(bridge.failure, TypeError)


def test_an_exception_in_painting_ends_in_zero_force_too(bridge, world, caplog, monkeypatch):
    begin_trial(bridge, world)
    heard = []
    monkeypatch.setattr(bridge, "_hook_before", lambda *error: heard.append(error))
    error = ValueError("no such colour")
    sys.excepthook(ValueError, error, None)
    assert not world.force_is_on
    assert isinstance(bridge.participant.page, TroublePage)
    assert heard == [(ValueError, error, None)]
    monkeypatch.undo()
    assert "no such colour" in caplog.text
    caplog.clear()


def test_an_event_that_comes_too_late_changes_nothing(bridge, world):
    before = list(world.done)
    bridge.participant.event.emit(Submitted(world.now_s))
    assert world.done == before
    assert bridge.trouble == ""
    assert world.force_is_on


def test_a_servo_fault_calls_the_operator(bridge, world):
    begin_trial(bridge, world)
    world.fault = "the device 'mouse' stopped answering; plug it in again and start anew"
    bridge._frame()
    assert isinstance(bridge.participant.page, TroublePage)
    assert "stopped answering" in bridge.operator.banner.what.text()
    assert "stopped answering" not in bridge.participant.page.paragraph
    assert bridge.operator.device.chip.word == "Fault"
    bridge._frame()
    assert dict(bridge.view().device.rows)["Safety faults"] == "1"
    world.fault = None
    bridge._frame()
    world.fault = "the device 'mouse' stopped answering again"
    assert dict(bridge.view().device.rows)["Safety faults"] == "2"


def test_what_fails_in_the_program_is_no_fault_of_the_device(bridge, world, caplog):
    begin_trial(bridge, world)
    bridge.fail(StoreError("the sealed key is gone"))
    view = bridge.view()
    assert view.state == "trouble"
    assert view.device.ready
    assert dict(view.device.rows)["Safety faults"] == "0"
    caplog.clear()


def test_the_operators_buttons_become_events(bridge, world):
    begin_trial(bridge, world)
    bridge.operator.note_written.emit("left-handed")
    bridge.operator.mark_set.emit()
    bridge.operator.pause_asked.emit()
    bridge.operator.resume_asked.emit()
    bridge.operator.repeat_asked.emit("phone rang")
    notes = [done[1] for done in world.done if done[0] == "note"]
    assert notes == [{"kind": "note", "text": "left-handed"}, {"kind": "mark", "text": ""}]
    assert ("paused", {"by": "operator"}) in world.done
    assert any(done[0] == "repeat" and done[1]["reason"] == "phone rang" for done in world.done)
    assert world.events().count("trial_started") == 3


def test_leaving_out_is_kept_and_noted_and_a_refusal_is_told(make, world):
    left_out = []

    def exclude(trial, reason):
        if reason == "again":
            raise StoreError("trial 1 is left out already")
        left_out.append((trial, reason))

    bridge = make(exclude=exclude)
    begin_trial(bridge, world)
    bridge.operator.exclude_asked.emit(1, "phone rang")
    bridge.operator.exclude_asked.emit(None, "no consent")
    bridge.operator.exclude_asked.emit(1, "again")
    assert left_out == [(1, "phone rang"), (None, "no consent")]
    notes = [done[1]["text"] for done in world.done if done[0] == "note"]
    assert notes == [
        "left out of the analysis: trial 1: phone rang",
        "left out of the analysis: the session: no consent",
    ]
    assert bridge.trouble == ""
    assert isinstance(bridge.participant.page, TaskPage)


def test_ending_closes_the_journal_with_status_and_reason_and_waits_to_be_closed(bridge, world, qtbot):
    begin_trial(bridge, world)
    bridge.operator.end_asked.emit("withdrawn", "felt unwell")
    assert world.done[-1] == ("session_ended", {"status": "withdrawn", "reason": "felt unwell"})
    assert isinstance(bridge.participant.page, EndPage)
    assert bridge.operator.buttons.close_session.isVisible()
    with qtbot.waitSignal(bridge.done):
        qtbot.mouseClick(bridge.operator.buttons.close_session, Qt.MouseButton.LeftButton)
    assert not any(window.isVisible() for window in (bridge.operator, bridge.participant) if isValid(window))


def test_closing_the_operators_window_stops_the_force_and_asks(bridge, world, qtbot):
    begin_trial(bridge, world)
    bridge.operator.close()
    assert not world.force_is_on
    assert bridge.operator.isVisible()
    assert bridge.operator.question is not None
    assert "session_ended" not in world.events()
    bridge.operator.question.accept()
    assert world.done[-1][1]["status"] == "aborted"
    with qtbot.waitSignal(bridge.done):
        bridge.operator.close()


def test_closing_it_again_ends_the_session_with_everything_kept(bridge, world, qtbot):
    begin_trial(bridge, world)
    bridge.operator.close()
    with qtbot.waitSignal(bridge.done):
        bridge.operator.close()
    assert world.done[-1] == ("session_ended", {"status": "aborted", "reason": "the window was closed"})
    assert not world.force_is_on


def test_ending_from_outside_is_zero_force_a_status_and_gone_once(bridge, world, qtbot):
    begin_trial(bridge, world)
    gone = []
    bridge.done.connect(lambda: gone.append(True))
    bridge.end_now("ended from outside (SIGTERM)")
    bridge.end_now("ended from outside (SIGTERM)")
    assert gone == [True]
    assert not world.force_is_on
    assert ("session_ended", {"status": "aborted", "reason": "ended from outside (SIGTERM)"}) in world.done
    assert world.events().count("session_ended") == 1


def test_an_end_that_cannot_be_written_still_lets_the_windows_go(bridge, world, qtbot, caplog):
    begin_trial(bridge, world)
    world.full = True
    bridge.operator.end_asked.emit("aborted", "")
    assert not world.force_is_on
    assert "No space left" in bridge.operator.banner.what.text()
    assert bridge.runner.stalled
    with qtbot.waitSignal(bridge.done):
        bridge.operator.close()
    assert "no space left" in caplog.text
    caplog.clear()


def test_painted_frames_are_counted_on_the_servos_clock(bridge, world):
    begin_trial(bridge, world)
    for frame in range(5):
        world.now_s = 2.0 + frame / 60
        bridge.participant.painted.emit(world.now_ns())
    vitals = bridge.health.vitals()
    assert (vitals.refreshes, vitals.refreshes_missed) == (4, 0)
    assert vitals.frame_rate_hz == pytest.approx(60, abs=0.1)


def test_the_pointer_and_its_buttons_reach_the_mouse_device(make, world):
    told = []
    bridge = make(point_to=lambda *place: told.append(place), press=told.append)
    begin_trial(bridge, world)
    bridge.participant.pointer.emit(0.01, 0.02, 0.03)
    bridge.participant.buttons.emit(1)
    assert told == [(0.01, 0.02, 0.03), 1]


def test_a_simulated_hand_sees_each_frame_and_may_go_on(make, world):
    seen = []

    def hand_for(page):
        return (
            SimpleNamespace(act=lambda now_s, _view: seen.append(now_s) or now_s > 10.0)
            if isinstance(page, TaskPage)
            else None
        )

    bridge = make(hand_for=hand_for)
    begin_trial(bridge, world)
    world.samples = tick(world, 2.0)
    bridge._frame()
    assert len(seen) == 1
    assert isinstance(bridge.participant.page, TaskPage)
    for at_s in (11.0, 11.1, 11.2):
        world.samples = tick(world, at_s)
        bridge._frame()
    assert "trial_ended" in world.events()


def tick(world, at_s):
    """Return one sample of the scene now loaded, at a new time."""
    world.now_s = at_s
    sample = records(SAMPLE, 1)
    sample.time_ns = round(at_s * 1e9)
    sample.tick = round(at_s * 1000)
    sample.scene = world._serial
    sample.fresh = 1
    return sample


def test_the_operator_sees_traces_and_figures(bridge, world):
    begin_trial(bridge, world)
    world.samples = tick(world, 2.0)
    bridge._frame()
    bridge._traces()
    bridge._tiles()
    times, _ = bridge.operator.position.plot.curves[0].getData()
    assert len(times) >= 1
    assert bridge.operator.tiles.cards[1].value.text() == "0"
