"""Events in, views out: what the windows say reaches the session, and its news the operator."""

import threading
from types import SimpleNamespace

import pytest
from PySide6.QtCore import Qt

from study_app.errors import StoreError
from study_app.session.pages import PausePage, TaskPage, TextPage
from study_app.session.transitions.events import Continue
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
