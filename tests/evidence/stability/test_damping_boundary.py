"""The damping that a free handle bears, measured on the servo's tick, against the eigenvalues of the linear loop."""

import math

import numpy as np
import pytest

from study_app.evidence.stability.damping_limits import boundary_nspm, measure_limits, passive_nspm
from study_app.haptics.model.estimators import DeviceVelocity, Ewma, Kalman, Raw
from study_app.haptics.model.slope_limits import damping_limits, slope_limit_table
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


def radius(damping_nspm, period_s, delay, taps, mass_kg, friction_nspm):
    """Return the spectral radius of mass, held force, delay and velocity estimator v_k = Σ taps_i p_{k-i} (or EWMA)."""
    decay = math.exp(-friction_nspm / mass_kg * period_s)
    reach = (1 - decay) / friction_nspm  # of a force, on the velocity
    way = (period_s - reach * mass_kg) / friction_nspm  # of a force, on the place
    ewma = isinstance(taps, float)
    places = 2 if ewma else len(taps)
    # state: places p_k … p_{k-places+1}, velocity, EWMA's last estimate, forces that wait (newest first)
    n = places + 2 + delay + 1
    step = np.zeros((n, n))
    v, estimate, force = places, places + 1, places + 2
    row = np.zeros(n)
    if ewma:
        row[0], row[1], row[estimate] = taps / period_s, -taps / period_s, 1 - taps
    else:
        row[:places] = taps
    step[estimate] = row
    step[force] = -damping_nspm * row
    for k in range(delay):
        step[force + 1 + k, force + k] = 1
    acting = step[force] if delay == 0 else np.eye(n)[force + delay - 1]
    step[0, 0], step[0, v] = 1, reach * mass_kg
    step[0] += way * acting
    step[v, v] = decay
    step[v] += reach * acting
    for k in range(1, places):
        step[k, k - 1] = 1
    modes = np.linalg.eigvals(step)
    return max(abs(modes[abs(modes - 1) > 1e-6]))


def critical_nspm(period_s, delay, taps, mass_kg=0.1, friction_nspm=0.5):
    """Return the damping at which a mode first grows; the place itself is a mode of 1 that means nothing."""
    low, high = 0.1, 1e4
    for _ in range(60):
        middle = math.sqrt(low * high)
        if radius(middle, period_s, delay, taps, mass_kg, friction_nspm) > 1 + 1e-9:
            high = middle
        else:
            low = middle
    return low


def line_taps(period_s, samples=15):
    """Return the weights of the least-squares slope, newest place first."""
    ages = -np.arange(samples) * period_s
    ages -= ages.mean()
    return ages / (ages**2).sum()


@pytest.mark.parametrize(
    ("period_s", "delay", "published"),
    [(1e-3, 0, 210), (1e-3, 1, 71.5), (1e-3, 2, 43.7), (1e-3, 4, 25.0), (2e-3, 1, 37), (4e-3, 4, 7.2)],
)
def test_the_boundary_agrees_with_eigenvalues_and_published_table(period_s, delay, published):
    weight = 1 - 0.9 ** (period_s / 1e-3)
    exact = critical_nspm(period_s, delay, weight)
    measured = boundary_nspm(Ewma(), period_s, delay)
    assert measured == pytest.approx(exact, rel=0.05)  # found in 3 s, in steps of 1 %, with sub-steps of 50 µs
    assert exact == pytest.approx(published, rel=0.02)


@pytest.mark.parametrize(("mass_kg", "friction_nspm"), [(0.25, 0.5), (0.1, 5.0)])
def test_mass_and_friction_move_it_as_the_eigenvalues_say(mass_kg, friction_nspm):
    exact = critical_nspm(1e-3, 1, 0.1, mass_kg, friction_nspm)
    measured = boundary_nspm(Ewma(), 1e-3, 1, mass_kg=mass_kg, friction_nspm=friction_nspm)
    assert measured == pytest.approx(exact, rel=0.03)


@pytest.mark.parametrize("samples", [5, 15])
def test_the_limits_of_a_measured_velocity_lie_below_the_boundary_of_a_line_that_lags_as_much(samples):
    exact = critical_nspm(1e-3, 1, line_taps(1e-3, samples))
    measured = DeviceVelocity(lag_s=(samples - 1) / 2 * 1e-3)
    assert 0.4 * exact < damping_limits(1e-3, 1, measured).drag_nspm < 0.78 * exact


def test_without_delay_friction_proves_19_times_its_damping():
    assert passive_nspm(1.0) == pytest.approx(1.9 / 0.1, rel=1e-3)
    assert 1 / passive_nspm(1.0, delay=1) == pytest.approx(0.120, abs=0.001)
    assert 1 / passive_nspm(1.0, delay=4) == pytest.approx(0.284, abs=0.001)
    assert 1 / passive_nspm(1.0, alpha=1.0) == pytest.approx(1.0, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0, 1, 4])
@pytest.mark.parametrize("friction_nspm", [0.1, 1.0, 10.0])
def test_provably_passive_damping_is_stable(delay, friction_nspm):
    proved = passive_nspm(friction_nspm, delay=delay)
    assert proved < boundary_nspm(Ewma(), 1e-3, delay, friction_nspm=friction_nspm)


@pytest.mark.slow
@pytest.mark.parametrize("velocity", [Ewma(), Ewma(alpha=0.2), Kalman(), Raw()], ids=str)
def test_the_shipped_table_is_the_one_that_is_measured(velocity):
    """This checks the first lines of some estimators; a command recomputes the whole table."""
    value = getattr(velocity, "alpha", None)
    shipped = [it for it in slope_limit_table() if (it.estimator, it.parameter) == (velocity.kind, value)]
    assert len(shipped) == 16
    for row, measured in zip(shipped[:6], measure_limits([velocity]), strict=False):
        assert row[:4] == (
            measured.estimator,
            measured.parameter,
            pytest.approx(measured.period_s),
            measured.delay_ticks,
        )
        assert row.limits == pytest.approx(measured.limits, rel=0.02, abs=0.11)


@pytest.mark.slow
def test_every_limit_lies_below_the_boundary():
    for delay in (1, 2, 4):
        for period_s in (0.5e-3, 1e-3, 4e-3):
            assert damping_limits(period_s, delay).drag_nspm < 0.78 * boundary_nspm(Ewma(), period_s, delay)
