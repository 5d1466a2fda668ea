"""The force that a device sends in place of the command, and the delay that it measures, in the servo's loop."""

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.errors import DeviceError
from study_app.haptics.kernels.loop import FASTER_SAMPLES, SLOWER_SAMPLES
from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.layout import LIMITER_SATURATED, STATUS_DEVICE_LOST
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.haptics.recording_device import Probe
from tests.haptics.running import recomputed
from tests.haptics.scenes import HONEY


def honey_samples(probe, ticks=1000):
    """Return the samples of a servo that presents honey to a moving probe."""
    servo = Servo(probe, clock=VirtualClock())
    servo.load(HONEY)
    reader = servo.telemetry.reader()
    servo.advance(ticks)
    servo.stop()
    return reader.read()


def test_telemetry_and_passivity_observer_take_the_force_that_the_device_sent():
    probe = Probe()
    whole = honey_samples(probe)
    probe = Probe()
    probe.state.share_sent = 0.25
    samples = honey_samples(probe)
    pushed = np.linalg.norm(samples.command_n, axis=1) > 0.1
    assert pushed.sum() > 500
    assert samples.device_force_n[pushed] == pytest.approx(0.25 * samples.command_n[pushed], abs=2.0**-15)
    assert (np.rint(samples.device_force_n * 2**14) == samples.device_force_n * 2**14)[pushed].all()
    assert samples.withheld_n[pushed] == pytest.approx(
        0.75 * np.linalg.norm(samples.command_n[pushed], axis=1), rel=1e-3
    )
    assert not whole.withheld_n[-1]
    assert (whole.command_n == whole.device_force_n).all()


def test_a_tick_is_recomputed_from_the_delivered_force_to_the_last_bit():
    probe = Probe(velocity_mps=(0.3, 0.0, 0.1))
    probe.state.share_sent = 0.5
    samples = honey_samples(probe)
    again, _ = recomputed(samples)
    for name in ("command_n", "device_force_n", "permitted_n", "withheld_n"):
        assert np.array_equal(again[name], samples[name]), name
    unaware, _ = recomputed(samples, delivered=False)
    assert np.array_equal(unaware.command_n, unaware.device_force_n)


def balances(servo):
    passivity = servo.loop.safety[0].passivity
    return np.array([passivity.balance_j, passivity.late_balance_j, passivity.later_balance_j])


def test_the_observer_takes_the_least_favourable_force_of_saturated_motors_and_a_replay_repeats_it():
    """While braking, the motors may have given no force; while pushing the hand, all of it."""
    results = {}
    for name, saturates, share in (("obeyed", 0, 1.0), ("nothing", 0, 0.0), ("saturated", 1, 1.0)):
        probe = Probe(velocity_mps=(0.3, 0.0, 0.1))
        probe.state.saturates, probe.state.share_sent = saturates, share
        servo = Servo(probe, clock=VirtualClock())
        servo.load(HONEY)
        reader = servo.telemetry.reader()
        servo.advance(600)
        braked = balances(servo)
        probe.state.velocity_mps = (-0.3, 0.0, -0.1)
        probe.state.began_ns += 1_200_000_000  # from the same place back
        servo.advance(3)
        results[name] = braked, balances(servo), reader.read(), servo.loop.safety[0].copy()
    assert (results["obeyed"][0] > 1e-5).all()
    assert results["saturated"][0] == pytest.approx(results["nothing"][0], abs=1e-9)
    fallen = {name: it[1] - it[0] for name, it in results.items()}
    assert fallen["saturated"][1] == pytest.approx(fallen["obeyed"][1], abs=1e-6)
    assert fallen["saturated"][1] < -1e-5

    samples, left = results["saturated"][2:]
    assert (samples.limiters & LIMITER_SATURATED != 0).all()
    assert (samples.device_force_n == samples.command_n).all()
    again, safety = recomputed(samples)
    assert (again.limiters == samples.limiters).all()
    assert safety.passivity.late_balance_j == left.passivity.late_balance_j


@pytest.mark.parametrize(("delay_s", "expected"), [(None, 1), (0.0, 0), (0.9e-3, 1), (1e-3, 1), (1.2e-3, 2)])
def test_the_believed_delay_is_the_measured_one_in_whole_ticks(delay_s, expected):
    samples = honey_samples(Probe(dynamics=Dynamics(delay_s)), ticks=2)
    assert samples.delay_ticks.tolist() == [expected, expected]


def test_a_device_too_slow_for_any_stable_force_is_refused():
    with pytest.raises(DeviceError, match="responds 5 ticks late at 1000 Hz"):
        Servo(Probe(dynamics=Dynamics(4.2e-3)), clock=VirtualClock())


def test_a_delay_that_grows_is_followed_tick_by_tick_and_one_that_shrinks_slowly():
    probe = Probe(dynamics=UNKNOWN)
    servo = Servo(probe, clock=VirtualClock())
    servo.load(HONEY)
    reader = servo.telemetry.reader()
    probe.state.delay_ticks = 3
    servo.advance(10)
    expected = [1] * (SLOWER_SAMPLES - 1) + [2] * SLOWER_SAMPLES + [3] * (11 - 2 * SLOWER_SAMPLES)
    assert reader.read().delay_ticks.tolist() == expected
    probe.state.delay_ticks = 1
    servo.advance(2 * FASTER_SAMPLES + 1)
    followed = reader.read().delay_ticks
    assert followed[: FASTER_SAMPLES - 1].tolist() == [3] * (FASTER_SAMPLES - 1)
    assert followed[-1] == 1


def test_a_delay_beyond_any_stable_loop_fades_the_force_out():
    probe = Probe()
    servo = Servo(probe, clock=VirtualClock())
    servo.load(HONEY)
    servo.advance(1000)
    probe.state.delay_ticks = 5
    reader = servo.telemetry.reader()
    servo.advance(100)
    samples = reader.read()
    assert not samples.fresh.any()
    assert not samples.device_force_n[-1].any()
    assert "sent no usable data" in servo.fault


@pytest.mark.parametrize(("lost", "reads"), [("lost_at_read", 500), ("lost_at_write", 500)])
def test_the_tick_of_a_lost_device_is_recomputed(lost, reads):
    probe = Probe(velocity_mps=(0.3, 0.0, 0.1))
    probe.state.share_sent, probe.state.held_when_lost_n = 0.5, 2.0
    probe.state[lost] = reads
    samples = honey_samples(probe)
    assert samples.status[-1] == STATUS_DEVICE_LOST
    again, _ = recomputed(samples)
    assert np.array_equal(again.device_force_n, samples.device_force_n)
    assert np.array_equal(again.command_n, samples.command_n)
    if lost == "lost_at_read":
        assert samples.device_force_n[-1].tolist() == [2.0, 0.0, 0.0]
