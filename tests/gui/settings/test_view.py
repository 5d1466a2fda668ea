"""The machine's place: it shows what is set, says what is to be changed, and changes nothing itself."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog

from study_app.store.workstation import CAMERA_LENGTH, MachineSettings
from tests.gui.windows import SCREENS, machine, two_screens
from tests.gui.windows import show_settings as show

ONE, TWO = SCREENS


@pytest.fixture
def place(qtbot, monkeypatch):
    two_screens(monkeypatch)
    return machine(qtbot)


def type_into(qtbot, field, text):
    field.setFocus()
    field.selectAll()
    qtbot.keyClicks(field, text)
    qtbot.keyClick(field, Qt.Key.Key_Return)


def test_a_distance_out_of_range_is_refused_and_an_empty_one_forgotten(place, qtbot):
    show(place, MachineSettings(viewing_distance_mm=600))
    field = place.seen.distance.field
    with qtbot.assertNotEmitted(place.changed):
        type_into(qtbot, field, "6")
    assert field.state == "refused"
    assert "200 to 3000 mm" in place.seen.distance.below.text()
    field.clear()
    with qtbot.waitSignal(place.changed) as changed:
        field.setModified(True)
        qtbot.keyClick(field, Qt.Key.Key_Return)
    assert changed.args == [{"viewing_distance_mm": None}]
    assert field.state == ""


def test_device_folder_theme_and_sound_are_chosen(place, qtbot, monkeypatch, tmp_path):
    assert not place.windows.sound.isChecked()
    with qtbot.waitSignal(place.changed) as changed:
        qtbot.mouseClick(place.windows.sound, Qt.MouseButton.LeftButton)
    assert changed.args == [{"sound": True}]
    assert place.offset.patch.isChecked()
    with qtbot.waitSignal(place.changed) as changed:
        qtbot.mouseClick(place.offset.patch, Qt.MouseButton.LeftButton)
    assert changed.args == [{"photodiode": False}]
    for choice, value, name in (
        (place.sessions.device, "falcon", "device"),
        (place.windows.theme_choice, "dark", "theme"),
    ):
        with qtbot.waitSignal(place.changed) as changed:
            choice.setCurrentIndex(choice.findData(value))
            choice.activated.emit(choice.currentIndex())
        assert changed.args == [{name: value}]
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(tmp_path))
    with qtbot.waitSignal(place.changed) as changed:
        qtbot.mouseClick(place.sessions.change, Qt.MouseButton.LeftButton)
    assert changed.args == [{"workspace": str(tmp_path)}]
    with qtbot.waitSignal(place.go_asked) as going:
        qtbot.mouseClick(place.sessions.devices, Qt.MouseButton.LeftButton)
    assert going.args == ["devices"]


@pytest.fixture
def real_place(qtbot):
    made = machine(qtbot)
    yield made
    made.leave()


def test_numbers_come_on_every_screen_and_go_with_the_place(real_place, qtbot):
    qtbot.mouseClick(real_place.screens.identify, Qt.MouseButton.LeftButton)
    (number,) = real_place.numbers
    assert number.isVisible()
    qtbot.keyClick(number, Qt.Key.Key_Space)
    assert not number.isVisible()
    with qtbot.waitSignal(number.destroyed):
        real_place.leave()
    assert real_place.numbers == []


def test_the_display_test_is_opened_once_and_left_by_esc(real_place, qtbot):
    qtbot.mouseClick(real_place.screens.test, Qt.MouseButton.LeftButton)
    test = real_place.test
    assert test.isVisible()
    real_place.open_test()
    assert real_place.test is test
    qtbot.keyClicks(test.offset.mean, "20")
    with qtbot.waitSignal(real_place.offset_measured):
        qtbot.mouseClick(test.offset.keep, Qt.MouseButton.LeftButton)
    with qtbot.waitSignal(test.left):
        qtbot.keyClick(test, Qt.Key.Key_Escape)
    assert real_place.test is None


def test_a_trigger_port_is_typed_and_what_is_none_is_refused(place, qtbot):
    outlets = place.outlets
    with qtbot.waitSignal(place.changed) as changed:
        type_into(qtbot, outlets.triggers, "serial:/dev/ttyUSB0")
    assert changed.args == [{"triggers": "serial:/dev/ttyUSB0"}]
    with qtbot.assertNotEmitted(place.changed):
        for typed in ("usb:1", "lsl:1", "serial:", "COM3"):
            type_into(qtbot, outlets.triggers, typed)
            assert outlets.triggers.property("state") == "refused", typed
    assert outlets.below.text().startswith("This is not the address of a port")
    assert outlets.triggers.property("state") == "refused"
    with qtbot.waitSignal(place.changed) as changed:
        type_into(qtbot, outlets.triggers, " ")
    assert changed.args == [{"triggers": ""}]
    assert outlets.below.text().startswith("One byte per event")


def test_a_camera_is_typed_and_never_longer_than_can_be_kept(place, qtbot):
    with qtbot.waitSignal(place.changed) as changed:
        type_into(qtbot, place.sessions.camera, " tcp://127.0.0.1:5000 ")
    assert changed.args == [{"camera": "tcp://127.0.0.1:5000"}]
    place.sessions.camera.clear()
    with qtbot.waitSignal(place.changed) as changed:
        place.sessions.camera.insert("x" * 1000)
        qtbot.keyClick(place.sessions.camera, Qt.Key.Key_Return)
    assert MachineSettings.model_validate(changed.args[0]).camera == "x" * CAMERA_LENGTH
