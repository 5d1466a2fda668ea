"""Devices opened for the lab: one at a time, cancelled, refused, released."""

import threading
from collections.abc import Callable
from typing import Any

import pytest

from study_app.app.lab_controller import LabController, LabOpening
from study_app.errors import ServoFault
from tests.app.lab.worlds import PATIENCE, SOON_MS, SlowDevices
from tests.compiled import needs_servo

MakeLab = Callable[..., LabController]

pytestmark = [needs_servo, pytest.mark.slow, pytest.mark.usefixtures("qapp")]


@pytest.mark.parametrize("stuck", [False, True])
def test_two_devices_are_never_opened_at_a_time_and_one_that_cannot_be_closed_holds_nobody_up(
    qtbot: Any, stuck: bool
) -> None:
    class Devices(SlowDevices):
        def close(self) -> None:
            super().close()
            if stuck:
                raise ServoFault("the servo is stuck: switch it off")

    devices = Devices()
    opening = LabOpening(devices)
    failed: list[str] = []
    rigs: list[Any] = []
    opening.failed.connect(lambda error: failed.append(str(error)))
    opening.opened.connect(rigs.append)
    opening.request_device("falcon")
    qtbot.waitUntil(lambda: devices.requests == ["falcon"], timeout=SOON_MS)
    opening.request_device("spacemouse")
    opening.request_device("mouse")
    devices.gate.set()
    qtbot.waitUntil(lambda: bool(rigs), timeout=SOON_MS)
    assert devices.requests == ["falcon", "mouse"]
    assert (devices.most, devices.open, devices.closed) == (1, 1, 1)
    assert failed == (["the servo is stuck: switch it off"] if stuck else [])


def test_leaving_while_a_device_is_being_opened_lets_go_of_it(make_lab: MakeLab, qtbot: Any) -> None:
    devices = SlowDevices()
    visit = make_lab(open_live=devices)
    visit.place.show()
    qtbot.waitUntil(lambda: devices.requests == ["scripted"], timeout=SOON_MS)
    qtbot.waitUntil(lambda: visit.view().busy == "switch scripted on", timeout=SOON_MS)
    visit.place.hide()
    threading.Timer(0.05, devices.gate.set).start()
    visit.end(PATIENCE)
    assert (devices.open, devices.closed) == (0, 1)
    assert visit.live is None


def test_a_force_that_was_stopped_does_not_come_with_a_device_that_is_being_opened(
    make_lab: MakeLab, qtbot: Any
) -> None:
    devices = SlowDevices()
    visit = make_lab(open_live=devices)
    visit.place.show()
    qtbot.waitUntil(lambda: devices.requests == ["scripted"], timeout=SOON_MS)
    visit.place.ask("stop")
    devices.gate.set()
    qtbot.waitUntil(lambda: devices.closed == 1, timeout=SOON_MS)
    assert visit.live is None
    view = visit.view()
    assert (view.busy, view.trouble, view.may_fade_in) == ("", "No device is open", True)
    visit.place.ask("change", "liquid.density_kg_m3", 900.0, False)
    assert visit.view().trouble == "No device is open"  # an edit opens none
