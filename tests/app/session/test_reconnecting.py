"""A device that failed is connected again beside the windows: told line by line, and refused or done in order."""

import threading

import pytest
from PySide6.QtCore import Qt

from study_app.errors import DeviceNotFound
from study_app.session.pages import PausePage, TaskPage
from study_app.session.transitions.events import EndAsked
from tests.app.world import begin_trial

pytestmark = pytest.mark.slow

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
