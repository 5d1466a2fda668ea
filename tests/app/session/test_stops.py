"""Stopping the force: at once, whatever the disk does, and back only when the one who stopped it asks."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from study_app.session.pages import PausePage, TaskPage, TroublePage
from study_app.session.transitions.events import ForceStopped, ResumeAsked
from tests.app.world import begin_trial

pytestmark = pytest.mark.slow


def test_stop_force_reaches_the_servo_before_the_disk(bridge, world):
    begin_trial(bridge, world)
    before = len(world.done)
    bridge.operator.stop_asked.emit()
    after = world.done[before:]
    assert after[0] == "stop_force"
    assert "force_stopped" in world.events()
    assert isinstance(bridge.participant.page, PausePage)
    assert bridge.operator.stop.word.text() == "Force is off"


def test_stop_force_works_with_a_full_disk(bridge, world, caplog):
    begin_trial(bridge, world)
    world.full = True
    bridge.operator.stop_asked.emit()
    assert not world.force_is_on
    assert isinstance(bridge.participant.page, TroublePage)
    assert "No space left" in bridge.operator.banner.what.text()
    assert bridge.operator.header.state.word == "Waiting for the disk"
    assert "no space left" in caplog.text
    caplog.clear()


def test_when_there_is_space_again_the_session_goes_on_paused_with_nothing_lost(bridge, world, caplog):
    begin_trial(bridge, world)
    world.full = True
    bridge.operator.mark_set.emit()
    bridge.operator.note_written.emit("dropped while the disk is full")
    assert "Free disk space" in bridge.operator.banner.then.text()
    assert bridge.operator.device.chip.word == "Ready"
    world.full = False
    world.now_s += 2.0
    bridge.draw_frame()
    assert isinstance(bridge.participant.page, PausePage)
    assert not bridge.operator.banner.isVisible()
    assert ("note", {"kind": "mark", "text": ""}) in world.done
    bridge.operator.fade_in_asked.emit()
    assert isinstance(bridge.participant.page, TaskPage)
    assert world.force_is_on
    assert "accepts data again" in caplog.text
    caplog.clear()


def test_the_participants_stop_reaches_the_servo_at_once(bridge, world):
    begin_trial(bridge, world)
    bridge.participant.event.emit(ForceStopped(world.now_s, "participant"))
    assert not world.force_is_on
    assert ("force_stopped", {"by": "participant"}) in world.done


def test_the_participant_cannot_bring_back_a_force_that_the_operator_stopped(bridge, world):
    begin_trial(bridge, world)
    bridge.operator.stop_asked.emit()
    assert bridge.participant.page == PausePage(force_off=True, held="force")
    before = list(world.done)
    QTest.keyClick(bridge.participant.widget, Qt.Key.Key_Return)
    bridge.participant.event.emit(ResumeAsked(world.now_s, "participant"))
    assert not world.force_is_on
    assert world.done == before
    bridge.operator.fade_in_asked.emit()
    assert world.force_is_on
    assert ("force_restored", {"by": "operator"}) in world.done


def test_fade_in_brings_the_force_back_and_the_trial_again(bridge, world):
    begin_trial(bridge, world)
    bridge.operator.stop_asked.emit()
    bridge.operator.fade_in_asked.emit()
    assert world.force_is_on
    assert isinstance(bridge.participant.page, TaskPage)
    assert world.events().count("trial_started") == 2
