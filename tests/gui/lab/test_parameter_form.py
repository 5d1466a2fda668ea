"""Every parameter with slider and field, nothing typed is lost; the force can be stopped from wherever one is."""

import dataclasses
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest

from study_app.gui.lab.parameter_rows import NumberRow, SwitchRow
from study_app.gui.widgets.escape_key import HOLD_MS, EscapeAnywhere
from study_app.viewmodels.lab import LabView
from tests.gui.lab.sample import blind, heard, still_view, workbench
from tests.gui.walk import settle

pytestmark = pytest.mark.slow


@pytest.fixture
def told(place: Any, still: LabView) -> list[tuple[Any, ...]]:
    said: list[tuple[Any, ...]] = []
    place.changed.connect(lambda *what: said.append(what))
    place.show_view(still)
    return said


def fields(place: Any) -> dict[str, NumberRow]:
    return {name: row for name, row in place.form.rows.items() if isinstance(row, NumberRow)}


def enter(field: Any, text: str) -> None:
    field.selectAll()
    QTest.keyClicks(field, text)
    QTest.keyClick(field, Qt.Key.Key_Return)


def test_every_number_says_exactly_what_it_shows_when_entered_again(place: Any, told: Any, still: LabView) -> None:
    """Millimetres and rounding do not creep into a parameter that was only looked at."""
    for name, row in fields(place).items():
        value = still.workbench.a.value(name)
        if value is None:
            continue
        told.clear()
        QTest.keyClick(row.field, Qt.Key.Key_End)
        row.field.setModified(True)
        QTest.keyClick(row.field, Qt.Key.Key_Return)
        assert told == [(name, value, False)]


def test_typing_and_sliding_take_si_units_and_say_when_it_is_held(place: Any, told: Any) -> None:
    enter(fields(place)["body.diameter_m"].field, "50")
    assert told == [("body.diameter_m", pytest.approx(0.05), False)]
    told.clear()
    row = fields(place)["wake.breaking_span_m"]
    middle = QPoint(row.slider.width() // 2, row.slider.height() // 2)
    QTest.mousePress(row.slider, Qt.MouseButton.LeftButton, pos=middle)
    assert row.field.text() == "250"
    place.show_view(still_view(workbench(breaking_span_m=0.1)))  # a refresh amid a drag does not pull the knob away
    assert row.slider.number == pytest.approx(250, abs=8)
    QTest.mouseRelease(row.slider, Qt.MouseButton.LeftButton, pos=middle)
    assert [held for _, _, held in told] == [True, False]
    assert told[-1][1] == pytest.approx(0.25, abs=0.008)


def test_what_is_no_number_is_said_in_one_line_and_stays(place: Any, told: Any, still: LabView) -> None:
    row = fields(place)["wake.exponent"]
    enter(row.field, "0.5.5")
    assert told == []
    assert row.why.isVisible()
    assert "“0.5.5” is not a number" in row.why.text()
    place.show_view(dataclasses.replace(still, measuring=True))
    assert row.field.text() == "0.5.5"
    assert row.field.state == "refused"
    QTest.keyClick(row.field, Qt.Key.Key_Escape)
    assert row.field.text() == "0.6"
    assert row.field.state == "changed"
    assert not row.why.isVisible()


def test_what_the_model_refuses_stays_with_the_reason_until_it_is_mended(place: Any, told: Any, still: LabView) -> None:
    row = fields(place)["wake.length"]
    enter(row.field, "9000")
    why = "length 9000 exceeds scaling 2600: lower length or raise scaling"
    refused = dataclasses.replace(still, refused=("wake.length", why))
    for _ in range(3):
        place.show_view(refused)
    assert (row.field.text(), row.field.state, row.why.text()) == ("9000", "refused", why)
    assert row.field.accessibleDescription() == why
    roomier = still.workbench.change("wake.scaling", 9500)
    place.show_view(dataclasses.replace(still, workbench=roomier))
    assert (row.field.text(), row.field.state) == ("9000", "refused")
    QTest.keyClick(row.field, Qt.Key.Key_Return)  # what was in its way is gone: try again
    assert told[-1] == ("wake.length", 9000, False)
    place.show_view(dataclasses.replace(still, workbench=roomier.change("wake.length", 9000)))
    assert (row.field.text(), row.field.state, row.refused) == ("9000", "changed", "")


def test_escape_leaves_what_was_refused(place: Any, told: Any, still: LabView) -> None:
    row = fields(place)["wake.length"]
    row.slider.setValue(row.slider.maximum())
    refused = ("wake.length", "too long")
    place.show_view(dataclasses.replace(still, refused=refused))
    assert (row.field.text(), row.slider.number) == ("100000", 100_000)
    row.field.setFocus()
    QTest.keyClick(row.field, Qt.Key.Key_Escape)
    assert (row.field.text(), row.slider.number, row.refused) == ("1700", 1700, "")
    place.show_view(dataclasses.replace(still, refused=refused, measuring=True))
    assert row.refused == ""
    place.show_view(dataclasses.replace(still, refused=(refused[0], refused[1])))
    assert row.refused == "too long"


@pytest.mark.parametrize("name", ["effects.history", "velocity.kind"])
def test_lists_and_switches_wait_for_the_view(place: Any, told: Any, still: LabView, name: str) -> None:
    row = place.form.rows[name]
    if isinstance(row, SwitchRow):
        row.toggle.click()
        assert not row.toggle.isChecked()
    else:
        before = row.choice.currentIndex()
        row.choice.activated.emit(before + 1)
        assert row.choice.currentIndex() == before
    assert len(told) == 1
    place.show_view(dataclasses.replace(still, refused=(name, "it needs a viscosity")))
    assert row.why.isVisible()
    assert row.why.text() == "it needs a viscosity"


def test_an_effect_that_comes_brings_its_rows_and_the_keyboard_stays(place: Any, told: Any, still: LabView) -> None:
    toggle = place.form.rows["effects.added_mass"].toggle
    toggle.setFocus()
    QTest.keyClick(toggle, Qt.Key.Key_Space)
    assert told == [("effects.added_mass", "on", False)]
    more = dataclasses.replace(still, workbench=still.workbench.change(*told[0][:2]))
    place.show_view(more)
    assert "added_mass.coefficient" in place.form.rows
    assert place.form.rows["effects.added_mass"].toggle is toggle
    assert toggle.isChecked()
    assert place.focusWidget() is toggle
    place.show_view(still)
    assert "added_mass.coefficient" not in place.form.rows


def test_tab_goes_through_every_part_from_top_to_bottom(place: Any, told: Any, still: LabView) -> None:
    place.show_view(dataclasses.replace(still, workbench=still.workbench.change("effects.added_mass", "on")))
    wanted = [part for row in place.form.rows.values() for part in row.parts()]
    found, part = [], place.form.copy
    for _ in range(3 * len(wanted)):
        part = part.nextInFocusChain()
        if part in wanted:
            found.append(part)
        if len(found) == len(wanted):
            break
    assert found == wanted


def test_the_liquid_and_the_copy_name_their_sides(place: Any, told: Any, still: LabView) -> None:
    chosen = []
    place.liquid_chosen.connect(lambda *what: chosen.append(what))
    assert place.form.liquid.currentText() == "Water"
    assert place.form.copy.text() == "Copy to B"
    place.form.liquid.activated.emit(1)
    place.show_view(dataclasses.replace(still, workbench=still.workbench.switch()))
    assert place.form.liquid.currentText() == "Light oil"
    assert place.form.copy.text() == "Copy to A"
    place.form.liquid.activated.emit(3)
    assert [(side, choice.title) for side, choice in chosen] == [("A", "Honey"), ("B", "Syrup")]


def test_stop_force_speaks_at_the_press_and_is_never_disabled_hidden_or_moved(place: Any, still: LabView) -> None:
    place.show_view(still)
    said = heard(place, "stop_asked")
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
    with qtbot.waitSignal(place.stop_asked, timeout=HOLD_MS + 2000):
        QTest.keyPress(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)
    QTest.keyRelease(QGuiApplication.focusWindow(), Qt.Key.Key_Escape)
    said = heard(place, "stop_asked")
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
    place.header.save.click()
    place.hide()
    assert place.dialog is None, "a dialog goes with the place"
    place.findChild(EscapeAnywhere).held.emit()
    assert len(said) == 1, "Esc held elsewhere asks nothing of a lab that was left"


def test_a_knob_held_while_the_other_side_is_called_for_changes_nothing_there(place: Any, still: LabView) -> None:
    place.show_view(still)
    slider = place.form.rows["wake.length"].slider
    QTest.mousePress(slider, Qt.MouseButton.LeftButton, pos=QPoint(30, 16))
    place.show_view(dataclasses.replace(still, workbench=still.workbench.switch()))
    said = heard(place, "changed")
    QTest.mouseMove(slider, QPoint(50, 16))
    QTest.mouseRelease(slider, Qt.MouseButton.LeftButton, pos=QPoint(50, 16))
    assert said == []
