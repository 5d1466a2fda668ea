"""The soak: sound where the servo is, and every way in which it could not be is found."""

import dataclasses
import json
import math
import signal
import subprocess
import sys
import threading
from random import Random

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.errors import ServoFault, StudyError
from study_app.evaluation import faults as faulty
from study_app.evaluation.audit import Audit
from study_app.evaluation.drift import Drift
from study_app.evaluation.faults import KINDS, FaultyDevice
from study_app.evaluation.ledger import Ledger, wake_of
from study_app.evaluation.references import wakes
from study_app.evaluation.restless import REACH_M, RestlessHand
from study_app.evaluation.soak import Soak, soak
from study_app.haptics.clock import SystemClock, VirtualClock
from study_app.haptics.layout import (
    LIMITER_ENERGY,
    LIMITER_GLITCH,
    LIMITER_STOP,
    SAMPLE,
    STATUS_DEVICE_LOST,
    records,
)
from study_app.haptics.scene import Box, Liquid, Scene, Uniform, Wake
from study_app.haptics.servo import Servo
from study_app.protocol.load import load_scenes
from tests.haptics.probe import Probe

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
    assert 15 < found.drift.longest_s < 30
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


def test_two_real_seconds_turn_in_a_thread_of_their_own(scenes):
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

    found = soak(scenes, SHORT_H, virtual=True, ending=ending, tell=tell)
    assert lines[-1].startswith(" 10 %")
    assert 12_000 <= found.ticks < 20_000
    assert found.verdict.startswith("sound: nothing found in the 1")
    assert not found.device.last_n.any()


@pytest.mark.parametrize("hours", [0.0, -1.0, math.nan, math.inf, 1e5, 1e-9])
def test_hours_that_make_no_sense_are_refused(scenes, hours):
    with pytest.raises(StudyError, match="a soak lasts"):
        soak(scenes, hours, virtual=True)


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
        for model in run.servo._loop._slots:
            model.liquid_states.wake.scale *= 1 + 1e-6

    found = stepped(scenes, spoil, at=0.15)  # in the steady part of a round in water, whose wake is 1.7 s long
    assert 1e-9 < found.drift.worst < 1e-2
    assert any("off its definition" in finding for finding in found.findings)


def test_a_spoilt_decay_of_the_wake_is_found(scenes):
    def spoil(run):
        for model in run.servo._loop._slots:
            model.liquids.wake.log_decay_per_s *= 1 + 1e-4

    assert any("off its definition" in finding for finding in stepped(scenes, spoil, at=0.6).findings)


def test_a_force_of_the_liquids_that_is_no_number_is_found(scenes):
    def spoil(run):
        for model in run.servo._loop._slots:
            model.liquids.drag.factor_kg_m = math.nan

    found = stepped(scenes, spoil, at=0.6)
    assert found.findings == ("1 forces of the liquids that are no numbers",)
    assert found.device.not_finite == 0, "none of them was sent"


def test_a_servo_that_takes_no_turn_is_not_waited_for(scenes, monkeypatch):
    now_s = iter(range(0, 1000, 6))
    monkeypatch.setattr("study_app.evaluation.soak.time.monotonic", lambda: next(now_s))
    with Soak(scenes, SHORT_H, virtual=True) as run:
        run.step()
        run.servo.advance = lambda _turns: 0
        run.step()
        with pytest.raises(ServoFault, match="no turn for 10 s"):
            run.step()


def test_memory_that_is_kept_is_found(scenes):
    kept = []
    found = stepped(scenes, lambda _run: kept.append(bytearray(b"x") * (12 << 20)))
    assert found.growth_bytes > 10 << 20
    assert [finding for finding in found.findings if "memory grew by 1" in finding]


def test_a_force_above_the_limit_is_found(scenes):
    def spoil(run):
        run.servo._loop._safety[0].device_limit_n = 20.0
        for model in run.servo._loop._slots:
            model.parameters.force_limit_n = 20.0
            model.parameters.slope_limit_nspm *= 10

    found = stepped(scenes, spoil, at=0.6)
    assert found.device.most_n > 8
    assert any("forces above the limit of 8 N" in finding for finding in found.findings)
    assert any("N was written" in finding for finding in found.findings)


def test_samples_read_too_late_are_counted_and_cost_nothing_else(scenes):
    found = stepped(scenes, lambda run: run.servo.advance(50_000), at=0.6)
    assert found.dropped > 50_000 - 32_768
    assert found.counts.missing == found.dropped
    assert found.findings == ()


def test_dropped_samples_that_are_not_counted_are_found(scenes):
    def spoil(run):
        run.servo.advance(50_000)
        run._reader.read()
        run._reader.dropped = 0

    assert any("dropped" in finding for finding in stepped(scenes, spoil, at=0.6).findings)


@pytest.mark.parametrize(
    ("record", "name", "value", "said"),
    [
        ("counts", "excess", 1, "above the limit"),
        ("counts", "no_number", 1, "no numbers"),
        ("counts", "steps", 1, "not 0.5 N"),
        ("counts", "unstopped", 1, "while stopped"),
        ("counts", "believed", 1, "no place"),
        ("counts", "drift_ns", 1, "off its ticks"),
        ("counts", "overruns", -1, "follow from the turns"),
        ("counts", "samples", 0, "ticks are not"),
        ("counts", "displaced", 0, "readings of glitch"),
        ("device", "not_finite", 1, "written that are no numbers"),
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


def test_a_wake_that_is_off_is_found(found):
    for worst in (1.1e-9, math.inf):
        assert "definition" in dataclasses.replace(found, drift=Drift(worst=worst)).verdict


# the audit


def samples(count=10):
    """Return good samples: a steady force, turn after turn."""
    made = records(SAMPLE, count)
    made.tick = np.arange(count)
    made.time_ns = np.arange(count) * PERIOD_NS + 100
    made.lateness_ns = 100
    made.device_force_n = (3.0, 0.0, 4.0)
    made.fresh = 1
    return made


def audited(made):
    audit = Audit(8.0, PERIOD_NS, 0.05)
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
        ("device_force_n", (3.0, 0.51, 4.0), {"steps": 2}),
        ("device_force_n", (3.0, 0.5, 4.0), {}),
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


def test_a_lost_device_begins_another_run():
    made = samples()
    made.status[6] = STATUS_DEVICE_LOST
    made.fresh[6] = 0
    made.time_ns[7:] += 123_456
    made.device_force_n[7:] = (0.0, 0.1, 0.0)
    counts = audited(made)
    assert broken(counts) == {}
    assert (counts.lost, counts.silent) == (1, 0)


def test_missing_turns_are_counted():
    made = samples()
    assert broken(audited(made[[0, 1, 2, 6, 7, 8]])) == {"missing": 3}


def test_a_turn_that_takes_long_passes_deadlines_over():
    made = samples()
    made.busy_ns[7] = 3_500_000
    made.time_ns[8:] += 2_000_000
    made.time_ns[8] += 500_000
    made.lateness_ns[8] += 500_000
    counts = audited(made)
    assert broken(counts) == {"overruns": 2}
    assert counts.long_turns == 1


# the ledger


def walked(scene, ticks, seed):
    """Return samples of a random walk and, by the slow definition, the wake each of them meets."""
    random = np.random.default_rng(seed)
    speed = np.repeat(random.choice([0.0, 5e-4, 0.05, 1.0, 4.0], ticks // 25), 25)
    heading = np.cumsum(np.where(random.random(ticks) < 0.03, random.uniform(-np.pi, np.pi, ticks), 0.01))
    made = records(SAMPLE, ticks)
    made.fresh, made.scene, made.tick = 1, 1, np.arange(ticks)
    made.time_ns = np.cumsum(random.choice([PERIOD_NS, 1_300_000, 30_000_000], ticks, p=[0.8, 0.15, 0.05]))
    made.velocity_mps = np.column_stack([speed * np.cos(heading), random.normal(size=ticks), speed * np.sin(heading)])
    interval_s = np.clip(np.diff(made.time_ns, prepend=made.time_ns[0] - PERIOD_NS) * 1e-9, 2e-4, 0.02)
    interval_s[0] = 1e-3
    made.position_m = np.cumsum(made.velocity_mps * interval_s[:, None], axis=0) / scene.scale
    wake = scene.liquids[0].wake
    vertical = 1.0 if wake.axes == "xyz" else 0.0
    made.wake_mps, _ = wakes(
        made.velocity_mps * np.array([1.0, vertical, 1.0]),
        made.position_m * scene.scale,
        interval_s,
        wake.length,
        wake.scaling,
        wake.exponent,
        math.cos(math.radians(wake.breaking_angle_deg)),
        wake.breaking_span_m,
        wake.decay,
        wake.resolution_m,
    )
    return made


def tank(**wake):
    plain = {"length": 80, "scaling": 100}
    return Scene(liquids=(Liquid(id="tank", density_kg_m3=1000, effects=("drag", "wake"), wake=Wake(**plain | wake)),))


@pytest.mark.parametrize(
    "wake",
    [
        {},
        {"exponent": 0.25, "breaking_span_m": 0.068},
        {"exponent": 2.0, "decay": 0.99, "breaking_angle_deg": 10},
        {"axes": "xyz", "breaking_span_m": 0.02},
        {"resolution_m": 0.01},
        {"length": 1, "decay": 1.0},
    ],
)
def test_the_ledger_equals_the_slow_definition(wake):
    scene = tank(**wake)
    made, ledger = walked(scene, 3000, seed=3), Ledger(scene)
    errors = [ledger.take(part) for part in np.split(made, range(137, 3000, 137))]
    assert max(error for error in errors if error is not None) < 1e-12
    assert sum(error is not None for error in errors) > 5


def test_a_wake_that_is_no_number_is_as_far_off_as_can_be():
    scene = tank()
    made = walked(scene, 500, seed=4)
    made.wake_mps[-1, 0] = math.nan
    assert Ledger(scene).take(made) == math.inf


def test_a_refused_reading_is_passed_over_and_five_empty_the_wake():
    scene = tank()
    made = walked(scene, 500, seed=4)
    for refused, empties in ((4, False), (5, True)):
        bad = made[: refused + 1].copy()
        bad.limiters[:refused] = LIMITER_GLITCH
        bad.position_m[:refused] = math.nan
        ledger = Ledger(scene)
        ledger.take(made)
        before, _ = ledger.definition()
        bad.wake_mps[refused] = 0.0 if empties else before
        error = ledger.take(bad)
        assert error is None if empties else error < 1e-12
        assert (ledger.age_s < 0.01) is empties


def test_drift_follows_scenes_and_no_further_than_the_samples_go():
    scene = tank()
    made, drift = walked(scene, 600, seed=5), Drift()
    drift.expect(1, scene)
    drift.take(made[:300])
    assert (drift.comparisons, drift.worst < 1e-12) == (1, True)
    drift.take(made[301:])
    assert drift.comparisons == 1
    drift.expect(2, scene)
    made.scene[560:] = 2
    drift.take(made)
    assert drift.comparisons == 2
    assert drift.worst > 1e-6, "the wake goes on where the scene began anew"


def test_only_a_wake_that_telemetry_tells_all_about_is_written_down():
    plain = tank().liquids[0]
    assert wake_of(tank()) == plain.wake
    for changed in (
        {"effects": ("drag",)},
        {"effects": ("drag", "wake", "current"), "current": Uniform(velocity_mps=(1, 0, 0))},
        {"region": Box(size_m=(1, 1, 1))},
    ):
        assert wake_of(Scene(liquids=(plain.model_copy(update=changed),))) is None
    assert wake_of(Scene()) is None


# the device that goes wrong


def turned(kind, readings, *, seed=1, ticks=2000, gap=(20, 60)):
    """Return a device that only goes wrong in one way, and the telemetry of a servo that has it."""
    clock = VirtualClock()
    probe = Probe(velocity_mps=(0.0, 0.0, 0.0))
    device = FaultyDevice(probe, clock, seed)
    device.allow({kind: (1.0, *readings)}, gap)
    servo = Servo(device, clock=clock)
    reader = servo.telemetry.reader()
    while servo.telemetry.written[0] < ticks:
        servo.advance(ticks - int(servo.telemetry.written[0]))
        if servo.fault:
            servo.stop()
    servo.stop()
    return device, reader.read()


def test_readings_that_are_no_numbers():
    device, seen = turned(faulty.NON_FINITE, (1, 8))
    bad = ~np.isfinite(seen.position_m).all(axis=1)
    assert bad.sum() == device.state.injected[faulty.NON_FINITE] > 50
    assert np.isnan(seen.position_m).any()
    assert {math.inf, -math.inf} <= set(seen.position_m[bad].ravel().tolist())
    assert (seen.limiters[bad] & LIMITER_GLITCH).all()


def test_glitches_of_100_m_a_second():
    device, seen = turned(faulty.GLITCH, (1, 8))
    steps = np.linalg.norm(np.diff(seen.position_m, axis=0), axis=1) / 1e-3
    assert (steps > 99).sum() == 2 * device.state.episodes[faulty.GLITCH]


def test_silence():
    device, seen = turned(faulty.SILENCE, (3, 60))
    assert (seen.fresh == 0).sum() == device.state.injected[faulty.SILENCE] > 100
    assert (seen.status != 0).any(), "60 ms are a fault"


def test_a_clock_that_jumps_and_one_that_cannot():
    device, seen = turned(faulty.JUMP, (1, 1))
    assert seen.busy_ns.sum() == device.state.jumped_ns > 10**9
    assert (seen.busy_ns > 0).sum() == device.state.injected[faulty.JUMP]
    real = FaultyDevice(Probe(), SystemClock(), 1)
    real.allow({faulty.JUMP: (1.0, 1, 1)}, (20, 60))
    assert not real.state.share.any()


@pytest.mark.parametrize("kind", [faulty.LOST, faulty.LOST_AT_WRITE])
def test_a_device_that_is_lost_and_comes_back(kind):
    device, seen = turned(kind, (1, 1))
    assert (seen.status == STATUS_DEVICE_LOST).sum() == device.state.injected[kind] > 20


def test_a_stop_button_that_is_held():
    device, seen = turned(faulty.BUTTON, (1, 50))
    assert (seen.buttons != 0).sum() == device.state.injected[faulty.BUTTON] > 100
    assert (seen.limiters[np.argmax(seen.buttons != 0) :] & LIMITER_STOP).all()


def test_nothing_goes_wrong_where_nothing_is_allowed():
    device, seen = turned(faulty.GLITCH, (1, 8), gap=(10**6, 10**6))
    assert device.state.injected.sum() == 0
    assert (seen.limiters & LIMITER_GLITCH == 0).all()
    assert len(KINDS) == len(device.state.share)


def test_the_device_bears_witness_to_what_was_written():
    clock = VirtualClock()
    probe = Probe(velocity_mps=(0.2, 0.0, 0.0))
    device = FaultyDevice(probe, clock, 1)
    servo = Servo(device, clock=clock)
    servo.load(Scene(liquids=(Liquid(id="honey", density_kg_m3=1400),)))
    servo.advance(1000)
    assert device.state.most_n == np.linalg.norm(probe.forces_n, axis=1).max() > 1
    assert device.state.last_n.tolist() == probe.forces_n[-1].tolist()
    assert device.state.writes == len(probe.forces_n)
    servo.stop()
    assert not device.state.last_n.any()


def test_the_hand_stays_within_reach_and_keeps_still_when_asked():
    hand, clock = RestlessHand(Random(1)), VirtualClock()  # noqa: S311
    servo = Servo(hand, clock=clock)
    reader = servo.telemetry.reader()
    for _ in range(40):
        servo.advance(max(1, round(1000 * hand.go_on())))
        places_m = reader.read().position_m
        assert abs(places_m).max() < 1.3 * REACH_M
        assert np.ptp(places_m) > 0
    hand.keep_still()
    servo.advance(2000)
    assert not np.ptp(reader.read().position_m[1000:], axis=0).any()


# the command


def liquid_study(*words, cwd):
    return subprocess.run(
        [sys.executable, "-m", "study_app", *words], cwd=cwd, capture_output=True, text=True, check=False, timeout=150
    )


def test_the_command_prints_and_writes_the_report(tmp_path):
    ended = liquid_study("soak", "--hours", "0.002", "--virtual", "--to", "out", cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert "sound: nothing found" in ended.stdout
    assert (tmp_path / "out" / "soak.txt").read_text(encoding="utf-8").strip() in ended.stdout
    table = json.loads((tmp_path / "out" / "soak.json").read_text(encoding="utf-8"))
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
def test_bad_words_are_one_line(tmp_path, words, part):
    (tmp_path / "taken").write_text("a file", encoding="utf-8")
    ended = liquid_study("soak", *words, cwd=tmp_path)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert len(ended.stderr.splitlines()) == 1, ended.stderr
    assert part in ended.stderr


def test_an_unknown_protocol_is_told_before_anything_runs(tmp_path):
    ended = liquid_study("soak", "--hours", "1", "--protocol", "rek2042", cwd=tmp_path)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert 'did you mean "rek2024"' in ended.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_ctrl_c_ends_with_the_report_so_far(tmp_path):
    words = [sys.executable, "-m", "study_app", "soak", "--hours", "100"]
    with subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert "Ctrl+C" in running.stdout.readline()
        running.send_signal(signal.SIGINT)
        said, complaint = running.communicate(timeout=60)
    assert complaint == ""
    assert running.returncode == 130
    assert "sound: nothing found in the 0.0 % that were run" in said
