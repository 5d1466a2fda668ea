"""What each device says of itself and answers tick by tick, what can go wrong with a Falcon, and descriptors."""

import pickle
from pathlib import Path

import pytest

from study_app.devices.doctor import Report, report_lines
from study_app.devices.falcon.failures import failures_on
from study_app.devices.registry import all_devices
from tests.golden import compare, each_once
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
    compare(GOLDEN / "falcon_failures.txt", each_once(told), pytestconfig)


def test_descriptors(pytestconfig: pytest.Config) -> None:
    told = list[str]()
    for one in all_devices():
        name = one.name
        values = one.window_values({"firmware": "/f.bin", "dhd-library": "/l.so", "nothing": "x"})
        told += [*value_lines(one, name), f"{name}: {one.label} {dict(values)}"]
    compare(GOLDEN / "descriptors.txt", each_once(told), pytestconfig)
