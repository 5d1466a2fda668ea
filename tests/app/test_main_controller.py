"""The main window before and after sessions: a cancelled session is released before the program ends."""

import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QDialog

from study_app.app import compilation, main_controller
from study_app.app.compilation import Compilation
from study_app.app.main_controller import MainController
from study_app.app.session import live_session
from study_app.errors import DeviceLost, DeviceNotFound
from study_app.gui.widgets.controls import ActionButton
from study_app.session.start import NewSession
from tests.session.small import CHOSEN

pytestmark = pytest.mark.slow

ALT = Qt.KeyboardModifier.AltModifier


class Machine:
    """An open device with its servo; the device may be lost when it is to be let go of."""

    def __init__(self, *, lost: bool = False) -> None:
        self.stopped = False
        self._lost = lost

    def stop(self) -> None:
        self.stopped = True
        if self._lost:
            raise DeviceLost("the device 'falcon' is gone")


@pytest.mark.slow
@pytest.mark.parametrize("how", ["back", "signal"])
def test_a_device_that_opens_after_all_is_let_go_of_before_the_end(
    visit: MainController, monkeypatch: Any, how: str
) -> None:
    machine, opening, may_open = Machine(), threading.Event(), threading.Event()

    def open_slowly(*_words: Any, **_named: Any) -> Machine:
        opening.set()
        may_open.wait(10)
        return machine

    monkeypatch.setattr(live_session, "open_rig", open_slowly)
    monkeypatch.setattr(live_session, "measure_rig", lambda *_words, **_named: None)
    visit.window.place("home").session_asked.emit(CHOSEN)
    assert opening.wait(10)
    assert visit.live is not None
    if how == "back":
        assert visit.live.note is not None
        visit.live.note.close()
        assert visit.window.isVisible()
        visit.window.close()
    else:
        visit.end_by_signal(15)
    threading.Timer(0.05, may_open.set).start()
    visit.end()
    assert machine.stopped


@pytest.mark.slow
def test_a_signal_waits_two_seconds_at_most_for_a_device_that_is_being_opened(
    visit: MainController, monkeypatch: Any
) -> None:
    opening, may_open = threading.Event(), threading.Event()

    def hang(*_words: Any, **_named: Any) -> Machine:
        opening.set()
        may_open.wait(30)
        return Machine()

    monkeypatch.setattr(live_session, "open_rig", hang)
    visit.window.place("home").session_asked.emit(CHOSEN)
    assert opening.wait(10)
    begun = time.perf_counter()
    visit.end_by_signal(15)
    visit.end()
    took_s = time.perf_counter() - begun
    may_open.set()
    assert took_s < 2.0 + 1.0
    assert visit.code == 128 + 15


def test_a_window_that_is_closed_at_once_loads_nothing_more(
    visit: MainController, monkeypatch: Any, qtbot: Any
) -> None:
    loaded: list[str] = []
    monkeypatch.setattr(main_controller, "load_modules", lambda: loaded.append("modules"))
    visit.open()
    visit.window.close()
    visit.end()
    qtbot.wait(main_controller.LOOK_AFTER_MS + 200)
    assert not loaded


def test_the_force_model_is_compiled_once_the_modules_are_loaded(
    visit: MainController, monkeypatch: Any, qtbot: Any
) -> None:
    steps: list[str] = []
    monkeypatch.setattr(main_controller, "load_modules", lambda: steps.append("loaded"))
    monkeypatch.setattr(compilation, "start_compilation", lambda: steps.append("compiles"))
    visit.compile_when_loaded()
    visit.preload()
    qtbot.waitUntil(lambda: steps == ["loaded", "compiles"])


def test_a_device_that_cannot_be_opened_is_tried_again_or_examined(
    visit: MainController, monkeypatch: Any, qtbot: Any
) -> None:
    tried: list[str] = []
    examined: list[str] = []

    def missing(name: str, *_settings: Any, **_named: Any) -> None:
        tried.append(name)
        raise DeviceNotFound("no Falcon is connected: plug it in")

    monkeypatch.setattr(live_session, "check_connected", missing)
    monkeypatch.setattr(visit.devices, "diagnose", examined.append)
    visit.window.place("home").session_asked.emit(replace(CHOSEN, device="falcon"))
    for count, words in ((1, "Try again"), (2, "Diagnose…")):
        qtbot.waitUntil(lambda count=count: len(tried) == count and visit.live is None)
        notice = visit.window.notice
        assert notice is not None
        assert notice.said.text() == "no Falcon is connected: plug it in."
        button = next(candidate for candidate in notice.findChildren(ActionButton) if candidate.text() == words)
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
        assert not notice.isVisible()
    assert (tried, examined) == (["falcon", "falcon"], ["falcon"])


@pytest.mark.parametrize("action", ["session", "enter", "device", "fade in"])
def test_opening_a_device_ends_a_running_diagnosis(visit: MainController, monkeypatch: Any, action: str) -> None:
    monkeypatch.setattr("study_app.app.session.live_session.LiveSession", Held)
    monkeypatch.setattr("study_app.gui.devices.view.open_diagnosis", lambda window, *_device: QDialog(window))
    monkeypatch.setattr("study_app.app.lab_controller.LabController._open_device", lambda *_device: None)
    visit.window.place("lab")
    visit.devices.diagnose("falcon")
    dialog = visit.devices.dialog
    assert dialog is not None
    assert dialog.isVisible()
    if action == "session":
        visit.window.place("home").session_asked.emit(CHOSEN)
    elif action == "enter":
        visit.window.go("lab")
    else:
        visit.window.place("lab").ask(action, "mouse")
    assert not dialog.isVisible()
    assert visit.devices.dialog is None


class Held(QObject):
    """A session that was held and is over as soon as it is opened."""

    over = Signal()
    has_begun, is_opening, error, code = True, False, None, 0

    def __init__(self, chosen: NewSession, theme: Any, *, asks: bool, compilation: Compilation) -> None:
        super().__init__()
        self.chosen, self.theme, self.compilation = chosen, theme, compilation
        assert asks

    def open(self) -> None:
        self.over.emit()


def test_the_sidebar_has_one_width_per_size_of_window_at_every_place(visit: MainController, qtbot: Any) -> None:
    for size, width in ((1024, 640), 72), ((1440, 900), 72), ((1920, 1080), 216):
        visit.window.resize(*size)
        for name in (*visit.window.rail.buttons, "home"):
            visit.window.go(name)
            qtbot.wait(1)
            assert (visit.window.size().toTuple(), visit.window.rail.width()) == (size, width), name


def test_keys_lead_from_every_place_to_home_and_to_a_new_study(visit: MainController, qtbot: Any) -> None:
    window = visit.window
    window.activateWindow()
    for name in window.rail.buttons:
        window.go(name)
        qtbot.keyClick(window, Qt.Key.Key_N, Qt.KeyboardModifier.ControlModifier)
        assert visit.designer is not None
        assert (window.here, visit.designer.place.stack.currentIndex()) == ("designer", 1), name
        visit.designer.place.close_new()
        window.go(name)
        qtbot.keyClick(window, Qt.Key.Key_Home, ALT)
        assert window.here == "home", name


def test_results_show_the_last_session(visit: MainController, monkeypatch: Any) -> None:
    folders: list[Path] = []
    monkeypatch.setattr("study_app.app.session.live_session.LiveSession", Held)
    monkeypatch.setattr(visit, "results_place", SimpleNamespace(choose_study=folders.append))
    visit.window.place("home").session_asked.emit(CHOSEN)
    assert (folders, visit.live) == ([CHOSEN.results], None)


def test_a_page_that_cannot_be_created_is_reported_once(visit: MainController, monkeypatch: Any) -> None:
    monkeypatch.setattr("study_app.gui.help.view.HelpPlace", lambda: 1 // 0)
    for go in (partial(visit.window.go, "help"), visit.show_help):
        with pytest.raises(ZeroDivisionError) as raised:
            go()
        visit.show_bug(raised.value)  # as of a slot
        notices = [notice for notice in visit.window.findChildren(QDialog) if notice.isVisible()]
        assert [notice.windowTitle() for notice in notices] == ["“Help” could not be opened"]
        notices[0].reject()


def test_a_mistake_before_the_first_window_leads_home_again(
    visit: MainController, monkeypatch: Any, capsys: Any
) -> None:
    def broken(*_given: Any, **_named: Any) -> None:
        raise TypeError("nobody is there")

    monkeypatch.setattr(live_session, "OpeningWindow", broken)
    visit.window.place("home").session_asked.emit(CHOSEN)
    assert visit.window.isVisible()
    assert visit.live is None
    assert visit.window.notice is not None
    assert visit.window.notice.windowTitle() == "A bug in the program stopped the session"
    assert "nobody is there" in capsys.readouterr().err


def test_back_leads_from_the_help_to_the_page_that_opened_it(visit: MainController, qtbot: Any) -> None:
    window = visit.window
    window.go("machine")
    window.activateWindow()
    window.place("machine").setFocus()
    window.place("machine").focusNextChild()
    asked_in = window.focusWidget()
    for by_keys in (False, True):
        qtbot.keyClick(window, Qt.Key.Key_F1)
        assert visit.help is not None
        assert window.focusWidget() is visit.help.reader
        leave = partial(qtbot.keyClick, window, Qt.Key.Key_Left, ALT) if by_keys else visit.help.back.click
        visit.help.open_page("lab")
        qtbot.keyClick(window.focusWidget(), Qt.Key.Key_PageDown)
        assert visit.help.reader.verticalScrollBar().value() > 0
        leave()
        assert (window.here, visit.help.reader.page) == ("help", "this-machine")
        leave()
        assert window.here == "machine"
        assert window.focusWidget() is asked_in
    qtbot.keyClick(window, Qt.Key.Key_F1)
    qtbot.keyClick(window, Qt.Key.Key_F1)
    assert visit.help.reader.page == "index", "F1 in the help"
    visit.help.back.click()
    visit.help.back.click()
    qtbot.keyClick(window, Qt.Key.Key_F1)
    visit.help.open_page("lab")
    qtbot.keyClick(visit.help.reader, Qt.Key.Key_Escape)
    assert window.here == "machine", "Esc leads there at once"
    qtbot.keyClick(window, Qt.Key.Key_F1)
    window.go("home")
    window.go("help")
    assert not visit.help.back.isEnabled(), "the place was left in another way"


def test_each_form_leads_to_the_glossary_and_back(visit: MainController, qtbot: Any) -> None:
    visit.open_designer("demo")
    assert visit.designer is not None
    qtbot.mouseClick(visit.designer.place.form.foot.glossary, Qt.MouseButton.LeftButton)
    assert visit.help is not None
    assert (visit.window.here, visit.help.reader.page) == ("help", "glossary")
    visit.help.back.click()
    visit.help.back.click()
    assert visit.window.here == "designer"
