"""The soak test: it passes with a sound servo; and its command."""

import json
import signal
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.cli import main
from study_app.devices.faulty import KINDS
from study_app.evidence.soak.soak import Audit, Soak, soak_servo
from study_app.haptics.model.layout import LIMITER_GLITCH, LIMITER_NAMES, LIMITER_STOP, SAMPLE, records
from study_app.haptics.runtime.telemetry import Samples
from study_app.protocol.load import load_scenes

pytestmark = pytest.mark.slow

SHORT_H = 2 / 60


@pytest.fixture(scope="module")
def scenes():
    return load_scenes("rek2024")


@pytest.fixture(scope="module")
def report(scenes):
    """Return the report of two minutes in virtual time."""
    return soak_servo(scenes, SHORT_H, virtual=True)


def test_two_virtual_minutes_of_every_fault_find_nothing(report):
    assert report.findings == ()
    assert report.verdict == "passed: no faults found"
    assert report.ticks == report.planned == 120_000
    for name, times, readings, count_seen in report.faults:
        assert 0 < times <= readings == count_seen, name
    assert (
        report.recoveries == sum(times for name, times, _, _ in report.faults if "lost" in name) + report.counts.stale
    )
    assert report.counts.stale > 0
    assert report.rests.count == 4
    assert 1 < report.rests.pushed_s < 3.5, "the wake of water pushes for 1.7 s"
    assert report.drift.comparisons > 20
    assert 5 < report.drift.longest_s < 30
    assert 1 < report.device.most_n <= 8
    assert not report.device.last_n.any()
    assert report.dropped == 0
    assert len(report.memory) == 11


def test_each_number_of_the_report_stands_beside_its_own_name(report):
    """Every number differs from the others."""
    counts, device, mib = report.counts.copy(), report.device.copy(), 2**20
    for name, number in {
        "limit_n": 8.0, "steepest_n": 1.2, "release_step_n": 1.1, "energy_step_n": 0.3, "no_number": 4, "refused": 15,
        "stale": 1600, "drift_ns": 17, "latest_s": 0.018, "limiters": 30 + np.arange(len(LIMITER_NAMES)),
        "not_finite": 91, "displaced": 92, "silent": 93, "long_ticks": 94, "buttons": 95, "lost": 96,
        "lost_at_write": 97,
    }.items():  # fmt: skip
        counts[name] = number
    for name, number in {
        "most_n": 1.9, "writes": 2000, "not_finite": 21, "episodes": 50 + np.arange(7), "injected": 70 + np.arange(7),
    }.items():  # fmt: skip
        device[name] = number
    numbered = replace(
        report, counts=counts, device=device, overruns=22, dropped=23, recoveries=24, loads=25, stops=26,
        memory=(mib, 2 * mib, 7 * mib // 2), drift=replace(report.drift, comparisons=27, worst=2.8e-10, longest_s=29.0),
        rests=replace(report.rests, count=61, pushed_s=0.62, wake_mps=0.63, force_n=0.64),
    )  # fmt: skip
    limiters = {name: 30 + k for k, name in enumerate(LIMITER_NAMES)}
    faults = {name: {"times": 50 + k, "readings": 70 + k, "seen": 91 + k} for k, name in enumerate(KINDS)}
    _, drift, forces, counters, injected, memory, _ = (part.splitlines() for part in numbered.text().split("\n\n"))
    assert drift == [
        "drift",
        "  clock                 17 ns from the ticks at most",
        "  wake                  2.8e-10 of Σ|e|/S from its definition at most, in 27 comparisons; "
        "the longest wake lasted 29 s",
        "  remains after 61 rests   wake 0.63 m/s, force 6.4e-01 N; above 0.05 N for at most 0.62 s",
    ]
    assert forces == [
        "forces",
        "  largest written       1.900000 N (limit 8 N), 2,000 writes",
        "  largest step          1.200000 N",
        "    at a stop or fault  1.100000 N",
        "    passivity control   0.300000 N",
        "  non-finite forces     25",
    ]
    assert counters == [
        "counters",
        "  overruns 22; dropped samples 23; latest tick 18.000 ms late",
        "  readings rejected 15; stale faults 1,600; recoveries 24",
        "  scenes presented 25; force stopped by the host 26 times",
        f"  limiters: {', '.join(f'{name} {ticks}' for name, ticks in limiters.items())}",
    ]
    assert [line.split() for line in injected] == [
        ["fault", "times", "readings", "seen"],
        *([name, *map(str, row.values())] for name, row in faults.items()),
    ]
    assert memory == ["memory [MiB]", "  1.0 2.0 3.5; growth +2.5"]
    numbers = {
        "clock_drift_ns": 17, "wake_drift": 2.8e-10, "wake_comparisons": 27, "longest_wake_s": 29.0, "rests": 61,
        "residue_wake_mps": 0.63, "residue_force_n": 0.64, "pushed_at_rest_s": 0.62, "largest_force_n": 1.9,
        "largest_step_n": 1.2, "largest_let_go_n": 1.1, "largest_energy_step_n": 0.3, "latest_s": 0.018,
        "overruns": 22, "dropped": 23, "refused": 15, "stale_faults": 1600, "recoveries": 24, "scenes_presented": 25,
        "force_stops": 26, "limiters": limiters, "faults": faults, "memory_bytes": [mib, 2 * mib, 7 * mib // 2],
    }  # fmt: skip
    assert numbered.table() == numbered.table() | numbers


def test_counts_of_telemetry_are_compared_only_if_no_sample_was_dropped(report):
    """With dropped samples telemetry must count less: only ticks = samples + dropped remains to be checked."""
    more = replace(report, overruns=report.overruns + 1)
    assert more.findings == (f"{more.overruns} overruns, but the ticks imply {report.counts.overruns}",)
    dropped = replace(more, dropped=7)
    assert dropped.findings == (f"{report.ticks} ticks do not equal {report.counts.samples} samples plus 7 dropped",)


def test_the_same_seed_finds_the_same(scenes, report):
    again = soak_servo(scenes, SHORT_H, virtual=True).table()
    first = report.table()
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
        audit.check(part)
    names = ("accepted", "excess", "no_number", "steps", "unstopped", "drift_ns", "missing")
    assert {name for name in names if audit.counts[name]} == violated
    assert audit.counts.first_tick == (3 if violated else -1)


def test_a_hand_draws_reaches_circles_and_zigzags_within_its_range_and_rests_between(scenes, monkeypatch):
    places, kinds = [], []
    hand = Soak(scenes, 0.01, virtual=True, seed=3).hand

    def reach_to(x_m, y_m, z_m, duration_s):
        assert 0.12 <= duration_s <= 1.62
        places.append((x_m, y_m, z_m))
        kinds.append("reach")

    def follow(t_s, places_m):
        legs_m = np.linalg.norm(np.diff(places_m, axis=0), axis=1)
        across_m = np.hypot(places_m[:, 0], places_m[:, 2])
        is_circle = np.ptp(across_m) < 1e-9
        kinds.append("circle" if is_circle else "zigzag")
        speeds_mps = legs_m / np.diff(t_s)
        assert speeds_mps.max() <= 1.0 * (1.1 if is_circle else 1 + 1e-9)
        assert t_s[0] == 0
        if is_circle:
            assert 0.004 <= across_m[0] <= 0.04
            assert np.abs(places_m[:, 1]).max() <= 0.3 * across_m[0] + 1e-12
            assert t_s[-1] + 0.002 >= 1.0
        else:
            assert 4 <= len(t_s) <= 11
            assert np.ptp(speeds_mps) < 1e-9, "all legs have the same speed"
            places.extend(map(tuple, places_m))

    monkeypatch.setattr(hand, "reach_to", reach_to)
    monkeypatch.setattr(hand, "follow", follow)
    monkeypatch.setattr(hand, "rest", lambda: kinds.append("rest"))
    durations_s = [hand.start_motion() for _ in range(1000)]
    assert 0.0 < min(durations_s) <= max(durations_s) <= 8.0
    shares = {kind: kinds.count(kind) / 1000 for kind in ("reach", "rest", "circle", "zigzag")}
    assert shares == pytest.approx({"reach": 0.3, "rest": 0.1, "circle": 0.3, "zigzag": 0.3}, abs=0.05)
    assert hand.state.hand.tremor_m > 0
    hand.keep_still()
    assert (hand.state.hand.tremor_m, kinds[-1]) == (0.0, "rest")
    for coordinates_m in np.transpose(places):
        assert coordinates_m.min() == pytest.approx(-0.04, abs=0.001)
        assert coordinates_m.max() == pytest.approx(0.04, abs=0.001)
        assert np.abs(coordinates_m).max() <= 0.04
        assert coordinates_m.mean() == pytest.approx(0.0, abs=0.002)


def test_liquids_without_a_wake_are_soaked_too():
    report = soak_servo(load_scenes("physical_liquids"), 0.01, virtual=True)
    assert report.findings == ()
    assert report.drift.comparisons == 0


@pytest.mark.nightly
def test_two_real_seconds_tick_in_a_thread_of_their_own(scenes):
    report = soak_servo(scenes, 2 / 3600, virtual=False)
    assert report.findings == ()
    assert report.ticks >= report.planned
    assert {name: count_seen for name, _, _, count_seen in report.faults}["clock_jump"] is None
    assert report.device.injected.sum() > 0
    assert "in real time" in report.text()
    assert not any(thread.name == "servo" for thread in threading.enumerate())


def test_a_soak_that_is_ended_early_reports_its_results_so_far(scenes):
    ending, lines = threading.Event(), []

    def tell(line):
        lines.append(line)
        if "%" in line:
            ending.set()

    report = soak_servo(scenes, SHORT_H, virtual=True, ending=ending, progress=tell)
    assert lines[-1].startswith(" 10 %")
    assert 12_000 <= report.ticks < 20_000
    assert report.verdict.startswith("passed: no faults found in the 1")
    assert not report.device.last_n.any()


@pytest.mark.parametrize("seed", [1, 2])
def test_no_force_ticks_to_and_fro_where_a_hand_keeps_still(scenes, seed):
    """A passivity observer in debt once let the force flip between two encoder counts for seconds."""
    rested = []
    with Soak({"light_oil": scenes["light_oil"]}, 0.012, virtual=True, seed=seed) as run:
        run.device.allow = lambda _faults, _gap: None
        reader = run.servo.telemetry.reader()
        while run.done < run.ticks:
            run.step()
            samples = reader.read()
            if run.stretch.part == "rest":
                rested.append(samples.device_force_n.copy())
    force_n = np.concatenate(rested)
    assert len(force_n) > 5000
    has_force = np.linalg.norm(force_n[1:], axis=1) > 0.05
    assert has_force.any()
    turned = np.sum(force_n[1:] * force_n[:-1], axis=1) < 0
    assert np.count_nonzero(turned & has_force) < 5


@pytest.fixture
def run_soak(tmp_path, monkeypatch, capsys):
    """Return a function that runs the command in an empty folder, and returns exit code and output."""
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
    def interrupted(*arguments, progress, **named):
        def tell(line):
            progress(line)
            if line.startswith(" 10 %"):
                signal.raise_signal(number)

        return soak_servo(*arguments, progress=tell, **named)

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
