"""The tail on the screen: where the body was, breaks where the wake has them, brighter and thicker the newer."""

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF

from study_app.gui.lab.lab_state import Floats, LabView
from study_app.gui.lab.lab_tank import tail_places
from study_app.gui.participant.tank.frame import Box, Camera

BOX = Box.around((0.1, 0.06, 0.06), 0.0034)
CAMERA = Camera.fitted(BOX, 30, 30, 700, 420, pitch=0.5)


@dataclass
class Made:
    positions_m: Floats
    breaks: np.ndarray
    ages: Floats
    elements: int = 400
    alive: int = 400
    segments: int = 1


def tail(places: list[tuple[float, float, float]], breaks: tuple[int, ...] = (0,), count: int = 100) -> Made:
    corners = np.array(places) / 1000
    share = np.linspace(0, len(corners) - 1, count)
    way = np.column_stack([np.interp(share, np.arange(len(corners)), corners[:, k]) for k in range(3)])
    begins = np.zeros(count, bool)
    begins[list(breaks)] = True
    return Made(way, begins, np.linspace(1, 0, count), segments=len(breaks))


def pixel(place_mm: tuple[float, float, float]) -> QPointF:
    return QPointF(*CAMERA.point(tuple(value / 1000 for value in place_mm)))


def apart(one: QPointF, other: QPointF) -> float:
    return float(np.hypot(one.x() - other.x(), one.y() - other.y()))


def test_a_break_is_a_ring_where_the_segment_before_ended_and_each_side_has_an_arrow() -> None:
    places = tail_places(tail([(-40, 0, 0), (40, 0, 0), (-40, 0, 20)], (0, 50)), CAMERA, BOX)
    assert len(places.breaks) == 2
    assert apart(places.breaks[1], pixel((40, 0, 0))) < 8
    (_, right, _), (_, left, _) = places.heads
    assert abs(right) < 0.1
    assert abs(left) > np.pi / 2
    assert len(places.floor) == 2


def test_a_segment_too_short_for_an_arrow_has_none() -> None:
    assert tail_places(tail([(0, 0, 0), (1, 0, 0)]), CAMERA, BOX).heads == ()


def test_a_real_wake_has_as_many_rings_as_segments(moved: LabView) -> None:
    assert moved.tail is not None
    places = tail_places(moved.tail, CAMERA, BOX)
    assert len(places.breaks) == moved.tail.segments
    assert moved.tail.segments > 3
    assert moved.now is not None
    newest = places.runs[-1][1].last()
    assert apart(newest, QPointF(*CAMERA.point(moved.now.position_m))) < 6
