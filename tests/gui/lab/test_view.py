"""The lab draws a view and says what is asked for; it can be used by keyboard alone, and blind it tells nothing."""

import dataclasses
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QComboBox, QLabel, QLineEdit, QWidget

from study_app.gui.lab.tank_note import SHOWN_AFTER_MS
from study_app.lab.ab_comparison import Workbench
from study_app.viewmodels.lab import LabView
from tests.gui.lab.sample import blind, heard, still_view, workbench
from tests.gui.walk import settle

pytestmark = pytest.mark.slow


def shown(place: Any) -> list[QWidget]:
    return [it for it in place.findChildren(QWidget) if it.isVisible()]


def words_of(place: Any) -> str:
    said = []
    for it in shown(place):
        said += [it.accessibleName(), it.accessibleDescription(), it.toolTip()]
        if isinstance(it, QLabel | QAbstractButton | QLineEdit):
            said.append(it.text())
        if isinstance(it, QComboBox):
            said.append(it.currentText())
    return " | ".join(said)


def test_the_felt_side_is_seen_and_buttons_and_keys_ask_also_from_within_a_field(place: Any) -> None:
    edited = workbench().change("wake.length", 100)
    names = ("switched", "undo_asked", "redo_asked", "blind_asked", "stop_asked")
    said = {name: heard(place, name) for name in names}
    place.show_view(still_view(edited))
    a, b = place.header.sides.segments.values()
    assert (a.isChecked(), b.isChecked()) == (True, False)
    assert a.accessibleName() == "A: Water, edited, felt now"
    assert (place.header.undo.isEnabled(), place.header.redo.isEnabled()) == (True, False)
    place.show_view(still_view(edited.undo()))
    assert place.header.redo.isEnabled()
    field = place.form.rows["wake.length"].field
    for target in (place, field):
        target.setFocus()
        for sequence in ("X", "Ctrl+Z", "Ctrl+Shift+Z"):
            QTest.keySequence(target, QKeySequence(sequence))
    assert field.text() == "1700"
    for button in (a, b, *(getattr(place.header, name) for name in ("undo", "redo", "blind", "stop"))):
        button.click()
    assert [len(said[name]) for name in names] == [3, 3, 3, 1, 1]
    assert said["blind_asked"] == [(True,)]
    assert a.isChecked()  # the view says when it is the other
    place.show_view(still_view(edited.switch()))
    assert b.isChecked()
    place.show_view(still_view(Workbench(workbench().b, workbench().b)))
    assert not place.header.undo.isEnabled()


def test_waiting_is_told_after_300_ms_and_can_be_cancelled(place: Any, still: LabView, qtbot: Any) -> None:
    said = heard(place, "cancel_asked")
    busy = dataclasses.replace(still, busy="Opening the Falcon")
    place.show_view(busy)
    assert not place.note.isVisible()
    assert place.note.findChild(QTimer).interval() == SHOWN_AFTER_MS
    qtbot.waitUntil(place.note.isVisible)
    assert place.note.words.text() == "Opening the Falcon\u00a0…"
    place.note.cancel.click()
    assert said == [()]
    place.show_view(busy)
    place.show_view(dataclasses.replace(still, trouble="No Falcon answers: check its cable."))
    assert place.note.words.text() == "No Falcon answers: check its cable."
    assert not place.note.cancel.isVisible()


def test_trouble_beside_a_force_that_is_on_can_be_put_away_until_there_is_another(place: Any, still: LabView) -> None:
    full = dataclasses.replace(still, trouble="The disk is full: free some room.")
    place.show_view(full)
    assert place.note.words.text() == full.trouble
    assert not place.note.fade_in.isVisible()
    place.note.dismiss.click()
    place.show_view(dataclasses.replace(full, measuring=True))
    assert not place.note.isVisible()
    place.show_view(dataclasses.replace(full, trouble="The folder is gone: choose another."))
    assert place.note.isVisible()
    place.show_view(dataclasses.replace(full, force_on=False))
    assert place.note.fade_in.text() == "Try again"


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
    assert pictures[0] == pictures[1]


def test_while_blind_both_sides_look_alike_but_for_which_is_felt(place: Any, moved: LabView) -> None:
    pictures = []
    place.show_view(moved)
    settle(place)
    for first, felt in (("A", "A"), ("B", "B")):
        bench = blind(moved.workbench, first=first, felt=felt)
        other = {} if felt == "A" else {"cost": moved.cost[:2], "errors": (), "limiters": moved.limiters[:3]}
        place.show_view(dataclasses.replace(moved, workbench=bench, **other))
        settle(place)
        pictures.append(place.grab().toImage())
        one, two = place.header.sides.segments.values()
        assert (one.text(), two.text(), one.isChecked(), two.isChecked()) == ("Setting 1", "Setting 2", True, False)
        assert (len(place.cost.lines), len(place.limiters.lines)) == (5, 11)  # nothing behind the curtain moves
    assert pictures[0] == pictures[1]


def chosen(place: Any, button: Any, file: Path) -> str:
    """Press a button and choose a file in its dialog; return the dialog's title and the name that it suggests."""
    button.click()
    assert place.dialog.isVisible()
    suggested = place.dialog.findChild(QLineEdit, "fileNameEdit").text()
    title: str = f"{place.dialog.windowTitle()}: {suggested}"
    place.dialog.fileSelected.emit(str(file))
    place.dialog.reject()
    assert place.dialog is None
    return title


def test_presets_are_saved_opened_and_used_where_one_says(place: Any, still: LabView, tmp_path: Path) -> None:
    place.show_view(still)
    saved, opened, used = (heard(place, name) for name in ("save_asked", "preset_opened", "use_asked"))
    assert chosen(place, place.header.save, tmp_path / "mine.toml").endswith("Water, edited: water-edited.toml")
    chosen(place, place.form.open, tmp_path / "syrup.toml")
    assert "Water" in chosen(place, place.form.use, tmp_path / "study.toml")
    assert saved == [(tmp_path / "mine.toml", still.workbench.a)]
    assert opened == [(tmp_path / "syrup.toml",)]
    assert used == [(tmp_path / "study.toml", still.workbench.a)]
    assert not place.form.said.isVisible()
    place.show_view(replace(still, said="Saved as syrup.toml in /there"))
    assert place.form.said.accessibleName() == "Saved as syrup.toml in /there"


def test_the_mouse_moves_the_ball_from_a_click_to_the_next_and_only_while_it_leads(place: Any, still: LabView) -> None:
    moves, bits = heard(place, "hand_moved"), heard(place, "hand_pressed")
    place.show_view(still)
    middle = place.tank.rect().center()
    QTest.mouseClick(place.tank, Qt.MouseButton.LeftButton, pos=middle)
    assert place.tank.pointer.held
    QTest.mouseMove(place.tank, middle + QPoint(40, 10))
    assert moves[-1] != moves[0]
    QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
    assert not place.tank.pointer.held
    assert bits[-1] == (0,)
    for fields in ({"path": "zigzag"}, {"busy": "Opening"}):
        place.show_view(still)
        QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
        assert place.tank.pointer.held
        place.show_view(dataclasses.replace(still, **fields))  # type: ignore[arg-type]
        assert not place.tank.pointer.held
        QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
        assert not place.tank.pointer.held


def test_escape_and_leaving_give_the_pointer_back(place: Any, still: LabView) -> None:
    place.show_view(still)
    place.tank.setFocus()
    QTest.keyClick(place.tank, Qt.Key.Key_Return)
    assert place.tank.pointer.held
    QTest.keyClick(place.tank, Qt.Key.Key_Escape)
    assert not place.tank.pointer.held
    QTest.keyClick(place.tank, Qt.Key.Key_Space)
    assert place.tank.pointer.held
    place.hide()
    assert not place.tank.pointer.held
