"""The main window at each of its places, and the windows that open from them, in both themes."""

from pathlib import Path
from typing import Any, Final

from PySide6.QtWidgets import QDialog

from study_app.app.main_controller import MainController
from study_app.devices.registry import all_devices
from study_app.gui.home.study_facts import StudyFacts, study_facts
from study_app.gui.kit.opening import open_here
from study_app.gui.sessions.session_facts import sessions
from study_app.gui.sessions.session_page import SessionPage
from study_app.gui.settings.view import DisplayTest
from study_app.gui.theme.theme import Theme
from tools.screenshots.capture import Camera, shown
from tools.screenshots.example_study import STUDY, WATCHED

HOME: Final = (1440, 900)
WIDE: Final = (1600, 900)
FELT_MS: Final = 4300
WATCHED_S: Final = 1.6
WATCHED_SIZE: Final = (1180, 800)
TESTED_MS: Final = 2500
PATH: Final = "zigzag"
KEPT_IN: Final = "~/.config/liquid-study/machine.json"  # in place of a folder that is gone afterwards


def take_places(camera: Camera, results: Path, theme: Theme) -> None:
    """Take home with its questions, results, lab, devices with a diagnosis, and the machine with its display test."""
    controller = MainController(results)
    window = controller.window
    window.show_theme(theme)
    controller.open()
    try:
        home: Any = window.place("home")
        home.sessions.show_kind("every")
        camera.until(lambda: home.sessions.shown, "the list of sessions")
        camera.until(lambda: controller.devices.shown, "the list of devices")
        camera.take(window, f"home-{theme.name}", HOME)
        _take_questions(camera, home, theme)
        _take_results(camera, controller, theme)
        _take_watched(camera, controller, theme)
        _take_lab(camera, controller, theme)
        _take_devices(camera, controller, theme)
        _take_machine(camera, controller, theme)
        _take_help(camera, controller, theme)
    finally:
        window.close()
        controller.end()


def _take_questions(camera: Camera, home: Any, theme: Theme) -> None:
    facts = study_facts(STUDY)
    assert isinstance(facts, StudyFacts)  # noqa: S101 - it ships with the program
    for ask, name in ((home.ask_for_session, "new-session"), (home.ask_for_rehearsal, "rehearse")):
        ask(facts)
        camera.take(home.dialog, f"{name}-{theme.name}")
        home.dialog.reject()


def _take_results(camera: Camera, controller: MainController, theme: Theme) -> None:
    controller.window.resize(*HOME)
    controller.show_study(controller.results / STUDY)
    place: Any = controller.window.place("results")
    camera.until(
        lambda: place.view.figures and place.view.drawing is None and place.view.testing is None, "the figures"
    )
    camera.take(controller.window, f"results-{theme.name}", HOME)


def _take_watched(camera: Camera, controller: MainController, theme: Theme) -> None:
    below = controller.window.place("results")
    page = SessionPage(below, theme, sessions(Path(WATCHED).resolve(), {})[0], open_here)
    page.show()
    camera.until(lambda: page.record, "the session's page")
    camera.take(page, f"session-{theme.name}")
    page.watch.click()
    window: Any = page.watched
    stage = camera.until(lambda: window.stage, "the trial")
    stage.show_moment(WATCHED_S)
    camera.take(window, f"watch-{theme.name}", WATCHED_SIZE)
    for size in camera.sizes:
        window.resize(size[0] - 40, size[1] - 60)
        camera.take(window, f"watch-{theme.name}-{size[0]}x{size[1]}")
    window.close()
    page.close()


def _take_lab(camera: Camera, controller: MainController, theme: Theme) -> None:
    controller.window.resize(*WIDE)
    controller.window.go("lab")
    lab: Any = camera.until(lambda: controller.lab, "the lab")
    camera.until(lambda: lab.live, "the lab's device")
    lab.place.ask("path", PATH)
    camera.until(lambda: not lab.view().measuring, "the lab's costs")
    camera.wait(FELT_MS)
    camera.take(controller.window, f"lab-{theme.name}", WIDE)


def _take_devices(camera: Camera, controller: MainController, theme: Theme) -> None:
    controller.window.go("devices")
    camera.take(controller.window, f"devices-{theme.name}", HOME)
    over: list[bool] = []
    controller.devices.diagnose(next(it.name for it in all_devices() if it.doctor is not None and it.moves_by_itself))
    dialog = controller.devices.dialog
    assert dialog is not None  # noqa: S101 - it was just opened
    dialog.over.connect(over.append)
    camera.until(lambda: over, "the diagnosis")
    camera.take(dialog, f"diagnosis-{theme.name}")
    dialog.done(QDialog.DialogCode.Rejected)


def _take_help(camera: Camera, controller: MainController, theme: Theme) -> None:
    controller.window.go("lab")
    controller.show_help()
    camera.take(controller.window, f"help-{theme.name}", HOME)


def _take_machine(camera: Camera, controller: MainController, theme: Theme) -> None:
    controller.window.go("machine")
    camera.take(controller.window, f"machine-{theme.name}", HOME)
    place: Any = controller.window.place("machine")
    place.show_settings(controller.machine.settings, folder="~/Liquid Study", undo="", kept_in=KEPT_IN)
    place.open_test()
    test = camera.until(lambda: shown(DisplayTest), "the display test")
    test.showNormal()
    test.resize(1280, 720)
    camera.wait(TESTED_MS)
    camera.take(test, f"display-test-{theme.name}", (1280, 720))
    test.close()
