"""What each device says of itself and answers tick by tick, what is found by the facts of a Falcon, and descriptors."""

import pickle
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from study_app.devices.doctor_report import Report, lines
from study_app.devices.falcon.doctor.failure_report import findings_of
from study_app.devices.falcon.failures import (
    LARGEST_STEP_N,
    LEAST_HZ,
    LONGEST_ROUND_TRIP_S,
    MOST_BROKEN,
    OPEN,
    Facts,
    sentence,
)
from study_app.devices.registry import discover
from tests.compiled import needs_servo
from tests.devices.subjects import Subject, falcon, force_dimension, inverse3, mouse, over, scripted
from tests.golden import compare
from tests.golden_values import value_lines

GOLDEN = Path(__file__).parent / "golden"
USB = ("access", "busy", "not-supported", "not-found", "no-device", "kernel-driver", "no-backend", "no-ftd2xx", "io",
       "timeout", "overflow", "pipe", OPEN)  # fmt: skip
VALUES: dict[str, tuple[Any, ...]] = {
    "usb": USB,
    "listed": (True, False),
    "ftdi_sees": (True, False),
    "program": ("running", "loaded", "needed", "refused"),
    "boot_step": ("ping", "autobaud", "echo", "start"),
    "replies": (True, False),
    "homed": (0, 0b101, 0b111),
    "moved": (True, False),
    "pulled_out": (True, False),
    "round_trip_s": (0.99 * LONGEST_ROUND_TRIP_S, LONGEST_ROUND_TRIP_S),
    "broken_share": (MOST_BROKEN, 1.01 * MOST_BROKEN),
    "rate_hz": (LEAST_HZ, 0.99 * LEAST_HZ),
    "step_n": (LARGEST_STEP_N, 1.01 * LARGEST_STEP_N),
}
MARKS = {"ok": ".", "found": "F", "not checked": "?"}


def rows(base: Facts) -> Iterator[str]:
    for name, values in VALUES.items():
        for value in values:
            facts = replace(base, **{name: value})
            states = "".join(MARKS[one.state] for one in findings_of(facts))
            yield f"{base.platform} {name} {value}: {states} {sentence(facts)[:60]}"
    for first in USB[:5]:
        for listed, sees in ((True, True), (True, False), (False, False)):
            facts = replace(base, usb=first, listed=listed, ftdi_sees=sees)
            yield f"{base.platform} {first} {listed} {sees}: {''.join(MARKS[one.state] for one in findings_of(facts))}"


def test_findings_of_a_falcon(pytestconfig: pytest.Config) -> None:
    found = list[str]()
    for platform in ("linux", "win32", "darwin"):
        found += rows(Facts(platform=platform))
        worst = Facts(
            platform=platform, usb="access", boot_step="echo", replies=False, moved=False, homed=0, step_n=1.0
        )
        for facts in (worst, replace(worst, usb="busy", program="refused"), Facts(platform=platform, usb=OPEN)):
            assert pickle.loads(pickle.dumps(findings_of(facts))) == findings_of(facts)  # noqa: S301 - of the worker
            report = Report(("a Falcon",), findings_of(facts), sentence(facts) or None)
            found += [*lines(report), f"{report.well} {report.conclusion}", *(one.id for one in report.found)]
    compare(GOLDEN / "falcon_findings.txt", found, pytestconfig)


def test_descriptors(pytestconfig: pytest.Config) -> None:
    told = list[str]()
    for one in discover().devices:
        name = one.name
        values = one.window_values({"firmware": "/f.bin", "dhd-library": "/l.so", "nothing": "x"})
        told += [*value_lines(one, name), f"{name}: {one.label} {dict(values)}"]
    compare(GOLDEN / "descriptors.txt", told, pytestconfig)


@needs_servo
@over(mouse, scripted, falcon, inverse3, force_dimension)
def test_ticks(made: Callable[..., Subject], request: pytest.FixtureRequest, pytestconfig: pytest.Config) -> None:
    limits = {} if made is mouse else {"random": Random(3)}  # noqa: S311
    subject = made(request, force_limit_n=4.0, workspace_m=(0.04, 0.03, 0.02), **limits)
    device, said = subject.device, list[str]()

    def tell(what: str, ticks: Any, answers: Any = ()) -> None:
        reading = ticks.reading[0]
        said.append(f"== {what} {' '.join(map(str, answers))}")
        read = {name: reading[name] for name in reading.dtype.names if not name.endswith("_ns")}
        said.extend(value_lines(read, "reading"))
        said.append(f"force: {' '.join(f'{one:.4f}' for one in np.round(subject.acting_n(), 4) + 0.0)}")
        said.append(f"failure: {device.failure}")
        said.extend(value_lines(getattr(device, "counters", {}), "counters"))

    said += [*value_lines(device.describe()), *value_lines(device.dynamics, "dynamics")]
    ticks = subject.ticks()
    tell("opened", ticks, [ticks.after(5), ticks.read(), ticks.read(pause_ns=0)])
    for force in ((0.5, -1.0, 1.5), (0.0, 0.0, 9.0), (np.nan, 0.0, 0.0), (0.0, -3.0, 0.0), (0.0, 0.0, 0.0)):
        answers = [ticks.take(force) for _ in range(min(subject.settle_ticks, 60) + 20)]
        subject.elapse()
        tell(f"force {force}", ticks, [answers[0], answers[-1]])
    if subject.press is not None:
        for buttons in (1, 2, 0):
            subject.press(buttons)
            ticks.after(5)
            said.append(f"buttons {buttons}: {ticks.reading[0].buttons}")
    assert subject.move is not None
    subject.move()
    for _ in range(3):
        tell("moved", ticks, [ticks.after(100, (1.0, 0.0, 0.0))])
    subject.lose()
    tell("lost", ticks, [ticks.after(1), ticks.after(30, (1.0, 0.0, 0.0)), ticks.after(100)])
    subject.restore()
    device.close()
    tell("closed", ticks, [ticks.read() if device.name not in ("mouse", "scripted") else ""])
    compare(GOLDEN / f"ticks_{made.__name__}.txt", said, pytestconfig)
