"""The soak: sound where the servo is, and every way in which it could not be is found."""

import dataclasses
import json
import math
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
from study_app.errors import ServoFault
from study_app.haptics.model.layout import LIMITER_ENERGY, LIMITER_STOP, SAMPLE, records
from study_app.protocol.load import load_scenes
from study_app.validation.soak.sample_audit import Audit
from study_app.validation.soak.soak import Soak, soak

pytestmark = pytest.mark.slow

SHORT_H = 2 / 60
PERIOD_NS = 1_000_000


@pytest.fixture(scope="module")
def scenes():
    return load_scenes("rek2024")


@pytest.fixture(scope="module")
def found(scenes):
    """Return the report of two minutes in virtual time."""
    return soak(scenes, SHORT_H, virtual=True)


# the servo as it is


def test_two_virtual_minutes_of_every_fault_find_nothing(found):
    assert found.findings == ()
    assert found.verdict == "sound: nothing found"
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
    again = soak(scenes, SHORT_H, virtual=True).table()
    first = found.table()
    for table in (again, first):
        for name in ("took_s", "memory_bytes"):
            del table[name]
    assert again == first
    assert soak(scenes, 0.001, virtual=True, seed=2).table() != soak(scenes, 0.001, virtual=True).table()


def test_liquids_without_a_wake_are_soaked_too():
    found = soak(load_scenes("physical_liquids"), 0.01, virtual=True)
    assert found.findings == ()
    assert found.drift.comparisons == 0


@pytest.mark.nightly
def test_two_real_seconds_tick_in_a_thread_of_their_own(scenes):
    found = soak(scenes, 2 / 3600, virtual=False)
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

    found = soak(scenes, SHORT_H, virtual=True, ending=ending, progress=tell)
    assert lines[-1].startswith(" 10 %")
    assert 12_000 <= found.ticks < 20_000
    assert found.verdict.startswith("sound: nothing found in the 1")
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


# a soak that could find nothing would prove nothing


def stepped(scenes, spoil, *, at=0.5, hours=SHORT_H):
    """Return the report of a soak in which ``spoil(run)`` is called once, at a share of its ticks."""
    with Soak(scenes, hours, virtual=True) as run:
        spoilt = False
        while run.done < run.ticks:
            run.step()
            if not spoilt and run.done >= at * run.ticks:
                spoil(run)
                spoilt = True
        return run.report()


def test_a_spoilt_sum_of_the_wake_is_found(scenes):
    def spoil(run):
        for model in run.servo.loop.slots:
            model.liquid_states.wake.scale *= 1 + 1e-6

    found = stepped(scenes, spoil, at=0.15)  # in the steady part of a round in water, whose wake is 1.7 s long
    assert 1e-9 < found.drift.worst < 1e-2
    assert any("off its definition" in finding for finding in found.findings)


def test_a_force_of_the_liquids_that_is_no_number_is_found(scenes):
    def spoil(run):
        for model in run.servo.loop.slots:
            model.liquids.drag.factor_kg_m = math.nan

    found = stepped(scenes, spoil, at=0.6)
    assert found.findings == ("1 non-finite forces of the liquids",)
    assert found.device.not_finite == 0, "none of them was sent"


def test_a_servo_that_takes_no_tick_is_not_waited_for(scenes, monkeypatch):
    now_s = iter(range(0, 1000, 6))
    monkeypatch.setattr("study_app.validation.soak.soak.time.monotonic", lambda: next(now_s))
    with Soak(scenes, SHORT_H, virtual=True) as run:
        run.step()
        run.servo.advance = lambda _ticks: 0
        run.step()
        with pytest.raises(ServoFault, match="no tick for 10 s"):
            run.step()


def test_memory_that_is_kept_is_found(scenes):
    kept = []
    found = stepped(scenes, lambda _run: kept.append(bytearray(b"x") * (384 << 20)))
    assert found.growth_bytes > 48 << 20  # what was freed before may have held a part of it
    assert [finding for finding in found.findings if "memory grew by" in finding]


def test_a_force_above_the_limit_is_found(scenes):
    def spoil(run):
        run.servo.loop.safety[0].device_limit_n = 20.0
        for model in run.servo.loop.slots:
            model.parameters.force_limit_n = 20.0
            model.parameters.slope_limit_nspm *= 10

    found = stepped(scenes, spoil, at=0.4)
    assert found.device.most_n > 8
    assert any("forces above the limit of 8 N" in finding for finding in found.findings)
    assert any("N was written" in finding for finding in found.findings)


@pytest.mark.parametrize(
    ("record", "name", "value", "said"),
    [
        ("counts", "excess", 1, "above the limit"),
        ("counts", "no_number", 1, "non-finite forces"),
        ("counts", "steps", 1, "not 1.5 N"),
        ("counts", "unstopped", 1, "while stopped"),
        ("counts", "believed", 1, "implausible readings"),
        ("counts", "drift_ns", 1, "off its ticks"),
        ("counts", "overruns", -1, "follow from the ticks"),
        ("counts", "samples", 0, "ticks are not"),
        ("counts", "displaced", 0, "readings of glitch"),
        ("device", "not_finite", 1, "non-finite forces were written"),
        ("device", "most_n", 8.1, "of 8.1 N was written"),
        ("device", "last_n", 0.1, "not zero"),
    ],
)
def test_every_number_that_may_not_be_is_named(found, record, name, value, said):
    changed = getattr(found, record).copy()
    changed[name] = value
    findings = dataclasses.replace(found, **{record: changed}).findings
    assert len(findings) == 1
    assert said in findings[0]


@pytest.mark.parametrize(("name", "value"), [("wake_mps", 1e-300), ("force_n", 1e-11), ("force_n", math.inf)])
def test_what_is_left_after_a_rest_is_found(found, name, value):
    rests = dataclasses.replace(found.rests, **{name: value})
    assert "after a rest" in dataclasses.replace(found, rests=rests).verdict


def samples(count=10):
    """Return good samples: a steady force, tick after tick."""
    made = records(SAMPLE, count)
    made.tick = np.arange(count)
    made.time_ns = np.arange(count) * PERIOD_NS + 100
    made.lateness_ns = 100
    made.device_force_n = (3.0, 0.0, 4.0)
    made.fresh = 1
    return made


def audited(made):
    audit = Audit(8.0, 1.5, PERIOD_NS, 0.05)
    audit.take(made[: len(made) // 2])
    audit.take(made[len(made) // 2 :])
    return audit.counts


BROKEN = ("excess", "no_number", "steps", "unstopped", "believed", "drift_ns", "missing", "overruns")


def broken(counts):
    return {name: int(counts[name]) for name in BROKEN if counts[name]}


def test_good_samples_break_no_promise():
    counts = audited(samples())
    assert broken(counts) == {}
    assert (counts.samples, counts.most_n, counts.first_tick) == (10, 5.0, -1)


@pytest.mark.parametrize(
    ("field", "value", "promise"),
    [
        ("device_force_n", (3.0, 1.51, 4.0), {"steps": 2}),
        ("device_force_n", (3.0, 1.5, 4.0), {}),
        ("device_force_n", (8.01, 0.0, 4.0), {"excess": 1, "steps": 2}),
        ("device_force_n", (3.0, math.nan, 4.0), {"no_number": 1}),
        ("device_force_n", (math.inf, 0.0, 0.0), {"no_number": 1, "steps": 1}),
        ("position_m", (0.0, math.nan, 0.0), {"believed": 1}),
        ("position_m", (-math.inf, 0.0, 0.0), {"believed": 1}),
        ("limiters", LIMITER_STOP, {"unstopped": 1}),
        ("lateness_ns", 99, {"drift_ns": 1}),
        ("busy_ns", 3_500_000, {"overruns": 2, "drift_ns": 2_000_000}),
    ],
)
def test_a_broken_promise_is_counted(field, value, promise):
    made = samples()
    made[field][7] = value
    assert broken(audited(made)) == promise


def test_the_energy_account_and_stops_may_let_go_at_once():
    for limiters in (LIMITER_ENERGY, LIMITER_STOP):
        made = samples()
        made.device_force_n[7:] = 0.0
        made.limiters[7] = limiters
        counts = audited(made)
        assert broken(counts) == {}
        assert max(counts.let_go_n, counts.paid_n) == 5.0


# the command


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
    assert "sound: nothing found" in said
    assert Path("out/soak.txt").read_text(encoding="utf-8").strip() in said
    table = json.loads(Path("out/soak.json").read_text(encoding="utf-8"))
    assert table["ticks"] == 7200
    assert table["findings"] == []


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (("--hours", "0"), "not 0"),
        (("--hours", "nan"), "not nan"),
        (("--hours", "soon"), "soon"),
        (("--hours", "0.002", "--virtual", "--to", "taken"), "taken"),
        ((), "--hours"),
    ],
)
def test_bad_words_are_one_line(run_soak, words, part):
    Path("taken").write_text("a file", encoding="utf-8")
    code, said, complaint = run_soak(*words)
    assert (code, said) == (2, "")
    assert len(complaint.splitlines()) == 1, complaint
    assert part in complaint


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
    assert "sound: nothing found in the 0.0 % that were run" in said
