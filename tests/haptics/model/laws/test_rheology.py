"""Flow curves and the steady force on a sphere: closed forms, limits of the parameters, and bad input."""

import numpy as np
import pytest
from pydantic import ValidationError

from study_app.errors import StudyError
from study_app.haptics.model import laws
from study_app.haptics.model.effects.non_newtonian import steady_n
from study_app.haptics.model.estimators import Kalman
from study_app.haptics.model.laws import Carreau, HerschelBulkley, Maxwell, ShearThickening
from study_app.haptics.model.overrides import override_value
from study_app.haptics.model.scene import Liquid, Scene
from study_app.haptics.model.slope_limits import steady_force
from tests.haptics.materials import PRESETS, tank

D = 0.068
SPEEDS = (0.003, 0.05, 0.6)


def force_n(table, speed_mps):
    return sum(laws.creeping_n(table, D, speed_mps))


def stokes_n(viscosity_pa_s, speed_mps):
    return 3 * np.pi * viscosity_pa_s * D * speed_mps


@pytest.mark.parametrize("speed_mps", SPEEDS)
def test_a_bingham_liquid_has_its_three_terms(speed_mps):
    stress_pa = 2.0 * speed_mps / D
    expected_n = 3 * np.pi * D**2 * (stress_pa + 1.7 * np.sqrt(stress_pa * 15) + 1.157 * 15)
    assert force_n(HerschelBulkley(consistency_pa_sn=2.0, yield_stress_pa=15), speed_mps) == pytest.approx(expected_n)


@pytest.mark.parametrize("index", [0.3, 0.5, 0.8, 1.0])
def test_a_power_law_grows_by_its_index(index):
    table = HerschelBulkley(consistency_pa_sn=5.0, flow_index=index)
    assert force_n(table, 0.4) / force_n(table, 0.1) == pytest.approx(4**index)


def test_the_shape_factor_equals_gu_and_tanner_and_is_continuous():
    assert [laws.shape_factor(n) for n in (1.0, 0.9, 0.5, 0.3)] == pytest.approx([1.0, 1.14, 1.42, 1.458])
    fine = [laws.shape_factor(n) for n in np.linspace(0.1, 1, 901)]
    assert abs(np.diff(fine)).max() <= 1.5e-3


def test_carreau_is_newtonian_for_short_times_and_a_power_law_for_long_ones():
    short, long = (Carreau(zero_shear_viscosity_pa_s=6, time_constant_s=it, flow_index=0.3) for it in (1e-4, 1000.0))
    assert force_n(short, 0.1) == pytest.approx(stokes_n(6, 0.1), rel=1e-6)
    assert force_n(long, 0.4) / force_n(long, 0.1) == pytest.approx(4**0.3, rel=1e-6)
    even = Carreau(zero_shear_viscosity_pa_s=6, time_constant_s=0.15, flow_index=1.0)
    assert force_n(even, 0.4) == pytest.approx(stokes_n(6, 0.4))


def test_shear_thickening_is_newtonian_below_and_above_and_never_steeper_than_asked():
    table = ShearThickening(zero_shear_viscosity_pa_s=1, thickened_viscosity_pa_s=20, onset_shear_rate_per_s=5)
    onset_mps = 5 * D / 2
    assert force_n(table, 0.9 * onset_mps) == pytest.approx(stokes_n(1, 0.9 * onset_mps))
    assert force_n(table, 2 * onset_mps) == pytest.approx(stokes_n(20, 2 * onset_mps))
    speeds = np.linspace(0, 1, 5001)
    for steepest in (5.0, 17.7, 100.0):
        forces = np.array([sum(laws.creeping_n(table, D, v, steepest)) for v in speeds])
        assert (np.diff(forces) / np.diff(speeds)).max() <= max(steepest, 0) * (1 + 1e-9) or steepest > 39
        assert (forces <= [force_n(table, v) + 1e-12 for v in speeds]).all()


def test_flow_curves_equal_the_rheometer_curves():
    hb = HerschelBulkley(yield_stress_pa=15, consistency_pa_sn=10, flow_index=0.25)
    assert laws.stress_pa(hb, 0.0) == 15
    assert laws.stress_pa(hb, 16.0) == pytest.approx(35)
    carreau = Carreau(zero_shear_viscosity_pa_s=6, time_constant_s=0.15, flow_index=0.3)
    assert laws.stress_pa(carreau, 20.0) == pytest.approx(6 * 20 * (1 + 9) ** -0.35)
    assert laws.stress_pa(Maxwell(zero_shear_viscosity_pa_s=30, relaxation_time_s=0.3), 2.0) == 60
    thick = ShearThickening(zero_shear_viscosity_pa_s=1, thickened_viscosity_pa_s=20, onset_shear_rate_per_s=5)
    assert [laws.stress_pa(thick, it) for it in (5.0, 7.5, 10.0, 20.0)] == pytest.approx([5, 102.5, 200, 400])


def test_the_force_grows_with_inertia_and_is_zero_at_rest():
    liquid = tank("shampoo").liquids[0]
    slow, fast = (sum(steady_n(tank("shampoo"), liquid, v)) / force_n(liquid.non_newtonian, v) for v in (1e-7, 0.6))
    assert slow == pytest.approx(1, abs=1e-6)
    assert fast == pytest.approx(
        laws.finite_reynolds(1030 * 0.6 * D / (force_n(liquid.non_newtonian, 0.6) / stokes_n(1, 0.6)))
    )


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"flow_index": 0}, "flow_index must be greater than or equal to 0.1"),
        ({"flow_index": 1.2}, "flow_index must be less than or equal to 1"),
        ({"yield_stress_pa": -1}, "yield_stress_pa must be greater than or equal to 0"),
        ({"consistency_pa_sn": 0}, "consistency_pa_sn must be greater than or equal to 0.0001"),
        ({"kind": "maxwell", "zero_shear_viscosity_pa_s": 1, "relaxation_time_s": 0}, "relaxation_time_s must be"),
        ({"kind": "carreau", "flow_index": 0.5}, "zero_shear_viscosity_pa_s: Field required"),
    ],
)
def test_a_bad_value_is_one_line(values, said):
    table = {"kind": "herschel-bulkley", "consistency_pa_sn": 1.0} if "kind" not in values else {}
    with pytest.raises(StudyError, match=said) as caught:
        override_value(tank("ketchup"), "non_newtonian", {**table, **values})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("effects", ["auto", ("non_newtonian",)])
def test_a_liquid_has_a_viscosity_or_a_flow_curve(effects):
    with pytest.raises(ValidationError, match="remove one of them"):
        Liquid(id="a", density_kg_m3=1000, viscosity_pa_s=1, effects=effects, non_newtonian=PRESETS["ketchup"][1])


@pytest.mark.parametrize("velocity", [Scene().velocity, Kalman()])
@pytest.mark.parametrize("name", PRESETS)
def test_the_steady_force_keeps_the_limits(name, velocity):
    tank_scene = tank(name, scale=3.0).model_copy(update={"velocity": velocity})
    for hand_mps in (0.001, 0.05, 0.3, 1.0):
        steady = steady_force(tank_scene, hand_mps)
        held_n = laws.yield_n(tank_scene.liquids[0].non_newtonian, D)
        assert steady.force_n <= min(held_n + 53 * hand_mps, 8.0) + 1e-9
        assert steady.drag_n == pytest.approx(sum(steady_n(tank_scene, tank_scene.liquids[0], 3 * hand_mps)))
        assert (steady.limit is None) == (steady.force_n == steady.drag_n)
