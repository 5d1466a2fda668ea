"""Which limits an interval breaks, by its samples: level, clipping, pace, and the difference of two delays."""

from typing import Any

import numpy as np
import pytest

from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_GLITCH, LIMITER_NORM, LIMITER_SATURATED, SAMPLE
from study_app.protocol.load import parse
from study_app.protocol.presented.presentation import Presentation
from study_app.protocol.trials.stimuli import Stimulated
from study_app.store.session_progress.delivered import (
    Delivered,
    beyond_limits,
    broken_interval_limits,
    broken_limits,
    broken_trial_limits,
    delivered_error,
    delivered_values,
    is_within_limits,
    judged_fields,
    late_device_text,
    late_device_ticks,
)
from tests.protocol.edited_studies import text_of

STUDY = text_of("delivered")
SLOW = (
    STUDY.replace("[tasks.follow]", '[conditions.late]\nliquid = "damper"\nforce_delay_ms = 100\n[tasks.follow]')
    .replace("[stimuli.damping]", '[stimuli.damping]\ncondition = "late"')
    .replace("= 8 }", "= 2 }")
)
DAMPING = Stimulated("damper", "damping_nspm", 8.0)
DELAY = Stimulated("damper", "delay_ms", 50.0)
VISCOSITY = Stimulated("damper", "viscosity_pa_s", 4.0)
LOSS = Stimulated("damper", "force_loss", 0.3)
FORCE_DELAY = Stimulated("damper", "force_delay_ms", 40.0)


def samples(b_nspm: float = 8.0, *, pace: float = 1.0, lasts_s: float = 4.0) -> Any:
    """Return an interval of the paced motion, its amplitude ``pace`` times the target's, through an exact damper."""
    recording = np.zeros(round(1000 * lasts_s), SAMPLE)
    t_s = np.arange(len(recording)) * 1e-3
    recording["time_ns"] = 5_000_000_000 + np.arange(len(recording)) * 1_000_000
    recording["position_m"][:, 0] = pace * 0.02 * np.sin(2 * np.pi * t_s)
    recording["force_n"][:, 0] = -b_nspm * pace * 0.02 * 2 * np.pi * np.cos(2 * np.pi * t_s)
    recording["device_force_n"] = recording["force_n"]
    return recording


def late(delay: int, b_nspm: float = 8.0) -> Any:
    """Return the interval with a force that is sent so many ticks late."""
    recording = samples(b_nspm)
    recording["device_force_n"][delay:] = recording["force_n"][: len(recording) - delay]
    recording["device_force_n"][:delay] = 0
    return recording


def weakened(share: float, until: int | None = None) -> Any:
    interval = samples()
    interval["device_force_n"][:until] *= share
    return interval


def clipped(at: int, interval: Any = None, limiter: int = LIMITER_NORM) -> Any:
    interval = samples() if interval is None else interval
    interval["limiters"][at] = limiter
    return interval


@pytest.mark.parametrize(
    ("task", "presented", "interval", "value", "broken"),
    [
        ("follow", DAMPING, samples(), 8.0, []),
        ("follow", DAMPING, samples(8.15), 8.15, []),
        ("follow", DAMPING, samples(7.85), 7.85, []),
        ("follow", DAMPING, samples(8.17), 8.17, ["level_error_percent"]),
        ("follow", DAMPING, samples(7.83), 7.83, ["level_error_percent"]),
        ("follow", VISCOSITY, weakened(0.985), 4.0, []),
        ("follow", VISCOSITY, weakened(0.97), 4.0, ["level_error_percent"]),
        ("follow", DELAY, weakened(0.97), None, []),
        ("follow", DAMPING, samples(pace=0.62), 8.0, []),
        ("follow", DAMPING, samples(pace=1.38), 8.0, []),
        ("follow", DAMPING, samples(pace=0.58), 8.0, ["pace_error_percent"]),
        ("follow", DAMPING, samples(pace=1.42), 8.0, ["pace_error_percent"]),
        ("stir", DAMPING, samples(pace=0.58), 8.0, []),
        ("stir", DAMPING, samples(pace=1.42), 8.0, []),
        ("follow", DAMPING, clipped(900), 8.0, []),
        ("follow", DAMPING, clipped(1100), 8.0, ["force_limit_n"]),
        ("follow", DELAY, clipped(1100), None, []),
        ("stir", DAMPING, clipped(400), 8.0, []),
        ("stir", DAMPING, clipped(600, limiter=LIMITER_SATURATED), 8.0, ["force_limit_n"]),
        ("stir", DELAY, clipped(600), None, []),
        ("stir", FORCE_DELAY, late(15), 15.0, []),
        ("stir", FORCE_DELAY, late(250), 250.0, []),
        ("follow", LOSS, late(3), 0.3, []),
        ("follow", LOSS, clipped(2000, late(3)), 0.3, ["force_limit_n"]),
    ],
)
def test_an_interval_is_judged_by_its_level_pace_and_clipping(
    task: str, presented: Stimulated, interval: Any, value: float | None, broken: list[str]
) -> None:
    """By the limits of 2 % of a level and 40 % of a pace; a force that is taken as requested is judged by its share."""
    protocol = parse(STUDY.encode(), "delivered.toml")
    delivery = delivered_values(protocol, presented, protocol.tasks[task], judged_fields(interval))
    sent, model = (np.linalg.norm(interval[name][1500:-500]) for name in ("device_force_n", "force_n"))
    speed_mps = interval["position_m"].max() * 2 * np.pi / np.sqrt(2)
    assert delivery.value_delivered == (None if value is None else pytest.approx(value, rel=2e-3))
    assert (delivery.force_share, delivery.pace_mps) == (
        pytest.approx(sent / model, rel=2e-3),
        pytest.approx(speed_mps, rel=0.02),
    )
    assert delivery.apparent_mass_kg is None or abs(delivery.apparent_mass_kg) < 0.01 or presented == LOSS
    assert [*broken_interval_limits(protocol.limits, presented, protocol.tasks[task], delivery)] == broken


def test_the_fade_refused_positions_and_lost_samples_are_not_judged() -> None:
    protocol = parse(STUDY.encode(), "delivered.toml")
    task, interval = protocol.tasks["follow"], weakened(0.0, until=1000)
    interval["position_m"][2000:2003], interval["limiters"][2000:2003] = 1.0, LIMITER_GLITCH
    delivery = delivered_values(protocol, DAMPING, task, judged_fields(interval))
    assert (delivery.value_delivered, delivery.force_share) == (pytest.approx(8, rel=1e-3), pytest.approx(1))
    assert [*broken_interval_limits(protocol.limits, DAMPING, task, delivery)] == []
    interval["limiters"] = 0
    delivery = delivered_values(protocol, DAMPING, task, judged_fields(interval))
    broken = [*broken_interval_limits(protocol.limits, DAMPING, task, delivery)]
    assert broken == ["level_error_percent", "pace_error_percent"]
    interval = late(30)
    interval["position_m"][2100], interval["limiters"][2100] = 1.0, LIMITER_GLITCH
    delivery = delivered_values(protocol, FORCE_DELAY, task, judged_fields(np.delete(interval, range(2500, 2510))))
    assert delivery.value_delivered == pytest.approx(30, abs=0.01)


def test_a_damping_is_measured_by_the_motion_that_its_late_force_belongs_to() -> None:
    """100 ms late, a damper of 2 N·s/m would measure as 2 cos 36° = 1.6 at 1 Hz."""
    protocol = parse(SLOW.encode(), "delivered.toml")
    presented = Stimulated("late", "damping_nspm", 2.0)
    delivery = delivered_values(protocol, presented, protocol.tasks["follow"], judged_fields(late(100, 2.0)))
    assert (delivery.value_delivered, delivery.force_share) == (pytest.approx(2, rel=1e-3), pytest.approx(1, rel=1e-3))


def test_the_lead_of_a_paced_task_is_not_judged() -> None:
    protocol = parse(STUDY.encode(), "delivered.toml")
    task = protocol.tasks["follow"]
    interval = weakened(0.5, until=round(1000 * task.lead_s))
    delivery = delivered_values(protocol, DAMPING, task, judged_fields(interval))
    assert task.lead_s > protocol.scene.fade_s
    assert (delivery.force_share, delivery.value_delivered) == (pytest.approx(1.0), pytest.approx(8.0, rel=0.01))


@pytest.mark.parametrize(
    ("errors_ms", "holds", "broken"),
    [
        ([6.0, 7.9], (False, True), []),
        ([6.0, 8.1], (False, True), ["level_error_ms"]),
        ([8.1, 6.0], (True, False), ["level_error_ms"]),
        ([6.0], (False, True), []),
        ([6.0, 60.0], (True, True), []),
        ([6.0, None], (False, True), []),
    ],
)
def test_delays_are_judged_by_the_difference_of_their_errors(
    errors_ms: list[float | None], holds: tuple[bool, ...], broken: list[str]
) -> None:
    limits = parse(STUDY.encode(), "delivered.toml").limits
    assert [
        *broken_trial_limits(limits, Presentation(10.0, 50.0, 0, (DELAY, DELAY)), holds, errors_ms, 1000.0)
    ] == broken
    assert [*broken_trial_limits(limits, Presentation(0.1, 8.0, 0, (DAMPING, DAMPING)), holds, errors_ms, 1000.0)] == []


@pytest.mark.parametrize("lag_ms", [0, 37, 255])
def test_the_delivered_delay_of_a_force_is_its_measured_lag(lag_ms: int) -> None:
    protocol = parse(STUDY.encode(), "delivered.toml")
    task, samples_late = protocol.tasks["follow"], judged_fields(late(lag_ms) if lag_ms else samples())
    delivery = delivered_values(protocol, FORCE_DELAY, task, samples_late)
    assert (delivery.value_delivered, delivery.force_share) == (
        pytest.approx(lag_ms, abs=0.2),
        pytest.approx(1, abs=1e-3),
    )
    assert delivered_values(protocol, FORCE_DELAY, task, samples_late, adjusted=True).value_delivered is None
    short = samples_late[: round(1000 * task.lead_s) + 200]
    assert delivered_values(protocol, FORCE_DELAY, task, short).value_delivered == pytest.approx(lag_ms, abs=0.5)
    resting = samples(0.0)
    assert delivered_values(protocol, FORCE_DELAY, task, judged_fields(resting)).value_delivered is None
    assert delivered_values(protocol, DELAY, task, samples_late).value_delivered is None


def test_a_delay_of_the_force_may_deviate_by_one_more_tick() -> None:
    """At 250 ticks per second by the limit of 2 ms and a tick of 4 ms; a visual delay by the limit."""
    limits, holds = parse(STUDY.encode(), "delivered.toml").limits, (True, False)
    for presented, permitted_ms in ((FORCE_DELAY, 6.0), (DELAY, 2.0)):
        due = Presentation(10.0, 50.0, 0, (presented, presented))
        for sign in (1, -1):
            inside, outside = ([sign * (permitted_ms + by_ms) + 7.0, 7.0] for by_ms in (-0.1, 0.1))
            assert [*broken_trial_limits(limits, due, holds, inside, 250.0)] == []
            assert [*broken_trial_limits(limits, due, holds, outside, 250.0)] == ["level_error_ms"]


@pytest.mark.parametrize(
    ("measured", "broken"),
    [
        ({"targets_reached": 5, "targets": 10}, ()),
        ({"targets_reached": 4, "targets": 10}, ("targets_reached", 40, 50)),
        ({"targets_reached": 0, "targets": 0}, ()),
        ({"targets_reached": None, "targets": 10, "withheld_share": None}, ()),
        ({"withheld_share": 0.05}, ()),
        ({"withheld_share": 0.06}, ("withheld_share", 6, 5)),
        ({"lateness_p99_ms": 2.0}, ()),
        ({"lateness_p99_ms": 2.1}, ("lateness_p99_ms", 2.1, 2)),
        ({"worst_gap_ms": 21.0}, ("worst_gap_ms", 21, 20)),
        ({"delay_error_p95_ms": -25.0}, ()),
        ({"delay_error_p95_ms": -26.0}, ("delay_error_p95_ms", -26, 25)),
        ({"first_frame_gap_ms": 251.0}, ("first_frame_gap_ms", 251, 250)),
        ({"worst_frame_gap_ms": 251.0}, ("worst_frame_gap_ms", 251, 250)),
    ],
)
def test_a_share_is_compared_with_a_limit_in_percent_and_targets_have_a_least_one(
    measured: dict[str, Any], broken: tuple[Any, ...]
) -> None:
    limits = {"lateness_ms": 2, "worst_gap_ms": 20, "delay_error_ms": 25, "frame_gap_ms": 250, "withheld_percent": 5}
    assert beyond_limits(measured, limits | {"targets_percent": 50}) == ((broken,) if broken else ())


def error(found: Any, fade_s: float = 0.3, b_nspm: float = 8.0) -> float | None:
    return delivered_error(judged_fields(found), 1000.0, fade_s, lambda _t_s, _x_m, v_mps: -b_nspm * v_mps)


def test_the_error_of_the_force_sent_is_its_difference_from_the_law_on_the_motion():
    assert error(samples()) == pytest.approx(0.0, abs=2e-3)
    weak, late, counted_samples = samples(), samples(), samples()
    weak["device_force_n"] *= 0.9
    assert error(weak) == pytest.approx(0.1, abs=2e-3)
    late["device_force_n"] = np.roll(late["force_n"], 10, axis=0)
    assert error(late) == pytest.approx(2 * np.sin(np.pi * 0.01), rel=0.03)
    counted_samples["position_m"] = np.rint(counted_samples["position_m"] / 38e-6) * 38e-6
    assert error(counted_samples) == pytest.approx(0.0, abs=0.01)
    quick, t_s = samples(), np.arange(4000) * 1e-3
    quick["position_m"][:, 1] = 0.002 * np.sin(2 * np.pi * 10 * t_s)
    quick["device_force_n"][:, 1] = -8.0 * 0.002 * 2 * np.pi * 10 * np.cos(2 * np.pi * 10 * t_s)
    assert error(quick) == pytest.approx(0.0, abs=0.02)  # the smoother passes it
    counted_samples["position_m"][1000] += 0.02
    counted_samples["limiters"][1000] = LIMITER_GLITCH
    assert error(counted_samples) == pytest.approx(0.0, abs=0.01)


def test_the_error_counts_after_the_fade_and_where_a_force_is_felt():
    faded = samples()
    faded["device_force_n"][:480] = 0.0
    assert error(faded) == pytest.approx(0.0, abs=2e-3)
    assert error(faded, fade_s=0.1) > 0.1
    assert error(samples(lasts_s=0.4)) is None
    assert error(samples(lasts_s=0.0)) is None
    assert error(samples(pace=0.001)) is None
    assert error(samples(pace=0.001), b_nspm=8000.0) is not None


def swing(*, lag: float, assumed: int = 1, acted_s: float = 2.0, force_n: float = 2.0) -> Any:
    """Return 2 s of a swing, 12° per tick, 20 mm/s, that its force neither drives nor brakes ``lag`` ticks later."""
    recording = np.zeros(2000, SAMPLE)
    ticks, turns = np.arange(len(recording)), np.pi / 15
    recording["position_m"][:, 0] = 0.02e-3 / turns * np.sin(turns * (ticks - 0.5))
    recording["device_force_n"][:, 0] = -force_n * np.sin(turns * (ticks + lag))
    recording["delay_ticks"] = assumed
    recording["limiters"][: round(1000 * acted_s)] = LIMITER_ENERGY
    return recording


@pytest.mark.parametrize(
    ("made", "ticks"),
    [
        ({"lag": 2.5}, 3),  # work at 2 ticks: -½ · 2 N · 0.02 m/s · sin 6° · 2 s = -4.2 mJ
        ({"lag": 2.9}, 3),
        ({"lag": 3.5}, 4),
        ({"lag": 3.5, "assumed": 2}, 4),
        ({"lag": 2.5, "assumed": 2}, None),  # one tick later than assumed is tolerated
        ({"lag": 1.5}, None),
        ({"lag": 2.5, "force_n": 0.5}, 3),  # -1.05 mJ
        ({"lag": 2.5, "force_n": 0.45}, None),  # -0.94 mJ
        ({"lag": 2.5, "acted_s": 0.09}, None),
        ({"lag": 9.0}, None),  # with every delay the force is a brake, so the hand drives the motion
    ],
)
def test_a_device_is_late_if_its_force_would_have_braked_an_oscillation_that_lasts(
    made: Any, ticks: int | None
) -> None:
    assert late_device_ticks(swing(**made), 1000.0) == ticks


def test_slow_motion_and_rejected_positions_do_not_make_a_device_late() -> None:
    samples_of_swing = swing(lag=2.5)
    samples_of_swing["device_force_n"] += 5.0
    samples_of_swing["position_m"][:, 1] = 0.1 * np.sin(2 * np.pi * 1e-3 * np.arange(len(samples_of_swing)))
    samples_of_swing["position_m"][700], samples_of_swing["limiters"][700] = 1.0, LIMITER_GLITCH
    assert late_device_ticks(samples_of_swing, 1000.0) == 3


def test_a_sentence_names_both_delays() -> None:
    assert late_device_text({"device_delay_ticks": 3, "loop_delay_ticks": 1}) == (
        "the device answered after 3 ticks, but the servo assumes 1 tick"
    )
    assert late_device_text({"loop_delay_ticks": 1}) == ""


def test_an_intervals_row_has_all_that_was_delivered_except_clipping() -> None:
    delivery = Delivered(value_delivered=7.9, force_share=0.98, apparent_mass_kg=0.01, pace_mps=0.08, clipped=True)
    row = {"value_delivered": 7.9, "force_share": 0.98, "apparent_mass_kg": 0.01, "pace_mps": 0.08}
    assert delivery.columns == row


def test_limits_are_named_as_in_the_study_once_and_only_if_it_states_them() -> None:
    limits = {"frame_gap_ms": 250.0, "targets_percent": 50.0, "withheld_percent": 5.0}
    broken = {"first_frame_gap_ms": 251.0, "worst_frame_gap_ms": 252.0, "targets_reached": 4, "targets": 10}
    assert broken_limits(broken | {"withheld_share": 0.06}, limits) == (
        "frame_gap_ms", "withheld_percent", "targets_percent",
    )  # fmt: skip
    assert broken_limits(broken, {}) == ()
    assert broken_limits({"targets_reached": 4, "targets": 10}, {"frame_gap_ms": 9.0}) == ()
    within = [is_within_limits(measured, limits) for measured in (broken, {"worst_frame_gap_ms": 250.0}, {"path": 1.0})]
    assert within == [False, True, None]


@pytest.mark.parametrize(("acted", "expected"), [(99, None), (100, 3)])
def test_a_controller_active_for_a_tenth_of_a_second_indicates_a_late_device(acted: int, expected: int | None) -> None:
    """At 1000 ticks per second; the limiters of the first sample belong to no step of the hand."""
    samples_of_swing = swing(lag=2.5, acted_s=0, force_n=20.0)
    samples_of_swing["limiters"][1 : acted + 1] = LIMITER_ENERGY
    assert late_device_ticks(samples_of_swing, 1000.0) == expected


def test_delays_longer_than_eight_ticks_are_unknown() -> None:
    assert [late_device_ticks(swing(lag=lag), 1000.0) for lag in (6.5, 7.5, 8.5)] == [7, 8, None]
