"""Both windows on one screen lead to each other; the force is shown in a single-blind study alone."""

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.app.session.bridge import SessionBridge
from study_app.gui.operator.force_plots import ForceCard
from study_app.gui.operator.plot_cards import HiddenForceCard
from study_app.gui.operator.strip import Strip
from study_app.haptics.model.layout import LIMITER_FADE, LIMITER_NORM, SAMPLE, records
from study_app.session.transitions.events import Continue
from tests.app.world import World, begin_trial

pytestmark = pytest.mark.slow


@pytest.fixture
def one_screen(make, qtbot):
    bridge = make(strip=Strip())
    qtbot.waitExposed(bridge.participant)
    return bridge


def in_front(bridge):
    return QApplication.activeWindow()


def test_strip_stands_above_every_page_and_covers_none(one_screen, world):
    strip, participant = one_screen.strip, one_screen.participant
    for _ in range(3):
        assert strip.isVisible()
        assert strip.parent() is participant
        assert strip.geometry().top() == 0
        assert strip.width() == participant.width()
        assert participant.widget.geometry().top() == strip.height()
        assert participant.widget.geometry().bottom() == participant.rect().bottom()
        one_screen.participant.event.emit(Continue(world.seconds()))


def test_strip_tells_the_state_and_stops_the_force_at_the_first_touch(one_screen, world, qtbot):
    begin_trial(one_screen, world)
    strip = one_screen.strip
    assert strip.state.word == "Running"
    assert world.force_is_on
    qtbot.mousePress(strip.stop, Qt.MouseButton.LeftButton)
    assert not world.force_is_on
    assert strip.state.word == "Paused, force is off"


def test_strip_leaves_the_keyboard_to_the_page(one_screen, qtbot):
    before = one_screen.participant.focusWidget()
    assert before is not None
    qtbot.mouseClick(one_screen.strip.operator, Qt.MouseButton.LeftButton)
    assert one_screen.participant.focusWidget() is before


def test_each_window_leads_to_the_other(one_screen, world, qtbot):
    qtbot.mouseClick(one_screen.strip.operator, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: in_front(one_screen) is one_screen.operator)
    qtbot.mouseClick(one_screen.operator.header.page, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: in_front(one_screen) is one_screen.participant)


def test_f6_leads_from_each_window_to_the_other_and_back(one_screen, world, qtbot):
    begin_trial(one_screen, world)
    windows = one_screen.participant, one_screen.operator
    one_screen.participant.come_forward()
    for here, there in (windows, windows[::-1]):
        qtbot.waitUntil(lambda here=here: in_front(one_screen) is here)
        qtbot.keyClick(here, Qt.Key.Key_F6)
        qtbot.waitUntil(lambda there=there: in_front(one_screen) is there)
    assert world.force_is_on


def test_trouble_brings_the_operators_window_to_the_front_once(one_screen, world, qtbot, caplog):
    begin_trial(one_screen, world)
    one_screen.participant.come_forward()
    one_screen.fail(RuntimeError("the disk is gone"))
    qtbot.waitUntil(lambda: in_front(one_screen) is one_screen.operator)
    one_screen.participant.come_forward()
    qtbot.waitUntil(lambda: in_front(one_screen) is one_screen.participant)
    one_screen.show_tiles()
    assert in_front(one_screen) is one_screen.participant
    caplog.clear()


@pytest.mark.parametrize("key", [Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Escape, None])
def test_last_page_ends_by_a_key_or_a_click_and_leads_to_the_operator(one_screen, world, qtbot, key):
    begin_trial(one_screen, world)
    one_screen.operator.end_asked.emit("withdrawn", "felt unwell")
    participant = one_screen.participant
    if key is None:
        qtbot.mouseClick(participant.widget.button, Qt.MouseButton.LeftButton)
    else:
        qtbot.keyClick(participant.focusWidget(), key)
    assert not participant.isVisible()
    qtbot.waitUntil(lambda: in_front(one_screen) is one_screen.operator)
    assert one_screen.operator.buttons.close_session.isVisible()


def test_two_screens_have_no_strip(bridge):
    assert bridge.participant.widget.geometry().top() == 0
    assert bridge.operator.header.page.isHidden()


def pushes(world: World, count: int = 400) -> Any:
    """Return samples of the scene now loaded with a force of 3 N, 1.5 N of it along x, limited now and then."""
    samples = records(SAMPLE, count)
    world.now_s += count / 1000
    samples.tick = np.arange(count)
    samples.time_ns = round(world.now_s * 1e9) - np.arange(count)[::-1] * 1_000_000
    samples.scene = world.serial
    samples.fresh = 1
    samples.device_force_n = (1.5, 0.0, np.sqrt(9 - 1.5**2))
    samples.wake_mps = (0.3, 0.0, 0.4)
    samples.permitted_n, samples.withheld_n = 4.0, 0.25
    samples.limiters = LIMITER_FADE
    samples.limiters[:7] |= LIMITER_NORM
    return samples


WITHHELD = "Force withheld, limit 5\u2009%"


def rows(bridge: SessionBridge) -> dict[str, str]:
    return dict(bridge.view().device.rows)


def looked(bridge: SessionBridge, world: World) -> None:
    begin_trial(bridge, world)
    world.samples = pushes(world)
    bridge.draw_frame()
    bridge.show_traces()
    bridge.show_tiles()


def test_force_wake_share_and_limiters_are_seen(make: Any, world: World) -> None:
    bridge = make(blinding="single", force_limit_n=6.0)
    looked(bridge, world)
    card = bridge.operator.force
    assert isinstance(card, ForceCard)
    x_n, size_n = (card.plot.curves[curve].getData()[1] for curve in (0, 3))
    assert x_n == pytest.approx(1.5)
    assert size_n == pytest.approx(3.0)
    assert card.wake.curve.getData()[1] == pytest.approx(0.5)
    assert rows(bridge)["Force, share of 6 N"] == "50\u2009%, most 50\u2009%"
    assert rows(bridge)["Limiters acted"] == "force 7"
    assert rows(bridge)[WITHHELD] == "6.2\u2009%"
    assert bridge.operator.header.blind.word == "Single-blind"


def test_double_blind_looks_at_no_force(bridge: SessionBridge, world: World) -> None:
    looked(bridge, world)
    assert bridge.monitor.forces is None
    assert isinstance(bridge.operator.force, HiddenForceCard)
    assert rows(bridge)["Force, share of 6 N"] == rows(bridge)["Limiters acted"] == rows(bridge)[WITHHELD] == "hidden"
    assert bridge.operator.header.blind.word == "Double-blind"


def test_the_participant_sees_the_same_in_both(make: Any, world: World) -> None:
    seen = []
    for blinding, limit_n in (("double", None), ("single", 6.0)):
        bridge = make(blinding=blinding, force_limit_n=limit_n)
        looked(bridge, world)
        seen.append((repr(bridge.participant.page), bridge.participant.grab().toImage()))
        bridge.leave_now()
        world.samples = records(SAMPLE, 0)
    assert seen[0][0] == seen[1][0]
    assert seen[0][1] == seen[1][1]
