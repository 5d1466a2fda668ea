"""The display test: the tank's own patch toggles when due."""

from types import SimpleNamespace

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QColor

from study_app.gui.participant.tank_widget import TankWidget
from study_app.gui.settings.view import FrameTimes
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


UNKNOWN = ("–", "–", "–", "–")
FRAMES_MS = (0, 21, 29, 90, 110, 141)  # gaps of 8, 20, 21, 31 and 61 ms; a refresh takes 20 ms at 50 Hz
FIGURES = ("35.5 of 50.0 Hz", "21.00 ms", "61.00 ms", "3")  # 5 gaps in 141 ms; one refresh was missed, then two


def figures_of(frames_ms, least_s=0.1):
    times = FrameTimes(50.0, least_s)
    for time_ms in frames_ms:
        times.add_frame(round(1e6 * time_ms))
    return times.figure_texts()


def test_rate_gaps_and_missed_refreshes_cover_the_last_ten_seconds():
    assert figures_of(FRAMES_MS) == FIGURES
    assert (figures_of((0, 200)), figures_of((0, 50, 99))) == (UNKNOWN, UNKNOWN)
    assert figures_of((0, 60, 100)) == ("20.0 of 50.0 Hz", "60.00 ms", "60.00 ms", "3")
    assert figures_of((0, 1000, 1999), least_s=2.0) == UNKNOWN
    assert figures_of((-1, 5000, 10_000, 14_900))[1:] == ("5000.00 ms", "5000.00 ms", str(244 + 249))
    assert figures_of((5000, 10_000, 15_000))[3] == str(249 + 249), "ten seconds are kept"
    assert figures_of([20 * k for k in range(200)] + [4000 + 61])[2] == "20.00 ms"
    assert [FrameTimes(rate_hz).refresh_hz for rate_hz in (0.0, -1.0, 0.5)] == [60.0, 60.0, 0.5]


def test_the_patch_toggles_after_each_interval_and_only_painted_frames_count(test_page, clock, qtbot):
    states = []
    for at_ms in (499, 500, 999, 1000):
        clock.now = round(1e6 * at_ms)
        test_page.draw_frame()
        states.append((test_page.lit, test_page.toggles))
    assert states == [(False, 0), (True, 1), (True, 1), (False, 2)]
    for typed, interval_ms in (("100", 100.0), ("49", 100.0), ("5001", 100.0), ("", 500.0)):
        control = test_page.interval.control
        control.selectAll()
        qtbot.keyClicks(control, typed) if typed else qtbot.keyClick(control, Qt.Key.Key_Delete)
        qtbot.keyClick(control, Qt.Key.Key_Return)
        assert test_page.interval_ms == interval_ms
    assert test_page.interval.control.text() == "500"
    test_page.times = FrameTimes(50.0, 0.1)
    test_page.grab()  # paints what `draw_frame` asked for
    test_page.times = FrameTimes(50.0, 0.1)
    for at_ms in FRAMES_MS:
        clock.now = round(1e6 * at_ms)
        test_page.draw_frame()
        for _ in range(2):
            test_page.grab()
    test_page.report_timer.timeout.emit()
    assert tuple(value.text() for value in test_page.values) == FIGURES


@pytest.mark.slow
def test_frames_are_requested_only_while_the_test_is_shown(qtbot):
    test_page = display_test(qtbot)
    test_page.start_frames()
    qtbot.waitUntil(lambda: test_page.times.figure_texts()[0] != "–")
    with qtbot.waitSignal(test_page.left):
        qtbot.keyClick(test_page, Qt.Key.Key_Escape)
    assert not test_page.frames.findChild(QTimer).isActive()
    assert not test_page.report_timer.isActive()
