"""The ball of a preview: it does what the task asks for, within the tank, again and again."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from study_app.protocol.trials.tasks import AnyTask, Explore, Follow, Reach
from study_app.session.simulated import observers
from study_app.session.simulated.observers import ProgrammedBall
from study_app.session.simulated.participant import AdjustingObserver

TANK_M = (0.12, 0.1, 0.08)
REACH = Reach(
    kind="reach",
    targets_mm=((-30.0, 0.0, 0.0), (30.0, 10.0, 0.0)),
    radius_mm=5.0,
    dwell_s=0.8,
    count=4,
    instruction="-",
)


def test_the_ball_reaches_every_target_and_begins_anew() -> None:
    ball = ProgrammedBall(REACH, TANK_M)
    views = [ball.view(time_s) for time_s in np.arange(0.0, ball.duration_s, 0.02)]
    assert [view.task.reached for view in views] == sorted(view.task.reached for view in views)
    assert views[-1].task.reached == 4
    assert {view.task.lit for view in views} == {0, 1, None}
    assert max(view.task.dwell for view in views) > 0.9
    again = ball.view(ball.duration_s + 0.5)
    assert again.task == ball.view(0.5).task
    assert again.position_m == pytest.approx(ball.view(0.5).position_m)


@pytest.mark.parametrize(
    "task",
    [
        Explore(kind="explore", min_s=5, max_s=20, instruction="-"),
        Follow(kind="follow", amplitude_mm=30, frequency_hz=0.5, cycles=3),
        REACH,
    ],
)
def test_the_ball_stays_in_the_tank_and_ends_before_the_task_does(task: AnyTask) -> None:
    ball = ProgrammedBall(task, TANK_M)
    assert 1.0 < ball.duration_s < task.limit_s
    places_m = np.array([ball.view(time_s).position_m for time_s in np.arange(0.0, ball.duration_s, 0.05)])
    assert (np.abs(places_m) <= np.array(TANK_M) / 2).all()
    assert np.ptp(places_m[:, 0]) > 0.02


def test_a_hidden_ball_is_drawn_during_the_lead_alone() -> None:
    task = Follow(kind="follow", lead_s=1.0)
    ball = ProgrammedBall(task, TANK_M, hidden_after_lead=True)
    assert not ball.view(0.5).ball_hidden
    assert ball.view(1.5).ball_hidden
    assert ball.view(0.5).position_m == pytest.approx(task.target_m(0.5), abs=1e-4)


def test_a_stroke_goes_straight_from_rest_to_rest_at_its_mean_pace() -> None:
    begin_m, end_m, pace_mps = np.array([0.01, -0.02, 0.03]), np.array([0.05, 0.01, 0.03]), 0.1
    places_m = np.vstack([begin_m, observers._stroke(begin_m, end_m, pace_mps)])
    assert places_m[-1] == pytest.approx(end_m, abs=1e-15)
    done = (places_m - begin_m) @ (end_m - begin_m) / 0.05**2
    assert places_m == pytest.approx(begin_m + done[:, None] * (end_m - begin_m), abs=1e-15)
    steps = np.diff(done)
    assert (steps > 0).all()
    assert steps == pytest.approx(steps[::-1], abs=1e-12)
    assert steps.max() * len(steps) == pytest.approx(1.875, rel=0.01)
    assert steps[0] * len(steps) < 0.01
    assert len(steps) == observers._row_count(0.05 / pace_mps)


def test_the_assumed_hand_moves_smoothly_to_each_target_and_stays() -> None:
    each_s = observers._MOVE_S + REACH.dwell_s + observers._STAY_S
    times_s, positions_m = observers._reaching_path(REACH, 2 * each_s)
    left, right = np.array(REACH.targets_m)
    for after_s, place_m in (
        (0.0, 0 * left), (observers._MOVE_S / 2, left / 2), (observers._MOVE_S, left), (each_s, left),
        (each_s + observers._MOVE_S / 2, (left + right) / 2), (each_s + observers._MOVE_S, right),
    ):  # fmt: skip
        assert positions_m[np.searchsorted(times_s, after_s - 1e-9)] == pytest.approx(place_m, abs=3e-4)
    assert times_s[-1] == pytest.approx(2 * each_s, abs=2 / observers.RATE_HZ)


@pytest.mark.parametrize(("least_s", "stays_s"), [(2.0, 3.0), (10.0, 12.0), (19.5, 20.0)])
def test_an_explorer_leaves_a_little_after_the_least_time(
    monkeypatch: pytest.MonkeyPatch, least_s: float, stays_s: float
) -> None:
    monkeypatch.setattr(observers, "exploration", lambda *_: ())
    task: Any = SimpleNamespace(least_s=least_s, limit_s=20.0)
    device: Any = SimpleNamespace(follow=lambda *_: None, workspace_m=TANK_M)
    explorer, view = observers.Explorer(task, device, lambda: 0.5, 100.0), cast(Any, None)
    assert [explorer.act(100.0 + stays_s + late_s, view) for late_s in (-0.01, 0.01)] == [False, True]


@pytest.mark.parametrize("delays", [True, False])
def test_without_noise_an_observer_senses_what_is_presented(delays: bool) -> None:
    observer: Any = SimpleNamespace(_attended=SimpleNamespace(delays=delays))
    neutral = AdjustingObserver._neutral.fget(observer)  # type: ignore[attr-defined]
    assert AdjustingObserver._perceived_magnitude(observer, 0.4, neutral) == 0.4
