import numpy as np
import pytest

from study_app.haptics.kernels.sample_validation import clamp
from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_GLITCH, LIMITER_STALE, STATUS_OK, STATUS_STALE_FAULT
from study_app.haptics.model.scene import Ewma
from tests.haptics.scenes import HONEY, TICK_NS, UNBENT, WATER, Hand, scene

RAW = scene(velocity=Ewma(alpha=1.0), knee=UNBENT, scale=1)


@pytest.mark.parametrize(("elapsed", "taken"), [(-1.0, 0.2e-3), (0.0, 0.2e-3), (1e-3, 1e-3), (0.5, 20e-3)])
def test_the_time_between_samples_is_clamped(elapsed, taken):
    assert clamp(elapsed) == taken


def test_the_first_sample_is_taken_wherever_it_is():
    sample = Hand(HONEY).tick((0.4, -0.2, 0.1))
    assert sample.limiters & LIMITER_GLITCH == 0
    assert not sample.velocity_mps.any()


def test_the_hand_is_mapped_into_the_scene_by_scale_and_origin():
    hand = Hand(scene(scale=3, origin_m=(1, 2, 3)))
    hand.tick((0.1, 0.2, 0.3))
    assert hand.model.state[0].position_m == pytest.approx([1.3, 2.6, 3.9])


def test_without_a_new_sample_the_model_rests_and_the_next_one_covers_the_gap():
    hand = Hand(RAW)
    hand.tick((0.0, 0.0, 0.0))
    felt = hand.tick((0.001, 0.0, 0.0))
    assert felt.velocity_mps[0] == pytest.approx(1.0)
    model = [field.copy() for field in hand.model.arrays]
    still = hand.tick(None)
    assert all((now == before).all() for now, before in zip(hand.model.arrays, model, strict=True))
    assert still.velocity_mps[0] == felt.velocity_mps[0]
    assert (still.force_n == felt.force_n).all()
    hand.tick(None)
    assert hand.tick((0.004, 0.0, 0.0)).velocity_mps[0] == pytest.approx(1.0)


def test_whether_a_sample_is_new_is_the_devices_word_not_the_positions():
    hand = Hand(RAW)
    hand.tick((0.0, 0.0, 0.0))
    hand.tick((0.001, 0.0, 0.0))
    assert hand.tick((0.001, 0.0, 0.0)).velocity_mps[0] == 0.0


@pytest.mark.parametrize("bad", [(np.nan, 0, 0), (0, np.inf, 0), (0, 0, -np.inf), (0.5, 0, 0), (1.7e308, 0, 0)])
def test_an_impossible_position_is_not_used_and_counted(bad):
    hand = Hand(WATER)
    hand.sweep(0.1, 50)
    with np.errstate(all="ignore"):
        refused = hand.tick(bad)
    assert refused.limiters & LIMITER_GLITCH
    assert refused.velocity_mps[0] == pytest.approx(1.0, rel=0.02)
    after = hand.tick((0.0052, 0, 0))
    assert after.limiters & LIMITER_GLITCH == 0
    assert after.velocity_mps[0] == pytest.approx(1.0, rel=0.02)


def test_a_refused_position_that_the_device_repeats_is_refused_again():
    hand = Hand(WATER)
    hand.sweep(0.1, 50)
    assert hand.tick((1.0, 1.0, 1.0)).limiters & LIMITER_GLITCH
    assert hand.tick(None).limiters & LIMITER_GLITCH
    assert hand.tick((0.0053, 0, 0)).limiters & LIMITER_GLITCH == 0
    assert hand.tick(None).limiters & LIMITER_GLITCH == 0


def test_ten_metres_a_second_of_hand_is_the_border_whatever_the_scale():
    for scale in (0.5, 10.0):
        hand = Hand(scene(scale=scale))
        hand.tick((0.0, 0.0, 0.0))
        assert hand.tick((0.00999, 0, 0)).limiters & LIMITER_GLITCH == 0
        assert hand.tick((0.02001, 0, 0)).limiters & LIMITER_GLITCH
        assert hand.tick((0.02001, 0, 0)).limiters & LIMITER_GLITCH == 0  # 2 ms have passed by then


def test_after_five_refusals_in_a_row_the_motion_begins_anew():
    hand = Hand(WATER)
    before = hand.sweep(0.1, 200)[-1]
    assert before.wake_mps[0] > 0
    refused = [hand.tick((0.5 + 0.1 * k, 0, 0)) for k in range(5)]
    assert all(sample.limiters & LIMITER_GLITCH for sample in refused)
    assert [bool(sample.limiters & LIMITER_FADE) for sample in refused] == [False] * 4 + [True]
    again = hand.tick((-0.3, 0, 0))
    assert again.limiters & LIMITER_GLITCH == 0
    assert not again.velocity_mps.any()
    assert not again.wake_mps.any()
    assert not again.force_n.any()
    assert hand.tick((-0.3001, 0, 0)).velocity_mps[0] == pytest.approx(-0.1)


def test_four_refusals_do_not_lose_the_body():
    hand = Hand(WATER)
    hand.sweep(0.1, 200)
    for _ in range(4):
        hand.tick((np.nan, 0, 0))
    sample = hand.tick((0.0205, 0, 0))
    assert sample.velocity_mps[0] == pytest.approx(1.0, rel=0.02)
    assert sample.wake_mps[0] > 0


def test_the_force_of_a_lost_body_fades_out_and_comes_back():
    hand = Hand(HONEY)
    steady = abs(hand.sweep(0.2, 300)[-1].device_force_n[0])
    lost = [hand.tick((np.nan, 0, 0)) for _ in range(40)]
    sizes = [np.linalg.norm(sample.device_force_n) for sample in lost]
    assert sizes[3] == pytest.approx(steady)
    assert (np.diff(sizes[4:]) < 0).all()
    assert sizes[-1] < 0.25 * steady
    hand.tick((0.1, 0, 0))
    back = hand.sweep(0.2, 300, start_m=0.1)[-1]
    assert abs(back.device_force_n[0]) == pytest.approx(steady, rel=1e-6)


def test_a_silent_device_lets_the_force_fade_after_5_ms_and_stops_it_after_50():
    hand = Hand(HONEY)
    steady = hand.sweep(0.2, 300)[-1]
    silent = [hand.tick(None) for _ in range(60)]
    sizes = np.array([np.linalg.norm(sample.device_force_n) for sample in silent])
    assert sizes[:5] == pytest.approx(np.linalg.norm(steady.device_force_n))
    assert not any(sample.limiters & LIMITER_STALE for sample in silent[:5])
    assert all(sample.limiters & LIMITER_STALE for sample in silent[5:])
    assert (np.diff(sizes[4:49]) < 0).all()
    assert not sizes[49:].any()
    assert [sample.status for sample in silent[:49]] == [STATUS_OK] * 49
    assert [sample.status for sample in silent[49:]] == [STATUS_STALE_FAULT] * 11


def test_a_fault_stays_until_the_host_clears_it():
    hand = Hand(HONEY)
    hand.sweep(0.2, 100)
    hand.tick(None, after_ns=60 * TICK_NS)
    assert hand.sweep(0.2, 100, start_m=0.03)[-1].status == STATUS_STALE_FAULT
    hand.safety[0].fault = STATUS_OK
    moved = hand.sweep(0.2, 600, start_m=0.05)
    assert moved[0].status == STATUS_OK
    assert np.linalg.norm(moved[99].device_force_n) < 0.25 * np.linalg.norm(moved[99].force_n)
    assert (moved[-1].device_force_n == moved[-1].force_n).all()


def test_samples_that_cannot_be_used_are_silence_too():
    hand = Hand(HONEY)
    hand.sweep(0.2, 100)
    assert [hand.tick((np.nan, 0, 0)).status for _ in range(50)] == [STATUS_OK] * 49 + [STATUS_STALE_FAULT]


def test_a_pause_before_the_first_sample_is_silence_from_the_first_tick_on():
    hand = Hand(HONEY)
    assert hand.tick(None, after_ns=10**12).status == STATUS_OK
    assert hand.tick(None, after_ns=50 * TICK_NS).status == STATUS_STALE_FAULT
