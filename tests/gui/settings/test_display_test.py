"""The display test: the tank's own patch toggles when due."""

from types import SimpleNamespace

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QColor

from study_app.gui.participant.tank_widget import TankWidget
from study_app.protocol.wording.languages import words
from tests.gui.small import task_page
from tests.gui.windows import display_test

WHITE, BLACK = QColor("#ffffff"), QColor("#000000")


@pytest.fixture
def clock():
    return SimpleNamespace(now=0)  # ns


@pytest.fixture
def test_page(qtbot, clock):
    return display_test(qtbot, now_ns=lambda: clock.now)


def test_the_patch_is_where_and_as_large_as_in_the_tank(test_page, qtbot):
    tank = TankWidget(task_page(), words("en"))
    qtbot.addWidget(tank)
    tank.resize(test_page.size())
    tank.patch.lit = test_page.lit = True
    black = 88
    area = (test_page.width() - black, test_page.height() - black, black, black)
    assert test_page.grab().toImage().copy(*area) == tank.grab().toImage().copy(*area)


@pytest.mark.slow
def test_frames_are_asked_for_while_it_is_shown_and_no_longer(qtbot):
    made = display_test(qtbot)
    made.start_frames()
    qtbot.waitUntil(lambda: made.times.figure_texts()[0] != "–")
    with qtbot.waitSignal(made.left):
        qtbot.keyClick(made, Qt.Key.Key_Escape)
    assert not made.frames.findChild(QTimer).isActive()
    assert not made.report_timer.isActive()
