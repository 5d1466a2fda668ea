"""The video in place of the tank."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from study_app.gui.participant.tank_widget import TankWidget
from study_app.video.frames import VideoFrame
from tests.gui.drawn import shown
from tests.gui.small import follow, follow_view, task_page

Make = Callable[..., TankWidget]
BLUE, GREEN = (200, 30, 60), (20, 130, 60)


def frame(number: int, blue_green_red: tuple[int, int, int], size: tuple[int, int] = (320, 180)) -> VideoFrame:
    width, height = size
    pixels = np.zeros((height, width, 4), np.uint8)
    pixels[..., :3] = blue_green_red
    return VideoFrame(number, width, height, 4 * width, memoryview(pixels), 0, None, 33_333_333)


def filmed(made: Make, **page: Any) -> TankWidget:
    return made(task_page(follow(), video=True, **page))


def seen(tank: TankWidget, video: VideoFrame | None) -> np.ndarray:
    tank.show_view(replace(follow_view(ball=(0.03, 0.01, 0)), video=video))
    return shown(tank)


def test_another_frame_is_painted_and_the_same_one_is_not(made: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    tank = filmed(made, overlay=False)
    seen(tank, frame(0, BLUE))
    second = frame(1, GREEN)
    middle = tuple(reversed([round(value) for value in tank.video.place.center().toTuple()]))
    assert tuple(seen(tank, second)[middle]) == GREEN
    painted: list[Any] = []
    monkeypatch.setattr(tank.video, "paint", lambda _painter, region: painted.append(region.boundingRect()))
    tank.show_view(replace(follow_view(ball=(0.03, 0.01, 0)), video=second))
    assert all(area.height() < tank.video.place.height() / 2 for area in painted)


@pytest.mark.parametrize("size", [(400, 40), (40, 400)])
def test_a_frame_of_another_ratio_is_in_the_middle_and_as_large_as_its_place(made: Make, size: tuple[int, int]) -> None:
    tank = filmed(made, overlay=False)
    at = np.argwhere((seen(tank, frame(0, GREEN, size)) == GREEN).all(axis=2))
    place, (top, left), (bottom, right) = tank.video.place, at.min(axis=0), at.max(axis=0) + 1
    assert (left + right) / 2 == pytest.approx(place.center().x(), abs=1)
    assert (top + bottom) / 2 == pytest.approx(place.center().y(), abs=1)
    assert max((right - left) / place.width(), (bottom - top) / place.height()) == pytest.approx(1, abs=0.01)
    assert (right - left) / (bottom - top) == pytest.approx(size[0] / size[1], rel=0.05)


def test_without_a_frame_there_is_neither_tank_nor_an_earlier_picture(made: Make) -> None:
    tank = filmed(made, overlay=False)
    middle = (tank.height() // 2, tank.width() // 4)
    assert seen(tank, None)[middle].max() < 60
    on_video = seen(tank, frame(0, BLUE))
    tank.turn_to(tank.page)
    assert shown(tank)[middle].max() < 60
    tank.turn_to(replace(tank.page, video=False))
    assert (seen(tank, None) != on_video).mean() > 0.3, "a page without a video draws the tank"
