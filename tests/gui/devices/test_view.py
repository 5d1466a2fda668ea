"""The devices' place: each device's row is true, and what is chosen is said, not done."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog

from study_app.devices.descriptor import Backend
from study_app.gui.devices.view import NO_FILE
from study_app.viewmodels.devices.list_view import devices_shown
from tests.gui import windows


@pytest.fixture
def place(qtbot):
    return windows.devices(qtbot)


def rows(place):
    return place.people.rows | place.simulated.rows


def test_entering_and_refresh_look_again_and_rows_stay(place, qtbot):
    with qtbot.waitSignal(place.look_asked):
        place.enter()
    with qtbot.waitSignal(place.look_asked):
        qtbot.mouseClick(place.refresh, Qt.MouseButton.LeftButton)
    before = rows(place)["falcon"]
    place.show_looking(True)
    assert not place.refresh.isEnabled()
    found = [
        one if one.by != "libusb 1.0" else Backend("falcon", one.by, "connected: FT1", one.can) for one in windows.FOUND
    ]
    place.show_devices(devices_shown(found), "mouse")
    place.show_looking(False)
    assert place.refresh.text() == "Refresh"
    assert rows(place)["falcon"] is before
    assert (before.chip.word, before.why.isVisible()) == ("Connected", False)


def test_a_falcons_firmware_is_chosen_and_forgotten(place, qtbot, monkeypatch):
    firmware = place.options["firmware"]
    assert firmware.file.accessibleName() == NO_FILE
    assert not firmware.forget.isEnabled()
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: ("/there/firmware.bin", ""))
    with qtbot.waitSignal(place.option_chosen) as chosen:
        qtbot.mouseClick(firmware.choose, Qt.MouseButton.LeftButton)
    assert chosen.args == ["firmware", "/there/firmware.bin"]
    place.show_options({"firmware": Path("/there/firmware.bin")})
    with qtbot.waitSignal(place.option_chosen) as chosen:
        qtbot.mouseClick(firmware.forget, Qt.MouseButton.LeftButton)
    assert chosen.args == ["firmware", None]
