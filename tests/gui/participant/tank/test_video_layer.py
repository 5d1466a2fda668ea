"""The video in the tank: drawn behind ball and targets or in place of them, and painted anew when it changes."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from study_app.video.frames import VideoFrame
from tests.gui.participant.tank.painted import shown
from tests.gui.small import follow, task_page, view

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
