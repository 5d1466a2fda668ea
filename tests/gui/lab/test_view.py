"""The lab draws a view and says what is asked for; it can be used by keyboard alone, and blind it tells nothing."""

import dataclasses
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QComboBox, QLabel, QLineEdit, QSlider, QWidget

from study_app.gui.lab.tank_note import SHOWN_AFTER_MS
from study_app.gui.lab.view import preset_name
from study_app.lab.ab_comparison import Workbench
from study_app.viewmodels.lab import LabView
from tests.gui.lab.sample import blind, heard, settle, still_view, workbench

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


def press(place: Any, sequence: str) -> None:
    QTest.keySequence(QApplication.focusWidget() or place, QKeySequence(sequence))


def test_the_felt_side_is_seen_and_x_asks_for_the_other(place: Any, still: LabView) -> None:
    said = heard(place, "switched")
    place.show_view(still)
    a, b = place.header.sides.segments.values()
    assert (a.isChecked(), b.isChecked()) == (True, False)
    assert a.accessibleName() == "A: Water, edited, felt now"
    b.click()
    a.click()
    press(place, "X")
    assert len(said) == 2
    assert a.isChecked()  # the view says when it is the other
    place.show_view(dataclasses.replace(still, workbench=still.workbench.switch()))
    assert b.isChecked()


def test_keys_work_from_within_a_field(place: Any, still: LabView) -> None:
    said = {name: heard(place, name) for name in ("switched", "undo_asked", "redo_asked")}
    place.show_view(still)
    field = place.form.rows["wake.length"].field
    field.setFocus()
    for sequence in ("X", "Ctrl+Z", "Ctrl+Shift+Z"):
        QTest.keySequence(field, QKeySequence(sequence))
    assert {name: len(what) for name, what in said.items()} == {"switched": 1, "undo_asked": 1, "redo_asked": 1}
    assert field.text() == "1700"


@pytest.mark.parametrize(
    ("part", "signal", "what"),
    [
        ("undo", "undo_asked", ()), ("redo", "redo_asked", ()), ("blind", "blind_asked", (True,)),
        ("stop", "stop_asked", ()),
    ],
)  # fmt: skip
def test_buttons_say_what_is_asked(place: Any, still: LabView, part: str, signal: str, what: tuple[Any, ...]) -> None:
    bench = still.workbench.change("wake.length", 100).undo()
    place.show_view(dataclasses.replace(still, workbench=bench))
    said = heard(place, signal)
    getattr(place.header, part).click()
    assert said == [what]


def test_undo_and_redo_can_be_pressed_only_where_there_is_something(place: Any) -> None:
    fresh = Workbench(workbench().b, workbench().b)
    place.show_view(still_view(fresh))
    assert not place.header.undo.isEnabled()
    edited = fresh.change("body.diameter_m", 0.05)
    place.show_view(still_view(edited))
    assert (place.header.undo.isEnabled(), place.header.redo.isEnabled()) == (True, False)
    place.show_view(still_view(edited.undo()))
    assert (place.header.undo.isEnabled(), place.header.redo.isEnabled()) == (False, True)


def test_device_and_path_are_chosen(place: Any, still: LabView) -> None:
    devices, paths = heard(place, "device_chosen"), heard(place, "path_chosen")
    place.show_view(still)
    place.header.device.activated.emit(1)
    place.header.path.activated.emit(2)
    place.header.path.activated.emit(0)
    assert devices == [("falcon",)]
    assert paths == [("zigzag",), (None,)]
    place.show_view(dataclasses.replace(still, path="zigzag"))
    assert place.header.path.currentText() == "Turns of 90°"


def test_after_a_stop_the_force_can_be_faded_in_again(place: Any, still: LabView) -> None:
    said = heard(place, "fade_in_asked")
    place.show_view(still)
    assert not place.note.isVisible()
    place.show_view(dataclasses.replace(still, force_on=False))
    assert place.note.words.text() == "Force is off"
    assert place.tank.rect().contains(place.note.geometry())
    place.note.fade_in.click()
    assert said == [()]
    place.show_view(still)
    assert not place.note.isVisible()


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
        settle()
        place.show_view(dataclasses.replace(moved, workbench=blind(bench)))
        settle()
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
    settle()
    for first, felt in (("A", "A"), ("B", "B")):
        bench = blind(moved.workbench, first=first, felt=felt)
        other = {} if felt == "A" else {"cost": moved.cost[:2], "errors": (), "limiters": moved.limiters[:3]}
        place.show_view(dataclasses.replace(moved, workbench=bench, **other))
        settle()
        pictures.append(place.grab().toImage())
        one, two = place.header.sides.segments.values()
        assert (one.text(), two.text(), one.isChecked(), two.isChecked()) == ("Setting 1", "Setting 2", True, False)
        assert (len(place.cost.lines), len(place.limiters.lines)) == (5, 11)  # nothing behind the curtain moves
    assert pictures[0] == pictures[1]


def test_blinding_changes_no_size_and_no_place(place: Any, moved: LabView) -> None:
    cards = (place.form, place.tank, place.force, place.speed, place.cost, place.error, place.limiters)
    place.show_view(moved)
    settle()
    before = [(card.mapTo(place, QPoint()), card.size()) for card in cards]
    place.show_view(dataclasses.replace(moved, workbench=blind(moved.workbench)))
    settle()
    assert [(card.mapTo(place, QPoint()), card.size()) for card in cards] == before
    assert not place.header.save.isEnabled()


def test_revealed_everything_is_back(place: Any, moved: LabView) -> None:
    place.show_view(dataclasses.replace(moved, workbench=blind(moved.workbench)))
    place.show_view(moved)
    settle()
    words = words_of(place)
    for name in ("Water, edited", "Light oil", "segments", "84 ns"):
        assert name in words


def test_a_preset_is_saved_where_one_says(place: Any, still: LabView, qtbot: Any, tmp_path: Path) -> None:
    place.show_view(still)
    said = heard(place, "save_asked")
    place.header.save.click()
    assert place.dialog is not None
    assert place.dialog.isVisible()
    place.dialog.fileSelected.emit(str(tmp_path / "mine.toml"))
    place.dialog.reject()
    assert said == [(tmp_path / "mine.toml", still.workbench.a)]
    assert place.dialog is None


def test_a_preset_is_opened_and_the_felt_setting_used_where_one_says(
    place: Any, still: LabView, tmp_path: Path, qtbot: Any
) -> None:
    place.show_view(still)
    opened, used = heard(place, "preset_opened"), heard(place, "use_asked")
    place.form.open.click()
    place.dialog.fileSelected.emit(str(tmp_path / "syrup.toml"))
    place.dialog.reject()
    place.form.use.click()
    assert "Water" in place.dialog.windowTitle()
    place.dialog.fileSelected.emit(str(tmp_path / "study.toml"))
    place.dialog.reject()
    assert opened == [(tmp_path / "syrup.toml",)]
    assert used == [(tmp_path / "study.toml", still.workbench.a)]
    assert not place.form.said.isVisible()
    place.show_view(replace(still, said="Saved as syrup.toml in /there"))
    assert place.form.said.isVisible()
    assert place.form.said.accessibleName() == "Saved as syrup.toml in /there"


@pytest.mark.parametrize(
    ("title", "name"),
    [("Water, edited", "water-edited"), ("Light oil (rek2024)", "light-oil-rek2024"), ("…", "preset")],
)
def test_a_presets_file_is_named_after_it(title: str, name: str) -> None:
    assert preset_name(title) == name


def test_the_mouse_moves_the_ball_from_a_click_to_the_next(place: Any, still: LabView) -> None:
    moves, bits = heard(place, "hand_moved"), heard(place, "hand_pressed")
    place.show_view(still)
    middle = place.tank.rect().center()
    QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
    QTest.mouseRelease(place.tank, Qt.MouseButton.LeftButton, pos=middle)
    assert place.tank.pointer.held
    QTest.mouseMove(place.tank, middle + QPoint(40, 10))
    assert moves[-1] != moves[0]
    QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=middle)
    assert not place.tank.pointer.held
    assert bits[-1] == (0,)


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


@pytest.mark.parametrize("fields", [{"path": "zigzag"}, {"busy": "Opening"}])
def test_the_pointer_is_the_ball_only_while_the_mouse_leads(place: Any, still: LabView, fields: dict[str, str]) -> None:
    place.show_view(still)
    QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=place.tank.rect().center())
    assert place.tank.pointer.held
    other = dataclasses.replace(still, **fields)  # type: ignore[arg-type]
    place.show_view(other)
    assert not place.tank.pointer.held
    QTest.mousePress(place.tank, Qt.MouseButton.LeftButton, pos=place.tank.rect().center())
    assert not place.tank.pointer.held


def test_a_ball_that_grows_leaves_the_glass_where_it_is(place: Any, moved: LabView) -> None:
    place.show_view(moved)
    settle()
    glass = place.tank.camera, place.tank.box
    small = place.tank.grab().toImage()
    place.show_view(dataclasses.replace(moved, body_radius_m=0.006))
    settle()
    assert (place.tank.camera, place.tank.box) == glass
    assert place.tank.grab().toImage() != small


@pytest.mark.variants(3)
@pytest.mark.parametrize("size", [(928, 560), (952, 640), (1294, 768), (1528, 900), (1848, 1080), (3768, 2160)])
def test_everything_fits(place: Any, moved: LabView, size: tuple[int, int]) -> None:
    place.resize(*size)
    place.show_view(moved)
    settle()
    assert place.size().toTuple() == size
    for part in (place.header.stop, place.header.save, place.header.sides, place.header.device, place.header.path):
        at = part.mapTo(place, QPoint())
        assert part.width() >= part.minimumSizeHint().width()
        assert at.x() >= 0
        assert at.x() + part.width() <= size[0]
    for card in (place.tank, place.force, place.speed, place.cost, place.error, place.limiters, place.form):
        at = card.mapTo(place, QPoint())
        assert at.x() >= 0
        assert at.x() + card.width() <= size[0]
    for it in shown(place):
        if type(it) is QLabel and it.text() and not it.wordWrap():
            assert it.fontMetrics().horizontalAdvance(it.text()) <= it.width() + 1, it.text()


def test_everything_that_takes_the_keyboard_has_a_name_and_is_reached_by_tab(place: Any, still: LabView) -> None:
    place.show_view(still)
    kinds = (QAbstractButton, QComboBox, QLineEdit, QSlider)
    parts = [it for it in shown(place) if isinstance(it, kinds) and it.isEnabled()] + [place.tank]
    chain, it = [], place.nextInFocusChain()
    while it is not place:
        chain.append(it)
        it = it.nextInFocusChain()
    for part in parts:
        assert part.accessibleName() or (isinstance(part, QAbstractButton) and part.text()), part
        assert part.focusPolicy() & Qt.FocusPolicy.TabFocus, part
        assert part in chain


def test_buttons_can_be_hit(place: Any, still: LabView) -> None:
    place.show_view(still)
    for it in shown(place):
        if isinstance(it, QAbstractButton | QComboBox | QLineEdit | QSlider) and it.isEnabled():
            assert min(it.width(), it.height()) >= 24, it
