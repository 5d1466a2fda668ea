"""Whatever fails ends in zero force, is written down once and told; a device that failed is connected again."""

import pkgutil
import sys
import threading
import weakref
from types import SimpleNamespace

import pytest
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication

from study_app.errors import DeviceNotFound, StoreError
from study_app.gui.widgets.dialogs import Notice
from study_app.gui.widgets.escape_key import EscapeHold
from study_app.session.pages import PausePage, TaskPage, TroublePage
from study_app.session.transitions.events import EndAsked, Submitted
from tests.app.world import begin_trial

pytestmark = pytest.mark.slow


def test_an_exception_in_a_slot_ends_in_zero_force(bridge, world, caplog):
    begin_trial(bridge, world)
    world.broken_clock = True
    bridge.draw_frame()
    assert "stop_force" in world.done
    assert not world.force_is_on
    assert "the clock fell off the wall" in caplog.text
    caplog.clear()
    world.broken_clock = False
    bridge.show_tiles()
    assert "the clock fell off the wall" in bridge.operator.banner.what.text()


def test_what_breaks_again_and_again_is_written_once(bridge, world, caplog):
    begin_trial(bridge, world)
    bridge.participant.show_view = None  # not callable: every frame fails
    for _ in range(5):
        world.now_s += 0.1
        bridge.draw_frame()
    assert world.events().count("broke") == 1
    assert len(caplog.records) == 1
    caplog.clear()
    assert isinstance(bridge.participant.page, TroublePage)
    assert isinstance(bridge.failure, TypeError)


def test_an_exception_in_painting_ends_in_zero_force_too(bridge, world, caplog, monkeypatch):
    begin_trial(bridge, world)
    heard = []
    monkeypatch.setattr(bridge.uncaught, "previous", lambda *error: heard.append(error))
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
    world.fault = "the device 'mouse' stopped responding; plug it in again and start anew"
    bridge.draw_frame()
    assert isinstance(bridge.participant.page, TroublePage)
    assert "stopped responding" in bridge.operator.banner.what.text()
    assert "stopped responding" not in bridge.participant.page.paragraph
    assert bridge.operator.device.chip.word == "Fault"
    bridge.draw_frame()
    assert dict(bridge.view().device.rows)["Safety faults"] == "1"
    world.fault = None
    bridge.draw_frame()
    world.fault = "the device 'mouse' stopped responding again"
    assert dict(bridge.view().device.rows)["Safety faults"] == "2"


def test_what_fails_in_the_program_is_no_fault_of_the_device(bridge, world, caplog):
    begin_trial(bridge, world)
    bridge.fail(StoreError("the sealed key is gone"))
    view = bridge.view()
    assert view.state == "trouble"
    assert view.device.ready
    assert dict(view.device.rows)["Safety faults"] == "0"
    caplog.clear()


BROKEN = "no such colour"


def breaks(*_arguments, **_named):
    raise ValueError(BROKEN)


def scribble(bridge):
    """Emit what the operator's own slot listens to."""
    bridge.operator.notes.field.setPlainText("left-handed")
    bridge.operator.notes.field.entered.emit()


def show_position(bridge):
    bridge.show_traces()


def choose_theme(bridge):
    bridge.operator.header.theme_button.click()


def paint_rail(bridge):
    bridge.operator.rail.update()


def paint_plot(bridge):
    bridge.operator.position.plot.viewport().update()


def paint_tank(bridge):
    bridge.participant.tank.update()


def tap(bridge):
    """Press a key that the participant's window hears itself."""
    key = QKeyEvent(QEvent.Type.KeyPress, Qt.Key.Key_Space, Qt.KeyboardModifier.NoModifier)
    QApplication.postEvent(bridge.participant, key)


def show_notes(bridge):
    bridge.operator.mark_set.emit()


def hold(bridge):
    bridge.participant.findChild(EscapeHold).tapped.emit()


@pytest.mark.parametrize(
    ("owner", "method", "do"),
    [
        ("study_app.gui.operator.window.OperatorWindow", "_change_theme", choose_theme),
        ("study_app.gui.participant.tank_widget.TankWidget", "paintEvent", paint_tank),
        ("study_app.gui.participant.window.ParticipantWindow", "keyPressEvent", tap),
        ("study_app.gui.participant.window.ParticipantWindow", "_pause", hold),
    ],
)
def test_whatever_window_it_happens_in_a_failure_is_zero_force_and_told(
    make, world, qtbot, monkeypatch, caplog, owner, method, do
):
    """Qt calls these itself: the exception is raised in a slot or an event of the window, not in the bridge."""
    breaks_here = []

    def broken(*arguments, **named):
        if breaks_here:
            breaks(*arguments, **named)
        return whole(*arguments, **named)

    kind = pkgutil.resolve_name(owner)
    whole = getattr(kind, method)
    monkeypatch.setattr(kind, method, broken, raising=False)
    bridge = make()
    before, bridge.uncaught.previous = bridge.uncaught.previous, lambda *_error: None
    begin_trial(bridge, world)
    QApplication.processEvents()
    assert world.force_is_on
    breaks_here.append(True)
    QTimer.singleShot(0, lambda: do(bridge))  # from Qt's loop, as it is in the program
    qtbot.waitUntil(lambda: not world.force_is_on)
    assert world.events().count("broke") == 1
    assert isinstance(bridge.participant.page, TroublePage)
    assert BROKEN in bridge.operator.banner.what.text()
    assert BROKEN in caplog.text
    breaks_here.clear()
    bridge.uncaught.previous = before
    caplog.clear()


@pytest.mark.qt_log_ignore("QBackingStore::endPaint")
@pytest.mark.parametrize(
    ("owner", "method", "do", "name"),
    [
        ("study_app.gui.operator.notes.NotesCard", "show_view", show_notes, "Notes"),
        ("study_app.gui.operator.notes.NoteField", "toPlainText", scribble, "Notes"),
        ("study_app.gui.operator.plot_cards.PositionCard", "show_health", show_position, "Position"),
        ("study_app.gui.widgets.live_plots.TracePlot", "show_traces", show_position, "Position"),
        ("study_app.gui.widgets.live_plots.Plot", "paintEvent", paint_plot, "Position"),
        ("study_app.gui.operator.steps_card.Rail", "paintEvent", paint_rail, "Session"),
        ("study_app.gui.operator.current_step.Tally", "show_view", show_notes, "Counts"),
    ],
)
def test_a_panel_that_fails_is_replaced_by_a_line_and_the_session_goes_on(
    make, world, qtbot, monkeypatch, caplog, owner, method, do, name
):
    breaks_here = []

    def broken(self, *arguments, **named):
        if breaks_here:
            breaks()
        return whole(self, *arguments, **named)

    kind = pkgutil.resolve_name(owner)
    whole = getattr(kind, method)
    monkeypatch.setattr(kind, method, broken, raising=False)
    bridge = make()
    begin_trial(bridge, world)
    QApplication.processEvents()
    breaks_here.append(True)
    QTimer.singleShot(0, lambda: do(bridge))  # from Qt's loop, as it is in the program
    panels = bridge.operator.panels
    qtbot.waitUntil(lambda: None not in panels.covers.values() and bool(panels.covers))
    for _ in range(3):
        do(bridge)
        bridge.show_tiles()
        QApplication.processEvents()
    cover = next(cover for panel, cover in panels.covers.items() if panels.names[panel] == name)
    assert cover.isVisible()
    assert cover.line.text() == f"{name}: this panel failed. The session continues."
    assert world.force_is_on
    assert not bridge.trouble
    assert isinstance(bridge.participant.page, TaskPage)
    assert "broke" not in world.events()
    told = [entry[1]["text"] for entry in world.done if entry[0] == "note" and entry[1]["kind"] == "note"]
    assert len([text for text in told if f"panel {name!r} failed" in text and BROKEN in text]) == 1
    assert f"the panel {name!r} failed" in caplog.text
    breaks_here.clear()
    caplog.clear()


@pytest.mark.qt_log_ignore("QBackingStore::endPaint")
def test_a_painter_that_a_failure_leaves_at_work_is_ended(make, world, qtbot, monkeypatch, caplog):
    """Else Qt paints no window any more: what failed could not even be read."""
    left = []

    def broken(painter, _place, **_named):
        left.append(weakref.ref(painter))
        raise ValueError(BROKEN)

    bridge = make()
    before, bridge.uncaught.previous = bridge.uncaught.previous, lambda *_error: None
    begin_trial(bridge, world)
    QApplication.processEvents()
    with monkeypatch.context() as patched:
        patched.setattr("study_app.gui.participant.tank_widget.paint_patch", broken)
        QTimer.singleShot(0, lambda: paint_tank(bridge))
        qtbot.waitUntil(lambda: not world.force_is_on)
    assert [painter() for painter in left] == [None] * len(left)
    assert left
    bridge.uncaught.previous = before
    caplog.clear()


def test_a_thread_that_ends_by_an_exception_is_told_noted_and_ends_no_session(bridge, world, qtbot, caplog):
    begin_trial(bridge, world)
    thread = threading.Thread(target=lambda: 1 / 0, name="recorder")
    thread.start()
    thread.join()
    qtbot.waitUntil(lambda: bridge.operator.findChildren(Notice) != [])
    (notice,) = bridge.operator.findChildren(Notice)
    assert notice.isVisible()
    assert "recorder" in caplog.text
    caplog.clear()
    (note,) = (entry[1] for entry in world.done if entry[0] == "note")
    assert "recorder: ZeroDivisionError" in note["text"]
    assert world.force_is_on
    assert not bridge.trouble


def test_the_recorders_losses_reach_the_cockpit_without_an_event(make, world, qtbot):
    class Losing:
        lost = (SimpleNamespace(trial=1, reason="No space left on device"),)
        dropped = 0

        def start(self, *_arguments):
            pass

        append = frame = stop = start

        def settled(self):
            return True

    bridge = make(recorder=Losing())
    begin_trial(bridge, world)
    bridge.show_tiles()
    assert bridge.operator.rail.tally.beyond.text().endswith("lost: No space left on device.")


FAULT = "the device 'memory' stopped responding"


class Device:
    """Connects when it is let go on, or fails; ``calls`` counts how often it was asked to."""

    def __init__(self, world):
        self.world, self.calls = world, 0
        self.error = None
        self.go_on = threading.Event()

    def __call__(self):
        self.calls += 1
        assert self.go_on.wait(10.0)
        if self.error is not None:
            raise self.error
        self.world.fault = None
        return {"name": "memory"}


@pytest.fixture
def device(world):
    return Device(world)


@pytest.fixture
def lost(make, world, device):
    bridge = make(reconnect=device)
    begin_trial(bridge, world)
    world.fault = FAULT
    bridge.draw_frame()
    assert bridge.operator.banner.reconnect.isVisible()
    return bridge


def settled(bridge, qtbot):
    qtbot.waitUntil(lambda: not bridge.reconnection.under_way)


def test_what_the_device_asks_for_is_shown_and_the_button_waits(lost, device, world, qtbot):
    banner = lost.operator.banner
    qtbot.mouseClick(banner.reconnect, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: device.calls == 1)
    lost.operator.reconnect_asked.emit()
    lost.tell_of_device("Homing (red light): pull the grip out.")
    assert banner.then.text() == "Homing (red light): pull the grip out."
    assert not banner.reconnect.isEnabled()
    device.go_on.set()
    settled(lost, qtbot)
    assert device.calls == 1
    assert isinstance(lost.participant.page, PausePage)
    assert not world.force_is_on
    assert not banner.isVisible()
    assert lost.view().state == "force off"
    lost.operator.resume_asked.emit()
    assert isinstance(lost.participant.page, TaskPage)
    assert world.force_is_on


@pytest.mark.parametrize("error", [DeviceNotFound("none is connected"), OSError("no bus")])
def test_why_it_failed_is_told_and_it_can_be_tried_again(lost, device, qtbot, caplog, error):
    device.error = error
    device.go_on.set()
    lost.operator.reconnect_asked.emit()
    settled(lost, qtbot)
    assert str(error) in lost.operator.banner.then.text()
    assert "was not reconnected" in caplog.text
    caplog.clear()
    device.error = None
    lost.operator.reconnect_asked.emit()
    settled(lost, qtbot)
    assert isinstance(lost.participant.page, PausePage)


def test_a_session_that_ends_meanwhile_stays_ended(lost, device, world, qtbot):
    lost.operator.reconnect_asked.emit()
    lost.participant.event.emit(EndAsked(world.now_s, "aborted", "cable"))
    device.go_on.set()
    settled(lost, qtbot)
    assert lost.view().over
    assert not world.force_is_on
    assert world.events()[-1] == "session_ended"


def test_a_failure_of_the_program_offers_no_reconnection(make, world, device, caplog):
    bridge = make(reconnect=device)
    begin_trial(bridge, world)
    bridge.fail(ValueError("a bug"))
    caplog.clear()
    assert not bridge.operator.banner.reconnect.isVisible()
    bridge.operator.reconnect_asked.emit()
    assert device.calls == 0
