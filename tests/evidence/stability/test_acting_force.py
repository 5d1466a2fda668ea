"""The force that acts on the hand: its error, the least error on the same motion, and the shares of the law's parts."""

import numpy as np
import pytest

from study_app.evidence.reference_solutions import without_buoyancy
from study_app.evidence.stability import acting_force
from study_app.evidence.stability.acting_force import Acting, Loop, Shares
from study_app.evidence.stability.bench import law_along, new_trace
from study_app.evidence.stability.stability_cases import Case, scenes
from study_app.evidence.stability.velocity import noise_m, wiener_bound
from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.model.scene import Knee, Liquid, Scene
from tests.haptics.scenes import COMPILED

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")

DAMPER = Scene(
    scale=1,
    knee=Knee(law="none"),
    liquids=(Liquid(id="damper", density_kg_m3=1000, drag=Drag(law="linear", damping_nspm=10)),),
)


@compiled
@pytest.mark.parametrize("delay", [1, 4])
def test_the_least_error_is_that_of_a_wiener_filter(delay):
    """Of a damper on noise of a known spectrum, whose least error follows from the spectrum."""
    count_m = 38e-6
    x_m = noise_m(1.6, seed=3)
    force_n = -10 * np.gradient(x_m, 1e-3)
    seen_m, mean_n = np.zeros((len(x_m), 3)), np.zeros((len(x_m) - 1, 3))
    seen_m[:, 0] = np.round(x_m / count_m) * count_m
    mean_n[:, 0] = 0.5 * (force_n[1:] + force_n[:-1])
    least = acting_force.least_error(seen_m, mean_n, delay)
    assert least == pytest.approx(100 * wiener_bound(DAMPER, count_m, (delay + 0.5) * 1e-3), rel=0.1)


def test_an_estimator_cannot_use_the_future():
    """White noise cannot be predicted from itself; with no delay the newest step is known."""
    seen_m = np.random.default_rng(1).normal(size=(6000, 3))
    steps = np.diff(seen_m, axis=0, prepend=0)
    assert acting_force.least_error(seen_m, steps, 0) < 1e-6
    assert acting_force.least_error(seen_m, steps, 1) > 65  # half the variance of a step is that of its first place


def loop(**changed):
    usual = {"liquid": "honey", "hand": "middle", "mass_kg": 0.2, "frequency_hz": 1.6, "delay": 1}
    return Loop(**{**usual, **changed})


@pytest.mark.parametrize(
    ("changed", "most"),
    [
        ({}, 15),
        ({"liquid": "water"}, 20),
        ({"liquid": "glycerin", "hand": "firm"}, 19.5),
        ({"mass_kg": 0.1}, 30),
        ({"hand": "light", "mass_kg": 0.5}, 30),
        ({"mass_kg": 0.5}, 22.5),
        ({"frequency_hz": 3.0}, 35),
        ({"frequency_hz": 3.0, "hand": "light", "liquid": "gear_oil"}, 30),
    ],
)
def test_limits_depend_on_liquid_hand_and_handle(changed, most):
    assert loop(**changed).most_error == most


@pytest.mark.parametrize(
    ("changed", "values", "said"),
    [
        ({}, {}, ()),
        ({}, {"sine": 15.1}, ("error 15.1 %, at most 15",)),
        ({}, {"noise": 21.0}, ("error on noise 2.1 of the bound, at most 2",)),
        ({"delay": 2}, {"noise": 21.0}, ()),
        ({}, {"shares": Shares(drag=200, inertial=84, history=0)}, ("inertial force 84 %, 85 to 115",)),
        ({"frequency_hz": 3.0}, {"shares": Shares(drag=69, inertial=0, history=0)}, ("drag 69 %, 70 to 130",)),
        ({"hand": "firm"}, {"noise": 90, "shares": Shares(drag=0, inertial=0, history=0)}, ()),
    ],
)
def test_what_misses_a_limit_is_said(changed, values, said):
    usual = {"sine": 14.9, "noise": 19.0, "bound": 10.0, "shares": Shares(drag=100, inertial=100, history=100)}
    row = Acting(loop=loop(**changed), **{**usual, **values})
    assert row.misses == said
    shown = acting_force.evidence((row,))
    assert shown.missed == bool(said)
    assert all(it in shown.text for it in said)


@compiled
def test_shares_are_those_that_act():
    """A force of 60 % of the drag and 130 % of the added mass of water, ½ρV of which is 82 g, in quick strokes."""
    t_s = np.arange(3000) * 1e-3
    trace = new_trace(Case(), 2.9)
    trace.t_s = t_s
    trace.position_m[:, 0], trace.velocity_mps[:, 0] = 0.01 * np.sin(20 * t_s), 0.2 * np.cos(20 * t_s)
    scene = without_buoyancy(scenes()["physical2_water"])
    inertia_n = np.zeros((3000, 3))
    inertia_n[:, 0] = 0.5 * 1000 * 4 / 3 * np.pi * 0.034**3 * 3 * 4 * np.sin(20 * t_s)
    acting_n = 0.6 * (law_along(scene, trace) - inertia_n) + 1.3 * inertia_n
    trace.acting_n[:-1] = 0.5 * (acting_n[1:] + acting_n[:-1])
    shares = acting_force.part_shares(scene, trace, acting_force.mean_law(scene, trace))
    assert shares[:2] == pytest.approx((60, 130), rel=0.03)
    assert np.isnan(shares.history)


@compiled
@pytest.mark.slow
def test_honey_acts_at_three_ticks():
    assert not acting_force.measure_loop("honey", "middle", 0.2, 1.6, 3).misses
