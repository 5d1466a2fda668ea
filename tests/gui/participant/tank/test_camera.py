"""The camera and what it places: everything of the tank lies within its rectangle, near things are larger."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.gui.participant.tank.camera import Box, Camera
from study_app.gui.participant.tank.frame import BallPlacer

WORKSPACE_M = (0.1, 0.06, 0.06)
BALL_M = 0.0034
BOX = Box.around(WORKSPACE_M, BALL_M)
CAMERA = Camera.fitted(BOX, 100, 50, 800, 450)


coordinate = st.floats(-1, 1)


def inside(x: float, y: float, z: float) -> tuple[float, float, float]:
    return tuple(share * size / 2 for share, size in zip((x, y, z), WORKSPACE_M, strict=True))  # type: ignore[return-value]


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
