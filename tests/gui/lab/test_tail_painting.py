"""The tail on the screen: where the body was, breaks where the wake has them, brighter and thicker the newer."""

from dataclasses import dataclass

import numpy as np
import pytest
from PySide6.QtCore import QPointF

from study_app.gui.lab.tail_painting import SHADES, STEP_PX, tail_places
from study_app.gui.participant.tank.camera import Box, Camera
from study_app.viewmodels.lab import Floats, LabView

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


def test_it_begins_and_ends_where_the_body_was() -> None:
    places = tail_places(tail([(-40, 0, 0), (0, 0, 10), (40, 5, 0)]), CAMERA, BOX)
    assert apart(places.runs[0][1].first(), pixel((-40, 0, 0))) < 1e-6
    assert apart(places.runs[-1][1].last(), pixel((40, 5, 0))) < 1e-6
    assert apart(places.breaks[0], pixel((-40, 0, 0))) < 1e-6


def test_a_break_is_a_ring_where_the_segment_before_ended_and_each_side_has_an_arrow() -> None:
    places = tail_places(tail([(-40, 0, 0), (40, 0, 0), (-40, 0, 20)], (0, 50)), CAMERA, BOX)
    assert len(places.breaks) == 2
    assert apart(places.breaks[1], pixel((40, 0, 0))) < 8
    (_, right, _), (_, left, _) = places.heads
    assert abs(right) < 0.1
    assert abs(left) > np.pi / 2
    assert len(places.floor) == 2


def test_no_more_points_than_can_be_seen_and_none_left_out_that_could() -> None:
    made = tail([(-40, 0, 0), (0, 20, 10), (40, -20, 0)], count=400)
    places = tail_places(made, CAMERA, BOX)
    drawn = np.array([(p.x(), p.y()) for _, run in places.runs for p in run.toList()])
    length = float(np.hypot(*np.diff(drawn, axis=0).T).sum())
    assert len(drawn) < length / STEP_PX + 2 * SHADES + 2
    for place in made.positions_m:
        at = QPointF(*CAMERA.point(tuple(place.tolist())))
        assert min(np.hypot(drawn[:, 0] - at.x(), drawn[:, 1] - at.y())) < 1.5 * STEP_PX


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_yet(count: int) -> None:
    made = Made(np.zeros((count, 3)), np.ones(count, bool), np.zeros(count), alive=count, segments=count)
    places = tail_places(made, CAMERA, BOX)
    assert places.runs == ()
    assert places.heads == ()
    assert len(places.breaks) == count


def test_a_real_wake_has_as_many_rings_as_segments(moved: LabView) -> None:
    assert moved.tail is not None
    places = tail_places(moved.tail, CAMERA, BOX)
    assert len(places.breaks) == moved.tail.segments
    assert moved.tail.segments > 3
    assert moved.now is not None
    newest = places.runs[-1][1].last()
    assert apart(newest, QPointF(*CAMERA.point(moved.now.position_m))) < 6
