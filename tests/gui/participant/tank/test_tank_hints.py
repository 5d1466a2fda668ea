"""The line below the tank: when the participant may or must go on, and how the ball gets into its target."""

from typing import Any

import pytest

from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.drawn import drawn_by
from tests.gui.participant.tank.painted import shown
from tests.gui.small import explore, reach, task_page, view


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


def hint_at(qtbot, position_m, *, by_mouse=True, language="en", **changed):
    """Return what is said below the tank while the ball is at a place [m]; the lit target is at x = 30 mm."""
    widget = TankWidget(task_page(reach(**changed)), words(language), by_mouse=by_mouse)
    qtbot.addWidget(widget)
    widget.resize(1366, 768)
    widget.show()
    widget.show_view(view(position_m))
    return widget.things["hint"].state


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


@pytest.mark.parametrize("by_mouse", [True, False])
def test_with_the_mouse_there_is_no_force_to_switch_off(qtbot: Any, by_mouse: bool) -> None:
    widget = TankWidget(task_page(), words("en"), by_mouse=by_mouse)
    qtbot.addWidget(widget)
    widget.resize(1366, 768)
    widget.show()
    texts = [one.text for one in drawn_by(widget)]
    assert ("Pause" in texts) is by_mouse
    assert any("force" in text for text in texts) is not by_mouse
