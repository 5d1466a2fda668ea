"""A target that moves and is followed: where it is drawn, and the ball that is hidden or waited for."""

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QApplication

from study_app.gui.participant.tank.frame import changes
from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from study_app.session.pages import Interval
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
