"""The display test: the tank's own patch toggles when due, greys and lines are what they say, offsets are typed."""

from itertools import pairwise

import pytest
from PySide6.QtCore import QPoint, QSize, Qt, QTimer
from PySide6.QtGui import QColor

from study_app.gui.participant.tank.photodiode_patch import PATCH
from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.settings.display_offset import offset_words
from study_app.gui.settings.display_test import FIRST_MS, DisplayTest, figures_words
from study_app.gui.settings.pixel_patterns import GREYS, GreyRamp, LineField, lines, steps
from study_app.protocol.wording.languages import words
from study_app.store.workstation import DisplayOffset
from tests.gui.small import task_page

WHITE, BLACK = QColor("#ffffff"), QColor("#000000")
OFFSET = DisplayOffset(mean_ms=23.5, spread_ms=1.2, measured="2026-11-20", screen="DP-1")


class Clock:
    """Nanoseconds that pass when told."""

    def __init__(self):
        self.now = 0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def test_page(qtbot, clock):
    made = DisplayTest("Screen 1", 60.0, now_ns=clock, least_s=0.05)
    qtbot.addWidget(made)
    made.resize(1366, 768)
    made.show()
    return made


def corner(widget):
    return widget.grab().toImage().pixelColor(widget.width() - 3, widget.height() - 3)


def test_the_patch_toggles_when_its_time_has_come_and_is_painted(test_page, clock):
    clock.now = round(1e6 * FIRST_MS) - 1
    test_page.frame()
    assert (test_page.lit, corner(test_page)) == (False, BLACK)
    clock.now += 1
    test_page.frame()
    assert (test_page.lit, corner(test_page)) == (True, WHITE)
    clock.now += round(1e6 * FIRST_MS)
    test_page.frame()
    assert (test_page.toggles, corner(test_page)) == (2, BLACK)


def test_the_patch_is_where_and_as_large_as_in_the_tank(test_page, qtbot):
    tank = TankWidget(task_page(), words("en"))
    qtbot.addWidget(tank)
    tank.resize(test_page.size())
    tank.patch.lit = test_page.lit = True
    black = round(PATCH[0])
    area = (test_page.width() - black, test_page.height() - black, black, black)
    assert test_page.grab().toImage().copy(*area) == tank.grab().toImage().copy(*area)


def test_frames_are_counted_when_they_are_painted(test_page, clock):
    for _ in range(10):
        clock.now += 16_666_667
        test_page.frame()
        test_page.repaint()
    assert test_page.times.figures().painted == 10
    test_page.repaint()  # that nobody asked for
    assert test_page.times.figures().painted == 10
    test_page.show_figures()
    assert [value.text() for value in test_page.values] == ["60.0 of 60.0 Hz", "16.67 ms", "16.67 ms", "0"]
    assert figures_words(None, 60.0) == ("–",) * 4


@pytest.mark.slow
def test_frames_are_asked_for_while_it_is_shown_and_no_longer(qtbot):
    made = DisplayTest("Screen 1", 60.0, least_s=0.05)
    qtbot.addWidget(made)
    made.show()
    made.begin()
    qtbot.waitUntil(lambda: made.times.figures() is not None)
    with qtbot.waitSignal(made.left):
        qtbot.keyClick(made, Qt.Key.Key_Escape)
    assert not made.frames.findChild(QTimer).isActive()
    assert not made.report_timer.isActive()


def test_the_interval_is_typed_and_one_out_of_range_is_refused(test_page, qtbot):
    field = test_page.interval
    field.setFocus()
    field.selectAll()
    qtbot.keyClicks(field, "200")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert test_page.interval_ms == 200
    field.selectAll()
    qtbot.keyClicks(field, "9")
    qtbot.keyClick(field, Qt.Key.Key_Return)
    assert (test_page.interval_ms, field.state) == (200, "refused")
    assert "50 to 5000" in test_page.why.text()


def test_what_the_photodiode_said_is_typed(test_page, qtbot):
    form = test_page.offset
    qtbot.keyClicks(form.mean, "23,5")
    qtbot.keyClicks(form.spread, "1.2")
    with qtbot.waitSignal(test_page.kept) as kept:
        qtbot.mouseClick(form.keep, Qt.MouseButton.LeftButton)
    assert kept.args == [23.5, 1.2, "photodiode"]


@pytest.mark.parametrize(("mean", "spread"), [("", "1"), ("900", "1"), ("20", "400")])
def test_an_offset_that_cannot_be_is_refused_with_what_can(test_page, qtbot, mean, spread):
    form = test_page.offset
    qtbot.keyClicks(form.mean, mean)
    qtbot.keyClicks(form.spread, spread)
    with qtbot.assertNotEmitted(test_page.kept):
        qtbot.mouseClick(form.keep, Qt.MouseButton.LeftButton)
    assert form.why.isVisible()
    assert " to " in form.why.text()


def test_an_offset_of_another_screen_is_said_not_to_count():
    assert offset_words(OFFSET, "DP-1") == "23.5 ± 1.2 ms by photodiode, 2026-11-20."
    assert "not used here" in offset_words(OFFSET, "HDMI-1")
    assert offset_words(None, "DP-1").startswith("Not measured")


@pytest.mark.parametrize("width", [800, 944, 1286, 1840])
def test_greys_lie_beside_each_other_and_each_differs(qtbot, width):
    edges = steps(width)
    assert len(edges) == GREYS
    assert edges[0][0] == 0
    assert edges[-1][1] == width
    assert all(left[1] == right[0] for left, right in pairwise(edges))
    ramp = GreyRamp()
    qtbot.addWidget(ramp)
    ramp.resize(width, 96)
    image = ramp.grab().toImage()
    greys = [image.pixelColor((left + right) // 2, 10).red() for left, right in edges]
    assert greys == sorted(set(greys))
    assert (greys[0], greys[-1]) == (0, 255)


@pytest.mark.parametrize("thick", [1, 2])
@pytest.mark.parametrize("standing", [True, False])
@pytest.mark.parametrize("ratio", [1.0, 1.5, 2.0])
def test_lines_are_so_many_device_pixels_thick(qtbot, thick, standing, ratio):
    field = LineField(thick, standing=standing)
    qtbot.addWidget(field)
    image = lines(60, 60, ratio, field)
    along = [image.pixelColor(*((n, 7) if standing else (7, n))).red() for n in range(8 * thick)]
    assert along == ([255] * thick + [0] * thick) * 4


@pytest.mark.parametrize("size", [QSize(1024, 640), QSize(1366, 768), QSize(1920, 1080)])
def test_nothing_stands_in_the_patchs_corner_and_no_word_is_cut(test_page, qtbot, size):
    test_page.resize(size)

    def apart():
        patch = test_page.patch_area()
        for one in (*test_page.values, test_page.leave, test_page.offset, test_page.interval):
            place = one.geometry()
            place.moveTopLeft(one.mapTo(test_page, QPoint()))
            assert not place.intersects(patch)
            assert test_page.rect().contains(place)

    qtbot.waitUntil(apart)
