"""Measured values of a device besides position: the servo records them and uses the velocity for the estimate."""

import numba
import numpy as np
import pytest

if numba.config.DISABLE_JIT:
    pytest.skip("the servo exists compiled only", allow_module_level=True)

from study_app.haptics.model.device_dynamics import UNKNOWN, Dynamics
from study_app.haptics.model.layout import (
    LIMITER_GLITCH,
    MEASURED_GRIPPER,
    MEASURED_ORIENTATION,
    MEASURED_TIME,
    MEASURED_VELOCITY,
)
from study_app.haptics.model.scene import Knee
from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.haptics.recording_device import Probe
from tests.haptics.running import recomputed
from tests.haptics.scenes import HONEY

LAG_S = 2e-3
MEASURING = Dynamics(velocity_lag_s=LAG_S)
SCENE = HONEY.model_copy(update={"knee": Knee(law="none")})


def samples_of(probe, ticks=500):
    """Return the samples of a servo that presents honey to a probe, and the servo."""
    servo = Servo(probe, clock=VirtualClock())
    servo.load(SCENE)
    reader = servo.telemetry.reader()
    servo.advance(ticks)
    servo.stop()
    return reader.read(), servo


def measuring_probe(velocity_mps=(0.1, 0.2, -0.3), dynamics=MEASURING):
    """Return a probe that reports a velocity other than that of its positions."""
    probe = Probe(velocity_mps=(0.2, 0.0, 0.0), dynamics=dynamics)
    probe.state.measured = MEASURED_VELOCITY
    probe.state.measured_mps = velocity_mps
    return probe


def test_measured_velocity_is_used_in_place_of_the_estimator():
    samples, servo = samples_of(measuring_probe())
    assert samples.velocity_mps == pytest.approx(np.tile(SCENE.scale * np.array([0.1, 0.2, -0.3]), (500, 1)))
    assert samples.device_velocity_mps[-1].tolist() == [0.1, 0.2, -0.3]
    assert servo.describe()["estimator"] == "device"
    force = samples.device_force_n[-1]
    assert force @ [0.1, 0.2, -0.3] == pytest.approx(-np.linalg.norm(force) * np.linalg.norm([0.1, 0.2, -0.3]))


@pytest.mark.parametrize("dynamics", [UNKNOWN, Dynamics(velocity_lag_s=8e-3)], ids=["undeclared", "too late"])
def test_velocity_that_is_not_declared_or_lags_too_much_is_recorded_and_not_used(dynamics):
    samples, servo = samples_of(measuring_probe(dynamics=dynamics))
    assert samples.velocity_mps[-1] == pytest.approx([SCENE.scale * 0.2, 0.0, 0.0])
    assert samples.device_velocity_mps[-1].tolist() == [0.1, 0.2, -0.3]
    assert servo.describe()["estimator"] == "scene"


@pytest.mark.parametrize(
    ("measured", "velocity_mps"),
    [(0, (0.1, 0.0, 0.0)), (MEASURED_VELOCITY, (np.nan, 0.0, 0.0)), (MEASURED_VELOCITY, (0.0, -11.0, 0.0))],
    ids=["missing", "NaN", "impossible"],
)
def test_sample_without_a_believable_velocity_is_refused_and_the_force_ends(measured, velocity_mps):
    probe = measuring_probe()
    servo = Servo(probe, clock=VirtualClock())
    servo.load(SCENE)
    servo.advance(500)
    assert probe.forces_n[-1].any()
    probe.state.measured, probe.state.measured_mps = measured, velocity_mps
    reader = servo.telemetry.reader()
    servo.advance(100)
    samples = reader.read()
    assert (samples.limiters & LIMITER_GLITCH).all()
    assert not probe.forces_n[-1].any()
    assert "sent no usable data" in servo.fault


def test_unmeasured_values_are_zero_whatever_the_record_holds():
    probe = Probe()
    probe.state.measured_mps, probe.state.orientation, probe.state.gripper_m = 0.1, 0.5, 0.02
    probe.state.clock_ahead_ns = 7
    (bare, *_), _ = samples_of(probe, 3)
    assert (bare.measured, bare.gripper_m, bare.device_time_ns) == (0, 0.0, 0)
    assert not bare.device_velocity_mps.any()
    assert not bare.orientation.any()
    probe.state.measured = MEASURED_ORIENTATION | MEASURED_GRIPPER | MEASURED_TIME
    samples, _ = samples_of(probe, 3)
    assert samples.orientation.tolist() == [[0.5] * 4] * 3
    assert (samples.gripper_m == 0.02).all()
    assert (samples.device_time_ns - samples.time_ns == 7).all()
    assert not samples.device_velocity_mps.any()


def test_tick_with_a_measured_velocity_is_recomputed_to_the_last_bit():
    samples, _ = samples_of(measuring_probe())
    again, _ = recomputed(samples, SCENE, MEASURING)
    for name in ("velocity_mps", "force_n", "command_n", "device_force_n", "limiters"):
        assert np.array_equal(again[name], samples[name]), name
