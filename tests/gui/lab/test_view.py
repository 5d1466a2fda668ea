"""The blinded lab reveals nothing; and motion by the pointer."""

import dataclasses
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QComboBox, QLabel, QLineEdit, QWidget

from study_app.gui.lab.lab_state import LabView
from tests.gui.lab.sample import blind, heard, workbench
from tests.gui.walk import settle

pytestmark = pytest.mark.slow


def visible_widgets(place: Any) -> list[QWidget]:
    return [it for it in place.findChildren(QWidget) if it.isVisible()]


def words_of(place: Any) -> str:
    said = []
    for it in visible_widgets(place):
        said += [it.accessibleName(), it.accessibleDescription(), it.toolTip()]
        if isinstance(it, QLabel | QAbstractButton | QLineEdit):
            said.append(it.text())
        if isinstance(it, QComboBox):
            said.append(it.currentText())
    return " | ".join(said)


def test_while_blind_nothing_tells_the_settings_apart(place: Any, moved: LabView) -> None:
    """Two pairs of liquids, felt with the same motion, look the same to the last pixel."""
    pictures = []
    for bench in (workbench(), workbench("honey", "syrup")):
        place.show_view(dataclasses.replace(moved, workbench=bench))
        settle(place)
        place.show_view(dataclasses.replace(moved, workbench=blind(bench)))
        settle(place)
        pictures.append(place.grab().toImage())
        words = words_of(place)
        for name in ("Water", "oil", "Honey", "Syrup", "edited", "84", "8 N", "1700", "segment", "Slew"):
            assert name not in words, name
        assert "Setting 1" in words
        assert "Setting 2" in words
        assert "The errors relative to the reference would reveal the settings." in words
    assert pictures[0] == pictures[1]


def test_while_blind_both_sides_look_alike_but_for_which_is_felt(place: Any, moved: LabView) -> None:
    pictures = []
    place.show_view(moved)
    settle(place)
    for first, presented in (("A", "A"), ("B", "B")):
        bench = blind(moved.workbench, first=first, presented=presented)
        other = {} if presented == "A" else {"cost": moved.cost[:2], "errors": (), "limiters": moved.limiters[:3]}
        place.show_view(dataclasses.replace(moved, workbench=bench, **other))
        settle(place)
        pictures.append(place.grab().toImage())
        first_segment, second_segment = place.header.sides.segments.values()
        assert (first_segment.text(), second_segment.text(), first_segment.isChecked(), second_segment.isChecked()) == (
            "Setting 1",
            "Setting 2",
            True,
            False,
        )
        assert (len(place.cost.lines), len(place.limiters.lines)) == (5, 11)  # nothing behind the curtain moves
    assert pictures[0] == pictures[1]


def test_the_mouse_moves_the_ball_from_a_click_to_the_next_and_only_while_it_leads(place: Any, still: LabView) -> None:
    moves, bits = heard(place, "point"), heard(place, "press")
    place.show_view(still)
    middle = place.tank.rect().center()
    QTest.mouseClick(place.tank, Qt.MouseButton.LeftButton, pos=middle)
    assert place.tank.pointer.is_held
    QTest.mouseMove(place.tank, middle + QPoint(40, 10))
    assert moves[-1] != moves[0]
    QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
    assert not place.tank.pointer.is_held
    assert bits[-1] == (0,)
    for fields in ({"path": "zigzag"}, {"busy": "Opening"}):
        place.show_view(still)
        QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
        assert place.tank.pointer.is_held
        place.show_view(dataclasses.replace(still, **fields))  # type: ignore[arg-type]
        assert not place.tank.pointer.is_held
        QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
        assert not place.tank.pointer.is_held


def test_a_device_that_failed_is_tried_again_or_examined(place: Any, still: LabView) -> None:
    requests: list[str] = []
    place.asked.connect(lambda what, _details: requests.append(what))
    lost = dataclasses.replace(still.device, state="stopped", diagnosable=True)
    place.show_view(dataclasses.replace(still, device=lost, trouble="the Falcon is gone", force_on=False))
    for button in (place.note.fade_in, place.note.diagnose):
        QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert (place.note.fade_in.text(), requests) == ("Try again", ["fade in", "diagnose"])
    for changed, trouble in (({"diagnosable": False}, "the mouse is gone"), ({"state": "ready"}, "no such file")):
        device = dataclasses.replace(lost, **changed)
        place.show_view(dataclasses.replace(still, device=device, trouble=trouble, force_on=False))
        assert (place.note.fade_in.isVisible(), place.note.diagnose.isVisible()) == (True, False), trouble


def test_escape_and_leaving_give_the_pointer_back(place: Any, still: LabView) -> None:
    place.show_view(still)
    place.tank.setFocus()
    QTest.keyClick(place.tank, Qt.Key.Key_Return)
    assert place.tank.pointer.is_held
    QTest.keyClick(place.tank, Qt.Key.Key_Escape)
    assert not place.tank.pointer.is_held
    QTest.keyClick(place.tank, Qt.Key.Key_Space)
    assert place.tank.pointer.is_held
    place.hide()
    assert not place.tank.pointer.is_held


def test_a_hidden_tank_and_an_inactive_window_release_the_pointer(place: Any, still: LabView, qtbot: Any) -> None:
    tank, other = place.tank, QWidget()
    qtbot.addWidget(other)
    place.show_view(still)
    qtbot.waitUntil(place.isActiveWindow)

    def capture() -> None:
        QTest.keyClick(tank, Qt.Key.Key_Enter)
        assert tank.pointer.is_held
        assert tank.cursor().shape() == Qt.CursorShape.BlankCursor

    capture()
    tank.hide()
    assert not tank.pointer.is_held
    assert tank.cursor().shape() == Qt.CursorShape.ArrowCursor
    tank.show()
    capture()
    other.show()
    other.activateWindow()
    qtbot.waitUntil(lambda: not place.isActiveWindow())
    assert not tank.pointer.is_held


def test_the_right_button_is_reported_and_keeps_the_pointer(place: Any, still: LabView) -> None:
    bits = heard(place, "press")
    place.show_view(still)
    QTest.mouseClick(place.tank, Qt.MouseButton.RightButton)
    assert not place.tank.pointer.is_held, "only the left button captures the pointer"
    QTest.mouseClick(place.tank, Qt.MouseButton.LeftButton)
    QTest.mousePress(place.tank, Qt.MouseButton.RightButton)
    assert bits == [(2,)]
    assert place.tank.pointer.is_held
    place.tank.hide()
    assert bits == [(2,), (0,)]
    QTest.mouseRelease(place.tank, Qt.MouseButton.RightButton)  # Qt would keep it for the next test
