"""The groups of cases beside the sweep: what is in them, and that loops and samples are disturbed as they say."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from study_app.validation.stability.case_groups import (
    CASES,
    DISTURBED,
    FIRST_RELEASE_S,
    HANDLES_KG,
    KALMAN_CASES,
    LINKS,
    MASSES,
    PHASES,
    groups,
    sweep,
)
from study_app.validation.stability.closed_loop import SLOWER_S, begin, play
from study_app.validation.stability.device_bench import new_bench, new_trace, trace_of
from study_app.validation.stability.stability_cases import (
    DAMPER,
    GRIPS,
    PLANTS,
    Case,
    liquids,
    materials,
    of_physical2,
    parse,
)
from study_app.validation.stability.verdict import MISJUDGED_ALLOWANCE_J, judge, windows
from tests.haptics.scenes import COMPILED

pytestmark = [pytest.mark.nightly, pytest.mark.slow]

compiled = pytest.mark.skipif(not COMPILED, reason="many thousands of ticks")

OTHER_LIQUIDS = {"non-Newtonian liquids": materials, "liquids of physical2": of_physical2}


@pytest.fixture(scope="module")
def all_groups():
    return {group.name: group.cases for group in groups()}


def own_plants(all_groups):
    others = ("through", "kalman", *OTHER_LIQUIDS)
    return {name: it for name, it in all_groups.items() if not name.startswith(others)}


def test_the_kalman_filter_is_judged_in_each_group_of_estimators(all_groups):
    kalman = {name.removeprefix("kalman: "): it for name, it in all_groups.items() if name.startswith("kalman")}
    others = dict(all_groups) | {"first plant": sweep()}
    del others["velocity measured by the device"]
    assert set(kalman) == set(others) - {name for name in others if name.startswith("kalman")}
    for name, cases in kalman.items():
        assert {case.estimator for case in cases} == {"kalman"}
        assert len(cases) == len(set(cases)) == min(KALMAN_CASES, len(others[name]))
        alike = {dataclasses.replace(case, estimator="kalman") for case in others[name]}
        assert set(cases) <= alike


def test_groups_have_both_plants_all_liquids_and_light_handles(all_groups):
    for name, cases in own_plants(all_groups).items():
        assert len(cases) == len(set(cases)) >= 500, name
        assert {case.liquid for case in cases} == set(liquids()), name
        assert {case.plant for case in cases} == ({"arm"} if name.startswith("second plant") else set(PLANTS)), name
        assert {case.mass_kg for case in cases} == set(HANDLES_KG), name
    assert (min(HANDLES_KG), max(HANDLES_KG)) == (0.03, 0.25)
    assert all(case.hand in {"lets-go", "thrown"} for case in all_groups["second plant, let go"])
    assert not any(case.hand in {"lets-go", "thrown"} for case in all_groups["second plant, held"])


def test_groups_have_disturbed_samples_and_misjudged_delays(all_groups):
    assert {case.lost for case in all_groups["10 % of samples lost"]} == {0.1}
    assert {case.duplicated for case in all_groups["5 % of samples repeated"]} == {0.05}
    assert {case.burst_ms for case in all_groups["no sample for 20 ms, again and again"]} == {20.0}
    assert {case.delay - case.believed for case in all_groups["delay believed one tick too short"]} == {1}
    assert {case.delay - case.believed for case in all_groups["delay believed one tick too long"]} == {-1}
    assert {case.slows_to - case.delay for case in all_groups["device slower by a tick from 0.5 s on"]} == {1}
    for name, cases in all_groups.items():
        if name.removeprefix("kalman: ") in DISTURBED:
            continue
        misjudged = "tick" in name
        assert {case.misjudged for case in cases} == {misjudged}, name


def test_groups_have_outliers_jumps_and_delays_that_jump(all_groups):
    for name, choices in DISTURBED.items():
        for field, values in choices.items():
            assert {getattr(case, field) for case in all_groups[name]} == set(values), (name, field)
    for less, name in ((2, "delay two ticks too short, measured"), (3, "delay three ticks too short, measured")):
        assert {(case.delay - case.believed, case.slows_to - case.delay) for case in all_groups[name]} == {(less, 0)}
    for case in all_groups["let go in a gap of samples"]:
        assert 0.9 - 1e-3 * case.burst_ms <= case.release_s <= 0.9


def test_late_forces_have_delay_jitter_loss_and_the_strongest_damper(all_groups):
    cases = all_groups["late forces"]
    assert len(cases) == 1000
    assert sum(case.liquid == DAMPER for case in cases) > 450
    assert {case.hand for case in cases} == set(GRIPS)
    for name in ("force_delay_ms", "force_jitter_ms", "force_loss"):
        assert {getattr(case, name) for case in cases} == set(LINKS[name])
    assert max(case.force_delay_ms for case in cases) == 200
    assert sum(case.estimator == "kalman" for case in cases) > 400
    for case in cases:
        assert parse(str(case)) == case


def test_groups_have_misjudged_and_changing_masses(all_groups):
    for prefix in ("", "let go in mid-stroke, ", "kalman: "):
        half, more, doubled = (all_groups[f"{prefix}{name}"] for name in MASSES)
        assert {case.believed_kg / case.mass_kg for case in half} == {0.5}
        assert {round(case.believed_kg / case.mass_kg, 6) for case in more} == {1.25}
        assert {case.other_kg / case.mass_kg for case in doubled} == {2.0}
        assert {case.other_kg for case in (*half, *more)} == {case.believed_kg for case in doubled} == {0.0}


@pytest.mark.parametrize(
    ("masses", "stated_kg"),
    [({}, 0.1), ({"believed_kg": 0.15}, 0.15), ({"other_kg": 0.04}, 0.04), ({"other_kg": 0.2}, 0.1)],
)
def test_the_loop_gets_the_mass_that_the_device_states(masses, stated_kg):
    model = new_bench(Case(mass_kg=0.1, estimator="kalman", **masses), safe=True).model
    assert model.parameters[0].mass_kg == pytest.approx(stated_kg)


@compiled
@pytest.mark.parametrize("plant", PLANTS)
def test_mass_of_the_handle_changes_every_150_ms(plant):
    case = Case(liquid="water", scale=1.0, plant=plant, hand="thrown", speed_mps=0.4, mass_kg=0.1, other_kg=0.25)
    trace = trace_of(case)
    free_n = (trace.acting_n - case.viscous_nspm * trace.velocity_mps)[:-1]
    moved = np.einsum("ij,ij->i", free_n, free_n), np.einsum("ij,ij->i", free_n, np.diff(trace.velocity_mps, axis=0))
    for k in range(6):
        rows = slice(round(k * 150) + 2, round(k * 150) + 148)
        found_kg = moved[0][rows].sum() / moved[1][rows].sum() / case.rate_hz
        assert found_kg == pytest.approx((0.1, 0.25)[k % 2], rel=0.02), k


@pytest.mark.parametrize(("group", "sizes"), [
    ("non-Newtonian liquids", [2500, 1500, 1500, 1500, 480]),
    ("liquids of physical2", [3000, 1500, 1500, 1500, 576]),
])  # fmt: skip
def test_groups_of_other_liquids_have_each_held_misjudged_and_let_go(all_groups, group, sizes):
    found = {name: cases for name, cases in all_groups.items() if name.startswith(group)}
    assert [len(cases) for cases in found.values()] == sizes
    for cases in found.values():
        assert {case.liquid for case in cases} == set(OTHER_LIQUIDS[group]())
    assert [any(case.misjudged for case in cases) for cases in found.values()] == [False, True, True, True, False]
    released = all_groups[f"{group}, let go in mid-stroke"]
    assert {(case.hand, case.plant, case.mass_kg) for case in released} == set(
        itertools.product(["lets-go"], PLANTS, HANDLES_KG)
    )


@compiled
def test_a_sample_of_closed_loops_in_other_liquids_is_stable():
    sampled = [group for group in groups(count=25) if group.name.startswith(tuple(OTHER_LIQUIDS))]
    unstable = [case for group in sampled for case in group.cases if not judge(case, safe=True).stable]
    assert not unstable


def test_groups_through_the_driver_have_all_liquids_within_its_workspace(all_groups):
    held, released = (cases for name, cases in all_groups.items() if name.startswith("through the Falcon's driver"))
    for cases in (held, released):
        assert len(cases) == len(set(cases)) >= 300
        assert {case.liquid for case in cases} == set(liquids())
        assert {(case.plant, case.delay, case.noise_um, case.missed) for case in cases} == {("falcon", 1, 0.0, 0.0)}
        assert min(case.mass_kg for case in cases) == 0.1
        assert not any(case.motion == "stroke" for case in cases)
    assert {case.hand for case in held} == {"light", "middle", "firm"}
    assert {case.hand for case in released} == {"lets-go"}
    for _, cases in itertools.groupby(released, key=lambda case: (case.liquid, case.mass_kg)):
        assert len(tuple(cases)) == PHASES


def test_releases_come_at_every_phase_for_each_plant_liquid_and_handle(all_groups):
    found = all_groups["let go in mid-stroke"]
    for _, cases in itertools.groupby(found, key=lambda case: (case.plant, case.liquid, case.mass_kg)):
        phases = [
            (case.release_s - FIRST_RELEASE_S) * case.speed_mps / (2 * math.pi * 0.5e-3 * case.way_mm) for case in cases
        ]
        assert phases == pytest.approx(np.arange(PHASES) / PHASES, abs=1e-3)
    assert {case.scale for case in found if case.liquid == "light_oil"} == {liquids()["light_oil"].scale}


def test_each_release_is_judged_over_0_4_s_before_and_after_it(all_groups):
    for case in all_groups["let go in mid-stroke"]:
        held, free = windows(case)
        assert min(held[1] - held[0], free[1] - free[0]) > 0.4 - 1e-9
        bench = new_bench(case, safe=True)
        assert bench.loop.moving_s >= bench.loop.release_s == case.release_s


def test_groups_follow_from_the_seed_and_can_be_thinned_out(all_groups):
    assert {group.name: group.cases for group in groups()} == all_groups
    assert groups("another")[0].cases != groups()[0].cases
    few = groups(count=10)
    assert {len(group.cases) for group in few} == {10}
    assert max(map(len, all_groups.values())) > CASES


def test_every_case_is_a_line_that_reproduces_it(all_groups):
    for cases in all_groups.values():
        assert all(parse(str(case)) == case for case in cases[::50])


def test_lines_of_earlier_versions_still_describe_the_same_case():
    old = "liquid=syrup scale=20 rate_hz=500 delay=2 hand=thrown motion=stroke speed_mps=0.6 mass_kg=0.25 missed=0.02"
    case = parse(old)
    assert case.believed_delay == case.delay == 2
    assert (case.plant, case.lost, case.duplicated, case.burst_ms, case.slows_to) == ("handle", 0.0, 0.0, 0.0, -1)


def samples(case, ticks):
    """Return of each tick whether its sample is new, and its position."""
    bench, trace = new_bench(case, safe=True), new_trace(case)
    begin(bench.loop, bench.handle)
    fresh, places = [], []
    for k in range(ticks):
        bench.run(trace[: k + 1], k, math.inf)
        fresh.append(bool(bench.sample[0].fresh))
        places.append(bench.sample[0].position_m.copy())
    return np.array(fresh), np.array(places)


@compiled
def test_lost_samples_are_not_new_and_repeat_the_last_position():
    fresh, places = samples(Case(quantum_um=0.0, noise_um=5.0, lost=0.1), 1800)
    assert 1 - fresh.mean() == pytest.approx(0.1, abs=0.03)
    still = (np.diff(places, axis=0) == 0).all(axis=1)
    assert (still == ~fresh[1:]).all()


@compiled
def test_duplicated_samples_are_new_and_repeat_the_last_position():
    fresh, places = samples(Case(quantum_um=0.0, noise_um=5.0, duplicated=0.05), 1800)
    assert fresh.all()
    still = (np.diff(places, axis=0) == 0).all(axis=1)
    assert still.mean() == pytest.approx(0.05, abs=0.02)


@compiled
def test_bursts_leave_twenty_milliseconds_without_a_sample():
    fresh, _ = samples(Case(burst_ms=20.0), 1700)
    runs = [len(list(ticks)) for new, ticks in itertools.groupby(fresh) if not new]
    assert len(runs) == 5
    assert all(19 <= run <= 20 for run in runs)


@compiled
def test_outliers_and_jumps_are_as_frequent_and_as_large_as_the_case_says():
    case = Case(quantum_um=0.0, hand="firm", speed_mps=0.01)
    _, true_m = samples(case, 1700)
    _, places_m = samples(dataclasses.replace(case, outliers=0.02, outlier_mm=5.0), 1700)
    off_m = np.abs(places_m - true_m).max(axis=1)
    assert (off_m > 5e-4).mean() == pytest.approx(0.02, abs=0.01)
    assert 4e-3 < off_m.max() < 6e-3
    fresh, places_m = samples(dataclasses.replace(case, burst_ms=20.0, jump_mm=5.0), 1700)
    steps_m = np.abs(np.diff(places_m[fresh], axis=0)).max(axis=1)
    assert (steps_m > 2e-4).sum() == 5
    assert steps_m.max() < 1.1e-2


@compiled
@pytest.mark.parametrize(
    ("believed", "ticks"), [(-1, [(0.0, 1), (0.51, 1), (0.55, 3), (1.2, 3)]), (0, [(0.0, 0), (0.1, 1)])]
)
def test_a_device_that_measures_its_delay_is_believed(believed, ticks):
    case = Case(slows_to=3, swaps=1, believed=believed)
    bench, trace = new_bench(case, safe=True), new_trace(case)
    begin(bench.loop, bench.handle)
    row = 0
    for time_s, expected in ticks:
        row = bench.run(trace, row, time_s + 0.001)
        assert bench.safety[0].delay_ticks == expected
    bench.run(trace, row, 1.8)
    delays = {round(one.t_s, 3): one.delay for one in trace}
    assert [delays[t] for t in (0.2, 0.5, 0.55, 0.7, 0.8, 1.0)] == [1, 3, 3, 1, 3, 1]


@compiled
@pytest.mark.parametrize("estimator", ["ewma", "kalman"])
@pytest.mark.parametrize(
    "fault",
    [
        {"lost": 0.1},
        {"duplicated": 0.05},
        {"burst_ms": 20.0},
        {"missed": 0.02},
        {"outliers": 0.02, "outlier_mm": 2.0},
        {"burst_ms": 8.0, "jump_mm": 5.0},
    ],
)
def test_motion_is_played_with_the_samples_and_the_forces_that_the_loop_had(fault, estimator):
    case = Case(speed_mps=0.6, jitter=0.2, estimator=estimator, **fault)
    bench, trace = new_bench(case, safe=False), new_trace(case)
    begin(bench.loop, bench.handle)
    first = bench.run(trace, 0, 0.3)
    again = bench.copy()
    trace = trace[: bench.run(trace, first, 1.0)]
    played = trace[first:].copy()
    records = again.model, again.safety[0], again.sample[0], again.handle, again.pace, again.loop
    play(*records, played, trace.position_m[first:].copy())
    assert np.abs(played.sent_n).max() > 0.1
    assert again.model.state[0].kalman.distrusted == bench.model.state[0].kalman.distrusted
    assert np.abs(played.sent_n - trace.sent_n[first:]).max() == 0.0


@compiled
def test_hand_that_breaks_the_wake_at_each_reversal_is_as_restless_without_feedback():
    """The wake of light oil turns the force at each reversal of 4 Hz, with the motors off more than with them."""
    released = "liquid=light_oil hand=lets-go motion=sine speed_mps=0.75398 release_s=0.7 plant=arm"
    held = dataclasses.replace(parse(released), hand="middle")
    for case in (parse(released), held):
        verdict = judge(case, safe=True)
        assert verdict.stable, verdict


SHORT = "hand=lets-go motion=sine viscous_nspm=0 plant=arm delay={} believed={} liquid={} scale={} mass_kg={} "
TAR, THROWN_TAR = "speed_mps=0.1885 release_s=1.01667", "hand=thrown speed_mps=0.3 quantum_um=60 noise_um=30"


@compiled
@pytest.mark.parametrize(
    "line",
    [
        SHORT.format(1, 0, "physical_tar", 3, 0.1) + TAR,  # accounted as a loop without delay
        SHORT.format(2, 1, "light_oil", 10, 0.03) + "speed_mps=0.37699 release_s=0.85",  # a swing paid by the motion
        SHORT.format(2, 1, "dense", 10, 0.1) + "speed_mps=0.1885 release_s=0.93333",
        SHORT.format(2, 1, "dense", 10, 0.03) + "speed_mps=0.37699 release_s=0.93333",  # LIGHTER
        SHORT.format(2, 1, "light_oil", 10, 0.05)
        + "speed_mps=0.37699 release_s=1.05833 viscous_nspm=0.5 estimator=kalman",  # LIGHTER
        SHORT.format(3, 2, "physical_tar", 3, 0.05)
        + "rate_hz=500 estimator=kalman motion=reaches "
        + THROWN_TAR,  # KALMAN_SHARE
        SHORT.format(2, 1, "physical_tar", 1, 0.2) + "motion=stroke speed_mps=1 estimator=kalman",  # KALMAN_SLEW
    ],
)
def test_a_delay_one_tick_longer_than_believed_leaves_the_loop_stable(line):
    verdict = judge(parse(line), safe=True)
    assert verdict.stable, verdict
    assert verdict.balance_j > -MISJUDGED_ALLOWANCE_J


@compiled
@pytest.mark.parametrize(
    "line",
    [
        "liquid=physical_tar scale=3 delay=2 hand=light motion=stroke speed_mps=0.6 mass_kg=0.05 viscous_nspm=0.5 "
        "quantum_um=20 noise_um=30 jitter=0.2 missed=0.02 plant=arm",
        "liquid=syrup scale=10 rate_hz=500 delay=2 hand=firm motion=stroke speed_mps=0.6 mass_kg=0.25 viscous_nspm=0 "
        "plant=arm",
    ],
)
def test_repeated_samples_do_not_make_the_force_restless(line):
    verdict = judge(parse(f"{line} duplicated=0.05 estimator=kalman"), safe=True)
    assert verdict.stable, verdict
    assert verdict.fast_n < verdict.played_n + 0.02


@compiled
@pytest.mark.parametrize("plant", PLANTS)
def test_slower_device_acts_with_the_force_of_one_tick_before(plant):
    trace = trace_of(Case(plant=plant, delay=1, slows_to=2, quantum_um=0.0))
    late = int(np.searchsorted(trace.t_s, SLOWER_S))
    assert set(trace.delay[: late - 1]) == {1}
    assert set(trace.delay[late + 1 :]) == {2}
    for first, last, delay in ((10, late - 1, 1), (late + 5, 1500, 2)):
        sent_n = np.clip(trace.sent_n[first - delay : last - delay], -8, 8)
        assert np.abs(trace.acting_n[first:last] - sent_n).max() <= 0.5 * 8 / 2048 + 1e-12


@compiled
@pytest.mark.parametrize("plant", PLANTS)
def test_misjudged_delay_permits_ten_millijoule(plant):
    case = Case(liquid="water", plant=plant, hand="lets-go", speed_mps=0.1)
    assert judge(dataclasses.replace(case, believed=0), safe=True).permitted_j == -MISJUDGED_ALLOWANCE_J
    assert judge(case, safe=True).permitted_j > -MISJUDGED_ALLOWANCE_J


@compiled
@pytest.mark.parametrize("plant", PLANTS)
def test_hand_lets_go_at_the_moment_that_the_case_says(plant):
    case = Case(liquid="water", scale=1.0, plant=plant, hand="lets-go", motion="sine", release_s=0.83, speed_mps=0.4)
    trace = trace_of(case)
    accelerations = np.diff(trace.velocity_mps[:, 0]) * case.rate_hz
    free = (trace.acting_n - case.viscous_nspm * trace.velocity_mps)[:-1, 0] / case.mass_kg
    held = trace.t_s[1:] < case.release_s
    assert np.abs(accelerations - free)[held][-10:].min() > 0.3
    assert np.abs(accelerations - free)[~held].max() < 0.02


@compiled
def test_second_plant_is_the_one_that_moves_the_handle():
    first, second = (trace_of(Case(hand="firm", plant=plant)) for plant in PLANTS)
    apart_m = np.abs(first.position_m - second.position_m).max()
    assert 1e-3 < apart_m < 0.05
