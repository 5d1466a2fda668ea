"""What each device says of itself and answers tick by tick, what can go wrong with a Falcon, and descriptors."""

import pickle
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from study_app.devices.doctor import Report, report_lines
from study_app.devices.falcon.failures import failures_on
from study_app.devices.registry import all_devices
from tests.compiled import needs_servo
from tests.devices.subjects import Subject, falcon, force_dimension, inverse3, mouse, over, scripted
from tests.golden import compare
from tests.golden_values import value_lines

GOLDEN = Path(__file__).parent / "golden"


def test_what_can_go_wrong_with_a_falcon(pytestconfig: pytest.Config) -> None:
    told = list[str]()
    for platform in ("linux", "win32", "darwin"):
        table = failures_on(platform)
        ids = [mode.id for mode in table.modes]
        reports = [Report((), table.findings({mode}, table.before(mode)), table.sentence(mode)) for mode in ids]
        told += [f"{platform}: {' '.join(ids)}", *(line for one in reports[::4] for line in report_lines(one))]
        assert pickle.loads(pickle.dumps(reports)) == reports  # noqa: S301 - of the worker
        told += report_lines(Report(("a Falcon",), table.findings(ids, ids), None))
    compare(GOLDEN / "falcon_failures.txt", told, pytestconfig)


def test_descriptors(pytestconfig: pytest.Config) -> None:
    told = list[str]()
    for one in all_devices():
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
