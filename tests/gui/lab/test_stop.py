"""The lab's force can be stopped from wherever one is, and nothing that is held goes on after a change of side."""

import dataclasses
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest

from study_app.gui.widgets.escape_key import HOLD_MS, EscapeAnywhere
from study_app.viewmodels.lab import LabView
from tests.gui.lab.sample import blind, heard, settle

pytestmark = pytest.mark.slow


def test_stop_force_speaks_at_the_press(place: Any, still: LabView) -> None:
    place.show_view(still)
    said = heard(place, "stop_asked")
    QTest.mousePress(place.header.stop, Qt.MouseButton.LeftButton)
    assert len(said) == 1


def test_stop_force_is_never_disabled_hidden_or_moved(place: Any, still: LabView) -> None:
    views = [
        still,
        dataclasses.replace(still, force_on=False),
        dataclasses.replace(still, busy="Opening the Falcon"),
        dataclasses.replace(still, trouble="The device is gone: plug it in again."),
        dataclasses.replace(still, workbench=blind(still.workbench)),
    ]
    for width in (1528, 952):
        place.resize(width, 640)
        settle()
        places = set()
        for view in views:
            place.show_view(view)
            settle()
            stop = place.header.stop
            assert stop.isEnabled()
            assert stop.isVisible()
            assert place.rect().contains(stop.geometry())
            assert stop.height() >= 44
            places.add(stop.mapTo(place, QPoint()).toTuple())
        assert len(places) == 1


def test_esc_held_stops_the_force_from_any_part(place: Any, still: LabView, qtbot: Any) -> None:
    place.show_view(still)
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is not None)
    with qtbot.waitSignal(place.stop_asked, timeout=HOLD_MS + 2000):
        QTest.keyPress(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)
    QTest.keyRelease(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)


def test_the_force_can_be_stopped_while_a_preset_is_being_saved(place: Any, still: LabView, qtbot: Any) -> None:
    said = heard(place, "stop_asked")
    place.show_view(still)
    place.header.save.click()
    assert not place.dialog.isModal()
    place.dialog.activateWindow()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is place.dialog.windowHandle())
    with qtbot.waitSignal(place.stop_asked, timeout=HOLD_MS + 2000):
        QTest.keyPress(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)  # which closes the dialog at once
    place.window().activateWindow()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is not None)
    QTest.keyRelease(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)
    assert len(said) == 1


def test_a_dialog_goes_with_the_place(place: Any, still: LabView) -> None:
    place.show_view(still)
    place.header.save.click()
    place.hide()
    assert place.dialog is None


def test_esc_held_elsewhere_asks_nothing_of_a_lab_that_was_left(place: Any, still: LabView) -> None:
    place.show_view(still)
    said = heard(place, "stop_asked")
    place.hide()
    place.findChild(EscapeAnywhere).held.emit()
    assert said == []


def test_a_knob_held_while_the_other_side_is_called_for_changes_nothing_there(place: Any, still: LabView) -> None:
    place.show_view(still)
    slider = place.form.rows["wake.length"].slider
    QTest.mousePress(slider, Qt.MouseButton.LeftButton, pos=QPoint(30, 16))
    place.show_view(dataclasses.replace(still, workbench=still.workbench.switch()))
    said = heard(place, "changed")
    QTest.mouseMove(slider, QPoint(50, 16))
    QTest.mouseRelease(slider, Qt.MouseButton.LeftButton, pos=QPoint(50, 16))
    assert said == []
