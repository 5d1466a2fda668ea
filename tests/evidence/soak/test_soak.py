"""The soak: sound where the servo is, and the command that runs it."""

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.cli import main
from study_app.evidence.soak.soak import Audit, Soak, soak_servo
from study_app.haptics.model.layout import LIMITER_GLITCH, LIMITER_STOP, SAMPLE, records
from study_app.haptics.runtime.telemetry import Samples
from study_app.protocol.load import load_scenes

pytestmark = pytest.mark.slow

SHORT_H = 2 / 60


@pytest.fixture(scope="module")
def scenes():
    return load_scenes("rek2024")


@pytest.fixture(scope="module")
def found(scenes):
    """Return the report of two minutes in virtual time."""
    return soak_servo(scenes, SHORT_H, virtual=True)


def test_two_virtual_minutes_of_every_fault_find_nothing(found):
    assert found.findings == ()
    assert found.verdict == "passed: no faults found"
    assert found.ticks == found.planned == 120_000
    for name, times, readings, seen in found.faults:
        assert 0 < times <= readings == seen, name
    assert found.recoveries == sum(times for name, times, _, _ in found.faults if "lost" in name) + found.counts.stale
    assert found.counts.stale > 0
    assert found.rests.count == 4
    assert 1 < found.rests.pushed_s < 3.5, "the wake of water pushes for 1.7 s"
    assert found.drift.comparisons > 20
    assert 5 < found.drift.longest_s < 30
    assert 1 < found.device.most_n <= 8
    assert not found.device.last_n.any()
    assert found.dropped == 0
    assert len(found.memory) == 11


def test_the_same_seed_finds_the_same(scenes, found):
    again = soak_servo(scenes, SHORT_H, virtual=True).table()
    first = found.table()
    for table in (again, first):
        for name in ("took_s", "memory_bytes"):
            del table[name]
    assert again == first
    assert soak_servo(scenes, 0.001, virtual=True, seed=2).table() != soak_servo(scenes, 0.001, virtual=True).table()


@pytest.mark.parametrize(
    ("changes", "violated"),
    [
        ({"device_force_n": (0.0, 0.0, 1.4)}, set()),
        ({"device_force_n": (0.0, 0.0, 1.6)}, {"steps"}),
        ({"device_force_n": (6.0, 0.0, 6.0)}, {"excess", "steps"}),
        ({"device_force_n": (0.0, np.nan, 0.0)}, {"no_number"}),
        ({"device_force_n": (0.1, 0.0, 0.0), "limiters": LIMITER_STOP}, {"unstopped"}),
        ({"device_force_n": (0.1, 0.0, 0.0), "busy_ns": 50_000_000}, {"unstopped", "drift_ns"}),
        ({"position_m": (np.nan, 0.0, 0.0)}, {"accepted"}),
        ({"position_m": (np.nan, 0.0, 0.0), "limiters": LIMITER_GLITCH}, set()),
        ({"time_ns": 3_400_000}, {"drift_ns"}),
    ],
)
def test_a_sample_that_breaks_a_guarantee_is_counted(changes, violated):
    samples = records(SAMPLE, 6).view(Samples)
    samples.tick, samples.time_ns, samples.fresh = np.arange(6), 1_000_000 * np.arange(6), 1
    for field, value in changes.items():
        samples[field][3] = value
    audit = Audit(limit_n=8.0, slew_n=1.5, period_ns=1_000_000, reach_m=0.05)
    for part in np.split(samples, [2, 3]):
        audit.take(part)
    names = ("accepted", "excess", "no_number", "steps", "unstopped", "drift_ns", "missing")
    assert {name for name in names if audit.counts[name]} == violated
    assert audit.counts.first_tick == (3 if violated else -1)


def test_liquids_without_a_wake_are_soaked_too():
    found = soak_servo(load_scenes("physical_liquids"), 0.01, virtual=True)
    assert found.findings == ()
    assert found.drift.comparisons == 0


@pytest.mark.nightly
def test_two_real_seconds_tick_in_a_thread_of_their_own(scenes):
    found = soak_servo(scenes, 2 / 3600, virtual=False)
    assert found.findings == ()
    assert found.ticks >= found.planned
    assert {name: seen for name, _, _, seen in found.faults}["clock_jump"] is None
    assert found.device.injected.sum() > 0
    assert "in real time" in found.text()
    assert not any(thread.name == "servo" for thread in threading.enumerate())


def test_one_that_is_asked_to_end_says_what_it_has(scenes):
    ending, lines = threading.Event(), []

    def tell(line):
        lines.append(line)
        if "%" in line:
            ending.set()

    found = soak_servo(scenes, SHORT_H, virtual=True, ending=ending, progress=tell)
    assert lines[-1].startswith(" 10 %")
    assert 12_000 <= found.ticks < 20_000
    assert found.verdict.startswith("passed: no faults found in the 1")
    assert not found.device.last_n.any()


@pytest.mark.parametrize("seed", [1, 2])
def test_no_force_ticks_to_and_fro_where_a_hand_keeps_still(scenes, seed):
    """An passivity in debt once let the force flip between two counts of the encoder, for seconds."""
    rested = []
    with Soak({"light_oil": scenes["light_oil"]}, 0.012, virtual=True, seed=seed) as run:
        run.device.allow = lambda _faults, _gap: None
        reader = run.servo.telemetry.reader()
        while run.done < run.ticks:
            run.step()
            seen = reader.read()
            if run.stretch.part == "rest":
                rested.append(seen.device_force_n.copy())
    force_n = np.concatenate(rested)
    assert len(force_n) > 5000
    felt = np.linalg.norm(force_n[1:], axis=1) > 0.05
    assert felt.any()
    turned = np.sum(force_n[1:] * force_n[:-1], axis=1) < 0
    assert np.count_nonzero(turned & felt) < 5


@pytest.fixture
def run_soak(tmp_path, monkeypatch, capsys):
    """Return what runs the command in this process and in an empty folder; it returns exit code and what was said."""
    monkeypatch.chdir(tmp_path)

    def run(*words):
        monkeypatch.setattr("sys.argv", ["liquid-study", "soak", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, *capsys.readouterr()

    return run


def test_the_command_prints_and_writes_the_report(run_soak):
    code, said, complaint = run_soak("--hours", "0.002", "--virtual", "--to", "out")
    assert (code, complaint) == (0, "")
    assert "passed: no faults found" in said
    assert Path("out/soak.txt").read_text(encoding="utf-8").strip() in said
    table = json.loads(Path("out/soak.json").read_text(encoding="utf-8"))
    assert table["ticks"] == 7200
    assert table["findings"] == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_command_with_the_report_so_far(run_soak, monkeypatch, number):
    def interrupted(*given, progress, **named):
        def tell(line):
            progress(line)
            if line.startswith(" 10 %"):
                signal.raise_signal(number)

        return soak_servo(*given, progress=tell, **named)

    monkeypatch.setattr("study_app.evidence.soak.soak_servo", interrupted)
    before = signal.getsignal(number)
    code, said, _ = run_soak("--hours", str(SHORT_H), "--virtual")
    assert code == 128 + number
    assert "passed: no faults found in the 1" in said
    assert signal.getsignal(number) == before


@pytest.mark.nightly
@pytest.mark.timeout(900)  # a new process, perhaps with everything to compile, on a busy machine
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_ends_with_the_report_so_far(tmp_path):
    words = [sys.executable, "-m", "study_app", "soak", "--hours", "100"]
    with subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        try:
            assert "Ctrl+C" in running.stdout.readline()
            running.send_signal(signal.SIGINT)
            said, complaint = running.communicate()
        finally:
            running.kill()
    assert complaint == ""
    assert running.returncode == 130
    assert "passed: no faults found in the 0.0 % that was run" in said
