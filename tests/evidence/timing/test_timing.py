"""How loops are timed: by the same rule, in ticks. No time is judged here."""

import subprocess
import sys
import threading

import numba
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)


from study_app.cli import main
from study_app.devices.simulated import PlayedHand
from study_app.evidence.computer import busy_cores
from study_app.evidence.cost import hand_motion
from study_app.evidence.timing.measurement import FULL, LEAD_IN, PERIOD_NS, granted_classes, measure_timing, ticks_at
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.pack import elements_needed
from study_app.haptics.runtime.servo import Servo


def after(*milliseconds):
    """Return ticks of 10 µs that begin so long after the start [(n, 2) ns], after those of the lead-in."""
    lead = [(k + 1) * PERIOD_NS for k in range(LEAD_IN)]
    begun = [*lead, *(LEAD_IN * PERIOD_NS + round(ms * 1e6) for ms in milliseconds)]
    return [(begun_ns, begun_ns + 10_000) for begun_ns in begun]


def test_a_tick_that_comes_late_is_late_by_all_of_it_and_passes_deadlines_over():
    late = ticks_at(0, after(1, 5.4, 6))
    assert late.lateness_ns.tolist() == [0, 3_400_000, 1_000_000]
    assert late.overruns == 2
    assert late.busy_ns.tolist() == [10_000] * 3


def test_no_python_is_called_in_a_tick():
    """Ten times as many ticks make no additional call of a Python or C function of the interpreter."""
    servo = Servo(PlayedHand(hand_motion()), clock=VirtualClock(), elements=elements_needed(FULL))
    servo.load(FULL)
    servo.advance(1)

    def calls(ticks):
        heard = []
        sys.setprofile(lambda _frame, event, _argument: heard.append(event))
        try:
            servo.advance(ticks)
        finally:
            sys.setprofile(None)
        return len(heard)

    assert calls(5000) == calls(500)


class FakeWindows:
    """The windows' thread without Qt: ``timer`` calls at once."""

    frames = 0

    def timer(self, _period_ms, count, fire):
        for _ in range(count):
            fire()
        return 0

    def during(self, work):
        return work()


@pytest.mark.nightly
@pytest.mark.slow
def test_a_race_times_every_loop_in_every_class_it_is_granted():
    lines = []
    raced = measure_timing(0.5, "none", FakeWindows(), progress=lines.append)
    levels = ["normal"] if granted_classes().best is None else ["normal", granted_classes().best.level]
    assert list(raced.levels) == levels
    assert [loop.kind for loop in raced.loops][:4] == ["servo", "bare", "thread", "qt"]
    assert {loop.ticks for loop in raced.loops} == {500}
    assert all((loop.lateness_ns >= 0).all() for loop in raced.loops)
    assert len(raced.limits()) == 4 * len(levels)
    assert lines[-1] == "100 %"
    assert raced.frames_hz is None
    assert not any(thread.name in {"servo", "timed"} for thread in threading.enumerate())


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Return a function that runs the command in this process, and returns exit code and output."""
    monkeypatch.chdir(tmp_path)

    def command(*words):
        monkeypatch.setattr("sys.argv", ["liquid-study", "timing", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, *capsys.readouterr()

    return command


def test_without_a_display_windows_are_refused_in_one_line(run, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("study_app.gui.application.QApplication.instance", lambda: None)
    if sys.platform != "linux":
        pytest.skip("a display can be missing")
    code, said, complaint = run("--seconds", "0.5", "--load", "gui")
    assert (code, said) == (2, "")
    assert "no display" in complaint


def test_processes_that_keep_cores_busy_end_with_this_one_where_a_parents_id_never_changes(monkeypatch):
    """On Windows; a program that is killed closes its pipes, as this test does."""
    start, started = subprocess.Popen, []

    def start_on_windows(command, **options):
        unchanging = f"import os\nos.getppid = lambda: 1\n{command[-1]}"
        started.append(start([*command[:-1], unchanging], **options))
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", start_on_windows)
    with busy_cores(1):
        (busy,) = started
        busy.stdin.close()
        assert busy.wait(60) == 0
