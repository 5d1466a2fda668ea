"""The display test: the tank's own patch toggles when due, greys and lines are what they say."""

from types import SimpleNamespace

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QColor

from study_app.gui.participant.tank.layers import PATCH
from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.settings.display_test import GREYS, GreyRamp, LineField, lines
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
    black = round(PATCH[0])
    area = (test_page.width() - black, test_page.height() - black, black, black)
    assert test_page.grab().toImage().copy(*area) == tank.grab().toImage().copy(*area)


@pytest.mark.slow
def test_frames_are_asked_for_while_it_is_shown_and_no_longer(qtbot):
    made = display_test(qtbot)
    made.begin()
    qtbot.waitUntil(lambda: made.times.figures() is not None)
    with qtbot.waitSignal(made.left):
        qtbot.keyClick(made, Qt.Key.Key_Escape)
    assert not made.frames.findChild(QTimer).isActive()
    assert not made.report_timer.isActive()


def test_greys_lie_beside_each_other_and_each_differs(qtbot):
    ramp = GreyRamp()
    qtbot.addWidget(ramp)
    ramp.resize(944, 96)
    image = ramp.grab().toImage()
    greys = [image.pixelColor(x, 10).red() for x in range(image.width())]
    assert greys == sorted(greys)
    assert (greys[0], greys[-1], len(set(greys))) == (0, 255, GREYS)


@pytest.mark.parametrize("thick", [1, 2])
@pytest.mark.parametrize("standing", [True, False])
@pytest.mark.parametrize("ratio", [1.0, 1.5])
def test_lines_are_so_many_device_pixels_thick(qtbot, thick, standing, ratio):
    field = LineField(thick, standing=standing)
    qtbot.addWidget(field)
    image = lines(60, 60, ratio, field)
    along = [image.pixelColor(*((n, 7) if standing else (7, n))).red() for n in range(8 * thick)]
    assert along == ([255] * thick + [0] * thick) * 4
