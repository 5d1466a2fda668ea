import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from study_app.haptics.kernels.safety import begin_scene
from study_app.haptics.model import laws
from study_app.haptics.model import motion as paths
from study_app.haptics.model.force_rules import CURRENT, VERSIONS
from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_GLITCH
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Body, ForceLink
from study_app.haptics.runtime.offline import simulate
from tests.haptics.scenes import COMPILED, HONEY, THESIS, WATER, Hand, examples, liquid, scene

STRONG = scene(liquid(10_000), scale=30)
RHO_V = 1400 * 4 / 3 * np.pi * 0.034**3
STOKES_LAYER_KG = 3 * np.pi * 0.034**2 * np.sqrt(2 * 10.0 * 1400 / (2 * np.pi * 50))  # at 50 Hz
SCENES = {**THESIS, "strong": STRONG}


def passivity_controller(hand):
    """Return the passivity controller of a hand's servo."""
    return hand.safety[0].passivity


def storage_j(hand, sent_n, share=1 / 3, *, clamped=1.0):
    """Return the energy that the velocity filter can return in a liquid at rest [J at the hand], by the closed form.

    ``sent_n`` is the force before the last sample, ``clamped`` the share of it that the force limit left; 9 ms is the
    mean delay of the thesis' filter.
    """
    power_w = max(-np.dot(sent_n, hand.model.state[0].estimate_mps) / hand.model.parameters[0].scale, 0.0)
    return (1 - (1 - share) * clamped ** (1 / (1 / share - 1))) * 9e-3 * power_w


def test_a_filtered_damper_returns_exactly_the_energy_that_its_filter_stores():
    """A hand that stops within a tick gets back at most ∫F(v̂) dt v = K τ F v̂, with the storage's K."""
    for viscous, share in ((False, 1 / 3), (True, 1 / 2)):
        drag = {"viscosity_pa_s": 20.0, "drag": {"law": "schiller-naumann"}} if viscous else {}
        hand = Hand(scene(liquid(1000 if not viscous else 1.0, **drag), scale=1))
        hand.sweep(0.2, 300)
        sent_n = hand.sample[0].device_force_n.copy()
        passivity_controller(hand).balance_j = 10.0
        hand.tick((0.2 * 0.301, 0.0, 0.0))
        stored_j = passivity_controller(hand).balance_j
        assert stored_j == pytest.approx(storage_j(hand, sent_n, share), rel=1e-6)
        # v = v̂ + τ dv̂/dt: what F(v̂) takes beyond ∫F v̂ dt while v̂ rises from 0 is the storage
        speeds = np.linspace(0.0, hand.model.state[0].estimate_mps[0], 1001)
        top_n = -hand.sample[0].device_force_n[0]
        forces = top_n * (speeds / speeds[-1]) ** (1 if viscous else 2)
        assert stored_j == pytest.approx(9e-3 * np.trapezoid(forces, speeds), rel=2e-3)


def test_the_balance_is_the_work_of_the_force_really_sent_over_the_steps_of_the_hand():
    hand = Hand(HONEY)
    places = np.array([[0.03 * np.cos(9 * t), 0.0, 0.03 * np.sin(9 * t)] for t in np.arange(0, 1, 1e-3)])
    balance_j, sent = 0.0, np.zeros(3)
    for k, place in enumerate(places):
        clamped = passivity_controller(hand).norm_share
        sample = hand.tick(place)
        if k > 0:
            balance_j = min(balance_j - sent @ (place - places[k - 1]), storage_j(hand, sent, clamped=clamped))
        assert passivity_controller(hand).balance_j == pytest.approx(balance_j, abs=1e-15)
        sent = sample.device_force_n.copy()


def test_over_a_gap_the_mean_of_the_forces_sent_meanwhile_counts():
    hand = Hand(HONEY, faded_in=False)
    hand.sweep(0.2, 100)
    passivity_controller(hand).balance_j = 0.0
    forces = [hand.tick((0.02, 0.0, 0.0)).device_force_n.copy()]
    forces += [hand.tick(None).device_force_n.copy() for _ in range(3)]
    hand.tick((0.0195, 0.0, 0.0))
    assert passivity_controller(hand).balance_j == pytest.approx(-np.mean(forces, axis=0)[0] * -0.0005)
    assert passivity_controller(hand).balance_j < 0


@pytest.mark.compiled
def test_a_wake_can_return_four_27ths_of_c_u_cubed_over_its_length():
    hand = Hand(WATER)
    hand.sweep(0.3, 1000)
    passivity_controller(hand).balance_j = 1.0
    sent_n = hand.sample[0].device_force_n.copy()
    sample = hand.tick((0.3, 0.0, 0.0))
    u = np.linalg.norm(sample.wake_mps)
    reserve_j = 4 / 27 * 0.5 * 1000 * 0.47 * np.pi * 0.034**2 * u**3 * 1.7 / 10
    assert reserve_j > 0.1
    assert passivity_controller(hand).balance_j == pytest.approx(reserve_j + storage_j(hand, sent_n), rel=1e-9)


@pytest.mark.parametrize(
    ("effects", "inertia_kg"),
    [
        (("added_mass",), 0.5 * RHO_V),
        (("history",), STOKES_LAYER_KG),
        (("added_mass", "history"), 0.5 * RHO_V + STOKES_LAYER_KG),
    ],
)
def test_moving_liquid_can_return_its_kinetic_energy(effects, inertia_kg):
    hand = Hand(scene(liquid(1400, viscosity_pa_s=10.0, effects=("drag", *effects)), scale=3))
    hand.sweep(0.3, 300)
    passivity_controller(hand).balance_j = 10.0
    sent_n = hand.sample[0].device_force_n.copy()
    v = hand.tick((0.09, 0.0, 0.0)).velocity_mps[0]
    assert passivity_controller(hand).balance_j == pytest.approx(
        0.5 * inertia_kg * v**2 / 3 + storage_j(hand, sent_n), rel=1e-9
    )


def test_a_wake_of_a_viscous_liquid_returns_a_quarter_of_its_resistance():
    viscous = liquid(1400, viscosity_pa_s=10.0, wake={"length": 500, "scaling": 600}, drag={"law": "brown-lawler"})
    hand = Hand(scene(viscous, scale=3))
    hand.sweep(0.1, 300)
    passivity_controller(hand).balance_j = 10.0
    sent_n = hand.sample[0].device_force_n.copy()
    u = np.linalg.norm(hand.tick((0.03, 0.0, 0.0)).wake_mps)
    resistance_nspm = 3 * np.pi * 10 * 0.068 * laws.brown_lawler(1400 * u * 0.068 / 10)
    wake_j = 0.25 * resistance_nspm * u**2 * 0.5 / 3
    assert passivity_controller(hand).balance_j == pytest.approx(
        wake_j + storage_j(hand, sent_n, share=1 / 2), rel=1e-9
    )


def test_the_reserve_follows_the_last_sample_despite_lost_samples():
    hand = Hand(HONEY)
    hand.safety[0].delay_ticks = 0
    hand.sweep(0.2, 300)
    for _ in range(20):
        hand.tick(None)
    for k in range(1, 12):
        hand.tick((0.06 + 1e-5 * k, 0.0, 0.0))
    assert passivity_controller(hand).stored_j.max() < 0.1 * storage_j(hand, (-8.0, 0.0, 0.0))
    newest = [
        passivity_controller(hand).stored_j[passivity_controller(hand).row - before] for before in (1, 2)
    ]  # late by a tick at least
    assert passivity_controller(hand).reserve_j == pytest.approx(max(newest), rel=1e-9)


def test_buoyancy_only_lends():
    ball = Body(density_kg_m3=300.0)
    hand = Hand(scene(liquid(1000, effects=("buoyancy",)), body=ball))
    for k in range(1, 500):
        sample = hand.tick((0.0, 1e-4 * k, 0.0))
    assert sample.device_force_n[1] > 1.0
    assert passivity_controller(hand).balance_j == pytest.approx(0.0, abs=1e-12)


@pytest.mark.compiled
def test_a_hand_that_drifts_with_a_current_does_no_work():
    river = liquid(1000, effects=("drag", "current"), current={"kind": "uniform", "velocity_mps": (1.0, 0.0, 0.0)})
    hand = Hand(scene(river, scale=10))
    held = [hand.tick((0.0, 0.0, 0.0)) for _ in range(100)]
    assert held[-1].device_force_n[0] > 0.5
    hand.sweep(0.1, 300)
    assert not any(hand.tick((0.03 + 2e-5 * k, 0.0, 0.0)).limiters & LIMITER_ENERGY for k in range(500))
    assert passivity_controller(hand).balance_j <= 0.2e-3


def pushed_hand():
    """Return a hand at rest 18 cm along a stroke, which its wake pushes on."""
    hand = Hand(WATER)
    hand.sweep(0.3, 600)
    for _ in range(60):
        hand.tick((0.18, 0.0, 0.0))
    assert hand.sample[0].device_force_n[0] > 1.0
    return hand


@pytest.mark.parametrize("debt_j", [2e-6, 0.1e-3, 1e-3])
def test_a_debt_is_paid_by_damping_beyond_the_slew_limit_within_the_stable_range(debt_j):
    hand = pushed_hand()
    for k in range(20):
        hand.tick((0.18 + 6e-5 * k, 0.0, 0.0))
    passivity_controller(hand).balance_j = -1e-3 - debt_j
    passivity_controller(hand).strongest_n, passivity_controller(hand).longest_m = 8.0, 0.01
    sent_n = hand.tick((0.18 + 6e-5 * 20, 0.0, 0.0)).device_force_n[0]
    assert hand.sample[0].limiters & LIMITER_ENERGY
    owed_j = -1e-3 - min(passivity_controller(hand).balance_j, passivity_controller(hand).late_balance_j)
    v = passivity_controller(hand).velocity_mps[0]
    assert v == pytest.approx(0.06, rel=1e-3)
    assert passivity_controller(hand).gain == pytest.approx(0.125e-3 / (0.125e-3 + owed_j))
    brake_n = min(owed_j / (1e-3 * v), 0.5 * passivity_controller(hand).gain * 53 * v)
    slewed_n = hand.safety[0].slewed_n[0]
    assert slewed_n > 0
    assert sent_n == pytest.approx(slewed_n - (v / 0.04 - 1) * (slewed_n + brake_n), rel=1e-6)


def test_a_brake_is_released_and_reported_even_if_a_scene_begins_meanwhile():
    hand = pushed_hand()
    for k in range(20):
        hand.tick((0.18 + 1e-4 * k, 0.0, 0.0))
    passivity_controller(hand).balance_j = -1.1e-3
    passivity_controller(hand).strongest_n, passivity_controller(hand).longest_m = 8.0, 0.01
    braked_n = hand.tick((0.18 + 1e-4 * 20, 0.0, 0.0)).device_force_n[0]
    assert hand.safety[0].slewed_n[0] - braked_n > 0.5
    begin_scene(hand.safety[0])
    after = hand.tick((0.18 + 1e-4 * 21, 0.0, 0.0))
    assert after.limiters & LIMITER_ENERGY
    assert abs(after.device_force_n[0] - hand.safety[0].slewed_n[0]) < 1e-12
    assert hand.tick((0.18 + 1e-4 * 22, 0.0, 0.0)).limiters & LIMITER_ENERGY == 0


def test_the_remaining_energy_is_not_spent_within_10_ms():
    hand = pushed_hand()
    for k in range(20):
        hand.tick((0.18 + 1e-4 * k, 0.0, 0.0))
    passivity_controller(hand).balance_j = passivity_controller(hand).late_balance_j = -0.95e-3
    sent_n = hand.tick((0.18 + 1e-4 * 20, 0.0, 0.0)).device_force_n[0]
    left_j = 1e-3 + min(passivity_controller(hand).balance_j, passivity_controller(hand).late_balance_j)
    assert left_j > 0
    assert sent_n == pytest.approx(left_j / (0.02 * passivity_controller(hand).velocity_mps[0]), rel=1e-6)


@pytest.mark.slow
@pytest.mark.compiled
def test_a_swinging_loop_keeps_a_low_gain_for_seconds():
    hand = Hand(HONEY)
    whole_n = hand.sweep(0.05, 100)[-1].device_force_n[0]
    passivity_controller(hand).balance_j = -1e-3 - 0.375e-3
    passivity_controller(hand).strongest_n, passivity_controller(hand).longest_m = 8.0, 0.01
    hand.tick((0.005 + 5e-5, 0.0, 0.0))
    passivity_controller(hand).balance_j = passivity_controller(hand).late_balance_j = 0.0
    shares = [hand.tick((0.005 + 5e-5 * k, 0.0, 0.0)).device_force_n[0] / whole_n for k in range(2, 2502)]
    assert shares[10] == pytest.approx(0.25, rel=0.05)
    assert shares[1400] == pytest.approx(0.5, rel=0.05)
    assert all(before <= after + 1e-9 for before, after in itertools.pairwise(shares[20:]))


def test_a_force_that_acts_late_is_counted_late():
    hand = Hand(HONEY)
    hand.safety[0].delay_ticks = 3
    places = np.array([0.005 * np.cos(200 * t) for t in np.arange(0, 0.1, 1e-3)])
    balance_j, sent, stored = 0.0, [], []
    for k, place in enumerate(places):
        if k > 0:
            late_n = sent[k - 4] if k >= 4 else 0.0
            balance_j = min(balance_j + 1e-6, -1e-3) if balance_j < -1e-3 else balance_j
            balance_j -= late_n * (place - places[k - 1])
        clamped, before_n = passivity_controller(hand).norm_share, (sent[k - 1] if k else 0.0, 0.0, 0.0)
        gain = passivity_controller(hand).gain  # this fast, a loop with such a delay is observed to swing
        sent.append(hand.tick((place, 0.0, 0.0)).device_force_n[0])
        stored.append(gain * storage_j(hand, before_n, clamped=clamped))
        balance_j = min(balance_j, max(stored[k], stored[max(k - 3, 0)]))
        assert passivity_controller(hand).late_balance_j == pytest.approx(balance_j, abs=1e-12)
    assert passivity_controller(hand).late_balance_j < passivity_controller(hand).balance_j


def test_a_loop_that_is_believed_not_to_be_late_is_counted_as_one_that_is_late_by_a_tick():
    hands = [Hand(HONEY), Hand(HONEY)]
    for hand, believed in zip(hands, (0, 1), strict=True):
        hand.safety[0].delay_ticks = believed
        for t in np.arange(0, 0.1, 1e-3):
            hand.tick((0.005 * np.cos(200 * t), 0.0, 0.0))
    late, later = (
        [getattr(passivity_controller(hand), name) for hand in hands] for name in ("late_balance_j", "later_balance_j")
    )
    assert late[0] == late[1] > later[0] == later[1]
    assert late[0] < passivity_controller(hands[0]).balance_j


def test_a_liquid_that_resists_enough_pays_its_debt_unchanged():
    hand = Hand(HONEY)
    honey_n = hand.sweep(0.2, 300)[-1].force_n[0]
    passivity_controller(hand).balance_j = -1e-3 + 0.0002 * honey_n * 0.999
    sample = hand.tick((0.0602, 0.0, 0.0))
    assert sample.device_force_n[0] == sample.force_n[0]
    assert sample.limiters == 0
    hand.tick((0.0604, 0.0, 0.0))
    assert passivity_controller(hand).balance_j > -1e-3


@pytest.mark.compiled
@pytest.mark.parametrize("name", THESIS)
@pytest.mark.parametrize("speed_mps", [0.05, 0.1, 0.2, 0.3] if COMPILED else [0.3])
@pytest.mark.parametrize("motion", ["reach", "circle", "stop"])
def test_it_never_acts_where_people_move_as_they_do(name, speed_mps, motion):
    scene = THESIS[name]
    scene_mps = scene.scale * speed_mps
    shape = {
        "reach": {"distance_m": 0.6, "reach_s": 1.875 * 0.6 / scene_mps},
        "circle": {"speed_mps": scene_mps, "radius_m": 0.3},
        "stop": {"speed_mps": scene_mps},
    }
    ideal = paths.programmed_motion(motion, **shape[motion])
    count_m = scene.scale * 38e-6
    for measured in (ideal, Motion(ideal.t_s, np.round(ideal.position_m / count_m) * count_m)):
        assert not (simulate(scene, measured).limiters & LIMITER_ENERGY).any()


@pytest.mark.slow
def test_no_hand_gets_more_than_one_steps_work_whatever_it_does_and_the_liquid_is_felt_again_after():
    """The hand always goes where it is pushed, in the largest steps that sample validation accepts."""
    hand = Hand(WATER)
    hand.sweep(0.3, 600)
    place, longest_m, strongest_n = np.array([0.18, 0.0, 0.0]), 0.0003, 0.0
    strongest_n = passivity_controller(hand).strongest_n
    for _ in range(3000 if COMPILED else 300):
        sent = hand.sample[0].device_force_n
        size_n = np.linalg.norm(sent)
        strongest_n = max(strongest_n, size_n)
        step = 0.0099 * sent / size_n if size_n > 0 else np.zeros(3)
        place = place + step
        longest_m = max(longest_m, np.linalg.norm(step))
        hand.tick(place)
        assert passivity_controller(hand).balance_j >= -1e-3 - strongest_n * longest_m
    felt_n = 0.0
    for k in range(16_000 if COMPILED else 0):
        place = place + np.array([0.0, 0.0, 0.0003 if k // 200 % 2 else -0.0003])
        felt_n = np.linalg.norm(hand.tick(place).device_force_n)
    assert passivity_controller(hand).balance_j > -1e-3 or not COMPILED
    assert felt_n > 1.0 or not COMPILED


@pytest.mark.variants(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
@settings(max_examples=examples(80), deadline=None)
@given(data=st.data())
def test_on_any_path_the_balance_stays_above_minus_1_mj_and_the_work_of_one_step(name, data):
    """A step is the distance between two accepted samples, since the controller sees nothing in between."""
    hand = Hand(SCENES[name], faded_in=data.draw(st.booleans()))
    span_m = data.draw(st.sampled_from([1e-5, 1e-4, 1e-3, 9e-3]))
    coordinate = st.floats(-1, 1)
    moves = st.tuples(coordinate, coordinate, coordinate, st.sampled_from(["wherever", "along", "against", "nothing"]))
    place, accepted_m, strongest_n, longest_m = np.zeros(3), np.zeros(3), 0.0, 0.0
    last = hand.tick(place).device_force_n.copy()
    for x, y, z, kind in data.draw(st.lists(moves, min_size=1, max_size=80)):
        after_ns = data.draw(st.sampled_from([1_000_000, 1_000_000, 300_000, 4_000_000]))
        if kind == "nothing":
            sample = hand.tick(None, after_ns=after_ns)
        else:
            step = span_m * np.array([x, y, z]) / 2
            if kind != "wherever" and np.linalg.norm(last) > 1e-9:
                step = (
                    (np.linalg.norm(step) if kind == "along" else -np.linalg.norm(step)) * last / np.linalg.norm(last)
                )
            place = place + step
            sample = hand.tick(place, after_ns=after_ns)
            if not sample.limiters & LIMITER_GLITCH:
                longest_m, accepted_m = max(longest_m, np.linalg.norm(place - accepted_m)), place
        last = sample.device_force_n.copy()
        assert passivity_controller(hand).balance_j >= -1e-3 - strongest_n * longest_m - 1e-12
        strongest_n = max(strongest_n, np.linalg.norm(last))


def gains_after_debt(hand, *, fast, missing=0):
    """Return the gain after each millisecond of slow motion, with an earlier debt of 50 mJ, from fast motion or not."""
    hz = 5.0 if fast else 1.0
    for k in range(400):
        hand.tick(None if 300 <= k < 300 + missing else (0.03 * np.sin(2e-3 * np.pi * hz * k), 0.0, 0.0))
    passivity_controller(hand).balance_j = -50e-3
    gains = []
    for k in range(1500):
        hand.tick((0.03 * np.sin(0.8e-3 * np.pi * hz * 1e3) + 1e-4 * k, 0.0, 0.0))
        gains.append(float(passivity_controller(hand).gain))
    return np.array(gains)


@pytest.mark.compiled
def test_a_debt_of_a_push_that_the_hand_made_is_forgiven_once_it_is_quiet():
    gains = gains_after_debt(Hand(HONEY), fast=True)
    assert gains[0] < 0.05
    assert (gains[:300] < 0.1).all()
    assert (gains[900:] == 1.0).all()
    assert np.diff(gains).max() <= 1.01e-3 / 0.3
    assert gains_after_debt(Hand(HONEY, rules=VERSIONS[2]), fast=True)[900:].max() < 0.2


@pytest.mark.compiled
@pytest.mark.parametrize("other", [{"fast": False}, {"fast": True, "missing": 5}])
def test_a_debt_that_begins_in_slow_motion_or_after_a_gap_is_not_forgiven(other):
    assert gains_after_debt(Hand(HONEY), **other)[900:].max() < 0.2


@pytest.mark.compiled
def test_with_a_force_link_no_debt_is_forgiven():
    linked = HONEY.model_copy(update={"link": ForceLink(delay_s=0.001)})
    assert gains_after_debt(Hand(linked), fast=True).max() < 0.1


def oscillating_gains(hz, speed_mps, *, stroke_mps=0.0, seconds=1.0, rules=CURRENT):
    """Return the controller's gain after each millisecond of an imposed oscillation on a slow sine of 1 Hz."""
    hand, gains = Hand(HONEY, rules=rules), []
    for t_s in np.arange(0.0, 1.0 + seconds, 1e-3):
        x_m = stroke_mps * np.sin(2 * np.pi * t_s) / (2 * np.pi)
        if t_s > 1.0:
            x_m += speed_mps * np.sin(2 * np.pi * hz * (t_s - 1.0)) / (2 * np.pi * hz)
        hand.tick((38e-6 * np.round(x_m / 38e-6), 0.0, 0.0))
        gains.append(float(passivity_controller(hand).gain))
    return np.array(gains[1000:])


@pytest.mark.compiled
@pytest.mark.parametrize(("hz", "speed_mps"), [(12.5, 0.06), (20.0, 0.03), (45.0, 0.05)])
def test_the_gain_falls_while_the_handle_oscillates_faster_than_a_hand_can(hz, speed_mps):
    gains = oscillating_gains(hz, speed_mps)
    assert (gains[: int(2.5e3 / hz)] == 1.0).all()
    assert gains[-1] == pytest.approx(0.05)
    assert (oscillating_gains(hz, speed_mps, rules=VERSIONS[4]) == 1.0).all()


@pytest.mark.compiled
def test_the_gain_falls_at_9_5_hz_if_the_handle_is_faster_than_a_tremor():
    gains = oscillating_gains(9.5, 0.12)
    assert (gains[: int(2.5e3 / 9.5)] == 1.0).all()
    assert gains[-1] < 0.1
    assert (oscillating_gains(9.5, 0.12, rules=VERSIONS[6]) == 1.0).all()
    assert (oscillating_gains(9.5, 0.03) == 1.0).all()


@pytest.mark.compiled
def test_a_position_that_jumps_in_a_gap_neither_pays_a_debt_nor_counts_as_a_step():
    """Otherwise a step of 3 mm would remain the longest of a scene, and the force limit in debt would be useless."""
    for rules, counts in ((VERSIONS[6], True), (CURRENT, False)):
        hand = Hand(HONEY, rules=rules)
        hand.sweep(0.2, 100)
        longest_m, balance_j = passivity_controller(hand).longest_m, passivity_controller(hand).balance_j = (
            2e-4,
            -0.5e-3,
        )
        for _ in range(6):
            hand.tick(None)
        hand.tick((0.02 + 3e-3, 0.0, 0.0))
        assert bool(passivity_controller(hand).longest_m > longest_m) == counts
        assert bool(passivity_controller(hand).balance_j > balance_j) == counts


@pytest.mark.compiled
@pytest.mark.parametrize(
    "motion",
    [
        {"hz": 8.0, "speed_mps": 0.5},
        {"hz": 20.0, "speed_mps": 0.005},
        {"hz": 20.0, "speed_mps": 0.05, "seconds": 0.1},
        {"hz": 20.0, "speed_mps": 0.05, "stroke_mps": 0.8, "seconds": 0.2},
    ],
    ids=["strokes of 8 Hz", "tremor", "two periods", "ripples of a stroke"],
)
def test_the_gain_stays_1_in_motions_of_a_hand(motion):
    assert (oscillating_gains(**motion) == 1.0).all()
