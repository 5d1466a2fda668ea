"""The Kalman filter of velocity: compared with its definition and EWMA, in closed loops, and after faults."""

import math

import numpy as np
import pytest

from study_app.evidence.stability.damping_limits import boundary_nspm
from study_app.evidence.stability.withheld_force import measure_withheld_force
from study_app.haptics.kernels import estimators as kalman
from study_app.haptics.kernels.safety import new_safety
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.estimators import NAMED, Ewma, Kalman
from study_app.haptics.model.force_rules import CURRENT, VERSIONS
from study_app.haptics.model.layout import LIMITER_ESTIMATOR, records
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Scene
from study_app.haptics.model.slope_limits import damping_limits, slope_limit_table
from study_app.haptics.runtime.offline import new_wake_places, recompute_sample, simulate
from study_app.haptics.runtime.pack import pack
from tests.haptics.scenes import COMPILED, HONEY, UNBENT, WATER, Hand, vectors

pytestmark = pytest.mark.slow

COUNT_M = 38e-6
compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")


def device(delay_ticks=1, period_s=1e-3):
    """Return the dynamics of a device that measures its delay."""
    return Dynamics(delay_s=delay_ticks * period_s, count_m=COUNT_M, mass_kg=0.1)


def hand(velocity=None, *, delay_ticks=1, scene=WATER, rules=CURRENT):
    """Return a hand on the device with a reply delay."""
    moved = Hand(scene.model_copy(update={"velocity": velocity or Kalman()}), dynamics=device(delay_ticks), rules=rules)
    moved.safety[0].delay_ticks = delay_ticks
    return moved


def estimated_velocities(velocity, position_m, interval_s=1e-3):
    """Return the velocities (n, 3) found in positions (n, 3) or (n,) along x, as an encoder of 38 µm counts them."""
    position_m = np.round(np.asarray(position_m, float) / COUNT_M) * COUNT_M
    if position_m.ndim == 1:
        position_m = np.column_stack([position_m, 0 * position_m, 0 * position_m])
    motion = Motion(np.arange(len(position_m)) * interval_s, position_m)
    return vectors(simulate(Scene(scale=1, velocity=velocity, knee=UNBENT), motion), "velocity")


def literal(position_m, interval_s, force_n, rules=CURRENT):
    """Return the velocities (n, 3) by the definition: positions (n, 3), intervals (n,), acting forces (n, 3)."""
    x, response, v = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((len(position_m), 3))  # rows of x: axes
    estimates, smooth, smooth_before = np.zeros_like(v), np.zeros(3), np.zeros(3)
    elapsed_s, checks, sums, false_share = 0.0, [], np.zeros(2), 0.0
    p = np.diag([COUNT_M**2 / 2, kalman.FIRST_SPEED_MPS**2, kalman.FIRST_ACCELERATION_MPS2**2])
    theta, spread = kalman.USUAL_PER_KG, kalman.USUAL_PER_KG**2 / 4
    x[:, 0] = position_m[0]
    once, twice, before, surprise = np.zeros(3), np.zeros(3), force_n[0], 0.0
    for k, (place, t, force) in enumerate(zip(position_m, interval_s, force_n, strict=True)):
        speed, acceleration = np.linalg.norm(v[k - 1]), np.linalg.norm(x[:, 2])
        q = kalman.JERK_M2PS5 + CURRENT.jerk_of_speed_ps3 * speed**2 + kalman.JERK_OF_ACCELERATION_PS * acceleration**2
        q += kalman.JERK_OF_SURPRISE_M2PS5 * max(surprise - kalman.SURPRISE, 0) ** 2
        noise = q * np.array([[t**5 / 20, t**4 / 8, t**3 / 6], [t**4 / 8, t**3 / 3, t**2 / 2], [t**3 / 6, t**2 / 2, t]])
        kept = math.exp(-kalman.CORNER_RADPS * t)
        passed = kept * (once + force - before)
        twice, once, before = kept * (twice + passed - once), passed, force
        step = np.array([[1, t, t * t / 2], [0, 1, t], [0, 0, 1]])
        x, response = x @ step.T, response @ step.T + np.outer(twice, [t * t / 2, t, 0])
        p = step @ p @ step.T + noise
        variance = p[0, 0] + COUNT_M**2 / 2 + (kalman.TIMING_S * speed) ** 2
        gain, e, s = p[:, 0] / variance, place - x[:, 0], response[:, 0]
        x, response, p = x + np.outer(e, gain), response - np.outer(s, gain), p - np.outer(gain, p[0])
        d = s @ s * spread + variance
        ratio = min(np.sum((e - s * theta) ** 2) / d, 2 * kalman.TROUBLE)
        surprise += -math.expm1(-t / kalman.TROUBLE_S) * (ratio - surprise)
        theta += spread * (s @ (e - s * theta)) / d
        spread += -(spread**2) * (s @ s) / d + kalman.LEARNING_PKG2S * t
        theta = min(max(theta + (kalman.USUAL_PER_KG - theta) * t / kalman.FORGETTING_S, 0.0), 10.0)
        v[k] = x[:, 1] + response[:, 1] * theta
        smooth_before = smooth
        smooth = smooth + (1 - 0.9 ** (t / 1e-3)) * ((place - position_m[max(k - 1, 0)]) / t - smooth)
        lead = v[k] - (smooth + smooth_before) / 2
        elapsed_s += t
        if k % 4 == 3:
            checks.append((elapsed_s, place, v[k], lead))
        if k % 4 == 3 and len(checks) > 2:
            lasted_s, way, (checked, old_lead) = elapsed_s - checks[-3][0], place - checks[-3][1], checks[-2][2:]
            weight = lasted_s / 2 / (kalman.CHECKED_S + lasted_s / 2)
            sums += weight * (np.array([old_lead @ old_lead, old_lead @ (checked - way / lasted_s)]) - sums)
            false_share = sums[1] / (sums[0] + (COUNT_M / kalman.LEAST_LEAD_S) ** 2) - rules.tolerated_false_lead
            false_share = np.clip(rules.false_lead_gain * false_share, 0, 1)
        estimates[k] = v[k] - false_share * lead
    return estimates


@pytest.mark.parametrize("rules", [VERSIONS[9], VERSIONS[11], CURRENT])
@pytest.mark.parametrize("delay_ticks", [0, 1, 3])
def test_it_is_its_definition_with_late_and_missing_samples(delay_ticks, rules):
    random = np.random.default_rng(4)
    moved = hand(delay_ticks=delay_ticks, scene=HONEY.model_copy(update={"scale": 3.0, "knee": UNBENT}), rules=rules)
    places, intervals, forces, estimates = [], [], [], []
    sent = [np.zeros(3)] * (delay_ticks + 1)
    impulse, since_s = np.zeros(3), 0.0
    speed = np.zeros(3)
    place = np.zeros(3)
    for k in range(400):
        speed = 0.99 * speed + random.normal(0, 0.01, 3)
        place = place + 1e-3 * speed
        after_ns = int(random.uniform(0.6e6, 1.6e6))
        fresh = k == 0 or random.random() > 0.2
        sample = moved.tick(place if fresh else None, after_ns=after_ns)
        tick_s = after_ns * 1e-9 if k else 0.0
        impulse, since_s = impulse + sent[-1 - delay_ticks] * tick_s, since_s + tick_s
        if fresh:
            places.append(place)
            intervals.append(since_s or 1e-3)
            forces.append(impulse / since_s if since_s else np.zeros(3))
            estimates.append(np.array(sample.velocity_mps) / 3.0)
            impulse, since_s = np.zeros(3), 0.0
        sent.append(np.array(sample.device_force_n))
    expected = literal(np.array(places), intervals, forces, rules)
    assert np.array(estimates) == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
    assert np.abs(expected).max() > 0.05
    blind = literal(np.array(places), intervals, np.zeros((len(places), 3)), VERSIONS[9])
    assert np.abs(expected - blind).max() > 0.005 * np.abs(expected).max()


def measured_mps(position_m, *, rules=CURRENT, velocity=None):
    """Return velocities (n,) from positions (n,) [m] along x, as an encoder of 38 µm counts them."""
    moved = hand(velocity, scene=WATER.model_copy(update={"scale": 1.0, "knee": UNBENT}), rules=rules)
    counted_m = np.round(np.column_stack([position_m, 0 * position_m, 0 * position_m]) / COUNT_M) * COUNT_M
    return np.array([moved.tick(place).velocity_mps[0] for place in counted_m])


@compiled
def test_encoder_noise_of_some_counts_is_not_noisier_than_with_ewma():
    """Twice the noise of a count leaves the mean of EWMA's last two: α (1 − z⁻²) / (2T (1 − 0.9 z⁻¹)) of the positions.

    More is a fault at times, so that EWMA is used. Under earlier rules, noise raised the jerk.
    """
    weights = 0.9 ** np.arange(200)
    ewma_per_s, mean_per_s = 100 * weights, 50 * weights
    ewma_per_s[1:] -= 100 * weights[:-1]
    mean_per_s[2:] -= 50 * weights[:-2]
    random = np.random.default_rng(6)
    for counts, bound_per_s in ((2.1, mean_per_s), (2.9, ewma_per_s)):
        x_m = random.normal(0, counts * COUNT_M, 20_000)
        bound_mps = COUNT_M * math.sqrt((counts**2 + 1 / 12) * np.sum(bound_per_s**2))
        noise_mps = np.std(measured_mps(x_m)[2000:])
        assert noise_mps < 1.03 * bound_mps
        assert counts > 2.5 or noise_mps > 0.97 * bound_mps
        assert np.std(measured_mps(x_m, rules=VERSIONS[9])[2000:]) > 1.5 * noise_mps


@compiled
def test_a_vibration_of_two_counts_leaves_it_as_accurate_as_ewma():
    t_s, random = np.arange(8000) / 1000, np.random.default_rng(7)
    for hz in random.uniform(20, 50, 4):
        true_mps = 0.068 * np.cos(2 * math.pi * 0.9 * t_s)
        x_m = 0.068 / (2 * math.pi * 0.9) * np.sin(2 * math.pi * 0.9 * t_s)
        x_m += 2 * COUNT_M * np.sin(2 * math.pi * hz * t_s + random.uniform(0, 6))
        now, before, ewma = (
            np.std((measured_mps(x_m, **estimator) - true_mps)[1000:])
            for estimator in ({}, {"rules": VERSIONS[9]}, {"velocity": Ewma()})
        )
        assert now < ewma < before, hz


@compiled
def test_the_limit_holds_where_the_delay_is_wrong_by_one():
    """At 1 kHz and one tick, the limit is that of a loop one tick later than believed."""
    assert damping_limits(1e-3, 1, Kalman()).drag_nspm <= boundary_nspm(Kalman(), 1e-3, 2, believed=1) * 1.01
    assert damping_limits(1e-3, 1, Kalman()).drag_nspm >= 53
    for entry in slope_limit_table():
        if entry.estimator == "kalman":
            assert entry.limits.drag_nspm < boundary_nspm(Ewma(), entry.period_s, entry.delay_ticks)


@compiled
def test_a_motion_that_breaks_off_leaves_no_liquid_weak():
    """The imposed stroke of 8 Hz changes into slow stirring at 0.5 m/s between two samples."""
    for withheld in measure_withheld_force(["honey"], ["kalman"]):
        assert withheld.lasting < 0.005
        assert withheld.quick < 0.02


@compiled
def test_nothing_of_a_motion_is_left_in_denormal_numbers():
    moved = hand()
    moved.sweep(0.2, 100)
    for _ in range(9000):
        moved.tick((0.02, 0.0, 0.0))
    state = moved.model.state[0].kalman
    for name in ("offset_m", "velocity_mps", "acceleration_mps2", "response_m", "response_mps", "passed_n", "input_n"):
        left = np.abs(state[name])
        assert ((left == 0) | (left > 1e-31)).all(), name
    assert not state.carried_mps.any()
    assert not moved.sample.velocity_mps.any()


def test_a_device_that_measures_no_delay_gets_ewma():
    kalman_hand, ewma_hand = (Hand(WATER.model_copy(update={"velocity": it})) for it in (Kalman(), Ewma()))
    assert kalman_hand.model.parameters[0].estimator == NAMED["ewma"].code
    assert [s.tobytes() for s in kalman_hand.sweep(0.2, 40)] == [s.tobytes() for s in ewma_hand.sweep(0.2, 40)]


def strokes(ticks, hz=2.0):
    """Return places (ticks, 3) of strokes of ±30 mm along x."""
    x = 0.03 * np.sin(2 * np.pi * hz * np.arange(ticks) / 1000)
    return np.column_stack([x, 0 * x, 0 * x])


def test_where_the_delay_changes_ewma_takes_over_without_a_jump_and_gives_back_after_a_second():
    moved, usual = hand(), hand(Ewma())
    samples, others = [], []
    for k, place in enumerate(strokes(1400)):
        if k == 300:
            moved.safety[0].delay_ticks = usual.safety[0].delay_ticks = 2
        samples.append(moved.tick(place))
        others.append(usual.tick(place))
    flagged = np.array([bool(sample.limiters & LIMITER_ESTIMATOR) for sample in samples])
    assert np.flatnonzero(flagged).tolist() == list(range(300, 1300))
    v, ewma = (np.array([s.velocity_mps[0] for s in rows]) for rows in (samples, others))
    assert abs(v[299] - ewma[299]) > 0.1  # what a jump would be
    steps = np.abs(np.diff(v))
    assert steps[[299, 1299]].max() < 1.1 * steps[250:290].max()
    assert v[400:1300] == pytest.approx(ewma[400:1300], abs=1e-4)


def test_positions_coarser_than_stated_are_detected_as_a_fault():
    moved = hand(rules=VERSIONS[2])  # later ones reject such positions
    random = np.random.default_rng(3)
    quiet = [moved.tick(place) for place in np.round(strokes(300) / COUNT_M) * COUNT_M]
    wild = [moved.tick(place + random.normal(0, 2e-3, 3)) for place in strokes(60)]
    assert not any(sample.limiters & LIMITER_ESTIMATOR for sample in quiet)
    assert not wild[5].limiters & LIMITER_ESTIMATOR
    assert any(sample.limiters & LIMITER_ESTIMATOR for sample in wild[:30])
    calm = [moved.tick((0.0, 0.0, 0.0)) for _ in range(1200)]
    assert calm[900].limiters & LIMITER_ESTIMATOR
    assert not calm[-1].limiters & LIMITER_ESTIMATOR


def test_a_repeated_sample_is_ignored_and_a_stop_accepted_at_its_second_sample():
    places = np.round(strokes(400) / COUNT_M) * COUNT_M
    repeated = places.copy()
    repeated[[300, 330]] = places[[299, 329]]
    usual, moved = hand(), hand()
    for k, (place, other) in enumerate(zip(places, repeated, strict=True)):
        v, u = moved.tick(other).velocity_mps[0], usual.tick(place).velocity_mps[0]
        assert moved.model.state[0].kalman.repeated == (k in {300, 330})
        assert v == pytest.approx(u, abs=0.06), k  # of up to 3.8 m/s; 0.4 where the sample counted
    stopped = [moved.tick(places[-1]) for _ in range(60)]
    assert abs(stopped[-1].velocity_mps[0]) < 0.05
    slow = hand()
    for place in np.round(strokes(400) / 10 / COUNT_M) * COUNT_M:  # often within the same count
        slow.tick(place)
        assert not slow.model.state[0].kalman.repeated


def test_a_replay_of_the_filter_is_exact_to_the_last_bit():
    moved = hand()
    samples = records(moved.sample.dtype, 700)
    for k, place in enumerate(strokes(700)):
        if k == 400:
            moved.safety[0].delay_ticks = 2
        samples[k] = moved.tick(place)
    again = samples.copy()
    again.velocity_mps = again.force_n = 0.0
    safety = new_safety()
    safety[0].fade = 1.0
    model = pack(WATER.model_copy(update={"velocity": Kalman()}), dynamics=device())
    recompute_sample(
        model, safety[0], again, *(it[0] if it.dtype.names[0] == "left" else it for it in new_wake_places(2000)), True
    )
    assert again.tobytes() == samples.tobytes()
