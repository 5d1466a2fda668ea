"""The two windows of a session: their requests to servo and journal, stops, ends, and a shared screen."""

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QApplication

from study_app.app.session import bridge as bridge_module
from study_app.gui.kit.dialogs import Question
from study_app.gui.operator.session_panels import Strip
from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_NORM, SAMPLE, records
from study_app.session.pages import EndPage, PausePage, TaskPage
from study_app.session.transitions.events import Continue
from tests.app.world import World, begin_trial, tick

pytestmark = pytest.mark.slow

LEFT = Qt.MouseButton.LeftButton


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
    for at_s in (3.0, 3.75):
        world.samples = tick(world, at_s)
        bridge.draw_frame()
    assert bridge.runner.task.elapsed_s == 0.75


class SlowRecorder:
    """Writes its recordings until ``on_disk``."""

    lost, dropped, on_disk = (), 0, False

    def start(self, *_arguments):
        pass

    append = frame = stop = start

    def end_without_waiting(self):
        return self.on_disk


def test_windows_answer_while_recordings_are_written_and_close_after_it(make, world, qtbot):
    recorder = SlowRecorder()
    bridge = make(recorder=recorder)
    begin_trial(bridge, world)
    bridge.operator.ask("end", "withdrawn", "tired")
    bridge.runner.poll()
    assert isinstance(bridge.participant.page, EndPage)
    bridge.operator.ask("close")
    assert not bridge.participant.may_close, "the end is still to be written"
    recorder.on_disk = True
    with qtbot.waitSignal(bridge.done):
        bridge.runner.poll()


@pytest.mark.parametrize("full_screen", [True, False])
def test_a_participants_window_that_comes_to_cover_the_operators_pauses_the_session(
    bridge, world, qtbot, monkeypatch, full_screen
):
    monkeypatch.setattr("study_app.app.session.bridge.SCREEN_SETTLES_MS", 0)
    if full_screen:
        bridge.participant.showFullScreen()
    bridge.watch_screens()
    begin_trial(bridge, world)
    bridge.participant.bring_forward()
    handle = bridge.participant.windowHandle()
    handle.screenChanged.emit(handle.screen())  # as Qt does for a window of a screen that is removed
    QApplication.processEvents()
    assert (("paused", {"by": "program"}) in world.done) == full_screen
    assert isinstance(bridge.participant.page, PausePage if full_screen else TaskPage)
    questions = [question for question in bridge.operator.findChildren(Question) if question.isVisible()]
    assert len(questions) == full_screen
    if full_screen:
        qtbot.waitUntil(lambda: QApplication.activeWindow() in (bridge.operator, *questions))
        bridge.operator.ask("resume")
        assert not any(row[0] == "resumed" for row in world.done), "the participant's window would cover the force stop"
        returned = []
        monkeypatch.setattr(bridge.participant, "open_on", returned.append)
        QApplication.instance().screenAdded.emit(handle.screen())
        assert returned == [handle.screen()]
        assert not bridge.participant.isFullScreen(), "only then it can change its screen"
        bridge.operator.ask("resume")
        assert any(row[0] == "resumed" for row in world.done)


def test_a_screen_that_is_rescaled_in_a_trial_changes_neither_force_nor_place_of_the_hand(bridge, world):
    begin_trial(bridge, world)
    window = bridge.participant
    window.resize(1000, 700)
    world.samples = tick(world, 2.0)
    bridge.draw_frame()
    large, call_count = window.tank.ball, len(world.done)
    for part in (window, bridge.operator):
        QApplication.sendEvent(part, QEvent(QEvent.Type.DevicePixelRatioChange))
    window.resize(500, 350)
    world.samples = tick(world, 3.0)
    bridge.draw_frame()
    small = window.tank.ball
    assert (world.done[call_count:], world.force_is_on, bridge.trouble) == ([], True, "")
    assert window.tank.placer.place(tuple(window.tank.view.position_m)) == small != large


@pytest.fixture
def one_screen(make, qtbot):
    bridge = make(strip=Strip())
    qtbot.waitExposed(bridge.participant)
    return bridge


def test_the_strip_covers_no_page_and_stops_the_force_at_the_first_touch(one_screen, world, qtbot, monkeypatch):
    strip, participant = one_screen.strip, one_screen.participant
    for page in ("text", "tank"):
        assert strip.isVisible(), page
        assert participant.widget.geometry().top() == strip.height()
        if page == "text":
            begin_trial(one_screen, world)
    assert (strip.state.word, world.force_is_on) == ("Running", True)
    qtbot.mousePress(strip.stop, LEFT)
    assert (strip.state.word, world.force_is_on) == ("Paused, force is off", False)
    raised = []
    monkeypatch.setattr(participant, "bring_forward", lambda: raised.append(strip.state.word))
    one_screen.operator.ask("resume")
    assert (raised, world.force_is_on) == (["Running"], True)
    one_screen.leave_without_asking()
    assert (world.done[-1], world.force_is_on) == (("paused", {"by": "program"}), False)


def test_the_strip_stops_the_force_though_nothing_can_be_recorded(one_screen, world, qtbot, monkeypatch, caplog):
    def broken(*_line, **_named):
        raise OSError("the drive is gone")

    begin_trial(one_screen, world)
    monkeypatch.setattr(world, "append", broken)
    qtbot.mousePress(one_screen.strip.stop, LEFT)
    assert not world.force_is_on
    one_screen.show_tiles()
    assert "the drive is gone" in one_screen.operator.banner.what.text()
    caplog.clear()


STALL_FACTS = ("trouble", "waits", "device_ready", "faults")


def test_the_operators_view_has_each_fact_of_servo_recorder_and_outlets(
    make: Any, world: World, monkeypatch: pytest.MonkeyPatch
) -> None:
    facts_shown: list[dict[str, Any]] = []
    view_session = bridge_module.view_session

    def view(session: Any, progress: Any, vitals: Any, **facts: Any) -> Any:
        facts_shown.append({"session": session, "progress": progress, **facts})
        return view_session(session, progress, vitals, **facts)

    monkeypatch.setattr(bridge_module, "view_session", view)
    recorder, outlets = SlowRecorder(), SimpleNamespace(lost={"LSL markers": "closed"})
    recorder.lost, recorder.dropped = (SimpleNamespace(trial=3, reason="the disk is full"),), 7
    bridge = make("single", recorder=recorder, outlets=outlets)
    world.now_s, world.rate_hz = 12.5, 500.0
    bridge.view()
    assert facts_shown[-1] == {
        "session": bridge.parts.session, "progress": bridge.parts.journal.progress, "now_s": 12.5,
        "force_on": world.force_is_on, "trouble": "", "waits": False, "device_ready": True, "faults": 0,
        "rate_hz": 500.0, "forces": bridge.forces.figures(), "lost": {3: "the disk is full"}, "dropped": 7,
        "outlets_lost": {"LSL markers": "closed"},
    }  # fmt: skip
    world.fault, world.force_is_on = "the servo stopped", False
    for _ in range(2):
        bridge.view()
    assert [facts_shown[-1][name] for name in (*STALL_FACTS, "force_on")] == [
        "the servo stopped",
        False,
        False,
        1,
        False,
    ]
    with monkeypatch.context() as patch:
        patch.setattr(type(bridge.runner), "stalled", "the disk is full")
        world.fault = None
        bridge.view()
        assert [facts_shown[-1][name] for name in STALL_FACTS] == ["the disk is full", True, True, 1]
        world.fault, bridge.trouble = "the servo stopped", "the window failed"
        bridge.view()
        assert [facts_shown[-1][name] for name in STALL_FACTS] == ["the window failed", False, False, 2]
    world.fault = None
    bridge.leave_without_asking()
    make().view()
    assert [facts_shown[-1][name] for name in ("forces", "lost", "dropped", "outlets_lost")] == [None, {}, 0, None]


def pushes(world: World, count: int = 400) -> Any:
    """Return samples of the scene now loaded with a force of 3 N, 1.5 N of it along x, limited now and then."""
    samples = records(SAMPLE, count)
    world.now_s += count / 1000
    samples.tick = np.arange(count)
    samples.time_ns = round(world.now_s * 1e9) - np.arange(count)[::-1] * 1_000_000
    samples.scene = world.serial
    samples.fresh = 1
    samples.device_force_n = (1.5, 0.0, np.sqrt(9 - 1.5**2))
    samples.permitted_n, samples.withheld_n = 4.0, 0.25
    samples.limiters = LIMITER_FADE
    samples.limiters[:7] |= LIMITER_NORM
    return samples


def test_the_operator_sees_forces_only_in_a_single_blind_study(make: Any, world: World) -> None:
    names = ("Force relative to 6 N", "Limited ticks", "Force held back, limit 5\u2009%")
    device_texts, participant_views = {}, []
    for blinding, limit_n in (("single", 6.0), ("double", None)):
        bridge = make(blinding=blinding, force_limit_n=limit_n)
        begin_trial(bridge, world)
        world.samples = pushes(world)
        bridge.draw_frame()
        bridge.show_traces()
        bridge.show_tiles()
        rows, card = dict(bridge.view().device.rows), bridge.operator.force
        device_texts[bridge.operator.header.blind.word] = [rows[name] for name in names]
        if blinding == "single":
            x_n, size_n = (card.plot.curves[curve].getData()[1] for curve in (0, 3))
            assert x_n == pytest.approx(1.5)
            assert size_n == pytest.approx(3.0)
            assert len(bridge.operator.position.plot.curves[0].getData()[0]) > 0
        else:
            assert not hasattr(card, "plot")
            assert bridge.forces is None
        assert bridge.participant.widget.geometry().top() == 0, "without a strip"
        assert bridge.operator.header.page.isHidden()
        participant_views.append((repr(bridge.participant.page), bridge.participant.grab().toImage()))
        bridge.leave_without_asking()
        world.samples = records(SAMPLE, 0)
    assert device_texts == {
        "Single-blind": ["50\u2009%, peak 50\u2009%", "force 7", "6.2\u2009%"],
        "Double-blind": ["hidden", "hidden", "hidden"],
    }
    assert participant_views[0] == participant_views[1]
