"""The second plant: against an ordinary differential equation solver, energy, the first plant where both are free."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from study_app.haptics.kernels.plant import move, new_handle, push
from study_app.validation.stability.arm_plant import FIRM, MIDDLE, Arm, advance, new_arm, write_force

STILL = np.zeros(3)


def moved(arm, seconds, path=lambda t: np.zeros(3), tick_s=1e-3):
    """Move an arm along a path and return the handle's places, one per tick."""
    places = []
    for k in range(round(seconds / tick_s)):
        advance(arm, path(k * tick_s), path((k + 1) * tick_s), tick_s)
        places.append(arm.handle_m.copy())
    return np.array(places)


def total_j(arm):
    """Return the energy of both masses and both springs of an arm that means to stay at 0."""
    kinetic_j = arm.arm_kg * (arm.arm_mps**2).sum() + arm.handle_kg * (arm.handle_mps**2).sum()
    springs_j = arm.arm_npm * (arm.arm_m**2).sum() + arm.tissue_npm * ((arm.arm_m - arm.handle_m) ** 2).sum()
    return 0.5 * (kinetic_j + springs_j)


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


def test_arm_without_damping_conserves_energy():
    arm = new_arm(Arm(0.5, 200.0, 0.0, 3000.0, 0.0), handle_kg=0.03)
    arm.handle_m[:] = 0.01, -0.02, 0.0
    before_j = total_j(arm)
    moved(arm, 5.0)
    assert total_j(arm) == pytest.approx(before_j, rel=1e-6)


def test_arm_is_stable_however_stiff():
    arm = new_arm(Arm(0.01, 1e6, 1.0, 1e7, 1.0), handle_kg=0.001, coulomb_n=5.0)
    arm.handle_m[:] = 0.01
    before_j = total_j(arm)
    for _ in range(200):
        advance(arm, STILL, STILL, 0.004)
        assert total_j(arm) <= before_j * (1 + 1e-9)


def test_handle_let_go_is_that_of_the_first_plant():
    arm = new_arm(MIDDLE, handle_kg=0.1, viscous_nspm=0.5)
    handle = new_handle(mass_kg=0.1, viscous_nspm=0.5)
    arm.held = handle.held = 0
    arm.handle_mps[:] = handle.velocity_mps[:] = 0.3, 0.0, -0.2
    force_n = np.array([1.0, -0.5, 0.0])
    write_force(arm, force_n)
    push(handle, *force_n)
    for _ in range(300):
        advance(arm, STILL, STILL, 1e-3)
        move(handle, STILL, STILL, 1e-3)
    assert arm.handle_m == pytest.approx(handle.position_m, rel=1e-3)
    assert arm.handle_mps == pytest.approx(handle.velocity_mps, rel=1e-3)


def test_force_is_limited_rounded_and_late_by_the_delay():
    arm = new_arm(MIDDLE, handle_kg=0.1, motor_limit_n=8.0, motor_step_n=0.5, delay=2)
    acting = []
    for k in range(1, 6):
        write_force(arm, np.array([1.1 * k, -20.0, 0.0]))
        acting.append(arm.force_n.copy())
    assert np.array(acting)[:, 0].tolist() == [0.0, 0.0, 1.0, 2.0, 3.5]
    assert np.array(acting)[:, 1].tolist() == [0.0, 0.0, -8.0, -8.0, -8.0]
    arm.delay = 4
    write_force(arm, np.zeros(3))
    assert arm.force_n[0] == 2.0  # what was sent four writes before, again


def test_coulomb_friction_brings_the_handle_to_rest():
    arm = new_arm(MIDDLE, handle_kg=0.1, coulomb_n=0.3)
    arm.held = 0
    arm.handle_mps[0] = 0.3
    places = moved(arm, 0.3)
    assert places[-1, 0] == pytest.approx(0.5 * 0.1 * 0.3**2 / 0.3, rel=0.02)
    assert abs(arm.handle_mps[0]) < 1e-4
