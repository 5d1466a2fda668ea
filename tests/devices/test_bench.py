"""`devices bench`: known numbers are found again, and every way out ends in zero force."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.devices.bench import measurements, procedure
from study_app.devices.bench.procedure import as_json, as_markdown, workstation_results
from study_app.devices.driver import dynamics_of
from study_app.devices.registry import descriptor_of, open_device
from study_app.errors import DeviceError, DeviceLost
from study_app.haptics.model.device_dynamics import Dynamics
from study_app.store import workstation
from tests.compiled import needs_servo

QUICK = procedure.Durations(rest_s=1.0, come_s=3.0, wave_s=12.0, push_s=3.0, damping_s=8.0)

pytestmark = [needs_servo, pytest.mark.slow]


def bench(device, ask=None, durations=QUICK):
    from study_app.devices.bench.procedure import ask_simulated_hand, run_bench
    from study_app.haptics.runtime.clocks import VirtualClock

    said = []
    hand = ask_simulated_hand(device, said.append)
    return run_bench(
        device, ask(hand) if ask else hand, progress=said.append, durations=durations, clock=VirtualClock()
    )


def last_command(device):
    """Return the last command of the motors: newtons, or a Falcon's motor units."""
    return np.array(device.held[1] if device.name == "falcon-emulated" else device.force_n)


@pytest.fixture(scope="module")
def bench_result_of():
    """Return a function that benches a device once and caches the result."""
    results = {}

    def measured(name):
        if name not in results:
            with open_device(name) as device:
                results[name] = bench(device)
                assert not last_command(device).any()
        return results[name]

    return measured


@pytest.mark.parametrize(
    ("name", "delay_ms"), [pytest.param("scripted", 0.0, marks=pytest.mark.nightly), ("falcon-emulated", 1.0)]
)
def test_numbers_of_the_simulated_handle_are_found(bench_result_of, name, delay_ms):
    result = bench_result_of(name)
    for motion in result.motions:
        assert motion.mass_kg == pytest.approx(0.2, rel=0.01)
        assert motion.damping_nspm == pytest.approx(0.5, abs=0.05)
        assert motion.friction_n == pytest.approx(0.1, abs=0.01)
        assert motion.delay_ms == pytest.approx(delay_ms, abs=0.2)
        assert motion.explained > 0.99
    assert result.count_m == pytest.approx(result.device["dynamics"]["count_m"], rel=0.2)
    assert result.gain.gain == pytest.approx(1.0, abs=0.01)
    assert result.regularity.new_share == pytest.approx(1.0)
    assert result.regularity.delay_ticks == (round(delay_ms), round(delay_ms))


def test_more_delay_permits_less_damping(bench_result_of):
    prompt, late = bench_result_of("scripted"), bench_result_of("falcon-emulated")
    assert {limit.ended for limit in prompt.damping} == {"most"}
    assert {limit.ended for limit in late.damping} == {"oscillation"}
    assert all(70 < limit.damping_nspm < 150 for limit in late.damping)


def test_report_and_settings_store_the_results(bench_result_of, tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_CONFIG", str(tmp_path))
    result = bench_result_of("falcon-emulated")
    text, document = as_markdown(result, "2026-11-21"), json.loads(as_json(result, "2026-11-21"))
    assert re.search(r"\| apparent mass \[kg\] \| 0\.(20|19)\d \|", text)
    assert "it oscillated" in text
    assert document["motions"][0]["mass_kg"] == result.motions[0].mass_kg
    assert document["device"]["serial"] == "EMULATED"
    assert str(tmp_path) not in text
    own = workstation.DeviceBench.model_validate(workstation_results(result, "2026-11-21"))
    workstation.save_settings(workstation.DEFAULTS.with_bench(own).with_bench(own))
    settings = workstation.load_settings()
    assert len(settings.benches) == 1
    assert settings.bench_of(result.device) == own
    kept_of = dynamics_of(1e-3, None, None, name="falcon-emulated", serial="EMULATED")
    assert kept_of == Dynamics(delay_s=1e-3, count_m=own.count_m, mass_kg=min(own.mass_kg))
    assert dynamics_of(None, 1e-5, None, name="falcon-emulated", serial="ANOTHER").unknown == ("delay_s", "mass_kg")
    assert settings.bench_of({"name": "falcon-emulated", "serial": "ANOTHER"}) is None
    from study_app.session.start import with_bench_measurements

    assert with_bench_measurements(result.device)["bench"]["mass_kg"] == pytest.approx([0.2] * 3, rel=0.01)
    assert "bench" not in with_bench_measurements({"name": "mouse"})


@pytest.mark.variants(2)
@pytest.mark.parametrize("at", ["damping", "grams"])
@pytest.mark.parametrize("name", ["scripted", "falcon-emulated"])
def test_interrupt_ends_in_zero_force(name, at):
    """Ctrl-C while a force acts: in the second that the damper grows, and at the second force on the scale."""
    forces = []

    def interrupting(hand):
        kinds = []

        def ask(kind, words):
            kinds.append(kind)

            def stop():
                forces.append(last_command(device))
                if len(forces) > 1 and forces[-1].any():
                    raise KeyboardInterrupt

            return stop if kind == at and (at == "damping" or kinds.count(at) > 1) else hand(kind, words)

        return ask

    with open_device(name) as device:
        with pytest.raises(KeyboardInterrupt):
            bench(device, interrupting)
        assert forces[-1].any()
        assert not last_command(device).any()


def test_a_key_ends_the_damper_and_a_missing_scale_is_skipped():
    def keys(hand):
        def ask(kind, words):
            return (lambda: "") if kind == "damping" else (lambda: "no") if kind == "scale" else hand(kind, words)

        return ask

    with open_device("scripted") as device:
        result = bench(device, keys)
        assert {limit.ended for limit in result.damping} == {"operator"}
        assert all(limit.damping_nspm < 1.0 for limit in result.damping)
        assert result.gain is None
        assert "Not measured." in as_markdown(result, "2026-11-21")


@pytest.mark.parametrize(
    ("at", "happens", "error", "words"),
    [
        ("damping", lambda device: device.unplug(), DeviceLost, "stopped responding"),
        ("damping", lambda device: device.press(8), DeviceError, "the stop button was pressed"),
        ("scale", lambda device: setattr(device, "held", False), DeviceError, "the handle moved too far"),
    ],
    ids=["unplugged", "stop button", "slips off the scale"],
)
def test_a_device_failure_ends_the_bench_without_force(at, happens, error, words):
    def watched(hand):
        def ask(kind, text):
            answer = hand(kind, text)
            if kind == at:
                happens(device)
            return answer

        return ask

    with open_device("scripted") as device:
        with pytest.raises(error, match=words):
            bench(device, watched)
        assert device.force_n == (0.0, 0.0, 0.0)


def start_driving_servo(device, limit_n, alive_ns=10**12, **excitation):
    """Return a servo that drives a device for a bench."""
    from study_app.devices.bench.excitation import BenchDriver, Excitation
    from study_app.haptics.runtime.clocks import VirtualClock
    from study_app.haptics.runtime.servo import Servo

    driver = BenchDriver(device, limit_n)
    servo = Servo(driver, clock=VirtualClock(), elements=1)
    driver.state.alive_ns = alive_ns
    driver.excite(Excitation(**excitation))
    return servo


def test_silent_host_ends_the_force():
    """A hanging program leaves no force on the handle."""
    with open_device("scripted") as device:
        servo = start_driving_servo(device, 4.0, alive_ns=500_000_000, push_n=(0.0, -1.0, 0.0))
        servo.advance(499)
        assert device.force_n[1] < -0.9
        servo.advance(3)
        assert device.force_n == (0.0, 0.0, 0.0)
        servo.stop()


def test_position_that_is_not_finite_is_passed_over():
    from tests.haptics.recording_device import Probe

    probe = Probe(velocity_mps=(0.0, 0.0, 0.0))
    probe.state.bad_at_read = 300
    servo = start_driving_servo(probe, 4.0, stiffness_npm=100.0, damping_nspm=6.0, push_n=(1.0, 0.0, 0.0))
    servo.advance(1000)
    assert probe.forces_n[-1] == pytest.approx([1.0, 0.0, 0.0])
    assert np.diff(probe.forces_n[:, 0]).min() >= 0.0
    servo.stop()
    assert not probe.forces_n[-1].any()


@pytest.mark.nightly
def test_fault_during_a_bench_has_the_message_of_the_driver():
    with open_device("inverse3-emulated") as device:
        servo = start_driving_servo(device, 4.0)
        servo.advance(10)
        device.hand.set_fault("closes")
        servo.advance(100)
        assert "the Inverse Service closed the connection" in servo.fault
        servo.stop()


def test_force_of_an_excitation_never_exceeds_its_limit():
    with open_device("scripted") as device:
        servo = start_driving_servo(
            device, 2.0, stiffness_npm=5000.0, centre_m=(0.04, 0.04, 0.0), push_n=(0.0, -9.0, 0.0)
        )
        reader = servo.telemetry.reader()
        servo.advance(3000)
        sizes = np.linalg.norm(reader.read().device_force_n, axis=1)
        assert sizes.max() == pytest.approx(2.0, abs=1e-3)
        servo.stop()
        assert device.force_n == (0.0, 0.0, 0.0)


def test_handle_that_is_held_is_reported_and_not_kept(tmp_path, monkeypatch):
    from study_app.devices.bench import procedure

    def never_lets_go(device, _tell):
        device.hold(0.0, 0.0, 0.0)
        device.follow(np.arange(0, 600, 0.1), 0.006 * np.random.default_rng(1).standard_normal((6000, 3)))
        return lambda kind, _words: lambda: {"damping": None, "scale": "no"}.get(kind, "")

    monkeypatch.setattr(procedure, "Durations", lambda: QUICK)
    monkeypatch.setattr(procedure, "ask_simulated_hand", never_lets_go)
    real = replace(descriptor_of("scripted"), kind="felt")
    monkeypatch.setattr("study_app.devices.registry.descriptor_of", lambda _name: real)
    result = liquid_study("devices", "bench", "scripted", "--to", str(tmp_path / "report"))
    assert result.exit_code == 3, result.output
    assert "somebody may have touched the handle" in (tmp_path / "report" / "bench.md").read_text("utf-8")
    assert "The measurements will not be copied into receipts" in result.output
    assert workstation.load_settings().benches == ()


def test_refused_position_does_not_enter_the_noise():
    from study_app.haptics.model.layout import LIMITER_GLITCH, SAMPLE, records

    samples = records(SAMPLE, 1000)
    samples.fresh, samples.time_ns = 1, 1_000_000 * np.arange(1000)
    samples.position_m = 1e-6 * np.random.default_rng(1).standard_normal((1000, 3))
    samples[500].position_m = np.nan
    samples[500].limiters = LIMITER_GLITCH
    assert measurements.noise(samples).position_um == pytest.approx([1.0] * 3, rel=0.1)


def accelerated_samples(ticks, every):
    """Return samples of a handle of 0.2 kg that 0.6 N accelerate by 3 m/s² along y, with a position every few ticks."""
    from study_app.haptics.model.layout import SAMPLE, records

    samples = records(SAMPLE, ticks)
    samples.time_ns = 7_000_000_000 + 1_000_000 * np.arange(ticks)
    samples.fresh = np.arange(ticks) % every == 0
    samples.position_m[:, 1] = 0.01 + 0.5 * 3.0 * (1e-3 * np.arange(ticks)) ** 2
    samples.device_force_n[:, 1] = 0.6
    return samples


@pytest.mark.parametrize(("ticks", "every", "last"), [(301, 20, 300), (310, 20, 300), (330, 33, 297)])
def test_a_segment_is_used_from_its_first_to_its_last_new_position(ticks, every, last):
    grid_s = measurements._prepare_segment(accelerated_samples(ticks, every), 1, 1e-3).grid_s
    assert grid_s == pytest.approx(1e-3 * np.arange(len(grid_s)))
    assert last <= len(grid_s) <= last + 1, "the last point itself depends on the rounding of its time"


def test_a_constant_acceleration_has_the_mass_and_the_speeds_of_its_motion():
    prepared = measurements._prepare_segment(accelerated_samples(301, 1), 1, 1e-3)
    acceleration_mps2, speed_mps, friction, _, constant = prepared.terms.T
    middle_s = prepared.grid_s[40:-40]  # 20 ms on either side to smooth the motion, and 20 to smooth its friction
    assert prepared.force_n(0.0) / acceleration_mps2 == pytest.approx(np.full(len(middle_s), 0.2))
    assert speed_mps == pytest.approx(3.0 * middle_s)
    assert friction == pytest.approx(np.ones(len(middle_s)), abs=1e-9)
    assert set(constant) == {1.0}


def test_a_force_acts_from_half_a_tick_after_it_was_sent_and_later_by_its_delay():
    samples = accelerated_samples(301, 1)
    samples.device_force_n[:, 1] = 5.0 * 1e-3 * np.arange(301)  # 5 N/s
    prepared = measurements._prepare_segment(samples, 1, 1e-3)
    assert prepared.force_n(0.004) == pytest.approx(5.0 * (prepared.grid_s[40:-40] - 0.004 - 0.0005))


def test_gain_is_the_slope_of_readings_over_forces():
    sent_n = (0.0, 1.0, 2.0, 3.0)
    shown_g = [1e3 * (0.1 + 0.8 * it) / measurements.GRAVITY_MPS2 for it in sent_n]
    fit = measurements.gain_of(sent_n, shown_g)
    assert (fit.gain, fit.offset_n, fit.readings) == (pytest.approx(0.8), pytest.approx(0.1), 4)
    assert fit.residual_n < 1e-12


def liquid_study(*words):
    return CliRunner().invoke(commands, words)


def test_the_command_writes_its_report_and_stores_results_of_real_devices_only(tmp_path, monkeypatch):
    monkeypatch.setattr(procedure, "Durations", lambda: QUICK)
    result = liquid_study("devices", "bench", "scripted", "--to", str(tmp_path / "report"))
    assert result.exit_code == 0, result.output
    assert {path.name for path in (tmp_path / "report").iterdir()} == {"bench.md", "bench.json"}
    assert "its measurements will not be copied" in result.output
    assert workstation.load_settings().benches == ()
    real = replace(descriptor_of("scripted"), kind="felt")
    monkeypatch.setattr("study_app.devices.registry.descriptor_of", lambda _name: real)
    monkeypatch.chdir(tmp_path)
    result = liquid_study("devices", "bench", "scripted")
    assert result.exit_code == 0, result.output
    (own,) = workstation.load_settings().benches
    assert own.report == str(tmp_path / "bench-scripted" / "bench.md")
    assert Path(own.report).is_file()


@pytest.mark.parametrize(
    ("words", "reason"),
    [(("mouse",), "device 'mouse' does not produce force"), (("nothing",), "device 'nothing' is not known")],
)
def test_device_without_force_is_refused(words, reason):
    refused = liquid_study("devices", "bench", *words)
    assert isinstance(refused.exception, DeviceError)
    assert str(refused.exception).startswith(reason)
