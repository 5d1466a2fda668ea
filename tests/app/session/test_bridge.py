"""Events in, views out: what the windows say reaches the session; its stops and its ends."""

import threading
from types import SimpleNamespace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from shiboken6 import isValid

from study_app.errors import StoreError
from study_app.session.pages import EndPage, PausePage, TaskPage, TextPage, TroublePage
from study_app.session.transitions.events import Continue, ForceStopped, ResumeAsked
from tests.app.world import begin_trial, tick

pytestmark = pytest.mark.slow


def test_starting_shows_the_first_page_to_both(bridge, world):
    assert isinstance(bridge.participant.page, TextPage)
    assert bridge.operator.rail.heading.text() == "A first look"
    assert world.events() == ["page_shown"]


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
            raise StoreError("trial 1 is already excluded")
        left_out.append((trial, reason))

    bridge = make(exclude=exclude)
    begin_trial(bridge, world)
    bridge.operator.exclude_asked.emit(1, "phone rang")
    bridge.operator.exclude_asked.emit(None, "no consent")
    bridge.operator.exclude_asked.emit(1, "again")
    assert left_out == [(1, "phone rang"), (None, "no consent")]
    notes = [done[1]["text"] for done in world.done if done[0] == "note"]
    assert notes == [
        "excluded from the analysis: trial 1: phone rang",
        "excluded from the analysis: the session: no consent",
    ]
    assert bridge.trouble == ""
    assert isinstance(bridge.participant.page, TaskPage)


def test_force_and_task_begin_when_the_tank_is_painted_and_not_while_a_page_asks_to_wait(bridge, world, qtbot):
    painted = threading.Event()
    bridge.participant.painting = threading.Thread(target=painted.wait, daemon=True)
    bridge.participant.painting.start()
    bridge.participant.event.emit(Continue(0.0))
    for second in range(1, 4):
        world.samples = tick(world, float(second))
        bridge.draw_frame()
    assert bridge.participant.tank is None
    assert "load" not in world.done
    assert bridge.runner.task.elapsed_s == 0
    painted.set()
    qtbot.waitUntil(lambda: bridge.participant.tank is not None)
    assert "load" not in world.done
    bridge.draw_frame()
    assert world.done[-1] == "load"
    world.samples = tick(world, 3.0)
    bridge.draw_frame()
    world.samples = tick(world, 3.75)
    bridge.draw_frame()
    assert bridge.runner.task.elapsed_s == 0.75


def test_painted_frames_are_counted_on_the_servos_clock(bridge, world):
    begin_trial(bridge, world)
    for frame in range(5):
        world.now_s = 2.0 + frame / 60
        bridge.participant.painted.emit(world.now_ns())
    vitals = bridge.monitor.health.vitals()
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
    bridge.draw_frame()
    assert len(seen) == 1
    assert isinstance(bridge.participant.page, TaskPage)
    for at_s in (11.0, 11.1, 11.2):
        world.samples = tick(world, at_s)
        bridge.draw_frame()
    assert "trial_ended" in world.events()


def test_the_operator_sees_traces_and_figures(bridge, world):
    begin_trial(bridge, world)
    world.samples = tick(world, 2.0)
    bridge.draw_frame()
    bridge.show_traces()
    bridge.show_tiles()
    times, _ = bridge.operator.position.plot.curves[0].getData()
    assert len(times) >= 1
    assert bridge.operator.tiles.cards[1].value.text() == "0"


def test_a_diagnosis_is_begun_with_the_force_off_and_a_pause(bridge, world, qtbot):
    begin_trial(bridge, world)
    seen = []
    bridge.diagnose_asked.connect(lambda: seen.append((world.force_is_on, bridge.participant.page)))
    with qtbot.waitSignal(bridge.diagnose_asked):
        qtbot.mouseClick(bridge.operator.device.diagnose, Qt.MouseButton.LeftButton)
    assert seen == [(False, PausePage(force_off=True, held="force"))]
    bridge.operator.end_asked.emit("aborted", "the device is broken")
    before = len(world.done)
    with qtbot.waitSignal(bridge.diagnose_asked):
        bridge.operator.diagnose_asked.emit()
    assert world.done[before:] == ["stop_force"]


def test_a_diagnosis_of_a_full_disk_is_opened_all_the_same(bridge, world, qtbot, caplog):
    begin_trial(bridge, world)
    world.full = True
    with qtbot.waitSignal(bridge.diagnose_asked):
        bridge.operator.diagnose_asked.emit()
    assert not world.force_is_on
    assert "no space left" in caplog.text
    caplog.clear()


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
    assert "Free disk space" in bridge.operator.banner.then.text()
    assert bridge.operator.device.chip.word == "Ready"
    world.full = False
    world.now_s += 2.0
    bridge.draw_frame()
    assert isinstance(bridge.participant.page, PausePage)
    assert not bridge.operator.banner.isVisible()
    assert ("note", {"kind": "mark", "text": ""}) in world.done
    bridge.operator.fade_in_asked.emit()
    assert isinstance(bridge.participant.page, TaskPage)
    assert world.force_is_on
    assert "accepts data again" in caplog.text
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


def test_closing_it_again_leaves_the_session_unfinished(bridge, world, qtbot):
    begin_trial(bridge, world)
    bridge.operator.close()
    with qtbot.waitSignal(bridge.done):
        bridge.operator.close()
    assert "session_ended" not in world.events()
    assert not world.force_is_on


def test_ending_from_outside_is_zero_force_no_end_and_gone_once(bridge, world, qtbot):
    begin_trial(bridge, world)
    gone = []
    bridge.done.connect(lambda: gone.append(True))
    bridge.leave_now()
    bridge.leave_now()
    assert gone == [True]
    assert not world.force_is_on
    assert "session_ended" not in world.events()


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


def test_windows_answer_while_recordings_are_written_and_close_after_it(make, world, qtbot):
    class Slow:
        lost, dropped, on_disk = (), 0, False

        def start(self, *_arguments):
            pass

        append = frame = stop = start

        def settled(self):
            return self.on_disk

    recorder = Slow()
    bridge = make(recorder=recorder)
    begin_trial(bridge, world)
    bridge.operator.end_asked.emit("withdrawn", "tired")
    bridge.runner.poll()
    assert isinstance(bridge.participant.page, EndPage)
    assert bridge.runner.ending
    bridge.operator.close_asked.emit()
    assert not bridge.participant.may_close, "the end is still to be written"
    recorder.on_disk = True
    with qtbot.waitSignal(bridge.done):
        bridge.runner.poll()
