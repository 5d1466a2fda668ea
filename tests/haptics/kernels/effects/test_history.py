import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.model.effects.drag import Drag
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, UNBENT, examples, liquid, moving, scene, vectors

HONEY = {"density_kg_m3": 1420, "viscosity_pa_s": 10}
GLYCERIN = {"density_kg_m3": 1261, "viscosity_pa_s": 1.41}
OLIVE_OIL = {"density_kg_m3": 913, "viscosity_pa_s": 0.084}
WATER = {"density_kg_m3": 998.2, "viscosity_pa_s": 1.0016e-3}
RADIUS_M = 0.034
CREEPING_MPS = 1e-10


def tank(effects=("history",), *, rate_hz=1000.0, history=None, **fluid):
    """Return a scene of one viscous liquid, laws of creeping flow, velocities as given."""
    medium = liquid(**fluid, effects=effects, drag=Drag(law="haider-levenspiel"), history=history or {})
    return scene(medium, knee=UNBENT, rate_hz=rate_hz)


def basset_force(fluid, t_s, speed_mps, ages_s):
    """Return −6 R² √(πρµ) ∫ dw/dτ (t − τ)^(−½) dτ for speeds (n,) interpolated linearly in time."""
    factor = 6 * RADIUS_M**2 * np.sqrt(np.pi * fluid["density_kg_m3"] * fluid["viscosity_pa_s"])
    slope = np.diff(speed_mps) / np.diff(t_s)
    since = np.sqrt(np.maximum(ages_s - t_s[:-1], 0)) - np.sqrt(np.maximum(ages_s - t_s[1:], 0))
    return -factor * np.sum(slope * 2 * since)


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason="tens of thousands of ticks are for compiled code")
@pytest.mark.parametrize(
    ("fluid", "hertz", "damping_nspm", "inertia_kg"),
    [
        (HONEY, 1, 11.011, 0.8494),
        (HONEY, 2, 12.918, 0.6348),
        (GLYCERIN, 1, 2.532, 0.3630),
        (OLIVE_OIL, 1, 0.392, 0.1290),
        (WATER, 1, 0.0393, 0.0883),
    ],
)
def test_creeping_oscillation_equals_landau_and_lifshitz(fluid, hertz, damping_nspm, inertia_kg):
    rate_hz = 5000.0  # a difference lags by half a tick: at 1 kHz that adds 4 % to what little damping water has
    omega, t_s = 2 * np.pi * hertz, np.arange(100_000) / rate_hz
    speed, acceleration = CREEPING_MPS * np.sin(omega * t_s), CREEPING_MPS * omega * np.cos(omega * t_s)
    motion = moving(np.outer(speed, [0.6, 0.0, 0.8]), 1 / rate_hz)
    table = simulate(tank(("drag", "added_mass", "history"), rate_hz=rate_hz, **fluid), motion)
    late = t_s >= 15
    along = (vectors(table, "force") @ [0.6, 0.0, 0.8])[late]
    (damping, inertia), *_ = np.linalg.lstsq(-np.column_stack([speed, acceleration])[late], along, rcond=None)
    assert damping == pytest.approx(damping_nspm, rel=0.01)
    assert inertia == pytest.approx(inertia_kg, rel=0.01)


@pytest.mark.slow
@settings(max_examples=examples(30), deadline=None)
@given(
    legs=st.lists(st.floats(-2, 2), min_size=1, max_size=8),
    pace=st.sampled_from([[1.0], [1.0, 0.7, 1.4, 0.9, 3.0], [5.0], [0.21]]),
)
def test_within_the_window_and_far_beyond_it_is_the_integral(legs, pace):
    ticks = 40 * len(legs) if COMPILED else 12 * len(legs)
    interval_s = 1e-3 * np.resize(pace, ticks)
    speed = np.repeat(np.cumsum(legs), ticks // len(legs))
    motion = moving(np.outer(speed, [0.0, 1.0, 0.0]), interval_s)
    force_n = simulate(tank(**HONEY, history={"window_s": 0.02}), motion).fy_n
    exact = [basset_force(HONEY, motion.t_s[: k + 1], speed[: k + 1], motion.t_s[k]) for k in range(1, ticks)]
    assert force_n[0] == 0.0
    # Ticks that come five times too fast outgrow the rows of the window: the exponentials count from a fifth of it.
    worst = 0.02 if pace == [0.21] else 0.002
    assert abs(force_n[1:] - exact).max() <= worst * max(abs(np.array(exact)).max(), 1e-12)
