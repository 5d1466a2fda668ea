"""The window before a session: every check with its value, warnings accepted by name, failures refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtWidgets import QLabel, QScrollArea, QWidget

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.gui.preflight.window import (
    BAR,
    LEFT,
    NAME,
    ComputerWindow,
    PreflightWindow,
    _compiled_check,
    _device_check,
    computer_checks,
    resumed_rows,
)
from study_app.gui.theme.theme import LIGHT
from study_app.gui.widgets.cards import Bar
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.preflight import Check, Masking
from tests.gui.walk import settle
from tests.gui.windows import SCALED, WELL, checked, preflight
from tests.journal_lines import event_from

pytestmark = pytest.mark.slow

FULL_DISK = replace(WELL, free_bytes=1)


@pytest.fixture
def window(qtbot):
    return preflight(qtbot)


CHECKS = (
    Check("Rate", "ok", "1 kHz", about="of the servo", share=0.25),
    Check("Screen", "warning", "48 Hz", about="of this screen", advice="Use another screen.", share=1.5),
    Check("Disk", "failure", "none", about="of its space", advice="Free some space."),
)


def record_starts(window):
    starts = []
    window.start_asked.connect(lambda: starts.append("begun"))
    return starts


@pytest.mark.parametrize(
    ("facts", "passed", "words"),
    [
        (WELL, "11 of 11 passed", "Start"),
        (SCALED, "10 of 11 passed", "Start with 1 warning"),
        (replace(SCALED, probe_s=0.4), "9 of 11 passed", "Start with 2 warnings"),
        (FULL_DISK, "10 of 11 passed", "Cannot start"),
    ],
)
@pytest.mark.parametrize("key", [Qt.Key.Key_Return, Qt.Key.Key_Enter])
def test_enter_begins_once_with_the_action_of_the_button(window, qtbot, key, facts, passed, words):
    starts = record_starts(window)
    window.show_view(checked(facts))
    assert (window.chip.word, window.start.text()) == (passed, words)
    look = {"Start": ("ok", "check"), "Cannot start": ("bad", "cross")}.get(words, ("warn", "warning"))
    assert (window.chip.tone, window.chip.icon, window.who.text()) == (*look, "rek2024  ·  Participant P007")
    qtbot.keyClick(window, key)
    qtbot.keyClick(window, key)
    assert starts == (["begun"] if window.start.isEnabled() else [])
    assert window.start.isEnabled() is (facts is not FULL_DISK)


def test_enter_on_measure_again_measures_and_the_next_enter_begins(window, qtbot):
    said = record_starts(window)
    window.again.setFocus()
    with qtbot.waitSignal(window.again_asked):
        qtbot.keyClick(window.again, Qt.Key.Key_Return)
    window.show_view(checked(FULL_DISK, busy=True))
    assert not window.again.hasFocus()
    assert (window.start.isEnabled(), window.again.isEnabled()) == (False, False)
    assert (window.chip.tone, window.chip.icon, window.chip.word) == ("neutral", "clock", "Measuring…")
    window.show_view(checked(WELL))
    assert (window.start.isEnabled(), window.again.isEnabled(), window.start.hasFocus()) == (True, True, True)
    qtbot.keyClick(window.focusWidget() or window, Qt.Key.Key_Return)
    assert said == ["begun"]


@pytest.mark.parametrize("how", ["escape", "cancel", "close", "finish"])
def test_going_back_leaves_no_trace_and_differs_from_finishing(window, qtbot, how):
    cancelled = []
    window.cancelled.connect(lambda: cancelled.append(how))
    if how == "escape":
        qtbot.keyClick(window, Qt.Key.Key_Escape)
    elif how == "cancel":
        qtbot.mouseClick(window.cancel, Qt.MouseButton.LeftButton)
    else:
        getattr(window, how)()
    assert cancelled == ([] if how == "finish" else [how])
    assert not window.isVisible()
    window.show()
    window.close()
    assert len(cancelled) == (how != "finish"), "it is said once"


def test_a_row_states_a_check_and_stays_until_a_check_changes(window):
    window.show_view(replace(checked(WELL), checks=CHECKS))
    rows = window.rows
    assert [row.accessibleName() for row in rows] == [
        "Rate, passed, 1 kHz; of the servo",
        "Screen, warning, 48 Hz; of this screen; Use another screen.",
        "Disk, cannot start, none; of its space; Free some space.",
    ]
    texts = [[part.text() for part in row.findChildren(QLabel)] for row in rows]
    assert [sorted(row) for row in texts] == [
        ["1 kHz", "Rate", "of the servo"],
        ["48 Hz", "Screen", "Use another screen.", "of this screen"],
        ["Disk", "Free some space.", "none", "of its space"],
    ]
    assert [[bar.share for bar in row.findChildren(Bar)] for row in rows] == [[0.25], [1.0], []]
    roles = [{part.text(): part.property("role") for part in row.findChildren(QLabel)} for row in rows]
    assert [row[check.value] for row, check in zip(roles, CHECKS, strict=True)] == ["text", "warn", "bad"]
    window.show_view(replace(checked(WELL), checks=CHECKS, who="Participant P008"))
    assert (window.rows, window.who.text()) == (rows, "rek2024  ·  Participant P008")
    window.show_view(replace(checked(WELL), checks=CHECKS[1:]))
    assert [row.check for row in window.rows] == list(CHECKS[1:])
    assert [*map(window.checks.column.indexOf, (*window.rows, *rows))] == [0, 1, -1, -1, -1]


def test_rows_are_aligned_with_and_without_advice_or_a_bar(window):
    wrapped = replace(CHECKS[0], name="Priority", about="of a screen that is described at length " * 20, share=None)
    window.show_view(replace(checked(WELL), checks=(*CHECKS, wrapped)))
    settle(window)
    spaces_below = []
    for row in window.rows:
        check = row.check
        places = {part.text(): QRect(part.mapTo(row, QPoint()), part.size()) for part in row.findChildren(QLabel)}
        name, value, about = places[check.name], places[check.value], places[check.about]
        assert (name.left(), row.width() - value.left() - value.width()) == (LEFT, 24), check.name
        assert (name.width(), about.left()) == (NAME, LEFT + NAME + 14), check.name
        if check.advice:
            assert places[check.advice].left() == LEFT, check.name
        for bar in row.findChildren(Bar):
            assert (bar.mapTo(row, QPoint()).x(), bar.width()) == (about.left(), BAR)
        spaces_below.append(row.height() - max(place.top() + place.height() for place in places.values()))
    assert spaces_below[1:] == [14, 14, 4]
    assert about.top() == 4


def test_a_row_about_the_session_is_hidden_while_it_is_not_known(window):
    for asked_error, is_hidden in ((True, False), (False, True), (True, False)):
        window.show_view(checked(WELL, asked_error=asked_error))
        labels = window.runs.findChildren(QLabel)
        (name,) = (label for label in labels if label.text() == "Expected force error")
        (value,) = (label for label in labels if label.text() == "measuring…")
        assert (name.isHidden(), value.isHidden()) == (is_hidden, is_hidden)
        assert [label.isHidden() for label in labels if label.text() in ("Ends about", "14:37")] == [False, False]


def test_the_plot_shows_the_measured_lateness_in_microseconds(window):
    window.show_view(checked(replace(WELL, lateness_ns=np.array([20_000] * 99 + [3_000_000]))))
    assert window.plot.p99_name.toPlainText() == "p99 50"  # 99.01 of 100 steps from 20 to 3000 µs
    assert window.plot.limit_name.toPlainText() == "limit 1\u2009000"
    centres, heights = window.plot.bars.opts["x"], window.plot.bars.opts["height"]
    assert [*np.round(10.0**centres)] == [pytest.approx(20, rel=0.2), pytest.approx(3000, rel=0.2)]
    assert heights - 0.3 == pytest.approx([np.log10(99), 0.0])
    window.show_view(checked(replace(WELL, lateness_ns=np.array([], int))))
    assert not window.plot.p99_name.isVisible()


def test_the_page_keys_scroll_the_checks(window, qtbot):
    window.resize(window.minimumSize())
    window.show_view(replace(checked(WELL), checks=CHECKS * 8))
    bar = window._area.verticalScrollBar()
    qtbot.waitUntil(lambda: bar.maximum() > 0)
    qtbot.keyClick(window, Qt.Key.Key_PageDown)
    assert bar.value() == min(bar.pageStep(), bar.maximum())
    qtbot.keyClick(window, Qt.Key.Key_PageUp)
    assert bar.value() == 0


def test_a_resumed_session_states_its_position_and_stored_answers(window):
    protocol = load("demo")
    schedule = build_schedule(protocol, "P007", 5)
    first, second = (trial.number for trial in schedule.trials[:2])
    answers = [{"item": "a", "first_s": 3.0}, {"item": "b", "first_s": 4.0}]
    happened = (
        {"event": "session_started"},
        {"event": "page_shown", "page": "welcome"},
        {"event": "page_left", "page": "welcome"},
        {"event": "trial_started", "trial": first, "attempt": 1, "phase": "main"},
        {"event": "trial_ended", "trial": first, "attempt": 1, "outcome": "complete"},
        {"event": "responses", "trial": first, "attempt": 1, "items": answers},
        {"event": "trial_started", "trial": second, "attempt": 1, "phase": "main"},
    )
    journal = [event_from({**line, "t_s": float(at)}) for at, line in enumerate(happened)]
    rows = resumed_rows(protocol, schedule, journal)
    assert rows == (("Continues at", "Liquid setting 2, attempt\u00a02"), ("Kept", "2 of 8 answers"))
    assert resumed_rows(protocol, schedule, journal[:-1])[0] == ("Continues at", "Liquid setting 2")
    assert resumed_rows(protocol, schedule, journal[:2]) == (
        ("Continues at", "A first look"),
        ("Kept", "0 of 8 answers"),
    )
    window.show_view(checked(WELL, goes_on=rows))
    assert {value.text() for value in window.values()} >= {"Liquid setting 2, attempt\u00a02", "2 of 8 answers"}
    assert checked(WELL).rows == (
        ("Parts", "2"), ("Settings", "10"), ("Answers", "62"), ("Expected time", "18 min"), ("Force limit", "8 N"),
        ("Expected force error", "measuring…"), ("Ends about", "14:37"),
    )  # fmt: skip
    errors = [dict(checked(WELL, error_n=error_n).rows)["Expected force error"] for error_n in (0.0099, 0.01, 0.256)]
    assert errors == ["< 0.01 N", "0.01 N", "0.26 N"]


def test_the_checks_of_devices_and_of_compiled_code() -> None:
    falcon, inverse, mouse = (
        Backend(name, "", state=state, can="")
        for name, state in (("Falcon", "connected"), ("Inverse3", NOT_AVAILABLE), ("SpaceMouse", NONE))
    )
    kept, folder = "the force model for this processor, in kept", Path("kept")
    checks = [*map(_device_check, ((falcon, inverse, mouse), (mouse,)))]
    checks += [_compiled_check(*compiled) for compiled in ((None, 0), (folder, 0), (folder, 7))]
    assert [(check.name, check.verdict, check.value, check.about, check.advice[:11]) for check in checks] == [
        ("Haptic devices", "ok", "Falcon", "not available now: Inverse3", ""),
        ("Haptic devices", "warning", "none connected", "all devices are available", "Connect a d"),
        ("Compiled code", "warning", "not stored", "no folder is writable", "The model i"),
        ("Compiled code", "ok", "stored", kept, ""),
        ("Compiled code", "ok", "7 functions compiled", kept, ""),
    ]
    results = computer_checks(FULL_DISK, load("demo"), [falcon], cache=folder, compiled=7)
    assert [(check.name, check.verdict) for check in results] == [
        ("Servo rate", "ok"), ("Servo lateness", "ok"), ("Priority", "ok"), ("Screen", "ok"),
        ("Results folder", "ok"), ("Free space", "failure"), ("Haptic devices", "ok"), ("Compiled code", "ok"),
    ]  # fmt: skip
    assert results[-1] == checks[-1]


def test_the_check_of_a_computer_can_be_repeated_when_it_is_over(qtbot) -> None:
    parent = QWidget()
    qtbot.addWidget(parent)
    window = ComputerWindow(parent, LIGHT)
    window.show_measuring()
    assert window.state.text().startswith("Measuring… On first use")
    assert (window.back.isEnabled(), window.bar.isHidden(), window.bar.maximum()) == (False, False, 0)
    window.show_compiled(0.6)
    assert (window.bar.value(), window.bar.maximum()) == (60, 100)
    assert [area.accessibleName() for area in window.findChildren(QScrollArea)] == ["Checks"]
    window.show_checks(CHECKS)
    assert [row.check for row in window.rows] == list(CHECKS)
    assert (window.state.text(), window.bar.isHidden()) == ("1 of 3 passed.", True)
    with qtbot.waitSignal(window.asked):
        window.back.click()
    with qtbot.assertNotEmitted(window.asked), qtbot.waitSignal(window.finished):
        window.go_on.click()


def test_a_haptic_device_is_asked_whether_its_motors_are_masked(qtbot) -> None:
    assert PreflightWindow(2000.0).masking is None
    window = PreflightWindow(2000.0, asks_masking=True)
    qtbot.addWidget(window)
    window.show()
    masking = window.masking
    assert masking is not None
    assert masking.answer() == Masking("no")
    assert not masking.noise_db.isVisible()
    for _ in range(2):
        qtbot.keyClick(masking.means, Qt.Key.Key_Down)
    assert masking.noise_db.isVisible()
    assert (masking.noise_db.minimum(), masking.noise_db.maximum(), masking.noise_db.value()) == (30, 85, 60)
    masking.noise_db.setValue(64)
    assert masking.answer() == Masking("noise", 64)
    qtbot.keyClick(masking.means, Qt.Key.Key_Up)
    assert masking.answer().entry == {"means": "headphones", "noise_db": None}
