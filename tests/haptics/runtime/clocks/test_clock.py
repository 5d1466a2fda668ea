import ast
import ctypes
import inspect
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

from study_app.haptics.kernels.c_functions import NOW, SLEEP, c_function
from study_app.haptics.model.layout import records
from study_app.haptics.runtime.clocks import clock, macos
from study_app.haptics.runtime.clocks import linux as clock_linux
from study_app.haptics.runtime.clocks import windows as clock_windows
from study_app.haptics.runtime.clocks.clock import SystemClock, raise_priority
from study_app.haptics.runtime.grants import Grant

if sys.platform != "win32":
    import resource

MS = 1_000_000


def sleep(clock, deadline_ns):
    return clock.sleep.ctypes(clock.context, deadline_ns)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere Python's clock may be another one")
def test_the_system_clock_is_pythons_monotonic_clock():
    before = time.perf_counter_ns()
    now = SystemClock().now_ns()
    assert before <= now <= time.perf_counter_ns()


def test_a_sleep_ends_at_its_deadline_or_later_and_returns_the_time():
    clock = SystemClock()
    deadline = clock.now_ns() + 3 * MS
    woken = sleep(clock, deadline)
    assert deadline <= woken <= clock.now_ns()


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


# priority, asked for in threads that end with the test


def in_a_thread(function):
    answers = []
    thread = threading.Thread(target=lambda: answers.append(function()))
    thread.start()
    thread.join()
    return answers[0]


def refuse(*_):
    raise PermissionError


def nothing(*_):
    pass


@pytest.fixture
def linux(monkeypatch):
    """Return a function that imitates a Linux which grants only ``granted``."""
    if sys.platform != "linux":
        pytest.skip("the scheduler of Linux")

    def grant(*granted, rtprio=0):
        monkeypatch.setattr(os, "sched_setscheduler", nothing if "fifo" in granted else refuse)
        monkeypatch.setattr(clock_linux, "make_real_time", (lambda _thread: 20) if "service" in granted else refuse)
        monkeypatch.setattr(os, "setpriority", nothing if "nice" in granted else refuse)
        monkeypatch.setattr(resource, "getrlimit", lambda _kind: (rtprio, rtprio))
        return in_a_thread(raise_priority)

    return grant


def test_linux_asks_for_less_where_more_is_refused(linux):
    assert str(linux("fifo", "service", "nice")) == "real-time (SCHED_FIFO 60)"
    assert str(linux("service", "nice")) == "real-time (SCHED_RR 20, granted by the desktop's real-time service)"
    raised, normal = linux("nice"), linux()
    assert raised.priority == "raised (nice -15)"
    assert normal.priority == "normal (the system does not grant a higher priority)"
    for grant in (raised, normal):
        (advice,) = grant.advice
        assert "/etc/security/limits.d/" in advice
        assert "rtkit" in advice


def test_linux_takes_the_priority_that_a_limit_allows(linux, monkeypatch):
    priorities = []
    monkeypatch.setattr(clock_linux, "_PRIORITY", 60)

    def grant_20(_thread, _policy, parameters):
        priorities.append(parameters.sched_priority)
        if parameters.sched_priority > 20:
            raise PermissionError

    linux("nice", rtprio=20)
    monkeypatch.setattr(os, "sched_setscheduler", grant_20)
    assert str(in_a_thread(raise_priority)) == "real-time (SCHED_FIFO 20)"
    assert priorities == [60, 20]


def test_unlocked_memory_is_reported_with_its_remedy():
    well = Grant("real-time", "SCHED_FIFO 60")
    assert str(well.with_memory(locked=True, advice="cure")) == "real-time (SCHED_FIFO 60), memory locked"
    assert str(well.with_memory(locked=False, advice="cure")) == "real-time (SCHED_FIFO 60), memory not locked; cure"


@pytest.mark.skipif(sys.platform != "linux", reason="a limit of Linux")
def test_with_a_limit_only_the_servos_own_memory_is_locked(monkeypatch):
    """If a whole process is locked under a limit, its later allocations fail."""
    calls = []

    class Library:
        def mlockall(self, flags):
            calls.append(("all", flags))
            return 0

        def mlock(self, address, size):
            calls.append((address.value, size.value))
            return 0

    monkeypatch.setattr(clock_linux.ctypes, "CDLL", lambda _name: Library())
    monkeypatch.setattr(resource, "setrlimit", refuse)
    monkeypatch.setattr(resource, "getrlimit", lambda _kind: (8 << 20, 8 << 20))
    assert clock_linux.lock_memory([(4096, 100), (8192, 50)])
    assert calls == [(4096, 100), (8192, 50)]
    calls.clear()
    monkeypatch.setattr(resource, "getrlimit", lambda _kind: (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    assert clock_linux.lock_memory([(4096, 100)])
    assert calls == [("all", 7)]


class FakeLibrary:
    """A library of Windows whose functions return given values."""

    def __init__(self, **answers):
        for name, answer in answers.items():
            setattr(self, name, lambda *_arguments, answer=answer: answer)


def test_windows_takes_the_multimedia_scheduler_before_a_critical_thread():
    kernel = {"GetCurrentThread": 1, "SetThreadPriority": 1}
    avrt = FakeLibrary(AvSetMmThreadCharacteristicsW=5, AvSetMmThreadPriority=1)
    none = FakeLibrary(AvSetMmThreadCharacteristicsW=0, AvSetMmThreadPriority=0)
    assert str(clock_windows.request_priority(avrt, FakeLibrary(**kernel))) == "real-time (MMCSS Pro Audio)"
    raised = clock_windows.request_priority(none, FakeLibrary(**kernel))
    assert raised.priority == "raised (time critical)"
    assert "Multimedia Class Scheduler" in raised.advice[0]
    refused = clock_windows.request_priority(none, FakeLibrary(**(kernel | {"SetThreadPriority": 0})))
    assert refused.level == "normal"


# looking at the clock before a deadline


def test_a_spin_takes_over_before_the_deadline_and_is_counted():
    clock = SystemClock(spin_us=500)
    deadlines = [clock.now_ns() + 2 * MS]
    for _ in range(50):
        woken = sleep(clock, deadlines[-1])
        assert woken >= deadlines[-1]
        deadlines.append(woken + 2 * MS)
    assert clock.spun_ns > 0
    trusting = SystemClock(spin_us=0)
    sleep(trusting, trusting.now_ns() + MS)
    assert trusting.spun_ns == 0


# the other systems' logic, against C functions that stand in for theirs

COUNTER_HZ = 10_000_000


class FakeWindows:
    """A performance counter: each wait advances it by the timer's setting, and each reading by 1 µs."""

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
        self.memory = records(clock_windows.COUNTER, 1)
        self.memory[0].frequency_hz = COUNTER_HZ
        self.memory[0].timer = 7
        self.memory[0].spin_ns = 500_000

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
    """Return one fake for all tests, since compiled code keeps the addresses of its functions."""
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
    memory = records(macos.TIMEBASE, 1)
    memory[0].numerator, memory[0].denominator = 125, 3
    now, sleep_until = c_function(NOW, macos.now), c_function(SLEEP, macos.sleep)
    context = memory.ctypes.data
    assert now.ctypes(context) == 1_000_000 * MS
    deadline = 1_000_000 * MS + 1_000_001
    woken = sleep_until.ctypes(context, deadline)
    assert deadline <= woken < deadline + 42
    assert len(state["waits"]) == 2


def test_a_machine_that_runs_is_not_suspended_meanwhile() -> None:
    clock = SystemClock()
    before_ns, began_ns = clock.suspended_ns(), clock.now_ns()
    wait_ns = 20_000_000
    while clock.now_ns() - began_ns < wait_ns:
        pass
    assert before_ns >= 0
    assert abs(clock.suspended_ns() - before_ns) < wait_ns / 2


@pytest.mark.parametrize("module", [clock_linux, clock_windows, macos], ids=["linux", "windows", "macos"])
def test_each_system_has_the_parts_of_a_clock(module):
    """Only one of them is loaded on this system, so sessions here would not reveal a missing part."""
    tree = ast.parse(inspect.getsource(clock))
    used = {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "platform"
    }
    assert used >= {"SPIN_US", "open_clock", "now", "sleep", "raise_priority", "lock_memory"}
    assert [name for name in sorted(used) if not hasattr(module, name)] == []
