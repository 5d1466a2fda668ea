"""What moves in the tank: the target that is followed, the video, the photodiode's square."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.tank.frame import changes
from study_app.gui.participant.tank.onset_patch import OnsetPatch
from study_app.gui.participant.tank.photodiode_patch import PATCH
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from study_app.session.pages import Interval
from study_app.video.frames import VideoFrame
from tests.gui.participant.tank.painted import shown
from tests.gui.small import follow, task_page, view


@pytest.fixture
def swing(qtbot: Any) -> TankWidget:
    widget = TankWidget(task_page(follow()), words("en"))
    qtbot.addWidget(widget)
    widget.resize(960, 640)
    widget.show()
    return widget


def test_a_moving_target_is_drawn_where_the_view_says(swing: TankWidget) -> None:
    for x in (-0.02, 0.0, 0.015):
        swing.show_view(view((0, 0.02, 0), lit=0, target_m=(x, 0.0, 0.0)))
        (target,) = swing.targets
        assert swing.camera is not None
        assert target.middle.x() == pytest.approx(swing.camera.point((x, 0.0, 0.0))[0])
        on_ring = (round(target.middle.y()), round(target.middle.x() + target.radius))
        assert shown(swing)[on_ring].min() > 120


def test_a_moving_target_is_painted_anew_where_it_was_and_where_it_is(swing: TankWidget) -> None:
    swing.show_view(view((0, 0.02, 0), lit=0, target_m=(-0.02, 0.0, 0.0)))
    before, things = shown(swing), swing.things
    swing.show_view(view((0, 0.02, 0), lit=0, target_m=(0.01, 0.0, 0.0)))
    region = changes(things, swing.things)
    differs = np.argwhere((before != shown(swing)).any(axis=2))
    assert len(differs) > 0
    assert all(region.contains(QPoint(int(x), int(y))) for y, x in differs)


def test_a_hidden_ball_is_not_drawn_and_the_target_is(swing: TankWidget) -> None:
    swing.show_view(view((0.03, 0.01, 0), lit=0, target_m=(0.0, 0.0, 0.0)))
    with_ball = shown(swing)
    swing.show_view(view((0.03, 0.01, 0), lit=0, target_m=(0.0, 0.0, 0.0), ball_hidden=True))
    hidden = shown(swing)
    assert (with_ball != hidden).any()
    assert {"ball", "shadow", "plumb"}.isdisjoint(swing.things)
    assert "target 0" in swing.things
    swing.show_view(view((-0.03, -0.01, 0.01), lit=0, target_m=(0.0, 0.0, 0.0), ball_hidden=True))
    assert (hidden == shown(swing)).all()  # nothing tells where the hand is


def test_following_has_no_count_and_cannot_be_left(swing: TankWidget) -> None:
    for elapsed_s in (3.0, 4.1):  # a swing that ends by time is no surprise
        swing.show_view(view(lit=0, elapsed_s=elapsed_s, target_m=(0.0, 0.0, 0.0)))
        assert swing.things["hint"].state == ""
    assert not swing.may_leave
    assert swing.accessibleName() == "Keep the ball on the target"


def resting(*, resting: bool, number: int = 2, **changed: Any) -> Any:
    announced = "Next: the second" if resting else "Second of 2"
    return task_page(follow(), interval=Interval(number, 2, resting, announced), **changed)


def test_a_rest_draws_ball_and_target_and_says_what_it_waits_for(qtbot: Any) -> None:
    widget = TankWidget(resting(resting=True), words("en"))
    qtbot.addWidget(widget)
    widget.resize(1366, 768)
    widget.show()
    widget.show_view(view((0.02, 0.0, 0.0), lit=0, elapsed_s=0.0, target_m=(0.0, 0.0, 0.0)))
    assert {"ball", "target 0"} <= set(widget.things)
    assert widget.things["hint"].state == "Move the ball back into the target"
    widget.show_view(view((0.003, 0.0, 0.0), lit=0, elapsed_s=0.0, target_m=(0.0, 0.0, 0.0)))
    assert widget.things["hint"].state == ""


@pytest.mark.parametrize(("z", "said"), [(0.01, "further_away"), (-0.01, "nearer")])
def test_a_rest_says_where_the_depth_is_wrong_for_the_mouse(qtbot: Any, z: float, said: str) -> None:
    widget = TankWidget(resting(resting=True), words("en"), by_mouse=True)
    qtbot.addWidget(widget)
    widget.resize(1366, 768)
    widget.show_view(view((0.0, 0.0, z), lit=0, elapsed_s=0.0, target_m=(0.0, 0.0, 0.0)))
    assert widget.things["hint"].state == getattr(words("en"), said)


def test_the_ball_stays_drawn_from_an_interval_to_its_rest_and_is_no_frame_of_it(qtbot: Any) -> None:
    widget = TankWidget(resting(resting=False, number=1), words("en"))
    qtbot.addWidget(widget)
    widget.resize(960, 640)
    widget.show()
    told: list[int] = []
    widget.painted.connect(told.append)
    QApplication.processEvents()
    widget.show_view(
        view((0.02, 0.0, 0.0), lit=0, elapsed_s=3.9, sample_ns=7, target_m=(0.02, 0.0, 0.0), ball_hidden=True)
    )
    widget.turn_to(resting(resting=True))
    assert widget.ball is not None
    assert widget.targets[0].middle.x() == pytest.approx(widget.width() / 2, abs=1)
    assert not widget.time_is_up
    assert told == [7]


Make = Callable[..., TankWidget]


def frame(number: int, blue_green_red: tuple[int, int, int], size: tuple[int, int] = (320, 180)) -> VideoFrame:
    width, height = size
    pixels = np.zeros((height, width, 4), np.uint8)
    pixels[..., :3] = blue_green_red
    return VideoFrame(number, width, height, 4 * width, memoryview(pixels), 0, None, 33_333_333)


@pytest.fixture
def made(qtbot: Any) -> Make:
    def make(**page: Any) -> TankWidget:
        widget = TankWidget(task_page(follow(), video=True, **page), words("en"))
        qtbot.addWidget(widget)
        widget.resize(960, 640)
        widget.show()
        return widget

    return make


def seen(widget: TankWidget, video: VideoFrame | None) -> np.ndarray:
    widget.show_view(replace(view((0.03, 0.01, 0), lit=0, target_m=(0.0, 0.0, 0.0)), video=video))
    return shown(widget)


def test_a_frame_fills_the_place_of_the_tank_with_its_own_ratio(made: Make) -> None:
    widget = made(overlay=False)
    picture = seen(widget, frame(0, (200, 30, 60)))
    drawn = widget.video.middle(frame(0, (0, 0, 0))).toRect()
    assert drawn.width() / drawn.height() == pytest.approx(16 / 9, abs=0.02)
    inside = picture[drawn.top() + 2 : drawn.bottom() - 2, drawn.left() + 2 : drawn.right() - 2]
    assert (inside == (200, 30, 60)).all()


def test_ball_and_target_are_drawn_over_the_video_or_not_at_all(made: Make) -> None:
    over, alone = made(), made(overlay=False)
    video = frame(0, (200, 30, 60))
    differs = (seen(over, video) != seen(alone, video)).any(axis=2)
    assert over.ball is not None
    for place in (over.ball.middle, over.targets[0].middle):
        x, y = round(place.x()), round(place.y())
        assert differs[y - 40 : y + 40, x - 40 : x + 40].any()


def test_another_frame_is_painted_and_the_same_one_is_not(made: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    widget = made(overlay=False)
    first, second = frame(0, (200, 30, 60)), frame(1, (20, 130, 60))
    seen(widget, first)
    middle = tuple(reversed([round(value) for value in widget.video.place.center().toTuple()]))
    assert tuple(seen(widget, second)[middle]) == (20, 130, 60)
    painted: list[Any] = []
    monkeypatch.setattr(widget.video, "paint", lambda _painter, region: painted.append(region.boundingRect()))
    moved = replace(view((0.03, 0.01, 0), lit=0, target_m=(0.0, 0.0, 0.0)), video=second)
    widget.show_view(moved)
    assert all(area.height() < widget.video.place.height() / 2 for area in painted)


def test_without_a_frame_there_is_neither_tank_nor_an_earlier_picture(made: Make) -> None:
    widget = made(overlay=False)
    dark = seen(widget, None)
    assert dark[widget.height() // 2, widget.width() // 4].max() < 60
    seen(widget, frame(0, (200, 30, 60)))
    widget.turn_to(widget.page)
    assert shown(widget)[widget.height() // 2, widget.width() // 4].max() < 60


def test_a_page_without_a_video_draws_the_tank(made: Make, qtbot: Any) -> None:
    widget = made()
    on_video = seen(widget, frame(0, (0, 0, 0)))
    widget.turn_to(replace(widget.page, video=False))
    assert (seen(widget, None) != on_video).mean() > 0.3


def onsets(patch: OnsetPatch, speeds_mps: list[float], step_ns: int = 10_000_000) -> list[bool]:
    place, lit = 0.0, []
    patch.follow((0, 0, 0), 0)
    for index, speed in enumerate(speeds_mps, 1):
        place += speed * step_ns / 1e9
        lit.append(patch.follow((place, 0, 0), index * step_ns))
    return lit


def test_patch_toggles_once_when_a_movement_begins() -> None:
    assert onsets(OnsetPatch(), [0, 0, 0.1, 0.2, 0.1]) == [False, False, True, True, True]


def test_patch_toggles_again_only_after_a_rest() -> None:
    assert onsets(OnsetPatch(), [0.1, 0, 0, 0.1]) == [True] * 4
    assert onsets(OnsetPatch(), [0.1, *[0] * 10, 0.1])[-1] is False


def test_patch_is_not_moved_by_drift_and_does_not_miss_a_gentle_start() -> None:
    assert not any(onsets(OnsetPatch(), [0.005] * 40))
    assert onsets(OnsetPatch(), [0, 0, 0.012, 0.05])[-1] is True


def test_patch_in_the_corner_turns_white_at_the_onset(tank: TankWidget) -> None:
    corner = QPoint(tank.width() - 10, tank.height() - 10)
    tank.show_view(view((0, 0, 0), sample_ns=1_000_000_000))
    assert tank.grab().toImage().pixelColor(corner) == QColor("black")
    tank.show_view(view((0.002, 0, 0), sample_ns=1_016_000_000))
    assert tank.grab().toImage().pixelColor(corner) == QColor("white")
    edge = QPoint(round(tank.width() - PATCH[0]) + 3, tank.height() - 10)
    assert tank.grab().toImage().pixelColor(edge) == QColor("black")


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
        assert ("patch" in widget.things) is photodiode
    assert corners[True] == "#000000"
    assert corners[False] != "#000000"
