"""The main window: places are made when one goes there, entered and left; the rail tells where one is."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton, QVBoxLayout

from study_app.gui.home.main_window import DESTINATIONS, MainWindow
from study_app.gui.widgets.main_view import Place


class Room(Place):
    """A place that remembers when it was entered and left."""

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


def test_what_a_place_says_is_shown_until_one_leaves_it_and_after_a_session(main):
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
    assert main.notice.isVisible()
    main.notice.accept()


def test_places_are_reached_and_the_window_is_closed_by_the_keyboard_alone(main, qtbot):
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
