import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.laws import LAWS, drag_n
from study_app.haptics.model.scene import Body
from study_app.haptics.model.slope_limits import slope_limit
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import UNBENT, examples, liquid, moving, scene, vectors

speeds = st.floats(-20, 20)


@pytest.mark.slow
@settings(max_examples=examples(100), deadline=None)
@given(vx=speeds, vy=speeds, vz=speeds, density=st.floats(1, 20_000), diameter=st.floats(0.001, 1), cd=st.floats(0, 10))
def test_drag_is_half_rho_cd_a_v_squared_against_the_motion(vx, vy, vz, density, diameter, cd):
    body = Body(diameter_m=diameter, drag_coefficient=cd)
    table = simulate(scene(liquid(density), body=body, knee=UNBENT), moving([(vx, vy, vz)]))
    v = np.array([vx, vy, vz])
    expected = -0.5 * density * cd * (np.pi * diameter**2 / 4) * np.linalg.norm(v) * v
    assert vectors(table, "force")[0] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def viscous(law, density, viscosity, **fields):
    return scene(liquid(density, viscosity_pa_s=viscosity, drag=Drag(law=law)), knee=UNBENT, **fields)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["constant", *LAWS])
@settings(max_examples=examples(50), deadline=None)
@given(
    velocity=st.tuples(speeds, speeds, speeds),
    scale=st.sampled_from([1.0, 1e-3, 1e-9]),
    density=st.floats(500, 2000),
    viscosity=st.floats(1e-4, 1e3),
    diameter=st.floats(0.001, 1),
)
def test_drag_follows_its_law_against_the_motion(law, velocity, scale, density, viscosity, diameter):
    body = Body(diameter_m=diameter)
    v = scale * np.array(velocity)
    force = vectors(simulate(viscous(law, density, viscosity, body=body), moving([v])), "force")[0]
    fluid = {"density_kg_m3": density, "viscosity_pa_s": viscosity, "diameter_m": diameter, "drag_coefficient": 0.47}
    speed = np.linalg.norm(v)
    expected = -drag_n(law, speed, **fluid) * v / speed if speed > 0 else 0 * v
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-100)


@pytest.mark.parametrize("law", ["haider-levenspiel", "brown-lawler"])
@pytest.mark.parametrize(
    ("density", "viscosity", "at_half_mps_n", "mps_at_8_n"),
    [(998.2, 1.0016e-3, 0.2166, 3.01), (913, 0.084, 0.2652, 3.51), (1420, 10, 4.622, 0.780), (1150, 100, None, 0.121)],
)
def test_real_liquids_are_as_strong_as_published(law, density, viscosity, at_half_mps_n, mps_at_8_n):
    force_n = simulate(viscous(law, density, viscosity), moving([(0.5, 0, 0), (mps_at_8_n, 0, 0)])).fx_n
    if at_half_mps_n is not None:
        assert force_n[0] == pytest.approx(-at_half_mps_n, rel=0.07)
    assert force_n[1] == pytest.approx(-8, rel=0.07)


@pytest.mark.slow
@settings(max_examples=examples(200), deadline=None)
@given(
    velocity=st.tuples(speeds, speeds, speeds),
    scale=st.floats(0.01, 100),
    damping=st.floats(0.01, 200),
    diameter=st.floats(0.001, 1),
)
def test_a_linear_damper_resists_the_hand_alike_at_any_scale_with_any_ball_and_knee(velocity, scale, damping, diameter):
    damper = liquid(drag=Drag(law="linear", damping_nspm=damping))
    hand = np.array(velocity) / scale
    force = vectors(simulate(scene(damper, scale=scale, body=Body(diameter_m=diameter)), moving([velocity])), "force")
    assert force[0] == pytest.approx(-damping * hand, rel=1e-12, abs=1e-100)


def test_the_slope_limit_of_a_linear_damper_is_on_its_damping():
    """A damper at the limit is sent whole; one beyond it is sent as the limit."""
    most = slope_limit(1e-3, 1)
    hand_mps = 0.05
    for damping, expected in ((0.999 * most, 0.999 * most), (1.5 * most, most)):
        damper = scene(liquid(drag=Drag(law="linear", damping_nspm=damping)), scale=7.0)
        sent = simulate(damper, moving([(7.0 * hand_mps, 0.0, 0.0)] * 200)).device_fx_n[-1]
        assert sent == pytest.approx(-expected * hand_mps, rel=1e-9)


def test_only_the_linear_law_has_a_damping():
    with pytest.raises(ValidationError, match='is missing: it is required by the drag law "linear"'):
        Drag(law="linear")
    with pytest.raises(ValidationError, match='is used only by the drag law "linear"'):
        Drag(law="constant", damping_nspm=8)
    assert Drag().model_dump() == {"law": "constant"}
