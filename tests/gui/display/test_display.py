"""Whether a window can be opened, said in one line; frames that come once a refresh."""

import gc
import sys

import numpy as np
import pytest
from PySide6.QtCore import QTimer

from study_app import app
from study_app.errors import DisplayError
from study_app.gui.display.screens import LEAD_NS, STALE_REFRESHES, Frames
from study_app.gui.display_check import check_display, missing_library
from tests.platforms import needs_posix, needs_window_system

MS = 1_000_000


class Screen:
    """A manual clock whose timers fire when their time has come."""

    def __init__(self, refresh_hz):
        self.now_ns = 10**9
        self.frames = Frames(refresh_hz, now_ns=lambda: self.now_ns)
        self.timer = self.frames.findChild(QTimer)
        self.drawn_ns = []
        self.takes_ns = 0
        self.frames.due.connect(self.draw)

    def draw(self):
        self.drawn_ns.append(self.now_ns)
        self.now_ns += self.takes_ns

    def run(self, seconds, early_ns=0, late_ns=0):
        """Advance the clock; the timer fires early or late by these times."""
        end_ns = self.now_ns + round(seconds * 1e9)
        while self.frames.next_ns < end_ns:
            self.now_ns = max(self.now_ns, self.frames.next_ns - early_ns + late_ns)
            self.timer.stop()
            self.timer.timeout.emit()
        self.now_ns = max(self.now_ns, end_ns)


@pytest.fixture(params=[59.94, 144.0])
def screen(request, qapp):
    refreshing = Screen(request.param)
    refreshing.frames.start()
    refreshing.timer.stop()  # before a late computer lets it go off by itself
    return refreshing


@pytest.mark.parametrize(("early_ns", "late_ns"), [(0, 0), (MS // 2, 0), (0, 3 * MS)])
def test_every_refresh_gets_a_frame_without_drift(screen, early_ns, late_ns):
    began_ns = screen.now_ns
    screen.run(10.0, early_ns, late_ns)
    period_ns = screen.frames.period_ns
    places = (np.array(screen.drawn_ns) - began_ns) / period_ns
    assert np.array_equal(np.rint(places - late_ns / period_ns), np.arange(1, len(places) + 1))


def test_the_timer_of_the_next_frame_runs_before_a_frame_is_drawn(qapp):
    refreshing, waits_ms = Screen(10.0), []
    refreshing.frames.start()
    assert (refreshing.timer.isActive(), refreshing.timer.interval(), refreshing.timer.isSingleShot()) == (
        True,
        100,
        True,
    )
    refreshing.frames.due.connect(lambda: waits_ms.append(refreshing.timer.interval()))
    for at_ms in (100, 230, 305):  # on time, late, and late again
        refreshing.now_ns = 10**9 + at_ms * MS
        refreshing.timer.timeout.emit()
    assert waits_ms == [100, 70, 95]
    refreshing.now_ns = 10**9 + 340 * MS
    refreshing.frames.note_swap()  # the next one comes at 440 ms; its frame is drawn 5 ms before it
    assert (refreshing.timer.isActive(), refreshing.timer.interval()) == (True, 95)
    refreshing.frames.stop()
    refreshing.frames.note_swap()
    assert not refreshing.timer.isActive()


def test_a_slow_frame_costs_only_its_own_refreshes(screen):
    screen.run(1.0)
    before = len(screen.drawn_ns)
    screen.takes_ns = round(2.4 * screen.frames.period_ns)
    screen.run(screen.frames.period_ns * 1e-9)
    screen.takes_ns = 0
    screen.run(1.0)
    gaps = np.diff(screen.drawn_ns[before:]) / screen.frames.period_ns
    assert gaps[0] == pytest.approx(2.4, abs=0.01)
    assert np.rint(gaps[1:].sum() + gaps[0]) == pytest.approx(gaps.sum(), abs=0.01)
    assert np.allclose(gaps[2:], 1.0, atol=1e-3)


def test_frames_follow_the_swaps_of_a_surface(screen):
    screen.run(1.0)
    assert not screen.frames.is_locked
    period_ns = screen.frames.period_ns
    swap_ns = screen.now_ns + period_ns // 3
    for _ in range(30):
        screen.run((swap_ns - screen.now_ns) * 1e-9)
        screen.now_ns = swap_ns
        screen.frames.note_swap()
        swap_ns += period_ns
    assert (screen.frames.is_locked, screen.frames.pacing) == (True, "synchronized with the screen's refresh")
    lead_ns = min(LEAD_NS, period_ns // 2)
    ahead_ns = [(swap_ns - drawn_ns) % period_ns for drawn_ns in screen.drawn_ns[-20:]]
    assert ahead_ns == pytest.approx([lead_ns] * 20, abs=2)
    assert np.diff(screen.drawn_ns[-20:]) == pytest.approx(period_ns, abs=2)


def test_without_swaps_the_clock_goes_on(screen):
    screen.frames.note_swap()
    assert screen.frames.is_locked
    screen.run(2 * STALE_REFRESHES * screen.frames.period_ns * 1e-9)
    assert (screen.frames.is_locked, screen.frames.pacing) == (False, "timed by the computer's clock")
    assert len(screen.drawn_ns) >= 2 * STALE_REFRESHES - 1


@pytest.mark.parametrize(
    "environment",
    [
        {},
        pytest.param({"DISPLAY": ":7654"}, marks=[needs_window_system, needs_posix]),
        {"QT_QPA_PLATFORM": "xcb", "WAYLAND_DISPLAY": "wayland-0"},
    ],
    ids=["none", "not served", "xcb by name"],
)
def test_a_missing_display_is_reported_with_commands_that_work_without_one(environment):
    with pytest.raises(DisplayError, match="DISPLAY") as refused:
        check_display(environment, "linux")
    assert "\n" not in str(refused.value)
    assert environment or ("ssh -X" in str(refused.value) and "rehearse" in str(refused.value))


def test_platforms_without_an_x_server_are_left_to_qt():
    for name, value in (
        ("QT_QPA_PLATFORM", "offscreen"),
        ("QT_QPA_PLATFORM", "vnc:size=800x600"),
        ("WAYLAND_DISPLAY", "wayland-0"),
    ):
        check_display({name: value}, "linux")
    for platform in ("win32", "darwin"):
        check_display({}, platform)


@needs_posix
def test_a_missing_library_is_named_with_the_packages_that_bring_it():
    error = ImportError("libEGL.so.1: cannot open shared object file: No such file or directory")
    said = str(missing_library(error))
    assert "libEGL.so.1" in said
    assert "apt install" in said
    assert "\n" not in said


def test_garbage_is_collected_again_after_an_import_that_failed(monkeypatch):
    monkeypatch.setitem(sys.modules, "study_app.app.main_controller", None)
    monkeypatch.setattr(gc, "isenabled", lambda: True)
    enabled = []
    monkeypatch.setattr(gc, "enable", lambda: enabled.append(True))
    with pytest.raises(DisplayError, match="Qt cannot be loaded"):
        app.run_home_window  # noqa: B018 - it is imported where it is asked for
    assert enabled
