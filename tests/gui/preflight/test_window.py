"""The window before a session: every check with its value, warnings accepted by name, failures refused."""

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt

from study_app.devices.descriptor import NONE, NOT_AVAILABLE, Backend
from study_app.gui.preflight.window import PreflightWindow, _compiled_check, _device_check, resumed_rows
from study_app.protocol.load import load
from study_app.protocol.orders.schedule import build_schedule
from study_app.session.preflight import Masking
from tests.gui.windows import SCALED, WELL, checked, preflight
from tests.journal_lines import event_from

pytestmark = pytest.mark.slow

FULL_DISK = replace(WELL, free_bytes=1)


@pytest.fixture
def window(qtbot):
    return preflight(qtbot)


def begun(window):
    said = []
    window.start_asked.connect(lambda: said.append("begun"))
    return said


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
def test_enter_begins_once_and_accepts_what_the_button_names(window, qtbot, key, facts, passed, words):
    said = begun(window)
    window.show_view(checked(facts))
    assert (window.chip.word, window.start.text()) == (passed, words)
    look = {"Start": ("ok", "check"), "Cannot start": ("bad", "cross")}.get(words, ("warn", "warning"))
    assert (window.chip.tone, window.chip.icon, window.who.text()) == (*look, "rek2024  ·  Participant P007")
    qtbot.keyClick(window, key)
    qtbot.keyClick(window, key)
    assert said == (["begun"] if window.start.isEnabled() else [])
    assert window.start.isEnabled() is (facts is not FULL_DISK)


def test_enter_on_another_button_measures_anew_and_after_it_enter_begins(window, qtbot):
    said = begun(window)
    window.again.setFocus()
    with qtbot.waitSignal(window.again_asked):
        qtbot.keyClick(window.again, Qt.Key.Key_Return)
    window.show_view(checked(WELL, busy=True))
    assert not window.again.hasFocus()
    assert not window.start.isEnabled()
    window.show_view(checked(WELL))
    qtbot.keyClick(window.focusWidget() or window, Qt.Key.Key_Return)
    assert said == ["begun"]


@pytest.mark.parametrize("how", ["escape", "cancel", "close", "finish"])
def test_one_goes_back_without_a_trace_and_finishing_is_not_going_back(window, qtbot, how):
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


def test_a_session_that_goes_on_says_where_and_what_is_kept(window):
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
    window.show_view(checked(WELL, goes_on=rows))
    assert {value.text() for value in window.values()} >= {"Liquid setting 2, attempt\u00a02", "2 of 8 answers"}
    assert checked(WELL).rows == (
        ("Parts", "2"), ("Settings", "10"), ("Answers", "62"), ("Expected time", "18 min"), ("Force limit", "8 N"),
        ("Expected force error", "measuring …"), ("Ends about", "14:37"),
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
    assert [(check.verdict, check.value, check.about) for check in checks] == [
        ("ok", "Falcon", "not available now: Inverse3"),
        ("warning", "none connected", "all devices are available"),
        ("warning", "not stored", "no folder is writable"),
        ("ok", "stored", kept),
        ("ok", "7 functions compiled", kept),
    ]


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
