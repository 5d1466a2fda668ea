"""The lab draws flow curves and forces over speed where a setting is non-Newtonian."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from study_app.lab.ab_comparison import Setting, Workbench
from study_app.lab.presets import spoken
from study_app.lab.steady_curves import RATES_PER_S, steady_curves
from study_app.protocol.load import load_scene
from tests.gui.lab.sample import blind, settle, still_view

pytestmark = pytest.mark.slow


def bench(a: str, b: str) -> Workbench:
    scenes = {name: load_scene("slime", name) for name in (a, b)}
    return Workbench(*(Setting(spoken(name), scenes[name], scenes[name]) for name in (a, b)))


def test_the_row_is_hidden_between_newtonian_liquids(place: Any) -> None:
    place.show_view(still_view())
    assert not place.curves.isVisible()
    place.show_view(still_view(bench("water", "ketchup")))
    assert place.curves.isVisible()
    place.show_view(still_view(bench("water", "honey")))
    assert not place.curves.isVisible()


def test_both_settings_are_drawn_with_the_limit(place: Any) -> None:
    view = still_view(bench("ketchup", "honey"))
    place.show_view(view)
    settle()
    b, a = place.curves.stress.stresses.curves
    assert np.allclose(a.getData()[1], np.log10(15 + 10 * RATES_PER_S**0.25))
    assert np.allclose(b.getData()[1], np.log10(10 * RATES_PER_S))
    forces = place.curves.force.forces
    assert forces.limit.value() == 8.0
    assert forces.curves[0].getData()[1].max() == steady_curves(view.workbench.b.scene).force_n.max()
    assert "thixotropy" in place.curves.stress.plot.accessibleDescription()


def test_an_edit_moves_the_curve(place: Any) -> None:
    before = bench("ketchup", "honey")
    place.show_view(still_view(before))
    place.show_view(still_view(before.change("non_newtonian.yield_stress_pa", 60.0)))
    _, a = place.curves.stress.stresses.curves
    assert np.allclose(a.getData()[1], np.log10(60 + 10 * RATES_PER_S**0.25))


def test_the_limit_is_that_of_the_setting_in_hand(place: Any) -> None:
    other = bench("ketchup", "honey").switch().change("scene.force_limit_n", 4.0)
    limit = place.curves.force.forces.limit
    for shown, limit_n in ((other, 4.0), (other.switch(), 8.0)):
        place.show_view(still_view(shown))
        assert limit.value() == limit_n


def test_while_blind_the_curves_are_hidden_and_nothing_moves(place: Any) -> None:
    view = still_view(bench("ketchup", "honey"))
    place.show_view(view)
    settle()
    before = [place.curves.stress.size(), place.tank.size()]
    place.show_view(dataclasses.replace(view, workbench=blind(view.workbench)))
    settle()
    assert [place.curves.stress.size(), place.tank.size()] == before
    for card in (place.curves.stress, place.curves.force):
        assert not card.plot.isVisible()
