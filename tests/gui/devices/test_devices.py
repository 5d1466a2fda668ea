"""What is said of each device, true to what was found, and of its last bench."""

from pathlib import Path
from typing import Any

import pytest

from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, READY, Backend
from study_app.devices.registry import backends, list_devices
from study_app.gui.kit.devices import benches_shown, device_named, devices_shown, looking
from study_app.store.workstation import DEFAULTS, DeviceBench

MOUSE = Backend("mouse", "the window", READY, "seen, not felt")
EMULATED = Backend("falcon-emulated", "the program", READY, "by command")


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
    shown = devices_shown([MOUSE, falcon("connected: FT1"), EMULATED])
    assert device_named("falcon:FT1", shown).title == "Novint Falcon"
    assert device_named("falcon-emulated", shown).title == "Emulated Falcon"
    assert device_named("falcon", ()) == looking("falcon")
    assert device_named("falcon", ()).word == "Looking …"
    unknown = device_named("hammer", shown)
    assert not unknown.ready
    assert "choose one of" in unknown.why


def bench(**fields: Any) -> DeviceBench:
    numbers: dict[str, Any] = {
        "name": "falcon",
        "serial": "FT1",
        "measured": "2026-11-21",
        "mass_kg": (0.19, 0.21, 0.2),
        "damping_nspm": (0.5, 0.5, 0.5),
        "friction_n": (0.1, 0.12, 0.1),
        "delay_ms": (1.0, 1.0, 1.0),
        "stable_nspm": (118.0, 120.0, 122.4),
    }
    return DeviceBench.model_validate(numbers | fields)


def test_words_have_date_serial_number_and_the_range_over_the_axes() -> None:
    shown = benches_shown([bench(gain=0.984)])["falcon"]
    assert shown.words == (
        "Measured 2026-11-21, serial number FT1: mass 0.19 to 0.21 kg, damping 0.5 N·s/m, friction 0.10 to 0.12 N, "
        "delay 1.0 ms, stable damping 118 to 122 N·s/m, 0.98 N on the scale per newton sent."
    )
    assert shown.report is None


def test_the_newest_bench_of_a_device_is_shown() -> None:
    older, newer = bench(serial="A", measured="2026-11-01"), bench(serial="B", measured="2026-11-20")
    other = bench(name="inverse3", serial="")
    shown = benches_shown(DEFAULTS.with_bench(older).with_bench(newer).with_bench(other).benches)
    assert list(shown) == ["inverse3", "falcon"]
    assert "Measured 2026-11-20, serial number B:" in shown["falcon"].words
    assert "Measured 2026-11-21: " in shown["inverse3"].words


def test_a_report_that_is_gone_is_said_and_not_offered(tmp_path: Path) -> None:
    report = tmp_path / "bench.md"
    gone = benches_shown([bench(report=str(report))])["falcon"]
    assert gone.report is None
    assert gone.words.endswith(f"The report is missing: {report}.")
    report.write_text("# Bench\n")
    assert benches_shown([bench(report=str(report))])["falcon"].report == report
