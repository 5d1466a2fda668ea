"""The texts about each device by its backends, compared with a reviewed text."""

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QBoxLayout, QDialog, QWidget

from study_app.devices.descriptor import DRIVER_READY, NONE, NOT_AVAILABLE, READY, Backend
from study_app.devices.registry import backends, list_devices
from study_app.gui.devices.view import DevicesPlace
from study_app.gui.kit.devices import (
    device_before_search,
    device_choices,
    device_named,
    device_or_default,
    devices_shown,
    remembered_options,
    text_scale_on,
    theme_named,
)
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.widgets.cards import Rule
from study_app.gui.widgets.controls import Radio
from study_app.store.workstation import DEFAULTS, MachineSettings
from tests.golden import check_kept
from tests.golden_values import value_lines
from tests.gui.windows import SCREENS

MOUSE = Backend("mouse", "the window", state=READY, can="seen, not felt")
EMULATED = Backend("falcon-emulated", "the program", state=READY, can="by command")


def falcon(state: str, why: str = "") -> Backend:
    return Backend("falcon", "libusb 1.0", state=state, can="felt, up to 8 N", why=why)


def ftdi(state: str, why: str = "") -> Backend:
    return Backend("falcon", "ftd2xx", state=state, can="the same", why=why)


FOR_WINDOWS = ftdi(NOT_AVAILABLE, "for Windows alone")
WAYS = (
    (falcon("connected: FT1"), FOR_WINDOWS),
    (falcon("connected: unnamed", "no permission"), ftdi(NOT_AVAILABLE)),
    (falcon(NONE, "plug it in"), FOR_WINDOWS),
    (falcon(NONE, "plug it in"), ftdi(DRIVER_READY)),
    (falcon(NOT_AVAILABLE, "install libusb"), ftdi(NOT_AVAILABLE, "other")),
)


def device_lines() -> Iterator[str]:
    for ways in WAYS:
        yield from value_lines(devices_shown(ways), "the best way to a Falcon")
    listed = devices_shown([MOUSE, falcon("connected: FT1"), EMULATED])
    for name in ("falcon:FT1", "falcon-emulated", "hammer"):
        yield from value_lines(device_named(name, listed), f"preferred {name}")
    assert device_named("falcon", ()) == device_before_search("falcon")
    yield from value_lines(device_before_search("falcon"), "before anybody looked")


def test_texts_about_devices_are_as_reviewed() -> None:
    check_kept(Path(__file__).with_name("devices.txt"), device_lines())


def test_every_device_is_shown_once_and_those_that_people_feel_with_first() -> None:
    names = [device.name for device in devices_shown(backends())]
    assert set(list_devices()) <= set(names)
    assert len(names) == len(set(names))
    assert set(names[:5]) == {"mouse", "spacemouse", "falcon", "force-dimension", "inverse3"}


def test_names_are_chosen_by_their_labels_and_unknown_ones_have_a_default() -> None:
    labels = dict(device_choices())
    assert list(labels) == list(list_devices())
    assert (labels["mouse"], labels["falcon"]) == ("Mouse (visual only)", "Novint Falcon")
    assert [device_or_default(name) for name in ("falcon:FT1", "hammer")] == ["falcon:FT1", "mouse"]
    assert [option.name for option in remembered_options()] == ["firmware"]
    assert [theme_named(name) for name in ("light", "dark", "blue")] == [LIGHT, DARK, LIGHT]


def test_the_library_that_is_ready_comes_before_one_without_a_device() -> None:
    for states, word, is_ready in (
        ((NONE, READY), "Ready", True),
        ((NOT_AVAILABLE, NONE), "Not connected", False),
        ((NONE, DRIVER_READY), "Driver ready", False),
        ((READY, "connected: FT1"), "Connected", True),
    ):
        (falcon_shown,) = devices_shown([falcon(states[0]), ftdi(states[1])])
        assert (falcon_shown.word, falcon_shown.is_ready) == (word, is_ready)
    assert device_before_search("toy-hand:3").icon == device_before_search("falcon").icon == "device"
    assert (device_before_search("mouse").icon, device_before_search("mouse").title) == ("mouse", "Mouse")


def test_the_participants_text_grows_with_the_distance_on_their_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("study_app.gui.kit.devices.screen_shown", lambda _screen: SCREENS[1])
    settings = MachineSettings(viewing_distance_mm=600.0)
    assert text_scale_on(settings, None) == pytest.approx(1.7473, abs=1e-4)  # type: ignore[arg-type]  # 527 mm, 1920 px


@pytest.fixture
def place(qtbot: Any) -> DevicesPlace:
    devices_place = DevicesPlace(MachineSettings(device="falcon:FT1"), lambda: [MOUSE, falcon(NONE, "plug it in")])
    qtbot.addWidget(devices_place)
    return devices_place


@pytest.mark.slow
def test_a_row_describes_a_device_and_follows_its_state(qtbot: Any, place: DevicesPlace) -> None:
    place.show_devices(devices_shown([MOUSE, *WAYS[2], EMULATED]))
    falcon_row, mouse_row, emulated_row = rows = [place.rows[name] for name in ("falcon", "mouse", "falcon-emulated")]
    assert [row.title.text() for row in rows] == ["Novint Falcon", "Mouse", "Emulated Falcon"]
    headings = {simulated: card.heading.text() for simulated, card in place.lists.items()}
    assert headings == {False: "Input devices", True: "Simulated devices"}
    assert [isinstance(row.title, Radio) and row.title.isChecked() for row in rows] == [True, False, False]
    assert [row.diagnose.isHidden() for row in rows] == [False, True, False]
    assert falcon_row.diagnose.accessibleName() == "Diagnose Novint Falcon"
    assert [place.lists[simulated].isAncestorOf(emulated_row) for simulated in (False, True)] == [False, True]
    assert [place.lists[simulated].isAncestorOf(mouse_row) for simulated in (False, True)] == [True, False]
    assert falcon_row.title.accessibleName() == "Novint Falcon. Not connected. Felt, up to 8 N. Plug it in."
    texts = [(part.text(), part.isHidden()) for part in (falcon_row.can, falcon_row.why, falcon_row.by)]
    ways = "libusb 1.0: none connected   ·   ftd2xx: not available"
    assert texts == [("Felt, up to 8 N.", False), ("Plug it in.", False), (ways, False)]
    assert [part.isHidden() for part in (mouse_row.can, mouse_row.why, mouse_row.by)] == [False, True, True]
    assert (falcon_row.chip.tone, falcon_row.chip.icon, falcon_row.chip.word) == ("neutral", "ring", "Not connected")
    assert falcon_row.why.property("role") == "text2"
    place.show_devices(devices_shown([MOUSE, *WAYS[1], EMULATED]))
    assert place.rows["falcon"] is falcon_row
    assert (falcon_row.chip.tone, falcon_row.chip.icon, falcon_row.chip.word) == ("warn", "warning", "Check it")
    assert (falcon_row.why.text(), falcon_row.why.property("role")) == ("No permission.", "warn")
    with qtbot.waitSignal(place.changed) as heard:
        mouse_row.title.click()
    assert heard.args == [{"device": "mouse"}]
    assert not falcon_row.title.isChecked()
    assert [len(place.lists[simulated].findChildren(Rule)) for simulated in (False, True)] == [1, 0]
    place.show_settings(MachineSettings.model_validate({"device": "falcon-emulated", "firmware": "/there/f.bin"}))
    checked = [name for name, row in place.rows.items() if isinstance(row.title, Radio) and row.title.isChecked()]
    assert checked == ["falcon-emulated"]
    assert place.isAncestorOf(place.options["firmware"].editor)
    assert place.options["firmware"].editor.control.text() == str(Path("/there/f.bin"))
    place.options["firmware"].editor.control.selectAll()
    with qtbot.waitSignal(place.changed) as heard:
        qtbot.keyClicks(place.options["firmware"].editor.control, __file__)
        qtbot.keyClick(place.options["firmware"].editor.control, Qt.Key.Key_Return)
    assert heard.args == [{"firmware": Path(__file__)}]
    control = place.options["firmware"].editor.control
    assert (control.accessibleName(), control.placeholderText()) == ("File", "No file chosen")
    for width, direction in ((999, QBoxLayout.Direction.TopToBottom), (1000, QBoxLayout.Direction.LeftToRight)):
        place.resize(width, 700)
        place.show()
        assert place._body.direction() == direction
        assert (place.help.maximumWidth() < 1000) is (width == 1000)


@pytest.mark.slow
def test_devices_are_looked_for_on_request_until_the_windows_close(qtbot: Any, place: DevicesPlace) -> None:
    assert (place.refresh.text(), place.refresh.isEnabled()) == ("Refresh", True)
    for look in (place.enter, place.refresh.click):
        with qtbot.waitSignal(place.looked):
            look()
            assert (place.refresh.text(), place.refresh.isEnabled()) == ("Looking…", False)
        assert (place.refresh.text(), place.refresh.isEnabled()) == ("Refresh", True)
    assert [(device.name, device.word) for device in place.shown] == [("mouse", "Ready"), ("falcon", "Not connected")]
    assert place.rows["falcon"].title.isChecked()

    def fail() -> list[Backend]:
        raise OSError("the driver is broken")

    place.backends = fail
    with qtbot.waitSignal(place.troubled) as heard:
        place.look_for_devices()
    assert heard.args == ["This machine could not be checked", "the driver is broken."]
    assert place.refresh.isEnabled()
    ended: list[bool] = []

    def look() -> list[Backend]:
        ended.append(threading.Event().wait(0.1))
        return fail()

    place.backends = look
    place.look_for_devices()
    with qtbot.assertNotEmitted(place.troubled, wait=50):
        place.stop_looking()
        assert ended == [False]
    place.look_for_devices()
    assert not place.refresh.isEnabled(), "the search that was running is the last one"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("preferred", "examined"), [("falcon:FT123", "falcon:FT123"), ("falcon", "falcon"), ("mouse", "falcon")]
)
def test_of_several_devices_the_one_with_the_preferred_serial_number_is_examined(
    qtbot: Any, monkeypatch: pytest.MonkeyPatch, preferred: str, examined: str
) -> None:
    names: list[str] = []

    def open_diagnosis(window: QWidget, _theme: object, name: str, _settings: object) -> QDialog:
        names.append(name)
        return QDialog(window)

    monkeypatch.setattr("study_app.gui.devices.view.open_diagnosis", open_diagnosis)
    place = DevicesPlace(DEFAULTS.model_copy(update={"device": preferred}), list)
    qtbot.addWidget(place)
    place.show_devices(devices_shown([falcon(NONE)]))
    place.rows["falcon"].diagnose.click()
    dialog = place.dialog
    assert dialog is not None
    assert dialog.isVisible()
    place.diagnose("falcon")
    assert (dialog.isVisible(), place.dialog is dialog) == (False, False)
    place.leave()
    assert place.dialog is None
    assert names == [examined] * 2
