"""The machine's place: it shows what is set, says what is to be changed, and changes nothing itself."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QFontMetricsF
from PySide6.QtWidgets import QFileDialog, QLabel

from study_app.gui.theme.theme import font
from study_app.store.workstation import CAMERA_LENGTH, STATEMENT_X_HEIGHT_PX, DisplayOffset, MachineSettings
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


def test_screens_are_listed_and_another_is_chosen_by_name_and_number_and_one_that_is_gone_is_named(place, qtbot):
    assert [radio.isChecked() for radio in place.screens.radios] == [False, True]
    said = [one.text() for one in place.screens.findChildren(QLabel)]
    assert any("1920 × 1080, 144 Hz, 100\u202f%" in words and "527 × 296 mm" in words for words in said)
    assert not place.screens.note.isVisible()
    with qtbot.waitSignal(place.changed) as changed:
        qtbot.keyClick(place.screens.radios[0], Qt.Key.Key_Space)
    assert changed.args == [{"screen": "eDP-1", "screen_number": 1}]
    show(place, MachineSettings(screen="eDP-1", screen_number=1))
    assert [radio.isChecked() for radio in place.screens.radios] == [True, False]
    assert place.participants is ONE
    show(place, MachineSettings(screen="HDMI-7", screen_number=2))
    assert "HDMI-7 is not connected" in place.screens.note.text()
    assert place.participants is TWO


def test_the_distance_is_typed_and_the_words_grow(place, qtbot):
    with qtbot.waitSignal(place.changed) as changed:
        type_into(qtbot, place.seen.distance.field, "600")
    assert changed.args == [{"viewing_distance_mm": 600.0}]
    assert place.seen.sample.scale == 1.0
    assert QFontMetricsF(font("statement")).xHeight() == pytest.approx(STATEMENT_X_HEIGHT_PX, abs=0.3)  # px: rounding
    show(place, MachineSettings(viewing_distance_mm=600))
    assert place.seen.sample.scale == pytest.approx(1.747, abs=0.001)
    assert "1.75 times the default size" in place.seen.said.text()


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


def test_an_offset_is_that_of_the_participants_screen(place, qtbot):
    form = place.offset.form
    qtbot.keyClicks(form.mean, "23.5")
    with qtbot.waitSignal(place.offset_measured) as measured:
        qtbot.mouseClick(form.keep, Qt.MouseButton.LeftButton)
    assert measured.args == [23.5, 0.0, "photodiode", "DP-1"]
    show(place, MachineSettings(display_offset=DisplayOffset(mean_ms=23.5, screen="DP-1")))
    with qtbot.waitSignal(place.changed) as changed:
        qtbot.mouseClick(form.forget, Qt.MouseButton.LeftButton)
    assert changed.args == [{"display_offset": None}]
    show(place, MachineSettings(display_offset=DisplayOffset(mean_ms=23.5, screen="HDMI-1")))
    assert form.said.text() == "23.5 ± 0 ms by photodiode for another screen (HDMI-1): not used here."


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


def test_undo_names_what_it_takes_back(place, qtbot):
    assert not place.undo.isEnabled()
    show(place, MachineSettings(sound=True), undo="sound")
    assert place.undo.text() == "Undo sound"
    with qtbot.waitSignal(place.undo_asked):
        qtbot.keyClick(place, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)


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


def test_markers_and_samples_are_switched(place, qtbot):
    with qtbot.waitSignal(place.changed) as changed:
        qtbot.keyClick(place.outlets.markers, Qt.Key.Key_Space)
    assert changed.args == [{"lsl_markers": True}]
    samples = place.outlets.samples
    assert samples.currentText() == "Off"
    samples.setCurrentIndex(1)
    with qtbot.waitSignal(place.changed) as changed:
        samples.activated.emit(1)
    assert changed.args == [{"lsl_samples": "single-blind"}]
    show(place, MachineSettings(lsl_markers=True, lsl_samples="always", triggers="serial:COM3"))
    assert place.outlets.markers.isChecked()
    assert samples.currentText() == "On, also in double-blind studies"
    assert place.outlets.triggers.text() == "serial:COM3"


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
