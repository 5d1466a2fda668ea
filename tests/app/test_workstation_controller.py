"""The settings of this machine: stored at once, undone, and stated in the receipt."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from PySide6.QtGui import QGuiApplication

from study_app.app.main_controller import MainController, WorkstationController
from study_app.app.session.live_session import NOT_EXAMINED, LiveSession
from study_app.devices.descriptor import READY, Backend
from study_app.gui.kit.devices import described_screens, settings_here, text_scale_on
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.store import workstation
from study_app.store.workstation import DEFAULTS, DisplayOffset, MachineSettings, save_settings
from study_app.user_folder import settings_file
from tests.session.small import CHOSEN

pytestmark = pytest.mark.slow

MOUSE = Backend("mouse", "the window", state=READY, can="seen, not felt")


@pytest.fixture
def desk(qapp):
    return WorkstationController()


def test_settings_that_cannot_be_saved_are_reported_but_apply(desk, qtbot):
    settings_file().parent.write_text("", encoding="utf-8", newline="\n")  # a file where the folder should be
    with qtbot.waitSignal(desk.troubled) as trouble:
        desk.change_settings({"theme": "dark"})
    assert "could not be saved" in trouble.args[0]
    assert desk.settings.theme == "dark"
    settings_file().parent.unlink()


def test_the_settings_page_shows_stored_settings_workspace_and_undo(desk, qtbot, tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path / "lab"))
    desk.change_settings({"theme": "dark"})
    page = desk.make_place()
    qtbot.addWidget(page)

    def shown():
        return page.settings.theme, page.settings.viewing_distance_mm, page.undo.text(), page.undo.isEnabled()

    assert shown() == ("dark", DEFAULTS.viewing_distance_mm, "Undo theme", True)
    assert (page.folder.whole, page.kept_in.whole) == (str(tmp_path / "lab"), f"Saved in {settings_file()}")
    page.changed.emit({"viewing_distance_mm": 640})
    assert shown() == ("dark", 640, "Undo viewing distance", True)
    page.undo.click()
    assert shown() == ("dark", DEFAULTS.viewing_distance_mm, "Undo theme", True)
    page.undo.click()
    assert shown() == (DEFAULTS.theme, DEFAULTS.viewing_distance_mm, "Undo", False)


def test_an_unknown_device_is_reported_and_replaced_by_the_mouse(qapp):
    save_settings(MachineSettings(device="hammer", theme="dark"))
    settings, trouble = settings_here()
    assert (settings.device, settings.theme) == ("mouse", "dark")
    assert "'hammer'" in trouble
    assert "\n" not in trouble


def test_the_receipt_states_distance_width_and_offset_of_the_participants_screen(qapp):
    screen = QGuiApplication.primaryScreen()
    offset = DisplayOffset(mean_ms=20, spread_ms=1, measured="2026-11-20", screen=screen.name())
    settings = MachineSettings(viewing_distance_mm=600, screen_width_mm=300, display_offset=offset)
    screens = described_screens(settings, screen, screen)
    assert screens["participant"]["frames"] == "timed by the computer's clock", (
        "nothing tells of swaps without a display"
    )
    assert screens["participant"]["viewing_distance_mm"] == 600
    assert screens["participant"]["display_offset"]["mean_ms"] == 20
    assert screens["participant"]["text_scale"] == pytest.approx(text_scale_on(settings, screen), abs=0.001)
    assert "viewing_distance_mm" not in screens["operator"]


def test_a_folder_given_by_command_applies_to_this_run(qtbot, tmp_path, monkeypatch):
    monkeypatch.delenv("LIQUID_STUDY_WORKSPACE")
    save_settings(MachineSettings(workspace=str(tmp_path / "set")))
    controller = MainController(tmp_path / "asked")
    qtbot.addWidget(controller.window)
    assert controller.results == tmp_path / "asked"
    controller.machine.change_settings({"workspace": str(tmp_path / "other")})
    assert controller.results == tmp_path / "asked"
    following = MainController()
    qtbot.addWidget(following.window)
    assert following.results == tmp_path / "other" / "results"


@pytest.mark.slow
def test_a_damaged_settings_file_is_reported_when_the_window_opens(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr(workstation, "load_or_default", lambda: (DEFAULTS, "the file is no JSON"))
    controller = MainController(tmp_path)
    qtbot.addWidget(controller.window)
    controller.devices.backends = lambda: [MOUSE]
    with qtbot.waitSignal(controller.devices.looked):
        controller.open()
    assert controller.window.notice.isVisible()
    controller.window.notice.go_on.click()
    assert controller.window.place("home").device.state.word == "Ready"


@pytest.mark.parametrize(("device", "held"), [("mouse", None), ("falcon:FT1", True), ("falcon-emulated", False)])
def test_the_cockpit_examines_a_falcon_and_reports_other_devices(qapp, monkeypatch, device, held):
    diagnoses, messages = [], []

    def diagnosis(_parent, _theme, name, _settings, *, held):
        diagnoses.append((name, held))
        return SimpleNamespace(show=lambda: None)

    monkeypatch.setattr("study_app.gui.devices.open_diagnosis", diagnosis)
    live = LiveSession(replace(CHOSEN, device=device), LIGHT)
    live.bridge = SimpleNamespace(
        operator=SimpleNamespace(theme=DARK, show_message=lambda *said: messages.append(said))
    )
    live.diagnose()
    assert diagnoses == ([] if held is None else [(device, held)])
    assert messages == ([NOT_EXAMINED] if held is None else [])
