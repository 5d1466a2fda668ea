"""The video in place of the tank."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QRectF

from study_app.gui.participant.tank_widget import TankWidget
from study_app.video.frames import VideoFrame
from tests.gui.drawn import grabbed_pixels
from tests.gui.small import follow, follow_view, task_page

Make = Callable[..., TankWidget]
BLUE, GREEN = (200, 30, 60), (20, 130, 60)


def frame(number: int, blue_green_red: tuple[int, int, int]) -> VideoFrame:
    pixels = np.zeros((180, 320, 4), np.uint8)
    pixels[..., :3] = blue_green_red
    return VideoFrame(
        number=number,
        width=320,
        height=180,
        stride=4 * 320,
        pixels=memoryview(pixels),
        due_ns=0,
        age_ns=None,
        period_ns=33_333_333,
    )


def shown_pixels(tank: TankWidget, video: VideoFrame | None) -> np.ndarray:
    tank.show_view(replace(follow_view(ball=(0.03, 0.01, 0)), video=video))
    return grabbed_pixels(tank)


@pytest.mark.parametrize(
    ("place", "ratio", "size"), [((640, 361), 1.5, (960, 541)), ((3, 5), 0.75, (2, 3)), ((0, 0), 2.0, (2, 2))]
)
def test_frames_are_requested_in_screen_pixels_and_at_least_two_by_two(
    make_tank: Make, place: tuple[int, int], ratio: float, size: tuple[int, int]
) -> None:
    video = make_tank(task_page(follow(), video=True)).video
    video.place = QRectF(7, 11, *place)
    assert video.size(ratio) == size


def test_a_new_frame_is_painted_but_not_the_same_one(make_tank: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    tank = make_tank(task_page(follow(), video=True, overlay=False))
    shown_pixels(tank, frame(0, BLUE))
    second = frame(1, GREEN)
    middle = tuple(reversed([round(value) for value in tank.video.place.center().toTuple()]))
    assert tuple(shown_pixels(tank, second)[middle]) == GREEN
    painted: list[Any] = []
    monkeypatch.setattr(tank.video, "paint", lambda _painter, region: painted.append(region.boundingRect()))
    tank.show_view(replace(follow_view(ball=(0.03, 0.01, 0)), video=second))
    assert all(area.height() < tank.video.place.height() / 2 for area in painted)
