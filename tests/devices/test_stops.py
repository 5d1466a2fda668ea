"""No stop is lost under the painting windows of a session: a minute each of ``tests/benchmarks/devices/stops.py``."""

import pytest

from tests.compiled import needs_servo

pytestmark = [needs_servo, pytest.mark.nightly]
SECONDS = 60.0


@pytest.mark.parametrize("name", ["inverse3", "falcon", "force-dimension"])
def test_a_minute_of_stops_under_painting_windows_loses_none(qapp: object, name: str) -> None:
    from tests.benchmarks.devices.stops import under_windows

    found = under_windows(name, SECONDS)
    assert found.lost == []
    assert found.faults == []
    assert found.stops > 30
    assert found.under_force > 0.8 * found.stops
    assert found.frames > 10 * SECONDS
