"""The tank: drawing, repainted regions, the painted signal, captions and moving parts."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QEvent, QObject, QPoint, QRect
from PySide6.QtGui import QColor, QPaintEvent, QRegion
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.tank.captions import Captions
from study_app.gui.participant.tank.glass import _blur_image, brightness
from study_app.gui.participant.tank.layers import OnsetPatch
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.drawn import grabbed_pixels
from tests.gui.small import explore, follow, follow_view, reach, task_page, view

Make = Callable[..., TankWidget]
PATCH_PX = 88
"""Side of the photodiode's patch."""
WORKSPACE_M = (0.1, 0.06, 0.06)


@pytest.fixture
def tank(make_tank: Make) -> TankWidget:
    return make_tank()


class Painted(QObject):
    """A recorder of the region of a widget that is painted."""

    def __init__(self, widget: TankWidget) -> None:
        super().__init__(widget)
        self.region = QRegion()
        widget.installEventFilter(self)

    def eventFilter(self, _watched: QObject, event: QEvent) -> bool:  # noqa: N802
        if isinstance(event, QPaintEvent):
            self.region += event.region()
        return False


def hint(tank: TankWidget) -> Any:
    return tank.parts["hint"].state


def ball_of(tank: TankWidget, position_m: tuple[float, float, float]) -> Any:
    tank.show_view(view(position_m, lit=0))
    assert tank.ball is not None
    return tank.ball


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
def test_changes_lie_inside_the_repainted_region(
    make_tank: Make, page: Any, views: tuple[Any, ...], qtbot: Any
) -> None:
    tank = make_tank(page)
    with qtbot.waitExposed(tank):
        tank.show()
    QApplication.processEvents()
    tank.show_view(views[0])
    for following in views[1:]:
        before, painted = grabbed_pixels(tank), Painted(tank)
        tank.show_view(following)
        region = QRegion(painted.region)
        assert not region.isEmpty()
        differs = np.argwhere((before != grabbed_pixels(tank)).any(axis=2))
        assert [(x, y) for y, x in differs if not region.contains(QPoint(int(x), int(y)))] == []
    assert len(differs) > 0


def test_painted_comes_once_a_view_before_anything_else_is_done(tank: TankWidget, qtbot: Any) -> None:
    qtbot.waitExposed(tank)
    painted_ns: list[int] = []
    tank.painted.connect(painted_ns.append)
    for sample_ns in (*range(1, 6), 5_123_456_789_012):
        tank.show_view(view((0.004 * min(sample_ns, 6), 0.0, 0.0), sample_ns=sample_ns))
        assert painted_ns[-1] == sample_ns, "without a turn of the event loop"
    tank.repaint()  # as when the window is uncovered
    QApplication.processEvents()
    assert painted_ns == [1, 2, 3, 4, 5, 5_123_456_789_012]
    painted = Painted(tank)
    with qtbot.waitSignal(tank.painted, timeout=1000):  # nothing changed, but it is a frame
        tank.show_view(view((0.024, 0.0, 0.0)))
    assert painted.region == QRegion(QRect(0, 0, 1, 1)), "a corner, for the frame's sake"


@pytest.mark.slow
def test_a_hidden_view_is_reported_when_it_becomes_visible(tank: TankWidget, qtbot: Any) -> None:
    painted_ns: list[int] = []
    tank.painted.connect(painted_ns.append)
    tank.show_view(view(sample_ns=1))
    tank.hide()
    tank.show_view(view(sample_ns=2))
    tank.show_view(view(sample_ns=3))
    assert painted_ns == [1]
    with qtbot.waitSignal(tank.painted, timeout=1000):
        tank.show()
    assert painted_ns == [1, 3]


MM = 1e-3
SLOW, FAST = (7.9 * MM, 20.1 * MM)
"""Just slower than the limit of a rest, and just faster than that of a movement [m/s]."""


@pytest.mark.parametrize(
    ("speeds_mps", "is_lit"),
    [
        ([FAST], True),
        ([19.9 * MM], False),
        ([0, 0, FAST, 200 * MM, FAST], True),
        ([5 * MM] * 40, False),  # a drift
        ([FAST, *[0] * 9, FAST], True),  # the hand rested for 90 ms only, so this is the same movement
        ([FAST, *[SLOW] * 10, FAST], False),
        ([FAST, *[8.1 * MM] * 40, FAST], True),
        ([FAST, *[0] * 6, 8.1 * MM, *[0] * 9, FAST], True),
        ([FAST, *[0] * 6, 8.1 * MM, *[0] * 10, FAST], False),
        ([FAST, *[0] * 12, 15 * MM, FAST], False),  # it speeds up only after the rest
        ([FAST, *[0] * 12, FAST, *[0] * 12, FAST, FAST], True),
    ],
)
def test_a_movement_faster_than_20_mm_per_s_after_100_ms_below_8_toggles_the_patch(
    speeds_mps: list[float], is_lit: bool
) -> None:
    patch, x_m = OnsetPatch(), 0.3
    start_ns = 5_123_000_000
    assert patch.follow_motion((x_m, -0.02, 0.01), start_ns) is False
    for index, speed_mps in enumerate(speeds_mps, 1):
        x_m -= speed_mps * 0.01
        patch.follow_motion((x_m, -0.02, 0.01), start_ns + index * 10_000_000)
    assert patch.lit is is_lit


def test_the_speed_for_the_patch_is_measured_over_8_ms_in_three_dimensions() -> None:
    """The path of 0.15, 0.2 and 0.6 mm is 0.65 mm long: 20.1 mm/s over 32.3 ms, and 19.9 mm/s over 32.7 ms."""
    start_m, end_m = (0.01, 0.02, -0.03), (0.01015, 0.0198, -0.0294)
    for times_ns, is_lit in (
        ((32_300_000,), [True]),
        ((32_700_000,), [False]),
        ((7_999_999, 8_000_000), [False, True]),
        ((3_000_000, 6_000_000, 9_000_000), [False, False, True]),
    ):
        patch = OnsetPatch()
        patch.follow_motion(start_m, 0)
        assert [patch.follow_motion(end_m, time_ns) for time_ns in times_ns] == is_lit


def test_patch_in_the_corner_turns_white_at_the_onset_unless_it_is_switched_off(make_tank: Make) -> None:
    for photodiode, colours in ((True, ["black", "white"]), (False, None)):
        tank = make_tank(photodiode=photodiode)
        patches = []
        for x, sample_ns in ((0.0, 1_000_000_000), (0.002, 1_016_000_000)):
            tank.show_view(view((x, 0, 0), sample_ns=sample_ns))
            patches.append(tank.grab().toImage().pixelColor(tank.width() - 10, tank.height() - 10))
        edge = tank.grab().toImage().pixelColor(tank.width() - PATCH_PX + 3, tank.height() - 10)
        if colours:
            assert patches == [QColor(colour) for colour in colours]
        assert (edge == QColor("black")) is photodiode


def test_the_ball_reaches_the_whole_workspace_between_floor_and_water(make_tank: Make) -> None:
    ball_m, margin_m = 0.0034, 0.0025
    around = type(make_tank()._box).around
    box = around(WORKSPACE_M, ball_m)
    assert (-box.floor, box.water) == pytest.approx((0.03 + ball_m + margin_m,) * 2)
    assert box.top > box.water
    assert min(box.x - 0.05, box.z - 0.03) >= ball_m + margin_m
    wide = around((0.5, 0.06, 0.3), ball_m)
    assert (wide.x, wide.z) == pytest.approx((0.25 + ball_m + margin_m, 0.15 + ball_m + margin_m))


def test_with_the_mouse_the_page_asks_for_a_click(make_tank: Make) -> None:
    spoken = words("en")
    for by_mouse, now, hint in (
        (False, spoken.continue_now, spoken.pause_hint),
        (True, spoken.click_now, spoken.pause_title),
    ):
        shown_words = make_tank(by_mouse=by_mouse)._words
        assert (shown_words.continue_now, shown_words.pause_hint) == (now, hint)


def test_the_hint_counts_the_seconds_until_a_person_may_or_must_go_on(qtbot: Any) -> None:
    wording, limit_s = words("en"), reach().limit_s
    left = {seconds: wording.seconds_left.format(seconds=seconds) for seconds in (1, 10)}
    for task, elapsed_s, hint_text, text in (
        (explore(), 0.0, "", wording.continue_in.format(seconds=30)),
        (explore(), 29.2, "", wording.continue_in.format(seconds=1)),
        (explore(), 30.0, "", wording.continue_now),
        (explore(), 109.9, "", wording.continue_now),
        (explore(), 110.0, "", f"{wording.continue_now} · {left[10]}"),
        (explore(), 119.5, "", f"{wording.continue_now} · {left[1]}"),
        (explore(), 120.0, "", wording.time_is_up),
        (reach(), limit_s - 10.5, "nearer", "nearer"),
        (reach(), limit_s - 10.0, "nearer", f"nearer · {left[10]}"),
        (reach(), limit_s - 0.5, "", left[1]),
        (reach(), limit_s, "nearer", wording.time_is_up),
        (follow(), follow().limit_s - 5.0, "nearer", "nearer"),
    ):
        parts = Captions(task_page(task), wording).parts(view(elapsed_s=elapsed_s, reached=5).task, hint_text)
        assert (parts["hint"].state, parts["count"].state) == (text, (5, 12))
    assert Captions(task_page(reach()), wording).parts(None)["count"].state == (0, 12)


def test_a_blur_spreads_each_cell_evenly_over_its_neighbours_and_repeats_the_edges() -> None:
    image = np.zeros((5, 6))
    image[2, 3] = 9.0
    spread = np.zeros((5, 6))
    spread[1:4, 2:5] = 1.0
    assert _blur_image(image) == pytest.approx(spread)
    assert _blur_image(np.full((4, 3), 0.7)) == pytest.approx(np.full((4, 3), 0.7))
    corner = np.zeros((4, 5))
    corner[0, 0] = 9.0
    assert _blur_image(corner)[:3, :3] == pytest.approx(np.array([[4.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 0.0]]))
    wide = np.zeros((5, 5))
    wide[2, 2] = 25.0
    assert _blur_image(wide, radius=2) == pytest.approx(np.ones((5, 5)))


def test_the_light_on_the_floor_is_dark_on_average_with_bright_lines() -> None:
    light = brightness()
    assert light.shape == (320, 512)
    assert (light.min(), light.max()) == (0.0, 1.0)
    assert 0.05 < light.mean() < 0.3
