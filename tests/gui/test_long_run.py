"""Half an hour of servo in virtual time with every fault, while both windows of a session paint."""

import threading

import pytest
from PySide6.QtWidgets import QApplication

from study_app.app.delay_session import WindowsThread
from study_app.evidence.soak.soak import soak_servo
from study_app.evidence.timing.measurement import LEAD_IN, PERIOD_NS
from study_app.protocol.load import load_scenes
from tests.compiled import needs_servo

FLAT_BYTES = 5 * 2**20
HALF_AN_HOUR = 0.5

pytestmark = [pytest.mark.slow, needs_servo]


@pytest.mark.nightly
@pytest.mark.usefixtures("qapp")
def test_half_an_hour_under_load_drops_nothing_drifts_by_nothing_and_takes_no_memory() -> None:
    windows = WindowsThread("gui")
    result = windows.during(lambda: soak_servo(load_scenes("rek2024"), HALF_AN_HOUR, virtual=True))
    assert result.findings == ()
    assert result.ticks == result.planned == 1_800_000
    assert result.dropped == 0
    assert result.counts.missing == 0
    assert result.counts.drift_ns == 0
    assert result.growth_bytes <= FLAT_BYTES  # what other tests left may go meanwhile
    assert windows.frames > 20


@pytest.mark.usefixtures("qapp")
def test_windows_are_open_while_work_is_done_and_gone_after_it() -> None:
    windows = WindowsThread("gui")
    frame_counts: list[int] = []

    def work() -> str:
        wait = threading.Event()
        while windows.frames < 3:
            wait.wait(0.005)
        frame_counts.append(windows.frames)
        return "done"

    assert windows.during(work) == "done"
    assert frame_counts[0] >= 3
    assert not [widget for widget in QApplication.topLevelWidgets() if widget.isVisible()]


@pytest.mark.usefixtures("qapp")
def test_a_timer_of_qt_fires_as_often_as_asked_in_the_windows_thread() -> None:
    windows = WindowsThread("none")
    fired: list[threading.Thread] = []
    start_ns = windows.during(lambda: windows.timer(1, LEAD_IN, lambda: fired.append(threading.current_thread())))
    assert len(fired) == LEAD_IN
    assert set(fired) == {threading.main_thread()}
    assert start_ns > PERIOD_NS
    assert windows.frames == 0


@pytest.mark.usefixtures("qapp")
def test_a_failed_tick_in_the_timer_raises_in_the_caller() -> None:
    windows = WindowsThread("none")

    def fail() -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        windows.during(lambda: windows.timer(1, 5, fail))
