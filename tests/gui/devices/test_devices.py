"""What is said of each device, true to what was found, compared with a reviewed text."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtWidgets import QDialog, QWidget

from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, READY, Backend
from study_app.devices.registry import backends, list_devices
from study_app.gui.devices.view import DevicesPlace
from study_app.gui.kit.devices import device_before_search, device_named, devices_shown
from study_app.store.workstation import DEFAULTS
from tests.golden import check_kept
from tests.golden_values import value_lines

MOUSE = Backend("mouse", "the window", state=READY, can="seen, not felt")
EMULATED = Backend("falcon-emulated", "the program", state=READY, can="by command")


def falcon(state: str, why: str = "") -> Backend:
    return Backend("falcon", "libusb 1.0", state=state, can="felt, up to 8 N", why=why)


def ftdi(state: str, why: str = "") -> Backend:
    return Backend("falcon", "ftd2xx", state=state, can="the same", why=why)


FOR_WINDOWS = ftdi(NOT_AVAILABLE, "for Windows alone")
WAYS = (
    (falcon("connected: FT1"), FOR_WINDOWS),
    (falcon("connected: unnamed", "no permission"), ftdi(NOT_AVAILABLE)),
    (falcon(NONE, "plug it in"), FOR_WINDOWS),
    (falcon(NONE, "plug it in"), ftdi(DRIVER_READY)),
    (falcon(NOT_AVAILABLE, "install libusb"), ftdi(NOT_AVAILABLE, "other")),
)


def told() -> Iterator[str]:
    for ways in WAYS:
        yield from value_lines(devices_shown(ways), "the best way to a Falcon")
    shown = devices_shown([MOUSE, falcon("connected: FT1"), EMULATED])
    for name in ("falcon:FT1", "falcon-emulated", "hammer"):
        yield from value_lines(device_named(name, shown), f"preferred {name}")
    assert device_named("falcon", ()) == device_before_search("falcon")
    yield from value_lines(device_before_search("falcon"), "before anybody looked")


def test_devices_are_told_as_reviewed() -> None:
    check_kept(Path(__file__).with_name("devices.txt"), told())


def test_every_device_is_shown_once_and_those_that_people_feel_with_first() -> None:
    names = [device.name for device in devices_shown(backends())]
    assert set(list_devices()) <= set(names)
    assert len(names) == len(set(names))
    assert set(names[:5]) == {"mouse", "spacemouse", "falcon", "force-dimension", "inverse3"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preferred", "examined"), [("falcon:FT123", "falcon:FT123"), ("falcon", "falcon"), ("mouse", "falcon")]
)
def test_of_several_devices_the_one_with_the_preferred_serial_number_is_examined(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, preferred: str, examined: str
) -> None:
    asked: list[str] = []

    def open_diagnosis(window: QWidget, _theme: object, name: str, _settings: object) -> QDialog:
        asked.append(name)
        return QDialog(window)

    monkeypatch.setattr("study_app.gui.devices.view.open_diagnosis", open_diagnosis)
    place = DevicesPlace(DEFAULTS.model_copy(update={"device": preferred}), list)
    qtbot.addWidget(place)
    place.diagnose("falcon")
    place.end_diagnosis()
    assert asked == [examined]
