"""The tank: what is drawn, what is painted anew, when a view counts as painted, and the words below it."""

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF
from PySide6.QtGui import QRegion
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.tank.frame import changes
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.drawn import drawn_by
from tests.gui.participant.tank.painted import shown
from tests.gui.small import explore, reach, task_page, view


def test_ball_is_drawn_where_the_view_says(tank: TankWidget) -> None:
    for position in ((0.0, 0.0, 0.0), (-0.04, 0.02, -0.02), (0.03, -0.02, 0.02)):
        tank.show_view(view(position, lit=0))
        ball = tank.ball
        assert ball is not None
        place = ball.middle.toPoint()
        colour = tank.grab().toImage().pixelColor(place)
        assert colour.red() > 170
        assert colour.red() > colour.green() > colour.blue() + 20


@pytest.mark.parametrize("other_z_mm", [-25, 25])
def test_the_nearer_of_ball_and_target_is_painted_over_the_other(qtbot: Any, other_z_mm: int) -> None:
    """Where the lit ring crosses the ball, the ball's colour shows if it is nearer, else the pale ring."""
    tank = TankWidget(task_page(reach(targets_mm=((-30, 0, 0), (30, 0, other_z_mm)))), words("en"))
    qtbot.addWidget(tank)
    tank.resize(960, 640)
    tank.show()
    tank.show_view(view((0, 0.02, 0), lit=0))
    assert tank.camera is not None
    assert tank.placer is not None
    target = tank.targets[0]
    ring = target.middle + QPointF(target.radius, 0)
    seen = []
    for z in (0.02, -0.02):
        flat = tank.camera.scale((0, 0, z))
        centre = tank.camera.point((0, 0, z))
        tank.show_view(view(((ring.x() - centre[0]) / flat, (centre[1] - ring.y()) / flat, z), lit=0))
        assert tank.ball is not None
        assert (tank.ball.middle - ring).manhattanLength() < tank.ball.radius / 2
        assert (tank.ball.depth_m < target.depth_m) is (z > 0)
        seen.append(tank.grab().toImage().pixelColor(ring.toPoint()))
    near, far = seen
    assert near.red() > near.blue() + 40
    assert far.blue() > near.blue() + 40


def test_lit_and_dim_targets_differ_in_shape_and_light(tank: TankWidget) -> None:
    tank.show_view(view((0, 0.02, 0), lit=0))
    left = shown(tank)
    tank.show_view(view((0, 0.02, 0), lit=1))
    right = shown(tank)
    target = tank.targets[0]
    x, y = round(target.middle.x()), round(target.middle.y())
    on_ring = (y, round(target.middle.x() + target.radius))
    assert left[on_ring].min() > 120  # a pale ring
    box = np.s_[y - 60 : y + 60, x - 60 : x + 60]
    assert left[box].mean() > right[box].mean() + 4


def test_dwell_arc_closes_clockwise_from_the_top(tank: TankWidget) -> None:
    target = tank.targets or (tank.prepare(), tank.targets)[1]
    middle, radius = target[1].middle, target[1].radius
    right_side = (round(middle.y()), round(middle.x() + radius))
    left_side = (round(middle.y()), round(middle.x() - radius))
    tank.show_view(view((0, 0.02, 0), dwell=0.5))
    half = shown(tank)
    assert half[right_side].min() > 235
    assert half[left_side].min() < 235
    tank.show_view(view((0, 0.02, 0), dwell=1.0))
    assert shown(tank)[left_side].min() > 235


def test_what_changed_lies_inside_the_region_painted_anew(tank: TankWidget) -> None:
    first = view((0.01, 0.0, 0.01), lit=1, dwell=0.2, reached=3)
    for second in (
        view((0.012, 0.001, 0.01), lit=1, dwell=0.25, reached=3),
        view((0.012, 0.001, 0.01), lit=1, dwell=0.25, reached=3),
        view((-0.03, -0.02, -0.02), lit=0, dwell=0.0, reached=4),
    ):
        tank.show_view(first)
        before, things = shown(tank), tank.things
        tank.show_view(second)
        after = shown(tank)
        region = changes(things, tank.things)
        differs = np.argwhere((before != after).any(axis=2))
        outside = [(x, y) for y, x in differs if not region.contains(QPoint(int(x), int(y)))]
        assert outside == []
        first = second


def test_nothing_changed_paints_nothing_but_still_counts_as_a_frame(tank: TankWidget, qtbot: Any) -> None:
    tank.show_view(view())
    before = tank.things
    QApplication.processEvents()
    with qtbot.waitSignal(tank.painted, timeout=1000):
        tank.show_view(view())
    assert changes(before, tank.things) == QRegion()


def test_painted_comes_once_a_view_with_the_time_of_what_was_drawn(tank: TankWidget, qtbot: Any) -> None:
    told: list[int] = []
    tank.painted.connect(told.append)
    with qtbot.waitSignal(tank.painted, timeout=1000):
        tank.show_view(view(sample_ns=5_123_456_789_012))
    tank.repaint()  # as when the window is uncovered
    assert told == [5_123_456_789_012]


def test_a_view_is_painted_before_anything_else_is_done(tank: TankWidget, qtbot: Any) -> None:
    qtbot.waitExposed(tank)
    told: list[int] = []
    tank.painted.connect(told.append)
    for sample_ns in range(1, 6):
        tank.show_view(view((0.004 * sample_ns, 0.0, 0.0), sample_ns=sample_ns))
        assert told[-1] == sample_ns, "without a turn of the event loop"
    QApplication.processEvents()
    assert told == [1, 2, 3, 4, 5]


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
    tank.show_view(view())
    first = tank.ball
    tank.resize(1024, 640)
    tank.show_view(view())
    tank.resize(1366, 768)
    tank.show_view(view())
    assert tank.ball is not None
    assert first is not None
    assert tank.ball.radius > first.radius
    assert shown(tank).shape == (768, 1366, 3)


def test_exploration_may_be_left_after_its_least_time(qtbot: Any) -> None:
    widget = TankWidget(task_page(explore()), words("en"))
    qtbot.addWidget(widget)
    widget.resize(960, 640)
    assert not widget.may_leave
    widget.show_view(view(lit=None, elapsed_s=29.9))
    assert not widget.may_leave
    early = shown(widget)
    widget.show_view(view(lit=None, elapsed_s=30.0))
    assert widget.may_leave
    assert (early != shown(widget)).any()  # the hint under the tank


def test_reaching_cannot_be_left(tank: TankWidget) -> None:
    tank.show_view(view(elapsed_s=1000))
    assert not tank.may_leave


def hint_at(qtbot, position_m, *, by_mouse=True, language="en", **changed):
    """Return what is said below the tank while the ball is at a place [m]; the lit target is at x = 30 mm."""
    widget = TankWidget(task_page(reach(**changed)), words(language), by_mouse=by_mouse)
    qtbot.addWidget(widget)
    widget.resize(1366, 768)
    widget.show()
    widget.show_view(view(position_m))
    return widget.things["hint"].state


@pytest.mark.parametrize(
    ("position_m", "said"),
    [
        ((0.03, 0.0, 0.0), ""),
        ((0.03, 0.0, 0.02), "A little further away: wheel forwards"),
        ((0.035, 0.004, -0.02), "A little nearer: wheel backwards"),
        ((-0.03, 0.0, 0.02), ""),
    ],
)
def test_depth_that_the_wheel_lost_is_told_where_the_mouse_is_the_device(qtbot, position_m, said):
    assert hint_at(qtbot, position_m) == said
    assert hint_at(qtbot, position_m, by_mouse=False) == ""


@pytest.mark.parametrize("language", ["ar", "de", "en", "fr", "nl"])
def test_depth_is_told_in_every_language_and_before_the_time(qtbot, language):
    said = words(language)
    left = said.seconds_left.format(seconds=18)
    assert hint_at(qtbot, (0.03, 0, 0.02), language=language, count=None, duration_s=30) == (
        f"{said.further_away} · {left}"
    )


@pytest.mark.parametrize("by_mouse", [True, False])
def test_with_the_mouse_there_is_no_force_to_switch_off(qtbot: Any, by_mouse: bool) -> None:
    widget = TankWidget(task_page(), words("en"), by_mouse=by_mouse)
    qtbot.addWidget(widget)
    widget.resize(1366, 768)
    widget.show()
    texts = [one.text for one in drawn_by(widget)]
    assert ("Pause" in texts) is by_mouse
    assert any("force" in text for text in texts) is not by_mouse
