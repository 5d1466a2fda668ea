"""The check of this computer, from the button to the rows."""

import threading
from typing import Any

import pytest

from study_app.app.main_controller import MainController
from study_app.app.session.preflight_controller import ComputerCheck
from study_app.gui.preflight.window import COMPUTER_CHECK_NAMES
from tests.compiled import needs_servo

pytestmark = [pytest.mark.slow, needs_servo]


@pytest.mark.nightly
def test_the_machines_place_opens_it_and_it_measures_this_computer(visit: MainController, qtbot: Any) -> None:
    visit.window.go("machine")
    assert visit.machine.place is not None
    visit.machine.place.check.click()
    check = visit.check
    assert check is not None
    assert check.window.isVisible()
    assert not check.window.back.isEnabled()
    qtbot.waitUntil(lambda: bool(check.window.rows), timeout=120_000)
    names = [row.check.name for row in check.window.rows]
    assert names == [*COMPUTER_CHECK_NAMES, "Haptic devices", "Compiled code"]
    assert check.window.state.text().endswith("of 8 passed.")
    check.window.back.click()
    assert not check.window.back.isEnabled()
    check.window.go_on.click()  # while it measures
    assert not check.window.isVisible()
    with qtbot.waitSignal(check.destroyed, timeout=120_000):
        pass


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
@pytest.mark.parametrize("closed", [False, True])
def test_a_bug_while_it_measures_is_a_sentence_and_leaves_no_window(
    visit: MainController, qtbot: Any, monkeypatch: pytest.MonkeyPatch, closed: bool
) -> None:
    may_fail = threading.Event()

    def fail(_self: ComputerCheck) -> None:
        may_fail.wait(10)
        raise RuntimeError("a module is missing")

    monkeypatch.setattr(ComputerCheck, "_run_checks", fail)
    visit.check_computer()
    check, shown_on = visit.check, visit.window.screen()
    assert check is not None
    assert (check._screen.refresh_hz, check._screen.scaling) == (shown_on.refreshRate(), shown_on.devicePixelRatio())
    if closed:
        check.window.go_on.click()
    else:
        may_fail.set()
        qtbot.waitUntil(check.window.back.isEnabled)
        assert "a module is missing" in check.window.state.text()
    with qtbot.waitSignal(check.destroyed):
        may_fail.set()
        if not closed:
            check.window.go_on.click()
