"""The loop of handle, estimator and damper against the published bounds, with the product's own handle and estimator.

Numbers: passivity of a filtered damper, b > B sup Re{-α e^(-jdθ) / (e^(jθ) - 1 + α)}; stability of a free handle by the
eigenvalues of mass, held force, filter and delay; the explicit map of quadratic drag.
"""

import numpy as np
import pytest

from study_app.haptics.kernels.plant import move, new_handle
from study_app.haptics.model.estimators import Ewma
from study_app.haptics.model.motion import Motion
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, UNBENT, scene

pytestmark = pytest.mark.skipif(not COMPILED, reason="too many sub-steps for plain Python")
STILL = np.zeros(3)


def coast(handle, k_spm, speed_mps, ticks):
    """Return the speeds (ticks + 1,) of a free handle under -c v|v|, measured and held a tick: k = T c/m [s/m]."""
    handle.held = 0
    handle.velocity_mps[0] = speed_mps
    speeds = [speed_mps]
    for _ in range(ticks):
        v = handle.velocity_mps[0]
        handle.force_n[0] = -k_spm * handle.mass_kg / 1e-3 * v * abs(v)
        move(handle, STILL, STILL, 1e-3)
        speeds.append(handle.velocity_mps[0])
    return np.array(speeds)


@pytest.mark.slow
def test_quadratic_drag_that_is_held_for_a_tick_diverges_from_k_v_2_on():
    k_spm = 1e-3 * 0.85 / 0.1  # water on 0.1 kg: 235 m/s
    calm, wild = (coast(new_handle(mass_kg=0.1), k_spm, kv / k_spm, 9) for kv in (1.99, 2.01))
    assert (np.diff(abs(calm)) < 0).all()
    assert (np.diff(abs(wild)) > 0).all()
    assert abs(wild[9] / wild[0]) == pytest.approx(9.1e10, rel=0.01)
    assert abs(coast(new_handle(mass_kg=0.1), k_spm, 1.99 / k_spm, 3000)[-1]) * k_spm < 0.05


def impulse_response(alpha, ticks=2000):
    """Return the velocities (ticks,) [m/s] that the product's estimator makes of 1 m for one sample."""
    x = np.zeros(ticks + 1)
    x[1] = 1.0
    motion = Motion(np.arange(ticks + 1) / 1000, np.column_stack([x, 0 * x, 0 * x]))
    return simulate(scene(velocity=Ewma(alpha=alpha), knee=UNBENT), motion).vx_mps[1:]


def passivity_multiplier(alpha, delay):
    """Return the friction that a filtered, delayed damper needs per damping, and the frequency [Hz] that needs it."""
    theta = np.linspace(1e-3, np.pi, 20_001)
    z = np.exp(-1j * theta)
    response = np.polynomial.polynomial.polyval(z, impulse_response(alpha)) * z**delay  # [1/s]
    needed = 0.5e-3 / (1 - np.cos(theta)) * ((1 - z) * response).real
    worst = int(np.argmax(needed))
    return needed[worst], theta[worst] / (2 * np.pi) * 1000


@pytest.mark.slow
@pytest.mark.parametrize(
    ("alpha", "delay", "multiplier"),
    [
        *[(0.1, d, m) for d, m in [(0, 0.05263), (1, 0.120), (2, 0.181), (4, 0.284), (8, 0.438)]],
        *[(0.2, d, m) for d, m in [(0, 0.111), (1, 0.225), (2, 0.324), (4, 0.473), (8, 0.659)]],
        *[(1.0, d, 1.0) for d in (0, 1, 2, 4)],
    ],
)
def test_the_friction_that_makes_a_filtered_damper_passive(alpha, delay, multiplier):
    assert passivity_multiplier(alpha, delay)[0] == pytest.approx(multiplier, abs=6e-4)


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [1.0, 0.5, 0.2, 0.1, 0.05])
def test_without_delay_it_is_alpha_over_2_minus_alpha(alpha):
    assert passivity_multiplier(alpha, 0)[0] == pytest.approx(alpha / (2 - alpha), rel=1e-6)


@pytest.mark.slow
def test_the_more_delay_the_lower_the_frequency_that_is_least_passive():
    worst_hz = [passivity_multiplier(0.1, delay)[1] for delay in (0, 1, 2, 4, 8)]
    assert worst_hz == pytest.approx([500, 112, 76, 50, 32], abs=1.0)
