"""Flow curves and steady forces of the lab's settings."""

import numpy as np
import pytest

from study_app.haptics.model.laws import yield_n
from study_app.haptics.model.scene import Liquid, Scene
from study_app.haptics.model.slope_limits import steady
from study_app.lab.ab_comparison import RATES_PER_S, SPEEDS_MPS, has_flow_curve, steady_curves
from study_app.lab.parameters import changed
from study_app.protocol.load import load_scene
from tests.haptics.materials import PRESETS


@pytest.mark.slow
def test_ketchup_has_its_flow_curve_and_a_force_at_rest():
    ketchup = load_scene("slime", "ketchup")
    found = steady_curves(ketchup)
    assert found.stress_pa == pytest.approx(15 + 10 * RATES_PER_S**0.25)
    assert found.force_n[0] == pytest.approx(yield_n(PRESETS["ketchup"][1], 0.068))
    assert found.force_n[10] == steady(ketchup, float(SPEEDS_MPS[10])).force_n
    assert has_flow_curve(ketchup)


def test_newtonian_liquids_have_a_straight_flow_curve_and_those_without_viscosity_none():
    honey = load_scene("slime", "honey")
    assert not has_flow_curve(honey)
    assert steady_curves(honey).stress_pa == pytest.approx(10 * RATES_PER_S)
    plain = steady_curves(Scene(liquids=(Liquid(id="a", density_kg_m3=1000),)))
    assert plain.stress_pa is None
    assert plain.force_n[-1] > 0


def test_non_newtonian_drag_takes_the_place_of_a_viscosity():
    honey = load_scene("physical2", "honey")
    found = changed(honey, "effects.non_newtonian", "on")
    assert found.liquids[0].viscosity_pa_s is None
    assert has_flow_curve(found)
    thicker = changed(found, "non_newtonian.yield_stress_pa", 60.0)
    assert np.all(steady_curves(thicker).stress_pa - steady_curves(found).stress_pa == pytest.approx(45.0))
    carreau = changed(found, "non_newtonian.kind", "carreau")
    assert steady_curves(carreau).force_n[0] == 0.0
