"""What tests of the servo share: waiting for its thread, and what it presents now."""

import threading
import time

import numpy as np

from tests.haptics.scenes import HONEY


def wait_until(condition, limit_s=30.0):
    """Wait for another thread; a test that needs it fails rather than hangs."""
    waiting, end = threading.Event(), time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end, "waited in vain"
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


# the force ends


def felt(servo, scene=HONEY):
    """Bring the servo to where a force is felt."""
    servo.load(scene)
    servo.advance(1000)
    assert force_n(servo.telemetry) > 1
