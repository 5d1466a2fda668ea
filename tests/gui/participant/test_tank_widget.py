"""The tank: where things are drawn, what is painted anew, what is told, and that nothing betrays the setting."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QEvent, QPoint
from PySide6.QtGui import QColor, QImage, QRegion
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.tank import caustics
from study_app.gui.participant.tank.camera import Box, Camera
from study_app.gui.participant.tank.frame import BallPlacer, changes
from study_app.gui.participant.tank.onset_patch import OnsetPatch
from study_app.gui.participant.tank.photodiode_patch import PATCH
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.small import explore, reach, task_page, view

WORKSPACE_M = (0.1, 0.06, 0.06)
BALL_M = 0.0034
BOX = Box.around(WORKSPACE_M, BALL_M)
CAMERA = Camera.fitted(BOX, 100, 50, 800, 450)

coordinate = st.floats(-1, 1)


def inside(x: float, y: float, z: float) -> tuple[float, float, float]:
    return tuple(share * size / 2 for share, size in zip((x, y, z), WORKSPACE_M, strict=True))  # type: ignore[return-value]


@pytest.fixture
def tank(qtbot: Any) -> TankWidget:
    widget = TankWidget(task_page(), words("en"))
    qtbot.addWidget(widget)
    widget.resize(960, 640)
    widget.show()
    return widget


def pixels(image: QImage) -> np.ndarray:
    """Return an image as (height, width, 3) of 0 … 255."""
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    flat = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    return flat[:, : image.width(), :3].copy()


def shown(widget: TankWidget) -> np.ndarray:
    return pixels(widget.grab().toImage())


# camera


@given(coordinate, coordinate, coordinate)
def test_every_place_of_the_workspace_is_inside_the_rectangle(x: float, y: float, z: float) -> None:
    left, top = CAMERA.point(inside(x, y, z))
    assert 100 < left < 900
    assert 50 < top < 500


@given(coordinate, coordinate, coordinate)
def test_right_is_right_up_is_up_and_near_is_large(x: float, y: float, z: float) -> None:
    here = inside(x, y, z)
    assert CAMERA.point((here[0] + 0.001, *here[1:]))[0] > CAMERA.point(here)[0]
    assert CAMERA.point((here[0], here[1] + 0.001, here[2]))[1] < CAMERA.point(here)[1]
    assert CAMERA.scale((*here[:2], here[2] + 0.001)) > CAMERA.scale(here)


def test_left_and_right_mirror_each_other() -> None:
    left, _ = CAMERA.point((-0.02, 0.01, 0.01))
    right, _ = CAMERA.point((0.02, 0.01, 0.01))
    assert left + right == pytest.approx(2 * CAMERA.centre_x)


def test_box_fills_the_rectangle_in_one_direction() -> None:
    xs, ys = zip(*(CAMERA.point(corner) for corner in BOX.corners()), strict=True)
    width, height = max(xs) - min(xs), max(ys) - min(ys)
    assert width == pytest.approx(800) or height == pytest.approx(450)
    assert width <= 800.001
    assert height <= 450.001


@given(coordinate, coordinate, coordinate)
def test_ball_stays_inside_the_glass(x: float, y: float, z: float) -> None:
    ball = BallPlacer(CAMERA, BOX, BALL_M).place((x, y, z))
    assert ball.radius > 0
    assert 100 < ball.middle.x() < 900
    assert ball.floor.y() >= ball.middle.y()


def test_ball_is_larger_and_its_shadow_lower_when_near() -> None:
    placer = BallPlacer(CAMERA, BOX, BALL_M)
    near, far = placer.place((0, 0, 0.028)), placer.place((0, 0, -0.028))
    assert near.radius > far.radius * 1.1
    assert near.floor.y() > far.floor.y() + 20
    assert near.haze < far.haze


def test_shadow_is_wider_and_fainter_under_a_high_ball() -> None:
    placer = BallPlacer(CAMERA, BOX, BALL_M)
    high, low = placer.place((0, 0.028, 0)), placer.place((0, -0.028, 0))
    assert high.spread > low.spread
    assert high.shade < low.shade
    assert len(high.feet) > len(low.feet)


def test_caustics_are_the_same_every_time_and_faint_in_the_mean() -> None:
    light = caustics.brightness()
    assert light.shape == (caustics.ROWS, caustics.COLUMNS)
    assert 0 <= light.min() < light.max() <= 1
    assert light.mean() < 0.2


# patch


def follow(patch: OnsetPatch, speeds_mps: list[float], step_ns: int = 10_000_000) -> list[bool]:
    place, lit = 0.0, []
    patch.follow((0, 0, 0), 0)
    for index, speed in enumerate(speeds_mps, 1):
        place += speed * step_ns / 1e9
        lit.append(patch.follow((place, 0, 0), index * step_ns))
    return lit


def test_patch_toggles_once_when_a_movement_begins() -> None:
    assert follow(OnsetPatch(), [0, 0, 0.1, 0.2, 0.1]) == [False, False, True, True, True]


def test_patch_toggles_again_only_after_a_rest() -> None:
    assert follow(OnsetPatch(), [0.1, 0, 0, 0.1]) == [True] * 4
    assert follow(OnsetPatch(), [0.1, *[0] * 10, 0.1])[-1] is False


def test_patch_is_not_moved_by_drift_and_does_not_miss_a_gentle_start() -> None:
    assert not any(follow(OnsetPatch(), [0.005] * 40))
    assert follow(OnsetPatch(), [0, 0, 0.012, 0.05])[-1] is True


# widget


def test_ball_is_drawn_where_the_view_says(tank: TankWidget) -> None:
    for position in ((0.0, 0.0, 0.0), (-0.04, 0.02, -0.02), (0.03, -0.02, 0.02)):
        tank.show_view(view(position, lit=0))
        ball = tank._ball
        assert ball is not None
        place = ball.middle.toPoint()
        colour = tank.grab().toImage().pixelColor(place)
        assert colour.red() > 170
        assert colour.red() > colour.green() > colour.blue() + 20


def test_lit_and_dim_targets_differ_in_shape_and_light(tank: TankWidget) -> None:
    tank.show_view(view((0, 0.02, 0), lit=0))
    left = shown(tank)
    tank.show_view(view((0, 0.02, 0), lit=1))
    right = shown(tank)
    target = tank._targets[0]
    x, y = round(target.middle.x()), round(target.middle.y())
    on_ring = (y, round(target.middle.x() + target.radius))
    assert left[on_ring].min() > 120  # a pale ring
    box = np.s_[y - 60 : y + 60, x - 60 : x + 60]
    assert left[box].mean() > right[box].mean() + 4


def test_dwell_arc_closes_clockwise_from_the_top(tank: TankWidget) -> None:
    target = tank._targets or (tank.prepare(), tank._targets)[1]
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
        before, things = shown(tank), tank._things
        tank.show_view(second)
        after = shown(tank)
        region = changes(things, tank._things)
        differs = np.argwhere((before != after).any(axis=2))
        outside = [(x, y) for y, x in differs if not region.contains(QPoint(int(x), int(y)))]
        assert outside == []
        first = second


def test_small_motion_paints_a_small_part(tank: TankWidget) -> None:
    tank.show_view(view((0.0, 0.0, 0.0), lit=1))
    before = tank._things
    tank.show_view(view((0.0005, 0.0, 0.0), lit=1))
    area = sum(rect.width() * rect.height() for rect in changes(before, tank._things))
    assert area < 0.06 * tank.width() * tank.height()


def test_nothing_changed_paints_nothing_but_still_counts_as_a_frame(tank: TankWidget, qtbot: Any) -> None:
    tank.show_view(view())
    before = tank._things
    QApplication.processEvents()
    with qtbot.waitSignal(tank.painted, timeout=1000):
        tank.show_view(view())
    assert changes(before, tank._things) == QRegion()


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


def test_time_that_is_left_is_drawn_where_time_ends_the_task(qtbot: Any) -> None:
    widget = TankWidget(task_page(reach(count=None, duration_s=30)), words("en"))
    qtbot.addWidget(widget)
    widget.resize(960, 640)
    widget.show_view(view(elapsed_s=10.0))
    first = shown(widget)
    widget.show_view(view(elapsed_s=10.0))
    assert (first == shown(widget)).all()
    widget.show_view(view(elapsed_s=11.0))
    assert (first != shown(widget)).any()


def test_patch_in_the_corner_turns_white_at_the_onset(tank: TankWidget) -> None:
    corner = QPoint(tank.width() - 10, tank.height() - 10)
    tank.show_view(view((0, 0, 0), sample_ns=1_000_000_000))
    assert tank.grab().toImage().pixelColor(corner) == QColor("black")
    tank.show_view(view((0.002, 0, 0), sample_ns=1_016_000_000))
    assert tank.grab().toImage().pixelColor(corner) == QColor("white")
    edge = QPoint(round(tank.width() - PATCH[0]) + 3, tank.height() - 10)
    assert tank.grab().toImage().pixelColor(edge) == QColor("black")


def test_resize_draws_a_new_tank_of_the_new_size(tank: TankWidget) -> None:
    tank.show_view(view())
    first = tank._ball
    tank.resize(1024, 640)
    tank.show_view(view())
    tank.resize(1366, 768)
    tank.show_view(view())
    assert tank._ball is not None
    assert first is not None
    assert tank._ball.radius > first.radius
    assert shown(tank).shape == (768, 1366, 3)


def test_references_to_none_stay_flat_over_200_repaints(tank: TankWidget) -> None:
    def paint(count: int) -> None:
        for frame in range(count):
            tank.show_view(view((0.0001 * frame, 0, 0), dwell=frame % 50 / 50, lit=frame // 50 % 2))
            tank.repaint()
            QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)

    paint(20)
    before = sys.getrefcount(None)
    paint(200)
    assert abs(sys.getrefcount(None) - before) < 100


def hint_at(qtbot, position_m, *, by_mouse=True, language="en", **changed):
    """Return what is said below the tank while the ball is at a place [m]; the lit target is at x = 30 mm."""
    widget = TankWidget(task_page(reach(**changed)), words(language), by_mouse=by_mouse)
    qtbot.addWidget(widget)
    widget.resize(1366, 768)
    widget.show()
    widget.show_view(view(position_m))
    return widget._things["hint"].state


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


def test_the_photodiodes_square_can_be_switched_off(qtbot):
    corners = {}
    for photodiode in (True, False):
        widget = TankWidget(task_page(), words("en"), photodiode=photodiode)
        qtbot.addWidget(widget)
        widget.resize(1366, 768)
        widget.show()
        widget.show_view(view())
        image = widget.grab().toImage()
        corners[photodiode] = image.pixelColor(image.width() - 82, image.height() - 82).name()
        assert ("patch" in widget._things) is photodiode
    assert corners[True] == "#000000"
    assert corners[False] != "#000000"
