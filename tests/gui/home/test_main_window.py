"""The main window: pages are created on the first visit, entered and left; the rail marks the present one."""

from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QApplication, QPushButton, QVBoxLayout
from shiboken6 import isValid

from study_app.errors import StudyError
from study_app.gui.home.main_window import DESTINATIONS, MainWindow, bug_sentence
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.main_view import Place


class Room(Place):
    """A page that records when it was entered and left."""

    def __init__(self, name, log):
        super().__init__()
        self.name, self.log = name, log
        column = QVBoxLayout(self)
        column.addWidget(QPushButton(name))
        column.addWidget(QPushButton(f"{name} again"))

    def enter(self):
        self.log.append(f"enter {self.name}")

    def leave(self):
        self.log.append(f"leave {self.name}")


@pytest.fixture
def log():
    return []


@pytest.fixture
def main(qtbot, log):
    window = MainWindow({place.name: lambda name=place.name: Room(name, log) for place in DESTINATIONS})
    qtbot.addWidget(window)
    window.show()
    return window


def test_one_begins_at_the_first_place_goes_by_the_rail_and_a_session_and_the_end_leave_it(main, log, qtbot):
    assert (main.here, log) == ("home", ["enter home"])
    qtbot.mouseClick(main.rail.buttons["lab"], Qt.MouseButton.LeftButton)
    assert (main.here, log[1:]) == ("lab", ["leave home", "enter lab"])
    assert [name for name, button in main.rail.buttons.items() if button.is_current] == ["lab"]
    for narrow, words in ((True, "Dark"), (False, "Dark theme")):
        main.rail.set_narrow(narrow)
        assert (main.rail.switch.text(), main.rail.switch.accessibleName()) == (words, "Dark theme")
    main.hide_for_session()
    assert (main.isVisible(), log[-1]) == (False, "leave lab")
    main.return_from_session()
    assert (main.isVisible(), log[-1]) == (True, "enter lab")
    main.close()
    assert log[-1].startswith("leave")
    assert "leave lab" in log[-2:]


def test_a_message_of_a_page_is_shown_until_it_is_left_and_again_after_a_session(main):
    main.place("home").go_asked.emit("devices")
    assert main.here == "devices"
    main.place("devices").message.emit("It did not work", "The cable is out.")
    assert main.notice.isVisible()
    main.go("home")
    assert not main.notice.isVisible()
    main.place("devices").message.emit("It did not work", "The cable is out.")
    main.go("devices")
    assert main.notice.isVisible(), "it is said before one goes there, too"
    main.go("home")
    main.hide_for_session()
    main.show_message("The studies could not be read", "The folder is gone.")
    assert not main.notice.isVisible()
    main.return_from_session()
    notice = main.notice
    assert notice.isVisible()
    notice.accept()
    QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert not isValid(notice)
    main.show_message("It did not work", "The cable is out.")
    notice = main.notice
    assert notice.isVisible(), "the session is over"
    main.close()
    assert not notice.isVisible()


def test_the_rail_leads_to_the_places_that_there_are(qtbot):
    window = MainWindow({"home": Place, "help": Place})
    qtbot.addWidget(window)
    assert [*window.rail.buttons] == ["home", "help"]
    assert (window.rail.switch.icon_name, window.rail.switch.word, window.rail.switch.short) == (
        "moon", "Dark theme", "Dark"
    )  # fmt: skip


def test_all_pages_and_closing_are_reachable_by_keyboard(main, qtbot):
    for key, place in ((Qt.Key.Key_Space, "designer"), (Qt.Key.Key_Return, "results")):
        main.rail.buttons[main.here].setFocus()
        qtbot.keyClick(main.focusWidget(), Qt.Key.Key_Tab)
        qtbot.keyClick(main.focusWidget(), key)
        assert main.here == place
    with qtbot.waitSignal(main.closed):
        qtbot.keyClick(main, Qt.Key.Key_Q, Qt.KeyboardModifier.ControlModifier)
    assert not main.isVisible()


@pytest.mark.parametrize("key", [Qt.Key.Key_Space, Qt.Key.Key_Return])
def test_keyboard_goes_from_the_rail_into_the_place(main, qtbot, key):
    def go(name):
        main.rail.buttons[name].setFocus()
        qtbot.keyClick(main.focusWidget(), key)

    go("lab")
    first, second = main.place("lab").findChildren(QPushButton)
    assert main.focusWidget() is first, "the first part of a place that had no keyboard yet"
    second.setFocus()
    go("home")
    assert main.place("home").isAncestorOf(main.focusWidget())
    go("lab")
    assert main.focusWidget() is second, "the part that had the keyboard last"
    second.hide()
    go("lab")
    assert main.focusWidget() is first, "one is here already, and the last part is gone"
    first.hide()
    go("lab")
    assert main.focusWidget() is main.rail.buttons["lab"], "a place without parts takes no keyboard"


def test_keyboard_is_after_a_session_where_it_was_before(main, qtbot):
    qtbot.waitUntil(main.isActiveWindow)
    began = main.place("home").findChild(QPushButton)
    began.setFocus()
    main.hide_for_session()
    main.focusNextChild()  # Qt does so where a hidden window becomes the active one
    assert main.focusWidget() is not began
    main.return_from_session()
    assert main.focusWidget() is began


def test_the_rail_names_each_place_at_full_length_where_it_is_wide(main, qtbot):
    for width, words in (
        (1680, ["Home", "Study designer", "Results", "Liquid lab", "Devices", "This machine", "Help", "Dark theme"]),
        (1679, ["Home", "Designer", "Results", "Lab", "Devices", "Machine", "Help", "Dark"]),
    ):
        main.resize(width, 900)
        buttons = [*main.rail.buttons.values(), main.rail.switch]
        assert [button.text() for button in buttons] == words
        assert main.rail.name.isHidden() is (width == 1679)
    names = ["home", "designer", "results", "lab", "devices", "machine", "help"]
    assert [*main.rail.buttons] == [place.name for place in DESTINATIONS] == names
    assert [button.icon_name for button in main.rail.buttons.values()] == [place.icon for place in DESTINATIONS]
    assert [button.accessibleDescription() for button in buttons] == ["You are here", *[""] * 7]
    main.go("lab")
    assert [button.accessibleDescription() for button in buttons] == [*[""] * 3, "You are here", *[""] * 4]


def test_the_switch_of_the_rail_changes_the_theme_to_the_one_that_it_names(main, qtbot):
    for theme, icon, words in ((DARK, "sun", ("Light theme", "Light")), (LIGHT, "moon", ("Dark theme", "Dark"))):
        with qtbot.waitSignal(main.theme_changed) as heard:
            main.rail.switch.click()
        assert heard.args == [theme]
        assert main.theme is theme
        assert (main.rail.switch.icon_name, main.rail.switch.word, main.rail.switch.short) == (icon, *words)
        assert (main.rail.switch.accessibleName(), main.rail.switch.text()) == words
    with qtbot.assertNotEmitted(main.theme_changed):
        main.show_theme(DARK)
    assert main.rail.switch.word == "Light theme"


def other_buttons(notice):
    named = (notice.go_on, notice.back)
    return [button for button in notice.findChildren(ActionButton) if button not in named]


def test_a_message_opens_its_file_and_closes_on_request_of_its_page(main, monkeypatch):
    files = []
    monkeypatch.setattr("study_app.gui.home.main_window.open_here", files.append)
    home, lab = main.place("home"), main.place("lab")
    home.file_message.emit("Written", "It is here.", Path("report.html"))
    notice = main.notice
    assert (notice.windowTitle(), notice.said.text(), notice.go_on.text()) == ("Written", "It is here.", "Close")
    (button,) = other_buttons(notice)
    assert button.text() == "Open the file"
    lab.message_over.emit()
    assert notice.isVisible()
    home.message_over.emit()
    assert not notice.isVisible()
    home.file_message.emit("Written", "It is here.", Path("report.html"))
    other_buttons(main.notice)[0].click()
    assert files == [Path("report.html")]
    lab.message.emit("Saved", "There.")
    assert (main.notice.windowTitle(), main.notice.said.text(), other_buttons(main.notice)) == ("Saved", "There.", [])
    main.notice.accept()


def test_a_failed_device_is_tried_again_or_diagnosed(main):
    said = []
    for diagnose, names in ((lambda: said.append("diagnose"), ["Diagnose…"]), (None, [])):
        main.ask_about_device("Not found", "Plug it in.", lambda: said.append("retry"), diagnose)
        notice = main.notice
        assert (notice.windowTitle(), notice.said.text()) == ("Not found", "Plug it in.")
        assert (notice.go_on.text(), notice.back.text(), notice.back.isHidden()) == ("Try again", "Close", False)
        assert [button.text() for button in other_buttons(notice)] == names
        for button in other_buttons(notice):
            button.click()
        assert notice.isVisible() is (diagnose is None)
        notice.show()
        notice.go_on.click()
        assert not notice.isVisible()
    assert said == ["diagnose", "retry", "retry"]


def test_a_page_that_fails_to_open_states_the_reason_and_is_retried(main, log):
    def fail():
        raise StudyError("the folder is gone")

    maker, main._makers["lab"] = main._makers["lab"], fail
    with pytest.raises(StudyError, match="the folder is gone"):
        main.go("lab")
    notice = main.notice
    assert (notice.windowTitle(), notice.said.text()) == ("“Liquid lab” could not be opened", "the folder is gone.")
    assert (notice.go_on.text(), notice.back.text(), main.here) == ("Try again", "Close", "home")
    assert str(main.not_opened) == "the folder is gone"
    main._makers["lab"] = maker
    notice.go_on.click()
    assert (main.here, log[-1]) == ("lab", "enter lab")
    main.hide()
    main._makers["help"], main.not_opened = fail, None
    with pytest.raises(StudyError):
        main.place("help")
    assert main.not_opened is None, "a hidden window shows nothing"


def test_an_unexpected_error_is_called_a_bug():
    assert bug_sentence(StudyError("the disk is full")) == "the disk is full."
    words = "ValueError: no number. This is a bug: please report it and include the terminal output."
    assert bug_sentence(ValueError("no number")) == words
