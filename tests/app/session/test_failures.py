"""Every failure ends in zero force and is recorded and reported once; a failed device is reconnected."""

import pkgutil
import threading
import weakref
from types import SimpleNamespace

import pytest
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from study_app.app.failures import Patience
from study_app.errors import StudyError
from study_app.gui.kit.dialogs import Question
from study_app.gui.widgets.main_view import EscapeKey
from study_app.session.pages import TaskPage, TroublePage
from study_app.session.transitions.events import EndRequested
from tests.app.world import begin_trial
from tests.plug_in_packages import forget_plug_ins, install

pytestmark = pytest.mark.slow


def test_an_exception_in_a_slot_ends_in_zero_force_and_is_reported_once(bridge, world, caplog):
    begin_trial(bridge, world)
    world.broken_clock = True
    bridge.draw_frame()
    assert not world.force_is_on
    assert [record.getMessage() for record in caplog.records] == [
        "the session failed: RuntimeError: the clock fell off the wall",
        "and could not be recorded: the clock fell off the wall",
    ]
    for _ in range(5):
        bridge.draw_frame()
    assert len(caplog.records) == 2
    caplog.clear()
    world.broken_clock = False
    bridge.show_tiles()
    assert "the clock fell off the wall" in bridge.operator.banner.what.text()


def test_a_plug_in_that_fails_is_zero_force_and_named(bridge, world, caplog, tmp_path, monkeypatch):
    install(tmp_path, "toy-plug", "task", {"toy": "toy_plug:draw"}, toy_plug="def draw(_now_ns):\n    return 1 / 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    forget_plug_ins()
    begin_trial(bridge, world)
    assert world.force_is_on
    monkeypatch.setattr(bridge.runner, "view", pkgutil.resolve_name("toy_plug:draw"))
    bridge.draw_frame()
    assert not world.force_is_on
    said = "the plug-in toy-plug 1.0 failed (ZeroDivisionError: division by zero): update or uninstall the plug-in"
    assert isinstance(bridge.failure, StudyError), "so that it ends with a line and exit code 2"
    assert [record.getMessage() for record in caplog.records] == [f"the session failed: {said}"]
    assert said[1:] in bridge.operator.banner.what.text()
    assert world.events().count("broke") == 1
    caplog.clear()
    forget_plug_ins("toy_plug")


def test_several_waits_share_one_limit(monkeypatch):
    times_s = iter([10.0, 10.0, 11.5, 12.0, 14.0])  # the first is that of the beginning
    monkeypatch.setattr("study_app.app.failures.time", SimpleNamespace(perf_counter=lambda: next(times_s)))
    patience = Patience(2.0)
    assert [patience.left_s for _ in range(4)] == [2.0, 0.5, 0.0, 0.0]


BROKEN = "no such colour"


class Breaking:
    """A patch that lets a window's method fail from ``now`` on, in a slot or an event called by Qt."""

    def __init__(self, monkeypatch, owner, method):
        self.on, self.failed, kind = False, 0, pkgutil.resolve_name(f"study_app.gui.{owner}")
        whole, breaking = getattr(kind, method), self

        def broken(self, *arguments, **named):
            if breaking.on:
                breaking.failed += 1
                raise ValueError(BROKEN)
            return whole(self, *arguments, **named)

        broken.__code__ = broken.__code__.replace(co_name=method)  # as Qt calls it
        monkeypatch.setattr(kind, method, broken, raising=False)

    def now(self, bridge, do):
        self.on = True
        QTimer.singleShot(0, lambda: do(bridge))  # from Qt's loop, as it is in the program


def paint_tank(bridge):
    bridge.participant.tank.update()


def tap(bridge):
    key = QKeyEvent(QEvent.Type.KeyPress, Qt.Key.Key_Space, Qt.KeyboardModifier.NoModifier)
    QApplication.postEvent(bridge.participant, key)


def mark(bridge):
    bridge.operator.ask("mark")


def paint_position(bridge):
    bridge.operator.position.plot.viewport().update()


@pytest.mark.qt_log_ignore("QBackingStore::endPaint")
@pytest.mark.parametrize(
    ("owner", "method", "do"),
    [
        ("operator.window.OperatorWindow", "_change_theme", lambda bridge: bridge.operator.header.theme_button.click()),
        ("participant.tank_widget.TankWidget", "_paint", paint_tank),
        ("participant.window.ParticipantWindow", "keyPressEvent", tap),
        (
            "participant.window.ParticipantWindow",
            "_ask_to_pause",
            lambda bridge: bridge.participant.findChild(EscapeKey).tapped.emit(),
        ),
    ],
)
def test_a_failure_in_any_window_ends_in_zero_force_and_is_reported(
    make, world, qtbot, monkeypatch, caplog, owner, method, do
):
    breaking = Breaking(monkeypatch, owner, method)
    bridge = make()
    heard = []
    before, bridge.uncaught.previous = bridge.uncaught.previous, lambda *error: heard.append(error)
    begin_trial(bridge, world)
    QApplication.processEvents()
    assert world.force_is_on
    breaking.now(bridge, do)
    qtbot.waitUntil(lambda: not world.force_is_on)
    assert BROKEN in str(heard[0][1]), "it is passed on as well"
    assert world.events().count("broke") == 1
    assert isinstance(bridge.participant.page, TroublePage)
    assert BROKEN in bridge.operator.banner.what.text()
    assert BROKEN in caplog.text
    breaking.on = False
    bridge.uncaught.previous = before
    caplog.clear()


@pytest.mark.qt_log_ignore("QBackingStore::endPaint")
def test_a_part_of_the_participants_window_from_elsewhere_that_cannot_be_painted_is_zero_force(
    make, world, qtbot, caplog
):
    class Field(QWidget):  # as a plug-in's, or one that both windows share
        def paintEvent(self, _event):  # noqa: N802 - as Qt calls it
            raise ValueError(BROKEN)

    bridge = make()
    before, bridge.uncaught.previous = bridge.uncaught.previous, lambda *_error: None
    begin_trial(bridge, world)
    field = Field(bridge.participant)
    field.show()
    qtbot.waitUntil(lambda: not world.force_is_on)
    field.hide()
    assert BROKEN in bridge.operator.banner.what.text()
    bridge.uncaught.previous = before
    caplog.clear()


@pytest.mark.qt_log_ignore("QBackingStore::endPaint")
@pytest.mark.parametrize(
    ("owner", "method", "do"),
    [
        ("operator.controls.NotesCard", "show_view", mark),
        ("operator.plots.PositionCard", "show_health", lambda it: it.show_traces()),
        ("widgets.live_plots.TracePlot", "paintEvent", paint_position),
        ("widgets.live_plots.pg.PlotCurveItem", "paint", paint_position),
        ("operator.session_panels.Tally", "show_view", mark),
    ],
)
def test_a_failed_part_of_the_operators_window_is_reported_once_and_the_session_continues(
    make, world, qtbot, monkeypatch, caplog, owner, method, do
):
    breaking = Breaking(monkeypatch, owner, method)
    bridge = make()
    begin_trial(bridge, world)
    QApplication.processEvents()
    breaking.now(bridge, do)
    qtbot.waitUntil(lambda: bool(bridge.operator.findChildren(Question)))
    for _ in range(9):
        do(bridge)
        bridge.show_tiles()
        qtbot.wait(5)  # in Qt's loop, as it is in the program
    said = [label.text() for notice in bridge.operator.findChildren(Question) for label in notice.findChildren(QLabel)]
    assert said.count(f"ValueError: {BROKEN}. The session continues.") == 1
    assert (world.force_is_on, bridge.trouble) == (True, "")
    assert isinstance(bridge.participant.page, TaskPage)
    assert "broke" not in world.events()
    notes = [entry[1]["text"] for entry in world.done if entry[0] == "note" and entry[1]["kind"] == "note"]
    assert [BROKEN in text for text in notes] == [True]
    assert BROKEN in caplog.text
    breaking.on = False
    caplog.clear()


@pytest.mark.qt_log_ignore("QBackingStore::endPaint")
def test_a_painter_that_a_failure_leaves_at_work_is_ended(make, world, qtbot, monkeypatch, caplog):
    """Otherwise Qt paints no window any more, and the error could not be read."""
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


def test_an_exception_in_a_thread_is_reported_and_noted_without_ending_the_session(bridge, world, qtbot, caplog):
    begin_trial(bridge, world)
    thread = threading.Thread(target=lambda: 1 / 0, name="recorder")
    thread.start()
    thread.join()
    qtbot.waitUntil(lambda: bridge.operator.findChildren(Question) != [])
    (notice,) = bridge.operator.findChildren(Question)
    assert notice.isVisible()
    assert "recorder" in caplog.text
    caplog.clear()
    (note,) = (entry[1] for entry in world.done if entry[0] == "note")
    assert "recorder: ZeroDivisionError" in note["text"]
    assert world.force_is_on
    assert not bridge.trouble


def test_closing_the_window_writes_an_end_that_the_full_disk_did_not_take(bridge, world, caplog):
    begin_trial(bridge, world)
    world.full = True
    bridge.operator.ask("end", "aborted", "")
    assert bridge.runner.stalled
    world.full = False
    bridge.operator.close()
    assert world.events()[-1] == "session_ended"
    assert not world.force_is_on
    caplog.clear()


FAULT = "the device 'memory' stopped responding"


class Device:
    """A device that reconnects on a signal, or fails; ``calls`` counts the attempts."""

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
    qtbot.waitUntil(lambda: not bridge.reconnecting.busy)


def test_a_session_that_ends_meanwhile_stays_ended(lost, device, world, qtbot):
    lost.operator.ask("reconnect")
    lost.participant.event.emit(EndRequested(world.now_s, "aborted", "cable"))
    device.go_on.set()
    settled(lost, qtbot)
    assert lost.view().over
    assert not world.force_is_on
    assert world.events()[-1] == "session_ended"


def test_a_device_that_fails_to_open_does_not_fail_the_session(lost, device, world, qtbot, caplog):
    device.error = OSError("the bus is gone")
    lost.operator.ask("reconnect")
    device.go_on.set()
    settled(lost, qtbot)
    assert lost.view().reconnection == "Not connected: OSError: the bus is gone."
    assert not lost.view().over
    assert not [entry for entry in world.done if entry[0] == "note"]
    assert not world.force_is_on
    assert [record.getMessage() for record in caplog.records] == ["the device was not reconnected: the bus is gone"]
    caplog.clear()
