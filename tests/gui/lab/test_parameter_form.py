"""Every parameter has slider and field, no typing is lost, and the force can be stopped from everywhere."""

import dataclasses
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest

from study_app.gui.lab.lab_state import LabView
from study_app.gui.widgets.main_view import HOLD_MS, EscapeKey
from study_app.lab.parameters import OFF
from tests.gui.lab.sample import blind, heard
from tests.gui.walk import settle

pytestmark = pytest.mark.slow


@pytest.fixture
def changes(place: Any, still: LabView) -> list[tuple[Any, ...]]:
    recorded: list[tuple[Any, ...]] = []
    place.asked.connect(lambda what, details: recorded.append(details) if what == "change" else None)
    place.show_view(still)
    return recorded


def fields(place: Any) -> dict[str, Any]:
    return {name: row for name, row in place.form.rows.items() if hasattr(row, "slider")}


def enter(field: Any, text: str) -> None:
    field.selectAll()
    QTest.keyClicks(field, text)
    QTest.keyClick(field, Qt.Key.Key_Return)


def test_entering_a_shown_number_again_leaves_the_parameter_exactly_unchanged(
    place: Any, changes: Any, still: LabView
) -> None:
    """Neither units nor rounding change a parameter that was only viewed."""
    for name, row in fields(place).items():
        value = still.workbench.a.value(name)
        if value is None:
            continue
        changes.clear()
        QTest.keyClick(row.field, Qt.Key.Key_End)
        row.field.setModified(True)
        QTest.keyClick(row.field, Qt.Key.Key_Return)
        assert changes == [(name, value, False)]


def test_a_refused_value_stays_with_its_reason_until_it_is_corrected(place: Any, changes: Any, still: LabView) -> None:
    row = fields(place)["wake.length"]
    enter(row.field, "9000")
    why = "length 9000 exceeds scaling 2600: reduce length or increase scaling"
    refused = dataclasses.replace(still, refused=("wake.length", why))
    for _ in range(3):
        place.show_view(refused)
    assert (row.field.text(), row.field.state, row.why.text()) == ("9000", "refused", why)
    assert row.field.accessibleDescription() == why
    roomier = still.workbench.change("wake.scaling", 9500)
    place.show_view(dataclasses.replace(still, workbench=roomier))
    assert (row.field.text(), row.field.state) == ("9000", "refused")
    QTest.keyClick(row.field, Qt.Key.Key_Return)  # what was in its way is gone: try again
    assert changes[-1] == ("wake.length", 9000, False)
    place.show_view(dataclasses.replace(still, workbench=roomier.change("wake.length", 9000)))
    assert (row.field.text(), row.field.state, row.refused) == ("9000", "changed", "")


def test_a_number_that_can_be_read_in_two_ways_changes_nothing(place: Any, changes: Any) -> None:
    row = fields(place)["wake.length"]
    enter(row.field, "2,500")
    assert changes == []
    assert (row.field.text(), row.field.state) == ("2,500", "refused")
    assert row.why.text() == "“2,500” can be read as 2.5 or 2500: write 2.5 or 2500, or press Esc."
    enter(row.field, "2500")
    assert changes[-1] == ("wake.length", 2500, False)


def test_switching_sides_releases_a_held_knob_and_discards_typing(place: Any, changes: Any, still: LabView) -> None:
    name = "liquid.density_kg_m3"
    row, other = fields(place)[name], still.workbench.switch()
    QTest.mousePress(row.slider, Qt.MouseButton.LeftButton)
    QTest.keyClicks(row.field, "7")
    assert row.slider.dragged
    place.show_view(dataclasses.replace(still, workbench=other))
    assert not row.slider.dragged
    assert float(row.field.text()) == other.in_hand.value(name) != still.workbench.in_hand.value(name)


def test_stop_force_speaks_at_the_press_and_is_never_disabled_hidden_or_moved(place: Any, still: LabView) -> None:
    place.show_view(still)
    said = heard(place, "stop")
    QTest.mousePress(place.header.stop, Qt.MouseButton.LeftButton)
    assert len(said) == 1
    QTest.mouseRelease(place.header.stop, Qt.MouseButton.LeftButton)
    views = [
        still,
        dataclasses.replace(still, force_on=False),
        dataclasses.replace(still, busy="Opening the Falcon"),
        dataclasses.replace(still, trouble="The device is gone: plug it in again."),
        dataclasses.replace(still, workbench=blind(still.workbench)),
    ]
    for width in (1528, 952):
        place.resize(width, 640)
        settle(place)
        places = set()
        for view in views:
            place.show_view(view)
            settle(place)
            stop = place.header.stop
            assert stop.isEnabled()
            assert stop.isVisible()
            assert place.rect().contains(stop.geometry())
            assert stop.height() >= 44
            places.add(stop.mapTo(place, QPoint()).toTuple())
        assert len(places) == 1


def test_esc_held_stops_the_force_from_any_part_also_while_a_preset_is_being_saved(
    place: Any, still: LabView, qtbot: Any
) -> None:
    place.show_view(still)
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is not None)
    with qtbot.waitSignal(place.asked, timeout=HOLD_MS + 2000, check_params_cb=lambda what, _: what == "stop"):
        QTest.keyPress(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)
    QTest.keyRelease(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)
    said = heard(place, "stop")
    place.header.save.click()
    assert not place.dialog.isModal()
    place.dialog.activateWindow()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is place.dialog.windowHandle())
    with qtbot.waitSignal(place.asked, timeout=HOLD_MS + 2000, check_params_cb=lambda what, _: what == "stop"):
        QTest.keyPress(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)  # which closes the dialog at once
    place.window().activateWindow()
    qtbot.waitUntil(lambda: QGuiApplication.focusWindow() is not None)
    QTest.keyRelease(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)
    assert len(said) == 1
    place.header.save.click()
    place.hide()
    assert place.dialog is None, "a dialog goes with the place"
    place.findChild(EscapeKey).held.emit()
    assert len(said) == 1, "Esc held elsewhere asks nothing of a lab that was left"


def test_the_keyboard_stays_in_a_switch_that_takes_parameters_away(place: Any, changes: Any, still: LabView) -> None:
    switch = place.form.rows["effects.wake"]
    switch.parts()[0].setFocus()
    place.show_view(dataclasses.replace(still, workbench=still.workbench.change("effects.wake", OFF)))
    assert "wake.length" not in place.form.rows
    again = place.form.rows["effects.wake"]
    assert again is not switch
    assert again.parts()[0].hasFocus()
