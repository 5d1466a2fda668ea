"""A window stands on its screen with its frame."""

import pytest
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QWidget

from study_app.gui.display.screens import place_window

pytestmark = pytest.mark.slow


def test_window_as_large_as_the_screen_makes_room_for_a_frame_that_comes_late(qtbot) -> None:
    room = QGuiApplication.primaryScreen().availableGeometry()
    window = QWidget()
    qtbot.addWidget(window)
    window.resize(room.size())
    place_window(window, window.screen(), corner=False)
    qtbot.wait(600)  # until then it has no frame
    window.show()
    qtbot.waitExposed(window)
    qtbot.waitUntil(lambda: room.contains(window.frameGeometry()))
    assert window.frameGeometry() != window.geometry()
    assert window.frameGeometry().size() == room.size()


def test_window_that_fits_or_fills_the_screen_keeps_size_and_least_size(qtbot) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    window.setMinimumSize(QSize(300, 200))
    window.resize(500, 400)
    place_window(window, window.screen(), corner=True)
    window.show()
    qtbot.waitExposed(window)
    qtbot.wait(400)
    assert window.size() == QSize(500, 400)
    assert window.minimumSize() == QSize(300, 200)
    window.showFullScreen()
    qtbot.wait(400)
    assert window.windowState() & Qt.WindowState.WindowFullScreen
    assert window.size() == window.screen().size()
