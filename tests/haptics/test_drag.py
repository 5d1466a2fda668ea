import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.offline import simulate
from study_app.haptics.scene import Body, Given
from tests.haptics.scenes import UNBENT, WATER_FACTOR, examples, liquid, moving, scene, vectors

speeds = st.floats(-20, 20)


def test_water_at_one_metre_a_second_resists_with_the_drag_equation():
    table = simulate(scene(), moving([(1.0, 0.0, 0.0)]))
    assert table.fx_n[0] == pytest.approx(-0.5 * 1000 * 0.47 * 3.6317e-3, rel=1e-4)
    assert (table.fy_n[0], table.fz_n[0]) == (0.0, 0.0)


@settings(max_examples=examples(100))
@given(vx=speeds, vy=speeds, vz=speeds, density=st.floats(1, 20_000), diameter=st.floats(0.001, 1), cd=st.floats(0, 10))
def test_drag_is_half_rho_cd_a_v_squared_against_the_motion(vx, vy, vz, density, diameter, cd):
    body = Body(diameter_m=diameter, drag_coefficient=cd)
    table = simulate(scene(liquid(density), body=body, knee=UNBENT), moving([(vx, vy, vz)]))
    v = np.array([vx, vy, vz])
    expected = -0.5 * density * cd * (np.pi * diameter**2 / 4) * np.linalg.norm(v) * v
    assert vectors(table, "force")[0] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_no_motion_is_no_force():
    table = simulate(scene(), moving(np.zeros((5, 3))))
    assert not vectors(table, "force").any()


@settings(max_examples=examples(50))
@given(angle=st.floats(0, 2 * np.pi), vx=speeds, vy=speeds, vz=speeds)
def test_turning_the_motion_about_the_vertical_turns_the_force(angle, vx, vy, vz):
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    v = np.array([vx, vy, vz])
    straight, turned = (vectors(simulate(scene(), moving([u])), "force")[0] for u in (v, turn @ v))
    assert turned == pytest.approx(turn @ straight, abs=1e-12 * max(np.linalg.norm(straight), 1))


def test_two_liquids_in_one_place_do_not_add_up():
    both = scene(liquid(1000, id="a"), liquid(500, id="b"), velocity=Given())
    assert simulate(both, moving([(1.0, 0.0, 0.0)])).fx_n[0] == pytest.approx(-WATER_FACTOR / 2)
