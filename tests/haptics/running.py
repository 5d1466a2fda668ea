"""Helpers for tests of the servo: waiting for its thread, and its present force."""

import threading
import time

import numpy as np

from study_app.haptics.kernels.safety import begin_scene, new_safety
from study_app.haptics.model.device_dynamics import UNKNOWN
from study_app.haptics.runtime.offline import new_wake_places, recompute_sample
from study_app.haptics.runtime.pack import pack
from tests.haptics.scenes import HONEY


def wait_until(condition, limit_s=30.0):
    """Wait for a condition that another thread fulfils; fail instead of hanging."""
    waiting, end = threading.Event(), time.perf_counter() + limit_s
    while not condition():
        assert time.perf_counter() < end, "waited in vain"
        waiting.wait(0.001)


def force_n(telemetry):
    """Return the size of the force sent last [N]."""
    latest = telemetry.latest()
    return 0.0 if latest is None else np.linalg.norm(latest.device_force_n)


def scene_of(telemetry):
    latest = telemetry.latest()
    return None if latest is None else latest.scene


def is_zero(force):
    return not np.any(force)


def bring_to_force(servo, scene=HONEY):
    """Load a scene and advance the servo until a force acts."""
    servo.load(scene)
    servo.advance(1000)
    assert force_n(servo.telemetry) > 1


def recomputed(samples, scene=HONEY, dynamics=UNKNOWN, *, delivered=True):
    """Recompute the samples of a scene's first presentation; return them with the state of the safety layer."""
    again, safety = samples.copy(), new_safety(8.0)
    begin_scene(safety[0])
    trail, places = new_wake_places(10)
    recompute_sample(pack(scene, dynamics=dynamics), safety[0], again, trail[0], places, delivered)
    return again, safety[0]
