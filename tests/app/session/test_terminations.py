"""How a session ends: by a question, by closing a window, from outside, with a disk that takes nothing."""

import pytest
from PySide6.QtCore import Qt
from shiboken6 import isValid

from study_app.session.pages import EndPage
from tests.app.world import begin_trial

pytestmark = pytest.mark.slow


def test_ending_closes_the_journal_with_status_and_reason_and_waits_to_be_closed(bridge, world, qtbot):
    begin_trial(bridge, world)
    bridge.operator.end_asked.emit("withdrawn", "felt unwell")
    assert world.done[-1] == ("session_ended", {"status": "withdrawn", "reason": "felt unwell"})
    assert isinstance(bridge.participant.page, EndPage)
    assert bridge.operator.buttons.close_session.isVisible()
    with qtbot.waitSignal(bridge.done):
        qtbot.mouseClick(bridge.operator.buttons.close_session, Qt.MouseButton.LeftButton)
    assert not any(window.isVisible() for window in (bridge.operator, bridge.participant) if isValid(window))


def test_closing_the_operators_window_stops_the_force_and_asks(bridge, world, qtbot):
    begin_trial(bridge, world)
    bridge.operator.close()
    assert not world.force_is_on
    assert bridge.operator.isVisible()
    assert bridge.operator.question is not None
    assert "session_ended" not in world.events()
    bridge.operator.question.accept()
    assert world.done[-1][1]["status"] == "aborted"
    with qtbot.waitSignal(bridge.done):
        bridge.operator.close()


def test_closing_it_again_leaves_the_session_unfinished(bridge, world, qtbot):
    begin_trial(bridge, world)
    bridge.operator.close()
    with qtbot.waitSignal(bridge.done):
        bridge.operator.close()
    assert "session_ended" not in world.events()
    assert not world.force_is_on


def test_ending_from_outside_is_zero_force_no_end_and_gone_once(bridge, world, qtbot):
    begin_trial(bridge, world)
    gone = []
    bridge.done.connect(lambda: gone.append(True))
    bridge.leave_now()
    bridge.leave_now()
    assert gone == [True]
    assert not world.force_is_on
    assert "session_ended" not in world.events()


def test_an_end_that_cannot_be_written_still_lets_the_windows_go(bridge, world, qtbot, caplog):
    begin_trial(bridge, world)
    world.full = True
    bridge.operator.end_asked.emit("aborted", "")
    assert not world.force_is_on
    assert "No space left" in bridge.operator.banner.what.text()
    assert bridge.runner.stalled
    with qtbot.waitSignal(bridge.done):
        bridge.operator.close()
    assert "no space left" in caplog.text
    caplog.clear()


def test_windows_answer_while_recordings_are_written_and_close_after_it(make, world, qtbot):
    class Slow:
        lost, dropped, on_disk = (), 0, False

        def start(self, *_arguments):
            pass

        append = frame = stop = start

        def settled(self):
            return self.on_disk

    recorder = Slow()
    bridge = make(recorder=recorder)
    begin_trial(bridge, world)
    bridge.operator.end_asked.emit("withdrawn", "tired")
    bridge.runner.poll()
    assert isinstance(bridge.participant.page, EndPage)
    assert bridge.runner.ending
    bridge.operator.close_asked.emit()
    assert not bridge.participant.may_close, "the end is still to be written"
    recorder.on_disk = True
    with qtbot.waitSignal(bridge.done):
        bridge.runner.poll()
