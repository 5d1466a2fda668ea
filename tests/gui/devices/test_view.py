"""The devices' place: each device's row is true, and what is chosen is said, not done."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QFileDialog

from study_app.devices.descriptor import Backend
from study_app.gui.devices.view import NO_FILE
from study_app.viewmodels.devices.bench import BenchShown
from study_app.viewmodels.devices.list_view import devices_shown
from tests.gui import windows


@pytest.fixture
def place(qtbot):
    return windows.devices(qtbot)


def rows(place):
    return place.people.rows | place.simulated.rows


def marked(place):
    titles = {name: row.title for name, row in rows(place).items()}
    return [name for name, title in titles.items() if isinstance(title, QAbstractButton) and title.isChecked()]


def test_every_device_has_a_row_with_its_state(place):
    assert list(place.people.rows) == ["mouse", "falcon"]
    assert list(place.simulated.rows) == ["falcon-emulated", "falcon-socket:PATH"]
    assert rows(place)["mouse"].chip.word == "Ready"
    falcon = rows(place)["falcon"]
    assert (falcon.chip.word, falcon.why.text()) == ("Not connected", "Plug it in.")
    assert "ftd2xx: not available" in falcon.by.text()
    assert "Not connected" in falcon.title.accessibleName()


def test_one_is_marked_and_another_can_be_chosen_by_the_keyboard(place, qtbot):
    assert rows(place)["mouse"].title.isChecked()
    with qtbot.waitSignal(place.chosen) as chosen:
        qtbot.keyClick(rows(place)["falcon"].title, Qt.Key.Key_Space)
    assert chosen.args == ["falcon"]
    place.show_devices(devices_shown(windows.FOUND), "falcon-emulated")
    assert marked(place) == ["falcon-emulated"]
    place.show_devices(devices_shown(windows.FOUND), "falcon-socket:/run/falcon")
    assert marked(place) == []


def test_falcons_can_be_diagnosed_and_nothing_else(place, qtbot):
    assert [name for name, row in rows(place).items() if row.diagnose.isVisible()] == ["falcon", "falcon-emulated"]
    with qtbot.waitSignal(place.diagnose_asked) as asked:
        qtbot.mouseClick(rows(place)["falcon"].diagnose, Qt.MouseButton.LeftButton)
    assert asked.args == ["falcon"]


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


def test_the_last_bench_is_shown_and_its_report_is_asked_for(place, qtbot, tmp_path):
    report = tmp_path / "bench.md"
    place.show_benches({"falcon": BenchShown("Measured 2026-11-21: mass 0.20 kg.", report)})
    falcon, mouse = rows(place)["falcon"], rows(place)["mouse"]
    assert (falcon.bench.text(), falcon.bench.isVisible()) == ("Measured 2026-11-21: mass 0.20 kg.", True)
    assert not mouse.bench.isVisible()
    assert not mouse.report.isVisible()
    with qtbot.waitSignal(place.report_asked) as asked:
        qtbot.mouseClick(falcon.report, Qt.MouseButton.LeftButton)
    assert asked.args == [report]
    place.show_devices(devices_shown(windows.FOUND), "mouse")
    assert falcon.bench.isVisible()
    place.show_benches({"falcon": BenchShown("Measured. The report is missing: /gone.", None)})
    assert (falcon.bench.isVisible(), falcon.report.isVisible()) == (True, False)
    place.show_benches({})
    assert not falcon.bench.isVisible()
