"""Descriptions of each device, its answers tick by tick, failure modes of a Falcon, and descriptors."""

import pickle
from pathlib import Path

import pytest

from study_app.devices.doctor import Report, report_lines
from study_app.devices.falcon.failures import failures_on
from study_app.devices.registry import all_devices
from tests.golden import compare, each_once
from tests.golden_values import value_lines

GOLDEN = Path(__file__).parent / "golden"


def test_failure_modes_of_a_falcon(pytestconfig: pytest.Config) -> None:
    lines = list[str]()
    for platform in ("linux", "win32", "darwin"):
        table = failures_on(platform)
        ids = [mode.id for mode in table.modes]
        reports = [Report((), table.findings({mode}, table.before(mode)), table.sentence(mode)) for mode in ids]
        lines += [f"{platform}: {' '.join(ids)}", *(line for report in reports[::4] for line in report_lines(report))]
        assert pickle.loads(pickle.dumps(reports)) == reports  # noqa: S301 - of the worker
        lines += report_lines(Report(("a Falcon",), table.findings(ids, ids), None))
    compare(GOLDEN / "falcon_failures.txt", each_once(lines), pytestconfig)


def test_descriptors(pytestconfig: pytest.Config) -> None:
    lines = list[str]()
    for device in all_devices():
        name = device.name
        values = device.window_values({"firmware": "/f.bin", "dhd-library": "/l.so", "nothing": "x"})
        lines += [*value_lines(device, name), f"{name}: {device.label} {dict(values)}"]
    compare(GOLDEN / "descriptors.txt", each_once(lines), pytestconfig)
