"""No stop is lost under the painting windows of a session: a minute each of ``tests/benchmarks/devices/stops.py``."""

import pytest

from tests.compiled import needs_servo

pytestmark = [needs_servo, pytest.mark.nightly]
SECONDS = 60.0


@pytest.mark.parametrize("name", ["inverse3", "falcon", "force-dimension"])
def test_no_stop_is_lost_in_a_minute_under_painting_windows(qapp: object, name: str) -> None:
    from tests.benchmarks.devices.stops import under_windows

    result = under_windows(name, SECONDS)
    assert result.lost == []
    assert result.faults == []
    assert result.stops > 30
    assert result.under_force > 0.8 * result.stops
    assert result.frames > 10 * SECONDS
