"""Every window but the participant's, opened with sample data of a study."""

import os
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, cast

import numpy as np
from PySide6.QtWidgets import QWidget

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, READY, Backend
from study_app.gui.devices.view import DevicesPlace
from study_app.gui.display.screens import ScreenShown
from study_app.gui.help.view import HelpPlace
from study_app.gui.home.dialogs import NewSessionDialog, RehearsalDialog
from study_app.gui.home.main_window import MainWindow
from study_app.gui.home.study_facts import study_facts
from study_app.gui.kit.devices import devices_shown
from study_app.gui.lab.view import LabPlace
from study_app.gui.preflight.window import LEAST as LEAST_PREFLIGHT
from study_app.gui.preflight.window import PreflightView, PreflightWindow, planned_rows
from study_app.gui.results.figures import unblinding_text
from study_app.gui.results.view import ResultsPlace
from study_app.gui.settings import view as settings_view
from study_app.gui.settings.view import DisplayTest, MachinePlace
from study_app.gui.startup_window import OpeningWindow
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.main_view import Place
from study_app.haptics.runtime.grants import Grant
from study_app.haptics.runtime.telemetry import Timing
from study_app.protocol.load import load
from study_app.session.preflight import Measurements, Screen, preflight_checks
from study_app.store.workstation import DEFAULTS, MachineSettings
from tests.gui.home.home_window import open_home
from tests.gui.lab.sample import still_view
from tests.gui.results.sample import LEFT_OUT, view

FOUND = [
    Backend("mouse", "the window", state=READY, can="seen, not felt"),
    Backend("falcon", "libusb 1.0", state=NONE, can="felt, up to 8 N", why="plug it in"),
    Backend("falcon", "ftd2xx", state=NOT_AVAILABLE, can="the same", why="for Windows alone"),
    Backend("falcon-emulated", "the program", state=READY, can="moves by itself"),
    Backend("falcon-emulated", "the program", state=READY, can="another program's"),
]
SCREENS = (
    ScreenShown(
        number=1,
        name="eDP-1",
        width_px=1366,
        height_px=768,
        refresh_hz=60.0,
        scaling=1.0,
        width_mm=344.0,
        height_mm=194.0,
    ),
    ScreenShown(
        number=2,
        name="DP-1",
        width_px=1920,
        height_px=1080,
        refresh_hz=144.0,
        scaling=1.0,
        width_mm=527.0,
        height_mm=296.0,
    ),
)
WELL = Measurements(
    device="mouse",
    fresh_share=1.0,
    timing=Timing(ticks=2000, rate_hz=1000.0, lateness_p99_s=6.2e-5, worst_gap_s=2e-3, overruns=0),
    sample_age_s=0.001,
    screen=Screen(60.0, 1.0),
    probe_s=0.002,
    probe_fault="",
    free_bytes=212 * 10**9,
    participant="P007",
    recordings=True,
    tick_s=146e-9,
    grant=Grant("real-time", "SCHED_FIFO 60", locked=True),
    lateness_ns=np.arange(1, 2001) * 31,
)
SCALED = replace(WELL, screen=Screen(60.0, 1.5))
GOES_ON = (("Continues at", "Liquid setting 2, attempt\u00a02"), ("Kept", "2 of 8 answers"))
OPENED = unblinding_text({"at": "2026-11-19", "by": "AK", "reason": "collection closed"})


def show_window(qtbot: Any, window: Any, size: tuple[int, int], theme: Any = LIGHT) -> Any:
    """Show a window or a page on the screen and return it."""
    qtbot.addWidget(window)
    if not hasattr(window, "given_theme"):
        apply_theme(window, theme)
    window.resize(*size)
    window.show()
    qtbot.waitExposed(window)
    return window


def devices(qtbot: Any) -> DevicesPlace:
    place: Any = DevicesPlace(DEFAULTS, lambda: FOUND)
    place.diagnose = lambda name: place.message.emit("diagnose", name)
    window: DevicesPlace = show_window(qtbot, place, (1200, 700), DARK)
    window.show_devices(devices_shown(FOUND))
    return window


def machine(qtbot: Any) -> MachinePlace:
    """Return the settings of a machine with two screens, if `two_screens` is used."""
    window: MachinePlace = show_window(qtbot, MachinePlace(), (1300, 760))
    show_settings(window, DEFAULTS)
    return window


def set_machine(qtbot: Any) -> MachinePlace:
    window = machine(qtbot)
    apply_theme(window, DARK)
    show_settings(window, MachineSettings(viewing_distance_mm=600), undo="width of the screen")
    return window


def show_settings(place: MachinePlace, settings: MachineSettings, undo: str = "") -> None:
    place.show_settings(settings, folder="/there", undo=undo, kept_in="/there/machine.json")


def two_screens(monkeypatch: Any) -> None:
    monkeypatch.setattr(settings_view, "screens_shown", lambda: SCREENS)


def checked(
    facts: Measurements,
    *,
    busy: bool = False,
    goes_on: tuple[tuple[str, str], ...] = (),
    error_n: float | None = None,
    **more: Any,
) -> PreflightView:
    protocol = load("rek2024")
    rows = (*goes_on, *planned_rows(protocol, datetime(2026, 3, 2, 14, 20), error_n, **more))
    return PreflightView("rek2024", "Participant P007", facts, preflight_checks(facts, protocol), rows, busy=busy)


def preflight(
    qtbot: Any, facts: Measurements = WELL, goes_on: tuple[tuple[str, str], ...] = (), **more: Any
) -> PreflightWindow:
    window = PreflightWindow(1000.0, **more)
    qtbot.addWidget(window)
    window.show_view(checked(facts, error_n=0.004, goes_on=goes_on))
    window.show()
    return window


class Idle:
    """A worker that stores its orders, in place of the process that reads studies."""

    works = True

    def __init__(self) -> None:
        self.orders: list[Any] = []

    def order(self, order: Any) -> int:
        self.orders.append(order)
        return len(self.orders)

    def stop(self) -> None:
        """Go on: nothing is under way."""

    close = stop


def results(qtbot: Any, results_view: Any = None) -> ResultsPlace:
    """Return the results in their main window, with drawn figures."""
    where, idle = Path(os.sep, "somewhere", "results"), cast("Any", Idle)
    window = MainWindow({"home": Place, "results": lambda: ResultsPlace(where, opener=str, start_worker=idle)})
    qtbot.addWidget(window)
    window.resize(1366, 768)
    window.show()
    place: Any = window.place("results")
    place._listening.setInterval(10**8)  # there are no answers,
    place._choose_study = lambda _folder: None  # so that this study stays
    window.go("results")
    place.main = window  # or it would be collected here
    place.show_view(results_view or view())
    qtbot.waitUntil(lambda: all(card.drawing is None or card.drawing.is_settled for card in place.figures.cards))
    return place  # type: ignore[no-any-return]


def opened_results(qtbot: Any) -> ResultsPlace:
    return results(qtbot, view(opened=OPENED, left_out=(LEFT_OUT,)))


def lab(qtbot: Any) -> LabPlace:
    window: LabPlace = show_window(qtbot, LabPlace(), (1528, 900))
    window.show_view(still_view())
    return window


def help_pages(qtbot: Any) -> HelpPlace:
    window: HelpPlace = show_window(qtbot, HelpPlace(), (1266, 768))
    return window


def display_test(qtbot: Any, **clock: Any) -> DisplayTest:
    window: DisplayTest = show_window(qtbot, DisplayTest("Screen 1", 60.0, least_s=0.05, **clock), (1366, 768))
    return window


PLACES = ((928, 640), (1294, 768), (1848, 1080))
MAIN = ((1024, 640), (1366, 768), (1920, 1080))
PREFLIGHT = (LEAST_PREFLIGHT.toTuple(), (1366, 768))


def dialog(kind: type[Any], qtbot: Any, folder: Any) -> QWidget:
    window = kind(study_facts("rek2024"), folder)
    qtbot.addWidget(window)
    window.open()
    return window  # type: ignore[no-any-return]


WINDOWS: dict[str, tuple[Callable[..., Any], tuple[Any, ...]]] = {
    "home": (lambda qtbot, folder: open_home(qtbot, folder).main, MAIN),
    "new session": (lambda qtbot, folder: dialog(NewSessionDialog, qtbot, folder), (None,)),
    "rehearsal": (lambda qtbot, folder: dialog(RehearsalDialog, qtbot, folder), (None,)),
    "opening": (lambda qtbot, _: show_window(qtbot, OpeningWindow("Preparing demo", "P001"), (500, 300)), (None,)),
    "preflight": (lambda qtbot, _: preflight(qtbot, SCALED), PREFLIGHT),
    "preflight of a haptic device": (lambda qtbot, _: preflight(qtbot, SCALED, GOES_ON, asks_masking=True), PREFLIGHT),
    "results": (lambda qtbot, _: opened_results(qtbot).main, MAIN),
    "lab": (lambda qtbot, _: lab(qtbot), PLACES),
    "devices": (lambda qtbot, _: devices(qtbot), PLACES),
    "settings": (lambda qtbot, _: set_machine(qtbot), PLACES),
    "display test": (lambda qtbot, _: display_test(qtbot), MAIN),
    "help": (lambda qtbot, _: help_pages(qtbot), PLACES),
}
