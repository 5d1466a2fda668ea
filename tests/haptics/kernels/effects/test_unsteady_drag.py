"""Unsteady drag: its limits, its symmetry, its energy, and what the fluid solver found."""

import numpy as np
import pytest

from study_app.evidence.cfd import fits, stored_flows
from study_app.evidence.reference_model import unsteady_n
from study_app.evidence.reference_solutions import oscillation_truth, starting_truth
from study_app.evidence.stability.stability_cases import parse_case
from study_app.evidence.stability.verdict import judge
from study_app.haptics.kernels.effects.unsteady_drag import RATES_PER_S, WEIGHTS_RPS
from study_app.haptics.model.estimators import Kalman
from study_app.haptics.model.laws import finite_reynolds
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Box, Liquid, MotionBox
from study_app.haptics.model.slope_limits import steady_force
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack
from tests.haptics.scenes import COMPILED, UNBENT, Hand, liquid, moving, scene, vectors
from tests.haptics.unsteady import ADDED_M3, FLUIDS, force, highest_gain, random_motion, tank

compiled = pytest.mark.skipif(not COMPILED, reason="thousands of ticks are for compiled code")


def test_the_exponentials_are_the_kernel_within_1_5_percent_from_1_ms_to_30_s():
    t_s = np.geomspace(1e-3, 30, 4000)
    kernel = (np.array(WEIGHTS_RPS) * np.exp(-np.outer(t_s, RATES_PER_S))).sum(axis=1)
    assert abs(kernel * np.sqrt(t_s) - 1).max() < 0.0155


def test_steady_drag_is_stokes_at_rest_and_that_of_the_solver_to_re_200():
    assert finite_reynolds(0.0) == 1
    solved = stored_flows.load_steady().columns
    for reynolds, coefficient in zip(solved["reynolds"], solved["drag_coefficient"], strict=True):
        within = 0.017 if reynolds >= 1 else 0.03
        assert finite_reynolds(reynolds) * 24 / reynolds == pytest.approx(coefficient, rel=within)


@compiled
@pytest.mark.parametrize("truth", [oscillation_truth, starting_truth])
@pytest.mark.parametrize("name", FLUIDS)
def test_as_re_vanishes_it_is_stokes_added_mass_and_basset_within_a_percent(name, truth):
    """Landau & Lifshitz §24 and Basset 1888, at Re 1e-5."""
    box = MotionBox(speed_mps=0.6, acceleration_mps2=6)
    scene = tank(name).model_copy(update={"motion": box, "rate_hz": 4000.0})
    (case,) = truth(scene).cases
    slow = Motion(case.motion.t_s, case.motion.position_m / 1e3, velocity_mps=case.motion.velocity_mps / 1e3)
    error_n = 1e3 * vectors(simulate(scene, slow), "force") - case.force_n
    rms = np.sqrt(np.mean(error_n[case.counted] ** 2) / np.mean(case.force_n[case.counted] ** 2))
    assert rms <= 0.01


@compiled
@pytest.mark.parametrize("table", stored_flows.load_tables(), ids=lambda it: it.case.name)
def test_it_is_the_fluid_solver_within_4_percent_and_6_of_the_peak(table):
    (model,) = [it for it in fits.MODELS if it.effects == ("unsteady_drag",)]
    judged = fits.evaluate_fit(model, table, {})
    _, solved_n = fits.resampled(table)
    assert judged.share <= 0.04
    assert judged.worst_n <= 0.06 * abs(solved_n).max()


@compiled
@pytest.mark.parametrize(("interval_s", "within"), [(1e-3, 0.002), (4e-3, 0.01), (2e-2, 0.02)])
@pytest.mark.parametrize("name", FLUIDS)
def test_it_equals_its_law_by_the_letter(name, interval_s, within):
    """The reference uses exact exponentials, which the kernel approximates; late ticks need them."""
    velocity = random_motion(3, ticks=1500) + np.array([0.1, 0.0, -0.05])
    velocity = velocity[:: round(interval_s / 1e-3)]
    scene, even_s = tank(name), np.full(len(velocity), interval_s)
    by_letter = unsteady_n(scene, velocity, np.diff(velocity, axis=0, prepend=velocity[:1]) / interval_s, even_s)
    assert abs(force(scene, velocity, even_s) - by_letter).max() <= within * abs(by_letter).max()


@pytest.mark.parametrize(("filter_s", "smoothing_s"), [(0.004, 0.03), (0.021, 0.006)])
def test_its_acceleration_is_smoothed_as_in_the_effects_that_it_replaces(filter_s, smoothing_s):
    times = {"added_mass": {"filter_s": filter_s}, "history": {"smoothing_s": smoothing_s}}
    oil = Liquid(id="oil", density_kg_m3=1261, viscosity_pa_s=1.41, effects=("unsteady_drag",), **times)
    record = pack(scene(oil, velocity=Kalman())).liquids[0].unsteady_drag
    assert (record.filter_per_s, record.history_filter_per_s) == pytest.approx((1 / filter_s, 1 / smoothing_s))


@compiled
@pytest.mark.parametrize("name", FLUIDS)
def test_no_motion_gains_energy(name):
    assert highest_gain(name, range(12)) <= 1e-3


def test_a_body_that_moves_already_meets_steady_drag_at_once():
    velocity = np.tile([0.1, 0.2, -0.2], (200, 1))
    force_n = force(tank("glycerin"), velocity)
    stokes_nspm = 3 * np.pi * 1.41 * 0.068
    steady = -stokes_nspm * finite_reynolds(1261 * 0.3 * 0.068 / 1.41) * velocity[0]
    assert force_n == pytest.approx(np.tile(steady, (200, 1)), rel=1e-9)


@pytest.mark.slow
@compiled
def test_after_a_stop_the_wake_pushes_on_and_its_memory_decays_to_zero():
    velocity = np.zeros((60_000, 3))
    velocity[10:400] = [0.5, 0.0, 0.0]
    force_n = force(tank("glycerin"), velocity)[:, 0]
    assert force_n[399] < 0 < force_n[450] < -force_n[399]
    hand = Hand(tank("tar", effects=("unsteady_drag",)))
    hand.sweep(0.2, 50)
    for _ in range(3000):
        hand.tick((0.01, 0.0, 0.0))
    memory = hand.model.liquid_states[0].unsteady_drag.memory_mps
    assert not memory[5:].any()
    assert not ((memory != 0) & (abs(memory) < 1e-300)).any()


def sent_and_due(name, scale, hand_mps, stop=0):
    """Return along x the sent force, the expected force, late drag, and its limits at the speeds u and |w|."""
    scene = tank(name).model_copy(update={"scale": scale, "force_limit_n": 20.0})
    hand = Hand(scene)
    sample = hand.sweep(hand_mps, 800)[-1]
    for _ in range(stop):
        sample = hand.tick((hand_mps * 0.8, 0.0, 0.0))
    local, delay = hand.model.liquid_states[0], hand.safety[0].delay_ticks
    most_nspm = hand.model.parameters[0].slope_limit_nspm[delay]
    stokes_nspm = 3 * np.pi * FLUIDS[name][1] * 0.068
    late_n = -stokes_nspm * local.unsteady_drag.excess_mps[0]
    most_n = max(most_nspm - stokes_nspm, 0.0) * local.late_mps
    due_n = -min(stokes_nspm, most_nspm) * local.relative_mps[0] + np.clip(late_n, -most_n, most_n)
    due_n += hand.model.liquids[0].inertia_share[delay] * local.inertia_n[0, 0]
    return sample.device_force_n[0], due_n, late_n, most_n, most_n / local.late_mps * abs(local.relative_mps[0])


@compiled
@pytest.mark.parametrize(
    ("name", "scale", "limited"), [("tar", 3.0, True), ("glycerin", 40.0, True), ("honey", 3.0, False)]
)
def test_late_drag_is_limited_to_the_remaining_slope(name, scale, limited):
    sent_n, due_n, late_n, most_n, _ = sent_and_due(name, scale, 0.1)
    assert sent_n == pytest.approx(due_n, rel=1e-9)
    assert late_n < 0
    assert (-late_n > most_n) == limited
    assert (
        steady_force(tank(name).model_copy(update={"scale": scale, "force_limit_n": 20.0}), 0.1).limit == "slope"
    ) == limited


@compiled
def test_after_a_stop_the_slope_limit_leaves_the_force_as_it_is():
    sent_n, due_n, late_n, most_n, at_w_n = sent_and_due("glycerin", 3.0, 0.2, stop=150)
    assert sent_n == pytest.approx(due_n, rel=1e-9)
    assert at_w_n < abs(late_n) < most_n
    assert sent_n > 0


@pytest.mark.slow
@compiled
@pytest.mark.parametrize(
    "line",
    [
        "liquid=physical2_olive_oil scale=20 rate_hz=2000 delay=0 mass_kg=0.03 hand=thrown plant=arm",
        "liquid=physical2_glycerin scale=20 rate_hz=2000 delay=3 hand=light motion=stroke mass_kg=0.25 viscous_nspm=0 "
        "coulomb_n=0.3 plant=arm",
    ],
)
def test_late_drag_leaves_closed_loops_stable(line):
    assert not judge(parse_case(line), safe=True).reasons


def test_added_mass_and_history_keep_the_stable_share_of_their_own_effects():
    apart = liquid(1420, viscosity_pa_s=10, effects=("drag", "added_mass", "history"))
    for velocity in (Kalman(), scene().velocity):
        together = tank("honey").model_copy(update={"velocity": velocity, "scale": 3.0})
        shares = [
            pack(it).liquids[0].inertia_share for it in (together, together.model_copy(update={"liquids": (apart,)}))
        ]
        assert (shares[0] >= shares[1]).all()
        assert (shares[0] < 1).any()


@compiled
def test_the_reserve_is_that_of_added_mass_and_history_together():
    hand = Hand(tank("glycerin"))
    hand.sweep(0.2, 500)
    state, liquid_state = hand.model.state[0], hand.model.liquid_states[0]
    mass_kg = 1261 * ADDED_M3 + 0.5 * 1.5 * 0.068**2 * np.sqrt(np.pi * 1261 * 1.41 / 50)
    share = hand.model.liquids[0].inertia_share[hand.safety[0].delay_ticks]
    assert state.returnable_j == pytest.approx(0.5 * share * mass_kg * (liquid_state.motion_mps**2).sum())


def test_under_a_surface_drag_goes_by_the_area_and_inertia_by_the_volume():
    """A quarter of the ball is submerged; its shares of frontal area and volume follow from the surface."""
    pool = liquid(1261, viscosity_pa_s=1.41, region=Box(size_m=(2, 2, 2)), effects=("unsteady_drag", "surface"))
    whole = pool.model_copy(update={"effects": ("unsteady_drag",)})
    shallow_m = 1.0 + 0.017  # of the centre: a quarter of the diameter is in
    velocity = np.zeros((3, 3))
    velocity[1:, 0] = 0.3
    motion = moving(velocity)
    motion.position_m[:, 1] = shallow_m - np.array([0.034, 0.0, 0.0])
    part = vectors(simulate(scene(pool, knee=UNBENT), motion), "force")
    motion.position_m[:, 1] = 0.0
    deep = vectors(simulate(scene(whole, knee=UNBENT), motion), "force")
    stokes_n = 3 * np.pi * 1.41 * 0.068 * 0.3
    area, volume = (np.arccos(0.5) - 0.5 * np.sqrt(0.75)) / np.pi, 0.25 * 0.5**2 * 2.5
    inertial_n = -deep[1, 0] - stokes_n
    assert -part[1, 0] == pytest.approx(stokes_n * area + inertial_n * volume, rel=2e-3)
