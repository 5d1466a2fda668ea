"""The expected error of a scene's force, in numbers and in a line."""

import math

import pytest

from study_app.evidence.expected_error import expected, physical_n
from study_app.evidence.reference_solutions import stroke_motion
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.effects.local_wake import LocalWake
from study_app.haptics.model.estimators import Ewma, Given, Kalman
from study_app.haptics.model.scene import Scene
from tests.evidence.accuracy.scenes import HONEY, REAL, TANK, WATER, compiled

pytestmark = pytest.mark.slow


@compiled
def test_with_a_given_velocity_only_the_limits_cause_an_error():
    known = expected(TANK.model_copy(update={"velocity": Given()}))
    assert known.error_share == pytest.approx(known.causes.limits, abs=1e-10)
    assert known.error_share > 0.01


@compiled
def test_an_exact_model_with_the_true_velocity_is_expected_to_be_right():
    tank = expected(TANK)
    assert tank.cost_ns > 0
    assert tank.causes.law < 1e-10
    assert 0.01 < tank.error_share < 0.5
    local = LocalWake(length=300, scaling=300)
    places = WATER.model_copy(update={"effects": ("drag", "local_wake"), "local_wake": local})
    assert expected(Scene(liquids=(places,))).causes.law < 0.05


@compiled
def test_omitted_effects_appear_in_the_expected_error():
    named = HONEY.model_copy(update={"effects": ("drag",), "drag": Drag(law="haider-levenspiel")})
    lacking = expected(REAL.model_copy(update={"liquids": (named,)}))
    whole = expected(REAL)
    assert whole.causes.law < 0.05
    assert lacking.causes.law > 0.4
    both = expected(REAL.model_copy(update={"liquids": (HONEY, named.model_copy(update={"id": "other"}))}))
    assert both.error_n == pytest.approx(lacking.error_n)
    assert "drag by experiments" in both.against
    assert expected(Scene()).error_n == 0


@compiled
def test_the_error_is_split_by_cause():
    """EWMA lags in velocity; behind a Kalman filter the smoothing of dw/dt lags; each limit takes its part alone."""

    def causes(delay=1, **changes):
        expected_error = expected(REAL.model_copy(update={"velocity": Kalman(), **changes}), delay)
        assert expected_error.error_share < sum(expected_error.causes) + 1e-12
        return expected_error.causes

    kalman, ewma, known = (causes(velocity=it) for it in (Kalman(), Ewma(), Given()))
    assert kalman.acceleration > 2 * kalman.velocity > 0
    assert ewma.velocity > 4 * kalman.velocity
    assert max(known.velocity, known.acceleration) < 1e-12
    assert kalman.law == ewma.law == known.law > 0
    assert causes(liquids=(HONEY.model_copy(update={"effects": ("drag",)}),)).acceleration < 1e-12
    assert causes(delay=4).limits > kalman.limits + 0.1
    weak = causes(force_limit_n=1.0)
    assert weak.limits > kalman.limits + 0.3
    assert weak[0] == pytest.approx(kalman.velocity, rel=0.5)
    assert (weak.acceleration, weak.law) == (kalman.acceleration, kalman.law)


def test_the_force_of_a_slow_stroke_equals_that_of_creeping_flow():
    """Far below Re 1 the drag by experiments is Stokes', within their scatter, and the rest is exact."""
    omega, v = 10.0, 1e-3
    t_s = stroke_motion(v, omega, 1, 1000).t_s
    force = physical_n(REAL, v, omega, t_s)
    radius, mu, rho = 0.034, 10.0, 1420.0
    delta = math.sqrt(2 * mu / (rho * omega))
    at_rest = round(math.pi / omega * 1000)  # v = 0, dv/dt = −ω v
    inertia = 3 * math.pi * radius**2 * math.sqrt(2 * mu * rho / omega) * (1 + 2 * radius / (9 * delta))
    assert force[at_rest, 0] == pytest.approx(inertia * omega * v, rel=0.01)
    fastest = round(math.pi / 2 / omega * 1000)
    damping = 6 * math.pi * mu * radius * (1 + radius / delta)
    assert force[fastest, 0] == pytest.approx(-damping * v, rel=0.12)
    lift = (rho - 1000) * 4 / 3 * math.pi * radius**3 * 9.80665
    assert force[:, 1] == pytest.approx(lift)
