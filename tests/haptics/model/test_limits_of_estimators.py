"""Which entries of the table of slope limits count for an estimator."""

import pytest

from study_app.haptics.model.estimators import MOST_LAG_TICKS, DeviceVelocity, Ewma, Given, Raw
from study_app.haptics.model.force_rules import VERSIONS
from study_app.haptics.model.slope_limits import damping_limits, handle_limits, table


def entry(name, parameter):
    """Return the limit of drag of an entry, at 1 kHz and one tick of delay."""
    (found,) = [
        it.limits.drag_nspm
        for it in table()
        if (it.estimator, it.parameter, it.period_s, it.delay_ticks) == (name, parameter, 1e-3, 1)
    ]
    return found


def limit(velocity):
    """Return the same of an estimator."""
    return damping_limits(1e-3, 1, velocity).drag_nspm


def test_between_two_weights_the_worse_counts_and_a_given_velocity_has_the_limit_of_ewma():
    assert limit(Ewma(alpha=0.11)) == min(entry("ewma", 0.1), entry("ewma", 0.12))
    assert limit(Ewma(alpha=0.18)) == min(entry("ewma", 0.15), entry("ewma", 0.2)) > limit(Raw())
    assert limit(Given()) == limit(Ewma()) == 53


def test_velocity_of_a_device_has_the_limits_of_a_line_that_lags_as_much():
    assert limit(DeviceVelocity(lag_s=2e-3)) == entry("line", 5) == 25.6
    assert limit(DeviceVelocity(lag_s=3e-3)) == min(entry("line", 5), entry("line", 8))
    assert limit(DeviceVelocity()) == entry("line", 2) == pytest.approx(limit(Raw()), rel=0.02)
    assert limit(DeviceVelocity(lag_s=MOST_LAG_TICKS * 1e-3)) == entry("line", 16)


@pytest.mark.parametrize(
    ("alpha", "delay_ticks", "inertia_nspm"),
    [(0.1, 1, 45.0), (0.1, 2, 28.491), (0.1, 3, 10.470), (0.3, 2, 18.6), (1.0, 3, 1.9)],
)
def test_inertia_keeps_its_limit_at_long_delays_of_ewma(alpha, delay_ticks, inertia_nspm):
    assert handle_limits(1e-3, delay_ticks, Ewma(alpha=alpha)).inertia_nspm == pytest.approx(inertia_nspm, abs=0.001)


def test_released_rules_have_the_inertia_limits_of_the_table():
    assert handle_limits(1e-3, 2, Ewma(), rules=VERSIONS[2]).inertia_nspm == 6.4
