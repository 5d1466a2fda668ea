"""What is said of each device, true to what was found, and of its last bench, compared with a reviewed text."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, READY, Backend
from study_app.devices.registry import backends, list_devices
from study_app.gui.kit.devices import benches_shown, device_named, devices_shown, looking
from study_app.store.workstation import DEFAULTS, DeviceBench
from tests.golden import compare
from tests.golden_values import value_lines

MOUSE = Backend("mouse", "the window", READY, "seen, not felt")
EMULATED = Backend("falcon-emulated", "the program", READY, "by command")


def falcon(state: str, why: str = "") -> Backend:
    return Backend("falcon", "libusb 1.0", state, "felt, up to 8 N", why)


def ftdi(state: str, why: str = "") -> Backend:
    return Backend("falcon", "ftd2xx", state, "the same", why)


FOR_WINDOWS = ftdi(NOT_AVAILABLE, "for Windows alone")
WAYS = (
    (falcon("connected: FT1"), FOR_WINDOWS),
    (falcon("connected: unnamed", "no permission"), ftdi(NOT_AVAILABLE)),
    (falcon(NONE, "plug it in"), FOR_WINDOWS),
    (falcon(NONE, "plug it in"), ftdi(DRIVER_READY)),
    (falcon(NOT_AVAILABLE, "install libusb"), ftdi(NOT_AVAILABLE, "other")),
)


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


def told(folder: Path) -> Iterator[str]:
    for ways in WAYS:
        yield from value_lines(devices_shown(ways), "the best way to a Falcon")
    shown = devices_shown([MOUSE, falcon("connected: FT1"), EMULATED])
    for name in ("falcon:FT1", "falcon-emulated", "hammer"):
        yield from value_lines(device_named(name, shown), f"preferred {name}")
    assert device_named("falcon", ()) == looking("falcon")
    yield from value_lines(looking("falcon"), "before anybody looked")
    benches = [
        bench(gain=0.984, measured="2026-11-01"),
        bench(serial="B", measured="2026-11-20", report=str(folder / "gone.md")),
        bench(name="inverse3", serial="", gain=0.984, report=str(folder / "here.md")),
    ]
    (folder / "here.md").write_text("# Bench\n")
    machine = DEFAULTS
    for measured in benches:
        machine = machine.with_bench(measured)
    for name, one in (*benches_shown(benches[:1]).items(), *benches_shown(machine.benches).items()):
        yield f"{name}: {one.words} Report: {one.report}"


def test_devices_and_benches_are_told_as_reviewed(tmp_path: Path, pytestconfig: pytest.Config) -> None:
    lines = (line.replace(f"{tmp_path}/", "") for line in told(tmp_path))
    compare(Path(__file__).parent / "golden" / "devices.txt", lines, pytestconfig)


def test_every_device_is_shown_once_and_those_that_people_feel_with_first() -> None:
    names = [device.name for device in devices_shown(backends())]
    assert set(list_devices()) <= set(names)
    assert len(names) == len(set(names))
    assert set(names[:5]) == {"mouse", "spacemouse", "falcon", "force-dimension", "inverse3"}
