"""Every window at its least and its usual size: nothing is cut, everything has a name, no button is dead."""

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from PySide6.QtGui import QAccessible
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.home.new_session_dialog import NewSessionDialog
from study_app.gui.home.rehearsal_dialog import RehearsalDialog
from study_app.gui.home.startup_window import OpeningWindow
from study_app.gui.preflight.window import LEAST as LEAST_PREFLIGHT
from study_app.viewmodels.home import study_facts
from tests.gui import windows
from tests.gui.home.home_window import open_home
from tests.gui.walk import cut, dead, settle, unnamed, unreached

pytestmark = pytest.mark.slow

PLACES = ((928, 640), (1294, 768), (1848, 1080))
MAIN = ((1024, 640), (1366, 768), (1920, 1080))
PREFLIGHT = (LEAST_PREFLIGHT.toTuple(), (1366, 768))


def dialog(kind: type[Any], qtbot: Any, folder: Any) -> QWidget:
    made = kind(study_facts("rek2024"), folder)
    qtbot.addWidget(made)
    made.open()
    return made  # type: ignore[no-any-return]


WINDOWS: dict[str, tuple[Callable[..., Any], tuple[Any, ...]]] = {
    "home": (lambda qtbot, folder: open_home(qtbot, folder).main, MAIN),
    "new session": (lambda qtbot, folder: dialog(NewSessionDialog, qtbot, folder), (None,)),
    "rehearsal": (lambda qtbot, folder: dialog(RehearsalDialog, qtbot, folder), (None,)),
    "opening": (lambda qtbot, _: windows.shown(qtbot, OpeningWindow("Preparing demo", "P001"), (500, 300)), (None,)),
    "preflight": (lambda qtbot, _: windows.preflight(qtbot, windows.SCALED), PREFLIGHT),
    "preflight of a haptic device": (
        lambda qtbot, _: windows.preflight(qtbot, windows.SCALED, windows.GOES_ON, asks_masking=True),
        PREFLIGHT,
    ),
    "results": (lambda qtbot, _: windows.opened_results(qtbot).main, MAIN),
    "lab": (lambda qtbot, _: windows.lab(qtbot), PLACES),
    "devices": (lambda qtbot, _: windows.devices(qtbot), PLACES),
    "settings": (lambda qtbot, _: windows.set_machine(qtbot), PLACES),
    "display test": (lambda qtbot, _: windows.display_test(qtbot), MAIN),
    "help": (lambda qtbot, _: windows.help_pages(qtbot), PLACES),
}


@pytest.fixture(autouse=True)
def nothing_left(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    windows.two_screens(monkeypatch)
    yield
    for window in QApplication.topLevelWidgets():
        window.close()


@pytest.mark.parametrize("name", WINDOWS)
def test_nothing_is_cut_everything_has_a_name_and_no_button_is_dead(qtbot: Any, tmp_path: Any, name: str) -> None:
    make, sizes = WINDOWS[name]
    window = make(qtbot, tmp_path)
    for size in sizes:
        settle(window, size)

        def fits() -> None:
            assert cut(window) == []

        qtbot.waitUntil(fits)
        assert size is None or window.size().toTuple() == size
    assert unnamed(window) == []
    assert unreached(window) == []
    assert dead(window) == []
    if name.startswith(("opening", "preflight")):
        assert QAccessible.queryAccessibleInterface(window).role() == QAccessible.Role.Window
