import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.evidence.stability.damping_limits import measured_estimators
from study_app.haptics.kernels.safety import begin_scene
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.haptics.model.estimators import NAMED, DeviceVelocity, Ewma, Given, Kalman, Raw
from study_app.haptics.model.force_rules import VERSIONS
from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_FADE, LIMITER_NORM, LIMITER_SLEW, LIMITER_SLOPE
from study_app.haptics.model.motion import Motion
from study_app.haptics.model.scene import Box, ForceLink
from study_app.haptics.model.slope_limits import (
    KALMAN_SLEW,
    LIGHTER,
    SLEW_N,
    damping_limits,
    refusal_reason,
    slew_limit_n,
    slope_limit,
    slope_limit_table,
)
from study_app.haptics.runtime.offline import simulate
from study_app.haptics.runtime.pack import pack, pack_into
from tests.haptics.scenes import HONEY, UNBENT, WATER, Hand, liquid, moving, scene, vectors

ESTIMATORS = {"kalman": Kalman(), "raw": Raw()}
TAR = scene(liquid(20_000), scale=30, knee=UNBENT)


def size(force_n):
    """Return |force|."""
    return float(np.linalg.norm(force_n))


@pytest.mark.parametrize(
    ("period_s", "delay_ticks", "expected"),
    [
        (1e-3, 0, 53),
        (1e-3, 1, 53),
        (1e-3, 2, 21.5),
        (1e-3, 3, 15.4),
        (1e-3, 4, 12.2),
        (0.5e-3, 4, 19),
        (0.5e-3, 1, 40),
        (0.25e-3, 1, 20),
        (0.7e-3, 1, 40),
        (0.7e-3, 3, 15.4),
        (2e-3, 1, 17.9),
        (1.5e-3, 2, 11),
        (3e-3, 1, 9.1),
        (4e-3, 4, 3.4),
    ],
)
def test_between_two_entries_of_the_slope_table_the_worse_counts(period_s, delay_ticks, expected):
    assert slope_limit(period_s, delay_ticks) == expected


@pytest.mark.parametrize(("period_s", "delay_ticks"), [(5e-3, 1), (1e-3, 5)])
def test_a_loop_beyond_the_table_is_refused(period_s, delay_ticks):
    with pytest.raises(StudyError, match="250 Hz"):
        slope_limit(period_s, delay_ticks)


def test_a_faster_line_is_noisier_and_bears_half():
    def limit(period_s):
        return slope_limit(period_s, 1, DeviceVelocity(lag_s=7 * period_s))  # a line of 15 positions

    assert limit(0.5e-3) == pytest.approx(limit(1e-3) / 2, abs=0.1)
    assert limit(0.25e-3) == pytest.approx(limit(0.5e-3) / 2)
    assert slope_limit(1e-3, 1, Given()) == slope_limit(1e-3, 1, Ewma()) > 4 * limit(1e-3)


def test_one_that_smooths_more_bears_as_much_as_the_usual_one():
    assert slope_limit(1e-3, 1, Ewma(alpha=0.02)) == slope_limit(1e-3, 1, Ewma())
    assert slope_limit(1e-3, 1, Ewma(alpha=0.001)) == slope_limit(1e-3, 1, Ewma())


def test_a_little_less_smoothing_bears_as_much_and_much_less_the_less():
    assert slope_limit(1e-3, 1, Ewma(alpha=0.11)) == 53
    limits = [slope_limit(1e-3, 1, Ewma(alpha=alpha)) for alpha in (0.11, 0.13, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0)]
    assert limits == sorted(limits, reverse=True)
    assert limits[1] == slope_limit(1e-3, 1, Ewma(alpha=0.15)) > 31  # what honey asks for
    assert limits[4] == slope_limit(1e-3, 1, Ewma(alpha=0.3))
    assert limits[-1] == slope_limit(1e-3, 1, Raw())


@pytest.mark.parametrize(("rate_hz", "may"), [(250.0, False), (499.0, False), (500.0, True), (1000.0, True)])
def test_below_500_hz_no_participant_is_to_feel_the_limits(rate_hz, may):
    assert (refusal_reason(rate_hz) is None) == may


def test_the_table_has_every_estimator_period_and_delay_and_falls_with_delay():
    rows = [
        entry for entry in slope_limit_table() if entry.estimator != "line"
    ]  # those are of velocities that a device measures
    keys = [(entry.estimator, entry.parameter, entry.period_s, entry.delay_ticks) for entry in rows]
    assert len(set(keys)) == len(keys) == len(measured_estimators()) * 4 * 4
    for entry in rows:
        if entry.delay_ticks > 1:
            kind = NAMED[entry.estimator]
            named = {} if entry.parameter is None else {"alpha": entry.parameter}
            before = damping_limits(entry.period_s, entry.delay_ticks - 1, kind.model(**named))
            assert entry.limits.drag_nspm <= before.drag_nspm
        assert entry.limits.inertia_nspm < entry.limits.drag_nspm


@pytest.mark.compiled
def test_added_mass_and_history_are_weakened_where_the_loop_bears_less():
    inert = scene(liquid(1400, viscosity_pa_s=10.0, effects=("added_mass", "history")), scale=3)
    t_s = np.arange(400) / 1000
    swaying = Motion(t_s, np.column_stack([0.01 * np.sin(20 * t_s), 0 * t_s, 0 * t_s]))
    table = simulate(inert, swaying)
    assert (table.device_fx_n == table.fx_n).all()
    coarse = scene(*inert.liquids, scale=3, velocity=Raw())
    table = simulate(coarse, swaying)
    ratio = table.device_fx_n[100:] / table.fx_n[100:]
    share = pack(coarse).liquids[0].inertia_share[1]
    assert 0.02 < share < 0.5
    assert ratio == pytest.approx(share)
    assert (table.limiters[100:] & LIMITER_SLOPE != 0).all()


@pytest.mark.parametrize("velocity", [Ewma(), Kalman()], ids=["ewma", "kalman"])
@pytest.mark.parametrize("effects", [("drag",), ("added_mass", "history")], ids=["drag", "inertia"])
def test_force_removed_by_slope_limits_counts_as_withheld(effects, velocity):
    steep = scene(liquid(20_000, viscosity_pa_s=10.0, effects=effects), scale=30, velocity=velocity, knee=UNBENT)
    hand = Hand(steep, dynamics=Dynamics(delay_s=1e-3, count_m=38e-6, mass_kg=0.1))
    for sample in [hand.tick((0.004 * np.sin(0.02 * k), 0.0, 0.0)) for k in range(400)]:
        asked_n = sample.force_n * min(1.0, 8.0 / max(size(sample.force_n), 1e-9))
        assert sample.permitted_n == pytest.approx(size(asked_n), rel=1e-9)
        assert sample.withheld_n == pytest.approx(size(asked_n - sample.device_force_n), abs=1e-9)
    assert sample.limiters & LIMITER_SLOPE
    assert sample.withheld_n > 0.2 * sample.permitted_n > 0
    late = Hand(steep.model_copy(update={"link": ForceLink(delay_s=0.003)}))
    sample = [late.tick((0.004 * np.sin(0.02 * k), 0.0, 0.0)) for k in range(400)][-1]
    assert sample.permitted_n == pytest.approx(size(late.safety[0].permitted_n))


def test_the_slew_limit_ignores_the_force_added_by_the_passivity_controller():
    hand = Hand(WATER)
    hand.sweep(0.3, 600)
    hand.safety[0].passivity.balance_j = -5e-3
    hand.safety[0].passivity.longest_m = 0.01
    braked = [hand.tick((0.18 - 0.0003 * k, 0.0, 0.0)) for k in range(1, 12)]
    assert any(size(sample.device_force_n) > size(hand.safety[0].slewed_n) for sample in braked[-1:])
    hand.safety[0].passivity.balance_j = hand.safety[0].passivity.late_balance_j = 0.0
    slewed = hand.safety[0].slewed_n.copy()
    back = hand.tick((0.18 - 0.0003 * 12, 0.0, 0.0))
    assert size(back.device_force_n - slewed) <= 0.5 + 1e-12
    assert back.limiters & LIMITER_ENERGY


def test_the_slope_at_the_hand_is_scale_times_that_of_the_scene():
    model = pack(HONEY, capacity=0)
    assert model.parameters[0].slope_limit_nspm[1] == 5.3
    pack_into(model, HONEY.model_copy(update={"scale": 3.0}))
    assert model.parameters[0].slope_limit_nspm[2] == pytest.approx(21.5 / 3)


def test_drag_is_shortened_to_the_slope_limit_along_its_direction():
    v = np.array([0.3, -0.2, 0.1])
    table = simulate(TAR, moving(np.tile(v, (40, 1))))
    force, sent = vectors(table, "force")[-1], vectors(table, "device")[-1]
    assert size(force) > 53 / 30 * size(v)
    assert sent == pytest.approx(-53 / 30 * v, rel=1e-12)
    assert table.limiters[-1] == LIMITER_SLOPE


def test_a_drag_within_its_slope_is_sent_as_it_is():
    table = simulate(WATER, moving(np.tile([0.0, 0.5, 1.0], (40, 1))))
    assert (vectors(table, "device")[-1] == vectors(table, "force")[-1]).all()
    assert table.limiters[-1] == 0


@pytest.mark.compiled
def test_the_slope_limit_uses_the_relative_speed_and_keeps_a_push():
    still = moving(np.concatenate([np.tile([3.0, 0, 0], (1500, 1)), np.zeros((30, 3))]))
    table = simulate(WATER, still)
    assert table.fx_n[-1] > 1.0
    assert table.device_fx_n[-1] == table.fx_n[-1]


def test_between_two_liquids_the_slope_keeps_one_limit():
    halves = scene(
        liquid(20_000, id="left", region=Box(centre_m=(-1, 0, 0), size_m=(2, 9, 9))),
        liquid(20_000, id="right", region=Box(centre_m=(1, 0, 0), size_m=(2, 9, 9))),
        scale=30,
        knee=UNBENT,
    )
    x = np.linspace(-0.02, 0.06, 80)
    motion = Motion(
        np.arange(80) / 1000, np.column_stack([x, 0 * x, 0 * x]), velocity_mps=np.tile([0.5, 0.0, 0.0], (80, 1))
    )
    assert simulate(halves, motion).device_fx_n[20:] == pytest.approx(-53 / 30 * 0.5)


def test_the_force_is_clamped_to_the_limit_along_its_direction():
    v = np.array([4.0, 1.0, -2.0])
    table = simulate(scene(liquid(4500), scale=1), moving(np.tile(v, (60, 1))))
    assert vectors(table, "device")[-1] == pytest.approx(-8 * v / size(v))
    assert table.limiters[-1] == LIMITER_NORM


def test_a_limit_that_is_lowered_holds_at_once():
    hand = Hand(HONEY)
    assert size(hand.sweep(0.2, 300)[-1].device_force_n) > 4
    hand.safety[0].device_limit_n = 1.0
    assert size(hand.tick((0.0602, 0, 0)).device_force_n) == pytest.approx(1.0)


def test_the_force_changes_by_at_most_the_slew_limit_per_tick():
    v, across = np.tile([3.0, 0.0, 1.0], (30, 1)), np.tile([-1.0, 0.0, 3.0], (30, 1))
    table = simulate(WATER, moving(np.concatenate([v, across])))
    sent = vectors(table, "device")
    steps = np.linalg.norm(np.diff(sent, axis=0, prepend=np.zeros((1, 3))), axis=1)
    assert steps.max() == pytest.approx(SLEW_N)
    slewed = table.limiters & LIMITER_SLEW != 0
    assert slewed[0]
    assert slewed[30]
    assert (steps[~slewed] <= SLEW_N).all()
    assert steps[slewed] == pytest.approx(SLEW_N)


@pytest.mark.parametrize(("period_s", "mass_kg", "expected"), [(1e-3, 0.25, 1.5), (1e-3, 0.04, 0.6), (4e-3, 0.1, 6.0)])
def test_the_slew_limit_knows_rate_and_mass(period_s, mass_kg, expected):
    device = Dynamics(delay_s=0.0, count_m=38e-6, mass_kg=mass_kg)
    assert slew_limit_n(period_s, device) == pytest.approx(expected)
    scene = HONEY.model_copy(update={"rate_hz": 1 / period_s})
    assert pack(scene, dynamics=device).parameters[0].slew_n == pytest.approx(expected)


@pytest.mark.parametrize(("delay_s", "share"), [(1e-3, KALMAN_SLEW), (None, 1.0)])
def test_the_slew_limit_is_lower_with_the_kalman_filter_which_needs_a_measured_delay(delay_s, share):
    device, scene = Dynamics(delay_s), HONEY.model_copy(update={"velocity": Kalman()})
    assert slew_limit_n(1e-3, device, Kalman()) == pytest.approx(share * SLEW_N)
    assert pack(scene, dynamics=device).parameters[0].slew_n == pytest.approx(share * SLEW_N)


@pytest.mark.parametrize("velocity", [Ewma(), Kalman()])
def test_a_light_device_bears_less_damping_by_its_mass(velocity):
    scene = HONEY.model_copy(update={"velocity": velocity})
    whole, half = (
        pack(scene, dynamics=Dynamics(delay_s=0.0, count_m=38e-6, mass_kg=kg)).parameters[0] for kg in (0.1, 0.05)
    )
    assert LIGHTER > 1
    assert half.slope_limit_nspm == pytest.approx(0.5**LIGHTER * whole.slope_limit_nspm)


def test_after_an_energy_debt_the_force_changes_more_slowly():
    def steepest(gain):
        hand = Hand(WATER, rules=VERSIONS[2])  # no hand changes its speed so suddenly
        hand.sweep(0.001, 50)
        passivity = hand.safety[0].passivity
        passivity.gain = gain
        forces_n = [hand.tick((0.00005 + 0.002 * k, 0.0, 0.0)).device_force_n[0] for k in range(1, 60)]
        return np.abs(np.diff(forces_n)).max()

    assert steepest(1.0) == pytest.approx(SLEW_N, rel=1e-3)
    assert steepest(0.2) == pytest.approx(SLEW_N / 3, rel=0.1)


def test_the_force_fades_in_over_half_a_second_at_the_start():
    hand = Hand(HONEY, faded_in=False)
    moved = hand.sweep(0.2, 600)
    share = np.array([size(sample.device_force_n) / max(size(sample.force_n), 1e-9) for sample in moved])
    assert share[200:500] == pytest.approx(np.arange(200, 500) / 500)
    assert (share[501:] == 1).all()
    faded = [bool(sample.limiters & LIMITER_FADE) for sample in moved]
    assert faded == [True] * 500 + [False] * 100


@pytest.mark.parametrize("fade_s", [0.05, 0.3, 2.0])
def test_a_scene_fades_in_over_the_time_it_asks_for(fade_s):
    hand = Hand(HONEY)
    hand.sweep(0.1, 10)
    hand.model = pack(HONEY.model_copy(update={"fade_s": fade_s}))
    begin_scene(hand.safety[0])
    faded = [bool(sample.limiters & LIMITER_FADE) for sample in hand.sweep(0.1, 2100)]
    assert sum(faded) == pytest.approx(fade_s / 1e-3, abs=1)
    assert all(faded[: sum(faded)])


def test_after_a_start_no_scene_fades_in_faster_than_the_start():
    hand = Hand(HONEY.model_copy(update={"fade_s": 0.05}), faded_in=False)
    assert sum(bool(sample.limiters & LIMITER_FADE) for sample in hand.sweep(0.1, 700)) == pytest.approx(500, abs=1)


def test_a_scene_during_the_start_fade_begins_it_again():
    hand = Hand(HONEY, faded_in=False)
    hand.sweep(0.2, 400)
    begin_scene(hand.safety[0])
    after = hand.sweep(0.2, 520, start_m=0.08)
    assert [bool(sample.limiters & LIMITER_FADE) for sample in after[:500]] == [True] * 499 + [False]
