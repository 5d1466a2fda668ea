"""The main window: places are made when one goes there, entered and left; the rail tells where one is."""

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication, QLabel, QPushButton, QVBoxLayout

from study_app.errors import StoreError
from study_app.gui.home.main_window import FULL, LEAST, MainWindow
from study_app.gui.home.navigation import DESTINATIONS, NARROW_RAIL, WIDE_RAIL
from study_app.gui.theme.theme import DARK
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

    def wants_narrow_rail(self):
        return self.name == "lab"


@pytest.fixture
def log():
    return []


@pytest.fixture
def main(qtbot, log):
    return opened(qtbot, {place.name: lambda name=place.name: Room(name, log) for place in DESTINATIONS}, {})


def opened(qtbot, makes, prepares):
    window = MainWindow(makes, prepares=prepares)
    qtbot.addWidget(window)
    window.show()
    return window


def test_one_begins_at_the_first_place_goes_by_the_rail_and_a_session_and_the_end_leave_it(main, log, qtbot):
    assert (main.here, log) == ("home", ["enter home"])
    qtbot.mouseClick(main.rail.buttons["lab"], Qt.MouseButton.LeftButton)
    assert (main.here, log[1:]) == ("lab", ["leave home", "enter lab"])
    assert [name for name, button in main.rail.buttons.items() if button.here] == ["lab"]
    main.rest()
    assert (main.isVisible(), log[-1]) == (False, "leave lab")
    main.come_back()
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
    main.rest()
    main.show_message("The studies could not be read", "The folder is gone.")
    assert not main.notice.isVisible()
    main.come_back()
    assert main.notice.isVisible()
    main.notice.accept()


def test_every_place_wears_the_theme_that_the_rail_chooses(main, qtbot):
    qtbot.mouseClick(main.rail.switch, Qt.MouseButton.LeftButton)
    assert main.rail.switch.text() == "Light theme"
    main.go("results")
    assert [main.place(name).theme for name in ("home", "results")] == [DARK, DARK]


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
    main.rest()
    main.focusNextChild()  # Qt does so where a hidden window becomes the active one
    assert main.focusWidget() is not began
    main.come_back()
    assert main.focusWidget() is began


@pytest.mark.parametrize(
    ("size", "place", "width"), [(FULL, "home", WIDE_RAIL), (LEAST, "home", NARROW_RAIL), (FULL, "lab", NARROW_RAIL)]
)
def test_the_rail_gives_way(main, size, place, width):
    main.resize(size)
    main.go(place)
    assert main.rail.width() == width


def test_whoever_goes_on_before_a_prepared_place_is_shown_gets_where_they_asked_to(qtbot):
    window = opened(qtbot, {"home": Place, "lab": Place, "devices": Place}, {"lab": lambda: iter((None,))})
    window.go("lab")
    window.go("devices")
    for _ in range(3):
        QApplication.processEvents()
    assert window.here == "devices"
    window.close()


@pytest.mark.parametrize("fails", ["make", "fill"])
@pytest.mark.parametrize("waits", [True, False])
def test_a_place_whose_step_fails_says_so_and_a_second_entry_tries_again(qtbot, fails, waits):
    ready, tried = not waits, []

    def step(kind):
        tried.append(kind)
        if kind == fails and tried.count(kind) == 1:
            raise RuntimeError("a file is missing")

    def make():
        step("make")
        return Place()

    def fill():
        step("fill")
        yield

    window = opened(qtbot, {"home": Place, "lab": make}, {"lab": lambda: fill() if ready else None})
    with qtbot.captureExceptions() as raised:
        QTimer.singleShot(0, lambda: window.go("lab"))
        qtbot.waitUntil(lambda: not waits or window.here == "lab")
        ready = True
        QTimer.singleShot(0, lambda: window.prepared("lab"))
        qtbot.waitUntil(lambda: window.notice is not None)
    assert [str(error) for _, error, _ in raised] == ["a file is missing"], "the terminal shows the details"
    assert window.here == "home"
    assert "a file is missing" in " ".join(one.text() for one in window.notice.findChildren(QLabel))
    window.notice.go_on.click()
    qtbot.waitUntil(lambda: window.stack.currentWidget() is window._places.get("lab"))
    assert tried == (["make", "make", "fill"] if fails == "make" else ["make", "fill", "fill"])
    window.close()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (StoreError("the folder cannot be read"), "the folder cannot be read."),
        (KeyError("a name"), "KeyError: 'a name'. This is a bug: please report it, with what the terminal shows."),
    ],
)
def test_a_place_that_cannot_be_made_says_why_and_is_tried_again(qtbot, error, said):
    fails = [error]

    def make():
        if fails:
            raise fails.pop()
        return Place()

    window = opened(qtbot, {"home": Place, "results": make, "lab": Place}, {"lab": lambda: None})
    window.go("lab")
    with qtbot.captureExceptions() as raised:
        qtbot.mouseClick(window.rail.buttons["results"], Qt.MouseButton.LeftButton)
    assert [one for _, one, _ in raised] == [error], "the terminal shows the details"
    assert window.here == "lab"
    assert [one.text() for one in window.notice.findChildren(QLabel)] == ["“Results” could not be opened", said]
    assert window.notice.go_on.text() == "Try again"
    window.notice.go_on.click()
    assert window.here == "results"
    assert not window.notice.isVisible()
    window.close()
