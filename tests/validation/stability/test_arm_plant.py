"""The second plant: against an ordinary differential equation solver, energy, the first plant where both are free."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from study_app.validation.stability.arm_plant import FIRM, MIDDLE, advance, new_arm, write_force


def moved(arm, seconds, path=lambda t: np.zeros(3), tick_s=1e-3):
    """Move an arm along a path and return the handle's places, one per tick."""
    places = []
    for k in range(round(seconds / tick_s)):
        advance(arm, path(k * tick_s), path((k + 1) * tick_s), tick_s)
        places.append(arm.handle_m.copy())
    return np.array(places)


@pytest.mark.slow
@pytest.mark.parametrize("hold", [MIDDLE, FIRM])
def test_arm_follows_the_solution_of_its_equations(hold):
    def path(t):
        return np.array([0.03 * math.sin(12 * t), 0.01 * math.cos(20 * t), 0.0])

    def rates(t, state):
        arm_m, arm_mps, handle_m, handle_mps = state.reshape(4, 3)
        intended_mps = (path(t + 1e-6) - path(t - 1e-6)) / 2e-6
        tissue_n = hold.tissue_npm * (arm_m - handle_m) + hold.tissue_nspm * (arm_mps - handle_mps)
        muscle_n = hold.stiffness_npm * (path(t) - arm_m) + hold.damping_nspm * (intended_mps - arm_mps)
        friction_n = 0.5 * handle_mps + 0.3 * handle_mps / math.sqrt((handle_mps**2).sum() + 1e-6)
        return np.concatenate(
            [arm_mps, (muscle_n - tissue_n) / hold.mass_kg, handle_mps, (force_n + tissue_n - friction_n) / 0.05]
        )

    force_n = np.array([2.0, 0.0, -1.0])
    arm = new_arm(hold, handle_kg=0.05, viscous_nspm=0.5, coulomb_n=0.3)
    write_force(arm, force_n)
    places = moved(arm, 0.4, path)
    exact = solve_ivp(rates, (0, 0.4), np.zeros(12), rtol=1e-9, atol=1e-12, t_eval=np.arange(1, 401) * 1e-3)
    assert np.abs(places - exact.y[6:9].T).max() < 5e-6
    assert np.abs(places).max() > 0.02
