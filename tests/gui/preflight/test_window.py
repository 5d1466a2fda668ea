"""The window before a session: every check with its value, warnings accepted by name, failures refused."""

from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication, QLabel

from study_app.gui.preflight import PreflightWindow
from study_app.gui.preflight.window import LEAST
from study_app.gui.theme.theme import DARK
from study_app.haptics.runtime.clocks.grants import Grant
from study_app.haptics.runtime.telemetry import Timing
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.masking import Masking
from study_app.session.preflight import Facts, Screen, checks
from study_app.viewmodels.preflight import WAITING, histogram, preflight_view, resumed_rows

pytestmark = pytest.mark.slow

NOW = datetime(2026, 3, 2, 14, 20)
WELL = Facts(
    device="mouse",
    fresh_share=1.0,
    timing=Timing(2000, 1000.0, 6.2e-5, 2e-3, 0),
    sample_age_s=0.001,
    screen=Screen(60.0, 1.0),
    probe_s=0.002,
    probe_fault="",
    free_bytes=212 * 10**9,
    participant="P007",
    recordings=True,
    tick_s=146e-9,
    grant=Grant("real-time", "SCHED_FIFO 60", locked=True),
    lateness_ns=np.arange(1, 2001) * 31,
)
SCALED = replace(WELL, screen=Screen(60.0, 1.5))
FULL_DISK = replace(WELL, free_bytes=1)


def view_of(facts, **more):
    protocol = load("rek2024")
    return preflight_view(protocol, facts, checks(facts, protocol), "Participant P007", now=NOW, **more)


@pytest.fixture
def window(qtbot):
    made = PreflightWindow(1000.0)
    qtbot.addWidget(made)
    made.show_view(view_of(WELL))
    made.show()
    return made


def test_every_check_has_a_row_with_its_value(window):
    said = {row.check.name: row.accessibleName() for row in window.rows}
    assert said["Servo rate"].startswith("Servo rate, passed, 1000.0 Hz")
    assert "146 ns per tick" in said["Cost of the scenes"]
    assert len(said) == len(checks(WELL, load("rek2024")))


@pytest.mark.parametrize(
    ("facts", "passed", "words", "able"),
    [
        (WELL, "11 of 11 passed", "Start", True),
        (SCALED, "10 of 11 passed", "Start with 1 warning", True),
        (replace(SCALED, probe_s=0.4), "9 of 11 passed", "Start with 2 warnings", True),
        (FULL_DISK, "10 of 11 passed", "Cannot start", False),
    ],
)
def test_the_button_says_what_is_accepted_by_it(window, facts, passed, words, able):
    window.show_view(view_of(facts))
    assert (window.chip.word, window.start.text(), window.start.isEnabled()) == (passed, words, able)


def test_a_warning_says_what_to_do(window):
    window.show_view(view_of(SCALED))
    row = next(row for row in window.rows if row.check.name == "Screen")
    assert any("100 % scaling" in part.text() for part in row.findChildren(QLabel))


@pytest.mark.parametrize("key", [Qt.Key.Key_Return, Qt.Key.Key_Enter])
def test_enter_begins_once(window, qtbot, key):
    began = []
    window.start_asked.connect(lambda: began.append(1))
    qtbot.keyClick(window, key)
    qtbot.keyClick(window, key)
    assert began == [1]


def test_enter_does_not_begin_what_cannot(window, qtbot):
    window.start_asked.connect(lambda: pytest.fail("begun"))
    window.show_view(view_of(FULL_DISK))
    qtbot.keyClick(window, Qt.Key.Key_Return)
    window.show_view(view_of(WELL, busy=True))
    qtbot.keyClick(window, Qt.Key.Key_Return)


def test_enter_on_another_button_does_what_it_says(window, qtbot):
    window.start_asked.connect(lambda: pytest.fail("begun"))
    window.again.setFocus()
    with qtbot.waitSignal(window.again_asked):
        qtbot.keyClick(window.again, Qt.Key.Key_Return)


def test_after_measuring_anew_enter_begins(window, qtbot):
    window.again.setFocus()
    window.show_view(view_of(WELL, busy=True))
    assert not window.again.hasFocus()
    window.show_view(view_of(WELL))
    with qtbot.waitSignal(window.start_asked):
        qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Return)


@pytest.mark.parametrize("how", ["escape", "cancel", "close"])
def test_one_goes_back_without_a_trace(window, qtbot, how):
    with qtbot.waitSignal(window.cancelled):
        if how == "escape":
            qtbot.keyClick(window, Qt.Key.Key_Escape)
        elif how == "cancel":
            qtbot.mouseClick(window.cancel, Qt.MouseButton.LeftButton)
        else:
            window.close()
    assert not window.isVisible()


def test_finishing_is_not_going_back(window):
    window.cancelled.connect(lambda: pytest.fail("cancelled"))
    window.finish()
    assert not window.isVisible()


def test_what_will_run_and_how_true_it_is(window):
    rows = dict(view_of(WELL).rows)
    assert rows["Answers"] == "62"
    assert rows["Expected force error"] == WAITING
    assert dict(view_of(WELL, error_n=0.004).rows)["Expected force error"] == "< 0.01 N"
    assert dict(view_of(WELL, error_n=0.031).rows)["Expected force error"] == "0.03 N"
    assert "Expected force error" not in dict(view_of(WELL, asked_error=False).rows)
    assert datetime.strptime(rows["Ends about"], "%H:%M").hour == 14


def test_the_histogram_holds_every_turn():
    edges, counts, p99 = histogram(WELL.lateness_ns / 1e3)
    assert counts.sum() == 2000
    assert len(edges) == len(counts) + 1
    assert p99 == pytest.approx(np.percentile(WELL.lateness_ns / 1e3, 99))
    assert histogram(np.empty(0))[2] is None


def test_every_check_can_be_looked_at_by_the_keyboard_in_the_smallest_window(window, qtbot):
    window.resize(LEAST)
    QApplication.processEvents()
    last = window.rows[-1]
    assert last.visibleRegion().boundingRect().height() < last.height()
    qtbot.keyClick(window.start, Qt.Key.Key_PageDown)
    assert last.visibleRegion().boundingRect().height() == last.height()
    qtbot.keyClick(window.start, Qt.Key.Key_PageUp)
    assert window.rows[0].visibleRegion().boundingRect().height() == window.rows[0].height()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_no_words_are_cut_in_the_smallest_window(qtbot, theme):
    made = PreflightWindow(1000.0, **({"theme": DARK} if theme == "dark" else {}))
    qtbot.addWidget(made)
    made.show_view(view_of(SCALED, error_n=0.004))
    made.resize(LEAST)
    made.show()
    QApplication.processEvents()
    for row in made.rows:
        for part in row.findChildren(QLabel):
            needed = part.sizeHint().width() if not part.wordWrap() else 0
            assert part.width() >= needed, (row.check.name, part.text())
            if part.wordWrap():
                assert part.height() >= part.heightForWidth(part.width()), (row.check.name, part.text())
    for value in made.runs.findChildren(QLabel):
        assert made.rect().contains(value.mapTo(made, QPoint(0, 0)))


def test_a_session_that_goes_on_says_where_and_what_is_kept(window):
    protocol = load("demo")
    schedule = build_schedule(protocol, "P007", 5)
    first, second = (trial.number for trial in schedule.trials[:2])
    happened = (
        {"event": "session_started"},
        {"event": "page_shown", "page": "welcome"},
        {"event": "page_left", "page": "welcome"},
        {"event": "trial_started", "trial": first, "attempt": 1},
        {"event": "trial_ended", "trial": first, "attempt": 1, "outcome": "complete"},
        {"event": "responses", "trial": first, "attempt": 1, "items": [{"item": "a"}, {"item": "b"}]},
        {"event": "trial_started", "trial": second, "attempt": 1},
    )
    rows = resumed_rows(protocol, schedule, [{**line, "t_s": float(at)} for at, line in enumerate(happened)])
    assert rows == (("Continues at", "Liquid setting 2, attempt\u00a02"), ("Kept", "2 of 8 answers"))
    window.show_view(view_of(WELL, goes_on=rows))
    assert {value.text() for value in window.values()} >= {"Liquid setting 2, attempt\u00a02", "2 of 8 answers"}
    assert "Kept" not in dict(view_of(WELL).rows)


def test_a_haptic_device_is_asked_whether_its_motors_are_masked(qtbot) -> None:
    assert PreflightWindow(2000.0).masking is None
    window = PreflightWindow(2000.0, asks_masking=True)
    qtbot.addWidget(window)
    window.show()
    asked = window.masking
    assert asked is not None
    assert asked.answer() == Masking("no")
    assert not asked.noise_db.isVisible()
    for _ in range(2):
        qtbot.keyClick(asked.means, Qt.Key.Key_Down)
    assert asked.noise_db.isVisible()
    asked.noise_db.setValue(64)
    assert asked.answer() == Masking("noise", 64)
    qtbot.keyClick(asked.means, Qt.Key.Key_Up)
    assert asked.answer().entry == {"means": "headphones", "noise_db": None}
