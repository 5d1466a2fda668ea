import ctypes
import os
import signal
import sys
import threading
import time

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("clocks are C functions", allow_module_level=True)

from llvmlite import binding

from study_app.haptics import clock_macos, clock_windows
from study_app.haptics.cfunctions import NOW, SLEEP, c_function
from study_app.haptics.clock import SystemClock, VirtualClock, raise_priority
from study_app.haptics.layout import records

MS = 1_000_000


def sleep(clock, deadline_ns):
    return clock.sleep.ctypes(clock.context, deadline_ns)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Python's clock may be another one")
def test_the_system_clock_is_pythons_monotonic_clock():
    before = time.monotonic_ns()
    now = SystemClock().now_ns()
    assert before <= now <= time.monotonic_ns()


def test_a_sleep_ends_at_its_deadline_or_later_and_says_when():
    clock = SystemClock()
    deadline = clock.now_ns() + 3 * MS
    woken = sleep(clock, deadline)
    assert deadline <= woken <= clock.now_ns()


def test_a_deadline_in_the_past_is_not_waited_for():
    clock = SystemClock()
    before = clock.now_ns()
    assert before <= sleep(clock, before - 3_600_000 * MS) <= clock.now_ns()


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="signals of POSIX")
def test_a_signal_does_not_shorten_a_sleep():
    clock, rung = SystemClock(), []
    before = signal.signal(signal.SIGALRM, lambda *_: rung.append(clock.now_ns()))
    try:
        deadline = clock.now_ns() + 20 * MS
        signal.setitimer(signal.ITIMER_REAL, 0.004)
        assert sleep(clock, deadline) >= deadline
        assert rung
    finally:
        signal.signal(signal.SIGALRM, before)


def test_virtual_time_passes_in_sleeps_alone():
    clock = VirtualClock(start_ns=5)
    assert clock.now_ns() == clock.now_ns() == 5
    assert sleep(clock, 70 * MS) == 70 * MS == clock.now_ns()


def test_virtual_time_never_goes_back():
    clock = VirtualClock(start_ns=9 * MS)
    assert sleep(clock, 2 * MS) == 9 * MS == clock.now_ns()


# priority, asked for in threads that end with the test


def in_a_thread(function):
    answers = []
    thread = threading.Thread(target=lambda: answers.append(function()))
    thread.start()
    thread.join()
    return answers[0]


def test_what_the_system_grants_is_said_in_words():
    assert in_a_thread(raise_priority).split()[0] in {"real-time", "raised", "normal"}


@pytest.mark.skipif(sys.platform != "linux", reason="the scheduler of Linux")
def test_linux_asks_for_less_where_more_is_refused(monkeypatch):
    def refuse(*_):
        raise PermissionError

    asked = []
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(os, "setpriority", lambda *arguments: asked.append(arguments))
    assert in_a_thread(raise_priority) == "raised (nice -15)"
    assert len(asked) == 1
    monkeypatch.setattr(os, "setpriority", refuse)
    assert in_a_thread(raise_priority) == "normal (the system grants no more)"


# the other systems' logic, against C functions that stand in for theirs

COUNTER_HZ = 10_000_000


class FakeWindows:
    """A performance counter that a wait moves on by what the timer was set to, and every look by 1 us."""

    def __init__(self, ticks):
        self.ticks = ticks
        self.due = []
        void, integer = ctypes.c_void_p, ctypes.c_int32
        counter = ctypes.CFUNCTYPE(integer, ctypes.POINTER(ctypes.c_int64))(self.query)
        timer = ctypes.CFUNCTYPE(integer, void, ctypes.POINTER(ctypes.c_int64), integer, void, void, integer)(self.set)
        wait = ctypes.CFUNCTYPE(integer, void, integer)(self.wait)
        self.functions = {"QueryPerformanceCounter": counter, "SetWaitableTimer": timer, "WaitForSingleObject": wait}
        for name, function in self.functions.items():
            binding.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)
        self.memory = records(clock_windows._COUNTER, 1)
        self.memory[0].frequency_hz = COUNTER_HZ
        self.memory[0].timer = 7

    def query(self, out):
        self.ticks += 10
        out[0] = self.ticks
        return 1

    def set(self, timer, due, _period, _routine, _argument, _resume):
        assert timer == 7
        self.due.append(due[0])
        return 1

    def wait(self, timer, limit_ms):
        assert (timer, limit_ms) == (7, -1)
        self.ticks += -self.due[-1]  # 100 ns, as the counter's
        return 0


@pytest.fixture(scope="module")
def windows():
    """One fake for all tests: compiled code keeps the address of what it calls."""
    fake = FakeWindows(ticks=0)
    return fake, c_function(NOW, clock_windows.now), c_function(SLEEP, clock_windows.sleep)


pretended = pytest.mark.skipif(sys.platform in {"win32", "darwin"}, reason="stands in for this system's own functions")


@pretended
def test_windows_time_is_exact_after_years_of_uptime(windows):
    fake, now, _sleep = windows
    fake.ticks = 10 * 365 * 86_400 * COUNTER_HZ + 3
    assert now.ctypes(fake.memory.ctypes.data) == (fake.ticks) * 100


@pretended
def test_windows_waits_on_the_timer_and_looks_at_the_counter_at_the_end(windows):
    fake, now, sleep_until = windows
    fake.ticks = 123_456_789
    context = fake.memory.ctypes.data
    deadline = now.ctypes(context) + 4 * MS
    woken = sleep_until.ctypes(context, deadline)
    assert deadline <= woken <= deadline + 2_000
    assert fake.due[-1] == pytest.approx(-35_000, abs=20)  # half a millisecond less, in 100 ns
    timers = len(fake.due)
    assert sleep_until.ctypes(context, woken - MS) >= woken
    assert sleep_until.ctypes(context, woken + MS // 4) >= woken + MS // 4
    assert len(fake.due) == timers


@pretended
def test_macos_time_and_sleep_go_by_the_timebase_of_apple_silicon():
    state = {"ticks": 24_000_000_000, "waits": []}

    def absolute():
        return state["ticks"]

    def wait_until(deadline):
        state["waits"].append(deadline)
        state["ticks"] = deadline if len(state["waits"]) > 1 else deadline - 5  # woken early, once
        return 0

    functions = (
        ctypes.CFUNCTYPE(ctypes.c_int64)(absolute),
        ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_int64)(wait_until),
    )
    for name, function in zip(("mach_absolute_time", "mach_wait_until"), functions, strict=True):
        binding.add_symbol(name, ctypes.cast(function, ctypes.c_void_p).value)
    memory = records(clock_macos._TIMEBASE, 1)
    memory[0].numerator, memory[0].denominator = 125, 3
    now, sleep_until = c_function(NOW, clock_macos.now), c_function(SLEEP, clock_macos.sleep)
    context = memory.ctypes.data
    assert now.ctypes(context) == 1_000_000 * MS
    deadline = 1_000_000 * MS + 1_000_001
    woken = sleep_until.ctypes(context, deadline)
    assert deadline <= woken < deadline + 42
    assert len(state["waits"]) == 2
