"""Both windows on one screen: state and force stop stay in sight, and each window leads to the other."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from study_app.gui.operator.strip import Strip
from study_app.session.transitions.events import Continue
from tests.app.world import begin_trial

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
