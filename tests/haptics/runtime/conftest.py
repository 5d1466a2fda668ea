"""A servo on a virtual clock, with a device that tests control."""

import pytest

from study_app.haptics.runtime.clocks import VirtualClock
from study_app.haptics.runtime.servo import Servo
from tests.haptics.recording_device import Probe


@pytest.fixture
def probe():
    return Probe()


@pytest.fixture
def servo(probe):
    return Servo(probe, clock=VirtualClock())
