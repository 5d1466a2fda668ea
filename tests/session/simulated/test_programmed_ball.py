"""The ball of a preview: it does what the task asks for, within the tank, again and again."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from study_app.protocol.trials.tasks import AnyTask, Explore, Follow, Reach
from study_app.session.simulated import observers
from study_app.session.simulated.observers import ProgrammedBall
from study_app.session.simulated.participant import AdjustingObserver
from study_app.session.tasks import TankView, TaskView

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


def test_a_hidden_ball_is_drawn_only_during_the_lead() -> None:
    task = Follow(kind="follow", lead_s=1.0)
    ball = ProgrammedBall(task, TANK_M, hidden_after_lead=True)
    assert not ball.view(0.5).ball_hidden
    assert ball.view(1.5).ball_hidden
    assert ball.view(0.5).position_m == pytest.approx(task.target_m(0.5), abs=1e-4)


def test_a_stroke_goes_straight_from_rest_to_rest_at_its_mean_pace() -> None:
    begin_m, end_m, pace_mps = np.array([0.01, -0.02, 0.03]), np.array([0.05, 0.01, 0.03]), 0.1
    places_m = np.vstack([begin_m, observers._stroke(begin_m, end_m, pace_mps)])
    assert places_m[-1] == pytest.approx(end_m, abs=1e-15)
    share_of_way = (places_m - begin_m) @ (end_m - begin_m) / 0.05**2
    assert places_m == pytest.approx(begin_m + share_of_way[:, None] * (end_m - begin_m), abs=1e-15)
    steps = np.diff(share_of_way)
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


class Hand:
    """A simulated hand that keeps its orders."""

    workspace_m, moving = TANK_M, False

    def __init__(self) -> None:
        self.orders: list[Any] = []

    def reach_to(self, *place_m: float) -> None:
        self.orders.append(place_m)

    def follow(self, times_s: Any, places_m: Any) -> None:
        self.orders.append((times_s, places_m))


def test_a_hand_reaches_for_the_lit_target_after_a_reaction_and_again_if_the_ball_rests_outside_it() -> None:
    """Drawn numbers of 1 give the slowest reaction, of 0.35 s, and the largest error of aim, 0.3 times 5 mm."""
    hand = Hand()
    behaviour = observers.hand_behaviour(REACH, cast(Any, hand), lambda: 1.0, 0.0)
    inside_m, outside_m = np.array([-0.03, 0.0049, 0.0]), np.array([-0.03, 0.0051, 0.0])
    acts: tuple[tuple[float, int | None, Any, bool, int], ...] = (
        (10.0, None, outside_m, False, 0),
        (11.0, 0, outside_m, False, 0),
        (11.34, 0, outside_m, False, 0),
        (11.36, 0, outside_m, False, 1),  # it reaches
        (12.0, 0, outside_m, True, 1),  # and moves
        (12.5, 0, inside_m, False, 1),
        (13.0, 0, outside_m, False, 1),  # it rests outside the target, from now on
        (13.2, 0, inside_m, False, 1),
        (14.0, 0, outside_m, False, 1),
        (14.34, 0, outside_m, False, 1),
        (14.36, 0, outside_m, False, 2),  # and tries again after 0.35 s
        (20.0, 1, outside_m, False, 2),
        (20.36, 1, outside_m, False, 3),
    )
    for now_s, lit, place_m, moving, orders in acts:
        hand.moving = moving
        task = TaskView(lit=lit, reached=0, of=4, dwell=0.0, elapsed_s=now_s)
        assert not behaviour.act(now_s, TankView(place_m, task, 0))
        assert len(hand.orders) == orders, now_s
    targets = ((-0.03, 0.0, 0.0), (-0.03, 0.0, 0.0), (0.03, 0.01, 0.0))
    assert hand.orders == [pytest.approx([axis_m + 0.0015 for axis_m in target]) for target in targets]


def test_a_hand_follows_a_target_with_an_error_that_grows_within_a_second() -> None:
    hand, task = Hand(), Follow(kind="follow", amplitude_mm=30, frequency_hz=0.5, cycles=3)
    observers.hand_behaviour(task, cast(Any, hand), lambda: 1.0, 0.0)
    ((times_s, places_m),) = hand.orders
    assert (times_s[0], times_s[-1]) == (0.0, pytest.approx(task.limit_s, abs=0.005))
    for at_s, share in ((0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (2.5, 1.0)):
        row = int(np.searchsorted(times_s, at_s - 1e-9))
        error_m = places_m[row] - np.array(task.target_m(at_s))
        assert error_m == pytest.approx(share * 0.3 * task.radius_m, abs=1e-12)


def test_a_hand_rests_at_the_start_of_a_paced_task_and_else_returns_to_the_middle_within_a_quarter_second() -> None:
    hand, swing = Hand(), Follow(kind="follow", amplitude_mm=30, frequency_hz=0.5, cycles=3)
    observers.rest_hand(swing, cast(Any, hand))
    observers.rest_hand(Explore(kind="explore", min_s=5, max_s=20, instruction="-"), cast(Any, hand))
    assert hand.orders == [swing.start_m, (0.0, 0.0, 0.0, 0.25)]


@pytest.mark.parametrize("delays", [True, False])
def test_an_observer_without_noise_perceives_the_presented_value(delays: bool) -> None:
    observer: Any = SimpleNamespace(_attended=SimpleNamespace(delays=delays))
    neutral = AdjustingObserver._neutral.fget(observer)  # type: ignore[attr-defined]
    assert AdjustingObserver._perceived_magnitude(observer, 0.4, neutral) == 0.4


def test_a_hand_reaches_after_a_reaction_and_again_if_it_rests_outside_the_target() -> None:
    """With this draw the reaction takes 0.275 s, and the aim errs by nothing; then by 1.5 mm along each axis."""
    draws, reached = [0.5], list[tuple[float, tuple[float, ...]]]()
    device = SimpleNamespace(moving=False, reach_to=lambda *place_m: reached.append((now_s, place_m)))
    hand = observers.Reacher(REACH, cast(Any, device), lambda: draws[0], 0.0)
    left, right = REACH.targets_m
    near = (left[0], 0.005, 0.0)
    for now_s, lit, place_m, moving in (
        (1.0, 0, (0, 0, 0), False), (1.274, 0, (0, 0, 0), False), (1.275, 0, (0, 0, 0), False),
        (1.3, 0, (0, 0, 0), True), (2.0, 0, (0, 0, 0), True),
        (2.1, 0, (0, 0, 0), False), (2.3, 0, near, False), (2.5, 0, (0, 0, 0), False), (2.849, 0, (0, 0, 0), False),
        (2.851, 0, (0, 0, 0), False), (3.0, None, near, False), (4.0, 1, (0, 0, 0), False),
        (4.27, 1, (0, 0, 0), True), (4.28, 1, (0, 0, 0), True),
    ):  # fmt: skip
        device.moving = moving
        draws[0] = 1.0 if now_s > 4.2 else 0.5
        task = TaskView(lit=lit, reached=0, of=4, dwell=0.0, elapsed_s=now_s)
        assert hand.act(now_s, TankView(np.array(place_m, float), task, 0)) is False
    assert [(at_s, pytest.approx(place_m)) for at_s, place_m in reached] == [
        (1.275, left), (2.851, left), (4.28, tuple(axis + 0.0015 for axis in right)),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("least_s", "drawn", "leaves_s"), [(5.0, 0.0, 10.5), (5.0, 0.9, 11.4), (1.0, 0.9, 7.4), (10.0, 0.5, 17.0)]
)
def test_an_exploration_is_left_a_little_after_its_least_time(least_s: float, drawn: float, leaves_s: float) -> None:
    """It is left after an extra tenth to three tenths of the minimum time, or of 5 s if longer; it began at 5 s."""
    followed: list[Any] = []
    device = SimpleNamespace(workspace_m=(0.05, 0.03, 0.03), follow=lambda *path: followed.append(path))
    task = Explore(kind="explore", min_s=least_s, max_s=20, instruction="-")
    hand = observers.Explorer(task, cast(Any, device), lambda: drawn, 5.0)
    view = TankView(np.zeros(3), TaskView(lit=None, reached=0, of=None, dwell=0.0, elapsed_s=0.0), 0)
    assert [hand.act(at_s, view) for at_s in (leaves_s - 1e-6, leaves_s + 1e-6)] == [False, True]
    ((times_s, positions_m),) = followed
    assert times_s[-1] >= leaves_s - 5.0 - 0.005
    assert (np.abs(positions_m) <= 0.7 * np.array(device.workspace_m) + 1e-12).all()
