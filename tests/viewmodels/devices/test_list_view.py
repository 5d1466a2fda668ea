"""What is said of each device: true to what was found, and one device for all ways to it."""

import pytest

from study_app.devices.backends import backends
from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, READY, Backend
from study_app.devices.registry import list_devices
from study_app.viewmodels.devices.list_view import device_named, devices_shown, looking

MOUSE = Backend("mouse", "the window", READY, "seen, not felt")
SOCKET = Backend("falcon-socket:PATH", "a Unix socket", READY, "by command")


def falcon(state, why=""):
    return Backend("falcon", "libusb 1.0", state, "felt, up to 8 N", why)


def ftdi(state, why=""):
    return Backend("falcon", "ftd2xx", state, "the same", why)


def test_every_device_is_shown_once_and_those_that_people_feel_with_first():
    shown = devices_shown(backends())
    names = [device.name for device in shown]
    assert set(list_devices()) <= set(names)
    assert len(names) == len(set(names))
    assert set(names[:5]) == {"mouse", "spacemouse", "falcon", "force-dimension", "inverse3"}
    assert all(device.can.endswith(".") for device in shown)
    (real,) = (device for device in shown if device.name == "falcon")
    assert [way.by.split()[0] for way in real.ways] == ["libusb", "ftd2xx"]


@pytest.mark.parametrize(
    ("ways", "word", "ready", "why"),
    [
        ((falcon("connected: FT1"), ftdi(NOT_AVAILABLE, "for Windows alone")), "Connected", True, ""),
        ((falcon("connected: unnamed", "no permission"), ftdi(NOT_AVAILABLE)), "Check it", False, "No permission."),
        ((falcon(NONE, "plug it in"), ftdi(NOT_AVAILABLE, "for Windows alone")), "Not connected", False, "Plug it in."),
        ((falcon(NONE, "plug it in"), ftdi(DRIVER_READY)), "Driver ready", False, ""),
        (
            (falcon(NOT_AVAILABLE, "install libusb"), ftdi(NOT_AVAILABLE, "other")),
            "Not available",
            False,
            "Install libusb.",
        ),
    ],
)
def test_a_falcon_is_as_well_as_the_best_way_to_it(ways, word, ready, why):
    (shown,) = devices_shown(ways)
    assert (shown.word, shown.ready, shown.why) == (word, ready, why)


def test_the_preferred_device_is_named_before_anybody_looked_and_if_nobody_knows_it():
    shown = devices_shown([MOUSE, falcon("connected: FT1"), SOCKET])
    assert device_named("falcon:FT1", shown).title == "Novint Falcon"
    assert device_named("falcon-socket:/run/f", shown).title == "Falcon behind a socket"
    assert device_named("falcon", ()) == looking("falcon")
    assert device_named("falcon", ()).word == "Looking …"
    unknown = device_named("hammer", shown)
    assert not unknown.ready
    assert "choose one of" in unknown.why
