"""The incremental passivity observer: the fast parts of force and motion, their work, and the resulting gain."""

import numpy as np
import pytest

from study_app.haptics.kernels.passivity import (
    CORNER_RADPS,
    HALVING_J,
    INCREMENTAL_ALLOWANCE_J,
    INCREMENTAL_FORGIVEN_W,
    begin_incremental,
    close_incremental,
    observe_incremental,
    reduce_gain,
    reset_observer,
)
from study_app.haptics.model.layout import PARAMETERS, PASSIVITY, STATE, records
from tests.haptics.scenes import HONEY, Hand


def balances(force_n, velocity_mps, period_s=1e-3):
    """Return the balance [J] after each sample of a motion along one axis."""
    fast = records(PASSIVITY, 1)[0].fast
    begin_incremental(fast)
    balances_j = []
    for one_n, one_mps in zip(force_n, velocity_mps, strict=True):
        observe_incremental(fast, 1, one_n, one_mps, period_s)
        close_incremental(fast, period_s)
        balances_j.append(fast.balance_j)
    return np.array(balances_j)


@pytest.mark.parametrize("frequency_hz", [30.0, 60.0])
@pytest.mark.parametrize("period_s", [0.5e-3, 1e-3])
def test_a_force_along_a_fast_motion_owes_the_filtered_power(frequency_hz, period_s):
    t_s = np.arange(0, 1, period_s)
    omega = 2 * np.pi * frequency_hz
    wave = np.sin(omega * t_s)
    balances_j = balances(2.0 * wave, 0.1 * wave, period_s)
    kept, tick = np.exp(-CORNER_RADPS * period_s), np.exp(-1j * omega * period_s)
    passed = np.abs(kept * (1 - tick) / (1 - kept * tick)) ** 4
    power_w = (balances_j[len(t_s) // 2] - balances_j[-1]) / 0.5
    assert power_w == pytest.approx(0.5 * 2.0 * 0.1 * passed - INCREMENTAL_FORGIVEN_W, rel=0.02)


def test_a_damper_owes_nothing_and_earns_no_credit():
    wave = np.sin(2 * np.pi * 40 * np.arange(1000) * 1e-3)
    balances_j = balances(np.where(np.arange(1000) < 500, -2.0, 2.0) * wave, 0.1 * wave)
    assert balances_j[:490].min() > -1e-4
    assert balances_j[-1] < -INCREMENTAL_ALLOWANCE_J


def test_a_swing_is_owed_for_although_the_motion_pays_more():
    """Over a 40 Hz oscillation on a motion of 2 Hz the whole force dissipates energy, but its fast part adds some."""
    t_s = np.arange(1000) * 1e-3
    slow, fast = 0.3 * np.sin(2 * np.pi * 2 * t_s), 0.05 * np.sin(2 * np.pi * 40 * t_s)
    force_n, velocity_mps = -20 * slow + 20 * fast, slow + fast
    assert -np.sum(force_n * velocity_mps) * 1e-3 > 0.5
    assert balances(force_n, velocity_mps)[-1] < -INCREMENTAL_ALLOWANCE_J
    assert balances(-20 * slow, slow).min() > -1e-4


def test_a_debt_beyond_the_allowance_lowers_the_gain():
    parameters, state = records(PARAMETERS, 1)[0], records(STATE, 1)[0]
    passivity = records(PASSIVITY, 1)[0]
    reset_observer(passivity)
    passivity.fast.balance_j = -INCREMENTAL_ALLOWANCE_J
    assert reduce_gain(parameters, state, passivity) == 1.0
    passivity.fast.balance_j = -INCREMENTAL_ALLOWANCE_J - HALVING_J
    assert reduce_gain(parameters, state, passivity) == pytest.approx(0.5)


def test_the_tick_observes_the_force_of_one_tick_more_than_the_loop_is_late():
    hand = Hand(HONEY)
    hand.safety[0].delay_ticks = 1
    places = 0.005 * np.cos(200 * np.arange(60) * 1e-3)
    sent = [hand.tick((place, 0.0, 0.0)).device_force_n[0] for place in places]
    assert hand.safety[0].passivity.fast.force_n[0] == pytest.approx(sent[-4])
    assert hand.safety[0].passivity.fast.velocity_mps[0] == pytest.approx((places[-1] - places[-2]) / 1e-3)
