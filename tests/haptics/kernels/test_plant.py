"""The handle against closed forms."""

import math

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

if numba.config.DISABLE_JIT:
    pytest.skip("too many sub-steps for plain Python", allow_module_level=True)

from study_app.haptics.kernels.plant import move, new_handle, new_schedule, next_tick, push

STILL = np.zeros(3)


def along_x(value):
    return np.array([value, 0.0, 0.0])


def trace(handle, seconds, *, hand=STILL, force=None, tick_s=1e-3):
    """Return (t, x, v) after every tick; ``force`` gives the force on x from the handle, held over the tick."""
    rows = []
    for k in range(round(seconds / tick_s)):
        if force is not None:
            handle.force_n[0] = force(handle)
        move(handle, hand, hand, tick_s)
        rows.append(((k + 1) * tick_s, handle.position_m[0], handle.velocity_mps[0]))
    return np.array(rows).T


@pytest.mark.parametrize("damping_ratio", [0.2, 1.0, 1.5])
def test_the_step_response_equals_that_of_mass_spring_and_damper(damping_ratio):
    mass, stiffness, step = 0.2, 400.0, 0.01
    own = math.sqrt(stiffness / mass)
    handle = new_handle(
        mass_kg=mass, stiffness_npm=stiffness, damping_nspm=2 * damping_ratio * math.sqrt(stiffness * mass)
    )
    t, x, _ = trace(handle, 0.5, hand=along_x(step))
    root = np.sqrt(complex(1 - damping_ratio**2))
    if damping_ratio == 1.0:
        rest = np.exp(-own * t) * (1 + own * t)
    else:
        wave = np.cos(root * own * t) + damping_ratio / root * np.sin(root * own * t)
        rest = (np.exp(-damping_ratio * own * t) * wave).real
    assert x == pytest.approx(step * (1 - rest), abs=3e-3 * step)


@pytest.mark.slow
@settings(deadline=None)  # the first example compiles
@given(
    st.floats(0.01, 1.0),
    st.floats(0, 1e7),
    st.floats(0, 1e6),
    st.floats(0, 100),
    st.lists(st.floats(-0.1, 0.1), min_size=3, max_size=3),
)
def test_no_stiffness_damping_or_friction_makes_energy(mass, stiffness, damping, coulomb, start):
    handle = new_handle(mass_kg=mass, stiffness_npm=stiffness, damping_nspm=damping, coulomb_n=coulomb)
    handle.position_m[:] = start
    handle.velocity_mps[:] = start[::-1]

    def energy():
        return 0.5 * (mass * (handle.velocity_mps**2).sum() + stiffness * (handle.position_m**2).sum())

    before = energy()
    for _ in range(20):
        move(handle, STILL, STILL, 1e-3)
        after = energy()
        assert after <= before * (1 + 1e-12) + np.finfo(float).tiny  # below it, numbers lose their digits
        before = after


def test_motors_saturate_each_on_its_own_and_give_whole_steps():
    handle = new_handle(mass_kg=0.2, motor_limit_n=8.0, motor_step_n=0.25)
    push(handle, 9.0, -100.0, 0.37)
    assert handle.force_n.tolist() == [8.0, -8.0, 0.25]
    push(handle, 0.38, -0.38, 0.124)
    assert handle.force_n.tolist() == [0.5, -0.5, 0.0]


def test_a_share_of_ticks_is_missed_and_the_others_are_late_by_the_jitter_at_most():
    pace = new_schedule(1e-3, jitter_s=2e-4, missed=0.2)
    steps_s = np.array([next_tick(pace) for _ in range(4000)])
    assert steps_s.mean() == pytest.approx(1e-3 / (1 - 0.2), rel=0.03)
    assert abs(steps_s / 1e-3 - np.rint(steps_s / 1e-3)).max() == pytest.approx(0.2, rel=0.05)
