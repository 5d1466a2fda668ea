"""The tank: what is drawn and painted anew, when a view counts as painted, the words below, what moves."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QPoint, QPointF
from PySide6.QtGui import QColor, QRegion
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.tank.frame import changes
from study_app.gui.participant.tank.onset_patch import OnsetPatch
from study_app.gui.participant.tank.photodiode_patch import PATCH
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import Interval
from tests.gui.drawn import drawn_by, shown
from tests.gui.small import explore, follow, follow_view, reach, task_page, view

Make = Callable[..., TankWidget]
FULL = (1366, 768)
MIDDLE = (0.0, 0.0, 0.0)
WORKSPACE_M = (0.1, 0.06, 0.06)


@pytest.fixture
def tank(made: Make) -> TankWidget:
    return made()


@pytest.fixture
def swing(made: Make) -> TankWidget:
    return made(task_page(follow()))


def hint(tank: TankWidget) -> Any:
    return tank.things["hint"].state


def ball_of(tank: TankWidget, position_m: tuple[float, float, float]) -> Any:
    tank.show_view(view(position_m, lit=0))
    assert tank.ball is not None
    return tank.ball


def test_ball_is_drawn_where_the_view_says(tank: TankWidget) -> None:
    for position in (MIDDLE, (-0.04, 0.02, -0.02), (0.03, -0.02, 0.02)):
        place = ball_of(tank, position).middle.toPoint()
        colour = tank.grab().toImage().pixelColor(place)
        assert colour.red() > 170
        assert colour.red() > colour.green() > colour.blue() + 20


@pytest.mark.slow
def test_right_is_right_up_is_up_near_is_large_and_the_ball_stays_in_the_glass(tank: TankWidget) -> None:
    @settings(max_examples=30)
    @given(*[st.floats(-0.98, 0.98)] * 3)
    def place(x: float, y: float, z: float) -> None:
        here = tuple(share * size / 2 for share, size in zip((x, y, z), WORKSPACE_M, strict=True))
        ball = ball_of(tank, here)  # type: ignore[arg-type]
        assert tank.rect().adjusted(20, 20, -20, -20).contains(ball.middle.toPoint())
        assert ball.floor.y() >= ball.middle.y()
        assert ball_of(tank, (here[0] + 0.001, *here[1:])).middle.x() > ball.middle.x()
        assert ball_of(tank, (here[0], here[1] + 0.001, here[2])).middle.y() < ball.middle.y()

    place()
    near, far = ball_of(tank, (0, 0, 0.028)), ball_of(tank, (0, 0, -0.028))
    assert near.radius > far.radius * 1.1
    assert near.floor.y() > far.floor.y() + 20
    assert near.haze < far.haze


@pytest.mark.parametrize("other_z_mm", [-25, 25])
def test_the_nearer_of_ball_and_target_is_painted_over_the_other(made: Make, other_z_mm: int) -> None:
    """Where the lit ring crosses the ball, the ball's colour shows if it is nearer, else the pale ring."""
    tank = made(task_page(reach(targets_mm=((-30, 0, 0), (30, 0, other_z_mm)))))
    tank.show_view(view((0, 0.02, 0), lit=0))
    assert tank.camera is not None
    target = tank.targets[0]
    ring = target.middle + QPointF(target.radius, 0)
    seen = []
    for z in (0.02, -0.02):
        flat = tank.camera.scale((0, 0, z))
        centre = tank.camera.point((0, 0, z))
        ball = ball_of(tank, ((ring.x() - centre[0]) / flat, (centre[1] - ring.y()) / flat, z))
        assert (ball.middle - ring).manhattanLength() < ball.radius / 2
        assert (ball.depth_m < target.depth_m) is (z > 0)
        seen.append(tank.grab().toImage().pixelColor(ring.toPoint()))
    near, far = seen
    assert near.red() > near.blue() + 40
    assert far.blue() > near.blue() + 40


def test_lit_and_dim_targets_differ_and_the_dwell_arc_closes_clockwise_from_the_top(tank: TankWidget) -> None:
    tank.show_view(view((0, 0.02, 0), lit=0))
    left = shown(tank)
    tank.show_view(view((0, 0.02, 0), lit=1))
    right = shown(tank)
    target = tank.targets[0]
    x, y = round(target.middle.x()), round(target.middle.y())
    assert left[y, round(target.middle.x() + target.radius)].min() > 120  # a pale ring
    box = np.s_[y - 60 : y + 60, x - 60 : x + 60]
    assert left[box].mean() > right[box].mean() + 4
    tank.show_view(view((0, 0.02, 0), dwell=0.5))
    target = tank.targets[1]
    y, x, radius = target.middle.y(), target.middle.x(), target.radius
    right_side, left_side = (round(y), round(x + radius)), (round(y), round(x - radius))
    half = shown(tank)
    assert half[right_side].min() > 235
    assert half[left_side].min() < 235
    tank.show_view(view((0, 0.02, 0), dwell=1.0))
    assert shown(tank)[left_side].min() > 235


@pytest.mark.parametrize(
    ("page", "views"),
    [
        (
            task_page(),
            (
                view((0.01, 0.0, 0.01), lit=1, dwell=0.2, reached=3),
                view((0.012, 0.001, 0.01), lit=1, dwell=0.25, reached=3),
                view((0.012, 0.001, 0.01), lit=1, dwell=0.25, reached=3),
                view((-0.03, -0.02, -0.02), lit=0, dwell=0.0, reached=4),
            ),
        ),
        (task_page(follow()), (follow_view(-0.02), follow_view(0.01))),
    ],
)
def test_what_changed_lies_inside_the_region_painted_anew(made: Make, page: Any, views: tuple[Any, ...]) -> None:
    tank = made(page)
    tank.show_view(views[0])
    for following in views[1:]:
        before, things = shown(tank), tank.things
        tank.show_view(following)
        region = changes(things, tank.things)
        differs = np.argwhere((before != shown(tank)).any(axis=2))
        assert [(x, y) for y, x in differs if not region.contains(QPoint(int(x), int(y)))] == []
    assert len(differs) > 0


def test_painted_comes_once_a_view_before_anything_else_is_done(tank: TankWidget, qtbot: Any) -> None:
    qtbot.waitExposed(tank)
    told: list[int] = []
    tank.painted.connect(told.append)
    for sample_ns in (*range(1, 6), 5_123_456_789_012):
        tank.show_view(view((0.004 * min(sample_ns, 6), 0.0, 0.0), sample_ns=sample_ns))
        assert told[-1] == sample_ns, "without a turn of the event loop"
    tank.repaint()  # as when the window is uncovered
    QApplication.processEvents()
    assert told == [1, 2, 3, 4, 5, 5_123_456_789_012]
    before = tank.things
    with qtbot.waitSignal(tank.painted, timeout=1000):  # nothing changed, but it is a frame
        tank.show_view(view((0.024, 0.0, 0.0)))
    assert changes(before, tank.things) == QRegion()


@pytest.mark.slow
def test_a_view_that_nobody_can_see_is_told_of_when_it_is_seen(tank: TankWidget, qtbot: Any) -> None:
    told: list[int] = []
    tank.painted.connect(told.append)
    tank.show_view(view(sample_ns=1))
    tank.hide()
    tank.show_view(view(sample_ns=2))
    tank.show_view(view(sample_ns=3))
    assert told == [1]
    with qtbot.waitSignal(tank.painted, timeout=1000):
        tank.show()
    assert told == [1, 3]


def test_resize_draws_a_new_tank_of_the_new_size(tank: TankWidget) -> None:
    first = ball_of(tank, MIDDLE)
    for size in ((1024, 640), FULL):
        tank.resize(*size)
        last = ball_of(tank, MIDDLE)
    assert last.radius > first.radius
    assert shown(tank).shape == (768, 1366, 3)


def test_an_exploration_may_be_left_after_its_least_time_and_no_other_task(made: Make) -> None:
    tank = made(task_page(explore()))
    assert not tank.may_leave
    tank.show_view(view(lit=None, elapsed_s=29.9))
    assert not tank.may_leave
    early = shown(tank)
    tank.show_view(view(lit=None, elapsed_s=30.0))
    assert tank.may_leave
    assert (early != shown(tank)).any()  # the hint under the tank
    for page, seen in ((task_page(), view(elapsed_s=1000)), (task_page(follow()), follow_view(elapsed_s=4.1))):
        other = made(page)
        other.show_view(seen)
        assert not other.may_leave


COUNTING, TIMED = reach(timeout_s=60), reach(count=None, duration_s=30)


@pytest.mark.parametrize(
    ("task", "seen", "said"),
    [
        (explore(), view(lit=None, elapsed_s=109.0), "Press the space bar to go on"),
        (explore(), view(lit=None, elapsed_s=110.5), "Press the space bar to go on · 10 s left"),
        (explore(), view(lit=None, elapsed_s=120.0), "Time is up"),
        (COUNTING, view(elapsed_s=49.0), ""),
        (COUNTING, view(elapsed_s=50.0), "10 s left"),
        (COUNTING, view(elapsed_s=59.5), "1 s left"),
        (COUNTING, view(elapsed_s=60.0), "Time is up"),
        (TIMED, view(elapsed_s=3.0), "27 s left"),
        (TIMED, view(elapsed_s=30.0), "Time is up"),
        (follow(), follow_view(elapsed_s=4.1), ""),
    ],
)
def test_last_ten_seconds_of_a_limit_are_counted_down(made: Make, task: Any, seen: Any, said: str) -> None:
    tank = made(task_page(task))
    tank.show_view(seen)
    assert hint(tank) == said


@pytest.mark.parametrize(
    ("position_m", "said"),
    [
        ((0.03, 0.0, 0.0), ""),
        ((0.03, 0.0, 0.02), "A little further away: wheel forwards"),
        ((0.035, 0.004, -0.02), "A little nearer: wheel backwards"),
        ((-0.03, 0.0, 0.02), ""),
    ],
)
def test_depth_that_the_wheel_lost_is_told_where_the_mouse_is_the_device(
    made: Make, position_m: Any, said: str
) -> None:
    for by_mouse in (True, False):
        tank = made(size=FULL, by_mouse=by_mouse)
        tank.show_view(view(position_m))
        assert hint(tank) == (said if by_mouse else "")


@pytest.mark.parametrize("language", LANGUAGES)
def test_depth_and_the_end_of_the_time_are_told_in_every_language(made: Make, language: str) -> None:
    said = words(language)
    tank = made(task_page(TIMED), FULL, language, by_mouse=True)
    tank.show_view(view((0.03, 0, 0.02)))
    assert hint(tank) == f"{said.further_away} · {said.seconds_left.format(seconds=18)}"
    tank.show_view(view(elapsed_s=30.0))
    assert hint(tank) == said.time_is_up


@pytest.mark.parametrize("by_mouse", [True, False])
def test_with_the_mouse_there_is_no_force_to_switch_off(made: Make, by_mouse: bool) -> None:
    texts = [one.text for one in drawn_by(made(size=FULL, by_mouse=by_mouse))]
    assert ("Pause" in texts) is by_mouse
    assert any("force" in text for text in texts) is not by_mouse


def test_a_moving_target_is_drawn_where_the_view_says(swing: TankWidget) -> None:
    for x in (-0.02, 0.0, 0.015):
        swing.show_view(follow_view(x))
        (target,) = swing.targets
        assert swing.camera is not None
        assert target.middle.x() == pytest.approx(swing.camera.point((x, 0.0, 0.0))[0])
        on_ring = (round(target.middle.y()), round(target.middle.x() + target.radius))
        assert shown(swing)[on_ring].min() > 120
    assert swing.accessibleName() == "Keep the ball on the target"


def test_a_hidden_ball_is_not_drawn_and_nothing_tells_where_it_is(swing: TankWidget) -> None:
    swing.show_view(follow_view(ball=(0.03, 0.01, 0)))
    with_ball = shown(swing)
    swing.show_view(follow_view(ball=(0.03, 0.01, 0), ball_hidden=True))
    hidden = shown(swing)
    assert (with_ball != hidden).any()
    assert {"ball", "shadow", "plumb"}.isdisjoint(swing.things)
    assert "target 0" in swing.things
    swing.show_view(follow_view(ball=(-0.03, -0.01, 0.01), ball_hidden=True))
    assert (hidden == shown(swing)).all()


def interval(*, resting: bool, number: int = 2) -> Any:
    announced = "Next: the second" if resting else "Second of 2"
    return task_page(follow(), interval=Interval(number, 2, resting, announced))


@pytest.mark.parametrize(
    ("ball", "by_mouse", "said"),
    [
        ((0.02, 0.0, 0.0), False, "Move the ball back into the target"),
        ((0.003, 0.0, 0.0), False, ""),
        ((0.0, 0.0, 0.01), True, words("en").further_away),
        ((0.0, 0.0, -0.01), True, words("en").nearer),
    ],
)
def test_a_rest_says_what_it_waits_for(made: Make, ball: Any, by_mouse: bool, said: str) -> None:
    tank = made(interval(resting=True), FULL, by_mouse=by_mouse)
    tank.show_view(follow_view(ball=ball, elapsed_s=0.0))
    assert {"ball", "target 0"} <= set(tank.things)
    assert hint(tank) == said


def test_the_ball_stays_drawn_from_an_interval_to_its_rest_and_is_no_frame_of_it(made: Make) -> None:
    tank = made(interval(resting=False, number=1))
    told: list[int] = []
    tank.painted.connect(told.append)
    QApplication.processEvents()
    tank.show_view(follow_view(0.02, (0.02, 0.0, 0.0), elapsed_s=3.9, sample_ns=7, ball_hidden=True))
    tank.turn_to(interval(resting=True))
    assert tank.ball is not None
    assert tank.targets[0].middle.x() == pytest.approx(tank.width() / 2, abs=1)
    assert not tank.time_is_up
    assert told == [7]


def onsets(speeds_mps: list[float], step_ns: int = 10_000_000) -> list[bool]:
    patch, place, lit = OnsetPatch(), 0.0, []
    patch.follow((0, 0, 0), 0)
    for index, speed in enumerate(speeds_mps, 1):
        place += speed * step_ns / 1e9
        lit.append(patch.follow((place, 0, 0), index * step_ns))
    return lit


def test_the_patch_toggles_once_when_a_movement_begins_after_a_rest_and_not_for_drift() -> None:
    assert onsets([0, 0, 0.1, 0.2, 0.1]) == [False, False, True, True, True]
    assert onsets([0.1, 0, 0, 0.1]) == [True] * 4
    assert onsets([0.1, *[0] * 10, 0.1])[-1] is False
    assert not any(onsets([0.005] * 40))
    assert onsets([0, 0, 0.012, 0.05])[-1] is True


def test_patch_in_the_corner_turns_white_at_the_onset_unless_it_is_switched_off(made: Make) -> None:
    for photodiode, colours in ((True, ["black", "white"]), (False, None)):
        tank = made(photodiode=photodiode)
        found = []
        for x, sample_ns in ((0.0, 1_000_000_000), (0.002, 1_016_000_000)):
            tank.show_view(view((x, 0, 0), sample_ns=sample_ns))
            found.append(tank.grab().toImage().pixelColor(tank.width() - 10, tank.height() - 10))
        edge = tank.grab().toImage().pixelColor(round(tank.width() - PATCH[0]) + 3, tank.height() - 10)
        if colours:
            assert found == [QColor(one) for one in colours]
        assert (edge == QColor("black")) is photodiode
